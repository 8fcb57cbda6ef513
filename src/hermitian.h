/* What complex numbers need beside real ones */
#ifndef AINSWORTH_HERMITIAN_H
#define AINSWORTH_HERMITIAN_H

#include "petsccompat.h"

/* y = conj(f(conj(x))): the transpose of a Hermitian operator, f itself in real arithmetic */
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
