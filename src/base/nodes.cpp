/* Nodes whose unknowns are not contiguous: numbered component by component, or in an arbitrary order */
#include "matrices.h"
#include "lists.h"
#include "objects.h"
#include <unordered_map>

/* Number of rows of each rank examined at first */
static const PetscInt voters = 100;
/*
   Fraction of the couplings between components of nodes that must have entries; at most 1/2 in a scalar problem whose
   halves look alike
*/
static const PetscReal coupled = 0.6;

/* What AinsworthFindNodes() found for a nonzero pattern */
namespace
{
struct Nodes {
  PetscObjectState      pattern = 0;
  PetscInt              bs      = 0;
  std::vector<PetscInt> order;
};
} // namespace

/* Checks whether the number of local rows is divisible by a block size on every rank. Collective */
PetscErrorCode AinsworthBlocksDivide(Mat A, PetscInt bs, PetscBool *divides)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  *divides = (PetscBool)(n % bs == 0);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, divides, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the columns of a row; none if it has a single entry, as with Dirichlet conditions */
PetscErrorCode AinsworthGetColumns(Mat A, PetscInt row, std::vector<PetscInt> *columns)
{
  PetscInt        n;
  const PetscInt *cols;

  PetscFunctionBegin;
  PetscCall(MatGetRow(A, row, &n, &cols, NULL));
  columns->assign(cols, cols + (n > 1 ? n : 0));
  PetscCall(MatRestoreRow(A, row, &n, &cols, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthCompareRows - compares the bs rows of a node, which are `stride` apart, by the nodes that they touch

   Nodes are compared, not columns, as stored patterns may lack zero entries, which some programs drop.
*/
PetscErrorCode AinsworthCompareRows(Mat A, PetscInt first, PetscInt stride, PetscInt bs,
                                    const AinsworthToNodes &toNodes, AinsworthNodeRows *rows)
{
  std::vector<PetscInt> nodes, others;

  PetscFunctionBegin;
  *rows = AinsworthNodeRows();
  for (PetscInt c = 0; c < bs && rows->votes; c++) {
    PetscCall(AinsworthGetColumns(A, first + c * stride, &others));
    rows->votes = !others.empty();
    rows->entries += (PetscInt)others.size();
    toNodes(&others);
    if (c == 0) nodes = others;
    rows->same = rows->same && nodes == others;
  }
  rows->touched = (PetscInt)nodes.size();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces columns by their nodes, ascending, assuming that each rank numbers its unknowns component by component */
static void ToNodes(const PetscInt ranges[], PetscMPIInt size, PetscInt bs, std::vector<PetscInt> *columns)
{
  for (PetscInt &c : *columns) {
    const PetscInt *owner = std::upper_bound(ranges, ranges + size + 1, c) - 1, nodes = (owner[1] - owner[0]) / bs;

    c = owner[0] / bs + (c - owner[0]) % nodes;
  }
  AinsworthSortUnique(columns);
}

/*
   Checks whether, if ranks number unknowns component by component, the rows of nearly all nodes touch the same nodes in
   most components. Collective
*/
static PetscErrorCode AreByComponent(Mat A, PetscInt bs, PetscBool *yes)
{
  PetscInt          n, first;
  PetscInt64        count[4] = {0, 0, 0, 0}; /* nodes that agree, that vote, that these touch; entries */
  PetscMPIInt       size;
  const PetscInt   *ranges;
  PetscBool         divides;
  AinsworthNodeRows rows;

  PetscFunctionBegin;
  *yes = PETSC_FALSE;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(AinsworthBlocksDivide(A, bs, &divides));
  if (!divides) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)A), &size));
  PetscCall(MatGetOwnershipRanges(A, &ranges));
  PetscCall(MatGetOwnershipRange(A, &first, NULL));
  for (PetscInt i = 0; i < n / bs; i += PetscMax(1, n / bs / voters)) {
    auto toNodes = [=](std::vector<PetscInt> *columns) { ToNodes(ranges, size, bs, columns); };
    PetscCall(AinsworthCompareRows(A, first + i, n / bs, bs, toNodes, &rows));
    if (!rows.votes) continue;
    count[0] += rows.same;
    count[1]++;
    count[2] += rows.touched;
    count[3] += rows.entries;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 4, MPIU_INT64, MPI_SUM, PetscObjectComm((PetscObject)A)));
  *yes = (PetscBool)(count[1] && count[0] >= AinsworthNodesEnough * count[1]);
  if (count[3] < coupled * bs * bs * count[2]) *yes = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether nearly all examined rows have a twin, a row with the same columns, among the rows that they touch.
   Collective
