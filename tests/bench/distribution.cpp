/* Rows per rank and messages of a projection, from the rank of each node and the entries of C */
#include "distribution.h"
#include <algorithm>
#include <array>
#include <numeric>

typedef std::vector<PetscInt> Counts; /* by rank */

/* One number on its way: the rank that wants it, the rank that has it, and which it is */
typedef std::array<PetscInt, 3> Want;
typedef std::vector<Want>       Wants;

static RowCount Summary(const Counts &rows)
{
  RowCount answer = {0, PETSC_MAX_INT, 0};

  for (PetscInt n : rows) {
    if (!n) continue;
    answer.ranks++;
    answer.least = PetscMin(answer.least, n);
    answer.most  = PetscMax(answer.most, n);
  }
  if (!answer.ranks) answer.least = 0;
  return answer;
}

static void AddWant(Wants &wants, PetscInt to, PetscInt from, PetscInt what)
{
  if (to != from) wants.push_back({to, from, what});
}

/* There and back: what is wanted in one direction is answered by as much in the other. A rank sends all that another wants at once. */
static void AddExchange(Wants &wants, Counts &messages, Exchange *exchange)
{
  std::sort(wants.begin(), wants.end());
  wants.erase(std::unique(wants.begin(), wants.end()), wants.end());
  exchange->scalars += 2 * (PetscInt)wants.size();
  for (size_t i = 0; i < wants.size(); i++) {
    if (i && wants[i][0] == wants[i - 1][0] && wants[i][1] == wants[i - 1][1]) continue;
    exchange->messages += 2;
    messages[wants[i][0]] += 2;
    messages[wants[i][1]] += 2;
  }
}

/* The ranks that solve with S: those with most rows of C, so that as little as possible has to move */
static std::vector<PetscInt> ChooseGroup(const Counts &rows, PetscInt size)
{
  std::vector<PetscInt> ranks(rows.size());

  std::iota(ranks.begin(), ranks.end(), 0);
  std::stable_sort(ranks.begin(), ranks.end(), [&rows](PetscInt a, PetscInt b) { return rows[a] > rows[b]; });
  ranks.resize(PetscMin((size_t)size, ranks.size()));
  return ranks;
}

PetscErrorCode DistributionCount(const CubesMesh &mesh, PetscMPIInt parts, Mat C, PetscInt rowsPerRank, Distribution *d)
{
  Counts                rowsA(parts, 0), rowsC(parts, 0), rowsGrouped(parts, 0), spread(parts, 0), together(parts, 0);
  std::vector<PetscInt> home, group; /* rank of each row of C; the ranks that solve with S */
  Wants                 ghosts, gathered, constrained;
  PetscInt              m, members;

  PetscFunctionBeginUser;
  *d = Distribution();
  PetscCall(MatGetSize(C, &m, NULL));
  for (PetscInt node = 0; node < mesh.nodes; node++) rowsA[mesh.Rank(node)] += 3;
  for (PetscInt row = 0; row < m; row++) {
    const PetscInt *columns;
    PetscInt        n, secondary = -1;

    PetscCall(MatGetRow(C, row, &n, &columns, NULL));
    for (PetscInt c = 0; c < n; c++) {
      if (mesh.Body(columns[c] / 3) == 1) secondary = columns[c] / 3; /* of all nodes of a row, one */
    }
    home.push_back(mesh.Rank(secondary));
    rowsC[home[row]]++;
    for (PetscInt c = 0; c < n; c++) AddWant(ghosts, home[row], mesh.Rank(columns[c] / 3), columns[c]);
    PetscCall(MatRestoreRow(C, row, &n, &columns, NULL));
  }
  group   = ChooseGroup(rowsC, m / rowsPerRank + (m % rowsPerRank ? 1 : 0));
  members = (PetscInt)group.size();
  for (PetscInt row = 0; row < m; row++) {
    const PetscInt  solver = group[(PetscInt)((PetscInt64)row * members / m)]; /* even shares */
    const PetscInt *columns;
    PetscInt        n;

    rowsGrouped[solver]++;
    AddWant(gathered, solver, home[row], row);
    PetscCall(MatGetRow(C, row, &n, &columns, NULL));
    for (PetscInt c = 0; c < n; c++) AddWant(constrained, solver, mesh.Rank(columns[c] / 3), columns[c]);
    PetscCall(MatRestoreRow(C, row, &n, &columns, NULL));
  }
  d->A       = Summary(rowsA);
  d->C       = Summary(rowsC);
  d->grouped = Summary(rowsGrouped);
  AddExchange(ghosts, spread, &d->spread);
  AddExchange(gathered, spread, &d->spread);
  AddExchange(constrained, together, &d->together);
  d->spread.busiest   = *std::max_element(spread.begin(), spread.end());
  d->together.busiest = *std::max_element(together.begin(), together.end());
  PetscFunctionReturn(PETSC_SUCCESS);
}
