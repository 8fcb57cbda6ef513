/* What a block -D does to the projection: springs in series with the constraints (docs/method.md, compliance) */
#ifndef AINSWORTH_COMPLIANCE_H
#define AINSWORTH_COMPLIANCE_H

#include "../petsccompat.h"

/*
   With mu = G lambda the constraint C x - D lambda = g is C x - N mu = g, N = D G^{-1}, and the springs' energy is mu' E mu, E = G^{-1} D G^{-1}. G is
   diagonal: 1, or smaller where D is far smaller than the flexibility (C diag(A)^{-1} C')_ii that A has under a constraint, larger where a D that couples rows
   is far larger
*/
struct AinsworthCompliance {
  Mat       N, E; /* m x m, rows as those of C; NULL: D = 0 */
  Vec       sums; /* m, of the rows of |D|, negative where D_ii is */
  Vec       rest; /* m, the energy that a mu gets where D has nothing in the row, else 0 */
  PetscReal soft; /* 1 / G of the rows that D couples, where that is below 1, else 0 */
};

PetscErrorCode AinsworthComplianceSetUp(AinsworthCompliance *, Mat C, Mat B, Mat D, Vec weight, Vec inverseDiagonal);
PetscErrorCode AinsworthComplianceGetPreconditioner(const AinsworthCompliance *, Vec penalty, Vec shared, Vec inverse);
PetscErrorCode AinsworthComplianceReset(AinsworthCompliance *);

#endif
