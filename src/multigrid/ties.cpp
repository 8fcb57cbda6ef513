/*
   Nodes that A knows nothing of follow those that rows of C tie them to (docs/multigrid.md, the cycle in Ker C)

   The reference node of a rigid part has no stiffness: A does not tell in which aggregate it belongs. Its rows of C do,
   and where the modes satisfy these rows it moves as the nodes around it. A mean strain, or what a bolt is shortened
   by, is moved by no mode: such nodes are carried to all levels
*/
#include "coarsen.h"
#include "../base/arrays.h"
#include "../base/columns.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include <algorithm>

/*
   A node follows an aggregate where it is tied to at most this many of them: a large rigid part would have the modes of
   a small piece of it extrapolated. Rigid parts of 16 to 2500 nodes take 8 to 10 iterations with up to 16, up to 12
   without a bound
*/
static const size_t mostAround = 8;

/*
   Creates the pattern of R' F, for the columns of C that are marked by 1, R, and those marked by 0, F. Collective
*/
static PetscErrorCode TieColumns(Mat C, Vec marks, Mat *product)
{
  AinsworthAtColumns at;
  AinsworthEntries   follow, lead;
  AinsworthRef<Mat>  R, Rt, F;

  PetscFunctionBegin;
  PetscCall(at.create(C, marks));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    for (PetscInt e = 0; e < row.n; e++) {
      const PetscReal mark = PetscRealPart(at(row.j[e]));

      if (row.a[e] == 0.0) continue;
      if (mark == 1.0) follow.add(row.j[e], 1.0);
      else if (mark == 0.0) lead.add(row.j[e], 1.0);
    }
    follow.endRow();
    lead.endRow();
  }));
  PetscCall(AinsworthCreateAIJLike(C, follow, R.out()));
  PetscCall(AinsworthCreateAIJLike(C, lead, F.out()));
  PetscCall(MatTranspose(R, MAT_INITIAL_MATRIX, Rt.out()));
  PetscCall(MatMatMult(Rt, F, MAT_INITIAL_MATRIX, PETSC_DEFAULT, product));
  PetscCall(MatProductClear(*product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTiesCreate - finds what carried nodes of the finest level may follow. Collective

   Input Parameters:
+  C     - the rows with carried unknowns, or NULL
.  bs    - unknowns per node
.  order - the local rows of A node by node; empty if they are stored so
-  modes - the near null space, and the carried nodes

   Output Parameters:
+  modes - carried nodes move as their rows ask for; if they follow nothing, each unknown has a mode of its own
-  ties  - the nodes that others may follow
*/
PetscErrorCode AinsworthTiesCreate(Mat C, PetscInt bs, const std::vector<PetscInt> &order, AinsworthModes *modes,
                                   AinsworthTies *ties)
{
  const PetscInt    k    = modes->k;
  PetscBool         some = PETSC_FALSE;
  AinsworthRef<Vec> marks;
  AinsworthRef<Mat> product;

  PetscFunctionBegin;
  *ties = AinsworthTies();
  if (C) PetscCall(AinsworthModesOfCarried(C, bs, order, modes, marks.out(), &some));
  if (some) {
    PetscCall(TieColumns(C, marks, product.out()));
    PetscCall(AinsworthBlockMatOpen(product, bs, order, NULL, ties));
    ties->reader.reset();
    ties->rows.br = ties->rows.bc = 1;
    ties->rows.a.assign(ties->rows.j.size(), 1.0);
  }
  for (size_t i = 0; i < modes->carried.size(); i++) {
    if (!modes->carried[i] || (some && ties->rows.i[i] < ties->rows.i[i + 1])) continue;
    PetscScalar *block = &modes->values[i * bs * k];
    std::fill_n(block, bs * k, 0.0);
    for (PetscInt c = 0; c < PetscMin(bs, k); c++) block[c * k + c] = 1.0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the number that most of those given have, -1 if there are none or too many different ones */
static PetscInt Choose(std::vector<PetscInt> &numbers)
{
  PetscInt best = -1;
  size_t   most = 0, different = 0;

  std::sort(numbers.begin(), numbers.end());
  for (size_t k = 0, end; k < numbers.size(); k = end, different++) {
    for (end = k; end < numbers.size() && numbers[end] == numbers[k];) end++;
    if (end - k <= most) continue;
    most = end - k;
    best = numbers[k];
  }
  return different <= mostAround ? best : -1;
}

/*
   Computes X with X R = N, where N has bs rows and R is upper triangular with zero rows for dependent modes; false if
   there is none
*/
static bool Extrapolate(PetscInt bs, PetscInt k, const PetscScalar *N, const PetscScalar *R, PetscScalar *X)
{
  for (PetscInt b = 0; b < bs; b++)
    for (PetscInt c = 0; c < k; c++) {
      PetscScalar v     = N[b * k + c];
      PetscReal   terms = PetscAbsScalar(v);

      for (PetscInt d = 0; d < c; d++) {
        const PetscScalar term = X[b * k + d] * R[d * k + c];
        v -= term;
        terms += PetscAbsScalar(term);
      }
      if (R[c * k + c] == 0.0 && PetscAbsScalar(v) > AinsworthModeSatisfied * terms) return false;
      X[b * k + c] = R[c * k + c] == 0.0 ? 0.0 : v / R[c * k + c];
    }
  return true;
}

/* Takes the aggregates of followers, which have no other node, out of those of this rank */
static void RemoveFollowers(const std::vector<PetscInt> &followers, PetscInt k, AinsworthAggregates *agg,
                            std::vector<PetscScalar> *coarse)
{
  std::vector<PetscInt> number(agg->count, 0);
  PetscInt              kept = 0;

  for (PetscInt i : followers) number[agg->of[i]] = -1;
  for (PetscInt g = 0; g < agg->count; g++) {
    if (number[g] < 0) continue;
    std::copy_n(coarse->begin() + (ptrdiff_t)g * k * k, k * k, coarse->begin() + (ptrdiff_t)kept * k * k);
    number[g] = kept++;
  }
  for (PetscInt &g : agg->of)
    if (g >= 0) g = number[g];
  agg->count = kept;
  coarse->resize((size_t)kept * k * k);
}

/* Finds for each local node the aggregate that it may follow, numbered as in a layout, or -1. Collective */
static PetscErrorCode FindLeaders(const AinsworthTies &ties, const AinsworthModes &modes,
                                  const AinsworthAggregates &agg, const AinsworthLayout &layout,
                                  std::vector<PetscInt> *leaders)
{
  const PetscInt        n = ties.rows.n;
  std::vector<PetscInt> number(n, -1), ghosts(ties.cols.ghosts.size()), around;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++)
    if (agg.of[i] >= 0 && !modes.carried[i]) number[i] = layout->rstart + agg.of[i];
  PetscCall(ties.cols.toGhosts(MPIU_INT, number.data(), ghosts.data()));
  for (PetscInt i = 0; i < n; i++) {
    around.clear();
    for (PetscInt e = ties.rows.i[i]; e < ties.rows.i[i + 1]; e++) {
      const PetscInt j = ties.rows.j[e], g = j < n ? number[j] : ghosts[j - n];
      if (g >= 0) around.push_back(g);
    }
    leaders->push_back(Choose(around));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTentativeFollow - lets nodes that are tied to few aggregates follow one of these, which may be on any rank,
   with the modes that it extrapolates to them. Collective

   agg, coarse: carried nodes are aggregates of their own, the last ones of this rank; those of followers are removed
*/
PetscErrorCode AinsworthTentativeFollow(const AinsworthTies &ties, const AinsworthModes &modes,
                                        AinsworthAggregates *agg, AinsworthTentative *T,
                                        std::vector<PetscScalar> *coarse)
{
  const PetscInt           bs = T->bs, k = T->k;
  const size_t             n      = agg->of.size();
  PetscInt                 others = agg->count;
  std::vector<PetscInt>    leaders, places;
  std::vector<PetscScalar> there, X((size_t)bs * k);
  AinsworthUnit            square(k * k, MPIU_SCALAR);
  AinsworthLayout          before, after;
  AinsworthColumns         makers;
  const PetscInt          *starts;

  PetscFunctionBegin;
  T->aggregate.assign(n, -1);
  if (!ties.cols.layout) PetscFunctionReturn(PETSC_SUCCESS);
  for (char c : modes.carried) others -= c;
  PetscCall(AinsworthLayoutCreate(ties.cols.layout->comm, others, &before));
  PetscCall(FindLeaders(ties, modes, *agg, before, &leaders));
  places = leaders;
  PetscCall(makers.createAt(before, &places));
  there.resize(makers.ghosts.size() * k * k);
  PetscCall(makers.toGhosts(square.type, coarse->data(), there.data()));
  for (size_t i = 0; i < n; i++) {
    const PetscInt g = places[i];

    if (g < 0) continue;
    const PetscScalar *R = g < others ? &(*coarse)[(size_t)g * k * k] : &there[(size_t)(g - others) * k * k];
    if (!Extrapolate(bs, k, &modes.values[i * bs * k], R, X.data())) continue;
    std::copy(X.begin(), X.end(), T->values.begin() + (ptrdiff_t)(i * bs * k));
    T->followers.push_back((PetscInt)i);
  }
  RemoveFollowers(T->followers, k, agg, coarse);
  PetscCall(AinsworthLayoutCreate(ties.cols.layout->comm, agg->count, &after));
  PetscCall(PetscLayoutGetRanges(after.get(), &starts));
  for (PetscInt i : T->followers) {
    PetscMPIInt owner;

    PetscCall(PetscLayoutFindOwner(before.get(), leaders[i], &owner));
    T->aggregate[i] = starts[owner] + leaders[i] - before->range[owner];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthTiesCoarsen - takes the ties of nodes that are still carried to the coarser level. Collective */
PetscErrorCode AinsworthTiesCoarsen(const AinsworthAggregates &agg, const AinsworthTentative &T, AinsworthTies *ties)
{
  const PetscInt                     n = ties->rows.n;
  std::vector<PetscInt>              ghosts(ties->cols.ghosts.size()), owner;
  std::vector<std::vector<PetscInt>> around(agg.count);
  AinsworthBlockRows                 made, rows;
  AinsworthColumns                   makers;
  PetscBool                          some;

  PetscFunctionBegin;
  if (!ties->cols.layout) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ties->cols.toGhosts(MPIU_INT, T.aggregate.data(), ghosts.data()));
  for (PetscInt i = 0; i < n; i++) {
    if (agg.of[i] < 0) continue;
    for (PetscInt e = ties->rows.i[i]; e < ties->rows.i[i + 1]; e++) {
      const PetscInt j = ties->rows.j[e], g = j < n ? T.aggregate[j] : ghosts[j - n];
      if (g >= 0) around[agg.of[i]].push_back(g);
    }
  }
  for (std::vector<PetscInt> &list : around) {
    AinsworthSortUnique(&list);
    made.j.insert(made.j.end(), list.begin(), list.end());
    made.endRow();
  }
  made.a.assign(made.j.size(), 1.0);
  some = (PetscBool)!made.j.empty();
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &some, 1, AINSWORTH_MPI_BOOL, MPI_LOR, T.layout->comm));
  *ties = AinsworthTies();
  if (!some) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(makers.createMade(T.layout, agg.count));
  if (makers.sf) PetscCall(AinsworthRowsToOwners(makers, made, &owner, &rows));
  else rows = std::move(made);
  PetscCall(ties->cols.createAt(T.layout, &rows.j));
  ties->rows = std::move(rows);
  PetscFunctionReturn(PETSC_SUCCESS);
}
