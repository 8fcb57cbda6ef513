/* Bounds of the energy norm of the error of conjugate gradients, from their coefficients alone (docs/report.md) */
#ifndef AINSWORTH_ESTIMATOR_H
#define AINSWORTH_ESTIMATOR_H

#include "../petsccompat.h"
#include <vector>

struct AinsworthEstimator {
  PetscReal              eigenvalue;      /* lower bound of the spectrum of the preconditioned operator; 0 to estimate it */
  std::vector<PetscReal> fall;            /* decrease of the squared error in step k: alpha_k r_k' z_k */
  PetscInt               accurate;        /* the iterates before this one have an accurate lower bound */
  PetscReal              rz;              /* r' z of the last iterate */
  PetscReal              alpha;           /* of the last step */
  PetscReal              beta;            /* factor of r' z in the last step */
  PetscReal              radau;           /* modified coefficient of the Gauss-Radau rule; not positive if the eigenvalue is too large */
  PetscReal              phi;             /* r' z / p' M p */
  PetscReal              rho, sigma, tau; /* incremental estimate of the largest eigenvalue of the inverse Lanczos matrix */
};

void AinsworthEstimatorStart(AinsworthEstimator *, PetscReal eigenvalue, PetscReal rz);
void AinsworthEstimatorStep(AinsworthEstimator *, PetscReal alpha, PetscReal rz);
/* Return bounds of the error of an iterate, in the energy norm */
PetscReal AinsworthEstimatorLower(const AinsworthEstimator *, PetscInt iteration);
PetscReal AinsworthEstimatorUpper(const AinsworthEstimator *, PetscInt iteration);
/* Checks whether the error of the last accurate iterate is at most `error` */
bool AinsworthEstimatorReached(const AinsworthEstimator *, PetscReal error);

#endif
