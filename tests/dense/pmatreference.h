/* M_* by dense formulas, with an Inv(S) that owes nothing to the plugin */
#ifndef TESTS_PMATREFERENCE_H
#define TESTS_PMATREFERENCE_H

#include "dense.h"
#include "inner/pmat.h"

/* What is tried with each system */
struct PmatChoice {
  PCAinsworthPmatType    type;
  MatAinsworthWeightType weight;
  AinsworthPenaltyType   penalty;
  PetscReal              factor; /* PETSC_DEFAULT: 0.5, 10 for id, 5 for norm */
  PetscInt               blocks;
  bool                   rowScaling;
  PCType                 inner = PCNONE; /* of the reduced solve */
};

/* As the options have it */
const char    *PenaltyName(AinsworthPenaltyType);
const char    *PmatName(int);
PetscErrorCode PmatReference(const DenseSystem &, bool symmetric, const PmatChoice &, Dense &M, Column &B);
/* PCAINSWORTH set up with this choice: the outer solver, which is to be destroyed, the reduced operator and M_* */
PetscErrorCode PmatSetUp(Mat A, Mat C, Vec w, const PmatChoice &, KSP *outer, Mat *S, Mat *M);

#endif
