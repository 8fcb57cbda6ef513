/* Certificates of what a row that depends on others, and is not met, means for the system */
#ifndef AINSWORTH_CERTIFY_H
#define AINSWORTH_CERTIFY_H

#include "../saddle/saddle.h"

typedef enum {
  AINSWORTH_DEPENDENCE_CONSISTENT,    /* K' w = 0, and w' b is the rounding of the rows in w, whatever x is */
  AINSWORTH_DEPENDENCE_CONTRADICTION, /* K' w = 0, but not w' b: no solution exists */
  AINSWORTH_DEPENDENCE_NONE           /* w' K is a row of its own, which the system has besides the others */
} AinsworthDependence;

PetscErrorCode AinsworthCertify(const AinsworthSaddle *, Vec, Vec, PetscReal, Vec, AinsworthDependence *);

#endif
