/* The values of a vector at the columns of the local rows of an AIJ matrix */
#ifndef AINSWORTH_COLUMNS_H
#define AINSWORTH_COLUMNS_H

#include "matrices.h"
#include "objects.h"
#include <algorithm>
#include <vector>

/* Reads the vector as long as it exists */
class AinsworthAtColumns {
public:
  AinsworthAtColumns()                           = default;
  AinsworthAtColumns(const AinsworthAtColumns &) = delete;
  ~AinsworthAtColumns()
  {
    if (vector) (void)VecRestoreArrayRead(vector, &own);
    if (there) (void)VecRestoreArrayRead(there, &others);
  }

  /* v: laid out as the columns of M. Collective */
  PetscErrorCode create(Mat M, Vec v)
  {
    Mat             part[2];
    const PetscInt *columns;
    PetscInt        n;

    PetscFunctionBegin;
    PetscCall(AinsworthAIJGetParts(M, part, &columns, &n));
    ghosts.assign(columns, columns + n);
    vector = AinsworthRetain(v);
    PetscCall(VecGetOwnershipRange(v, &first, &end));
    PetscCall(AinsworthVecGather(v, n, columns, there.out()));
    PetscCall(VecGetArrayRead(there, &others));
    PetscCall(VecGetArrayRead(v, &own));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* Returns the value at a column, given by its global number */
  PetscScalar operator()(PetscInt j) const
  {
    if (j >= first && j < end) return own[j - first];
    if (last + 1 < ghosts.size() && ghosts[last + 1] == j) last++; /* as rows are read, the next one is usual */
    else last = std::lower_bound(ghosts.begin(), ghosts.end(), j) - ghosts.begin();
    return others[last];
  }

private:
  PetscInt              first = 0, end = 0;
  std::vector<PetscInt> ghosts;   /* columns of other ranks, ascending */
  mutable size_t        last = 0; /* the ghost that was read last */
  AinsworthRef<Vec>     vector, there;
  const PetscScalar    *own = NULL, *others = NULL; /* values of the own columns, and of the ghosts */
};

#endif
