/* The exact solution of a saddle-point system: direct, with iterative refinement in extended precision */
#ifndef TUTORIALS_REFERENCE_H
#define TUTORIALS_REFERENCE_H

#include "saddle.h"

/* Solver options have the prefix reference_; the default is MUMPS */
PetscErrorCode ReferenceCompute(const SaddleBlocks &, Vec f, Vec g, Vec x, Vec lambda);
/* x and lambda, one after the other, in PETSc's binary format */
PetscErrorCode ReferenceSave(const char file[], Vec x, Vec lambda);
PetscErrorCode ReferenceLoad(const char file[], Vec x, Vec lambda);

#endif
