/* What a block -D does to the projection: springs in series with the constraints (docs/method.md, compliance) */
#ifndef AINSWORTH_COMPLIANCE_H
#define AINSWORTH_COMPLIANCE_H

#include "../petsccompat.h"

/*
   With mu = G lambda the constraint C x - D lambda = g is C x - N mu = g, N = D G^{-1}, and the springs' energy is mu' E mu, E = G^{-1} D G^{-1}.
   |G_ii| = (D_ii / flexibility_i)^{1/2} makes E the flexibility that A has under each constraint, however large or small D is.
*/
struct AinsworthCompliance {
  Mat N, E;        /* m x m, rows as those of C; NULL: D = 0 */
  Vec ratio;       /* m, G */
  Vec flexibility; /* m, (C diag(A)^{-1} C')_ii */
  Vec sums;        /* m, of the rows of |D|, negative where D_ii is */
  Vec rest;        /* m, flexibility where D has nothing in the row, else 0: a mu of such a row gets an energy of its own */
  Vec soft;        /* m, 1 / G_ii where D_ii stands alone and is larger than the flexibility, else 0: D lambda = C x - g determines lambda there */
  Vec together;    /* m, 1 / G_ii where that is below 1 and D couples the row with others, else 0: the same in several steps */
};

PetscErrorCode AinsworthComplianceSetUp(AinsworthCompliance *, Mat C, Mat B, Mat D, Vec weight, Vec inverseDiagonal);
PetscErrorCode AinsworthComplianceGetPreconditioner(const AinsworthCompliance *, Vec penalty, Vec shared, Vec inverse);
PetscErrorCode AinsworthComplianceReset(AinsworthCompliance *);

#endif
