#include "coarsen.h"
#include "../base/events.h"
#include <algorithm>

namespace
{
/* The rows of P for all columns of X, owned and ghost; columns are places in cols, whose ghosts are those of both */
struct Extended {
  AinsworthColumns              cols;
  std::vector<PetscInt>         i, j;
  const AinsworthInterpolation *own = NULL;
  AinsworthBlockRows            ghost;
  std::vector<AinsworthSingle>  ghostSingle; /* the values of the ghosts if P is in single precision */
  std::vector<PetscInt>         fromOwn;     /* place in cols of each place in P.cols */
  std::vector<PetscMPIInt>      owner;       /* rank that owns each place */

  bool single() const { return !own->single.empty(); }
  template <class V>
  const V *block(PetscInt k) const
  {
    const PetscInt n = (PetscInt)own->rows.j.size(), size = own->rows.size();

    if constexpr (std::is_same<V, PetscScalar>::value) return k < n ? own->rows.block(k) : ghost.block(k - n);
    else return k < n ? own->single.data() + (size_t)k * size : ghostSingle.data() + (size_t)(k - n) * size;
  }
  /* For two nodes with the same owner the upper block is enough */
  bool wanted(PetscInt c, PetscInt e) const { return e >= c || owner[c] != owner[e]; }

  PetscErrorCode create(const AinsworthBlockMat &X, const AinsworthInterpolation &P)
  {
    AinsworthBlockRows    sent(P.rows.br, P.rows.bc);
    std::vector<PetscInt> nodes(P.cols.ghosts);

    PetscFunctionBegin;
    own = &P;
    if (X.cols.sf) { /* send only the rows that other ranks need */
      std::vector<char>        shared;
      std::vector<PetscScalar> room(P.rows.size());

      PetscCall(X.cols.findShared(&shared));
      for (PetscInt r = 0; r < P.rows.n; r++, sent.endRow())
        for (PetscInt k = P.rows.i[r]; shared[r] && k < P.rows.i[r + 1]; k++) {
          const PetscScalar *a = P.block(k, room.data());
          sent.j.push_back(P.cols.node(P.rows.j[k]));
          sent.a.insert(sent.a.end(), a, a + P.rows.size());
        }
      PetscCall(AinsworthSendRows(X.cols.sf, sent, (PetscInt)X.cols.ghosts.size(), &ghost));
      if (single()) {
        for (PetscScalar v : ghost.a) ghostSingle.push_back((AinsworthSingle)v);
        ghost.a.clear();
      }
    }
    for (PetscInt g : ghost.j)
      if (!P.cols.owns(g)) nodes.push_back(g);
    AinsworthSortUnique(&nodes);
    cols.first  = P.cols.first;
    cols.local  = P.cols.local;
    cols.ghosts = std::move(nodes); /* neither layout nor sf: these columns do not communicate */
    fromOwn.resize(P.cols.count());
    for (PetscInt p = 0; p < P.cols.count(); p++) fromOwn[p] = cols.place(P.cols.node(p));
    owner.resize(cols.count());
    for (PetscInt p = 0; p < cols.count(); p++)
      PetscCall(PetscLayoutFindOwner(P.cols.layout.get(), cols.node(p), &owner[p]));
    i = P.rows.i;
    j.reserve(P.rows.j.size() + ghost.j.size());
    for (PetscInt p : P.rows.j) j.push_back(fromOwn[p]);
    for (PetscInt r = 0; r < ghost.n; r++) i.push_back(P.rows.i[P.rows.n] + ghost.i[r + 1]);
    for (PetscInt g : ghost.j) j.push_back(cols.place(g));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

/* Adds row r of X P to w, whose blocks are those of the columns at `place` */
template <int B, int K, class V>
AINSWORTH_CLONES void AddRow(const AinsworthBlockMat &X, PetscInt r, const Extended &P, PetscInt k,
                             const std::vector<PetscInt> &place, PetscScalar *w)
{
  const PetscInt     bs = B ? B : X.rows.br, bc = K ? K : k;
  const PetscScalar *a = X.row(r);

  for (PetscInt e = X.rows.i[r]; e < X.rows.i[r + 1]; e++, a += bs * bs)
    for (PetscInt q = P.i[X.rows.j[e]]; q < P.i[X.rows.j[e] + 1]; q++)
      AinsworthMultAdd<B, B, K>(bs, bs, k, a, P.block<V>(q), w + (size_t)place[P.j[q]] * bs * bc);
}
template <int B, int K>
void AddRow(const AinsworthBlockMat &X, PetscInt r, const Extended &P, PetscInt k, const std::vector<PetscInt> &place,
            PetscScalar *w)
{
  if (P.single()) AddRow<B, K, AinsworthSingle>(X, r, P, k, place, w);
  else AddRow<B, K, PetscScalar>(X, r, P, k, place, w);
}

/*
   The blocks of L' X R that this rank computes and that are wanted, by rows; L and R have columns in the same places

   X R is computed row by row, and its products with the row of L are added up; it is never stored. The first
   `diagonal` rows have a diagonal block, be it zero
*/
struct Product {
  PetscInt                 size = 0; /* of a block */
  std::vector<PetscInt>    i    = {0}, j;
  std::vector<PetscScalar> values;

  template <class Wanted>
  Product(const AinsworthBlockMat &A, const Extended &L, const Extended &R, PetscInt diagonal, PetscInt places,
          Wanted wanted)
    : size(R.own->rows.bc * R.own->rows.bc)
  {
    const AinsworthBlockRows          &X = A.rows;
    std::vector<PetscInt>              mark(places, -1), yi = {0}, yj; /* pattern of X R in rows that L has */
    std::vector<std::vector<PetscInt>> users(places);                  /* rows of L with an entry in each column */

    for (PetscInt r = 0; r < X.n; r++) {
      for (PetscInt k = L.i[r] < L.i[r + 1] ? X.i[r] : X.i[r + 1]; k < X.i[r + 1]; k++)
        for (PetscInt q = R.i[X.j[k]]; q < R.i[X.j[k] + 1]; q++)
          if (mark[R.j[q]] != r) {
            mark[R.j[q]] = r;
            yj.push_back(R.j[q]);
          }
      std::sort(yj.begin() + yi[r], yj.end());
      yi.push_back((PetscInt)yj.size());
      for (PetscInt k = L.i[r]; k < L.i[r + 1]; k++) users[L.j[k]].push_back(r);
    }
    std::fill(mark.begin(), mark.end(), -1);
    for (PetscInt c = 0; c < places; c++) {
      if (c < diagonal) {
        mark[c] = c;
        j.push_back(c);
      }
      for (PetscInt r : users[c])
        for (PetscInt k = yi[r]; k < yi[r + 1]; k++) {
          const PetscInt e = yj[k];
          if (mark[e] != c && wanted(c, e)) {
            mark[e] = c;
            j.push_back(e);
          }
        }
      std::sort(j.begin() + i[c], j.end());
      i.push_back((PetscInt)j.size());
    }
    values.assign(j.size() * size + 4, 0.0); /* the last load of four may read beyond the last block */
    PetscInt most = 0;
    for (PetscInt r = 0; r < X.n; r++) most = PetscMax(most, yi[r + 1] - yi[r]);
    std::vector<PetscScalar> w((size_t)most * X.br * R.own->rows.bc), left((size_t)X.br * R.own->rows.bc);
    AinsworthDispatch(X.br, R.own->rows.bc,
                      [&](auto B, auto K) { multiply<B(), K()>(A, L, R, yi, yj, mark, wanted, w, left); });
  }

  /* Hands the blocks over as half of a matrix, if no other rank has any of its rows. Collective */
  PetscErrorCode release(const AinsworthLayout &nodes, PetscInt bs, AinsworthHalf *half)
  {
    auto upper = std::make_shared<AinsworthBlockRows>(bs, bs);

    PetscFunctionBegin;
    PetscCall(half->outside.cols.create(nodes, {}));
    upper->n             = nodes->n;
    half->outside.rows   = AinsworthBlockRows(bs, bs);
    half->outside.rows.n = upper->n;
    half->outside.rows.i.assign(upper->n + 1, 0);
    upper->i    = std::move(i);
    upper->j    = std::move(j);
    upper->a    = std::move(values);
    half->upper = upper;
    PetscFunctionReturn(PETSC_SUCCESS);
  }

private:
  /* w, left: work space; nothing is allocated here, as no exception gets through a clone of GCC 12 */
  template <int B, int K, class Wanted>
  AINSWORTH_CLONES void multiply(const AinsworthBlockMat &X, const Extended &L, const Extended &R,
                                 const std::vector<PetscInt> &yi, const std::vector<PetscInt> &yj,
                                 std::vector<PetscInt> &place, Wanted wanted, std::vector<PetscScalar> &w,
                                 std::vector<PetscScalar> &left)
  {
    const PetscInt bs = B ? B : X.rows.br, k = K ? K : R.own->rows.bc;

    for (PetscInt r = 0; r < X.rows.n; r++) {
      const PetscInt  m    = yi[r + 1] - yi[r];
      const PetscInt *cols = yj.data() + yi[r];

      if (!m) continue;
      std::fill_n(w.begin(), (size_t)m * bs * k, 0.0);
      for (PetscInt s = 0; s < m; s++) place[cols[s]] = s;
      AddRow<B, K>(X, r, R, k, place, w.data());
      for (PetscInt q = L.i[r]; q < L.i[r + 1]; q++) {
        PetscInt at = i[L.j[q]];

        if (L.single()) std::copy_n(L.block<AinsworthSingle>(q), left.size(), left.begin());
        else std::copy_n(L.block<PetscScalar>(q), left.size(), left.begin());
        for (PetscInt s = 0; s < m; s++) {
          if (!wanted(L.j[q], cols[s])) continue;
          while (j[at] < cols[s]) at++;
          AinsworthMultAdjointAdd<K, B, K>(k, bs, k, left.data(), &w[(size_t)s * bs * k], &values[(size_t)at * size]);
        }
      }
    }
  }
};
} // namespace

/*
   AinsworthGalerkin - computes P' X P for a Hermitian X. Collective

   X may have empty rows and couple nodes that A does not: the surface part of M_* has its own neighbors. There are two
   exchanges: rows of P for the ghosts of X, and coarse rows to their owners.
*/
PetscErrorCode AinsworthGalerkin(const AinsworthBlockMat &X, const AinsworthInterpolation &P, AinsworthHalf *coarse)
{
  const PetscInt        k = P.rows.bc;
  Extended              extended;
  AinsworthBlockRows    sent(k, k), arrived;
  std::vector<PetscInt> owner;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscCall(extended.create(X, P));
  const AinsworthColumns &cols = extended.cols;
  Product                 S(X, extended, extended, P.cols.local, cols.count(),
                            [&](PetscInt c, PetscInt e) { return extended.wanted(c, e); });

  for (size_t g = 0; g < P.cols.ghosts.size(); g++, sent.endRow()) {
    const PetscInt c = extended.fromOwn[P.cols.local + g];

    for (PetscInt s = S.i[c]; s < S.i[c + 1]; s++) sent.j.push_back(cols.node(S.j[s]));
    sent.a.insert(sent.a.end(), S.values.begin() + (size_t)S.i[c] * S.size,
                  S.values.begin() + (size_t)S.i[c + 1] * S.size);
  }
  PetscCall(AinsworthRowsToOwners(P.cols, sent, &owner, &arrived));
  if (cols.ghosts.empty() && !arrived.n) PetscCall(S.release(P.cols.layout, k, coarse));
  else {
    std::vector<std::vector<AinsworthPiece>> pieces(P.cols.local);

    for (PetscInt c = 0; c < cols.local; c++)
      for (PetscInt s = S.i[c]; s < S.i[c + 1]; s++)
        pieces[c].push_back({cols.node(S.j[s]), &S.values[(size_t)s * S.size], false});
    for (PetscInt r = 0; r < arrived.n; r++)
      for (PetscInt s = arrived.i[r]; s < arrived.i[r + 1]; s++)
        pieces[owner[r]].push_back({arrived.j[s], arrived.block(s), false});
    PetscCall(AinsworthHalfAssemble(P.cols.layout, k, pieces, coarse));
  }
  PetscCall(PetscLogEventEnd(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the rows of D P */
template <int B, int K>
static void MultiplyRows(const AinsworthBlockMat &X, const Extended &P, PetscInt k, AinsworthBlockRows *rows)
{
  const AinsworthBlockRows &D    = X.rows;
  const PetscInt            size = D.br * k;
  std::vector<PetscInt>     cols, place(P.cols.count());

  for (PetscInt r = 0; r < D.n; r++, rows->endRow()) {
    const size_t start = rows->a.size();

    cols.clear();
    for (PetscInt e = D.i[r]; e < D.i[r + 1]; e++)
      cols.insert(cols.end(), P.j.begin() + P.i[D.j[e]], P.j.begin() + P.i[D.j[e] + 1]);
    AinsworthSortUnique(&cols);
    for (size_t s = 0; s < cols.size(); s++) place[cols[s]] = (PetscInt)s;
    rows->j.insert(rows->j.end(), cols.begin(), cols.end());
    rows->a.resize(start + cols.size() * size, 0.0);
    AddRow<B, K>(X, r, P, k, place, rows->a.data() + start);
  }
}

/* AinsworthInterpolationMultiply - computes D P. Collective */
PetscErrorCode AinsworthInterpolationMultiply(const AinsworthBlockMat &D, const AinsworthInterpolation &P,
                                              AinsworthInterpolation *product)
{
  const PetscInt k = P.rows.bc;
  Extended       extended;

  PetscFunctionBegin;
  PetscCall(extended.create(D, P));
  product->rows = AinsworthBlockRows(D.rows.br, k);
  AinsworthDispatch(D.rows.br, k, [&](auto B, auto K) { MultiplyRows<B(), K()>(D, extended, k, &product->rows); });
  for (PetscInt &j : product->rows.j) j = extended.cols.node(j);
  PetscCall(product->cols.createAt(P.cols.layout, &product->rows.j));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes P + Z / 2 in the rows that A has columns for, here or on other ranks, and leaves others empty. Collective
*/
static PetscErrorCode AddHalf(const AinsworthBlockMat &A, const AinsworthInterpolation &P,
                              const AinsworthInterpolation &Z, AinsworthInterpolation *sum)
{
  const size_t             size = P.rows.size();
  size_t                   most = 0;
  std::vector<PetscInt>    ghosts(P.cols.ghosts);
  std::vector<char>        asked;
  std::vector<PetscScalar> room(size), roomZ(size);

  PetscFunctionBegin;
  ghosts.insert(ghosts.end(), Z.cols.ghosts.begin(), Z.cols.ghosts.end());
  PetscCall(sum->cols.create(P.cols.layout, std::move(ghosts)));
  PetscCall(A.cols.findShared(&asked));
  for (PetscInt j : A.rows.j)
    if (j < P.rows.n) asked[j] = 1;
  sum->rows = AinsworthBlockRows(P.rows.br, P.rows.bc);
  for (PetscInt r = 0; r < P.rows.n; r++)
    if (asked[r]) most += P.rows.i[r + 1] - P.rows.i[r] + Z.rows.i[r + 1] - Z.rows.i[r];
  sum->rows.a.reserve(most * size);
  for (PetscInt r = 0; r < P.rows.n; r++, sum->rows.endRow()) {
    PetscInt p = P.rows.i[r], z = Z.rows.i[r];

    while (asked[r] && (p < P.rows.i[r + 1] || z < Z.rows.i[r + 1])) {
      const PetscInt     ofP   = p < P.rows.i[r + 1] ? sum->cols.place(P.cols.node(P.rows.j[p])) : PETSC_MAX_INT;
      const PetscInt     ofZ   = z < Z.rows.i[r + 1] ? sum->cols.place(Z.cols.node(Z.rows.j[z])) : PETSC_MAX_INT;
      const PetscScalar *fromP = ofP <= ofZ ? P.block(p++, room.data()) : NULL;
      const PetscScalar *fromZ = ofZ <= ofP ? Z.block(z++, roomZ.data()) : NULL;

      sum->rows.j.push_back(PetscMin(ofP, ofZ));
      for (size_t v = 0; v < size; v++)
        sum->rows.a.push_back((fromP ? fromP[v] : 0.0) + (fromZ ? 0.5 * fromZ[v] : 0.0));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes Z' A (P + Z / 2), whose rows and columns are at `places`. Collective */
static PetscErrorCode MultiplyHalf(const AinsworthBlockMat &A, const AinsworthInterpolation &P,
                                   const AinsworthInterpolation &Z, AinsworthColumns *places,
                                   std::unique_ptr<const Product> *product)
{
  AinsworthInterpolation half;
  std::vector<PetscInt>  nodes;
  Extended               left, right;

  PetscFunctionBegin;
  PetscCall(AddHalf(A, P, Z, &half));
  PetscCall(left.create(A, Z));
  PetscCall(right.create(A, half));
  nodes = left.cols.ghosts;
  nodes.insert(nodes.end(), right.cols.ghosts.begin(), right.cols.ghosts.end());
  PetscCall(places->create(P.cols.layout, std::move(nodes)));
  for (Extended *E : {&left, &right})
    for (PetscInt &j : E->j) j = places->place(E->cols.node(j));
  product->reset(new Product(A, left, right, 0, places->count(), [](PetscInt, PetscInt) { return true; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGalerkinChange - computes (P + Z)' A (P + Z) - P' A P, where Z has few rows, of which A needs to have no
   others. Collective

   This is the sum of Z' A (P + Z / 2) and its adjoint
*/
PetscErrorCode AinsworthGalerkinChange(const AinsworthBlockMat &A, const AinsworthInterpolation &P,
                                       const AinsworthInterpolation &Z, AinsworthHalf *change)
{
  const PetscInt                           k = P.rows.bc;
  std::unique_ptr<const Product>           product;
  std::vector<PetscInt>                    owner;
  AinsworthColumns                         places;
  AinsworthBlockRows                       sent(k, k), arrived;
  std::vector<std::vector<AinsworthPiece>> all;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscCall(MultiplyHalf(A, P, Z, &places, &product));
  const Product &S = *product;
  /* each coarse row gets its blocks, and the adjoints of those in its column; those of other ranks are sent to them */
  all.resize(places.count());
  auto add = [&](PetscInt c, PetscInt e, const PetscScalar *values, bool adjoint) {
    if (c >= places.local || e >= c) all[c].push_back({places.node(e), values, adjoint}); /* the upper half is enough */
  };
  for (PetscInt c = 0; c < places.count(); c++)
    for (PetscInt s = S.i[c]; s < S.i[c + 1]; s++) {
      add(c, S.j[s], &S.values[(size_t)s * S.size], false);
      add(S.j[s], c, &S.values[(size_t)s * S.size], true);
    }
  for (PetscInt p = places.local; p < places.count(); p++, sent.endRow())
    for (const AinsworthPiece &piece : all[p]) {
      sent.j.push_back(piece.node);
      for (PetscInt v = 0; v < k * k; v++)
        sent.a.push_back(piece.adjoint ? PetscConj(piece.values[v % k * k + v / k]) : piece.values[v]);
    }
  PetscCall(AinsworthRowsToOwners(places, sent, &owner, &arrived));
  all.resize(places.local);
  for (PetscInt r = 0; r < arrived.n; r++)
    for (PetscInt s = arrived.i[r]; s < arrived.i[r + 1]; s++)
      all[owner[r]].push_back({arrived.j[s], arrived.block(s), false});
  PetscCall(AinsworthHalfAssemble(P.cols.layout, k, all, change));
  PetscCall(PetscLogEventEnd(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
