/*
   What multigrid in Ker C has to know of C (docs/multigrid.md, the cycle in Ker C)

   The smoother of the finest level projects exactly. Coarse functions Q_* P, with an approximate inverse of S, are in
   Ker C of the short rows up to the last projection. Unknowns without stiffness that several rows share have no weight
   there and are carried to coarser levels; rows that are long, or have only such unknowns, are kept as few constraints
   of the coarser levels
*/
#include "coarse.h"
#include "../base/columns.h"
#include "../base/layouts.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../projection/projector.h"
#include "../saddle/saddle.h"
#include <algorithm>

/*
   Unknowns without stiffness in more rows are carried: with a weight they would couple these rows, for which a diagonal
   Inv(S) is too crude
*/
static const PetscReal fewRows = 8.0;
/* A row has no weight left if its entry of S is at most this part of what the weight of all unknowns gives it */
static const PetscReal weightless = 1e-10;
/*
   An unknown follows others only where it gives at least this part of the flexibility of its row. Stiffer bars hold
   their surroundings: on a lattice of bars as stiff as 1, 10, 30, 100, 1000 times these it takes 10, 10, 13, 19, 47
   iterations, and 10 with Inv(S); in unstructured meshes less stiff ones need it
*/
static const PetscReal soft       = 0.05;
static const PetscReal softSpring = 0.5;
/* The same where loose unknowns do all that a row asks for */
static const PetscReal nothing = 1e-16;
/* At most so many rows are kept as constraints of coarser levels; the projector alone knows of others */
static const size_t mostKept = 64;

namespace
{
/* Tells slack unknowns, which come last on each rank, from others */
struct SlackColumns {
  const PetscInt *springs, *ranges = NULL;
  PetscLayout     columns = NULL;

  SlackColumns(const AinsworthPmatInputs *in, Mat C) : springs(in->springs)
  {
    (void)MatGetLayouts(C, NULL, &columns);
    (void)PetscLayoutGetRanges(columns, &ranges);
  }
  bool operator()(PetscInt j) const
  {
    PetscMPIInt owner;

    if (!springs) return false;
    (void)PetscLayoutFindOwner(columns, j, &owner);
    return j >= ranges[owner + 1] - springs[owner];
  }
};
} // namespace

/* Finds carried unknowns, and the weight of Q_*: none for these and for masters in unusually many rows. Collective */
static PetscErrorCode FindCarried(const AinsworthPmatInputs *in, Vec counts, Vec zeros, AinsworthKernelRoles *roles)
{
  PetscInt              rstart;
  std::vector<PetscInt> mine;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(counts, &rstart, NULL));
  PetscCall(AinsworthVecClone(in->weight, &roles->weight));
  PetscCall(AinsworthUpdate(roles->weight, {counts, zeros},
                            [&](PetscInt i, PetscScalar &w, PetscScalar count, PetscScalar zero) {
                              const bool carry = zero != 0.0 && PetscRealPart(count) > fewRows;

                              if (carry) mine.push_back(rstart + i);
                              if (carry || PetscRealPart(count) > in->fill.usual) w = 0.0;
                            }));
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)in->C), mine, &roles->carried));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Marks unknowns whose rows of A are zero, which their diagonal entry tells where A is positive semidefinite, by 1, all
   others by 0. Collective
