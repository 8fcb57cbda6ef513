/* Conjugate gradients in Ker C: KSPPROJECTEDCG, and other methods that are made to do so */
#ifndef AINSWORTH_PROJECTEDCG_H
#define AINSWORTH_PROJECTEDCG_H

#include "../petsccompat.h"

PETSC_INTERN PetscErrorCode KSPCreate_ProjectedCG(KSP);
PETSC_INTERN PetscErrorCode KSPProjectedCGSetUse_Private(KSP, PetscBool);
PETSC_INTERN PetscErrorCode KSPProjectedCGGetUse_Private(KSP, PetscBool *);

/* longrows.cpp */
struct Mat_Ainsworth;
PETSC_INTERN PetscErrorCode KSPProjectedCGForgetLongRows_Private(Mat_Ainsworth *, PetscInt);
PETSC_INTERN PetscErrorCode KSPProjectedCGLiftLongRows_Private(PC, Mat_Ainsworth *);
PETSC_INTERN PetscErrorCode KSPProjectedCGTakeLongRows_Private(const Mat_Ainsworth *, Vec, Vec);

#endif
