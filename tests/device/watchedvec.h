/*
   Vectors and matrices that stand for those of a device: PETSc's own operations count as work there, and an access to
   the numbers of a vector that were changed on the other side counts as a copy of it
*/
#ifndef TESTS_WATCHEDVEC_H
#define TESTS_WATCHEDVEC_H

#include <base/petsccompat.h>
#include <petscmat.h>

#define VECWATCHED "watched"

PetscErrorCode WatchedRegister(void);
/* Makes products with an AIJ matrix those of a device, and its vectors watched ones */
PetscErrorCode WatchedSetMat(Mat);
/* Copies since the start, of vectors of this global length */
PetscInt WatchedCopies(PetscInt length);

#endif
