/* A saddle-point system [A B'; C -D] from files that the options -A, -B, -C, -D, -f, -g name */
#ifndef TUTORIALS_SYSTEM_H
#define TUTORIALS_SYSTEM_H

#include "files.h"
#include "saddle.h"

/* given: whether any of the options is there; A, C and f are required then, g and D are zero without a file, B is C */
PetscErrorCode SystemLoad(MPI_Comm, PetscBool *given, SaddleBlocks *, Vec *f, Vec *g);
PetscErrorCode SystemDestroy(SaddleBlocks *);

#endif
