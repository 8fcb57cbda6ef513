/* The program's vectors in parts: x and lambda, or f and g */
#ifndef AINSWORTH_TRANSFER_H
#define AINSWORTH_TRANSFER_H

#include "saddlevec.h"
#include <functional>

/* What is done to the parts of a vector */
typedef enum {
  AINSWORTH_ACCESS_READ,
  AINSWORTH_ACCESS_WRITE, /* all entries are set: those of before need not be there */
  AINSWORTH_ACCESS_UPDATE
} AinsworthAccess;

/* Made at set-up for all vectors with the layout of the program's */
struct AinsworthTransfer {
  AinsworthRef<Vec>                part[2];
  AinsworthRef<IS>                 field[2];
  mutable AinsworthRef<VecScatter> scatter[2]; /* made for the first vector of which the part is copied */
  /* where a part begins in the local entries if it is contiguous on all ranks, and seen in place; -1: it is copied */
  PetscInt offset[2] = {-1, -1};
};

PetscErrorCode AinsworthTransferCreate(Vec, const AinsworthRef<IS>[2], Vec, Vec, AinsworthTransfer *);
PetscErrorCode AinsworthTransferIn(const AinsworthTransfer *, AinsworthAccess, Vec, AinsworthSaddleVec);
PetscErrorCode AinsworthTransferOut(const AinsworthTransfer *, AinsworthAccess, bool failed, Vec, AinsworthSaddleVec);
PetscErrorCode AinsworthVecCopyEntries(Vec, Vec);

#endif
