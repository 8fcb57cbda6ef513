/*
   Estimates of the largest eigenvalue of a level, by moments of Chebyshev polynomials (Sack, Donovan, An algorithm for
   Gaussian quadrature given modified moments, Numer. Math. 18, 1971): all inner products are added up at the end, so
   that the steps of the Lanczos process take one reduction
*/
#include "levelmat.h"
#include "../base/eigen.h"
#include <cmath>

/*
   The polynomials are those of [0, interval] for D^{-1} M. Ten steps find .97 of what the Lanczos process finds where
   the largest eigenvalue is .6 to 2 times as large, as with elasticity, .95 from .3 to 10 times and .9 to 1000 times
   (tests/multigrid/mg_estimate.cpp)
*/
static const PetscReal interval = 2.5;
/* Below it what is left of a combination of polynomials is rounding, of products in single precision as well */
static const PetscReal roundingOfMoments = 1e-7;

/*
   The smoother damps what is above a tenth of 1.1 times the largest eigenvalue. Where an incomplete factor is exact the
   eigenvalue is 1, which has to be among these
*/
static const PetscReal mostOfFactor = 9.0;

/* AinsworthHash - returns a number in [-1, 1) that depends on l alone, so that it is the same on any number of ranks */
PetscReal AinsworthHash(size_t l)
{
  unsigned long long s = (unsigned long long)l * 0x9E3779B97F4A7C15ull + 0x1234567ull;

  s ^= s >> 29;
  s *= 0xBF58476D1CE4E5B9ull;
  s ^= s >> 32;
  return (PetscReal)((double)(s >> 11) / 4503599627370496.0 - 1.0);
}

