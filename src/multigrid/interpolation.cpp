#include "coarsen.h"
#include <algorithm>

/* A column is dependent if orthogonalization leaves at most this part of its length */
static const PetscReal dependent = 1e-6;

/*
   AinsworthOrthonormalize - orthonormalizes the k columns of q, of length m each, by modified Gram-Schmidt in two
   passes; r: k x k, by rows, adds to what is there. Dependent columns become zero
*/
void AinsworthOrthonormalize(PetscInt m, PetscInt k, PetscScalar *q, PetscScalar *r)
{
  for (PetscInt c = 0; c < k; c++) {
    PetscScalar *v      = q + c * m;
    PetscReal    before = 0.0, after = 0.0;

    for (PetscInt l = 0; l < m; l++) before += PetscRealPart(v[l] * PetscConj(v[l]));
    for (int pass = 0; pass < 2; pass++)
      for (PetscInt d = 0; d < c; d++) {
        const PetscScalar *u = q + d * m;
        PetscScalar        h = 0.0;

        for (PetscInt l = 0; l < m; l++) h += PetscConj(u[l]) * v[l];
        for (PetscInt l = 0; l < m; l++) v[l] -= h * u[l];
        r[d * k + c] += h;
      }
    for (PetscInt l = 0; l < m; l++) after += PetscRealPart(v[l] * PetscConj(v[l]));
    const bool      keep  = after > dependent * dependent * before;
    const PetscReal norm  = keep ? PetscSqrtReal(after) : 0.0;
    const PetscReal scale = keep ? 1.0 / norm : 0.0;
    for (PetscInt l = 0; l < m; l++) v[l] *= scale;
    r[c * k + c] = norm;
  }
}

/*
   AinsworthTentativeCreate - creates the values of tentative interpolation, the orthonormalized modes of each aggregate
   of this rank, one bs x k block for each node, and the modes of the coarse nodes, one k x k block for each aggregate
*/
void AinsworthTentativeCreate(const AinsworthAggregates &agg, PetscInt bs, const AinsworthModes &modes,
                              AinsworthTentative *T, std::vector<PetscScalar> *coarse)
{
  const PetscInt                     k = modes.k;
  std::vector<std::vector<PetscInt>> members(agg.count);
  std::vector<PetscScalar>           q;

  for (size_t i = 0; i < agg.of.size(); i++)
    if (agg.of[i] >= 0) members[agg.of[i]].push_back((PetscInt)i);
  T->bs = bs;
  T->k  = k;
  T->values.assign(agg.of.size() * bs * k, 0.0);
  coarse->assign((size_t)agg.count * k * k, 0.0);
  for (PetscInt g = 0; g < agg.count; g++) {
    const PetscInt m  = (PetscInt)members[g].size() * bs;
    auto           at = [&](PetscInt l, PetscInt c) { return ((size_t)members[g][l / bs] * bs + l % bs) * k + c; };

    q.resize((size_t)m * k);
    for (PetscInt l = 0; l < m; l++)
      for (PetscInt c = 0; c < k; c++) q[c * m + l] = modes.values[at(l, c)];
    AinsworthOrthonormalize(m, k, q.data(), &(*coarse)[(size_t)g * k * k]);
    for (PetscInt l = 0; l < m; l++)
      for (PetscInt c = 0; c < k; c++) T->values[at(l, c)] = q[c * m + l];
  }
}

