/*
   Public face of libainsworthslepc.so: vibration modes of constrained models

       [ A  C' ] [ x ]          [ M  0 ] [ x ]
       [ C  0  ] [ l ] = lambda [ 0  0 ] [ l ]

   by multigrid, as a SLEPc eigensolver (EPSAINSWORTH). See docs/modes.md.
*/
#ifndef SLEPCAINSWORTH_H
#define SLEPCAINSWORTH_H

#include <petscainsworth.h>
#include <slepceps.h>

#define EPSAINSWORTH "ainsworth"

PETSC_EXTERN PetscErrorCode AinsworthSlepcInitializePackage(void);

PETSC_EXTERN PetscErrorCode EPSAinsworthSetShift(EPS, PetscReal);
PETSC_EXTERN PetscErrorCode EPSAinsworthGetShift(EPS, PetscReal *);

#endif
