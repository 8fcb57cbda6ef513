/* The connected pieces of the Gram matrix, and the ranks that solve with each of them */
#ifndef AINSWORTH_PIECES_H
#define AINSWORTH_PIECES_H

#include "../petsccompat.h"
#include <vector>

/* Where the rows of S are solved for */
struct AinsworthPlacement {
  IS                    rows = NULL;     /* rows of S that this rank solves for, piece by piece; NULL: its own, in their order */
  std::vector<PetscInt> sizes;           /* of the pieces of this rank, in the order of its rows */
  PetscInt              pieces  = 0;     /* in all */
  PetscInt              largest = 0;     /* rows of the largest piece */
  PetscInt              ranks   = 0;     /* that solve for any row */
  PetscInt              small   = 0;     /* pieces of up to so many rows are small: their rows stand together */
  bool                  split   = false; /* a piece lies on several ranks */
};

PetscErrorCode AinsworthPlacementCreate(Mat, Mat, PetscInt, PetscInt, AinsworthPlacement *);
PetscErrorCode AinsworthPlacementReset(AinsworthPlacement *);

#endif
