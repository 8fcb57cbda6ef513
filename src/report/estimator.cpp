#include "estimator.h"
#include <cmath>

/*
   Part of the squared error that an accurate lower bound may miss, and its reduction over which Safety() looks back
   (Meurant, Papez, Tichy 2021)
*/
static const PetscReal missing = 0.25, history = 1e-4;

void AinsworthEstimatorStart(AinsworthEstimator *e, PetscReal eigenvalue, PetscReal rz)
{
  e->eigenvalue = eigenvalue;
  e->fall.clear();
  e->accurate = 0;
  e->rz       = rz;
  e->alpha = e->beta = 0.0;
  e->phi             = 1.0;
  e->radau           = eigenvalue > 0.0 ? 1.0 / eigenvalue : 0.0;
  e->rho = e->sigma = e->tau = 0.0;
}

/*
   Updates the estimate of the smallest Ritz value, 1 / ||L^{-1}||^2, for the Cholesky factor L of the Lanczos matrix,
   which grows by one row per step

   ||L^{-1}|| is estimated from below by the best combination of the old vector and the new unit vector (Meurant, Tichy
   2019).
*/
static void GrowLanczosMatrix(AinsworthEstimator *e, PetscReal alpha)
{
  if (e->fall.empty()) {
    e->rho = e->sigma = e->tau = alpha;
    return;
  }
  const PetscReal ratio = std::sqrt(e->beta * alpha / e->alpha);

  e->tau                   = ratio * ratio * e->tau + alpha;
  const PetscReal coupling = -ratio * e->sigma, half = (e->rho - e->tau) / 2, root = std::hypot(half, coupling);
  const PetscReal largest = (e->rho + e->tau) / 2 + root;
  /* its eigenvector, from the row without cancellation */
  PetscReal       s = half > 0 ? half + root : coupling, c = half > 0 ? coupling : root - half;
  const PetscReal length = std::hypot(s, c);

  s        = length > 0 ? s / length : 1.0;
  c        = length > 0 ? c / length : 0.0;
  e->sigma = s * coupling + c * e->tau;
  e->rho   = largest;
}

/* Returns the largest quotient of the squared error and its decrease in recent steps */
static PetscReal Safety(const AinsworthEstimator *e)
{
  const PetscReal last  = e->fall.back();
  PetscReal       error = last, safety = 1.0;

  for (size_t k = e->fall.size() - 1; k-- > 0;) {
    error += e->fall[k];
    safety = PetscMax(safety, error / e->fall[k]);
    if (last <= history * error) break;
  }
  return safety;
}

/* Sums the decreases of steps first to end - 1, the smallest first */
static PetscReal Sum(const AinsworthEstimator *e, PetscInt first, PetscInt end)
{
  PetscReal sum = 0.0;

  for (PetscInt k = end; k-- > first;) sum += e->fall[k];
  return sum;
}

/* Records the step from the last iterate to the one with this r' z */
void AinsworthEstimatorStep(AinsworthEstimator *e, PetscReal alpha, PetscReal rz)
{
  const PetscInt  step = (PetscInt)e->fall.size();
  const PetscReal beta = e->rz > 0.0 ? rz / e->rz : 0.0, modified = e->radau - alpha;

  GrowLanczosMatrix(e, alpha);
  e->fall.push_back(alpha * e->rz);
  if (e->eigenvalue > 0.0) e->radau = modified > 0.0 ? modified / (e->eigenvalue * modified + beta) : -1.0;
  e->phi   = e->phi / (e->phi + beta);
  e->alpha = alpha;
  e->beta  = beta;
  e->rz    = rz;

  const PetscReal rest = Safety(e) * e->fall.back();
  while (e->accurate < step && rest <= missing * Sum(e, e->accurate, step)) e->accurate++;
}

PetscReal AinsworthEstimatorLower(const AinsworthEstimator *e, PetscInt iteration)
{
  return std::sqrt(Sum(e, iteration, (PetscInt)e->fall.size()));
}

/*
   Estimates the squared error of the last iterate by the simpler bound without poles (Meurant, Tichy 2019), with the
   smallest Ritz value
*/
static PetscReal Estimated(const AinsworthEstimator *e)
{
  return e->phi * e->rho * e->rz;
}

/*
   Returns the Gauss-Radau bound if an eigenvalue was given (Golub, Meurant 1997), otherwise the estimate

   NAN if the given eigenvalue is too large, or before the first step gives a Ritz value
*/
PetscReal AinsworthEstimatorUpper(const AinsworthEstimator *e, PetscInt iteration)
{
  PetscReal rest;

  if (e->eigenvalue > 0.0) rest = e->radau > 0.0 ? e->radau * e->rz : NAN;
  else rest = e->fall.empty() ? NAN : Estimated(e);
  return std::sqrt(rest + Sum(e, iteration, (PetscInt)e->fall.size()));
}

/*
   Requires both bounds, because the lower bound alone would stop on a plateau

   Without a given eigenvalue the upper bound would stop there, too, as long as no coefficient shows a small eigenvalue
*/
bool AinsworthEstimatorReached(const AinsworthEstimator *e, PetscReal error)
{
  if (!e->accurate) return false;
  const PetscReal lower = Sum(e, e->accurate - 1, (PetscInt)e->fall.size());
  const PetscReal rest  = e->radau > 0.0 ? e->radau * e->rz : Estimated(e);
  return PetscMax(lower / (1 - missing), lower + rest) <= error * error;
}
