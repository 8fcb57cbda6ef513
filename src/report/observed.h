/* An operator that remembers x' A x of its last product: what conjugate gradients need besides r' z to tell their coefficients */
#ifndef AINSWORTH_OBSERVED_H
#define AINSWORTH_OBSERVED_H

#include "../petsccompat.h"

PetscErrorCode AinsworthObservedCreate(Mat, Mat *);
PetscErrorCode AinsworthObservedGet(Mat, PetscInt *products, PetscReal *xAx, PetscLogDouble *seconds);

#endif
