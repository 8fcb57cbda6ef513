/* The program's vectors in parts: x and lambda, or f and g, copied by scatters that are made once */
#ifndef AINSWORTH_TRANSFER_H
#define AINSWORTH_TRANSFER_H

#include "saddlevec.h"

struct AinsworthTransfer {
  IS         fields[2]  = {}; /* of both parts in the vector */
  Vec        part[2]    = {};
  VecScatter scatter[2] = {};

  /* between AinsworthTransferIn() and AinsworthTransferOut() */
  Vec       given = NULL;
  PetscBool write = PETSC_FALSE;
};

PetscErrorCode AinsworthTransferIn(AinsworthTransfer *, const IS[2], PetscBool, Vec, AinsworthSaddleVec *);
PetscErrorCode AinsworthTransferOut(AinsworthTransfer *, AinsworthSaddleVec *);
PetscErrorCode AinsworthTransferDestroy(AinsworthTransfer *);
PetscErrorCode AinsworthVecCreatePlain(Vec, PetscInt, Vec *);
PetscErrorCode AinsworthVecCopyEntries(Vec, Vec);

#endif
