/* M_* = C' B C + Q_*' A Q_*, the assembled matrix that AMG works on (paper, section 4.3, Table 1) */
#ifndef AINSWORTH_PMAT_H
#define AINSWORTH_PMAT_H

#include <petscainsworth.h>
#include "../petsccompat.h"

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
  AINSWORTH_PMAT_SUM /* MATCOMPOSITE of A itself and M_* - A, which is not zero on the surface only */
} AinsworthPmatFormat;

struct AinsworthPmatInputs {
  Mat                 A, C, S;         /* of any type; AIJ, without zero rows; AIJ, NULL: C W C' is not at hand */
  Vec                 weight;          /* diagonal of W, NULL for W = I */
  Vec                 compliance;      /* sums of the rows of |D|, negative where D_ii is; NULL: D = 0 */
  Vec                 inverseDiagonal; /* diag(A)^{-1}, from AinsworthWeightCreate() */
  AinsworthPmatFormat format;
};

PetscErrorCode AinsworthInvGramCreate(Mat, const AinsworthPmatOptions *, Mat *);
PetscErrorCode AinsworthPmatCreate(const AinsworthPmatInputs *, const AinsworthPmatOptions *, Vec *, Mat *, PetscInt *);
PetscErrorCode AinsworthPmatComponentsApart(Mat, PetscInt, PetscBool *);

#endif
