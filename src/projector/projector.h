/* The projector Q = I - R C onto Ker C along Im(W C'), and the right inverse R = W C' S^{-1} of C (docs/method.md) */
#ifndef AINSWORTH_PROJECTOR_H
#define AINSWORTH_PROJECTOR_H

#include "gram.h"
#include "../saddle/saddle.h"

/* What the nonzero pattern of S, and the places of its rows, come from */
struct AinsworthProjectorSource {
  PetscObjectId    id; /* of C */
  PetscObjectState pattern;
  PetscInt         rowsPerRank;
  bool             weighted;
};

struct AinsworthProjector {
  Mat           C;                      /* m x n AIJ, its rows where they are solved for (placed) */
  Mat           CW;                     /* C W, placed; the same as C for W = I */
  AinsworthGram gram;                   /* S = C W C' */
  VecScatter    scatter;                /* from the program's rows of C to their places; NULL: they stay */
  Vec           rowValues, rowSolution; /* work space, m, placed: C x, and S^{-1} of it */

  AinsworthProjectorSource source; /* of the last set-up, where C is there */
};

PetscErrorCode AinsworthProjectorSetUp(AinsworthProjector *, Mat, Vec, PetscInt, PetscObject, const char[]);
PetscErrorCode AinsworthProjectorReset(AinsworthProjector *);
PetscErrorCode AinsworthProjectorPlace(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorMult(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorMultTranspose(AinsworthProjector *, Vec, Vec, Vec);
PetscErrorCode AinsworthProjectorRightInverse(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorRightInverseTranspose(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorSolveRange(AinsworthProjector *, Vec, Vec, Vec);

PetscErrorCode AinsworthWeightCreate(Mat, Vec *);
PetscErrorCode AinsworthRowPenaltyCreate(Mat, Vec, PetscReal, Vec *);

#endif
