/* The connected components of the Gram matrix, and the ranks that solve with each of them */
#ifndef AINSWORTH_PLACEMENT_H
#define AINSWORTH_PLACEMENT_H

#include "../petsccompat.h"
#include <vector>

/* Where the rows of S are solved for */
struct AinsworthPlacement {
  IS                    rows = NULL;        /* rows of S that this rank solves for, component by component; NULL: its own, in their order */
  std::vector<PetscInt> sizes;              /* of the components of this rank, in the order of its rows */
  PetscInt              components = 0;     /* in all */
  PetscInt              largest    = 0;     /* rows of the largest component */
  PetscInt              ranks      = 0;     /* that solve for any row */
  PetscInt              small      = 0;     /* components of up to so many rows are small: their rows stand together */
  bool                  split      = false; /* a component lies on several ranks */
};

PetscErrorCode AinsworthPlacementCreate(Mat, Mat, PetscInt, PetscInt, AinsworthPlacement *);
PetscErrorCode AinsworthPlacementReset(AinsworthPlacement *);

#endif
