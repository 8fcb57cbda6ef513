/* The elimination of a Hermitian matrix, told from its pattern: orderings, and what a Cholesky factorization costs */
#ifndef AINSWORTH_SYMBOLIC_H
#define AINSWORTH_SYMBOLIC_H

#include "../petsccompat.h"

/* Nested dissection by METIS, which PETSc knows only where it was configured with METIS; registered with the plugin */
static const char AinsworthDissection[] = "ainsworthnd";

/* The ordering of the prediction, for who factors the matrix that it is attached to; registered with the plugin */
static const char AinsworthPredicted[] = "ainsworthpredicted";

/* The ordering that is tried first, with little fill on networks as well as on surfaces, and cheap (docs/gram.md) */
#if defined(PETSC_HAVE_SUITESPARSE)
static const char *const AinsworthOrdering = MATORDERINGAMD;
#else
static const char *const AinsworthOrdering = AinsworthDissection;
#endif

struct AinsworthCost {
  PetscReal entries, operations; /* of the factor; multiplications and additions: the squares of its column counts */
};

PetscErrorCode AinsworthFactorPredict(Mat, MatOrderingType, PetscInt bs, AinsworthCost *, IS *);
PetscErrorCode AinsworthOrderingAttach(IS, Mat);
PetscErrorCode AinsworthOrderingGet(Mat, MatOrderingType, IS *, IS *);

#endif
