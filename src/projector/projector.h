/*
   The projector Q = I - R C onto Ker C along Im(W C'), and the right inverse R = W C' S^{-1} of C, S = C W C' + N (docs/method.md); those of B, where that is not
   C, on the side of the first equation
*/
#ifndef AINSWORTH_PROJECTOR_H
#define AINSWORTH_PROJECTOR_H

#include "compliance.h"
#include "gram.h"
#include "../saddle/saddle.h"

/* What the nonzero pattern of S, and the places of its rows, come from */
struct AinsworthProjectorSource {
  PetscObjectId    id[3]; /* of C, B and D */
  PetscObjectState pattern[3];
  PetscInt         rowsPerRank;
  bool             weighted;
};

struct AinsworthProjector {
  Mat           C, B;                   /* m x n AIJ, their rows where they are solved for (placed); B may be C */
  Mat           CW, BW;                 /* C W and B W, placed; the same as C and B for W = I */
  AinsworthGram gram;                   /* S = C W C' + N */
  AinsworthGram gramB;                  /* B W B' + N, with the same places; nothing where B is C */
  VecScatter    scatter;                /* from the program's rows of C to their places; NULL: they stay */
  Vec           rowValues, rowSolution; /* work space, m, placed: C x, and S^{-1} of it */

  /* of D, and NULL where it is zero; but for the first all placed */
  AinsworthCompliance compliance;
  Mat                 E;
  Vec                 rest, shared, inverse; /* the preconditioner's are those of AinsworthComplianceGetPreconditioner() */
  Vec                 held, load;            /* work space, m and n */

  AinsworthProjectorSource source; /* of the last set-up, where C is there */
};

/* The blocks beside A of [A B'; C -D], of the rows that are kept; D may be NULL */
struct AinsworthProjectorBlocks {
  Mat C, B, D;
};

/* The Gram matrix of B */
inline AinsworthGram *AinsworthProjectorOtherGram(AinsworthProjector *proj)
{
  return proj->B == proj->C ? &proj->gram : &proj->gramB;
}

PetscErrorCode AinsworthProjectorSetUp(AinsworthProjector *, const AinsworthProjectorBlocks *, Vec, Vec, PetscInt, PetscObject);
PetscErrorCode AinsworthProjectorReset(AinsworthProjector *);
PetscErrorCode AinsworthProjectorPlaceMat(const AinsworthProjector *, Mat, Mat *);
PetscErrorCode AinsworthProjectorPlace(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorReturn(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorMult(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorMultTranspose(AinsworthProjector *, Vec, Vec, Vec, Vec);
PetscErrorCode AinsworthProjectorRightInverse(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorMultiplier(AinsworthProjector *, Vec, Vec, Vec);
PetscErrorCode AinsworthProjectorSolveRange(AinsworthProjector *, Vec, Vec, Vec);
PetscErrorCode AinsworthProjectorSetPenalty(AinsworthProjector *, Vec);
PetscErrorCode AinsworthProjectorMultEnergy(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorPrecondition(AinsworthProjector *, PC, PetscErrorCode (*)(PC, Vec, Vec), Vec, Vec);

/* weight.cpp */
#define AINSWORTH_WEIGHT_LOOSE 100.0 /* so many times that of their surroundings is the weight of unknowns that A does nothing to */
PetscErrorCode AinsworthWeightCreate(Mat, Vec *);
PetscErrorCode AinsworthWeightLoosen(Mat, Mat, Mat, Vec, PetscBool *);
PetscErrorCode AinsworthRowPenaltyCreate(Mat, Vec, PetscReal, Vec *);

#endif
