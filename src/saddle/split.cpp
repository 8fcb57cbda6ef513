/*
   Splits an AIJ matrix whose fields are sorted and local into blocks in one pass, without symbolic work except for
   columns of other ranks
*/
#include "split.h"
#include "../base/lists.h"
#include "../base/objects.h"

/* Numbers of field 1 in maps: -1, -2, ... for 0, 1, ... */
static inline PetscInt Flip(PetscInt number)
{
  return -1 - number;
}

/*
   Maps each local row to its number in its field; *splits becomes false if a set is not sorted or not local, or if the
   sets do not cover each row once
*/
static PetscErrorCode AddSets(const AinsworthRef<IS> sets[2], PetscInt first, std::vector<PetscInt> *map, bool *splits)
{
  std::vector<char> seen(map->size(), 0);

  PetscFunctionBegin;
  for (int f = 0; f < 2; f++) {
    const PetscInt *index;
    PetscInt        n;

    PetscCall(ISGetLocalSize(sets[f], &n));
    PetscCall(ISGetIndices(sets[f], &index));
    for (PetscInt k = 0; k < n && *splits; k++) {
      const PetscInt row = index[k] - first;

      *splits = row >= 0 && row < (PetscInt)map->size() && !seen[row] && (k == 0 || index[k] > index[k - 1]);
      if (!*splits) break;
      seen[row]   = 1;
      (*map)[row] = f ? Flip(k) : k;
    }
    PetscCall(ISRestoreIndices(sets[f], &index));
  }
  for (char s : seen) *splits = *splits && s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fetches the global numbers of the columns of other ranks from their owners. Collective */
static PetscErrorCode MapGhosts(Mat aij, const PetscInt first[2], const PetscInt *ghosts, AinsworthSplit *split)
{
  std::vector<PetscInt> numbers(split->cols[0]);
  PetscLayout           layout;

  PetscFunctionBegin;
  for (PetscInt &number : numbers) number = number < 0 ? number - first[1] : number + first[0];
  PetscCall(MatGetLayouts(aij, NULL, &layout));
  PetscCall(AinsworthFetch(PetscObjectComm((PetscObject)aij), layout, numbers, (PetscInt)split->cols[1].size(), ghosts,
                           &split->cols[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSplitCreate - plans where the entries of an AIJ matrix go; NULL if the index sets do not allow it.
   Collective
*/
PetscErrorCode AinsworthSplitCreate(Mat aij, const AinsworthRef<IS> rows[2], const AinsworthRef<IS> cols[2],
                                    std::shared_ptr<const AinsworthSplit> *split)
{
  auto            plan = std::make_shared<AinsworthSplit>();
  Mat             part[2];
  const PetscInt *ghosts;
  PetscInt        m, n, nghosts, first[2];
  bool            splits = true;
  PetscBool       all;

  PetscFunctionBegin;
  split->reset();
  PetscCall(MatGetLocalSize(aij, &m, &n));
  PetscCall(AinsworthAIJGetParts(aij, part, &ghosts, &nghosts));
  plan->rows.resize(m);
  plan->cols[0].resize(n);
  plan->cols[1].resize(nghosts);
  PetscCall(MatGetOwnershipRange(aij, &first[0], NULL));
  PetscCall(MatGetOwnershipRangeColumn(aij, &first[1], NULL));
  PetscCall(AddSets(rows, first[0], &plan->rows, &splits));
  PetscCall(AddSets(cols, first[1], &plan->cols[0], &splits));
  all = (PetscBool)splits;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &all, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)aij)));
  if (!all) PetscFunctionReturn(PETSC_SUCCESS);
  for (int f = 0; f < 2; f++) {
    PetscCall(ISGetLocalSize(cols[f], &plan->size[f]));
    first[f] = 0;
    PetscCallMPI(MPI_Exscan(&plan->size[f], &first[f], 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)aij)));
  }
  if (part[1]) PetscCall(MapGhosts(aij, first, ghosts, plan.get()));
  *split = plan;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls visit(block, column, value) for each entry of a part, row by row */
template <typename Visit>
static inline void ForEntries(const AinsworthCSR &part, const std::vector<PetscInt> &rows,
                              const std::vector<PetscInt> &cols, Visit visit)
{
  for (PetscInt r = 0; r < part.n; r++) {
    const int row = rows[r] < 0 ? 2 : 0; /* first block of the row: A or C */

    for (PetscInt k = part.ia[r]; k < part.ia[r + 1]; k++) {
      const PetscInt c = cols[part.ja[k]];

      if (c >= 0) visit(row, c, part.a[k]);
      else visit(row + 1, Flip(c), part.a[k]);
    }
  }
}

