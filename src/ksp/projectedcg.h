/* Conjugate gradients in Ker C: KSPPROJECTEDCG, and other methods that are switched to it */
#ifndef AINSWORTH_PROJECTEDCG_H
#define AINSWORTH_PROJECTEDCG_H

#include "../petsccompat.h"
#include <vector>

PETSC_INTERN PetscErrorCode KSPCreate_ProjectedCG(KSP);
PETSC_INTERN PetscErrorCode KSPProjectedCGSetUse_Private(KSP, PetscBool);
PETSC_INTERN PetscErrorCode KSPProjectedCGGetUse_Private(KSP, PetscBool *);
PETSC_INTERN PetscErrorCode KSPProjectedCGGetDirection_Private(KSP, Vec *);

struct Mat_Ainsworth;
PETSC_INTERN PetscErrorCode KSPProjectedCGForget_Private(Mat_Ainsworth *);

/* longrows.cpp */
PETSC_INTERN PetscErrorCode KSPProjectedCGForgetLongRows_Private(Mat_Ainsworth *, PetscInt);
PETSC_INTERN PetscErrorCode KSPProjectedCGLiftLongRows_Private(PC, Mat_Ainsworth *);
PETSC_INTERN PetscErrorCode KSPProjectedCGTakeLongRows_Private(const Mat_Ainsworth *, Vec, Vec);

/* shared.cpp */
PETSC_INTERN PetscErrorCode KSPProjectedCGForgetShared_Private(Mat_Ainsworth *, const std::vector<PetscInt> &);
PETSC_INTERN PetscErrorCode KSPProjectedCGLiftShared_Private(PC, Mat, Mat_Ainsworth *);
PETSC_INTERN PetscErrorCode KSPProjectedCGPrecondition_Private(PC, Mat, Mat_Ainsworth *, Vec, Vec);

#endif
