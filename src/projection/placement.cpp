#include "placement.h"
#include "../base/lists.h"
#include "../base/arrays.h"
#include <petscsf.h>
#include <map>
#include <numeric>

namespace
{
/* The labels of the local rows, and where the components are known */
class Labels : public AinsworthLabels {
public:
  Mat                   M = NULL; /* C; borrowed */
  AinsworthRef<PetscSF> roots;    /* from the owner of the first row of each component to ranks that have rows of it */
  std::vector<PetscInt> distinct; /* labels on this rank, ascending; the leaves of `roots` */
  std::vector<PetscInt> leaf;     /* of each local row */

  PetscErrorCode create(const std::vector<AinsworthLinks> &links);
  MPI_Comm       on() const { return PetscObjectComm((PetscObject)M); }
  PetscInt       rows() const { return (PetscInt)label.size(); }
};

PetscErrorCode Labels::create(const std::vector<AinsworthLinks> &links)
{
  PetscLayout layout;

  PetscFunctionBegin;
  M = links[0].M;
  PetscCall(open(links));
  PetscCall(connect());
  distinct = label;
  AinsworthSortUnique(&distinct);
  leaf.reserve(label.size());
  for (PetscInt l : label) leaf.push_back(std::lower_bound(distinct.begin(), distinct.end(), l) - distinct.begin());
  PetscCall(MatGetLayouts(M, &layout, NULL));
  PetscCall(PetscSFCreate(on(), roots.out()));
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
  for (size_t r = 0; r < labels.leaf.size(); r++) {
    rows[labels.leaf[r]]++;
    nonzeros[labels.leaf[r]] += labels.entries[r];
  }
  size.assign(labels.rows(), 0);
  work.assign(labels.rows(), 0);
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
  for (PetscInt i = 0; i < labels.rows(); i++)
    if (size[i] > small) mine.insert(mine.end(), {labels.rstart + i, size[i], work[i]});
  PetscCall(AinsworthGatherLists(labels.on(), mine, &all));
  for (size_t k = 0; k < all.size(); k += 3) large.push_back({all[k], all[k + 1], all[k + 2]});
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses up to `count` ranks with the most rows of C, ascending, because rows they own need not be moved */
PetscErrorCode ChooseRanks(Mat C, PetscInt count, std::vector<PetscMPIInt> &chosen)
{
  const PetscInt *ranges;
  PetscMPIInt     size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)C), &size));
  PetscCall(MatGetOwnershipRanges(C, &ranges));
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
PetscErrorCode TargetsOfShares(const Labels &labels, const std::vector<PetscMPIInt> &ranks,
                               std::vector<PetscInt> &target)
{
  PetscInt64 before = 0, mine = 0, all;

  PetscFunctionBegin;
  for (PetscInt entries : labels.entries) mine += entries;
  PetscCallMPI(MPI_Scan(&mine, &before, 1, MPIU_INT64, MPI_SUM, labels.on()));
  before -= mine;
  PetscCall(MPIU_Allreduce(&mine, &all, 1, MPIU_INT64, MPI_SUM, labels.on()));
  for (PetscInt entries : labels.entries) {
    /* the work in the middle of the row, which is below all, be the row empty */
    const double part = ((double)before + 0.5 * (double)entries) / ((double)all + 1.0);

    target.push_back(ranks[(size_t)(part * (double)ranks.size())]);
    before += entries;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds the target rank of each local row if components stay whole; small components go to the rank with most unknowns
   of their first row
*/
PetscErrorCode TargetsOfComponents(const Labels &labels, const std::vector<PetscInt> &size,
                                   const std::map<PetscInt, PetscInt> &large, std::vector<PetscInt> &target)
{
  std::vector<PetscInt> atRoot(labels.rows(), -1), atLeaf(labels.distinct.size());

  PetscFunctionBegin;
  for (PetscInt i = 0; i < labels.rows(); i++) {
    if (!size[i]) continue;
    const auto found = large.find(labels.rstart + i);
    atRoot[i]        = found == large.end() ? labels.home[i] : found->second;
  }
  PetscCall(PetscSFBcastBegin(labels.roots, MPIU_INT, atRoot.data(), atLeaf.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(labels.roots, MPIU_INT, atRoot.data(), atLeaf.data(), MPI_REPLACE));
  target.resize(labels.rows());
  for (PetscInt i = 0; i < labels.rows(); i++) target[i] = atLeaf[labels.leaf[i]];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collects the rows sent to this rank, component by component, each ascending */
PetscErrorCode Collect(const Labels &labels, const std::vector<PetscInt> &target, AinsworthPlacement *placement)
{
  MPI_Comm                                   comm = labels.on();
  IS                                         to, rows;
  PetscInt                                   n, *sorted;
  PetscLayout                                layout;
  std::vector<PetscInt>                      r, component;
  std::vector<std::pair<PetscInt, PetscInt>> order;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(comm, labels.rows(), target.data(), PETSC_USE_POINTER, &to));
  PetscCall(ISBuildTwoSided(to, NULL, &rows));
  PetscCall(ISDestroy(&to));
  PetscCall(AinsworthISToList(rows, &r));
  PetscCall(ISDestroy(&rows));
  n = (PetscInt)r.size();
  PetscCall(MatGetLayouts(labels.M, &layout, NULL));
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
PetscErrorCode AinsworthPlacementFindLarge(const AinsworthLinks &links, PetscInt small, PetscBool *found)
{
  AinsworthLabels       labels;
  std::vector<PetscInt> size;

  PetscFunctionBegin;
  PetscCall(labels.open({links}));
  size.assign(labels.label.size(), 0);
  *found = PETSC_FALSE;
  for (PetscInt l : labels.label)
    if (++size[l - labels.rstart] > small) *found = PETSC_TRUE;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, found, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)links.M)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Ranks share a component if it has more than this many times rowsPerRank rows, because solves that they share take
   several times as long (docs/gram.csv)

   Only MUMPS does that; without it components stay whole.
*/
static const PetscReal sharedAbove = 16.0;

/*
   AinsworthPlacementCreate - decides which rank solves for which row of S, whose pattern is that of the links; the
   first of these is C. Collective

   Components of up to `small` rows go to the rank that owns their unknowns. Larger ones go to ceil(rows / rowsPerRank)
   ranks: whole and with equal work or, if one has more than sharedAbove times rowsPerRank rows, all ranks share S.
*/
PetscErrorCode AinsworthPlacementCreate(const std::vector<AinsworthLinks> &links, PetscInt rowsPerRank, PetscInt small,
                                        AinsworthPlacement *placement)
{
  const Mat                C    = links[0].M;
  MPI_Comm                 comm = PetscObjectComm((PetscObject)C);
  Labels                   labels;
  PetscMPIInt              ranks;
  PetscInt                 m, rows = 0, largest = 0, counts[2] = {0, 0};
  std::vector<PetscInt>    size, work, target;
  std::vector<Component>   large;
  std::vector<PetscMPIInt> chosen;

  PetscFunctionBegin;
  PetscCall(AinsworthPlacementReset(placement));
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  PetscCall(MatGetSize(C, &m, NULL));
  PetscCall(labels.create(links));
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
  PetscCall(ChooseRanks(C, 1 + ((placement->split ? m : PetscMax(rows, 1)) - 1) / rowsPerRank, chosen));
  if (chosen.size() == 1) placement->split = false;
  if (ranks == 1) target.assign(labels.rows(), 0);
  else if (placement->split) PetscCall(TargetsOfShares(labels, chosen, target));
  else PetscCall(TargetsOfComponents(labels, size, Pack(large, chosen), target));
  PetscCall(Collect(labels, target, placement));
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
