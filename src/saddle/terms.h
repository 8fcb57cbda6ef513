/* The magnitude of the terms of each row of both equations, to which its residual is compared */
#ifndef AINSWORTH_TERMS_H
#define AINSWORTH_TERMS_H

#include "saddle.h"

/* Rounding of a right inverse through a Gram matrix with a condition number of 1e8, relative to the terms |C_i| |x| + |g_i| of a row of C x = g */
static const PetscReal AinsworthConsistent = 1e-8;
/* Rounding that a row receives from the others through S, relative to the largest |x| */
static const PetscReal AinsworthCombined = 1e3 * PETSC_MACHINE_EPSILON;
/* The fraction of AinsworthCombined that every row is allowed, whatever other rows show, also after further solves */
static const PetscReal AinsworthCombinedLeast = 0.03;
/* The least size of the terms of a row, relative to the largest of all, if the energy also reflects small terms */
static const PetscReal AinsworthSmallTerms = 1e-3;

PetscErrorCode AinsworthDuplicateAbs(Vec, Vec *);
PetscErrorCode AinsworthAbsoluteMultTranspose(Mat, Vec, Vec);
PetscErrorCode AinsworthTermsPrimal(const AinsworthSaddle *, PetscBool, PetscReal, Vec, AinsworthSaddleVec, Vec, Vec);
PetscErrorCode AinsworthTermsDual(AinsworthSaddle *, PetscReal, PetscReal, Vec, AinsworthSaddleVec, Vec, Vec *);
PetscErrorCode AinsworthTermsStiffness(const AinsworthSaddle *, Vec *);
PetscErrorCode AinsworthTermsDisplacement(Vec, Vec, PetscReal *, PetscReal *);
PetscErrorCode AinsworthTermsSoftest(const AinsworthSaddle *, PetscReal *);
PetscErrorCode AinsworthTermsThroughRows(const AinsworthSaddle *, Vec, PetscReal, Vec, Vec);
PetscErrorCode AinsworthTermsRaise(const AinsworthSaddle *, Vec, PetscReal, Vec);
PetscErrorCode AinsworthTermsSpread(const AinsworthSaddle *, Vec, Vec);

/* Returns the ratio of a residual to its bound, infinite if either is NaN or the bound overflows */
inline PetscReal AinsworthQuotient(PetscReal residual, PetscReal bound)
{
  if (residual == 0.0) return 0.0;
  const PetscReal quotient = residual / bound;
  return quotient >= 0.0 && !PetscIsInfOrNanReal(bound) ? PetscMin(quotient, PETSC_MAX_REAL) : PETSC_MAX_REAL;
}

#endif
