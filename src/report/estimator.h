/* The energy norm of the error of conjugate gradients, from their coefficients alone (docs/report.md) */
#ifndef AINSWORTH_ESTIMATOR_H
#define AINSWORTH_ESTIMATOR_H

#include "../petsccompat.h"
#include <vector>

struct AinsworthEstimator {
  PetscReal              eigenvalue;      /* lower bound of the spectrum of the preconditioned operator; 0: estimated */
  std::vector<PetscReal> fall;            /* what step k takes off the squared error: alpha_k r_k' z_k */
  PetscInt               accurate;        /* the iterates before this one have an accurate lower bound */
  PetscReal              rz;              /* r' z of the last iterate */
  PetscReal              alpha;           /* of the last step */
  PetscReal              beta;            /* by which the last step multiplied r' z */
  PetscReal              radau;           /* modified coefficient of the Gauss-Radau rule; not positive: the eigenvalue is too large */
  PetscReal              phi;             /* r' z / p' M p */
  PetscReal              rho, sigma, tau; /* incremental estimate of the largest eigenvalue of the inverse Lanczos matrix */
};

void AinsworthEstimatorStart(AinsworthEstimator *, PetscReal eigenvalue, PetscReal rz);
void AinsworthEstimatorStep(AinsworthEstimator *, PetscReal alpha, PetscReal rz);
/* of the error of an iterate, in the energy norm */
PetscReal AinsworthEstimatorLower(const AinsworthEstimator *, PetscInt iteration);
PetscReal AinsworthEstimatorUpper(const AinsworthEstimator *, PetscInt iteration);
/* is the error of the last accurate iterate at most this? */
bool AinsworthEstimatorReached(const AinsworthEstimator *, PetscReal error);

#endif
