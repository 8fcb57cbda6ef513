/* MATAINSWORTH: the matrix-free reduced operator A~ = C' B C + Q' A Q of [A C'; C 0] or, in general, of [A B'; C -D] */
#ifndef AINSWORTH_MATAINSWORTH_H
#define AINSWORTH_MATAINSWORTH_H

#include <petscainsworth.h>
#include "projector.h"
#include <string>
#include <vector>

struct Mat_Ainsworth {
  Mat A = NULL, C = NULL;
  /* of [A B'; C -D]; C itself and NULL if the matrix was set up by the public functions */
  Mat                    B = NULL, D = NULL;
  PetscBool              adjoint    = PETSC_FALSE; /* B is C, and D = D' */
  Mat                    product    = NULL;        /* A in a form with faster products; NULL: A itself */
  MatAinsworthWeightType weightType = {};
  Vec                    weight     = NULL; /* diagonal of W, length n; NULL for W = I */
  /* weight of the projector: `weight`, but zero for unknowns shared by many rows of C and larger for loose ones */
  Vec mobility = NULL;
  Vec penalty  = NULL; /* diagonal of B, length m, laid out as the rows of C */
  Vec placed   = NULL; /* the placed penalty; NULL: not placed yet */
  /* set by MatAinsworthSetPenalty(); otherwise the default with gamma = 1 */
  PetscBool            userPenalty = PETSC_FALSE;
  AinsworthGramChoices gramChoices;
  /* the operator is Q' A Q, and the right-hand side lies in the range of Q', without C' B C and C' B g */
  PetscBool          omitPenalty = PETSC_FALSE;
  PetscBool          homogeneous = PETSC_FALSE; /* g was zero in the last right-hand side */
  PetscReal          energy      = 0.0;         /* (R g)' A R g of it */
  AinsworthProjector proj;
  /* rows of C are nearly dependent, so solves with the Gram matrix are refined */
  bool             doubtful = false;
  Vec              work     = NULL;            /* work vector, n */
  Vec              rowWork  = NULL;            /* work vector, m, placed */
  Vec              residual = NULL;            /* m, laid out as the rows of C; NULL until needed */
  Vec              mu       = NULL;            /* S^{-1} (C y - g) with D, laid out as the rows of C */
  PetscBool        current  = PETSC_FALSE;     /* the projector matches the present A, C and W */
  PetscObjectState stateA = 0, stateC[3] = {}; /* stateC: of C, B and D */
};

/*
   Each projection with a nearly singular S is done so often: the condition number c of S leaves about (c eps)^k, which
   is eps up to c = eps^{-3/4}
*/
static const int AinsworthRefinements = 4;

PETSC_INTERN PetscErrorCode MatCreate_Ainsworth(Mat);

/* context.cpp; the first gets the context, and raises an error for other types */
PETSC_INTERN PetscErrorCode MatAinsworthGetContext_Private(Mat, Mat_Ainsworth **);
PETSC_INTERN PetscErrorCode MatAinsworthReset_Private(Mat_Ainsworth *);
PETSC_INTERN PetscErrorCode MatAinsworthSetUp_Private(Mat, Mat_Ainsworth **);
PETSC_INTERN PetscErrorCode MatAinsworthSetUpProjector_Private(Mat, Mat_Ainsworth **);

/* settings, doors, products */
PETSC_INTERN PetscErrorCode MatAinsworthCreate_Private(Mat, Mat, Mat *);
PETSC_INTERN PetscErrorCode MatAinsworthReduce_Private(Mat, PetscBool, Vec, Vec, Vec);
PETSC_INTERN PetscErrorCode MatAinsworthComplete_Private(Mat, Vec, Vec);
PETSC_INTERN PetscErrorCode MatAinsworthRecover_Private(Mat, PetscBool, PetscBool, AinsworthSaddleVec,
                                                        AinsworthSaddleVec, Vec);
PETSC_INTERN PetscErrorCode MatAinsworthSetOtherBlocks_Private(Mat, Mat, Mat, PetscBool);
PETSC_INTERN PetscErrorCode MatAinsworthGetCompliance_Private(Mat, const AinsworthCompliance **);
PETSC_INTERN PetscErrorCode MatAinsworthDiagnose_Private(Mat, PetscInt *, PetscInt *, PetscInt **, PCFailedReason *,
                                                         PetscBool *);
PETSC_INTERN PetscErrorCode MatAinsworthFindNear_Private(Mat, PetscInt *, PetscInt **);
PETSC_INTERN PetscErrorCode MatAinsworthIsDoubtful_Private(Mat, PetscBool *);
PETSC_INTERN PetscErrorCode MatAinsworthGetGram_Private(Mat, const AinsworthGram **);
PETSC_INTERN PetscErrorCode MatAinsworthGetPlaced_Private(Mat, Mat *, Mat *, Mat *);
PETSC_INTERN PetscErrorCode MatAinsworthSetGramChoices_Private(Mat, const AinsworthGramChoices &);
PETSC_INTERN PetscErrorCode MatAinsworthPrecondition_Private(Mat, PC, PetscErrorCode (*)(PC, Vec, Vec), Vec, Vec);
PETSC_INTERN PetscErrorCode MatAinsworthOmitPenalty_Private(Mat, PetscBool);
PETSC_INTERN PetscErrorCode MatAinsworthProject_Private(Mat, Vec);
PETSC_INTERN PetscErrorCode MatAinsworthProjectForces_Private(Mat, Vec);
PETSC_INTERN PetscErrorCode MatAinsworthSetProduct_Private(Mat, Mat);

/* combination.cpp */
PETSC_INTERN PetscErrorCode MatAinsworthCombineRows_Private(Mat, const AinsworthSaddle *, Vec);

#endif
