#include "coarsen.h"
#include <algorithm>

namespace
{
/* The graph of the local nodes with the strengths of their couplings */
struct Graph {
  const AinsworthBlockRows &A;
  const PetscInt            n = 0;
  std::vector<PetscReal>    square;   /* |A_ij|_F^2 of each block */
  std::vector<PetscReal>    diagonal; /* |A_ii|_F */
  std::vector<bool>         alone;    /* not coupled to any other node on any rank */
  std::vector<PetscInt>     si, sj;   /* strong neighbors on this rank */

  Graph(const AinsworthBlockRows &rows, const std::vector<char> &embedded)
    : A(rows), n(A.n), square(A.j.size(), 0.0), diagonal(n, 0.0), alone(n, true)
  {
    auto out = [&](PetscInt i) { return i < n && !embedded.empty() && embedded[i]; };

    for (PetscInt i = 0; i < n; i++)
      for (PetscInt k = A.i[i]; k < A.i[i + 1] && !out(i); k++) {
        PetscReal sum = 0.0;

        if (out(A.j[k])) continue; /* ghosts that are embedded have no aggregate either */
        for (const PetscScalar *a = A.block(k), *end = A.block(k + 1); a != end; a++)
          sum += PetscRealPart(*a * PetscConj(*a));
        square[k] = sum;
        if (A.j[k] == i) diagonal[i] = PetscSqrtReal(sum);
        else if (sum > 0.0) alone[i] = false;
      }
  }
};
} // namespace

/* Selects strong neighbors: those with |A_ij|^2 > theta^2 |A_ii| |A_jj| */
static void SelectStrong(PetscReal theta, Graph *G)
{
  const AinsworthBlockRows &A = G->A;

  G->si.assign(1, 0);
  G->sj.clear();
  for (PetscInt i = 0; i < G->n; i++) {
    for (PetscInt k = A.i[i]; k < A.i[i + 1]; k++) {
      const PetscInt j = A.j[k];
      if (j != i && j < G->n && G->square[k] > theta * theta * G->diagonal[i] * G->diagonal[j]) G->sj.push_back(j);
    }
    G->si.push_back((PetscInt)G->sj.size());
  }
}

/* Makes each node whose strong neighbors are all free the root of an aggregate of these nodes */
static void FindRoots(const Graph &G, AinsworthAggregates *agg)
{
  std::vector<PetscInt> &of = agg->of;

  for (PetscInt i = 0; i < G.n; i++) {
    const auto first = G.sj.begin() + G.si[i], last = G.sj.begin() + G.si[i + 1];

    if (of[i] >= 0 || G.alone[i] || first == last || std::any_of(first, last, [&](PetscInt j) { return of[j] >= 0; }))
      continue;
    of[i] = agg->count;
    std::for_each(first, last, [&](PetscInt j) { of[j] = agg->count; });
    agg->count++;
  }
}

/*
   Adds free nodes to the aggregate of most of their strong neighbors; nodes without strong neighbors become aggregates
   of their own
*/
static void Join(const Graph &G, AinsworthAggregates *agg)
{
  const std::vector<PetscInt> before(agg->of);

  for (PetscInt i = 0; i < G.n; i++) {
    const auto first = G.sj.begin() + G.si[i], last = G.sj.begin() + G.si[i + 1];
    PetscInt   most = 0;

    if (before[i] >= 0 || G.alone[i]) continue;
    if (first == last) agg->of[i] = agg->count++;
    for (auto k = first; k != last; ++k) { /* at least one of them is in an aggregate, or the node would be a root */
      const PetscInt g = before[*k];
      if (g < 0) continue;
      const PetscInt touches = (PetscInt)std::count_if(first, last, [&](PetscInt j) { return before[j] == g; });
      if (touches <= most) continue;
      most       = touches;
      agg->of[i] = g;
    }
  }
}

/*
   Merges each single-node aggregate into that of its most strongly coupled neighbor

   If that neighbor is on another rank the node may belong to a stiff body that the partition cuts, and stays. Larger
   aggregates always stay.
*/
static void MergeSingle(const Graph &G, AinsworthAggregates *agg)
{
  const AinsworthBlockRows &A = G.A;
  std::vector<PetscInt>     members(agg->count, 0), number(agg->count, -1);

  for (PetscInt g : agg->of)
    if (g >= 0) members[g]++;
  for (PetscInt i = 0; i < G.n; i++) {
    PetscReal best = 0.0;
    PetscInt  to   = -1;

    if (agg->of[i] < 0 || members[agg->of[i]] > 1) continue;
    for (PetscInt k = A.i[i]; k < A.i[i + 1]; k++) {
      const PetscInt j = A.j[k];
      if (j == i || G.square[k] <= best || (j < G.n && agg->of[j] < 0)) continue;
      best = G.square[k];
      to   = j < G.n ? agg->of[j] : -1;
    }
    if (to < 0) continue;
    members[agg->of[i]]--;
    members[to]++;
    agg->of[i] = to;
  }
  agg->count = 0;
  for (PetscInt &g : agg->of) {
    if (g < 0) continue;
    if (number[g] < 0) number[g] = agg->count++;
    g = number[g];
  }
}

/*
   AinsworthAggregate - groups the local nodes by the strength of their couplings. Not collective

   With k unknowns per aggregate, the next level should have at most half of the unknowns of this one: theta is halved
   until it does, and finally set to 0. A carried node becomes an aggregate of its own. Requiring a much smaller level
   would merge stiff bodies that one or two cells of soft material separate (docs/multigrid.md).
*/
PetscErrorCode AinsworthAggregate(const AinsworthBlockMat &A, PetscReal theta, const AinsworthModes &modes,
                                  AinsworthAggregates *agg)
{
  Graph          G(A.rows, modes.embedded);
  const PetscInt coupled = (PetscInt)std::count(G.alone.begin(), G.alone.end(), false);

  PetscFunctionBegin;
  for (;; theta = theta > 1e-3 ? theta / 2 : 0.0) {
    SelectStrong(theta, &G);
    agg->count = 0;
    agg->of.assign(G.n, -1);
    FindRoots(G, agg);
    Join(G, agg);
    if (2 * modes.k * agg->count <= A.rows.br * coupled || theta == 0.0) break;
  }
  MergeSingle(G, agg);
  for (PetscInt i = 0; i < G.n; i++)
    if (modes.carried[i]) agg->of[i] = agg->count++;
  PetscFunctionReturn(PETSC_SUCCESS);
}
