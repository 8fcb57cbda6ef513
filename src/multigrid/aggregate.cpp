#include "coarsen.h"
#include <algorithm>

namespace
{
/* The graph of the local nodes with the strengths of their couplings */
struct Graph {
  const AinsworthBlockRows &A;
  const PetscInt            n = 0;
  std::vector<PetscReal>    square;   /* |A_ij|_F^2 of each block; 0 where a node is embedded */
  std::vector<PetscReal>    diagonal; /* |A_ii|_F */
  std::vector<bool>         alone;    /* not coupled to any other node on any rank */

  Graph(const AinsworthBlockRows &rows, std::vector<PetscReal> &&squares, const std::vector<char> &embedded)
    : A(rows), n(A.n), square(std::move(squares)), diagonal(n, 0.0), alone(n, true)
  {
    auto out = [&](PetscInt i) { return i < n && !embedded.empty() && embedded[i]; };

    for (PetscInt i = 0; i < n; i++)
      for (PetscInt k = A.i[i]; k < A.i[i + 1]; k++) {
        if (out(i) || out(A.j[k])) square[k] = 0.0; /* ghosts that are embedded have no aggregate either */
        else if (A.j[k] == i) diagonal[i] = PetscSqrtReal(square[k]);
        else if (square[k] > 0.0) alone[i] = false;
      }
  }
  /* Finds the strong neighbors of a node on this rank: those with |A_ij|^2 > theta^2 |A_ii| |A_jj| */
  void findStrong(PetscReal theta, PetscInt i, std::vector<PetscInt> *strong) const
  {
    strong->clear();
    for (PetscInt k = A.i[i]; k < A.i[i + 1]; k++) {
      const PetscInt j = A.j[k];
      if (j != i && j < n && square[k] > theta * theta * diagonal[i] * diagonal[j]) strong->push_back(j);
    }
  }
};
} // namespace

/* Makes each node whose strong neighbors are all free the root of an aggregate of these nodes */
static void FindRoots(const Graph &G, PetscReal theta, AinsworthAggregates *agg)
{
  std::vector<PetscInt> &of = agg->of, strong;

  for (PetscInt i = 0; i < G.n; i++) {
    if (of[i] >= 0 || G.alone[i]) continue;
    G.findStrong(theta, i, &strong);
    if (strong.empty() || std::any_of(strong.begin(), strong.end(), [&](PetscInt j) { return of[j] >= 0; })) continue;
    of[i] = agg->count;
    for (PetscInt j : strong) of[j] = agg->count;
    agg->count++;
  }
}

/*
   Adds free nodes to the aggregate of most of their strong neighbors; nodes without strong neighbors become aggregates
   of their own
*/
static void Join(const Graph &G, PetscReal theta, AinsworthAggregates *agg)
{
  const std::vector<PetscInt> before(agg->of);
  std::vector<PetscInt>       strong;

  for (PetscInt i = 0; i < G.n; i++) {
    PetscInt most = 0;

    if (before[i] >= 0 || G.alone[i]) continue;
    G.findStrong(theta, i, &strong);
    if (strong.empty()) agg->of[i] = agg->count++;
    for (PetscInt j : strong) { /* at least one of them is in an aggregate, or the node would be a root */
      const PetscInt g = before[j];
      if (g < 0) continue;
      const PetscInt touches = (PetscInt)std::count_if(strong.begin(), strong.end(),
                                                       [&](PetscInt l) { return before[l] == g; });
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
   AinsworthAggregate - groups the local nodes by the strength of their couplings; square: |A_ij|_F^2 of each block.
   Not collective

   With k unknowns per aggregate, the next level should have at most half of the unknowns of this one: theta is halved
   until it does, and finally set to 0. A carried node becomes an aggregate of its own. Requiring a much smaller level
   would merge stiff bodies that one or two cells of soft material separate (docs/multigrid.md).
*/
PetscErrorCode AinsworthAggregate(const AinsworthBlockRows &A, std::vector<PetscReal> &&square, PetscReal theta,
                                  const AinsworthModes &modes, AinsworthAggregates *agg)
{
  Graph          G(A, std::move(square), modes.embedded);
  const PetscInt coupled = (PetscInt)std::count(G.alone.begin(), G.alone.end(), false);

  PetscFunctionBegin;
  for (;; theta = theta > 1e-3 ? theta / 2 : 0.0) {
    agg->count = 0;
    agg->of.assign(G.n, -1);
    FindRoots(G, theta, agg);
    Join(G, theta, agg);
    if (2 * modes.k * agg->count <= A.br * coupled || theta == 0.0) break;
  }
  MergeSingle(G, agg);
  for (PetscInt i = 0; i < G.n; i++)
    if (modes.carried[i]) agg->of[i] = agg->count++;
  PetscFunctionReturn(PETSC_SUCCESS);
}
