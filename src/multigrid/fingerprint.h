/* Fingerprint of A and its near null space, which shows whether a new or reassembled matrix has the same values */
#ifndef AINSWORTH_FINGERPRINT_H
#define AINSWORTH_FINGERPRINT_H

#include "../base/petsccompat.h"
#include <petscmat.h>
#include <vector>

struct AinsworthFingerprint {
  PetscObjectId            id = 0, modesId = 0; /* of A and of its near null space */
  PetscObjectState         state = 0;
  std::vector<PetscScalar> image;           /* product of A with a random vector that is always the same */
  PetscScalar              modes     = 0.0; /* weighted sum of the local entries of the near null space */
  PetscReal                modesSize = 0.0; /* weighted sum of their magnitudes */

  PetscErrorCode identify(Mat A, MatNullSpace near);
  PetscErrorCode take(Mat A, MatNullSpace near);
  PetscErrorCode holds(Mat A, MatNullSpace near, const std::vector<PetscReal> &diagonal, PetscBool *same,
                       PetscBool *fits) const;
};

#endif
