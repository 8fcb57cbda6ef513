/* The levels of PCBLOCKSA in a subspace: what they need to know of it, and solvers that stay in it */
#include "blocksaimpl.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../base/matrices.h"

/*
   Returns the local nodes, in their order, that coarse functions do not reach because others move all their unknowns;
   empty if there are none
*/
std::vector<char> AinsworthSubspaceEmbedded(const PC_BlockSA *sa, PetscInt bs, const std::vector<PetscInt> &order)
{
  std::vector<char> embedded;

  if (!sa->subspace || !sa->subspace->embedded) return embedded;
  for (size_t l = 0; l < sa->subspace->embedded->size(); l += bs) {
    embedded.push_back(1);
    for (PetscInt c = 0; c < bs; c++)
      if (!(*sa->subspace->embedded)[order.empty() ? l + c : order[l + c]]) embedded.back() = 0;
  }
  return embedded;
}

/* Gets A as AIJ, for the unknowns of the levels */
PetscErrorCode PCBlockSAGetAIJ_Private(PC_BlockSA *sa, Mat A, Mat *aij)
{
  Mat own;

  PetscFunctionBegin;
  if (!sa->extended && sa->subspace && sa->subspace->map) {
    PetscCall(AinsworthGetAIJ(A, &own));
    PetscCall(sa->subspace->extend(own, &sa->extended));
    PetscCall(MatDestroy(&own));
  }
  if (sa->extended) PetscCall(AinsworthShare(sa->extended, aij));
  else PetscCall(AinsworthGetAIJ(A, aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes the rows of a level to the next coarser one, C P. Collective */
PetscErrorCode AinsworthCoarsenRows(const AinsworthGrid &grid, std::vector<Vec> *rows)
{
  Mat P;

  PetscFunctionBegin;
  if (rows->empty()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthInterpolationMatCreate(grid.P, grid.nodes, 1, &P));
  for (Vec &row : *rows) {
    Vec coarse;

    PetscCall(AinsworthCreateVecs(P, &coarse, NULL));
    PetscCall(MatMultHermitianTranspose(P, row, coarse));
    PetscCall(VecDestroy(&row));
    row = coarse;
  }
  PetscCall(MatDestroy(&P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies a multivector of the finest level from the order of the matrix to that of its nodes, or back */
PetscErrorCode PCBlockSASort_Private(const PC_BlockSA *sa, bool back, PetscInt width, Vec from, Vec to)
{
  const std::vector<PetscInt> &order = sa->levels.hierarchy->order;
  const PetscScalar           *values;
  PetscScalar                 *a;

  PetscFunctionBegin;
  if (!sa->levels.hierarchy->sorted) PetscCall(VecCopy(from, to));
  else if (back) {
    PetscCall(VecGetArrayWrite(to, &a));
    PetscCall(
      AinsworthForEntries({from}, [&](PetscInt l, PetscScalar v) { a[order[l / width] * width + l % width] = v; }));
    PetscCall(VecRestoreArrayWrite(to, &a));
  } else {
    PetscCall(VecGetArrayRead(from, &values));
    PetscCall(
      AinsworthUpdate(to, [&](PetscInt l, PetscScalar &v) { v = values[order[l / width] * width + l % width]; }));
    PetscCall(VecRestoreArrayRead(from, &values));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the rows of the finest level, node by node */
PetscErrorCode PCBlockSASortRows_Private(const PC_BlockSA *sa, std::vector<Vec> *rows)
{
  PetscFunctionBegin;
  for (Vec row : sa->subspace ? sa->subspace->rows : std::vector<Vec>()) {
    Vec sorted;

    PetscCall(VecDuplicate(row, &sorted));
    PetscCall(PCBlockSASort_Private(sa, false, 1, row, sorted));
    rows->push_back(sorted);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Keeps a coarser level, which may be the coarsest, in the kernel of rows, which are made orthonormal for its diagonal.
   Collective
*/
PetscErrorCode PCBlockSAKeepRows_Private(const std::vector<Vec> &rows, AinsworthLevel *level,
                                         std::shared_ptr<const AinsworthFewRows> *few)
{
  auto                                          created = std::make_shared<AinsworthFewRows>();
  std::shared_ptr<const AinsworthLevelSubspace> subspace;
  std::vector<PetscReal>                        weight;

  PetscFunctionBegin;
  few->reset();
  if (rows.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscReal d : *level->diagonal) weight.push_back(1.0 / d);
  PetscCall(created->create(rows, weight));
  if (created->c.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  *few = created;
  PetscCall(AinsworthFewRowsSubspaceCreate(*few, &subspace));
  level->stay(subspace);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes what corrects coarse functions, and what that adds to the first coarser level. Collective */
PetscErrorCode PCBlockSACorrectCoarse_Private(Mat A, PC_BlockSA *sa, AinsworthHalf *added)
{
  const AinsworthHierarchy &h = *sa->levels.hierarchy;
  AinsworthBlockMat         T, rows;
  std::vector<char>         marked;
  Mat                       aij;

  PetscFunctionBegin;
  PetscCall(AinsworthBlockMatOpen(sa->subspace->correction, h.finest.bs, h.order, NULL, &T));
  for (PetscInt i = 0; i < T.rows.n; i++) marked.push_back(T.rows.i[i] < T.rows.i[i + 1]);
  auto Z = std::make_shared<AinsworthInterpolation>();
  PetscCall(AinsworthInterpolationMultiply(T, *h.finest.P, Z.get()));
  for (PetscScalar &v : Z->rows.a) v = -v;
  if (!h.finest.P->single.empty()) Z->round();
  PetscCall(PCBlockSAGetAIJ_Private(sa, A, &aij));
  PetscCall(AinsworthBlockMatOpen(aij, h.finest.bs, h.order, &marked, &rows));
  PetscCall(MatDestroy(&aij));
  PetscCall(AinsworthGalerkinChange(rows, *h.finest.P, *Z, added));
  sa->corrected = Z;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gives the solvers of all levels back the preconditioners that they had before PCBlockSAStayInSubspace_Private(),
   which are set up with the levels
*/
PetscErrorCode PCBlockSALeaveSubspace_Private(PC pc, PC_BlockSA *sa)
{
  PetscFunctionBegin;
  for (PetscInt l = 0; l < (PetscInt)sa->op.size(); l++) {
    KSP ksp;
    PC  own, inner;

    PetscCall(PCMGGetSmoother(pc, l, &ksp));
    PetscCall(KSPGetPC(ksp, &own));
    PetscCall(AinsworthSubspacePCGetInner(own, &inner));
    if (inner != own) PetscCall(KSPSetPC(ksp, inner));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Keeps interpolation to the finest level, smoothers that know nothing of it, and the solver of the coarsest level in
   the subspace of each level
*/
PetscErrorCode PCBlockSAStayInSubspace_Private(PC pc, PC_BlockSA *sa)
{
  const PetscInt top = (PetscInt)sa->op.size() - 1;

  PetscFunctionBegin;
  for (PetscInt l = 0; l <= top && top; l++) {
    AinsworthLevel *level = NULL;
    KSP             ksp;
    PC              inner, projected = NULL;
    Mat             P;
    PetscBool       single;

    PetscCall(PCMGGetSmoother(pc, top - l, &ksp));
    PetscCall(KSPGetPC(ksp, &inner));
    if (l < top) PetscCall(AinsworthLevelMatGet(sa->op[l], &level));
    if (l == 0) {
      PetscCall(PCMGGetInterpolation(pc, top, &P));
      PetscCall(AinsworthInterpolationMatSetSubspace(P, level->subspace, sa->corrected));
    }
    PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPCHEBYSHEVSINGLE, &single));
    if (level && level->subspace && !single)
      PetscCall(AinsworthSubspacePCCreate(level->subspace, 1, inner, &projected));
    else if (l == top && sa->coarseRows) {
      PetscCall(AinsworthFewRowsPCCreate(sa->coarseRows, inner, &projected));
      if (!projected) PetscCall(AinsworthPCSetFailedReason(pc, PC_FACTOR_NUMERIC_ZEROPIVOT));
    }
    if (projected) PetscCall(KSPSetPC(ksp, projected));
    PetscCall(PCDestroy(&projected));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
