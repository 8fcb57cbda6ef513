#include "placement.h"
#include "graph.h"
#include "../base/csr.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/arrays.h"
#include <petscsf.h>
#include <map>
#include <numeric>

namespace
{
/* The local rows of S, labeled by the smallest row of their component */
class Labels {
public:
  PetscErrorCode        create(Mat S);
  Mat                   S      = NULL;
  PetscInt              rstart = 0, n = 0;
  std::vector<PetscInt> label;
  /* from the owner of the first row of each component to the ranks that have rows of it */
  PetscSF               roots = NULL;
  std::vector<PetscInt> distinct; /* labels on this rank, ascending; the leaves of `roots` */
  std::vector<PetscInt> leaf;     /* of each local row */

private:
  PetscErrorCode findWithin(Mat inside);
  PetscErrorCode spread(Mat outside, const PetscInt ghosts[]);
};

/* Labels the components within the rank */
PetscErrorCode Labels::findWithin(Mat inside)
{
  AinsworthCSR rows;

  PetscFunctionBegin;
  PetscCall(rows.open(inside));
  AinsworthGraphComponents(rows, &label);
  for (PetscInt &l : label) l += rstart;
  PetscCall(rows.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Merges components across ranks: the smallest label wins, until no rank changes any */
PetscErrorCode Labels::spread(Mat outside, const PetscInt ghosts[])
{
  MPI_Comm              comm = PetscObjectComm((PetscObject)S);
  AinsworthCSR          rows;
  PetscInt              nghosts;
  PetscMPIInt           changed = 1;
  PetscLayout           layout;
  PetscSF               sf;
  std::vector<PetscInt> ghost, best, start(label);

  PetscFunctionBegin;
  PetscCall(MatGetSize(outside, NULL, &nghosts));
  ghost.resize(nghosts);
  PetscCall(MatGetLayouts(S, NULL, &layout));
  PetscCall(PetscSFCreate(comm, &sf));
  PetscCall(PetscSFSetGraphLayout(sf, layout, nghosts, NULL, PETSC_USE_POINTER, ghosts));
  PetscCall(rows.open(outside));
  while (changed) {
    PetscCall(PetscSFBcastBegin(sf, MPIU_INT, label.data(), ghost.data(), MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(sf, MPIU_INT, label.data(), ghost.data(), MPI_REPLACE));
    changed = 0;
    best    = label;
    for (PetscInt i = 0; i < n; i++) { /* start[i] is the first local row of the part of the component on this rank */
      PetscInt &of = best[start[i] - rstart];
      for (PetscInt k = rows.ia[i]; k < rows.ia[i + 1]; k++) of = PetscMin(of, ghost[rows.ja[k]]);
    }
    for (PetscInt i = 0; i < n; i++) {
      if (best[start[i] - rstart] == label[i]) continue;
      label[i] = best[start[i] - rstart];
      changed  = 1;
    }
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, comm));
  }
  PetscCall(rows.close());
  PetscCall(PetscSFDestroy(&sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Labels::create(Mat matrix)
{
  Mat             part[2];
  const PetscInt *ghosts;
  PetscInt        nghosts;
  PetscLayout     layout;

  PetscFunctionBegin;
  S = matrix;
  PetscCall(MatGetOwnershipRange(S, &rstart, NULL));
  PetscCall(MatGetLocalSize(S, &n, NULL));
  PetscCall(AinsworthAIJGetParts(S, part, &ghosts, &nghosts));
  PetscCall(findWithin(part[0]));
  if (part[1]) PetscCall(spread(part[1], ghosts));
  distinct = label;
  AinsworthSortUnique(&distinct);
  leaf.reserve(n);
  for (PetscInt l : label) leaf.push_back(std::lower_bound(distinct.begin(), distinct.end(), l) - distinct.begin());
  PetscCall(MatGetLayouts(S, &layout, NULL));
  PetscCall(PetscSFCreate(PetscObjectComm((PetscObject)S), &roots));
  PetscCall(PetscSFSetGraphLayout(roots, layout, (PetscInt)distinct.size(), NULL, PETSC_USE_POINTER, distinct.data()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A component, as known to the owner of its first row */
struct Component {
  PetscInt first = 0, size = 0, work = 0;
};

/*
   Computes the size and the work of each component whose first row this rank owns; the size is 0 at rows that begin no
   component
*/
PetscErrorCode Measure(const Labels &labels, std::vector<PetscInt> &size, std::vector<PetscInt> &work)
{
  std::vector<PetscInt> rows(labels.distinct.size(), 0), nonzeros(labels.distinct.size(), 0);

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(labels.S, [&](const AinsworthMatRow &row) {
    const PetscInt d = labels.leaf[row.local];

    rows[d]++;
    nonzeros[d] += row.n;
  }));
  size.assign(labels.n, 0);
  work.assign(labels.n, 0);
  PetscCall(PetscSFReduceBegin(labels.roots, MPIU_INT, rows.data(), size.data(), MPI_SUM));
  PetscCall(PetscSFReduceEnd(labels.roots, MPIU_INT, rows.data(), size.data(), MPI_SUM));
  PetscCall(PetscSFReduceBegin(labels.roots, MPIU_INT, nonzeros.data(), work.data(), MPI_SUM));
  PetscCall(PetscSFReduceEnd(labels.roots, MPIU_INT, nonzeros.data(), work.data(), MPI_SUM));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers the components of more than `small` rows; the same list on every rank. Collective */
PetscErrorCode GatherLarge(const Labels &labels, PetscInt small, const std::vector<PetscInt> &size,
                           const std::vector<PetscInt> &work, std::vector<Component> &large)
{
  std::vector<PetscInt> mine, all;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < labels.n; i++)
    if (size[i] > small) mine.insert(mine.end(), {labels.rstart + i, size[i], work[i]});
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)labels.S), mine, &all));
  for (size_t k = 0; k < all.size(); k += 3) large.push_back({all[k], all[k + 1], all[k + 2]});
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses up to `count` ranks with the most rows of S, ascending, because rows they own need not be moved */
PetscErrorCode ChooseRanks(Mat S, PetscInt count, std::vector<PetscMPIInt> &chosen)
{
  const PetscInt *ranges;
  PetscMPIInt     size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)S), &size));
  PetscCall(MatGetOwnershipRanges(S, &ranges));
  chosen.resize(size);
  std::iota(chosen.begin(), chosen.end(), 0);
  std::stable_sort(chosen.begin(), chosen.end(), [ranges](PetscMPIInt a, PetscMPIInt b) {
    return ranges[a + 1] - ranges[a] > ranges[b + 1] - ranges[b];
  });
  while (chosen.size() > 1 && ranges[chosen.back() + 1] == ranges[chosen.back()]) chosen.pop_back();
  if (chosen.size() > (size_t)count) chosen.resize(count);
  std::sort(chosen.begin(), chosen.end());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Assigns whole components to ranks: those with the most work first, each to the rank with the least load (Graham's
   rule)
*/
std::map<PetscInt, PetscInt> Pack(std::vector<Component> components, const std::vector<PetscMPIInt> &ranks)
{
  std::vector<PetscInt64>      load(ranks.size(), 0);
  std::map<PetscInt, PetscInt> rank;

  std::stable_sort(components.begin(), components.end(),
                   [](const Component &a, const Component &b) { return a.work > b.work; });
  for (const Component &component : components) {
    const size_t least = std::min_element(load.begin(), load.end()) - load.begin();
    load[least] += component.work;
    rank[component.first] = ranks[least];
  }
  return rank;
}

/*
   Finds the target rank of each local row if the ranks share S, rows in their order and with equal work: MUMPS chooses
   itself which rank factors what. Collective
*/
PetscErrorCode TargetsOfShares(Mat S, const std::vector<PetscMPIInt> &ranks, std::vector<PetscInt> &target)
{
  MPI_Comm   comm   = PetscObjectComm((PetscObject)S);
  PetscInt64 before = 0, mine = 0, all;

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(S, [&](const AinsworthMatRow &row) { mine += row.n; }));
  PetscCallMPI(MPI_Scan(&mine, &before, 1, MPIU_INT64, MPI_SUM, comm));
  before -= mine;
  PetscCall(MPIU_Allreduce(&mine, &all, 1, MPIU_INT64, MPI_SUM, comm));
  PetscCall(AinsworthForRows(S, [&](const AinsworthMatRow &row) {
    /* the work in the middle of the row, which is below all, be the row empty */
    const double part = ((double)before + 0.5 * (double)row.n) / ((double)all + 1.0);

    target.push_back(ranks[(size_t)(part * (double)ranks.size())]);
    before += row.n;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the rank that owns most of the unknowns of a row of C; this rank if the row is empty and only D couples it */
PetscErrorCode FindHome(Mat C, PetscInt row, PetscInt *home)
{
  PetscInt        ncols, most = 0, count = 0;
  const PetscInt *cols;
  PetscMPIInt     owner, previous = -1;
  PetscLayout     layout;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)C), &owner));
  *home = owner;
  PetscCall(MatGetLayouts(C, NULL, &layout));
  PetscCall(MatGetRow(C, row, &ncols, &cols, NULL));
  for (PetscInt k = 0; k < ncols; k++) { /* columns are ascending, so those of one owner are consecutive */
    PetscCall(PetscLayoutFindOwner(layout, cols[k], &owner));
    count    = owner == previous ? count + 1 : 1;
    previous = owner;
    if (count > most) {
      most  = count;
      *home = owner;
    }
  }
  PetscCall(MatRestoreRow(C, row, &ncols, &cols, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds the target rank of each local row if components stay whole; small components go to the rank with most unknowns
   of their first row
*/
PetscErrorCode TargetsOfComponents(Mat C, const Labels &labels, const std::vector<PetscInt> &size,
                                   const std::map<PetscInt, PetscInt> &large, std::vector<PetscInt> &target)
{
  std::vector<PetscInt> atRoot(labels.n, -1), atLeaf(labels.distinct.size());

  PetscFunctionBegin;
  for (PetscInt i = 0; i < labels.n; i++) {
    if (!size[i]) continue;
    const auto found = large.find(labels.rstart + i);
    if (found == large.end()) PetscCall(FindHome(C, labels.rstart + i, &atRoot[i]));
    else atRoot[i] = found->second;
  }
  PetscCall(PetscSFBcastBegin(labels.roots, MPIU_INT, atRoot.data(), atLeaf.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(labels.roots, MPIU_INT, atRoot.data(), atLeaf.data(), MPI_REPLACE));
  target.resize(labels.n);
  for (PetscInt i = 0; i < labels.n; i++) target[i] = atLeaf[labels.leaf[i]];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collects the rows sent to this rank, component by component, each ascending */
PetscErrorCode Collect(const Labels &labels, const std::vector<PetscInt> &target, AinsworthPlacement *placement)
{
  MPI_Comm                                   comm = PetscObjectComm((PetscObject)labels.S);
  IS                                         to, rows;
  PetscInt                                   n, *sorted;
  PetscLayout                                layout;
  std::vector<PetscInt>                      r, component;
  std::vector<std::pair<PetscInt, PetscInt>> order;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(comm, labels.n, target.data(), PETSC_USE_POINTER, &to));
  PetscCall(ISBuildTwoSided(to, NULL, &rows));
  PetscCall(ISDestroy(&to));
  PetscCall(AinsworthISToList(rows, &r));
  PetscCall(ISDestroy(&rows));
  n = (PetscInt)r.size();
  PetscCall(MatGetLayouts(labels.S, &layout, NULL));
  PetscCall(AinsworthFetch(comm, layout, labels.label, n, r.data(), &component));
  for (PetscInt i = 0; i < n; i++) order.emplace_back(component[i], r[i]);
  std::sort(order.begin(), order.end());
  PetscCall(PetscMalloc1(n, &sorted));
  for (PetscInt i = 0; i < n; i++) {
    sorted[i] = order[i].second;
    if (!i || order[i].first != order[i - 1].first) placement->sizes.push_back(0);
    placement->sizes.back()++;
  }
  PetscCall(ISCreateGeneral(comm, n, sorted, PETSC_OWN_POINTER, &placement->rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

/*
   AinsworthPlacementFindLarge - checks whether the rows of any rank alone have a component of more than `small` rows,
   with one reduction; a large one that no rank has much of is not found. Collective
*/
PetscErrorCode AinsworthPlacementFindLarge(Mat S, PetscInt small, PetscBool *found)
{
  AinsworthCSR          rows;
  Mat                   part[2];
  const PetscInt       *ghosts;
  PetscInt              nghosts;
  std::vector<PetscInt> label, size;

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(S, part, &ghosts, &nghosts));
  PetscCall(rows.open(part[0]));
  AinsworthGraphComponents(rows, &label);
  PetscCall(rows.close());
  size.assign(label.size(), 0);
  *found = PETSC_FALSE;
  for (PetscInt l : label)
    if (++size[l] > small) *found = PETSC_TRUE;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, found, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)S)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Ranks share a component if it has more than this many times rowsPerRank rows, because solves that they share take
   several times as long (docs/gram.csv)

   Only MUMPS does that; without it components stay whole.
*/
static const PetscReal sharedAbove = 16.0;

/*
   AinsworthPlacementCreate - decides which rank solves for which row of S. Collective

   Components of up to `small` rows go to the rank that owns their unknowns. Larger ones go to ceil(rows / rowsPerRank)
   ranks: whole and with equal work or, if one has more than sharedAbove times rowsPerRank rows, all ranks share S.
*/
PetscErrorCode AinsworthPlacementCreate(Mat S, Mat C, PetscInt rowsPerRank, PetscInt small,
                                        AinsworthPlacement *placement)
{
  MPI_Comm                 comm = PetscObjectComm((PetscObject)S);
  Labels                   labels;
  PetscMPIInt              ranks;
  PetscInt                 m, rows = 0, largest = 0, counts[2] = {0, 0};
  std::vector<PetscInt>    size, work, target;
  std::vector<Component>   large;
  std::vector<PetscMPIInt> chosen;

  PetscFunctionBegin;
  PetscCall(AinsworthPlacementReset(placement));
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  PetscCall(MatGetSize(S, &m, NULL));
  PetscCall(labels.create(S));
  PetscCall(Measure(labels, size, work));
  for (PetscInt s : size) {
    counts[0] += s > 0;
    largest = PetscMax(largest, s);
  }
  PetscCall(MPIU_Allreduce(&largest, &placement->largest, 1, MPIU_INT, MPI_MAX, comm));
  placement->small = small = PetscMin(small, rowsPerRank);
  PetscCall(GatherLarge(labels, small, size, work, large));
  for (const Component &component : large) rows += component.size;
  placement->split = PetscDefined(HAVE_MUMPS) && ranks > 1 &&
                     (PetscReal)placement->largest > sharedAbove * (PetscReal)rowsPerRank;
  PetscCall(ChooseRanks(S, 1 + ((placement->split ? m : PetscMax(rows, 1)) - 1) / rowsPerRank, chosen));
  if (chosen.size() == 1) placement->split = false;
  if (ranks == 1) target.assign(labels.n, 0);
  else if (placement->split) PetscCall(TargetsOfShares(S, chosen, target));
  else PetscCall(TargetsOfComponents(C, labels, size, Pack(large, chosen), target));
  PetscCall(Collect(labels, target, placement));
  PetscCall(PetscSFDestroy(&labels.roots));
  counts[1] = placement->sizes.size() > 0;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, counts, 2, MPIU_INT, MPI_SUM, comm));
  placement->components = counts[0];
  placement->ranks      = counts[1];
  /* no blocks that need contiguous rows */
  if (ranks == 1 && (placement->largest > small || placement->largest == 1)) PetscCall(ISDestroy(&placement->rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPlacementReset(AinsworthPlacement *placement)
{
  PetscFunctionBegin;
  PetscCall(ISDestroy(&placement->rows));
  *placement = AinsworthPlacement();
  PetscFunctionReturn(PETSC_SUCCESS);
}
