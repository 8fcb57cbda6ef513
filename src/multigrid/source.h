/* What levels were made of: tells whether A is the same, where another object, or one that was assembled again, holds the values that it had */
#ifndef AINSWORTH_SOURCE_H
#define AINSWORTH_SOURCE_H

#include "../petsccompat.h"
#include <petscmat.h>
#include <vector>

struct AinsworthSource {
  PetscObjectId            id = 0, modesId = 0; /* of A and of its near null space */
  PetscObjectState         state = 0;
  std::vector<PetscScalar> image;           /* A times a vector of random numbers, which are always the same */
  PetscScalar              modes     = 0.0; /* the entries of the near null space on this rank, times such numbers */
  PetscReal                modesSize = 0.0; /* their magnitudes, times the same */

  PetscErrorCode identify(Mat A, MatNullSpace near);
  PetscErrorCode take(Mat A, MatNullSpace near);
  PetscErrorCode holds(Mat A, MatNullSpace near, const std::vector<PetscReal> &diagonal, PetscBool *same, PetscBool *fits) const;
};

#endif
