/* What a Cholesky factorisation costs, told from the pattern alone */
#ifndef AINSWORTH_SYMBOLIC_H
#define AINSWORTH_SYMBOLIC_H

#include "../petsccompat.h"
#include <vector>

/* The pattern of the strictly lower triangle of a symmetric matrix, by rows */
struct AinsworthPattern {
  PetscInt              m;
  std::vector<size_t>   start;
  std::vector<PetscInt> column;
};

std::vector<PetscInt> AinsworthEliminationTree(const AinsworthPattern &);
PetscErrorCode        AinsworthFactorOperations(Mat, MatOrderingType, PetscReal *);

#endif
