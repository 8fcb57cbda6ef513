/* Access to the arrays of AIJ matrices, and arrays of matrices under construction */
#ifndef AINSWORTH_ARRAYS_H
#define AINSWORTH_ARRAYS_H

#include "csr.h"
#include <petscsf.h>
#include <memory>
#include <vector>

/* CSR arrays under construction: row r has the entries i[r] to i[r + 1] */
struct AinsworthRows {
  std::vector<PetscInt>          i{0};
  std::unique_ptr<PetscInt[]>    j;
  std::unique_ptr<PetscScalar[]> a;

  void reserve(size_t entries)
  {
    j.reset(new PetscInt[entries]);
    a.reset(new PetscScalar[entries]);
  }
};

/* The same for matrices with few entries; columns are global and ascending within each row */
struct AinsworthEntries {
  std::vector<PetscInt>    start{0}, columns;
  std::vector<PetscScalar> values;

  void add(PetscInt column, PetscScalar value)
  {
    columns.push_back(column);
    values.push_back(value);
  }
  void endRow() { start.push_back((PetscInt)columns.size()); }
};

PetscErrorCode AinsworthMatCreateFromRows(MPI_Comm, PetscInt, std::unique_ptr<AinsworthRows>,
                                          std::unique_ptr<AinsworthRows>, Mat *);
PetscErrorCode AinsworthCreateAIJ(MPI_Comm, PetscInt, const AinsworthEntries &, Mat *);
PetscErrorCode AinsworthCreateAIJLike(Mat, const AinsworthEntries &, Mat *);
PetscErrorCode AinsworthAIJGetParts(Mat, Mat[2], const PetscInt *[], PetscInt *);
PetscErrorCode AinsworthColumnsCreateSF(Mat, PetscSF *);

#endif
