/* How well a vector solves the program's system, row by row, in the units of its scale */
#ifndef AINSWORTH_BACKWARDERROR_H
#define AINSWORTH_BACKWARDERROR_H

#include "../saddle/saddle.h"

/*
   The row of one equation with the largest residual relative to its terms; row: in the numbering of its field, -1 if
   all residuals are zero
*/
struct AinsworthWorstRow {
  PetscReal omega = 0.0, residual = 0.0, terms = 0.0;
  PetscInt  row = -1;
};

/*
   Half of all digits: an x of less than this of b, in units of the scale, is the rounding of forces that balance each
   other, and b is nearly that of a larger x
*/
static const PetscReal AinsworthRest = 1e-8;

/* Nobody asks for less: the rounding of products and of solves with S */
static const PetscReal AinsworthLeast = 1e-13;

/* Two digits: an x that rounding of the system moves by more of itself is not determined */
static const PetscReal AinsworthUndetermined = 0.01;

/* What rounding leaves at most, relative to the terms of its sum */
static const PetscReal AinsworthRoundoff = 10 * PETSC_MACHINE_EPSILON;

/*
   Componentwise backward error of both equations; dependent: of rows of C that were left out because they depend on
   others, whose solution they share
*/
struct AinsworthBackward {
  AinsworthWorstRow primal, dual, dependent;
  /* what the floor of dual rows, and what the energy excuses, is relative to, if they were looked at */
  PetscReal sizes[2] = {0.0, 0.0};
};

/*
   What rows are allowed: `relative` of their terms, `floor` of the largest terms of its equation in units of the scale,
   and `energetic` of the energy norm of x
*/
struct AinsworthMeasure {
  PetscReal relative = 0.0, floor = 0.0, energetic = 0.0;
};

/*
   Kinds of rows: those that A or a spring of D holds, whose residual costs energy; those of C without a spring; those
   where A is zero, with a force, or without: they hold multipliers alone, and a force that is given is no rounding,
   however small; those of C that are left out, although no others imply them
*/
enum {
  AINSWORTH_ROWS_HELD,
  AINSWORTH_ROWS_RIGID,
  AINSWORTH_ROWS_FORCED,
  AINSWORTH_ROWS_LOOSE,
  AINSWORTH_ROWS_NEAR,
  AINSWORTH_ROWS_KINDS
};
PetscErrorCode AinsworthBackwardError(const AinsworthSaddle *, PetscBool, const AinsworthMeasure[], Vec,
                                      AinsworthSaddleVec, AinsworthSaddleVec, Vec, AinsworthSaddleVec,
                                      AinsworthBackward *);
PetscErrorCode AinsworthAllowedOfConstraints(const AinsworthSaddle *, const AinsworthMeasure[], Vec, AinsworthSaddleVec,
                                             AinsworthSaddleVec, const AinsworthBackward *, Vec);
PetscErrorCode AinsworthLargestEntry(const AinsworthSaddle *, AinsworthSaddleVec, bool unknowns, PetscReal *);
PetscErrorCode AinsworthGrowth(const AinsworthSaddle *, AinsworthSaddleVec, Vec, PetscReal *);
PetscErrorCode AinsworthChange(const AinsworthSaddle *, AinsworthSaddleVec, Vec, Vec, PetscReal *);

#endif
