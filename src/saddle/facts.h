/* Facts of a matrix that set-up goes by, from one pass over its entries and one reduction */
#ifndef AINSWORTH_FACTS_H
#define AINSWORTH_FACTS_H

#include "../base/objects.h"
#include <vector>

/* Kept with the matrix until its values change */
struct AinsworthMatFacts {
  PetscBool symmetric = PETSC_FALSE; /* A = A', in complex arithmetic its adjoint: as declared, or found */
  PetscBool finite    = PETSC_TRUE;  /* no entry is NaN or Inf */

  /* of each row, if the type gives its entries; otherwise the rows are unknown, and these are empty */
  PetscBool         rows = PETSC_FALSE;
  AinsworthRef<Vec> diagonal;
  std::vector<bool> alone;                  /* its diagonal entry is not zero, and the only one that is not */
  PetscBool         some     = PETSC_FALSE; /* there are such rows, on any rank */
  PetscBool         positive = PETSC_FALSE; /* all diagonal entries are positive, on all ranks */
};

PetscErrorCode AinsworthGetFacts(Mat, const AinsworthMatFacts **);
PetscErrorCode AinsworthProbeSymmetry(Mat, PetscBool *);

#endif
