/* Matrices and vectors in files: PETSc binary or Matrix Market, whichever the first bytes say */
#ifndef TUTORIALS_FILES_H
#define TUTORIALS_FILES_H

#include "compat.h"
#include <petscmat.h>

enum FileFormat {
  FILE_PETSC_BINARY,
  FILE_MATRIX_MARKET
};

struct FileInfo {
  FileFormat format;
  PetscInt   rows, columns;
  PetscInt   blockSize; /* of a PETSc matrix, from its companion file .info; else 1 */
};

/* What is in the file, an error unless it is a matrix, or a vector */
PetscErrorCode FileGetInfo(MPI_Comm, const char file[], PetscBool vector, FileInfo *);
/* Into a matrix or vector whose sizes are set */
PetscErrorCode FileLoadMat(const char file[], const FileInfo &, Mat);
PetscErrorCode FileLoadVec(const char file[], const FileInfo &, Vec);
/* Matrix Market if the name ends in .mtx, else PETSc binary */
PetscErrorCode FileSaveVec(const char file[], Vec);

/* The same for Matrix Market alone; read and written by rank 0 */
PetscErrorCode MarketGetInfo(MPI_Comm, const char file[], FileInfo *);
PetscErrorCode MarketLoadMat(const char file[], Mat);
PetscErrorCode MarketLoadVec(const char file[], Vec);
PetscErrorCode MarketSaveVec(const char file[], Vec);

#endif
