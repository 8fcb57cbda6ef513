/* Conjugate gradients in Ker C: KSPPROJECTEDCG, and other methods that are switched to it */
#ifndef AINSWORTH_PROJECTEDCG_H
#define AINSWORTH_PROJECTEDCG_H

#include "../petsccompat.h"

PETSC_INTERN PetscErrorCode KSPCreate_ProjectedCG(KSP);
PETSC_INTERN PetscErrorCode KSPProjectedCGSetUse_Private(KSP, PetscBool);
PETSC_INTERN PetscErrorCode KSPProjectedCGGetUse_Private(KSP, PetscBool *);
PETSC_INTERN PetscErrorCode KSPProjectedCGGetDirection_Private(KSP, Vec *);

/* deflation.cpp */
struct Mat_Ainsworth;
PETSC_INTERN PetscErrorCode KSPProjectedCGForget_Private(Mat_Ainsworth *);
PETSC_INTERN PetscErrorCode KSPProjectedCGLift_Private(PC, Mat, Mat_Ainsworth *);
PETSC_INTERN PetscErrorCode KSPProjectedCGPrecondition_Private(PC, Mat, Mat_Ainsworth *, Vec, Vec);

#endif
