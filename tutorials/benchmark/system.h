/* A saddle-point system from files that the options -A, -C, -f, -g name */
#ifndef TUTORIALS_SYSTEM_H
#define TUTORIALS_SYSTEM_H

#include "files.h"

/* given: whether any of the options is there; A, C and f are required then, g is zero without a file */
PetscErrorCode SystemLoad(MPI_Comm, PetscBool *given, Mat *A, Mat *C, Vec *f, Vec *g);

#endif
