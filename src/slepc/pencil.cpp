#include "pencil.h"
#include "../base/loops.h"
#include <petscainsworth.h>
#include <petscdm.h>
#include <cmath>

/* Gets M in the type of K */
static PetscErrorCode GetInTypeOf(Mat K, Mat M, Mat *mass)
{
  MatType   type, massType;
  PetscBool same, can;

  PetscFunctionBegin;
  PetscCall(MatGetType(K, &type));
  PetscCall(MatGetType(M, &massType));
  PetscCall(PetscStrcmp(type, massType, &same));
  PetscCall(MatHasOperation(M, MATOP_GET_ROW, &can));
  PetscCheck(same || can, PetscObjectComm((PetscObject)M), PETSC_ERR_SUP,
             "The preconditioner needs the entries of M, which a matrix of type %s does not give: assemble it as %s",
             massType, type);
  if (same) PetscCall(AinsworthShare(M, mass));
  else PetscCall(MatConvert(M, type, MAT_INITIAL_MATRIX, mass));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates K + sigma M, with what a preconditioner reads from K; mass: M in the type of K */
static PetscErrorCode Add(Mat K, PetscReal sigma, Mat mass, Mat *sum)
{
  MatNullSpace near;
  PetscInt     bs;
  DM           dm;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(K, MAT_COPY_VALUES, sum));
  PetscCall(MatGetBlockSize(K, &bs));
  PetscCall(MatAXPY(*sum, sigma, mass, DIFFERENT_NONZERO_PATTERN));
  if (bs > 1) PetscCall(MatSetBlockSize(*sum, bs));
  PetscCall(MatGetNearNullSpace(K, &near));
  if (!near) PetscCall(MatGetNullSpace(K, &near)); /* what K leaves free, K + sigma M leaves soft */
  PetscCall(MatSetNullSpace(*sum, NULL));
  PetscCall(MatSetNearNullSpace(*sum, near));
  PetscCall(MatGetDM(K, &dm));
  if (dm) PetscCall(MatSetDM(*sum, dm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode IsZero(Mat M, PetscBool *zero)
{
  PetscReal norm;
  PetscBool can;

  PetscFunctionBegin;
  *zero = PETSC_TRUE;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  *zero = PETSC_FALSE;
  PetscCall(MatHasOperation(M, MATOP_NORM, &can));
  if (!can) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNorm(M, NORM_FROBENIUS, &norm));
  *zero = (PetscBool)(norm == 0.0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a block of K + sigma M; K or M may be NULL */
PetscErrorCode AinsworthPencil::createSum(Mat block, Mat mass, AinsworthRef<Mat> *made)
{
  PetscBool    zero;
  MatNullSpace null = NULL;
  Sum          s;

  PetscFunctionBegin;
  PetscCall(IsZero(mass, &zero));
  if (zero) {
    *made = AinsworthRetain(block);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (block) {
    PetscCall(GetInTypeOf(block, mass, s.mass.out()));
    PetscCall(MatGetNullSpace(block, &null));
    if (shift == 0.0 && !null) s.sum = AinsworthRetain(block); /* which is not changed: there is no other shift */
    else PetscCall(Add(block, shift, s.mass, s.sum.out()));
  } else {
    PetscCall(MatDuplicate(mass, MAT_COPY_VALUES, s.sum.out()));
    PetscCall(MatScale(s.sum, shift));
    s.mass = AinsworthRetain(mass);
  }
  *made = s.sum;
  sums.push_back(s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::createSums()
{
  PetscBool nest, massNest;
  PetscInt  rows, cols, massRows, massCols;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)K, MATNEST, &nest));
  PetscCall(PetscObjectTypeCompare((PetscObject)M, MATNEST, &massNest));
  PetscCheck(nest == massNest, PetscObjectComm((PetscObject)M), PETSC_ERR_ARG_INCOMP,
             "One of K and M is a MATNEST, the other is not: give M the blocks of K, NULL where it has no entries");
  if (!nest) {
    PetscCall(createSum(K, M, &shifted));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatNestGetSize(K, &rows, &cols));
  PetscCall(MatNestGetSize(M, &massRows, &massCols));
  PetscCheck(rows == massRows && cols == massCols, PetscObjectComm((PetscObject)M), PETSC_ERR_ARG_INCOMP,
             "K has %" PetscInt_FMT " x %" PetscInt_FMT " blocks and M %" PetscInt_FMT " x %" PetscInt_FMT
             ": give M the blocks of K, NULL where it has no entries",
             rows, cols, massRows, massCols);
  std::vector<IS>                isRows(rows), isCols(cols);
  std::vector<AinsworthRef<Mat>> blocks(rows * cols);
  std::vector<Mat>               all;
  PetscCall(MatNestGetISs(K, isRows.data(), isCols.data()));
  for (PetscInt i = 0; i < rows; i++)
    for (PetscInt j = 0; j < cols; j++) {
      Mat block, massBlock;

      PetscCall(MatNestGetSubMat(K, i, j, &block));
      PetscCall(MatNestGetSubMat(M, i, j, &massBlock));
      PetscCall(createSum(block, massBlock, &blocks[i * cols + j]));
      all.push_back(blocks[i * cols + j]);
    }
  PetscCall(MatCreateNest(PetscObjectComm((PetscObject)K), rows, isRows.data(), cols, isCols.data(), all.data(),
                          shifted.out()));
  PetscCall(MatNestSetVecType(shifted, VECNEST));
  PetscCall(MatCreateVecs(shifted, in.out(), out.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the places of the multipliers, which the preconditioner knows */
PetscErrorCode AinsworthPencil::findMultipliers()
{
  PC              pc;
  IS              dual;
  Vec             marks;
  PetscInt        n;
  const PetscInt *rows;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetFields(pc, NULL, &dual));
  if (!dual) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(createVec(&marks));
  PetscCall(ISGetLocalSize(dual, &n));
  PetscCall(ISGetIndices(dual, &rows));
  for (PetscInt i = 0; i < n; i++) PetscCall(VecSetValue(marks, rows[i], 1.0, INSERT_VALUES));
  PetscCall(ISRestoreIndices(dual, &rows));
  PetscCall(VecAssemblyBegin(marks));
  PetscCall(VecAssemblyEnd(marks));
  PetscCall(AinsworthForEntries({marks}, [&](PetscInt i, PetscScalar mark) {
    if (mark != 0.0) multipliers.push_back(i);
  }));
  PetscCall(VecDestroy(&marks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::build(Mat stiffness, Mat mass, KSP solver, PetscReal sigma)
{
  PetscFunctionBegin;
  *this = AinsworthPencil();
  K     = AinsworthRetain(stiffness);
  M     = AinsworthRetain(mass);
  ksp   = solver;
  shift = sigma;
  PetscCall(createSums());
  PetscCall(setUp());
  PetscCall(findMultipliers());
  PetscCall(checkMass());
  PetscCall(findBlock());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::changeShift(PetscReal sigma)
{
  PetscFunctionBegin;
  for (const Sum &s : sums) PetscCall(MatAXPY(s.sum, sigma - shift, s.mass, SUBSET_NONZERO_PATTERN));
  shift = sigma;
  if (in) PetscCall(AinsworthStateIncrease((PetscObject)(Mat)shifted));
  PetscCall(setUp());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::setUp()
{
  PetscFunctionBegin;
  PetscCall(KSPSetOperators(ksp, shifted, shifted));
  PetscCall(KSPSetUp(ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   By the diagonals of A and M: the geometric mean of A_ii / M_ii is near the largest eigenvalue of a mesh of one size,
   and the lowest is smaller by the square of the nodes along an edge
*/
PetscErrorCode AinsworthEstimateLowest(Mat K, Mat M, PetscReal *lowest)
{
  PetscReal sums[2] = {};
  Vec       a, m;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(K, &a, NULL));
  PetscCall(VecDuplicate(a, &m));
  PetscCall(MatGetDiagonal(K, a));
  PetscCall(MatGetDiagonal(M, m));
  PetscCall(AinsworthForEntries({a, m}, [&](PetscInt, PetscScalar aii, PetscScalar mii) {
    if (PetscRealPart(aii) <= 0.0 || PetscRealPart(mii) <= 0.0) return;
    sums[0] += std::log(PetscRealPart(aii) / PetscRealPart(mii));
    sums[1]++;
  }));
  PetscCall(VecDestroy(&a));
  PetscCall(VecDestroy(&m));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)K)));
  PetscCheck(sums[1] > 0.0, PetscObjectComm((PetscObject)M), PETSC_ERR_ARG_WRONG,
             "No row has a positive diagonal entry in both K and M: pass the stiffness first and the mass second, "
             "EPSSetOperators(eps, K, M)");
  *lowest = std::exp(sums[0] / sums[1]) * std::pow(sums[1], -2.0 / 3.0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::refuseIndefinite() const
{
  PetscFunctionBegin;
  PetscCheck(shift > 0.0, PetscObjectComm((PetscObject)K), PETSC_ERR_ARG_OUTOFRANGE,
             "K is not positive definite where the constraints are met: a body floats that no constraint holds, or is "
             "unstable. Modes of free bodies are the smallest eigenvalues of (K, M): pass K first, without a shift");
  SETERRQ(PetscObjectComm((PetscObject)K), PETSC_ERR_ARG_OUTOFRANGE,
          "K + %g M is not positive definite where the constraints are met: K has an eigenvalue below %g, or the shift "
          "is lost in rounding. Give a larger one with -eps_ainsworth_shift",
          (double)shift, (double)-shift);
}

PetscErrorCode AinsworthPencil::checkDefinite(Vec x) const
{
  static const PetscReal rounding = 1e3 * PETSC_MACHINE_EPSILON; /* of x' K x, over x' diag(K) x */
  PetscScalar            energy;
  Vec                    diagonal, Dx;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(K, &diagonal, NULL));
  PetscCall(MatGetDiagonal(shifted, diagonal));
  PetscCall(VecDuplicate(x, &Dx));
  PetscCall(
    AinsworthUpdate(Dx, {x, diagonal}, [](PetscInt, PetscScalar &a, PetscScalar b, PetscScalar d) { a = d * b; }));
  PetscCall(VecDot(Dx, x, &energy));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(VecDestroy(&Dx));
  if (rounding * PetscAbsScalar(energy) >= 1.0) PetscCall(refuseIndefinite());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::createVec(Vec *v) const
{
  PetscInt n;

  PetscFunctionBegin;
  if (in) {
    PetscCall(MatGetLocalSize(K, &n, NULL));
    PetscCall(VecCreate(PetscObjectComm((PetscObject)K), v));
    PetscCall(VecSetSizes(*v, n, PETSC_DETERMINE));
    PetscCall(VecSetType(*v, VECSTANDARD));
  } else PetscCall(MatCreateVecs(K, v, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::copy(Vec from, Vec to) const
{
  PetscFunctionBegin;
  if (in) PetscCall(AinsworthUpdate(to, {from}, [](PetscInt, PetscScalar &a, PetscScalar b) { a = b; }));
  else PetscCall(VecCopy(from, to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::mult(Mat matrix, Vec x, Vec y) const
{
  PetscFunctionBegin;
  if (in) {
    PetscCall(copy(x, in));
    PetscCall(MatMult(matrix, in, out));
    PetscCall(copy(out, y));
  } else PetscCall(MatMult(matrix, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::multShifted(Vec x, Vec y) const
{
  PetscFunctionBegin;
  PetscCall(mult(shifted, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::multMass(Vec x, Vec y) const
{
  PetscFunctionBegin;
  PetscCall(mult(M, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::precondition(Vec r, Vec z) const
{
  KSPConvergedReason reason;
  PC                 pc;
  const char        *why;

  PetscFunctionBegin;
  if (in) {
    PetscCall(copy(r, in));
    PetscCall(KSPSolve(ksp, in, out));
    PetscCall(copy(out, z));
  } else PetscCall(KSPSolve(ksp, r, z));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  if (reason > 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  SETERRQ(PetscObjectComm((PetscObject)ksp), PETSC_ERR_NOT_CONVERGED, "The preconditioner of K + %g M failed (%s): %s",
          (double)shift, KSPConvergedReasons[reason], why);
}

PetscErrorCode AinsworthPencil::removeMultipliers(Vec v) const
{
  PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(VecGetArray(v, &a));
  for (PetscInt i : multipliers) a[i] = 0.0;
  PetscCall(VecRestoreArray(v, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::keepMultipliers(Vec v) const
{
  Vec rest;

  PetscFunctionBegin;
  PetscCall(AinsworthVecClone(v, &rest));
  PetscCall(removeMultipliers(rest));
  PetscCall(VecAXPY(v, -1.0, rest));
  PetscCall(VecDestroy(&rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses an M with entries in rows or columns of multipliers, which products with random vectors show */
PetscErrorCode AinsworthPencil::checkMass() const
{
  /* sums of three products round off far less */
  const PetscReal rounding = 1e3 * PETSC_MACHINE_EPSILON;
  Vec             x, y;
  PetscReal       all, wrong;
  PetscInt        row;

  PetscFunctionBegin;
  PetscCall(createVec(&x));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(AinsworthVecSetRandom(x));
  PetscCall(multMass(x, y));
  PetscCall(VecNorm(y, NORM_INFINITY, &all));
  PetscCall(keepMultipliers(y));
  PetscCall(VecAbs(y));
  PetscCall(VecMax(y, &row, &wrong));
  PetscCheck(wrong <= rounding * all, PetscObjectComm((PetscObject)M), PETSC_ERR_ARG_WRONG,
             "M has entries in row %" PetscInt_FMT
             ", which belongs to a multiplier: a mass matrix has none there. Leave them out; K comes first, "
             "EPSSetOperators(eps, K, M), but second with -eps_largest_real",
             row);
  PetscCall(keepMultipliers(x));
  PetscCall(multMass(x, y));
  PetscCall(VecNorm(y, NORM_INFINITY, &wrong));
  PetscCheck(wrong <= rounding * all, PetscObjectComm((PetscObject)M), PETSC_ERR_ARG_WRONG,
             "M has entries in columns of multipliers: a mass matrix has none there");
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}
