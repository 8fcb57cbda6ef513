/* A + E, where E has few nonzero rows: its norm, and the assembled sum, seen in a frame */
#ifndef AINSWORTH_SUM_H
#define AINSWORTH_SUM_H

#include "../projector/frame.h"

PetscErrorCode AinsworthSumNorm(Mat, Mat, PetscReal *);
PetscErrorCode AinsworthSum(Mat, Mat, const AinsworthFrame *, Mat *);

#endif
