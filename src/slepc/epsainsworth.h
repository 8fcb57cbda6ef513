/* EPSAINSWORTH: modes in Ker C by a block method with multigrid */
#ifndef AINSWORTH_EPSAINSWORTH_H
#define AINSWORTH_EPSAINSWORTH_H

#include "pencil.h"

struct EPS_Ainsworth {
  PetscReal       shift = PETSC_DECIDE; /* what the program chose; negative: chosen here */
  AinsworthPencil pencil;
  PetscObjectId   chosen = 0; /* the PC for which ChooseMethod() has chosen */
  /* what the program begins with, until a solve */
  std::vector<AinsworthRef<Vec>> initial;
};

PETSC_INTERN PetscErrorCode EPSCreate_Ainsworth(EPS);
/* Whether the program's pencil is (M, K), of which the largest eigenvalues are wanted; K and M themselves */
PETSC_INTERN bool           EPSAinsworthIsSwapped_Private(EPS);
PETSC_INTERN PetscErrorCode EPSAinsworthGetMatrices_Private(EPS, Mat *K, Mat *M);
/* lobpcg.cpp */
PETSC_INTERN PetscErrorCode EPSSolve_Ainsworth(EPS);

#endif
