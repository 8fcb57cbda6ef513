/* SNESAINSWORTHACTIVESET: Newton's method and an active set for multipliers with bounds */
#ifndef AINSWORTH_ACTIVESET_H
#define AINSWORTH_ACTIVESET_H

#include <petscainsworth.h>
#include <petscsnes.h>
#include "../petsccompat.h"
#include <set>
#include <vector>

/* What a row that has bounds is given in the next step */
enum AinsworthHold : signed char {
  HOLD_NONE, /* its equation */
  HOLD_LOWER,
  HOLD_UPPER
};

struct SNES_AinsworthActiveSet {
  PetscReal tolerance = 1e-8;
  PetscReal loose     = 1e-2; /* relative tolerance of linear solves after which rows may change */

  /* rows.cpp */
  std::vector<PetscInt>      rows;         /* the local ones that have bounds */
  std::vector<AinsworthHold> hold;         /* of each local row */
  std::set<uint64_t>         seen;         /* the sets there were */
  PetscInt                   wrong, least; /* rows that must change, now and when rows began to change one by one */
  bool                       single;       /* they do */
  bool                       tight;        /* a set came again after loose solves: no more of them */
  PetscReal                  largest;      /* residual of a row with bounds, so far */

  /* step.cpp */
  Vec                        bounded = NULL; /* 1 where there is a bound, else 0 */
  Mat                        step = NULL, pstep = NULL;
  std::vector<AinsworthHold> solved;   /* hold when these matrices were made */
  uint64_t                   state[2]; /* of the Jacobian then */
  PetscReal                  asked;    /* relative tolerance of the linear solver, whatever the step takes */
  PetscReal                  reached;  /* by the last linear solve, of its right-hand side */
  PetscReal                  left;     /* what it may have left, of the energy norm of x; negative: there was none, or it left rows wrong */
  bool                       exact;    /* not more than was asked for */
  bool                       linear;   /* F was what its Jacobian said */
  PetscReal                  diagonal; /* the largest entry of the Jacobian's */
};

/* rows.cpp */
PetscErrorCode AinsworthActiveSetFindWrong(SNES, SNES_AinsworthActiveSet *, bool first, std::vector<AinsworthHold> &wanted);
PetscErrorCode AinsworthActiveSetChange(SNES, SNES_AinsworthActiveSet *, const std::vector<AinsworthHold> &wanted, bool *cycles);

/* step.cpp */
PetscErrorCode AinsworthActiveSetSolveStep(SNES, SNES_AinsworthActiveSet *, Vec keep, Vec known, Vec rhs, Vec Y);
PetscErrorCode AinsworthActiveSetTakeStep(SNES, Vec before, Vec Y);
PetscErrorCode AinsworthActiveSetJudgeStep(SNES, SNES_AinsworthActiveSet *, Vec before, Vec JY, Vec Y);

/* stepmatrix.cpp: J where keep is 1; rows and columns where it is 0 have -1 on the diagonal and nothing else. bounded: 1 where keep may ever be 0 */
PetscErrorCode AinsworthStepMatCreate(Mat J, Vec bounded, Vec keep, Mat *step);
PetscErrorCode AinsworthStepMultKnown(Mat J, Vec known, Vec product);

PETSC_INTERN PetscErrorCode SNESCreate_AinsworthActiveSet(SNES);

#endif
