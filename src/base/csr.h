/* Read-only access to the rows of a SeqAIJ matrix; a NULL matrix has no rows */
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
    MatType   type;

    PetscFunctionBegin;
    mat = M;
    if (!M) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(MatGetRowIJ(M, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    PetscCall(MatGetType(M, &type));
    PetscCheck(done, PETSC_COMM_SELF, PETSC_ERR_PLIB, "The type %s does not give its arrays", type);
    PetscCall(MatSeqAIJGetArrayRead(M, &a));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscErrorCode close()
  {
    PetscBool done;

    PetscFunctionBegin;
    if (!mat) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(MatSeqAIJRestoreArrayRead(mat, &a));
    PetscCall(MatRestoreRowIJ(mat, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

#endif
