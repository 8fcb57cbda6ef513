/* Contact of two cubes without friction as one nonlinear problem, whose active rows a SNES finds */
#ifndef TUTORIALS_ACTIVESET_H
#define TUTORIALS_ACTIVESET_H

#include "cubes.h"

struct ActiveSetResult {
  PetscInt  steps, iterations; /* of Newton's method, and of all its linear solves */
  double    seconds;           /* of the processors */
  PetscBool converged;
};

/* x of least energy with C x >= g, by the SNES of the options; fresh: each step begins with a new solver */
PetscErrorCode ActiveSetSolve(const CubesSystem &, PetscBool fresh, Vec x, ActiveSetResult *);

#endif
