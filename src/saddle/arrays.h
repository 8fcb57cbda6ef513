/* The arrays of AIJ matrices, of given ones and of those in the making */
#ifndef AINSWORTH_ARRAYS_H
#define AINSWORTH_ARRAYS_H

#include "../petsccompat.h"
#include <petsc/private/petscimpl.h>
#include <memory>
#include <vector>

/* Rows in the making: first their lengths, i[r + 1] - i[r], then memory for their entries */
struct AinsworthRows {
  std::vector<PetscInt>          i{0};
  std::unique_ptr<PetscInt[]>    j;
  std::unique_ptr<PetscScalar[]> a;

  void reserve()
  {
    j.reset(new PetscInt[i.back()]);
    a.reset(new PetscScalar[i.back()]);
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
