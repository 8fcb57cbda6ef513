/* What a pencil does to several vectors at once, the columns of dense matrices */
#include "pencil.h"

PetscErrorCode AinsworthPencil::findBlock()
{
  PetscBool aij = PETSC_FALSE, alone = PETSC_TRUE, same;
  Mat       diagonal[2];
  PetscInt  n[2] = {};

  PetscFunctionBegin;
  if (sums.size() != 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompareAny((PetscObject)(Mat)sums[0].sum, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)(Mat)sums[0].mass, &same, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(MatGetLocalSize(sums[0].sum, &rows, NULL));
  if (in) {
    PetscInt m, k;

    PetscCall(MatNestGetSize(shifted, &m, &k));
    if (m != 2 || k != 2) PetscFunctionReturn(PETSC_SUCCESS);
    for (PetscInt i = 0; i < 2; i++) {
      Vec part;

      PetscCall(MatNestGetSubMat(shifted, i, i, &diagonal[i]));
      PetscCall(VecNestGetSubVec(in, i, &part));
      PetscCall(VecGetLocalSize(part, &n[i]));
    }
    const PetscInt at = diagonal[1] == sums[0].sum;

    if (diagonal[at] != sums[0].sum) PetscFunctionReturn(PETSC_SUCCESS);
    offset = at ? n[0] : 0;
    alone  = (PetscBool)(n[!at] == (PetscInt)multipliers.size() &&
                        (multipliers.empty() || multipliers[0] == (at ? 0 : n[0])));
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &alone, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)K)));
  if (!aij || !same || !alone) PetscFunctionReturn(PETSC_SUCCESS);
  block[0] = sums[0].sum;
  block[1] = sums[0].mass;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies between the rows of the blocks and all rows, in the columns that X has */
static PetscErrorCode CopyRows(bool back, PetscInt offset, PetscInt rows, Mat X, Mat part)
{
  PetscScalar *x, *p;
  PetscInt     n, ldx, ldp;

  PetscFunctionBegin;
  PetscCall(MatGetSize(X, NULL, &n));
  PetscCall(MatDenseGetLDA(X, &ldx));
  PetscCall(MatDenseGetLDA(part, &ldp));
  PetscCall(MatDenseGetArray(X, &x));
  PetscCall(MatDenseGetArray(part, &p));
  for (PetscInt j = 0; j < n; j++) {
    PetscScalar *whole = x + (size_t)j * ldx + offset, *some = p + (size_t)j * ldp;

    PetscCall(PetscArraycpy(back ? whole : some, back ? some : whole, rows));
  }
  PetscCall(MatDenseRestoreArray(part, &p));
  PetscCall(MatDenseRestoreArray(X, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::multBlock(int k, Mat X, Mat Y)
{
  Mat      product = to[k];
  PetscInt columns;

  PetscFunctionBegin;
  if (block[k]) {
    PetscCall(MatMatMult(block[k], from, product ? MAT_REUSE_MATRIX : MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
    if (!to[k]) to[k] = AinsworthOwn(product);
    PetscCall(MatZeroEntries(Y));
    PetscCall(CopyRows(true, offset, rows, Y, to[k]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetSize(X, NULL, &columns));
  for (PetscInt j = 0; j < columns; j++) {
    Vec x, y;

    PetscCall(MatDenseGetColumnVecRead(X, j, &x));
    PetscCall(MatDenseGetColumnVecWrite(Y, j, &y));
    PetscCall(mult(k ? M : shifted, x, y));
    PetscCall(MatDenseRestoreColumnVecWrite(Y, j, &y));
    PetscCall(MatDenseRestoreColumnVecRead(X, j, &x));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPencil::multAll(Mat X, Mat KX, Mat MX)
{
  PetscInt columns, before = -1;

  PetscFunctionBegin;
  if (block[0]) {
    PetscCall(MatGetSize(X, NULL, &columns));
    if (from) PetscCall(MatGetSize(from, NULL, &before));
    if (columns != before) {
      for (AinsworthRef<Mat> &product : to) product.reset();
      PetscCall(MatCreateDense(PetscObjectComm((PetscObject)K), rows, PETSC_DECIDE, PETSC_DETERMINE, columns, NULL,
                               from.out()));
    }
    PetscCall(CopyRows(false, offset, rows, X, from));
  }
  PetscCall(multBlock(0, X, KX));
  PetscCall(multBlock(1, X, MX));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPMatSolve() would make the one application of KSPRICHARDSON column by column */
PetscErrorCode AinsworthPencil::precondition(Mat R, Mat Z) const
{
  PetscBool richardson;
  PetscInt  steps;
  PC        pc;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPRICHARDSON, &richardson));
  PetscCall(KSPGetTolerances(ksp, NULL, NULL, NULL, &steps));
  if (!richardson || steps != 1) {
    PetscCall(KSPMatSolve(ksp, R, Z));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCPreSolve(pc, ksp));
  PetscCall(PCMatApply(pc, R, Z));
  PetscCall(PCPostSolve(pc, ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}