/*
   Computes P_i = T_i - omega D_i^{-1} sum_j A_ij T_j, where P has its pattern and room for values already; at: work
   space for the columns of P, row: for the blocks of a row. Nothing is allocated here, as no exception gets through a
   clone of GCC 12
*/
template <int B, int K, class V>
AINSWORTH_CLONES static void SmoothRows(const AinsworthBlockMat &A, const std::vector<PetscInt> &aggregate,
                                        const PetscScalar *T, const std::vector<PetscReal> &diagonal, PetscReal omega,
                                        const AinsworthBlockRows &P, std::vector<PetscInt> &at,
                                        std::vector<PetscScalar> &row, V *values)
{
  const PetscInt bs = B ? B : P.br, k = K ? K : P.bc, size = bs * k;

  for (PetscInt i = 0; i < P.n; i++) {
    const PetscScalar *a = A.row(i);

    if (aggregate[i] < 0) continue;
    const size_t n = (size_t)(P.i[i + 1] - P.i[i]) * size;
    std::fill_n(row.begin(), n, 0.0);
    for (PetscInt p = P.i[i]; p < P.i[i + 1]; p++) at[P.j[p]] = p - P.i[i];
    for (PetscInt e = A.rows.i[i]; e < A.rows.i[i + 1]; e++, a += bs * bs) {
      const PetscInt j = A.rows.j[e];

      if (aggregate[j] >= 0)
        AinsworthMultAdd<B, B, K>(bs, bs, k, a, &T[(size_t)j * size], &row[at[aggregate[j]] * size]);
    }
    for (size_t l = 0; l < n; l++) row[l] *= -omega / diagonal[i * bs + l / k % bs];
    for (PetscInt l = 0; l < size; l++) row[at[aggregate[i]] * size + l] += T[(size_t)i * size + l];
    for (size_t l = 0; l < n; l++) *values++ = (V)row[l];
  }
}

/*
   Finds the pattern of P: the aggregates of the neighbors of each node; aggregate: as places, for the columns of A; at:
   -1 for each column of P
*/
static void FindPattern(const AinsworthBlockRows &A, const std::vector<PetscInt> &aggregate, std::vector<PetscInt> &at,
                        AinsworthBlockRows *P)
{
  for (PetscInt i = 0; i < A.n; i++, P->endRow()) {
    const size_t start = P->j.size();
    auto         take  = [&](PetscInt g) {
      if (g < 0 || at[g] == i) return;
      at[g] = i;
      P->j.push_back(g);
    };

    if (aggregate[i] < 0) continue;
    take(aggregate[i]);
    for (PetscInt e = A.i[i]; e < A.i[i + 1]; e++) take(aggregate[A.j[e]]);
    std::sort(P->j.begin() + start, P->j.end());
  }
}

