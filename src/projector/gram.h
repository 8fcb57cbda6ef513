/* The Gram matrix S = C W C' and its solver, which lives on few ranks (paper, section 5.2) */
#ifndef AINSWORTH_GRAM_H
#define AINSWORTH_GRAM_H

#include "../petsccompat.h"

struct AinsworthGram {
  Mat        S;       /* m x m AIJ, rows distributed as those of C */
  Mat        grouped; /* the same on the group of ranks that solve with it */
  KSP        ksp;     /* on the group; NULL on the other ranks */
  MPI_Comm   group;   /* MPI_COMM_NULL: the communicator of S itself */
  VecScatter scatter; /* layout of C's rows to layout of the group; NULL if they are the same */
  Vec        all;     /* layout of the group on the communicator of S; its array is lent to the two below */
  Vec        b, x;    /* on the group */
  PetscInt   ranks;   /* size of the group */
};

PetscErrorCode AinsworthGramSetUp(AinsworthGram *, Mat, Mat, PetscInt, PetscObject, const char[]);
PetscErrorCode AinsworthGramReset(AinsworthGram *);
PetscErrorCode AinsworthGramSolve(AinsworthGram *, Vec, Vec);
PetscErrorCode AinsworthGramGetFailedReason(AinsworthGram *, PCFailedReason *);
PetscErrorCode AinsworthGramView(AinsworthGram *, PetscViewer);

#endif
