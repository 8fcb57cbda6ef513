/* Unknowns that many rows of C share, such as master or reference nodes, which would make the Gram matrix dense */
#ifndef AINSWORTH_SHARED_H
#define AINSWORTH_SHARED_H

#include "../base/petsccompat.h"

PetscErrorCode AinsworthSharedUnweigh(Mat, Mat, Vec, PetscBool *);
PetscErrorCode AinsworthCopyWeighted(Mat, Vec, Mat *);

#endif