*/
static PetscErrorCode MarkZeroRows(const AinsworthPmatInputs *in, Vec zeros)
{
  PetscFunctionBegin;
  PetscCall(AinsworthGetDiagonal(in->aij, zeros));
  PetscCall(AinsworthUpdate(zeros, [](PetscInt, PetscScalar &z) { z = z == 0.0 ? 1.0 : 0.0; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Decides which rows are in Q_*, and which are kept. Collective

   C: the rows, scaled to C W C' = 1 before loose unknowns were released from them, or the program's own
*/
static PetscErrorCode ChooseRows(const AinsworthPmatInputs *in, Mat C, AinsworthKernelRoles *roles)
{
  Vec                   left, all;
  std::vector<char>     asks;
  std::vector<PetscInt> mine;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(C, NULL, &left));
  PetscCall(VecDuplicate(left, &all));
  PetscCall(AinsworthRowSquares(C, roles->weight, left));
  PetscCall(AinsworthRowSquares(C, in->weight, all));
  PetscCall(AinsworthForEntries({left, all}, [&](PetscInt, PetscScalar l, PetscScalar a) {
    asks.push_back(PetscRealPart(a) > (C == in->C ? 0.0 : nothing));
    roles->shortRows.push_back(asks.back() && PetscRealPart(l) > weightless * PetscRealPart(a));
  }));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    if (row.n > PetscMax(in->fill.most, in->fill.usual)) roles->shortRows[row.local] = 0;
    if (asks[row.local] && !roles->shortRows[row.local]) mine.push_back(row.number);
  }));
  PetscCall(VecDestroy(&left));
  PetscCall(VecDestroy(&all));
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)C), mine, &roles->kept));
  if (roles->kept.size() > mostKept) {
    PetscCall(PetscInfo(C, "%d rows of C would have to be kept on all levels: the projector alone has them\n",
                        (int)roles->kept.size()));
    roles->kept.clear();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the column of each local row that no other row has and that is soft enough, or -1: that of a slack unknown, or
   the one with the largest entry

   A spring that gives at least half of the flexibility of its row is stretched by coarse functions, which then have at
   most twice the energy that they need
*/
static PetscErrorCode FindSlaves(const AinsworthPmatInputs *in, Mat C, const AinsworthKernelRoles &roles,
                                 std::vector<PetscInt> *slaves, std::vector<PetscScalar> *entries)
{
  std::vector<PetscReal> shares;
  size_t                 at = 0;

  PetscFunctionBegin;
  const SlackColumns isSlack(in, C);
  PetscCall(AinsworthKernelFindShares(in, C, roles, &shares));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    bool spring = false;

    slaves->push_back(-1);
    entries->push_back(0.0);
    for (PetscInt k = 0; k < row.n; k++, at++) {
      const bool slack = isSlack(row.j[k]);

      if (shares[at] == 0.0 || shares[at] < (slack ? softSpring : soft) || spring) continue;
      if (!slack && PetscAbsScalar(row.a[k]) <= PetscAbsScalar(entries->back())) continue;
      slaves->back()  = row.j[k];
      entries->back() = row.a[k];
      spring          = slack;
    }
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Marks by 1 the slaves all of whose neighbors in A are slaves or have no entries in A; zeros: marks the latter.
   Collective
*/
static PetscErrorCode MarkEmbedded(Mat A, const std::vector<PetscInt> &slaves, Vec zeros, Vec embedded, PetscInt *found)
{
  Vec                   moved;
  AinsworthAtColumns    at;
  std::vector<PetscInt> which;
  PetscInt              rstart;
  PetscScalar          *marks;

  PetscFunctionBegin;
  *found = 0;
  PetscCall(AinsworthVecClone(zeros, &moved));
  for (PetscInt j : slaves)
    if (j >= 0) PetscCall(VecSetValue(moved, j, 2.0, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(moved));
  PetscCall(VecAssemblyEnd(moved));
  PetscCall(VecGetOwnershipRange(moved, &rstart, NULL));
  PetscCall(AinsworthForEntries({moved}, [&](PetscInt i, PetscScalar m) {
    if (m == 2.0) which.push_back(rstart + i);
  }));
  PetscCall(at.create(A, moved));
  PetscCall(VecZeroEntries(embedded));
  PetscCall(VecGetArray(embedded, &marks));
  for (PetscInt i : which) {
    PetscInt           n;
    const PetscInt    *j;
    const PetscScalar *a;
    bool               free = false;

    PetscCall(MatGetRow(A, i, &n, &j, &a));
    for (PetscInt k = 0; k < n && !free; k++) free = a[k] != 0.0 && at(j[k]) == 0.0;
    PetscCall(MatRestoreRow(A, i, &n, &j, &a));
    if (free) continue;
    marks[i - rstart] = 1.0;
    (*found)++;
  }
  PetscCall(VecRestoreArray(embedded, &marks));
  PetscCall(VecDestroy(&moved));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Creates T_e, which expresses embedded unknowns by others, E C with E_ji = 1 / C_ij, and takes their rows out of Q_*;
   NULL if there are none. Collective
*/
static PetscErrorCode CreateEmbedding(const AinsworthPmatInputs *in, Mat C, Vec zeros, AinsworthKernelRoles *roles,
                                      std::shared_ptr<const std::vector<char>> *left, Mat *embedding)
{
  std::vector<PetscInt>    slaves;
  std::vector<PetscScalar> entries;
  std::vector<char>        rows;
  AinsworthEntries         picks;
  AinsworthAtColumns       at;
  Vec                      embedded;
  Mat                      pick, E, kept;
  PetscInt                 found;

  PetscFunctionBegin;
  *embedding = NULL;
  left->reset();
  PetscCall(FindSlaves(in, C, *roles, &slaves, &entries));
  PetscCall(VecDuplicate(zeros, &embedded));
  PetscCall(MarkEmbedded(in->aij, slaves, zeros, embedded, &found));
  if (found) {
    PetscCall(at.create(C, embedded));
    for (size_t i = 0; i < slaves.size(); i++, picks.endRow()) {
      if (slaves[i] < 0 || at(slaves[i]) == 0.0) continue;
      picks.add(slaves[i], PetscConj(1.0 / entries[i]));
      roles->shortRows[i] = 2;
    }
    PetscCall(AinsworthCreateAIJLike(C, picks, &pick));
    PetscCall(MatHermitianTranspose(pick, MAT_INITIAL_MATRIX, &E));
    for (char &s : roles->shortRows) {
      rows.push_back(s == 2);
      if (s == 2) s = 0;
    }
    PetscCall(AinsworthCopyMarkedRows(C, &rows, &kept));
    PetscCall(MatMatMult(E, kept, MAT_INITIAL_MATRIX, PETSC_DEFAULT, embedding));
    PetscCall(MatProductClear(*embedding));
    for (Mat *M : {&pick, &E, &kept}) PetscCall(MatDestroy(M));
    auto marks = std::make_shared<std::vector<char>>();
    PetscCall(AinsworthForEntries(
      {embedded, zeros}, [&](PetscInt, PetscScalar e, PetscScalar z) { marks->push_back(e != 0.0 || z != 0.0); }));
    *left = marks;
    PetscCall(PetscInfo(
      C,
      "%" PetscInt_FMT
      " unknowns are embedded: with all their neighbors they move as others do, and have no coarse functions\n",
      found));
  }
  PetscCall(VecDestroy(&embedded));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the rows with carried unknowns, if there are any. Collective */
static PetscErrorCode CopyCarriedRows(Mat C, const AinsworthKernelRoles &roles, Mat *rows)
{
  AinsworthAtColumns at;
  AinsworthRef<Vec>  carried;
  std::vector<char>  marked;
  PetscInt           start, end;

  PetscFunctionBegin;
  if (roles.carried.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(roles.weight, carried.out()));
  PetscCall(VecGetOwnershipRange(carried, &start, &end));
  PetscCall(VecZeroEntries(carried));
  for (PetscInt u : roles.carried)
    if (u >= start && u < end) PetscCall(VecSetValue(carried, u, 1.0, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(carried));
  PetscCall(VecAssemblyEnd(carried));
  PetscCall(at.create(C, carried));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    marked.push_back(std::any_of(row.j, row.j + row.n, [&](PetscInt j) { return at(j) != 0.0; }));
  }));
  PetscCall(AinsworthCopyMarkedRows(C, &marked, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Carries the slack unknowns of kept rows, which would be rigid without them. Collective */
static PetscErrorCode CarrySprings(const AinsworthPmatInputs *in, Mat C, AinsworthKernelRoles *roles)
{
  std::vector<PetscInt> mine, all;

  PetscFunctionBegin;
  if (!in->springs || roles->kept.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  const SlackColumns slack(in, C);
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    if (!std::binary_search(roles->kept.begin(), roles->kept.end(), row.number)) return;
    for (PetscInt k = 0; k < row.n; k++)
      if (slack(row.j[k])) mine.push_back(row.j[k]);
  }));
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)C), mine, &all));
  roles->carried.insert(roles->carried.end(), all.begin(), all.end());
  AinsworthSortUnique(&roles->carried);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreateInKernel - creates I - Q_* for the coarser levels, and what these keep. Collective

   Q_* = (I - T_e) (I - T_f): unknowns are spread over the short rows first, then embedded ones follow.
*/
PetscErrorCode AinsworthPmatCreateInKernel(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt,
                                           AinsworthPmatInKernel *made)
{
  AinsworthKernelRoles roles;
  Vec                  counts, zeros;
  Mat                  all, embedding, spread;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(in->C, 0, &counts));
  PetscCall(VecDuplicate(counts, &zeros));
  PetscCall(MarkZeroRows(in, zeros));
  PetscCall(FindCarried(in, counts, zeros, &roles));
  PetscCall(AinsworthPmatReleaseLoose(in, roles.weight, in->C, &all));
  PetscCall(ChooseRows(in, all, &roles));
  PetscCall(CopyCarriedRows(all, roles, made->carried.rows.out()));
  PetscCall(CarrySprings(in, all, &roles));
  PetscCall(CreateEmbedding(in, all, zeros, &roles, &made->left, &embedding));
  PetscCall(AinsworthKernelCreateSpread(in, all, opt, roles, &spread));
  made->correction = spread ? spread : embedding;
  if (spread && embedding) {
    Mat product;

    PetscCall(MatMatMult(embedding, spread, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
    PetscCall(MatScale(product, -1.0));
    PetscCall(AinsworthAddAIJ(1.0, {embedding, product}, &made->correction));
    PetscCall(MatDestroy(&product));
    PetscCall(MatDestroy(&embedding));
  }
  PetscCall(AinsworthGetRows(all, roles.kept, &made->rows));
  for (Vec row : made->rows) { /* Q_*' c */
    if (!made->correction) break;
    PetscCall(MatMultHermitianTranspose(made->correction, row, counts));
    PetscCall(VecAXPY(row, -1.0, counts));
  }
  made->carried.unknowns = roles.carried;
  PetscCall(VecDestroy(&counts));
  PetscCall(VecDestroy(&zeros));
  PetscCall(MatDestroy(&all));
  PetscCall(VecDestroy(&roles.weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}