/* Fills rows of A and B, or of C and D, in one pass; nearly all of their entries are in A or in C */
static void FillRows(const AinsworthCSR &part, const AinsworthSplit *split, int which, bool multipliers,
                     AinsworthRows *rows, AinsworthRows *rest)
{
  const PetscInt  *map   = split->cols[which].data();
  PetscInt         bound = 0, n = 0;
  AinsworthEntries few; /* of B or D, respectively */

  for (PetscInt r = 0; r < part.n; r++)
    if ((split->rows[r] < 0) == multipliers) bound += part.ia[r + 1] - part.ia[r];
  rows->reserve(bound);
  PetscInt    *j = rows->j.get();
  PetscScalar *a = rows->a.get();

  for (PetscInt r = 0; r < (PetscInt)split->rows.size(); r++) {
    if ((split->rows[r] < 0) != multipliers) continue;
    for (PetscInt k = part.mat ? part.ia[r] : 0, end = part.mat ? part.ia[r + 1] : 0; k < end; k++) {
      const PetscInt c = map[part.ja[k]];

      if (c >= 0) {
        j[n]   = c;
        a[n++] = part.a[k];
      } else few.add(Flip(c), part.a[k]);
    }
    rows->i.push_back(n);
    few.endRow();
  }
  rest->reserve((PetscInt)few.columns.size());
  std::copy(few.columns.begin(), few.columns.end(), rest->j.get());
  std::copy(few.values.begin(), few.values.end(), rest->a.get());
  rest->i = std::move(few.start);
}

/* AinsworthSplitFill - creates the blocks A, B, C, D, or A alone. Collective */
PetscErrorCode AinsworthSplitFill(Mat aij, const AinsworthSplit *split, int wanted, AinsworthRef<Mat> block[])
{
  Mat                            mat[2];
  const PetscInt                *ghosts;
  PetscInt                       nghosts;
  std::unique_ptr<AinsworthRows> rows[2][4];

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(aij, mat, &ghosts, &nghosts));
  for (int p = 0; p < 2; p++) {
    AinsworthCSR part;

    PetscCall(part.open(mat[p]));
    for (auto &r : rows[p]) r.reset(new AinsworthRows);
    for (int k = 0; k < wanted; k += 2) FillRows(part, split, p, k > 0, rows[p][k].get(), rows[p][k + 1].get());
    PetscCall(part.close());
  }
  for (int k = 0; k < wanted; k++)
    PetscCall(AinsworthMatCreateFromRows(PetscObjectComm((PetscObject)aij), split->size[k % 2], std::move(rows[0][k]),
                                         std::move(rows[1][k]), block[k].out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSplitRefill - updates blocks that were filled from a matrix of the same pattern. Collective

   The state of a block whose values have not changed stays the same, so that nothing that depends on it is recomputed.
*/
PetscErrorCode AinsworthSplitRefill(Mat aij, const AinsworthSplit *split, int wanted, AinsworthRef<Mat> block[])
{
  Mat             mat[2], parts[4][2];
  const PetscInt *ghosts;
  PetscInt        nghosts, changed[4] = {0, 0, 0, 0};
  AinsworthCSR    part[2];

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(aij, mat, &ghosts, &nghosts));
  for (int k = 0; k < wanted; k++) PetscCall(AinsworthAIJGetParts(block[k], parts[k], &ghosts, &nghosts));
  for (int p = 0; p < 2; p++) {
    const PetscScalar *start[4] = {NULL}, *a[4] = {NULL};

    PetscCall(part[p].open(mat[p]));
    for (int k = 0; k < wanted && mat[p]; k++) PetscCall(MatSeqAIJGetArrayRead(parts[k][p], &start[k]));
    for (int k = 0; k < 4; k++) a[k] = start[k];
    auto compare = [&](int k, PetscInt, PetscScalar v) {
      if (k < wanted && !changed[k] && *a[k]++ != v) changed[k] = 1;
    };
    ForEntries(part[p], split->rows, split->cols[p], compare);
    for (int k = 0; k < wanted && mat[p]; k++) PetscCall(MatSeqAIJRestoreArrayRead(parts[k][p], &start[k]));
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, changed, 4, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)aij)));
  for (int p = 0; p < 2; p++) {
    PetscScalar *start[4] = {NULL}, *a[4] = {NULL};

    for (int k = 0; k < wanted && mat[p]; k++)
      if (changed[k]) PetscCall(MatSeqAIJGetArrayWrite(parts[k][p], &start[k]));
    for (int k = 0; k < 4; k++) a[k] = start[k];
    auto fill = [&](int k, PetscInt, PetscScalar v) {
      if (changed[k]) *a[k]++ = v;
    };
    if (changed[0] || changed[1] || changed[2] || changed[3]) ForEntries(part[p], split->rows, split->cols[p], fill);
    for (int k = 0; k < wanted && mat[p]; k++)
      if (changed[k]) PetscCall(MatSeqAIJRestoreArrayWrite(parts[k][p], &start[k]));
    PetscCall(part[p].close());
  }
  for (int k = 0; k < wanted; k++)
    if (changed[k]) PetscCall(AinsworthStateIncrease((PetscObject)block[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
