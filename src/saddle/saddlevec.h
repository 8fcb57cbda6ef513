/* f and g, or x and lambda, in the program's fields */
#ifndef AINSWORTH_SADDLEVEC_H
#define AINSWORTH_SADDLEVEC_H

#include "../base/objects.h"

struct AinsworthSaddleVec {
  Vec primal = NULL, dual = NULL;
};

/* The same, with references of its own */
struct AinsworthSaddleVecRef {
  AinsworthRef<Vec> primal, dual;

  operator AinsworthSaddleVec() const { return {primal, dual}; }
};

static inline PetscErrorCode AinsworthSaddleVecDuplicate(AinsworthSaddleVec like, AinsworthSaddleVec *y)
{
  PetscFunctionBegin;
  PetscCall(VecDuplicate(like.primal, &y->primal));
  PetscCall(VecDuplicate(like.dual, &y->dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode AinsworthSaddleVecDestroy(AinsworthSaddleVec *y)
{
  PetscFunctionBegin;
  PetscCall(VecDestroy(&y->primal));
  PetscCall(VecDestroy(&y->dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode AinsworthSaddleVecZero(AinsworthSaddleVec y)
{
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(y.primal));
  PetscCall(VecZeroEntries(y.dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode AinsworthSaddleVecCopy(AinsworthSaddleVec x, AinsworthSaddleVec y)
{
  PetscFunctionBegin;
  PetscCall(VecCopy(x.primal, y.primal));
  PetscCall(VecCopy(x.dual, y.dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode AinsworthSaddleVecScale(AinsworthSaddleVec y, PetscScalar a)
{
  PetscFunctionBegin;
  PetscCall(VecScale(y.primal, a));
  PetscCall(VecScale(y.dual, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode AinsworthSaddleVecAXPY(AinsworthSaddleVec y, PetscScalar a, AinsworthSaddleVec x)
{
  PetscFunctionBegin;
  PetscCall(VecAXPY(y.primal, a, x.primal));
  PetscCall(VecAXPY(y.dual, a, x.dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
