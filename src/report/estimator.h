/* Bounds of the energy norm of the error of conjugate gradients, from their coefficients alone (docs/options.md) */
#ifndef AINSWORTH_ESTIMATOR_H
#define AINSWORTH_ESTIMATOR_H

#include "../base/petsccompat.h"
#include <vector>

struct AinsworthEstimator {
  /* lower bound of the spectrum of the preconditioned operator; 0 to estimate it */
  PetscReal              eigenvalue = 0.0;
  std::vector<PetscReal> fall;           /* decrease of the squared error in step k: alpha_k r_k' z_k */
  PetscInt               accurate = 0;   /* the iterates before this one have an accurate lower bound */
  PetscReal              rz       = 0.0; /* r' z of the last iterate */
  PetscReal              alpha    = 0.0; /* of the last step */
  PetscReal              beta     = 0.0; /* factor of r' z in the last step */
  /* modified coefficient of the Gauss-Radau rule; not positive if the eigenvalue is too large */
  PetscReal radau = 0.0;
  PetscReal phi   = 0.0; /* r' z / p' M p */
  /* incremental estimate of the largest eigenvalue of the inverse Lanczos matrix */
  PetscReal rho = 0.0, sigma = 0.0, tau = 0.0;
};

void AinsworthEstimatorStart(AinsworthEstimator *, PetscReal eigenvalue, PetscReal rz);
void AinsworthEstimatorStep(AinsworthEstimator *, PetscReal alpha, PetscReal rz);
/* Return bounds of the error of an iterate, in the energy norm */
PetscReal AinsworthEstimatorLower(const AinsworthEstimator *, PetscInt iteration);
PetscReal AinsworthEstimatorUpper(const AinsworthEstimator *, PetscInt iteration);
/* Checks whether the error of the last accurate iterate is at most `error` */
bool AinsworthEstimatorReached(const AinsworthEstimator *, PetscReal error);

#endif
