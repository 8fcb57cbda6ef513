/* A x = f, without constraints, solved by a KSP that the options choose */
#ifndef TUTORIALS_ALONE_H
#define TUTORIALS_ALONE_H

#include "saddle.h"

/*
   As PCAINSWORTH's own reduced solve has it, CG to 1e-8 in the natural norm, unless told otherwise. C has no rows; X:
   coordinates for the preconditioner, or NULL
*/
PetscErrorCode AloneSolve(Mat A, Mat C, Vec f, Vec X, SaddleSolution *);
/* Seconds, once all ranks are here */
PetscErrorCode AloneNow(MPI_Comm, PetscReal *seconds);

#endif
