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
  std::vector<PetscScalar>      wide;    /* the values of P in double precision if it has single; else empty */
  std::vector<PetscInt>         fromOwn; /* place in cols of each place in P.cols */
  std::vector<PetscMPIInt>      owner;   /* rank that owns each place */

  const PetscScalar *block(PetscInt k) const
  {
    const PetscInt n = (PetscInt)own->rows.j.size();
    return k >= n ? ghost.block(k - n) : wide.empty() ? own->rows.block(k) : wide.data() + (size_t)k * own->rows.size();
  }
  /* For two nodes with the same owner the upper block is enough */
  bool wanted(PetscInt c, PetscInt e) const { return e >= c || owner[c] != owner[e]; }

  PetscErrorCode create(const AinsworthBlockMat &X, const AinsworthInterpolation &P)
  {
    AinsworthBlockRows    sent(P.rows.br, P.rows.bc);
    std::vector<PetscInt> nodes(P.cols.ghosts);

    PetscFunctionBegin;
    own = &P;
    wide.assign(P.single.begin(), P.single.end());
    if (X.cols.sf) { /* send only the rows that other ranks need */
      const PetscInt *degree;

      PetscCall(PetscSFComputeDegreeBegin(X.cols.sf.get(), &degree));
      PetscCall(PetscSFComputeDegreeEnd(X.cols.sf.get(), &degree));
      for (PetscInt r = 0; r < P.rows.n; r++, sent.endRow())
        for (PetscInt k = P.rows.i[r]; degree[r] && k < P.rows.i[r + 1]; k++) {
          const PetscScalar *a = block(k);
          sent.j.push_back(P.cols.node(P.rows.j[k]));
          sent.a.insert(sent.a.end(), a, a + P.rows.size());
        }
      PetscCall(AinsworthSendRows(X.cols.sf.get(), sent, (PetscInt)X.cols.ghosts.size(), &ghost));
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

/* Nonzero patterns by rows: of X P (yi, yj), and of the part of P' X P computed on this rank (ui, uj) */
struct Pattern {
  std::vector<PetscInt> yi = {0}, yj, ui = {0}, uj;

  Pattern(const AinsworthBlockRows &X, const Extended &P)
  {
    const PetscInt                     n = X.n, nc = P.cols.count();
    std::vector<PetscInt>              mark(nc, -1);
    std::vector<std::vector<PetscInt>> users(nc); /* rows of P with an entry in each column */

    for (PetscInt r = 0; r < n; r++) {
      if (P.i[r] < P.i[r + 1]) {
        for (PetscInt k = X.i[r]; k < X.i[r + 1]; k++)
          for (PetscInt q = P.i[X.j[k]]; q < P.i[X.j[k] + 1]; q++)
            if (mark[P.j[q]] != r) {
              mark[P.j[q]] = r;
              yj.push_back(P.j[q]);
            }
        std::sort(yj.begin() + yi[r], yj.end());
      }
      yi.push_back((PetscInt)yj.size());
    }
    for (PetscInt r = 0; r < n; r++)
      for (PetscInt k = P.i[r]; k < P.i[r + 1]; k++) users[P.j[k]].push_back(r);
    std::fill(mark.begin(), mark.end(), -1);
    for (PetscInt c = 0; c < nc; c++) {
      for (PetscInt r : users[c])
        for (PetscInt k = yi[r]; k < yi[r + 1]; k++) {
          const PetscInt e = yj[k];
          if (mark[e] != c && P.wanted(c, e)) {
            mark[e] = c;
            uj.push_back(e);
          }
        }
      std::sort(uj.begin() + ui[c], uj.end());
      ui.push_back((PetscInt)uj.size());
    }
  }
};

/* Adds row r of X P to w, whose blocks are those of the columns at `place` */
template <int B, int K>
void AddRow(const AinsworthBlockRows &X, PetscInt r, const Extended &P, PetscInt k, const std::vector<PetscInt> &place,
            PetscScalar *w)
{
  const PetscInt bs = X.br;

  for (PetscInt e = X.i[r]; e < X.i[r + 1]; e++)
    for (PetscInt q = P.i[X.j[e]]; q < P.i[X.j[e] + 1]; q++)
      AinsworthMultAdd<B, B, K>(bs, bs, k, X.block(e), P.block(q), w + (size_t)place[P.j[q]] * bs * k);
}

/* Computes P' X P row by row of X: w = (X P)_r, then P_rc' w is added to row c; X P is never stored */
template <int B, int K>
void Multiply(const AinsworthBlockRows &X, const Extended &P, const Pattern &pattern, PetscInt k,
              std::vector<PetscScalar> *values)
{
  const PetscInt           bs = X.br;
  std::vector<PetscInt>    place(P.cols.count());
  std::vector<PetscScalar> w;

  values->assign(pattern.uj.size() * k * k, 0.0);
  for (PetscInt r = 0; r < X.n; r++) {
    const PetscInt  m    = pattern.yi[r + 1] - pattern.yi[r];
    const PetscInt *cols = pattern.yj.data() + pattern.yi[r];

    if (!m) continue;
    w.assign((size_t)m * bs * k, 0.0);
    for (PetscInt s = 0; s < m; s++) place[cols[s]] = s;
    AddRow<B, K>(X, r, P, k, place, w.data());
    for (PetscInt q = P.i[r]; q < P.i[r + 1]; q++) {
      const PetscInt     c  = P.j[q];
      const PetscScalar *Pq = P.block(q);
      PetscInt           at = pattern.ui[c];

      for (PetscInt s = 0; s < m; s++) {
        if (!P.wanted(c, cols[s])) continue;
        while (pattern.uj[at] < cols[s]) at++;
        AinsworthMultAdjointAdd<K, B, K>(k, bs, k, Pq, &w[(size_t)s * bs * k], &(*values)[(size_t)at * k * k]);
      }
    }
  }
}
} // namespace

/*
   AinsworthGalerkin - computes P' X P for a Hermitian X; collective

   X may have empty rows and couple nodes that A does not: the surface part of M_* has its own neighbors. There are two
   exchanges: rows of P for the ghosts of X, and coarse rows to their owners.
*/
PetscErrorCode AinsworthGalerkin(const AinsworthBlockMat &X, const AinsworthInterpolation &P, AinsworthBlockMat *coarse)
{
  const PetscInt                           k = P.rows.bc;
  Extended                                 extended;
  AinsworthBlockRows                       sent(k, k), arrived;
  std::vector<PetscInt>                    owner;
  std::vector<PetscScalar>                 values;
  std::vector<std::vector<AinsworthPiece>> pieces(P.cols.local);

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscCall(extended.create(X, P));
  const Pattern           pattern(X.rows, extended);
  const AinsworthColumns &cols = extended.cols;
  AinsworthDispatch(X.rows.br, k, [&](auto B, auto K) { Multiply<B(), K()>(X.rows, extended, pattern, k, &values); });

  for (size_t g = 0; g < P.cols.ghosts.size(); g++, sent.endRow()) {
    const PetscInt c = extended.fromOwn[P.cols.local + g];

    for (PetscInt s = pattern.ui[c]; s < pattern.ui[c + 1]; s++) sent.j.push_back(cols.node(pattern.uj[s]));
    sent.a.insert(sent.a.end(), values.begin() + (size_t)pattern.ui[c] * k * k,
                  values.begin() + (size_t)pattern.ui[c + 1] * k * k);
  }
  PetscCall(AinsworthRowsToOwners(P.cols, sent, &owner, &arrived));
  /* the lower half is the adjoint of the upper half */
  auto take = [&](PetscInt row, PetscInt node, const PetscScalar *block) {
    pieces[row].push_back({node, block, false});
    if (cols.owns(node) && node != cols.first + row)
      pieces[node - cols.first].push_back({cols.first + row, block, true});
  };
  for (PetscInt c = 0; c < cols.local; c++)
    for (PetscInt s = pattern.ui[c]; s < pattern.ui[c + 1]; s++)
      take(c, cols.node(pattern.uj[s]), &values[(size_t)s * k * k]);
  for (PetscInt r = 0; r < arrived.n; r++)
    for (PetscInt s = arrived.i[r]; s < arrived.i[r + 1]; s++) take(owner[r], arrived.j[s], arrived.block(s));
  PetscCall(AinsworthBlockMatAssemble(P.cols.layout, k, pieces, coarse));
  PetscCall(PetscLogEventEnd(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the rows of D P, and columns as places in P.cols of `extended` */
template <int B, int K>
static void MultiplyRows(const AinsworthBlockRows &D, const Extended &P, PetscInt k, AinsworthBlockRows *rows)
{
  const PetscInt        size = D.br * k;
  std::vector<PetscInt> cols, place(P.cols.count());

  for (PetscInt r = 0; r < D.n; r++, rows->endRow()) {
    const size_t start = rows->a.size();

    cols.clear();
    for (PetscInt e = D.i[r]; e < D.i[r + 1]; e++)
      cols.insert(cols.end(), P.j.begin() + P.i[D.j[e]], P.j.begin() + P.i[D.j[e] + 1]);
    AinsworthSortUnique(&cols);
    for (size_t s = 0; s < cols.size(); s++) place[cols[s]] = (PetscInt)s;
    rows->j.insert(rows->j.end(), cols.begin(), cols.end());
    rows->a.resize(start + cols.size() * size, 0.0);
    AddRow<B, K>(D, r, P, k, place, rows->a.data() + start);
  }
}

/* AinsworthInterpolationMultiply - computes D P; collective */
PetscErrorCode AinsworthInterpolationMultiply(const AinsworthBlockMat &D, const AinsworthInterpolation &P,
                                              AinsworthInterpolation *product)
{
  const PetscInt        k = P.rows.bc;
  Extended              extended;
  std::vector<PetscInt> ghosts;

  PetscFunctionBegin;
  PetscCall(extended.create(D, P));
  product->rows = AinsworthBlockRows(D.rows.br, k);
  AinsworthDispatch(D.rows.br, k, [&](auto B, auto K) { MultiplyRows<B(), K()>(D.rows, extended, k, &product->rows); });
  for (PetscInt j : product->rows.j)
    if (j >= extended.cols.local) ghosts.push_back(extended.cols.node(j));
  AinsworthSortUnique(&ghosts);
  PetscCall(product->cols.create(P.cols.layout, std::move(ghosts)));
  for (PetscInt &j : product->rows.j) j = product->cols.place(extended.cols.node(j));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* The products of marked rows of A with an interpolation: columns by rows, and the values of one row */
struct RowProducts {
  std::vector<PetscInt>    i = {0}, j;
  std::vector<PetscScalar> w;

  RowProducts(const AinsworthBlockRows &A, const Extended &marked, const Extended &P, PetscInt places)
  {
    std::vector<PetscInt> mark(places, -1);

    for (PetscInt r = 0; r < A.n; r++) {
      for (PetscInt e = marked.i[r] < marked.i[r + 1] ? A.i[r] : A.i[r + 1]; e < A.i[r + 1]; e++)
        for (PetscInt q = P.i[A.j[e]]; q < P.i[A.j[e] + 1]; q++) {
          if (mark[P.j[q]] == r) continue;
          mark[P.j[q]] = r;
          j.push_back(P.j[q]);
        }
      std::sort(j.begin() + i[r], j.end());
      i.push_back((PetscInt)j.size());
    }
  }
  template <int B, int K>
  void multiply(const AinsworthBlockRows &A, PetscInt r, const Extended &P, PetscInt k, std::vector<PetscInt> *place)
  {
    for (PetscInt s = i[r]; s < i[r + 1]; s++) (*place)[j[s]] = s - i[r];
    w.assign((size_t)(i[r + 1] - i[r]) * A.br * k, 0.0);
    AddRow<B, K>(A, r, P, k, *place, w.data());
  }
};

/*
   The blocks of S, where S + S' = Z' A Z - Z' A P - P' A Z, that this rank computes, by coarse nodes in places

   Of the symmetric part S has the blocks above the diagonal, in the order of the nodes, and half of those on it
*/
struct Change {
  std::vector<PetscInt>    i = {0}, j;
  std::vector<PetscScalar> values;

  template <int B, int K>
  void multiply(const AinsworthBlockRows &A, const Extended &Z, const Extended &P, const std::vector<PetscInt> &node,
                PetscInt k)
  {
    const PetscInt           bs = A.br, size = bs * k, places = (PetscInt)node.size();
    RowProducts              AP(A, Z, P, places), AZ(A, Z, Z, places);
    std::vector<PetscInt>    place(places);
    std::vector<PetscScalar> minus(size), half(size);

    findPattern(A.n, Z, AP, AZ, node);
    values.assign(j.size() * k * k, 0.0);
    for (PetscInt r = 0; r < A.n; r++) {
      if (Z.i[r] == Z.i[r + 1]) continue;
      AP.multiply<B, K>(A, r, P, k, &place);
      AZ.multiply<B, K>(A, r, Z, k, &place);
      for (PetscInt q = Z.i[r]; q < Z.i[r + 1]; q++) {
        const PetscInt     c    = Z.j[q];
        const PetscScalar *left = Z.block(q);
        auto               take = [&](const RowProducts &X, const PetscScalar *factor, PetscInt s, PetscInt *at) {
          while (j[*at] != X.j[s]) (*at)++;
          AinsworthMultAdjointAdd<K, B, K>(k, bs, k, factor, &X.w[(size_t)(s - X.i[r]) * size],
                                           &values[(size_t)*at * k * k]);
        };
        PetscInt at[2] = {i[c], i[c]};

        for (PetscInt v = 0; v < size; v++) {
          minus[v] = -left[v];
          half[v]  = 0.5 * left[v];
        }
        for (PetscInt s = AP.i[r]; s < AP.i[r + 1]; s++) take(AP, minus.data(), s, &at[0]);
        for (PetscInt s = AZ.i[r]; s < AZ.i[r + 1]; s++)
          if (node[AZ.j[s]] >= node[c]) take(AZ, AZ.j[s] == c ? half.data() : left, s, &at[1]);
      }
    }
  }

private:
  void findPattern(PetscInt n, const Extended &Z, const RowProducts &AP, const RowProducts &AZ,
                   const std::vector<PetscInt> &node)
  {
    std::vector<std::vector<PetscInt>> users(node.size()); /* rows of Z with an entry in each column */
    std::vector<PetscInt>              mark(node.size(), -1);

    for (PetscInt r = 0; r < n; r++)
      for (PetscInt q = Z.i[r]; q < Z.i[r + 1]; q++) users[Z.j[q]].push_back(r);
    for (PetscInt c = 0; c < (PetscInt)node.size(); c++) {
      for (PetscInt r : users[c])
        for (const RowProducts *X : {&AP, &AZ})
          for (PetscInt s = X->i[r]; s < X->i[r + 1]; s++) {
            if (mark[X->j[s]] == c || (X == &AZ && node[X->j[s]] < node[c])) continue;
            mark[X->j[s]] = c;
            j.push_back(X->j[s]);
          }
      std::sort(j.begin() + i[c], j.end());
      i.push_back((PetscInt)j.size());
    }
  }
};
} // namespace

/*
   AinsworthGalerkinChange - computes Q' A Q - P' A P for Q = P - Z, where Z has few rows, of which A needs to have no
   others; collective

   This is Z' A Z - Z' A P - P' A Z.
*/
PetscErrorCode AinsworthGalerkinChange(const AinsworthBlockMat &A, const AinsworthInterpolation &P,
                                       const AinsworthInterpolation &Z, AinsworthBlockMat *change)
{
  const PetscInt                           k = P.rows.bc;
  std::vector<PetscInt>                    nodes(P.cols.ghosts), owner;
  AinsworthColumns                         places;
  Extended                                 left, right;
  Change                                   S;
  AinsworthBlockRows                       sent(k, k), arrived;
  std::vector<std::vector<AinsworthPiece>> all, pieces;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscCall(left.create(A, Z));
  PetscCall(right.create(A, P));
  nodes = left.cols.ghosts;
  nodes.insert(nodes.end(), right.cols.ghosts.begin(), right.cols.ghosts.end());
  AinsworthSortUnique(&nodes);
  PetscCall(places.create(P.cols.layout, std::move(nodes)));
  for (Extended *E : {&left, &right})
    for (PetscInt &j : E->j) j = places.place(E->cols.node(j));
  std::vector<PetscInt> node;
  for (PetscInt p = 0; p < places.count(); p++) node.push_back(places.node(p));
  AinsworthDispatch(A.rows.br, k, [&](auto B, auto K) { S.multiply<B(), K()>(A.rows, left, right, node, k); });

  /*
     each coarse row gets its blocks of S, and the adjoints of those in its column; those of other ranks are sent to
     them
  */
  all.resize(places.count());
  for (PetscInt c = 0; c < places.count(); c++)
    for (PetscInt s = S.i[c]; s < S.i[c + 1]; s++) {
      all[c].push_back({node[S.j[s]], &S.values[(size_t)s * k * k], false});
      all[S.j[s]].push_back({node[c], &S.values[(size_t)s * k * k], true});
    }
  for (PetscInt p = places.local; p < places.count(); p++, sent.endRow())
    for (const AinsworthPiece &piece : all[p]) {
      sent.j.push_back(piece.node);
      for (PetscInt v = 0; v < k * k; v++)
        sent.a.push_back(piece.adjoint ? PetscConj(piece.values[v % k * k + v / k]) : piece.values[v]);
    }
  PetscCall(AinsworthRowsToOwners(places, sent, &owner, &arrived));
  pieces.assign(all.begin(), all.begin() + places.local);
  for (PetscInt r = 0; r < arrived.n; r++)
    for (PetscInt s = arrived.i[r]; s < arrived.i[r + 1]; s++)
      pieces[owner[r]].push_back({arrived.j[s], arrived.block(s), false});
  PetscCall(AinsworthBlockMatAssemble(P.cols.layout, k, pieces, change));
  PetscCall(PetscLogEventEnd(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
