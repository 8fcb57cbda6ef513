/* Symbolic factorization of a Hermitian matrix: orderings, and the cost of a Cholesky factor */
#ifndef AINSWORTH_SYMBOLIC_H
#define AINSWORTH_SYMBOLIC_H

#include "../base/petsccompat.h"

/* Nested dissection by METIS, available even if PETSc was configured without METIS; registered with the plugin */
static const char AinsworthDissection[] = "ainsworthnd";

/*
   The ordering attached to a matrix by AinsworthOrderingAttach(), used for the prediction; registered with the plugin
*/
static const char AinsworthPredicted[] = "ainsworthpredicted";

/* The ordering tried first: cheap, with little fill on networks as well as on surfaces (docs/cost.md) */
#if defined(PETSC_HAVE_SUITESPARSE)
static const char *const AinsworthOrdering = MATORDERINGAMD;
#else
static const char *const AinsworthOrdering = AinsworthDissection;
#endif

struct AinsworthCost {
  /* entries of the factor; operations: multiplications and additions, the sum of its squared column counts */
  PetscReal entries = 0.0, operations = 0.0;
};

PetscErrorCode AinsworthFactorPredict(Mat, MatOrderingType, PetscInt bs, AinsworthCost *, IS *);
PetscErrorCode AinsworthOrderingAttach(IS, Mat);
PetscErrorCode AinsworthOrderingGet(Mat, MatOrderingType, IS *, IS *);

#endif
