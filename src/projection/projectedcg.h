/* KSPPROJECTEDCG, and what we read of PETSc's conjugate gradients */
#ifndef AINSWORTH_PROJECTEDCG_H
#define AINSWORTH_PROJECTEDCG_H

#include "../base/petsccompat.h"

PETSC_INTERN PetscErrorCode KSPCreate_ProjectedCG(KSP);
PETSC_INTERN PetscErrorCode KSPProjectedCGGetDirection_Private(KSP, Vec *);

#endif
