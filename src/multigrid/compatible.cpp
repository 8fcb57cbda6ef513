/*
   How well a smoother does what the coarser level cannot do: compatible relaxation (Brandt, Electron. Trans. Numer.
   Anal. 10, 2000; Falgout, Vassilevski, SIAM J. Numer. Anal. 42, 2004)
*/
#include "hierarchy.h"
#include "definite.h"
#include "moments.h"
#include "../base/lists.h"
#include <algorithm>

/*
   Steps of the Lanczos process. After the first ones the condition number of isotropic elements is found to be 4 to 8,
   and that is all one wants to know: of 24 systems none went on from there to one that calls for a factor that exists
*/
static const PetscInt  firstSteps = 4, steps = 10;
static const PetscReal conditionOfFirst = 8.0;

typedef std::vector<AinsworthSingle> Values;

namespace
{
/* The range of interpolation T by the modes of aggregates, in variables x with M = D^{-1/2} W A W D^{-1/2} */
class Range {
public:
  Range(const AinsworthTentative &T, const AinsworthScaled &L)
    : bs(T.bs), k(T.k), stride(L.product->stride()), of(T.aggregate)
  {
    std::vector<PetscInt>    mine;
    std::vector<PetscScalar> gram;

    for (PetscInt i : T.followers) of[i] = -1; /* A does not know them */
    mine = of;
    AinsworthSortUnique(&mine);
    if (!mine.empty() && mine[0] < 0) mine.erase(mine.begin());
    for (PetscInt &g : of)
      if (g >= 0) g = (PetscInt)(std::lower_bound(mine.begin(), mine.end(), g) - mine.begin());
    gram.assign(mine.size() * k * k, 0.0);
    basis.reserve(T.values.size());
    for (size_t u = 0; u < of.size() * bs; u++) {
      const PetscReal d = 1.0 / PetscRealPart(L.inverse[u / bs * stride + u % bs]), w = (*L.w)[u];
      PetscScalar    *G = of[u / bs] < 0 ? NULL : &gram[(size_t)of[u / bs] * k * k];

      for (PetscInt a = 0; a < k; a++) {
        const PetscScalar t = T.values[u * k + a] / w;

        basis.push_back((AinsworthSingle)(PetscSqrtReal(d) * t));
        for (PetscInt b = 0; G && b < k; b++) G[a * k + b] += d * PetscConj(t) * T.values[u * k + b] / w;
      }
    }
    for (size_t g = 0; g < mine.size(); g++) {
      PetscScalar *G = &gram[g * k * k];

      for (PetscInt a = 0; a < k; a++) /* a mode that the aggregate does not have */
        if (G[a * k + a] == 0.0) G[a * k + a] = 1.0;
      if (!AinsworthInvertDefinite<0>(k, G)) std::fill_n(G, k * k, 0.0);
    }
    for (PetscScalar v : gram) inverse.push_back((AinsworthSingle)v);
    part.resize(mine.size() * k);
    solved.resize(part.size());
  }

  /* Replaces x, of which nothing lies beyond the nodes, by its part in the complement */
  void leave(Values *x)
  {
    AinsworthDispatch(bs, k, [&](auto R, auto C) { leaveBlocks<R(), C()>(x->data()); });
  }

private:
  const PetscInt        bs, k, stride;
  std::vector<PetscInt> of;      /* the aggregate of each node among those of this rank; -1: none */
  Values                basis;   /* D^{1/2} W^{-1} T */
  Values                inverse; /* of its Gram matrix, for each aggregate */
  Values                part, solved;

  template <int R, int C>
  AINSWORTH_CLONES void leaveBlocks(AinsworthSingle *x)
  {
    const PetscInt br = R ? R : bs, bc = C ? C : k;

    std::fill(part.begin(), part.end(), AinsworthSingle(0));
    for (size_t i = 0; i < of.size(); i++) {
      const AinsworthSingle *b = &basis[i * br * bc];

      for (PetscInt p = 0; of[i] >= 0 && p < br; p++)
        for (PetscInt q = 0; q < bc; q++) part[of[i] * bc + q] += AinsworthConj(b[p * bc + q]) * x[i * stride + p];
    }
    for (size_t g = 0; g < part.size() / bc; g++)
      for (PetscInt p = 0; p < bc; p++) {
        solved[g * bc + p] = 0;
        for (PetscInt q = 0; q < bc; q++) solved[g * bc + p] += inverse[(g * bc + p) * bc + q] * part[g * bc + q];
      }
    for (size_t i = 0; i < of.size(); i++) {
      const AinsworthSingle *b = &basis[i * br * bc];

      for (PetscInt p = 0; p < br; p++) {
        if (of[i] < 0) x[i * stride + p] = 0; /* what nothing is coupled with is left to the smoother */
        for (PetscInt q = 0; of[i] >= 0 && q < bc; q++) x[i * stride + p] -= b[p * bc + q] * solved[of[i] * bc + q];
      }
    }
  }
};
} // namespace

/* Gets the condition number from what AinsworthMomentsAdvance() left. Collective */
static PetscErrorCode Evaluate(MPI_Comm comm, std::vector<PetscReal> moments, PetscReal *condition)
{
  PetscReal most, least;

  PetscFunctionBegin;
  PetscCall(AinsworthMomentsReduce(comm, &moments));
  PetscCall(AinsworthMomentsFindLargest(moments, &most));
  for (size_t k = 1; k < moments.size(); k += 2) moments[k] = -moments[k]; /* those of -X */
  PetscCall(AinsworthMomentsFindLargest(moments, &least));
  *condition = most > -1.0 && least < 1.0 ? (1.0 + most) / (1.0 - least) : 1.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindCompatibleCondition - estimates the condition number of D^{-1} A in the complement of the range of
   interpolation by the modes of aggregates, from below: its least eigenvalue is the inverse of the constant of the weak
   approximation property (docs/method.md). Collective

   grid: in single precision; its largest eigenvalue is known
*/
PetscErrorCode AinsworthFindCompatibleCondition(const AinsworthGrid &grid, const AinsworthTentative &T,
                                                PetscReal *condition)
{
  std::unique_ptr<AinsworthLevel> level;
  const PetscReal                 scale = 2.0 / (1.1 * grid.largest); /* of [0, 1.1 largest] to [0, 2] */
  std::vector<PetscReal>          moments;

  PetscFunctionBegin;
  PetscCall(grid.createLevel(NULL, true, false, &level));
  AinsworthScaled &L      = *level->single;
  const PetscInt   stride = L.product->stride();
  Range            range(T, L);
  Values          &root = L.inverse, &now = L.x, next(now.size()), before(now.size());
  for (AinsworthSingle &v : root) v = std::sqrt(v);
  for (PetscInt u = 0; u < grid.nodes->n * T.bs; u++)
    now[u / T.bs * stride + u % T.bs] = (AinsworthSingle)AinsworthHash((size_t)grid.nodes->rstart * T.bs + (size_t)u);
  range.leave(&now);
  for (PetscInt k = 0; k < steps; k++) {
    for (size_t l = 0; l < now.size(); l++) L.p[l] = root[l] * now[l];
    PetscCall(L.product->mult(L.p.data(), L.r.data()));
    for (size_t l = 0; l < now.size(); l++) next[l] = root[l] * L.r[l];
    range.leave(&next);
    AinsworthMomentsAdvance(scale, now, &before, &now, &next, &moments);
    if (k + 1 < firstSteps || (k + 1 > firstSteps && k + 1 < steps)) continue;
    PetscCall(Evaluate(grid.nodes->comm, moments, condition));
    if (*condition <= conditionOfFirst) break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
