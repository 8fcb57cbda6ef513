/* Read access to the rows of a SeqAIJ matrix */
#ifndef AINSWORTH_CSR_H
#define AINSWORTH_CSR_H

#include "petsccompat.h"

struct AinsworthCSR {
  Mat                mat = NULL;
  PetscInt           n   = 0;
  const PetscInt    *ia = nullptr, *ja = nullptr;
  const PetscScalar *a = nullptr;

  PetscErrorCode open(Mat M)
  {
    PetscBool done;

    PetscFunctionBegin;
    mat = M;
    PetscCall(MatGetRowIJ(M, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    PetscAssert(done, PETSC_COMM_SELF, PETSC_ERR_PLIB, "A matrix that is not SeqAIJ");
    PetscCall(MatSeqAIJGetArrayRead(M, &a));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscErrorCode close()
  {
    PetscBool done;

    PetscFunctionBegin;
    PetscCall(MatSeqAIJRestoreArrayRead(mat, &a));
    PetscCall(MatRestoreRowIJ(mat, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

#endif
