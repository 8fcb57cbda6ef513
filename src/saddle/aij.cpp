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
