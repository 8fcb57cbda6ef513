#include "coarsen.h"
#include <algorithm>

namespace
{
/* The graph of the nodes of this rank, and how strongly A couples them */
class Graph {
public:
  explicit Graph(const AinsworthBlockMat &);
  void     select(PetscReal theta);
  void     aggregate(AinsworthAggregates *agg) const;
  void     mergeSingle(AinsworthAggregates *agg) const;
  PetscInt coupled() const { return n - (PetscInt)std::count(alone.begin(), alone.end(), true); }

private:
  void findRoots(AinsworthAggregates *) const;
  bool join(AinsworthAggregates *) const;
  void rest(AinsworthAggregates *) const;

  const AinsworthBlockRows &A;
  const PetscInt            n;
  std::vector<PetscReal>    square;   /* |A_ij|_F^2 of each block */
  std::vector<PetscReal>    diagonal; /* |A_ii|_F */
  std::vector<bool>         alone;    /* not coupled to any other node, on this rank or another */
  std::vector<PetscInt>     si, sj;   /* strong neighbors on this rank */
};

Graph::Graph(const AinsworthBlockMat &mat) : A(mat.rows), n(mat.rows.n), square(mat.rows.j.size()), diagonal(n, 0.0), alone(n, true)
{
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt k = A.i[i]; k < A.i[i + 1]; k++) {
      const PetscScalar *a = A.block(k);
      PetscReal          s = 0.0;

      for (PetscInt q = 0; q < A.size(); q++) s += PetscRealPart(a[q] * PetscConj(a[q]));
      square[k] = s;
      if (A.j[k] == i) diagonal[i] = PetscSqrtReal(s);
      else if (s > 0.0) alone[i] = false;
    }
}

/* Neighbors with |A_ij|^2 > theta^2 |A_ii| |A_jj| are strong */
void Graph::select(PetscReal theta)
{
  si.assign(1, 0);
  sj.clear();
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt k = A.i[i]; k < A.i[i + 1]; k++) {
      const PetscInt j = A.j[k];
      if (j != i && j < n && square[k] > theta * theta * diagonal[i] * diagonal[j]) sj.push_back(j);
    }
    si.push_back((PetscInt)sj.size());
  }
}

/* A node whose strong neighbors are all free is the root of an aggregate of them */
void Graph::findRoots(AinsworthAggregates *agg) const
{
  std::vector<PetscInt> &of = agg->of;

  for (PetscInt i = 0; i < n; i++) {
    if (of[i] >= 0 || alone[i] || si[i] == si[i + 1]) continue;
    if (std::any_of(sj.begin() + si[i], sj.begin() + si[i + 1], [&](PetscInt j) { return of[j] >= 0; })) continue;
    of[i] = agg->count;
    for (PetscInt k = si[i]; k < si[i + 1]; k++) of[sj[k]] = agg->count;
    agg->count++;
  }
}

/* Free nodes join the aggregate that most of their strong neighbors are in; false where none could */
bool Graph::join(AinsworthAggregates *agg) const
{
  const std::vector<PetscInt> before(agg->of);
  bool                        any = false;

  for (PetscInt i = 0; i < n; i++) {
    PetscInt most = 0;

    if (before[i] >= 0 || alone[i]) continue;
    for (PetscInt k = si[i]; k < si[i + 1]; k++) {
      const PetscInt g = before[sj[k]];
      if (g < 0) continue;
      const PetscInt touches = (PetscInt)std::count_if(sj.begin() + si[i], sj.begin() + si[i + 1], [&](PetscInt j) { return before[j] == g; });
      if (touches > most) {
        most       = touches;
        agg->of[i] = g;
        any        = true;
      }
    }
  }
  return any;
}

/* What is still free becomes aggregates of free neighbors */
void Graph::rest(AinsworthAggregates *agg) const
{
  for (PetscInt i = 0; i < n; i++) {
    if (agg->of[i] >= 0 || alone[i]) continue;
    agg->of[i] = agg->count;
    for (PetscInt k = si[i]; k < si[i + 1]; k++)
      if (agg->of[sj[k]] < 0) agg->of[sj[k]] = agg->count;
    agg->count++;
  }
}

void Graph::aggregate(AinsworthAggregates *agg) const
{
  agg->count = 0;
  agg->of.assign(n, -1);
  findRoots(agg);
  for (int pass = 0; pass < 4 && join(agg); pass++) { }
  rest(agg);
}

/* A node on its own joins the aggregate of the neighbor that it is coupled to most: larger ones may be what a stiff body has on this rank, and stay */
void Graph::mergeSingle(AinsworthAggregates *agg) const
{
  std::vector<PetscInt> members(agg->count, 0), number(agg->count, -1);

  for (PetscInt g : agg->of)
    if (g >= 0) members[g]++;
  for (PetscInt i = 0; i < n; i++) {
    PetscReal best = 0.0;
    PetscInt  to   = -1;

    if (agg->of[i] < 0 || members[agg->of[i]] > 1) continue;
    for (PetscInt k = A.i[i]; k < A.i[i + 1]; k++) {
      const PetscInt j = A.j[k];
      if (j == i || square[k] <= best || (j < n && agg->of[j] < 0)) continue;
      best = square[k];
      to   = j < n ? agg->of[j] : -1;
    }
    if (to < 0) continue; /* or what it is coupled to most is on another rank: it may be a piece of a stiff body that the partition has cut */
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
} // namespace

/*
   AinsworthAggregate - groups the nodes of this rank by how strongly A couples them; not collective

   With k unknowns for each aggregate the next level shall have at most half of the unknowns of this one: theta is halved while it has more, and given up at
   last. To go on until it is much smaller glues stiff bodies that a cell or two of soft material keep apart (docs/multigrid.md).
*/
PetscErrorCode AinsworthAggregate(const AinsworthBlockMat &A, PetscReal theta, PetscInt k, AinsworthAggregates *agg)
{
  Graph graph(A);

  PetscFunctionBegin;
  for (;; theta = theta > 1e-3 ? theta / 2 : 0.0) {
    graph.select(theta);
    graph.aggregate(agg);
    if (2 * k * agg->count <= A.rows.br * graph.coupled() || theta == 0.0) break;
  }
  graph.mergeSingle(agg);
  PetscFunctionReturn(PETSC_SUCCESS);
}
