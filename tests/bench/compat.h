/* What these programs need to compile with PETSc 3.18 as well as with newer versions */
#ifndef TUTORIALS_COMPAT_H
#define TUTORIALS_COMPAT_H

#include <petscsys.h>

#if PETSC_VERSION_LT(3, 19, 0)
  #define PETSC_SUCCESS ((PetscErrorCode)0)
#endif
#if PETSC_VERSION_LT(3, 24, 0)
  #define SNESLINESEARCHSECANT SNESLINESEARCHL2
#endif

#endif
