/* Krylov methods that iterate in Ker C, KSPPROJECTEDCG among them */
#ifndef AINSWORTH_PROJECTEDCG_H
#define AINSWORTH_PROJECTEDCG_H

#include "../petsccompat.h"

PETSC_INTERN PetscErrorCode KSPCreate_ProjectedCG(KSP);
PETSC_INTERN PetscErrorCode KSPProjectedCGSetUse_Private(KSP, PetscBool);
PETSC_INTERN PetscErrorCode KSPProjectedCGGetUse_Private(KSP, PetscBool *);

#endif