/*
   AinsworthTentativePlace - gives the coarse nodes their owners. Collective

   Input Parameters:
+  agg    - the aggregates of this rank, numbered after those of the ranks before it
.  layout - the distribution of the coarse nodes, which may be owned by other ranks than those that made them
.  coarse - the modes of the aggregates
-  T      - its values, and the aggregates of followers

   Output Parameters:
+  modes - the near null space on the coarse nodes that this rank owns
-  T     - the tentative interpolation
*/
PetscErrorCode AinsworthTentativePlace(const AinsworthAggregates &agg, const AinsworthLayout &layout,
                                       std::vector<PetscScalar> &&coarse, AinsworthModes *modes, AinsworthTentative *T)
{
  const PetscInt    k = modes->k;
  std::vector<char> carried(agg.count, 0);
  AinsworthUnit     square(k * k, MPIU_SCALAR);
  AinsworthColumns  makers;

  PetscFunctionBegin;
  PetscCall(makers.createMade(layout, agg.count));
  T->layout = layout;
  T->aggregate.resize(agg.of.size(), -1);
  for (size_t i = 0; i < agg.of.size(); i++) {
    if (agg.of[i] < 0) continue;
    T->aggregate[i] = makers.ghosts[agg.of[i]];
    if (modes->carried[i]) carried[agg.of[i]] = 1;
  }

  /* send the coarse modes to the owners of their nodes */
  if (makers.sf) {
    modes->values.assign((size_t)makers.local * k * k, 0.0);
    modes->carried.assign(makers.local, 0);
    PetscCall(PetscSFReduceBegin(makers.sf, square.type, coarse.data(), modes->values.data(), MPI_REPLACE));
    PetscCall(PetscSFReduceEnd(makers.sf, square.type, coarse.data(), modes->values.data(), MPI_REPLACE));
    PetscCall(PetscSFReduceBegin(makers.sf, MPI_CHAR, carried.data(), modes->carried.data(), MPI_REPLACE));
    PetscCall(PetscSFReduceEnd(makers.sf, MPI_CHAR, carried.data(), modes->carried.data(), MPI_REPLACE));
  } else {
    modes->values  = std::move(coarse);
    modes->carried = std::move(carried);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthTentativeInterpolate - creates T as an interpolation, with one block in each row. Collective */
PetscErrorCode AinsworthTentativeInterpolate(const AinsworthTentative &T, AinsworthInterpolation *P)
{
  const PetscInt size = T.bs * T.k;

  PetscFunctionBegin;
  P->rows = AinsworthBlockRows(T.bs, T.k);
  for (size_t i = 0; i < T.aggregate.size(); i++, P->rows.endRow()) {
    if (T.aggregate[i] < 0) continue;
    P->rows.j.push_back(T.aggregate[i]);
    P->rows.a.insert(P->rows.a.end(), &T.values[i * size], &T.values[i * size] + size);
  }
  PetscCall(P->cols.createAt(T.layout, &P->rows.j));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTentativeSmooth - creates smoothed interpolation, T - omega diagonal^{-1} A T. Collective

   Input Parameters:
+  A        - the matrix of this level
.  T        - tentative interpolation; nodes without an aggregate get no coarse functions
.  diagonal - the diagonal of A, positive
.  omega    - of the damped Jacobi step, 4/3 over the largest eigenvalue of diagonal^{-1} A (Vanek, Mandel, Brezina,
              Computing 56, 1996)
-  single   - store the values in single precision

   Output Parameter:
.  P - the interpolation
*/
PetscErrorCode AinsworthTentativeSmooth(const AinsworthBlockMat &A, const AinsworthTentative &T,
                                        const std::vector<PetscReal> &diagonal, PetscReal omega, bool single,
                                        AinsworthInterpolation *P)
{
  const PetscInt           bs = T.bs, k = T.k, size = bs * k;
  std::vector<PetscInt>    aggregate(T.aggregate), at;
  std::vector<PetscScalar> values, row;
  PetscInt                 longest = 0;
  const PetscScalar       *all     = T.values.data();
  AinsworthUnit            unit(size, MPIU_SCALAR);

  PetscFunctionBegin;
  aggregate.resize(A.cols.count(), -1);
  PetscCall(A.cols.toGhosts(MPIU_INT, T.aggregate.data(), aggregate.data() + A.rows.n));
  if (A.cols.sf) {
    values = T.values;
    values.resize((size_t)A.cols.count() * size);
    PetscCall(A.cols.toGhosts(unit.type, T.values.data(), values.data() + T.values.size()));
    all = values.data();
  }
  P->rows = AinsworthBlockRows(bs, k);
  PetscCall(P->cols.createAt(T.layout, &aggregate));
  at.assign(P->cols.count(), -1);
  FindPattern(A.rows, aggregate, at, &P->rows);
  for (PetscInt i = 0; i < P->rows.n; i++) longest = PetscMax(longest, P->rows.i[i + 1] - P->rows.i[i]);
  row.resize((size_t)longest * size);
  if (single) P->single.resize(P->rows.j.size() * size);
  else P->rows.a.resize(P->rows.j.size() * size);
  AinsworthDispatch(bs, k, [&](auto B, auto K) {
    if (single) SmoothRows<B(), K()>(A, aggregate, all, diagonal, omega, P->rows, at, row, P->single.data());
    else SmoothRows<B(), K()>(A, aggregate, all, diagonal, omega, P->rows, at, row, P->rows.a.data());
  });
  PetscFunctionReturn(PETSC_SUCCESS);
}
