/* What a block -D adds to the projection: springs in series with the constraints (docs/method.md, compliance) */
#ifndef AINSWORTH_COMPLIANCE_H
#define AINSWORTH_COMPLIANCE_H

#include "../base/petsccompat.h"

/*
   With mu = G lambda the constraint C x - D lambda = g becomes C x - N mu = g with N = D G^{-1}, and the energy of the
   springs is mu' E mu / 2 with E = G^{-1} D G^{-1}

   G is diagonal: 1 as a rule, smaller where D is far smaller than the flexibility (C diag(A)^{-1} C')_ii of A under a
   constraint, larger where a D that couples rows is far larger.
*/
struct AinsworthCompliance {
  Mat       N = NULL, E = NULL; /* m x m, laid out as the rows of C; NULL if D = 0 */
  Vec       sums    = NULL;     /* m, row sums of |D|, with the sign of D_ii */
  Vec       rest    = NULL;     /* m, energy of mu where D is zero, a tiny one in rows that D couples, else 0 */
  Vec       inverse = NULL;     /* m, 1 / G */
  PetscReal soft    = 0.0;      /* 1 / G of the rows that D couples, if below 1; else 0 */
};

PetscErrorCode AinsworthComplianceSetUp(AinsworthCompliance *, Mat C, Mat B, Mat D, Vec weight, Vec inverseDiagonal);
PetscErrorCode AinsworthComplianceGetPreconditioner(const AinsworthCompliance *, Vec penalty, Vec shared, Vec inverse);
PetscErrorCode AinsworthComplianceReset(AinsworthCompliance *);

#endif
