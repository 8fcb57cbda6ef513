/* Helpers for complex arithmetic */
#ifndef AINSWORTH_HERMITIAN_H
#define AINSWORTH_HERMITIAN_H

#include "petsccompat.h"

/*
   Computes y = conj(f(conj(x))): applies the transpose of the Hermitian operator f; in real arithmetic this is f itself
*/
template <class F>
static inline PetscErrorCode AinsworthApplyConjugated(Vec x, Vec y, F f)
{
  Vec conjugate;

  PetscFunctionBegin;
  if (!PetscDefined(USE_COMPLEX)) {
    PetscCall(f(x, y));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecDuplicate(x, &conjugate));
  PetscCall(VecCopy(x, conjugate));
  PetscCall(VecConjugate(conjugate));
  PetscCall(f(conjugate, y));
  PetscCall(VecConjugate(y));
  PetscCall(VecDestroy(&conjugate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
