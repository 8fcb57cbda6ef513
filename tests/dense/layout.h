/* Programs' ways to pass [A C'; C 0] and its vectors, and solutions against dense LU */
#ifndef TESTS_LAYOUT_H
#define TESTS_LAYOUT_H

#include "dense.h"

/* How the program passes its system */
struct Layout {
  enum {
    EXPLICIT,
    TRANSPOSE,
    HERMITIAN,
    ABSENT
  } ct   = HERMITIAN;
  bool c = true, view = false, empty = false, first = false, nestedVectors = false; /* view: C is that of a transpose */
};

PetscErrorCode LayoutCreate(const System &, const Layout &, Mat *nest);
/* Solves with what is set in ksp; x and lambda as dense columns */
PetscErrorCode SolveFields(KSP ksp, const System &, bool first, bool nestedVectors, Column &x, Column &lambda,
                           bool transposed = false);
PetscErrorCode CheckSolution(KSP ksp, const System &, const DenseSystem &, bool first, bool nestedVectors,
                             PetscReal tolerance, PetscReal rounding = 1e-14);

#endif
