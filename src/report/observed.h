/* An operator that records x' A x of its last product, which together with r' z gives the coefficients of conjugate gradients */
#ifndef AINSWORTH_OBSERVED_H
#define AINSWORTH_OBSERVED_H

#include "../petsccompat.h"

PetscErrorCode AinsworthObservedCreate(Mat, Mat *);
PetscErrorCode AinsworthObservedGet(Mat, PetscInt *products, PetscReal *xAx, PetscLogDouble *seconds);

#endif
