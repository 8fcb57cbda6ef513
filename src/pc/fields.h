/* f and g, or x and lambda, in the program's fields */
#ifndef AINSWORTH_PC_FIELDS_H
#define AINSWORTH_PC_FIELDS_H

#include "../petsccompat.h"

struct PCAinsworthFields {
  Vec primal, dual;
};

static inline PetscErrorCode PCAinsworthFieldsDuplicate(PCAinsworthFields like, PCAinsworthFields *y)
{
  PetscFunctionBegin;
  PetscCall(VecDuplicate(like.primal, &y->primal));
  PetscCall(VecDuplicate(like.dual, &y->dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode PCAinsworthFieldsDestroy(PCAinsworthFields *y)
{
  PetscFunctionBegin;
  PetscCall(VecDestroy(&y->primal));
  PetscCall(VecDestroy(&y->dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those of a vector, to be restored */
static inline PetscErrorCode PCAinsworthFieldsGet(Vec v, const IS fields[], PCAinsworthFields *y)
{
  PetscFunctionBegin;
  PetscCall(VecGetSubVector(v, fields[0], &y->primal));
  PetscCall(VecGetSubVector(v, fields[1], &y->dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode PCAinsworthFieldsRestore(Vec v, const IS fields[], PCAinsworthFields *y)
{
  PetscFunctionBegin;
  PetscCall(VecRestoreSubVector(v, fields[0], &y->primal));
  PetscCall(VecRestoreSubVector(v, fields[1], &y->dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
