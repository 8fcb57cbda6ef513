/* Iterative refinement with solvers that are given as functions */
#ifndef TESTS_STEPS_H
#define TESTS_STEPS_H

#include "system.h"

/* What a solver answers to the residual r, call by call, in all of the program's rows */
using Answer = std::function<Column(const Column &r, int call)>;

struct Run {
  AinsworthOutcome outcome;
  int              calls = 0;
  Column           y, left;
};

PetscErrorCode Refine(Setup *, const AinsworthRequest &, const Column &b, const Column &y, const Answer &, Run *);
Answer         Inverse(const Setup &, PetscReal error, bool transpose = false);

#endif
