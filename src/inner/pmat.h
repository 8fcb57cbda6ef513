/* M_* = C' B C + Q_*' A Q_*, the assembled matrix for multigrid (paper, section 4.3, Table 1) */
#ifndef AINSWORTH_PMAT_H
#define AINSWORTH_PMAT_H

#include <petscainsworth.h>
#include "../projection/compliance.h"
#include "../multigrid/subspace.h"
#include "../base/csr.h"
#include <memory>
#include <vector>

/* Inv(S), the sparse approximation of the inverse Gram matrix in M_* (paper, Table 1) */
typedef enum {
  PC_AINSWORTH_PMAT_JCB, /* diagonal with the inverse 1-norms of the rows of S, or of S scaled to a unit diagonal */
  PC_AINSWORTH_PMAT_ID,  /* Inv(S) = 0: Q_* = I, M_* = A + C' B C */
  PC_AINSWORTH_PMAT_CC,  /* exact inverse by Cholesky; dense */
  /* conjugate gradients for each column to a loose tolerance; entries that are not reached stay zero */
  PC_AINSWORTH_PMAT_CG,
  PC_AINSWORTH_PMAT_BJ_CC, /* block Jacobi with blocks cut by METIS, exact inverse of each block */
  PC_AINSWORTH_PMAT_BJ_CG, /* block Jacobi, conjugate gradients in each block */
  PC_AINSWORTH_PMAT_AUTO   /* one of the first two (docs/method.md) */
} PCAinsworthPmatType;
extern const char *const PCAinsworthPmatTypes[];

/* The diagonal penalty B of the reduced operator */
typedef enum {
  AINSWORTH_PENALTY_ROW, /* B_ii = gamma / (C diag(A)^{-1} C')_ii */
  /*
     B = beta I, beta = gamma ||Q_*' A Q_*||_1 / ||C' C||_1, with the infinity norm for a non-symmetric A (paper,
     section 3.3)
  */
  AINSWORTH_PENALTY_NORM
} AinsworthPenaltyType;
extern const char *const AinsworthPenaltyTypes[];

struct AinsworthPmatOptions {
  PCAinsworthPmatType  type       = {};
  AinsworthPenaltyType penalty    = {};
  PetscReal            factor     = 0.0;         /* gamma */
  PetscBool            rowScaling = PETSC_FALSE; /* make jcb independent of the scale of the rows of C */
  PetscReal            rtol       = 0.0;         /* tolerance of cg and bj_cg */
  /* number of blocks of bj_cc and bj_cg; PETSC_DECIDE: from the number of rows */
  PetscInt  blocks    = 0;
  PetscBool symmetric = PETSC_FALSE; /* A = A' */
};

/* Format of the matrix for the inner preconditioner */
typedef enum {
  AINSWORTH_PMAT_AIJ,
  AINSWORTH_PMAT_HYPRE,
  AINSWORTH_PMAT_FACTOR, /* AIJ, to be factored */
  AINSWORTH_PMAT_SUM     /* MATCOMPOSITE of A itself and M_* - A, which has entries on the surface only */
} AinsworthPmatFormat;

/* The fill that rows of C cause in M_* */
struct AinsworthPmatFill {
  PetscReal entries = 0.0; /* entries of A */
  PetscInt  usual   = 0;   /* rows up to about this length are not long; unknowns in more rows than this are shared */
  PetscReal squares = 0.0; /* sum of the squared lengths of the rows of C that are in M_* */
  PetscInt  longest = 0;   /* length of the longest row of C */
  PetscInt  most    = 0;   /* rows with more entries are left out of M_* */
  PetscInt  leftOut = 0;   /* number of rows left out */
};

/* What multigrid in Ker C gets of C (coarse.cpp) */
struct AinsworthPmatInKernel {
  Mat              correction = NULL; /* I - Q_* = W C' Inv(S) C; NULL for 0; the owner destroys it */
  std::vector<Vec> rows;              /* adjoints of rows Q_*' C' that coarser levels keep; the owner destroys them */
  /*
     marks local unknowns that others move, with all their neighbors in A, and those without entries in A; NULL on all
     ranks if there are none
  */
  std::shared_ptr<const std::vector<char>> left;
  AinsworthCarried carried; /* with the rows of those unknowns that several rows share */
};

/* A, C and W with unknowns for the springs of D (slack.cpp) */
struct AinsworthPmatSlack {
  Mat                   A = NULL, C = NULL;
  Mat                   map    = NULL; /* to vectors of the reduced system */
  Vec                   weight = NULL;
  std::vector<PetscInt> numbers; /* of slack unknowns on each rank */
  PetscReal             d = 1.0; /* their diagonal entry in A */

  ~AinsworthPmatSlack();
};

