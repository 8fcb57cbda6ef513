/* The elimination of a Hermitian matrix, told from its pattern: ordering, tree, what a Cholesky factorization costs */
#ifndef AINSWORTH_SYMBOLIC_H
#define AINSWORTH_SYMBOLIC_H

#include "../petsccompat.h"
#include <vector>

/* Of the orderings that PETSc may have the one with the least fill on networks as well as on surfaces (docs/gram.md) */
#if defined(PETSC_HAVE_SUITESPARSE)
static const char *const AinsworthOrdering = MATORDERINGAMD;
#elif defined(PETSC_HAVE_METIS)
static const char *const AinsworthOrdering = MATORDERINGMETISND;
#else
static const char *const AinsworthOrdering = MATORDERINGND;
#endif

/* The strictly lower triangle of a sequential matrix, by rows, in that ordering */
struct AinsworthTriangle {
  PetscInt                 m;
  std::vector<size_t>      start;
  std::vector<PetscInt>    column;
  std::vector<PetscScalar> value;
  std::vector<PetscReal>   diagonal;
  std::vector<PetscInt>    number; /* of each row of the matrix in that ordering */

  PetscErrorCode        create(Mat);
  std::vector<PetscInt> eliminationTree() const;
};

PetscErrorCode AinsworthFactorOperations(Mat, PetscReal *);

#endif
