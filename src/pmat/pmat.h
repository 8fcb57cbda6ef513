/* M_* = C' B C + Q_*' A Q_*, the assembled matrix that AMG works on (paper, section 4.3, Table 1) */
#ifndef AINSWORTH_PMAT_H
#define AINSWORTH_PMAT_H

#include <petscainsworth.h>
#include "../petsccompat.h"
#include <vector>

/* Inv(S), the sparse approximation of the inverse Gram matrix in M_* (paper, Table 1) */
typedef enum {
  PC_AINSWORTH_PMAT_JCB,   /* diagonal of the inverse 1-norms of the rows of S, or of S scaled to a unit diagonal */
  PC_AINSWORTH_PMAT_ID,    /* Inv(S) = 0: Q_* = I, M_* = A + C' B C */
  PC_AINSWORTH_PMAT_CC,    /* the exact inverse, by Cholesky; dense */
  PC_AINSWORTH_PMAT_CG,    /* conjugate gradients per column to a loose tolerance; entries not reached stay zero */
  PC_AINSWORTH_PMAT_BJ_CC, /* block Jacobi, blocks cut by METIS, exact inverse in each block */
  PC_AINSWORTH_PMAT_BJ_CG, /* block Jacobi, conjugate gradients in each block */
  PC_AINSWORTH_PMAT_AUTO   /* one of the first two (docs/method.md) */
} PCAinsworthPmatType;
extern const char *const PCAinsworthPmatTypes[];

/* The diagonal penalty B of the reduced operator */
typedef enum {
  AINSWORTH_PENALTY_ROW, /* B_ii = gamma / (C diag(A)^{-1} C')_ii */
  AINSWORTH_PENALTY_NORM /* B = beta I, beta = gamma ||Q_*' A Q_*||_1 / ||C' C||_1, with the infinity norm for a non-symmetric A (paper, section 3.3) */
} AinsworthPenaltyType;
extern const char *const AinsworthPenaltyTypes[];

struct AinsworthPmatOptions {
  PCAinsworthPmatType  type;
  AinsworthPenaltyType penalty;
  PetscReal            factor;     /* gamma */
  PetscBool            rowScaling; /* jcb does not depend on the scale of the rows of C */
  PetscReal            rtol;       /* of cg and bj_cg */
  PetscInt             blocks;     /* of bj_cc and bj_cg; PETSC_DECIDE: from the number of rows */
  PetscBool            symmetric;  /* A = A' */
};

/* What the inner preconditioner takes */
typedef enum {
  AINSWORTH_PMAT_AIJ,
  AINSWORTH_PMAT_HYPRE,
  AINSWORTH_PMAT_FACTOR, /* AIJ, to be factored */
  AINSWORTH_PMAT_SUM     /* MATCOMPOSITE of A itself and M_* - A, which is not zero on the surface only */
} AinsworthPmatFormat;

/* What the rows of C bring into M_* */
struct AinsworthPmatFill {
  PetscReal entries; /* of A */
  PetscInt  usual;   /* rows of up to about this length are not long, unknowns in more rows than this are shared */
  PetscReal squares; /* of the lengths of the rows of C that M_* has, added up */
  PetscInt  longest; /* row of C */
  PetscInt  most;    /* rows with more entries than this are left out of M_* */
  PetscInt  leftOut; /* their number */
};

struct AinsworthPmatInputs {
  Mat                   A, C, S;         /* of any type; AIJ, without zero rows; AIJ, C W C' + N, NULL: not at hand */
  Mat                   N;               /* what D adds to C W C', NULL: D = 0 */
  Mat                   aij;             /* A as AIJ */
  Vec                   weight;          /* diagonal of W, NULL for W = I */
  Vec                   compliance;      /* sums of the rows of |D|, negative where D_ii is; NULL: D = 0 */
  Vec                   inverseDiagonal; /* diag(A)^{-1}, from AinsworthWeightCreate() */
  AinsworthPmatFormat   format;
  PetscBool             single; /* the inner preconditioner works in single precision */
  PetscInt              bs;     /* of M_*, which A may not know */
  AinsworthPmatFill     fill;   /* of A and C */
  std::vector<PetscInt> shared; /* unknowns that M_* holds instead of what rows of C couple them with: conjugate gradients move them (ksp/shared.cpp) */
};

/* fill.cpp */
PetscErrorCode AinsworthPmatGetFill(Mat, Mat, AinsworthPmatFill *);
PetscErrorCode AinsworthPmatPredict(Mat, Mat, Mat, const AinsworthPmatFill *, PetscReal *);
PetscErrorCode AinsworthPmatCheckFill(Mat, Mat, Mat, const AinsworthPmatFill *, PCAinsworthPmatType);

/* loose.cpp */
PetscErrorCode AinsworthPmatEliminateLoose(const AinsworthPmatInputs *, PetscReal, Mat, Mat *, Mat *);

/* rows.cpp */
PetscErrorCode AinsworthSelectRows(Mat, const std::vector<char> *, Mat *);
PetscErrorCode AinsworthPmatCreateShort(Mat, const AinsworthPmatFill *, Mat *);
PetscErrorCode AinsworthPmatFindShared(Mat, Mat, const AinsworthPmatFill *, PetscBool *, std::vector<PetscInt> *);
PetscErrorCode AinsworthPmatHoldShared(const AinsworthPmatInputs *, Mat *, Mat *);
PetscErrorCode AinsworthPmatCreatePrivate(Mat, Vec, const AinsworthPmatFill *, Mat *, PetscBool *);
PetscErrorCode AinsworthCreateFromDiagonal(Vec, Mat *);
PetscErrorCode AinsworthPmatCreateShift(const AinsworthPmatInputs *, Mat *);

PetscErrorCode AinsworthMultiplyAdjoint(Mat, Mat, Mat *);
PetscErrorCode AinsworthInvGramCreate(Mat, const AinsworthPmatOptions *, Mat *);
PetscErrorCode AinsworthPmatCreateSeries(Vec, Vec, Vec *);
PetscErrorCode AinsworthPmatCreate(const AinsworthPmatInputs *, const AinsworthPmatOptions *, Vec *, Mat *, PetscInt *);
PetscErrorCode AinsworthPmatComponentsApart(Mat, PetscInt, PetscInt, PetscBool *);

#endif