*/
static PetscErrorCode HaveTwins(Mat A, PetscBool *yes)
{
  PetscInt              first, end, count[2] = {0, 0};
  std::vector<PetscInt> columns, others;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &first, &end));
  for (PetscInt i = first; i < end; i += PetscMax(1, (end - first) / voters)) {
    bool twin = false;

    PetscCall(AinsworthGetColumns(A, i, &columns));
    if (columns.empty()) continue;
    for (PetscInt c : columns) {
      if (c == i || c < first || c >= end) continue;
      PetscCall(AinsworthGetColumns(A, c, &others));
      twin = others == columns;
      if (twin) break;
    }
    count[0] += twin;
    count[1]++;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  *yes = (PetscBool)(count[1] && count[0] >= AinsworthNodesEnough * count[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds nodes as sets of rows with the same columns, if all have the same number of rows; otherwise bs is 1. Collective
*/
static PetscErrorCode FindTwins(Mat A, PetscInt *bs, std::vector<PetscInt> *order)
{
  PetscInt                                  first, end, size = 0;
  std::unordered_map<uint64_t, std::size_t> known; /* node of each hashed pattern */
  std::vector<std::vector<PetscInt>>        nodes;
  /* alone: Dirichlet rows, coupled to nothing, which may form any node */
  std::vector<PetscInt> columns, alone;
  PetscBool             good;

  PetscFunctionBegin;
  *bs = 1;
  PetscCall(HaveTwins(A, &good));
  if (!good) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRange(A, &first, &end));
  for (PetscInt i = first; i < end; i++) {
    uint64_t pattern = 0;

    PetscCall(AinsworthGetColumns(A, i, &columns));
    if (columns.empty()) {
      alone.push_back(i - first);
      continue;
    }
    for (PetscInt c : columns) pattern = AinsworthMixState(pattern, (uint64_t)c);
    const auto at = known.emplace(pattern, nodes.size());
    if (at.second) nodes.emplace_back();
    nodes[at.first->second].push_back(i - first);
  }
  for (const auto &node : nodes) size = PetscMax(size, (PetscInt)node.size());
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &size, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)A)));
  good = (PetscBool)(size > 1 && size <= AinsworthNodesLargest && alone.size() % size == 0);
  for (const auto &node : nodes) good = (PetscBool)(good && (PetscInt)node.size() == size);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &good, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)A)));
  if (!good) PetscFunctionReturn(PETSC_SUCCESS);
  *bs = size;
  nodes.push_back(std::move(alone));
  for (const auto &node : nodes) order->insert(order->end(), node.begin(), node.end());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Implements AinsworthFindNodes() without its cache */
static PetscErrorCode Find(Mat A, PetscInt *bs, std::vector<PetscInt> *order)
{
  PetscBool found = PETSC_FALSE;
  PetscInt  n;

  PetscFunctionBegin;
  for (*bs = AinsworthNodesLargest; *bs > 1; --*bs) {
    PetscCall(AreByComponent(A, *bs, &found));
    if (found) break;
  }
  if (found) {
    PetscCall(MatGetLocalSize(A, &n, NULL));
    for (PetscInt i = 0; i < n; i++) order->push_back(i % *bs * (n / *bs) + i / *bs);
  } else PetscCall(FindTwins(A, bs, order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindNodes - finds the number of unknowns per node if they are not contiguous, and the local rows ordered by
   nodes; otherwise 1 and no order. Collective

   Zero entries may be missing only if unknowns are numbered component by component; Dirichlet rows may be present. The
   result is cached with A until its nonzero pattern changes.
*/
PetscErrorCode AinsworthFindNodes(Mat A, PetscInt *bs, std::vector<PetscInt> *order)
{
  static const char name[] = "AinsworthNodes";
  PetscObjectState  pattern;
  PetscBool         aij, known;
  Nodes            *last;

  PetscFunctionBegin;
  *bs = 1;
  order->clear();
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)A, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  if (!aij) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetNonzeroState(A, &pattern));
  PetscCall(AinsworthGetAttached((PetscObject)A, name, &last));
  known = (PetscBool)(last && last->pattern == pattern);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &known, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)A)));
  if (known) {
    *bs    = last->bs;
    *order = last->order;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(Find(A, bs, order));
  PetscCall(AinsworthAttach((PetscObject)A, name, std::make_unique<Nodes>(Nodes{pattern, *bs, *order})));
  PetscFunctionReturn(PETSC_SUCCESS);
}
