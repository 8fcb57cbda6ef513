/* Conjugate gradients in Ker C: KSPPROJECTEDCG, and other methods that are made to do so */
#ifndef AINSWORTH_PROJECTEDCG_H
#define AINSWORTH_PROJECTEDCG_H

#include "../petsccompat.h"

PETSC_INTERN PetscErrorCode KSPCreate_ProjectedCG(KSP);
PETSC_INTERN PetscErrorCode KSPProjectedCGSetUse_Private(KSP, PetscBool);
PETSC_INTERN PetscErrorCode KSPProjectedCGGetUse_Private(KSP, PetscBool *);

#endif
