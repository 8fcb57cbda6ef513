/* The program's vectors in parts: x and lambda, or f and g, in place where they are contiguous, otherwise copied by scatters */
#ifndef AINSWORTH_TRANSFER_H
#define AINSWORTH_TRANSFER_H

#include "saddlevec.h"
#include <vector>

struct AinsworthTransfer {
  /* what it was made for */
  PetscObjectId         mat       = 0;
  IS                    fields[2] = {NULL, NULL};
  PetscBool             rows      = PETSC_FALSE;
  std::vector<PetscInt> shape; /* of the vectors: sizes of leaves, which are plain, and -n for a VECNEST of n parts */

  struct Part {
    Vec                     vec    = NULL; /* has no array of its own if it is a view */
    PetscInt                leaf   = -1;   /* that it is a view of; -1: it is a copy */
    PetscInt                offset = 0;    /* of the view */
    std::vector<VecScatter> scatters;      /* of a copy, from each leaf; NULL: nothing is there */
  } part[2];

  /* between AinsworthTransferIn() and AinsworthTransferOut() */
  Vec                   given = NULL;
  PetscBool             write = PETSC_FALSE;
  std::vector<Vec>      leaves, nests; /* that the given one consists of */
  std::vector<PetscInt> seen;          /* its shape */
  const PetscScalar    *array[2] = {}; /* that parts are views of */
};

PetscErrorCode AinsworthTransferIn(AinsworthTransfer *, Mat, PetscBool, const IS[], PetscBool, Vec, AinsworthSaddleVec *);
PetscErrorCode AinsworthTransferOut(AinsworthTransfer *, AinsworthSaddleVec *);
PetscErrorCode AinsworthTransferDestroy(AinsworthTransfer *);

#endif
