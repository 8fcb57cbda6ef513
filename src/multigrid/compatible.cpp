/*
   How well a smoother does what the coarser level cannot do: compatible relaxation (Brandt, Electron. Trans. Numer.
   Anal. 10, 2000; Falgout, Vassilevski, SIAM J. Numer. Anal. 42, 2004)
*/
#include "levelmat.h"
#include "definite.h"
#include "../base/lists.h"
#include <algorithm>

/* Steps of the Lanczos process: both ends of the spectrum within a factor of 2 (docs/multigrid.md) */
static const PetscInt steps = 5;

namespace
{
/* The projector I - T (T' D T)^{-1} T' D in the variables D^{1/2} x, aggregate by aggregate */
class Complement {
public:
  Complement(const AinsworthTentative &tentative, const std::vector<PetscReal> &root)
    : T(tentative), D(root), at(T.aggregate), coarse(0)
  {
    const PetscInt        k = T.k;
    std::vector<PetscInt> mine(at);

    AinsworthSortUnique(&mine);
    if (mine.size() && mine[0] < 0) mine.erase(mine.begin());
    for (PetscInt &g : at)
      if (g >= 0) g = (PetscInt)(std::lower_bound(mine.begin(), mine.end(), g) - mine.begin());
    inverse.assign(mine.size() * k * k, 0.0);
    coarse.resize(mine.size() * k);
    forUnknowns([&](size_t u, PetscInt g) {
      for (PetscInt a = 0; a < k; a++)
        for (PetscInt b = 0; b < k; b++)
          inverse[(g * k + a) * k + b] += D[u] * D[u] * PetscConj(T.values[u * k + a]) * T.values[u * k + b];
    });
    for (size_t g = 0; g < mine.size(); g++) {
      PetscScalar *G = &inverse[g * k * k];

      for (PetscInt a = 0; a < k; a++) /* a mode that the aggregate does not have */
        if (G[a * k + a] == 0.0) G[a * k + a] = 1.0;
      if (!AinsworthInvertDefinite<0>(k, G)) std::fill_n(G, k * k, 0.0);
    }
  }

  void project(std::vector<PetscScalar> *x)
  {
    const PetscInt k = T.k;

    std::fill(coarse.begin(), coarse.end(), 0.0);
    forUnknowns([&](size_t u, PetscInt g) {
      for (PetscInt a = 0; a < k; a++) coarse[g * k + a] += D[u] * PetscConj(T.values[u * k + a]) * (*x)[u];
    });
    for (size_t g = 0; g < coarse.size() / k; g++) {
      std::vector<PetscScalar> y(k, 0.0);

      for (PetscInt a = 0; a < k; a++)
        for (PetscInt b = 0; b < k; b++) y[a] += inverse[(g * k + a) * k + b] * coarse[g * k + b];
      std::copy(y.begin(), y.end(), coarse.begin() + g * k);
    }
    for (size_t i = 0; i < at.size(); i++) /* nodes that nothing is coupled with are solved by the smoother */
      for (PetscInt c = 0; c < T.bs && at[i] < 0; c++) (*x)[i * T.bs + c] = 0.0;
    forUnknowns([&](size_t u, PetscInt g) {
      for (PetscInt a = 0; a < k; a++) (*x)[u] -= D[u] * T.values[u * k + a] * coarse[g * k + a];
    });
  }

private:
  const AinsworthTentative     &T;
  const std::vector<PetscReal> &D;  /* the roots */
  std::vector<PetscInt>         at; /* the aggregate of each node among those of this rank; -1: none */
  std::vector<PetscScalar>      inverse, coarse;

  template <class F>
  void forUnknowns(F f) const
  {
    for (size_t i = 0; i < at.size(); i++)
      for (PetscInt c = 0; c < T.bs && at[i] >= 0; c++) f(i * T.bs + c, at[i]);
  }
};
} // namespace

/*
   AinsworthFindCompatibleCondition - estimates the condition number of D^{-1} M in the complement of the range of
   tentative interpolation, from below: the least eigenvalue is the inverse of the constant of the weak approximation
   property (docs/method.md). Collective

   level: of width 1, whose largest eigenvalue has been estimated
*/
PetscErrorCode AinsworthFindCompatibleCondition(AinsworthLevel *level, const AinsworthTentative &T,
                                                PetscReal *condition)
{
  const size_t             n        = level->diagonal->size();
  const PetscReal          interval = 1.1 * level->largest; /* as that of Chebyshev's smoother */
  std::vector<PetscReal>   root(n), moments(2 * steps);
  std::vector<PetscScalar> before(n), now(n), next(n);
  PetscReal                most, least;
  auto                     dot = [&](const std::vector<PetscScalar> &a, const std::vector<PetscScalar> &b) {
    PetscReal sum = 0.0;

    for (size_t l = 0; l < n; l++) sum += PetscRealPart(PetscConj(a[l]) * b[l]);
    return sum;
  };

  PetscFunctionBegin;
  for (size_t l = 0; l < n; l++) root[l] = PetscSqrtReal((*level->diagonal)[l]);
  Complement complement(T, root);
  for (size_t l = 0; l < n; l++) now[l] = AinsworthHash((size_t)level->nodes()->rstart * T.bs + l);
  complement.project(&now);
  for (PetscInt k = 0; k < steps; k++) {
    std::vector<PetscScalar> z(n);

    for (size_t l = 0; l < n; l++) z[l] = now[l] / root[l];
    PetscCall(level->mult(1.0, z.data(), next.data()));
    for (size_t l = 0; l < n; l++) next[l] /= root[l];
    complement.project(&next);
    for (size_t l = 0; l < n; l++)
      next[l] = k ? (4.0 / interval) * next[l] - (PetscReal)2 * now[l] - before[l] : 2.0 / interval * next[l] - now[l];
    moments[2 * k]     = dot(now, now);
    moments[2 * k + 1] = dot(now, next);
    before.swap(now);
    now.swap(next);
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, moments.data(), 2 * steps, MPIU_REAL, MPIU_SUM, level->nodes()->comm));
  AinsworthMomentsDouble(&moments);
  PetscCall(AinsworthMomentsFindLargest(moments, &most));
  for (PetscInt k = 1; k < 2 * steps; k += 2) moments[k] = -moments[k]; /* those of -X */
  PetscCall(AinsworthMomentsFindLargest(moments, &least));
  *condition = most > -1.0 && least < 1.0 ? (1.0 + most) / (1.0 - least) : 1.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