struct AinsworthPmatInputs {
  /* A: any type; C: AIJ without zero rows; W C' and S = C W C': AIJ, laid out as the rows of C, or NULL */
  Mat                 A = NULL, C = NULL, WCt = NULL, S = NULL;
  Mat                 N               = NULL; /* what D adds to C W C'; NULL if D = 0 */
  Mat                 aij             = NULL; /* A as AIJ */
  Vec                 weight          = NULL; /* diagonal of W, NULL for W = I */
  Vec                 compliance      = NULL; /* row sums of |D| with the sign of D_ii; NULL if D = 0 */
  Vec                 inverseDiagonal = NULL; /* diag(A)^{-1}, from AinsworthWeightCreate() */
  AinsworthPmatFormat format          = {};
  PetscBool           single          = PETSC_FALSE; /* the inner preconditioner works in single precision */
  AinsworthPmatInKernel
    /*
       multigrid stays in Ker C and knows C on its coarser levels alone: M_* is Q_*' A Q_*, without a penalty; NULL: it
       does not
    */
    *inKernel = NULL;
  /* number of slack unknowns of each rank, which come last; NULL: there are none */
  const PetscInt *springs = NULL;
  /* what multigrid in Ker C works with instead: placed rows or, with D, rows with unknowns for springs */
  const AinsworthPmatInputs *kernel = NULL;
  PetscInt                   bs     = 0;  /* block size of M_*, which A may not have */
  AinsworthPmatFill          fill   = {}; /* for A and C */
  /* unknowns held in M_* instead of coupled by rows of C; conjugate gradients move them (projection/deflation.cpp) */
  std::vector<PetscInt> shared;
};

PetscErrorCode AinsworthPmatCreateAlone(const AinsworthPmatInputs *, PetscBool, Mat *);
PetscErrorCode AinsworthPmatCreateInKernel(const AinsworthPmatInputs *, const AinsworthPmatOptions *,
                                           AinsworthPmatInKernel *);

PetscErrorCode AinsworthPmatHasSlack(const AinsworthPmatInputs *, const AinsworthCompliance *, PetscBool *);
PetscErrorCode AinsworthPmatCreateSlack(const AinsworthPmatInputs *, const AinsworthCompliance *, PetscInt,
                                        const std::vector<PetscInt> &, PetscInt, AinsworthPmatSlack *);

PetscErrorCode AinsworthPmatSlackExtend(const AinsworthPmatSlack *, Mat, Mat *);

/* fill.cpp */
PetscErrorCode AinsworthPmatGetFill(Mat, Mat, AinsworthPmatFill *);
PetscErrorCode AinsworthPmatPredict(Mat, Mat, Mat, const AinsworthPmatFill *, PetscReal *);
PetscErrorCode AinsworthPmatCheckFill(Mat, Mat, Mat, const AinsworthPmatFill *, PCAinsworthPmatType);

/* products.cpp */
PetscErrorCode AinsworthMultiply(Mat, Mat, Mat *);
PetscErrorCode AinsworthMultiplyAdjoint(Mat, Mat, Mat *);

/* penalty.cpp */
PetscErrorCode AinsworthPmatCreateSeries(Vec, Vec, Vec *);
PetscErrorCode AinsworthPmatCreatePenalty(const AinsworthPmatInputs *, const AinsworthPmatOptions *, Mat, Mat, Vec *,
                                          Vec *);

/* loose.cpp */
PetscErrorCode AinsworthPmatEliminateLoose(const AinsworthPmatInputs *, PetscReal, Mat, Mat *, Mat *);

PetscErrorCode AinsworthPmatReleaseLoose(const AinsworthPmatInputs *, Vec, Mat, Mat *);

/* rows.cpp */
PetscErrorCode AinsworthCopyMarkedRows(Mat, const std::vector<char> *, Mat *);
PetscErrorCode AinsworthPmatCreateShort(Mat, const AinsworthPmatFill *, Mat *);
PetscErrorCode AinsworthPmatFindShared(Mat, Mat, const AinsworthPmatFill *, PetscBool *, std::vector<PetscInt> *);
PetscErrorCode AinsworthPmatHoldShared(const AinsworthPmatInputs *, Mat *, Mat *);
PetscErrorCode AinsworthPmatCreatePrivate(Mat, Vec, const AinsworthPmatFill *, Mat *);
PetscErrorCode AinsworthCreateFromDiagonal(Vec, Mat *);
PetscErrorCode AinsworthPmatCreateShift(const AinsworthPmatInputs *, Mat *);

PetscErrorCode AinsworthInvertBlock(const AinsworthCSR &, const std::vector<PetscInt> &, PetscReal,
                                    std::vector<PetscScalar> *, PetscBool *);
PetscErrorCode AinsworthInvGramCreate(Mat, const AinsworthPmatOptions *, Mat *);
PetscErrorCode AinsworthInvGramMultiply(Mat, const AinsworthPmatOptions *, Mat, Mat *);
PetscErrorCode AinsworthPmatCreate(const AinsworthPmatInputs *, const AinsworthPmatOptions *, Vec *, Mat *, PetscInt *);
PetscErrorCode AinsworthPmatComponentsApart(Mat, PetscInt, PetscInt, PetscBool *);

#endif
