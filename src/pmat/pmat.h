/* M_* = C' B C + Q_*' A Q_*, the assembled matrix that AMG works on (paper, section 4.3, Table 1) */
#ifndef AINSWORTH_PMAT_H
#define AINSWORTH_PMAT_H

#include <petscainsworth.h>
#include "../petsccompat.h"

struct AinsworthPmatOptions {
  PCAinsworthPmatType    type;
  PCAinsworthPenaltyType penalty;
  PetscReal              factor;     /* gamma */
  PetscBool              rowScaling; /* jcb does not depend on the scale of the rows of C */
  PetscReal              rtol;       /* of cg and bj_cg */
  PetscInt               blocks;     /* of bj_cc and bj_cg; PETSC_DECIDE: from the number of rows */
  PetscInt               maxRows;    /* of cc and cg, which may be dense */
  PetscBool              symmetric;  /* A = A' */
};

/* What the inner preconditioner takes */
typedef enum {
  AINSWORTH_PMAT_AIJ,
  AINSWORTH_PMAT_HYPRE,
  AINSWORTH_PMAT_SUM /* MATCOMPOSITE of A itself and M_* - A, which is not zero on the surface only */
} AinsworthPmatFormat;

struct AinsworthPmatInputs {
  Mat                 A, C, S;         /* AIJ; C without zero rows */
  Vec                 weight;          /* diagonal of W, NULL for W = I */
  Vec                 inverseDiagonal; /* diag(A)^{-1}, from AinsworthWeightCreate() */
  AinsworthPmatFormat format;
  Mat                 given; /* A as the program gave it, for AINSWORTH_PMAT_SUM */
};

PetscErrorCode AinsworthInvGramCreate(Mat, const AinsworthPmatOptions *, Mat *);
PetscErrorCode AinsworthPmatCreate(const AinsworthPmatInputs *, const AinsworthPmatOptions *, Vec *, Mat *);
PetscErrorCode AinsworthPmatComponentsApart(Mat, PetscInt, PetscBool *);
PetscErrorCode AinsworthBlocksCreate(Mat, PetscInt, PetscInt *);

#endif
