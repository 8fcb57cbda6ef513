/* A reduced problem for KSPPROJECTEDCG */
#ifndef TESTS_PROBLEM_H
#define TESTS_PROBLEM_H

#include "dense.h"

/* KSPPROJECTEDCG on the reduced operator, Jacobi of A; A counts its products if asked to */
struct Problem {
  System      sys;
  DenseSystem d;
  Mat         S = NULL, shell = NULL;
  KSP         ksp = NULL;
  Vec         b = NULL, x = NULL;
  Dense       reduced;
};

PetscErrorCode ProblemCreate(const Spec &, bool counted, Problem *);
PetscErrorCode ProblemDestroy(Problem *);

/* calls of a counted A and of CountedApply(), a preconditioner for PCSHELL whose context is a factor */
extern int     products, preconditioned;
PetscErrorCode CountedApply(PC, Vec, Vec);

#endif
