/* Vectors and matrices on the layouts of other matrices, so that no rank asks the others for what these know */
#ifndef AINSWORTH_LAYOUTS_H
#define AINSWORTH_LAYOUTS_H

#include "petsccompat.h"

PetscErrorCode AinsworthVecsOnHost(Mat, PetscBool *);
PetscErrorCode AinsworthCreateVecs(Mat, Vec *, Vec *);
PetscErrorCode AinsworthCreateShell(Mat, void *, Mat *);
PetscErrorCode AinsworthCreateShellOn(MPI_Comm, PetscLayout, PetscLayout, void *, Mat *);
PetscErrorCode AinsworthLayoutOfSize(MPI_Comm, PetscInt, PetscLayout *);
PetscErrorCode AinsworthLayoutOfBlocks(MPI_Comm, PetscLayout, PetscInt, PetscInt, PetscLayout *);

#endif
