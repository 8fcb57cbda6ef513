/* Finds rows of C that are combinations of others, where solves with the Gram matrix are inaccurate */
#ifndef AINSWORTH_DEPENDENT_H
#define AINSWORTH_DEPENDENT_H

#include "projector.h"

PetscErrorCode AinsworthProjectorDiagnose(AinsworthProjector *, Vec, PetscInt *, PetscInt *, PetscInt **,
                                          PCFailedReason *, PetscBool *, bool *);
PetscErrorCode AinsworthProjectorFindNear(const AinsworthProjector *, Vec, PetscInt *, PetscInt **);

#endif
