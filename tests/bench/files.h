/* Matrices and vectors in PETSc's binary files */
#ifndef TUTORIALS_FILES_H
#define TUTORIALS_FILES_H

#include "compat.h"
#include <petscmat.h>

struct FileInfo {
  PetscInt rows, columns;
  PetscInt blockSize; /* of a matrix, from its companion file .info; else 1 */
};

/* What is in the file, an error unless it is a matrix, or a vector */
PetscErrorCode FileGetInfo(MPI_Comm, const char file[], PetscBool vector, FileInfo *);
/* Into a matrix or vector whose sizes are set */
PetscErrorCode FileLoadMat(const char file[], Mat);
PetscErrorCode FileLoadVec(const char file[], Vec);
PetscErrorCode FileSaveVec(const char file[], Vec);

#endif
