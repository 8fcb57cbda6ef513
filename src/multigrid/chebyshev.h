/* KSPCHEBYSHEVSINGLE: Chebyshev's iteration with Jacobi in single precision, the smoother of the finest level of PCBLOCKSA */
#ifndef AINSWORTH_CHEBYSHEV_H
#define AINSWORTH_CHEBYSHEV_H

#include "levelmat.h"
#include <petscainsworth.h>

PETSC_INTERN PetscErrorCode KSPCreate_ChebyshevSingle(KSP);
PetscErrorCode              AinsworthChebyshevSetEigenvalues(KSP, PetscReal, PetscReal);
PetscErrorCode              AinsworthChebyshevResidual(Mat, Vec, Vec, Vec);

#endif
