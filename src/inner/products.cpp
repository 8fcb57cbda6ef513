/* Products of AIJ matrices that are made once */
#include "pmat.h"

/* AinsworthMultiply - computes left right. Collective */
PetscErrorCode AinsworthMultiply(Mat left, Mat right, Mat *product)
{
  PetscFunctionBegin;
  PetscCall(MatMatMult(left, right, MAT_INITIAL_MATRIX, PETSC_DEFAULT, product));
  PetscCall(MatProductClear(*product)); /* otherwise the product keeps its factors */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthMultiplyAdjoint - computes left' right. Collective */
PetscErrorCode AinsworthMultiplyAdjoint(Mat left, Mat right, Mat *product)
{
  Mat adjoint;

  PetscFunctionBegin;
  PetscCall(MatHermitianTranspose(left, MAT_INITIAL_MATRIX, &adjoint));
  PetscCall(AinsworthMultiply(adjoint, right, product));
  PetscCall(MatDestroy(&adjoint));
  PetscFunctionReturn(PETSC_SUCCESS);
}
