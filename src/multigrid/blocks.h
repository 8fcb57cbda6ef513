/* Block rows of a Hermitian matrix, distributed over the ranks: what block smoothed aggregation computes with */
#ifndef AINSWORTH_BLOCKS_H
#define AINSWORTH_BLOCKS_H

#include "../petsccompat.h"
#include <petscsf.h>
#include <vector>

/* n rows of blocks, br x bc each, stored row by row */
struct AinsworthBlockRows {
  PetscInt                 n = 0, br = 1, bc = 1;
  std::vector<PetscInt>    i, j;
  std::vector<PetscScalar> a;

  PetscInt           size() const { return br * bc; }
  const PetscScalar *block(PetscInt k) const { return a.data() + (size_t)k * size(); }
  PetscScalar       *block(PetscInt k) { return a.data() + (size_t)k * size(); }
};

/* The nodes that block columns stand for: those that this rank owns, at places 0 to local - 1, then ghosts, by rising numbers */
struct AinsworthColumns {
  PetscLayout           layout = NULL; /* of the nodes over the ranks */
  PetscInt              first = 0, local = 0;
  std::vector<PetscInt> ghosts;    /* numbers of the nodes */
  PetscSF               sf = NULL; /* from owners to ghosts; NULL on one rank */

  PetscErrorCode create(PetscLayout, std::vector<PetscInt> &&);
  PetscErrorCode destroy();
  PetscErrorCode toGhosts(MPI_Datatype, const void *, void *) const;

  PetscInt count() const { return local + (PetscInt)ghosts.size(); }
  PetscInt node(PetscInt place) const { return place < local ? first + place : ghosts[place - local]; }
  PetscInt place(PetscInt node) const;
};

struct AinsworthBlockMat {
  AinsworthBlockRows rows; /* columns are places in cols; square blocks */
  AinsworthColumns   cols;
};

/* An MPI type of some numbers in a row, freed at the end of its scope; one number is its own type, as MPI sums no other */
class AinsworthUnit {
public:
  AinsworthUnit(PetscInt n, MPI_Datatype base) : type(base), own(n != 1)
  {
    if (!own) return;
    (void)MPI_Type_contiguous((PetscMPIInt)n, base, &type);
    (void)MPI_Type_commit(&type);
  }
  ~AinsworthUnit()
  {
    if (own) (void)MPI_Type_free(&type);
  }
  AinsworthUnit(const AinsworthUnit &)            = delete;
  AinsworthUnit &operator=(const AinsworthUnit &) = delete;
  MPI_Datatype   type;

private:
  const bool own;
};

void           AinsworthSortUnique(std::vector<PetscInt> &);
PetscErrorCode AinsworthBlockMatCreate(Mat, PetscInt, AinsworthBlockMat *);
PetscErrorCode AinsworthRowsToGhosts(const AinsworthColumns &, const AinsworthBlockRows &, AinsworthBlockRows *);
PetscErrorCode AinsworthRowsToOwners(const AinsworthColumns &, const AinsworthBlockRows &, std::vector<PetscInt> *, AinsworthBlockRows *);

#endif
