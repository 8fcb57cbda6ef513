/* The projector Q = I - R C onto Ker C along Im(W C'), and the right inverse R = W C' S^{-1} of C (docs/method.md) */
#ifndef AINSWORTH_PROJECTOR_H
#define AINSWORTH_PROJECTOR_H

#include "frame.h"
#include "gram.h"
#include "../saddle/saddle.h"

struct AinsworthProjector {
  Mat           C;    /* m x n AIJ, in the frame: C T' */
  Mat           CW;   /* C W T'; the same as C for W = I */
  AinsworthGram gram; /* S = C W C' */
  Vec           s, t; /* m */
};

PetscErrorCode AinsworthProjectorSetUp(AinsworthProjector *, Mat, Vec, const AinsworthFrame *, PetscInt, PetscObject, const char[]);
PetscErrorCode AinsworthProjectorReset(AinsworthProjector *);
PetscErrorCode AinsworthProjectorMult(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorMultTranspose(AinsworthProjector *, Vec, Vec, Vec);
PetscErrorCode AinsworthProjectorRightInverse(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorRightInverseTranspose(AinsworthProjector *, Vec, Vec);

PetscErrorCode AinsworthRowSums(Mat, Vec);
PetscErrorCode AinsworthWeightCreate(Mat, Vec *);
PetscErrorCode AinsworthRowPenaltyCreate(Mat, Vec, PetscReal, Vec *);

#endif
