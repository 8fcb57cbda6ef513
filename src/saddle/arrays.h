/* The arrays of AIJ matrices, of given ones and of those in the making */
#ifndef AINSWORTH_ARRAYS_H
#define AINSWORTH_ARRAYS_H

#include "../petsccompat.h"
#include <petsc/private/petscimpl.h>
#include <memory>
#include <vector>

/* Rows in the making: those of row r are i[r] to i[r + 1] */
struct AinsworthRows {
  std::vector<PetscInt>          i{0};
  std::unique_ptr<PetscInt[]>    j;
  std::unique_ptr<PetscScalar[]> a;

  void reserve(PetscInt entries)
  {
    j.reset(new PetscInt[entries]);
    a.reset(new PetscScalar[entries]);
  }
};

/* A sequential AIJ; no rows where there is none */
struct AinsworthPart {
  Mat                mat = NULL;
  PetscInt           n   = 0;
  const PetscInt    *i = NULL, *j = NULL;
  const PetscScalar *a = NULL;
};

PetscErrorCode AinsworthMatCreateFromRows(MPI_Comm, PetscInt, std::unique_ptr<AinsworthRows>, std::unique_ptr<AinsworthRows>, Mat *);
PetscErrorCode AinsworthPartGet(Mat, AinsworthPart *);
PetscErrorCode AinsworthPartRestore(AinsworthPart *);
PetscErrorCode AinsworthAIJGetParts(Mat, Mat[2], const PetscInt *[], PetscInt *);

#endif
