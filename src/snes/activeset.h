/* SNESAINSWORTHACTIVESET: Newton's method with an active set for multipliers with bounds */
#ifndef AINSWORTH_ACTIVESET_H
#define AINSWORTH_ACTIVESET_H

#include <petscainsworth.h>
#include <petscsnes.h>
#include "../base/petsccompat.h"
#include <set>
#include <vector>

/* How a bounded row is treated in the next step: held at a bound or not */
enum AinsworthHold : signed char {
  HOLD_NONE, /* its equation is solved */
  HOLD_LOWER,
  HOLD_UPPER
};

struct SNES_AinsworthActiveSet {
  PetscReal tolerance = 1e-8;
  PetscReal loose     = 1e-2; /* relative tolerance of linear solves after which rows may change */

  /* rows.cpp */
  std::vector<PetscInt>      rows; /* local rows with bounds */
  std::vector<AinsworthHold> hold; /* of each local row */
  std::set<uint64_t>         seen; /* hashes of the sets so far */
  /* number of rows that must change: now, and the least before rows changed one by one */
  PetscInt  wrong = 0, least = 0;
  bool      single  = false; /* rows change one by one */
  bool      tight   = false; /* a set recurred after loose solves, which are no longer used */
  PetscReal largest = 0.0;   /* residual of a bounded row so far */

  /* step.cpp */
  Vec                        bounded = NULL; /* 1 where there is a bound, else 0 */
  Mat                        step = NULL, pstep = NULL;
  std::vector<AinsworthHold> solved;         /* hold when these matrices were made */
  uint64_t                   state[2] = {};  /* of the Jacobians then */
  PetscReal                  asked    = 0.0; /* relative tolerance of the linear solver before it is loosened */
  PetscReal                  reached  = 0.0; /* relative residual of the last linear solve */
  /* estimated error that it left, relative to the energy norm of x; negative without a solve, or with wrong rows */
  PetscReal left     = 0.0;
  bool      exact    = false; /* that error is within the requested tolerance */
  bool      linear   = false; /* F agreed with its linearization */
  PetscReal diagonal = 0.0;   /* largest diagonal entry of the Jacobian */
};

/* rows.cpp */
PetscErrorCode AinsworthActiveSetFindWrong(SNES_AinsworthActiveSet *, Vec X, Vec F, Vec lower, Vec upper, bool first,
                                           std::vector<AinsworthHold> &wanted);
PetscErrorCode AinsworthActiveSetChange(SNES, SNES_AinsworthActiveSet *, const std::vector<AinsworthHold> &wanted,
                                        bool *cycles);

/* step.cpp */
PetscErrorCode AinsworthActiveSetSolveStep(SNES, SNES_AinsworthActiveSet *, Vec keep, Vec known, Vec rhs, Vec Y);
PetscErrorCode AinsworthActiveSetJudgeStep(SNES, SNES_AinsworthActiveSet *, Vec before, Vec JY, Vec Y);

/*
   stepmatrix.cpp: J with -1 on the diagonal and zeros elsewhere in rows and columns where keep is 0; bounded: 1 where
   keep may ever be 0
*/
PetscErrorCode AinsworthStepMatCreate(Mat J, Vec bounded, Vec keep, Mat *step);
PetscErrorCode AinsworthStepMultKnown(Mat J, Vec known, Vec product);

PETSC_INTERN PetscErrorCode SNESCreate_AinsworthActiveSet(SNES);

#endif
