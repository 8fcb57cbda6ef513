/* Rows of C that are combinations of others, found in the Gram matrix */
#ifndef AINSWORTH_DEPENDENT_H
#define AINSWORTH_DEPENDENT_H

#include "gram.h"

PetscErrorCode AinsworthGramDiagnose(AinsworthGram *, PetscInt *, PetscInt *, PetscInt **, PCFailedReason *, bool *);

#endif
