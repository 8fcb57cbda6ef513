/*
   The projector Q = I - R C onto Ker C along Im(W C') and the right inverse R = W C' S^{-1} of C, with S = C W C' + N
   (docs/method.md)

   If B is not C, the first equation has a projector and a right inverse of B.
*/
#ifndef AINSWORTH_PROJECTOR_H
#define AINSWORTH_PROJECTOR_H

#include "compliance.h"
#include "polynomial.h"
#include "surface.h"
#include "../saddle/saddle.h"
#include <string>

/* What the nonzero pattern of S and the placement of its rows depend on */
struct AinsworthProjectorPatterns {
  PetscObjectId    id[3]       = {}; /* of C, B and D; 0 where absent */
  PetscObjectState pattern[3]  = {};
  PetscInt         rowsPerRank = 0;
  bool             factored    = false;
  bool             weighted    = false;
  PetscBool        hermitian   = PETSC_FALSE; /* D is Hermitian: S has a Cholesky factorization */
};

struct AinsworthProjector {
  Mat C = NULL, B = NULL; /* m x n AIJ, placed: each row is on the rank that solves for it; B may be C */
  std::shared_ptr<const AinsworthSurface> surface, surfaceB; /* of these; that of B is that of C if B is C */
  AinsworthGram                           gram;              /* S = C W C' + N; with a polynomial S_p */
  AinsworthGram                           gramB; /* B W B' + N with the placement of gram; empty if B is C */
  VecScatter scatter   = NULL; /* from the program's rows of C to the placed rows; NULL: rows are not moved */
  Vec        rowValues = NULL, rowSolution = NULL; /* work vectors, m, placed */
  std::unique_ptr<AinsworthPolynomial> polynomial; /* R has no S^{-1}; NULL: S is factored */

  /* for D, empty where D is zero; E and all vectors of m entries are placed */
  AinsworthCompliance compliance = {};
  Mat                 E          = NULL;
  /* placed copies of AinsworthCompliance's rest and of the results of AinsworthComplianceGetPreconditioner() */
  Vec rest = NULL, shared = NULL, inverse = NULL;
  Vec held = NULL, load = NULL; /* work vectors, m and n */

  AinsworthProjectorPatterns patterns = {}; /* of the last set-up; valid if C is not NULL */
};

/* The blocks of [A B'; C -D] other than A, with only the rows that are kept; D may be NULL */
struct AinsworthProjectorBlocks {
  Mat C = NULL, B = NULL, D = NULL;
};

/* Gets the Gram matrix of B, which is that of C if B is C */
inline AinsworthGram *AinsworthProjectorOtherGram(AinsworthProjector *proj)
{
  return proj->B == proj->C ? &proj->gram : &proj->gramB;
}

/* How solves with S are done */
typedef enum {
  AINSWORTH_GRAM_AUTO, /* without a factorization where that is quicker */
  AINSWORTH_GRAM_FACTOR,
  AINSWORTH_GRAM_POLYNOMIAL /* without a factorization where that is possible */
} AinsworthGramType;
PETSC_INTERN const char *const AinsworthGramTypes[];

struct AinsworthGramChoices {
  AinsworthGramType type        = AINSWORTH_GRAM_AUTO;
  PetscInt          rowsPerRank = 25000; /* docs/method.md */
  AinsworthMachine  machine;

  bool operator!=(const AinsworthGramChoices &other) const
  {
    return type != other.type || rowsPerRank != other.rowsPerRank || !(machine == other.machine);
  }
};

PetscErrorCode AinsworthProjectorSetUp(AinsworthProjector *, const AinsworthProjectorBlocks *, Vec, Vec,
                                       const AinsworthGramChoices &, PetscObject);
PetscErrorCode AinsworthProjectorSubtract(AinsworthProjector *, const AinsworthSurface &, bool, PetscScalar[]);
PetscErrorCode AinsworthProjectorReset(AinsworthProjector *);
PetscErrorCode AinsworthProjectorMoveRows(const AinsworthProjector *, Mat, Mat *);
PetscErrorCode AinsworthProjectorPlaceMat(const AinsworthProjector *, Mat, Mat *);
PetscErrorCode AinsworthProjectorPlace(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorReturn(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorMult(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorMultTranspose(AinsworthProjector *, Vec, Vec, Vec, Vec);
PetscErrorCode AinsworthProjectorRightInverse(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorMultiplier(AinsworthProjector *, bool, Vec, Vec, Vec);
PetscErrorCode AinsworthProjectorSetPenalty(AinsworthProjector *, Vec);
PetscErrorCode AinsworthProjectorMultEnergy(AinsworthProjector *, Vec, Vec);
PetscErrorCode AinsworthProjectorPrecondition(AinsworthProjector *, PC, PetscErrorCode (*)(PC, Vec, Vec), Vec, Vec);

PetscErrorCode AinsworthProjectorDescribeGram(const AinsworthProjector *, std::string *);
PetscErrorCode AinsworthProjectorGetEconomy(const AinsworthProjector *, const char **);

/* weight.cpp */
/*
   AinsworthLooseFactor - returns the factor by which the weight of unknowns with zero rows in A exceeds that of their
   surroundings: the larger, the less force they put on these, which coarse levels do not know of. A rod with RBE3 takes
   43, 17, 15, 14, 14 iterations with 10, 100, 300, 1000, 1e4. With D such unknowns must not hide springs of their rows:
   a small rod with RBE2 and springs of all kinds takes at most 24 iterations with 100, 32 with 300, 38 with 1000
*/
static inline PetscReal AinsworthLooseFactor(bool springs)
{
  return springs ? 100.0 : 1000.0;
}
PetscErrorCode AinsworthWeightCreate(Mat, Vec *);
PetscErrorCode AinsworthWeightLoosen(Mat, Mat, Mat, Vec, PetscBool *);
PetscErrorCode AinsworthRowPenaltyCreate(Mat, Vec, PetscReal, Vec *);

#endif
