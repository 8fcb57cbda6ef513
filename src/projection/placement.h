/* The connected components of the Gram matrix, and the ranks that solve with each of them */
#ifndef AINSWORTH_PLACEMENT_H
#define AINSWORTH_PLACEMENT_H

#include "labels.h"

/* Which rank solves for which row of S */
struct AinsworthPlacement {
  /* rows of S that this rank solves for, component by component; NULL: its own rows in their order */
  IS                    rows = NULL;
  std::vector<PetscInt> sizes;          /* of the components on this rank, in the order of `rows` */
  PetscInt              components = 0; /* on all ranks */
  PetscInt              largest    = 0; /* rows of the largest component */
  PetscInt              ranks      = 0; /* ranks that solve for any row */
  /* components of up to this many rows are small; their rows are contiguous */
  PetscInt small = 0;
  bool     split = false; /* components may lie on several ranks */
};

PetscErrorCode AinsworthPlacementFindLarge(const AinsworthLinks &, PetscInt, PetscBool *);
PetscErrorCode AinsworthPlacementCreate(const std::vector<AinsworthLinks> &, PetscInt, PetscInt, AinsworthPlacement *);
PetscErrorCode AinsworthPlacementReset(AinsworthPlacement *);

#endif