/*
   AinsworthMomentsFindLargest - finds the largest Ritz value of a Hermitian operator X in the Krylov space of a vector
   v. Not collective

   Input Parameter:
.  moments - (v, T_k(X) v) for k = 0 to 2 steps - 1; those that overflowed, and what they belong to, are left out

   Output Parameter:
.  largest - the Ritz value; -1 where v is zero or not finite, or LAPACK fails

   The Gram matrix of T_i(X) v is ((v, T_{i+j} v) + (v, T_{|i-j|} v)) / 2, and X T_j = (T_{j+1} + T_{|j-1|}) / 2
*/
PetscErrorCode AinsworthMomentsFindLargest(const std::vector<PetscReal> &moments, PetscReal *largest)
{
  PetscInt     steps = 0, kept = 0;
  PetscBLASInt info;

  PetscFunctionBegin;
  *largest = -1.0;
  for (; steps < (PetscInt)moments.size() / 2; steps++)
    if (!std::isfinite(moments[2 * steps] + moments[2 * steps + 1])) break;
  if (!steps) PetscFunctionReturn(PETSC_SUCCESS);
  std::vector<PetscScalar> gram(steps * steps), basis, shifted;
  std::vector<PetscReal>   values(steps);
  auto                     inner = [&](PetscInt i, PetscInt j) { /* of T_i v and T_j v */
                                             return (moments[i + j] + moments[PetscAbs(i - j)]) / 2;
  };

  for (PetscInt i = 0; i < steps; i++)
    for (PetscInt j = 0; j < steps; j++) gram[i * steps + j] = inner(i, j);
  PetscCall(AinsworthHermitianEigen(steps, gram.data(), values.data(), &info));
  if (info) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < steps; k++) {
    if (!(values[k] > roundingOfMoments * values[steps - 1])) continue;
    for (PetscInt i = 0; i < steps; i++) basis.push_back(gram[k * steps + i] / PetscSqrtReal(values[k]));
    kept++;
  }
  if (!kept) PetscFunctionReturn(PETSC_SUCCESS);
  shifted.assign(kept * kept, 0.0);
  for (PetscInt k = 0; k < kept; k++)
    for (PetscInt l = 0; l < kept; l++)
      for (PetscInt i = 0; i < steps; i++)
        for (PetscInt j = 0; j < steps; j++)
          shifted[k * kept + l] += PetscConj(basis[k * steps + i]) * basis[l * steps + j] *
                                   (inner(i, j + 1) + inner(i, PetscAbs(j - 1))) / (PetscReal)2;
  PetscCall(AinsworthHermitianEigen(kept, shifted.data(), values.data(), &info));
  if (info) PetscFunctionReturn(PETSC_SUCCESS);
  *largest = values[kept - 1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthMomentsDouble - replaces (T_k v, T_k v) and (T_k v, T_{k+1} v) for k = 0 to steps - 1 by the moments, as
   T_{i+j} = 2 T_i T_j - T_{|i-j|}
*/
void AinsworthMomentsDouble(std::vector<PetscReal> *moments)
{
  for (size_t k = 2; k < moments->size(); k++) (*moments)[k] = 2 * (*moments)[k] - (*moments)[k % 2];
}

/*
   AinsworthLevel::estimate - estimates the largest eigenvalue of D^{-1} M or, in a subspace, of Q W Q' M, from below;
   with a factor that takes the place of D^{-1} and W. Collective

   The first residual is r_i = sqrt(m_ii) times a random number, so that stiff and soft unknowns have the same share.
   added: M is A plus a matrix with entries in these rows, and `largest` holds the eigenvalue of A. If that of M is
   larger, its eigenvector is near these rows, and starting there finds it in half of the steps (docs/multigrid.md).
   embedded: M is meant without the rows and columns of these nodes; empty: none
*/
PetscErrorCode AinsworthLevel::estimate(const AinsworthBlockRows *added, const std::vector<char> &embedded)
{
  const bool               factor = single && single->factor;
  const PetscInt           steps = added ? 5 : 10, rstart = nodes()->rstart;
  const size_t             n = diagonal->size(), bs = nodes()->n ? n / nodes()->n : 1;
  std::vector<PetscScalar> before(n), now(n), z(n), next(n); /* residuals T_k r, and W times the last one */
  std::vector<PetscReal>   w(n), moments(2 * steps);
  PetscReal                found;
  auto                     get = [&](PetscInt l, PetscInt) { return z[l]; };
  auto                     set = [&](PetscInt l, PetscInt, PetscScalar v) { z[l] = v; };
  auto                     dot = [&](const std::vector<PetscScalar> &v) {
    PetscReal sum = 0.0;

    for (size_t l = 0; l < n; l++) sum += PetscRealPart(PetscConj(z[l]) * v[l]);
    return sum;
  };

  PetscFunctionBegin;
  for (size_t l = 0; l < n; l++) {
    const bool starts = !added || added->i[l / bs] < added->i[l / bs + 1];

    now[l] = starts ? PetscSqrtReal((*diagonal)[l]) * AinsworthHash((size_t)rstart * bs + l) : 0.0;
    w[l]   = embedded.empty() || !embedded[l / bs] ? 1.0 / (*diagonal)[l] : 0.0;
  }
  if (subspace)
    for (size_t k = 0; k < subspace->at.size(); k++) w[subspace->at[k]] = subspace->space->weight[k];
  for (PetscInt k = 0; k < steps; k++) {
    z = now;
    if (subspace && (factor || subspace->space->excess > 0.0)) PetscCall(subspace->project(true, 1, get, set));
    if (factor) single->precondition(z.data());
    else
      for (size_t l = 0; l < n; l++) z[l] *= w[l];
    if (subspace) PetscCall(subspace->project(false, 1, get, set));
    PetscCall(mult(1.0, z.data(), next.data()));
    /* T_1 = X, T_{k+1} = 2 X T_k - T_{k-1} with X = 2 M W / interval - 1 */
    for (size_t l = 0; l < n; l++)
      next[l] = k ? (4.0 / interval) * next[l] - (PetscReal)2 * now[l] - before[l] : 2.0 / interval * next[l] - now[l];
    moments[2 * k]     = dot(now);
    moments[2 * k + 1] = dot(next);
    before.swap(now);
    now.swap(next);
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, moments.data(), 2 * steps, MPIU_REAL, MPIU_SUM, nodes()->comm));
  AinsworthMomentsDouble(&moments);
  PetscCall(AinsworthMomentsFindLargest(moments, &found));
  found = interval * (found + 1.0) / 2.0;
  if (!(found > 0.0)) found = factor ? PETSC_MAX_REAL : 1.0; /* solves with pivots near zero may overflow */
  largest = added ? PetscMax(found, largest) : found;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthLevel::giveFactor - lets an incomplete factor smooth a level in single precision, and estimates its largest
   eigenvalue. There is none if a pivot on some rank is not positive definite, or near zero. Collective

   added: NULL, or what the level has beside its upper half
*/
PetscErrorCode AinsworthLevel::giveFactor(const AinsworthBlockRows *added)
{
  PetscBool exists;

  PetscFunctionBegin;
  single->factor = AinsworthIncomplete::create(single->product->upper, added, single->w->data());
  exists         = (PetscBool)(single->factor != NULL);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &exists, 1, AINSWORTH_MPI_BOOL, MPI_LAND, nodes()->comm));
  if (!exists) single->factor.reset();
  single->z.assign(exists ? single->x.size() : 0, AinsworthSingle(0));
  if (exists) PetscCall(judgeFactor(largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthLevel::judgeFactor - estimates the largest eigenvalue with the factor, and gives that up if it is too large.
   Collective

   jacobi: the largest eigenvalue without it
*/
PetscErrorCode AinsworthLevel::judgeFactor(PetscReal jacobi)
{
  PetscFunctionBegin;
  PetscCall(estimate(NULL, {}));
  if (largest <= mostOfFactor) PetscFunctionReturn(PETSC_SUCCESS);
  largest = jacobi;
  single->factor.reset();
  PetscFunctionReturn(PETSC_SUCCESS);
}
