/* A saddle-point system [A B'; C -D][x; lambda] = [f; g] as a MatNest, solved by a KSP that the options choose */
#ifndef TUTORIALS_SADDLE_H
#define TUTORIALS_SADDLE_H

#include "compat.h"
#include <petscksp.h>

/* Not owned */
struct SaddleBlocks {
  Mat A, C;
  Mat B = NULL; /* as C, if NULL */
  Mat D = NULL; /* zero, if NULL */
};

struct SaddleSolution {
  Vec                x, lambda;
  PetscReal          setupSeconds, solveSeconds;
  double             setupProcessor = 0, solveProcessor = 0; /* seconds of the processor, of this rank */
  double             setupPages = 0, solvePages = 0;         /* that this rank touched for the first time */
  double             peak = 0;                               /* bytes in use at most, beyond those before the set-up */
  PetscInt           iterations;
  KSPConvergedReason reason;
};

PetscErrorCode SaddleSolve(const SaddleBlocks &, Vec f, Vec g, SaddleSolution *);
PetscErrorCode SaddleSolutionDestroy(SaddleSolution *);
/* In PETSc's binary format, <prefix>_A.dat and so on; X: coordinates */
PetscErrorCode SaddleWrite(Mat A, Mat C, Vec f, Vec g, Vec X, const char prefix[]);

#endif
