/* KSPPROJECTEDCG: conjugate gradients in Ker C */
#ifndef AINSWORTH_PROJECTEDCG_H
#define AINSWORTH_PROJECTEDCG_H

#include "../petsccompat.h"

PETSC_INTERN PetscErrorCode KSPCreate_ProjectedCG(KSP);
PETSC_INTERN PetscErrorCode KSPProjectedCGGetCoefficients_Private(KSP, PetscReal *, PetscReal *);

#endif
