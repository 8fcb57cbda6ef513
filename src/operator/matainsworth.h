/* MATAINSWORTH: the reduced operator A~ = C' B C + Q' A Q of [A C'; C 0] or, in general, that of [A B'; C -D], never assembled */
#ifndef AINSWORTH_MATAINSWORTH_H
#define AINSWORTH_MATAINSWORTH_H

#include <petscainsworth.h>
#include "../projector/projector.h"
#include <vector>

struct Mat_Ainsworth {
  Mat                    A, C;
  Mat                    B, D;    /* of [A B'; C -D]: C itself and NULL where the program's own calls made this matrix */
  PetscBool              adjoint; /* B is C, and D = D' */
  Mat                    product; /* A in a form that multiplies faster; NULL: A itself */
  MatAinsworthWeightType weightType;
  Vec                    weight;      /* diagonal of W, length n; NULL for W = I */
  Vec                    mobility;    /* that of the projector: zero where many rows of C share an unknown; else the same */
  Vec                    penalty;     /* its diagonal, length m, distributed as the rows of C */
  Vec                    placed;      /* the same where the rows are placed; NULL: not yet */
  PetscBool              userPenalty; /* set by MatAinsworthSetPenalty(), otherwise one per row with gamma = 1 */
  PetscInt               rowsPerRank;
  PetscBool              omitPenalty;    /* Q' A Q, without C' B C */
  PetscBool              homogeneous;    /* g was zero in the last right-hand side */
  PetscReal              start[2];       /* x0' A x0 and f' x0 of the last right-hand side, x0 = R g */
  PetscBool              inKernel;       /* a method iterates in Ker C: Q' A Q, as above */
  PetscBool              direction;      /* the next product is with a vector of Ker C: one was projected since the last */
  PetscBool              refine;         /* from some point on its last solve did every projection twice */
  PetscInt               projections;    /* of this solve */
  PetscErrorCode (*apply)(PC, Vec, Vec); /* of its preconditioner, without the projection or the springs of D */
  PetscErrorCode (*applyTranspose)(PC, Vec, Vec);
  AinsworthProjector       proj;
  PetscInt                 longest = PETSC_MAX_INT; /* rows of C with more entries are not in the preconditioning matrix (ksp/longrows.cpp) */
  std::vector<Vec>         lifted;                  /* M^{-1} C' of those rows */
  const void              *liftedBy = NULL;         /* the data of the preconditioner */
  std::vector<PetscScalar> longFactor;              /* of C M^{-1} C' */
  std::vector<PetscInt>    shared;                  /* unknowns that the preconditioning matrix holds (ksp/shared.cpp) */
  std::vector<Vec>         motions, motionForces;   /* Z and Q' A Z of them, Z' A Z = I */
  bool                     doubtful;                /* rows of C are nearly dependent: solves with the Gram matrix are refined */
  Vec                      work;                    /* n */
  Vec                      rowWork;                 /* m, placed */
  Vec                      residual;                /* m, as the rows of C; NULL: not needed yet */
  Vec                      mu;                      /* the same: S^{-1} (C y - g), where D is not zero */
  PetscBool                current;                 /* the projector belongs to the present A, C and W */
  PetscObjectState         stateA, stateC[3];       /* the latter also of B and D */
};

PETSC_INTERN PetscErrorCode MatCreate_Ainsworth(Mat);
/* the context, with the projector brought up to date; the error of a wrong type names the caller */
PETSC_INTERN PetscErrorCode MatAinsworthGetContext_Private(Mat, Mat_Ainsworth **);
PETSC_INTERN PetscErrorCode MatAinsworthReset_Private(Mat_Ainsworth *);
PETSC_INTERN PetscErrorCode MatAinsworthSetUp_Private(Mat, Mat_Ainsworth **);
PETSC_INTERN PetscErrorCode MatAinsworthSetUpProjector_Private(Mat, Mat_Ainsworth **);
PETSC_INTERN PetscErrorCode MatAinsworthReduce_Private(Mat, PetscBool, Vec, Vec, Vec);
PETSC_INTERN PetscErrorCode MatAinsworthRecover_Private(Mat, PetscBool, AinsworthSaddleVec, AinsworthSaddleVec, Vec);
PETSC_INTERN PetscErrorCode MatAinsworthSetOtherBlocks_Private(Mat, Mat, Mat, PetscBool);
PETSC_INTERN PetscErrorCode MatAinsworthGetCompliance_Private(Mat, Vec *, Mat *);
PETSC_INTERN PetscErrorCode MatAinsworthDiagnose_Private(Mat, PetscInt *, PetscInt *, PetscInt **, PCFailedReason *, PetscBool *);
PETSC_INTERN PetscErrorCode MatAinsworthFindNear_Private(Mat, PetscInt *, PetscInt **);
PETSC_INTERN PetscErrorCode MatAinsworthIsDoubtful_Private(Mat, PetscBool *);
PETSC_INTERN PetscErrorCode MatAinsworthGetGram_Private(Mat, const AinsworthGram **);
PETSC_INTERN PetscErrorCode MatAinsworthSetRowsPerRank_Private(Mat, PetscInt);
PETSC_INTERN PetscErrorCode MatAinsworthSolveRange_Private(Mat, Vec, Vec);
PETSC_INTERN PetscErrorCode MatAinsworthPrecondition_Private(Mat, PC, PetscErrorCode (*)(PC, Vec, Vec), Vec, Vec);
PETSC_INTERN PetscErrorCode MatAinsworthOmitPenalty_Private(Mat, PetscBool);
PETSC_INTERN PetscErrorCode MatAinsworthSetProduct_Private(Mat, Mat);
PETSC_INTERN PetscErrorCode MatAinsworthGetDrift_Private(Mat, Vec, PetscReal *);

#endif
