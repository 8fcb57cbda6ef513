#include "saddle.h"

/*
   AinsworthGetAIJ - M itself where it is AIJ, otherwise a converted copy; to be destroyed

   On one rank the sequential type is what products and factorisations accept: of a MATMPIAIJ it is the diagonal block.
*/
PetscErrorCode AinsworthGetAIJ(Mat M, Mat *aij)
{
  PetscBool   is, mpi;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)M, &is, MATSEQAIJ, MATMPIAIJ, ""));
  if (is) {
    PetscCall(PetscObjectReference((PetscObject)M));
    *aij = M;
  } else PetscCall(MatConvert(M, MATAIJ, MAT_INITIAL_MATRIX, aij));
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)M), &size));
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)*aij, MATMPIAIJ, &mpi));
  if (mpi && size == 1) {
    Mat parallel = *aij, block;

    PetscCall(MatGetDiagonalBlock(parallel, &block));
    PetscCall(PetscObjectReference((PetscObject)block));
    PetscCall(MatDestroy(&parallel));
    *aij = block;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |M|, entry by entry, of an AIJ */
PetscErrorCode AinsworthAbsoluteAIJ(Mat M, Mat *absolute)
{
  Mat       block[2] = {NULL, NULL};
  PetscBool sequential;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(M, MAT_COPY_VALUES, absolute));
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)*absolute, MATSEQAIJ, &sequential));
  if (sequential) block[0] = *absolute;
  else PetscCall(MatMPIAIJGetSeqAIJ(*absolute, &block[0], &block[1], NULL));
  for (Mat part : block) {
    MatInfo      info;
    PetscScalar *v;

    if (!part) continue;
    PetscCall(MatGetInfo(part, MAT_LOCAL, &info));
    PetscCall(MatSeqAIJGetArray(part, &v));
    for (PetscInt k = 0; k < (PetscInt)info.nz_used; k++) v[k] = PetscAbsScalar(v[k]);
    PetscCall(MatSeqAIJRestoreArray(part, &v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sums = of each row of M the sum of |entry|^power, power 1 or 2 */
PetscErrorCode AinsworthRowSums(Mat M, int power, Vec sums)
{
  Mat          R;
  PetscInt     rstart, rend;
  PetscScalar *s;

  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(M, &R));
  PetscCall(MatGetOwnershipRange(R, &rstart, &rend));
  PetscCall(VecGetArrayWrite(sums, &s));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt           ncols;
    const PetscScalar *v;
    PetscReal          sum = 0.0;

    PetscCall(MatGetRow(R, i, &ncols, NULL, &v));
    for (PetscInt k = 0; k < ncols; k++) sum += power == 2 ? PetscSqr(PetscAbsScalar(v[k])) : PetscAbsScalar(v[k]);
    PetscCall(MatRestoreRow(R, i, &ncols, NULL, &v));
    s[i - rstart] = sum;
  }
  PetscCall(VecRestoreArrayWrite(sums, &s));
  PetscCall(MatDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}
