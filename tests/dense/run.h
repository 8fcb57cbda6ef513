/* One system given by dense matrices, solved by PCAINSWORTH, and how that ended */
#ifndef TESTS_RUN_H
#define TESTS_RUN_H

#include "layout.h"

struct Run {
  System             sys;
  Mat                nest = NULL;
  KSP                ksp  = NULL;
  Column             x, lambda;
  KSPConvergedReason reason;
  PCFailedReason     failure;
};

/* crossed: all unknowns on the first rank, all multipliers on the last one, nothing in between */
PetscErrorCode SystemFromDense(const DenseSystem &, bool crossed, System *);
PetscErrorCode RunCreate(const DenseSystem &, bool crossed, Run *);
/* The same with C', too, so that the matrix can be multiplied with, as outer methods do */
PetscErrorCode RunCreateWhole(const DenseSystem &, Run *);
PetscErrorCode RunSolve(Run *);
PetscErrorCode RunDestroy(Run *);
/* Springs of this stiffness between neighbors and to the ground; rows of C tie unknowns far from each other */
DenseSystem SpringsCreate(PetscInt n, PetscInt m, PetscReal stiffness, PetscInt seed);
/* Values that are not zero into a matrix that has places for them */
PetscErrorCode WriteDense(const Dense &, Mat);
/* Solves; the reason is positive, and both equations hold */
PetscErrorCode CheckSolved(Run *, const DenseSystem &);
/* KSP_DIVERGED_PC_FAILED, and a reason of the PC, on all ranks */
PetscErrorCode CheckFailed(const Run &);
/* Both equations, in units of their terms; each row of C on its own */
PetscErrorCode CheckResiduals(const Run &, const DenseSystem &, PetscReal primal, PetscReal constraint);

#endif
