#include "estimator.h"
#include <cmath>

/* share of the squared error that an accurate lower bound may miss, and the fall of the squared error that history reaches back to
   (Meurant, Papez, Tichy 2021) */
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
   The smallest Ritz value is 1 / ||L^{-1}||^2, L the Cholesky factor of the Lanczos matrix, which grows by one row a step.
   ||L^{-1}|| is estimated from below by the best combination of the old vector and the new unit vector (Meurant, Tichy 2019).
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
  /* its eigenvector, from the row that does not cancel */
  PetscReal       s = half > 0 ? half + root : coupling, c = half > 0 ? coupling : root - half;
  const PetscReal length = std::hypot(s, c);

  s        = length > 0 ? s / length : 1.0;
  c        = length > 0 ? c / length : 0.0;
  e->sigma = s * coupling + c * e->tau;
  e->rho   = largest;
}

/* How much larger the squared error was than what the step took off it, at worst in recent steps */
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

/* Sums start at the small end */
static PetscReal Sum(const AinsworthEstimator *e, PetscInt first, PetscInt end)
{
  PetscReal sum = 0.0;

  for (PetscInt k = end; k-- > first;) sum += e->fall[k];
  return sum;
}

/* The step from the last iterate to the one whose r' z is given */
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

/* What is left of the squared error at the last iterate: by the simpler bound that has no poles (Meurant, Tichy 2019), with the smallest Ritz value */
static PetscReal Estimated(const AinsworthEstimator *e)
{
  return e->phi * e->rho * e->rz;
}

/* Gauss-Radau with the given eigenvalue (Golub, Meurant 1997), otherwise the estimate. NAN where the given eigenvalue turned out too large, or before the
   first step gave a Ritz value */
PetscReal AinsworthEstimatorUpper(const AinsworthEstimator *e, PetscInt iteration)
{
  PetscReal rest;

  if (e->eigenvalue > 0.0) rest = e->radau > 0.0 ? e->radau * e->rz : NAN;
  else rest = e->fall.empty() ? NAN : Estimated(e);
  return std::sqrt(rest + Sum(e, iteration, (PetscInt)e->fall.size()));
}

/* The lower bound alone would end on a plateau, and so would the upper one where no coefficient tells of a small eigenvalue yet, unless one is given */
bool AinsworthEstimatorReached(const AinsworthEstimator *e, PetscReal error)
{
  if (!e->accurate) return false;
  const PetscReal lower = Sum(e, e->accurate - 1, (PetscInt)e->fall.size());
  const PetscReal rest  = e->radau > 0.0 ? e->radau * e->rz : Estimated(e);
  return PetscMax(lower / (1 - missing), lower + rest) <= error * error;
}
