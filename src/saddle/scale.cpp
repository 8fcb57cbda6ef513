/* The scale of a system: powers of 2 that bring the entries of [A B'; C -D] to about 1 */
#include "saddle.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include <algorithm>
#include <cmath>

/*
   Returns the power of 2 next to the inverse of the root, by which products cause no rounding; 1 for a size that says
   nothing
*/
static PetscReal InverseRoot(PetscReal size)
{
  int exponent;

  if (!(size > 0.0) || PetscIsInfOrNanReal(size)) return 1.0;
  (void)std::frexp((double)size, &exponent);
  return (PetscReal)std::ldexp(1.0, -(int)std::floor(0.5 * exponent));
}

/*
   Computes the stiffness of each unknown: the diagonal of A or, where that is not positive, the largest entry of the
   row; 0 in rows of zeros. positive: there are no other rows where it is not
*/
static PetscErrorCode Stiffness(Mat A, Vec *stiffness, PetscBool *positive)
{
  const AinsworthMatFacts *facts;
  AinsworthRef<Mat>        aij;
  AinsworthRef<Vec>        largest;

  PetscFunctionBegin;
  PetscCall(AinsworthGetFacts(A, &facts));
  PetscCall(AinsworthCreateDiagonal(A, stiffness));
  *positive = PETSC_TRUE;
  if (facts->rows && !facts->positive) {
    PetscCall(AinsworthGetAIJ(A, aij.out()));
    PetscCall(VecDuplicate(*stiffness, largest.out()));
    PetscCall(MatGetRowMaxAbs(aij, largest, NULL));
    PetscCall(AinsworthUpdate(*stiffness, {largest}, [=](PetscInt, PetscScalar &d, PetscScalar entry) {
      if (PetscRealPart(d) > 0.0) return;
      d = entry;
      if (entry != 0.0) *positive = PETSC_FALSE;
    }));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, positive, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)A)));
  }
  PetscCall(AinsworthUpdate(*stiffness, [](PetscInt, PetscScalar &d) { d = PetscMax(PetscRealPart(d), 0.0); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A matrix whose rows, and columns, are scaled in each sweep; NULL if the block is absent */
struct Block {
  Mat  mat = NULL;
  bool row = false, column = false; /* whether they belong to the multipliers */
};

/* Raises `most` to the largest entry of each row, where the rows are those of the field */
static PetscErrorCode RaiseToRows(const std::vector<Block> &blocks, bool field, Vec work, Vec most)
{
  PetscFunctionBegin;
  for (const Block &b : blocks) {
    if (b.row != field) continue;
    PetscCall(MatGetRowMaxAbs(b.mat, work, NULL));
    PetscCall(AinsworthUpdate(
      most, {work}, [](PetscInt, PetscScalar &m, PetscScalar w) { m = PetscMax(PetscRealPart(m), PetscRealPart(w)); }));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the geometric mean of the entries that are not 0; 1 if there are none. Collective */
static PetscErrorCode GeometricMean(Vec v, PetscReal *mean)
{
  PetscReal sums[2] = {0.0, 0.0};

  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({v}, [&](PetscInt, PetscScalar a) {
    if (!(PetscRealPart(a) > 0.0) || PetscIsInfOrNanScalar(a)) return;
    sums[0] += PetscLogReal(PetscRealPart(a));
    sums[1] += 1.0;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)v)));
  *mean = sums[1] > 0.0 ? PetscExpReal(sums[0] / sums[1]) : 1.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Begins with one number for all unknowns and one for all multipliers, so that the units of A and of C do not matter;
   work: overwritten
*/
static PetscErrorCode Start(const std::vector<Block> &blocks, Vec stiffness, AinsworthSaddleVec scale,
                            AinsworthSaddleVec work)
{
  PetscReal s, t;
  Vec       rows;

  PetscFunctionBegin;
  PetscCall(VecZeroEntries(work.dual));
  PetscCall(VecDuplicate(work.dual, &rows));
  for (const Block &b : blocks)
    if (b.row && !b.column) PetscCall(RaiseToRows({b}, true, rows, work.dual));
  PetscCall(VecDestroy(&rows));
  PetscCall(GeometricMean(stiffness, &s));
  PetscCall(GeometricMean(work.dual, &t));
  s = InverseRoot(s);
  t = InverseRoot(t) * InverseRoot(t) / s;
  PetscCall(VecSet(scale.primal, s));
  PetscCall(VecSet(scale.dual, t));
  for (const Block &b : blocks) PetscCall(MatScale(b.mat, (b.row ? t : s) * (b.column ? t : s)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Equilibrates by the largest entries of rows and columns (Ruiz 2001), with the diagonal in place of A

   An entry of a positive definite A is at most the root of the product of two diagonal entries. Each sweep halves the
   decades that are left between rows, and one that changes nothing is the last
*/
static PetscErrorCode Equilibrate(const std::vector<Block> &blocks, Vec stiffness, AinsworthSaddleVec scale)
{
  static const int   sweeps = 8; /* 2^8 decades */
  AinsworthSaddleVec most, work;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleVecDuplicate(scale, &most));
  PetscCall(AinsworthSaddleVecDuplicate(scale, &work));
  PetscCall(Start(blocks, stiffness, scale, most));
  for (int sweep = 0; sweep < sweeps; sweep++) {
    PetscBool changed = PETSC_FALSE;

    PetscCall(VecPointwiseMult(most.primal, scale.primal, scale.primal));
    PetscCall(VecPointwiseMult(most.primal, most.primal, stiffness));
    PetscCall(VecZeroEntries(most.dual));
    PetscCall(RaiseToRows(blocks, false, work.primal, most.primal));
    PetscCall(RaiseToRows(blocks, true, work.dual, most.dual));
    for (Vec v : {most.primal, most.dual}) {
      PetscCall(AinsworthUpdate(v, [&](PetscInt, PetscScalar &m) {
        m = InverseRoot(PetscRealPart(m));
        if (m != 1.0) changed = PETSC_TRUE;
      }));
    }
    PetscCall(
      MPIU_Allreduce(MPI_IN_PLACE, &changed, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)stiffness)));
    if (!changed) break;
    for (const Block &b : blocks)
      PetscCall(MatDiagonalScale(b.mat, b.row ? most.dual : most.primal, b.column ? most.dual : most.primal));
    PetscCall(VecPointwiseMult(scale.primal, scale.primal, most.primal));
    PetscCall(VecPointwiseMult(scale.dual, scale.dual, most.dual));
  }
  PetscCall(AinsworthSaddleVecDestroy(&most));
  PetscCall(AinsworthSaddleVecDestroy(&work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleScale - finds the scale of the program's system, its unknowns without stiffness, and its rows with
   springs. Collective

   The scale is made of positive powers of 2, so that the largest entry of each row and column of the scaled [A B'; C
   -D] is about 1. An unknown that no stiffer row holds gets A_ii^{-1/2}, no other one more: an error t in the energy
   norm leaves at most 2 t in each scaled row (Cauchy-Schwarz)
*/
PetscErrorCode AinsworthSaddleScale(AinsworthSaddle *sp)
{
  std::vector<Block> blocks;
  Mat                copy;

  PetscFunctionBegin;
  PetscCall(Stiffness(sp->block[AINSWORTH_BLOCK_A], sp->stiffness.out(), &sp->positive));
  PetscCall(AinsworthForEntries({sp->stiffness}, [sp](PetscInt, PetscScalar d) { sp->loose.push_back(d == 0.0); }));
  PetscCall(VecDuplicate(sp->stiffness, sp->scale.primal.out()));
  PetscCall(AinsworthCreateVecs(sp->all.C, NULL, sp->scale.dual.out()));
  for (Mat C : {(Mat)sp->all.C, (Mat)sp->all.B}) {
    if (sp->oneSided() && blocks.size()) continue;
    PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &copy));
    blocks.push_back({copy, true, false});
    PetscCall(MatTranspose(C, MAT_INITIAL_MATRIX, &copy));
    blocks.push_back({copy, false, true});
  }
  sp->sprung.assign(sp->local(), false);
  if (sp->all.D) {
    PetscCall(MatDuplicate(sp->all.D, MAT_COPY_VALUES, &copy));
    blocks.push_back({copy, true, true});
    PetscCall(AinsworthForRows(copy, [sp](const AinsworthMatRow &row) {
      sp->sprung[row.local] = std::any_of(row.a, row.a + row.n, [](PetscScalar v) { return v != 0.0; });
    }));
  }
  PetscCall(Equilibrate(blocks, sp->stiffness, sp->scale));
  for (Block &b : blocks) PetscCall(MatDestroy(&b.mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}
