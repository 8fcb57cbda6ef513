/* What the terms of the rows of both equations amount to: the measure of their residuals */
#ifndef AINSWORTH_TERMS_H
#define AINSWORTH_TERMS_H

#include "saddle.h"

/* Of what a row of C x = g holds, |C_i| |x| + |g_i|, the rounding of a right inverse through a Gram matrix with a condition number of 1e8 */
static const PetscReal AinsworthConsistent = 1e-8;
/* What a row gets from the others through S, relative to the largest |x| */
static const PetscReal AinsworthCombined = 1e3 * PETSC_MACHINE_EPSILON;
/* The part of that which a row may have whatever others show, and after further solves */
static const PetscReal AinsworthCombinedLeast = 0.03;
/* What the terms of a row count at least, as a part of the largest of all, where the energy is fair to small ones, too */
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

/* quotient of a residual and its bound, infinite where either is not a number: a bound that overflows allows nothing */
inline PetscReal AinsworthQuotient(PetscReal residual, PetscReal bound)
{
  if (residual == 0.0) return 0.0;
  const PetscReal quotient = residual / bound;
  return quotient >= 0.0 && !PetscIsInfOrNanReal(bound) ? PetscMin(quotient, PETSC_MAX_REAL) : PETSC_MAX_REAL;
}

#endif
