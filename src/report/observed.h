/*
   An operator that records p' A p for the search direction p of a KSPCG, which together with r' z gives the
   coefficients of conjugate gradients
*/
#ifndef AINSWORTH_OBSERVED_H
#define AINSWORTH_OBSERVED_H

#include "../base/petsccompat.h"

PetscErrorCode AinsworthObservedCreate(Mat, KSP, Mat *);
PetscErrorCode AinsworthObservedGet(Mat, PetscInt *products, PetscReal *xAx, PetscLogDouble *seconds);

#endif
