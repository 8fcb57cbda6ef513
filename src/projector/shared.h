/* Unknowns that many rows of C share, a master or a reference node, which would make the Gram matrix dense */
#ifndef AINSWORTH_SHARED_H
#define AINSWORTH_SHARED_H

#include "../petsccompat.h"

PetscErrorCode AinsworthSharedUnweigh(Mat, Mat, Vec, PetscBool *);
PetscErrorCode AinsworthSharedDrop(Vec, Mat *);

#endif
