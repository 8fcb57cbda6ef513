/* SNESAINSWORTHACTIVESET: Newton's method and an active set for multipliers with bounds */
#ifndef AINSWORTH_ACTIVESET_H
#define AINSWORTH_ACTIVESET_H

#include <petscainsworth.h>
#include <petscsnes.h>
#include "../petsccompat.h"

/* stepmatrix.cpp: J where keep is 1; rows and columns where it is 0 have -1 on the diagonal and nothing else. bounded: 1 where keep may ever be 0 */
PetscErrorCode AinsworthStepMatCreate(Mat J, Vec bounded, Vec keep, Mat *step);

PETSC_INTERN PetscErrorCode SNESCreate_AinsworthActiveSet(SNES);

#endif
