/* Estimates of the largest eigenvalue of a level, with Jacobi or with an incomplete factor */
#include "levelmat.h"
#include "moments.h"

/*
   The polynomials are those of [0, interval] for D^{-1} M. Ten steps find .97 of what the Lanczos process finds where
   the largest eigenvalue is .6 to 2 times as large, as with elasticity, .95 from .3 to 10 times and .9 to 1000 times
   (tests/multigrid/mg_estimate.cpp)
*/
static const PetscReal interval = 2.5;

/*
   The smoother damps what is above a tenth of 1.1 times the largest eigenvalue. Where an incomplete factor is exact the
   eigenvalue is 1, which has to be among these
*/
static const PetscReal mostOfFactor = 9.0;

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
  const bool               factor = factored();
  const PetscInt           steps = added ? 5 : 10, rstart = nodes()->rstart;
  const size_t             n = diagonal->size(), bs = nodes()->n ? n / nodes()->n : 1;
  std::vector<PetscScalar> before(n), now(n), z(n), next(n); /* residuals T_k r, and W times the last one */
  std::vector<PetscReal>   w(n), moments;
  PetscReal                found;
  auto                     get = [&](PetscInt l, PetscInt) { return z[l]; };
  auto                     set = [&](PetscInt l, PetscInt, PetscScalar v) { z[l] = v; };

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
    if (factor) PetscCall(single->precondition(subspace.get(), z.data()));
    else {
      if (subspace && subspace->space->excess > 0.0) PetscCall(subspace->project(true, 1, get, set));
      for (size_t l = 0; l < n; l++) z[l] *= w[l];
      if (subspace) PetscCall(subspace->project(false, 1, get, set));
    }
    PetscCall(mult(1.0, z.data(), next.data()));
    AinsworthMomentsAdvance(2.0 / interval, z, &before, &now, &next, &moments);
  }
  PetscCall(AinsworthMomentsReduce(nodes()->comm, &moments));
  PetscCall(AinsworthMomentsFindLargest(moments, &found));
  found = interval * (found + 1.0) / 2.0;
  if (!(found > 0.0)) found = factor ? PETSC_MAX_REAL : 1.0; /* solves with pivots near zero may overflow */
  largest = added ? PetscMax(found, largest) : found;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthLevel::giveFactor - lets an incomplete factor smooth a level in single precision, unless a pivot on some
   rank is not positive definite, or near zero, or its largest eigenvalue, which takes the place of that with Jacobi, is
   too large. Collective

   added: NULL, or what the level has beside its upper half
*/
PetscErrorCode AinsworthLevel::giveFactor(const AinsworthBlockRows *added)
{
  const PetscReal   jacobi = largest;
  PetscBool         exists;
  std::vector<char> last(subspace ? nodes()->n : 0, 0);

  PetscFunctionBegin;
  if (subspace)
    for (PetscInt l : subspace->at) last[l / single->product->bs()] = 1;
  single->factor = AinsworthIncomplete::create(single->product->upper, added, single->w->data(), last);
  exists         = (PetscBool)(single->factor != NULL);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &exists, 1, AINSWORTH_MPI_BOOL, MPI_LAND, nodes()->comm));
  if (exists) {
    single->z.assign(single->x.size(), AinsworthSingle(0));
    PetscCall(estimate(NULL, {}));
    if (largest <= mostOfFactor) PetscFunctionReturn(PETSC_SUCCESS);
  }
  largest = jacobi;
  single->factor.reset();
  single->z = std::vector<AinsworthSingle>();
  PetscFunctionReturn(PETSC_SUCCESS);
}
