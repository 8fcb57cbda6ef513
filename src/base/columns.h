/* The values of a vector at the columns of the local rows of an AIJ matrix */
#ifndef AINSWORTH_COLUMNS_H
#define AINSWORTH_COLUMNS_H

#include "matrices.h"
#include <algorithm>
#include <vector>

class AinsworthAtColumns {
public:
  /* v: laid out as the columns of M. Collective */
  PetscErrorCode create(Mat M, Vec v)
  {
    Mat                part[2];
    const PetscInt    *columns;
    const PetscScalar *a;
    PetscInt           n;
    Vec                here;

    PetscFunctionBegin;
    PetscCall(AinsworthAIJGetParts(M, part, &columns, &n));
    ghosts.assign(columns, columns + n);
    PetscCall(VecGetOwnershipRange(v, &first, &end));
    PetscCall(VecGetArrayRead(v, &a));
    values.assign(a, a + (end - first));
    PetscCall(VecRestoreArrayRead(v, &a));
    PetscCall(AinsworthVecGather(v, n, columns, &here));
    PetscCall(VecGetArrayRead(here, &a));
    values.insert(values.end(), a, a + n);
    PetscCall(VecRestoreArrayRead(here, &a));
    PetscCall(VecDestroy(&here));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* Returns the value at a column, given by its global number */
  PetscScalar operator()(PetscInt j) const
  {
    if (j >= first && j < end) return values[j - first];
    return values[end - first + (std::lower_bound(ghosts.begin(), ghosts.end(), j) - ghosts.begin())];
  }

private:
  PetscInt                 first = 0, end = 0;
  std::vector<PetscInt>    ghosts; /* columns of other ranks, ascending */
  std::vector<PetscScalar> values; /* of the own columns, then of the ghosts */
};

#endif
