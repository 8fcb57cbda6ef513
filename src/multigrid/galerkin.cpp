#include "coarsen.h"
#include "kernels.h"
#include "../events.h"
#include <algorithm>

namespace
{
/* All rows of P that X has columns for, own and ghost; columns are places in cols, whose ghosts are those of both */
struct Extended {
  AinsworthColumns              cols;
  std::vector<PetscInt>         i, j;
  const AinsworthInterpolation *own;
  AinsworthBlockRows            ghost;
  std::vector<PetscInt>         fromOwn; /* place in cols of each place in P's own columns */
  std::vector<PetscMPIInt>      owner;   /* rank that owns each place */

  PetscErrorCode     create(const AinsworthBlockMat &, const AinsworthInterpolation &);
  const PetscScalar *block(PetscInt k, PetscScalar *room) const
  {
    const PetscInt n = (PetscInt)own->rows.j.size();
    return k < n ? own->block(k, room) : ghost.block(k - n);
  }
  /* of the two blocks of a pair of nodes with the same owner the upper one is enough */
  bool wanted(PetscInt c, PetscInt e) const { return e >= c || owner[c] != owner[e]; }
};

PetscErrorCode Extended::create(const AinsworthBlockMat &X, const AinsworthInterpolation &P)
{
  AinsworthBlockRows       sent;
  std::vector<PetscInt>    nodes(P.cols.ghosts);
  std::vector<PetscScalar> room(P.rows.size());

  PetscFunctionBegin;
  own = &P;
  if (X.cols.sf) { /* only rows that somebody asks for are sent */
    const PetscInt *degree;

    PetscCall(PetscSFComputeDegreeBegin(X.cols.sf, &degree));
    PetscCall(PetscSFComputeDegreeEnd(X.cols.sf, &degree));
    sent.n  = P.rows.n;
    sent.br = P.rows.br;
    sent.bc = P.rows.bc;
    sent.i.assign(1, 0);
    for (PetscInt r = 0; r < P.rows.n; r++) {
      if (degree[r]) {
        for (PetscInt k = P.rows.i[r]; k < P.rows.i[r + 1]; k++) {
          const PetscScalar *a = P.block(k, room.data());
          sent.j.push_back(P.cols.node(P.rows.j[k]));
          sent.a.insert(sent.a.end(), a, a + P.rows.size());
        }
      }
      sent.i.push_back((PetscInt)sent.j.size());
    }
  }
  PetscCall(AinsworthRowsToGhosts(X.cols, sent, &ghost));
  for (PetscInt g : ghost.j)
    if (g < P.cols.first || g >= P.cols.first + P.cols.local) nodes.push_back(g);
  AinsworthSortUnique(nodes);
  cols.first  = P.cols.first;
  cols.local  = P.cols.local;
  cols.ghosts = std::move(nodes); /* no communication through these columns: neither layout nor sf */
  fromOwn.resize(P.cols.count());
  for (PetscInt p = 0; p < P.cols.count(); p++) fromOwn[p] = cols.place(P.cols.node(p));
  owner.resize(cols.count());
  for (PetscInt p = 0; p < cols.count(); p++) PetscCall(PetscLayoutFindOwner(P.cols.layout, cols.node(p), &owner[p]));
  i = P.rows.i;
  j.reserve(P.rows.j.size() + ghost.j.size());
  for (PetscInt p : P.rows.j) j.push_back(fromOwn[p]);
  for (PetscInt r = 0; r < ghost.n; r++) i.push_back(P.rows.i[P.rows.n] + ghost.i[r + 1]);
  for (PetscInt g : ghost.j) j.push_back(cols.place(g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nonzero patterns by rows: of X P, and of the part of P' X P that is computed here */
struct Pattern {
  std::vector<PetscInt> yi, yj, ui, uj;

  Pattern(const AinsworthBlockRows &X, const Extended &P);
};

Pattern::Pattern(const AinsworthBlockRows &X, const Extended &P)
{
  const PetscInt        n = X.n, nc = P.cols.count();
  std::vector<PetscInt> mark(nc, -1), start(nc + 1, 0), row, next;

  yi.assign(1, 0);
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
  for (PetscInt k = 0; k < P.i[n]; k++) start[P.j[k] + 1]++;
  for (PetscInt c = 0; c < nc; c++) start[c + 1] += start[c];
  next.assign(start.begin(), start.end() - 1);
  row.resize(P.i[n]);
  for (PetscInt r = 0; r < n; r++)
    for (PetscInt k = P.i[r]; k < P.i[r + 1]; k++) row[next[P.j[k]]++] = r;
  std::fill(mark.begin(), mark.end(), -1);
  ui.assign(1, 0);
  for (PetscInt c = 0; c < nc; c++) {
    for (PetscInt q = start[c]; q < start[c + 1]; q++)
      for (PetscInt k = yi[row[q]]; k < yi[row[q] + 1]; k++) {
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

/* Row after row of X: w = (X P)_r, then P_rc' w to row c. X P is never stored */
template <int B, int K>
void Multiply(const AinsworthBlockRows &X, const Extended &P, const Pattern &pattern, PetscInt k, std::vector<PetscScalar> *values)
{
  const PetscInt           bs = X.br;
  std::vector<PetscInt>    place(P.cols.count());
  std::vector<PetscScalar> w, room(bs * k);

  values->assign(pattern.uj.size() * k * k, 0.0);
  for (PetscInt r = 0; r < X.n; r++) {
    const PetscInt  m    = pattern.yi[r + 1] - pattern.yi[r];
    const PetscInt *cols = pattern.yj.data() + pattern.yi[r];

    if (!m) continue;
    w.assign((size_t)m * bs * k, 0.0);
    for (PetscInt s = 0; s < m; s++) place[cols[s]] = s;
    for (PetscInt e = X.i[r]; e < X.i[r + 1]; e++)
      for (PetscInt q = P.i[X.j[e]]; q < P.i[X.j[e] + 1]; q++)
        AinsworthMultAdd<B, B, K>(bs, bs, k, X.block(e), P.block(q, room.data()), &w[(size_t)place[P.j[q]] * bs * k]);
    for (PetscInt q = P.i[r]; q < P.i[r + 1]; q++) {
      const PetscInt     c  = P.j[q];
      const PetscScalar *Pq = P.block(q, room.data());
      PetscInt           at = pattern.ui[c];

      for (PetscInt s = 0; s < m; s++) {
        if (!P.wanted(c, cols[s])) continue;
        while (pattern.uj[at] < cols[s]) at++;
        AinsworthMultAdjointAdd<K, B, K>(k, bs, k, Pq, &w[(size_t)s * bs * k], &(*values)[(size_t)at * k * k]);
      }
    }
  }
}

/* A block of a coarse row, by the number of its column */
struct Piece {
  PetscInt           node;
  const PetscScalar *values;
};

/* The coarse rows of this rank from the pieces computed here and elsewhere; the lower half is the adjoint of the upper one */
PetscErrorCode Assemble(const AinsworthInterpolation &P, const std::vector<std::vector<Piece>> &pieces, PetscInt k, AinsworthBlockMat *coarse)
{
  const PetscInt        n = P.cols.local, first = P.cols.first;
  std::vector<PetscInt> ghosts, at;
  AinsworthBlockRows   &rows = coarse->rows;

  PetscFunctionBegin;
  for (const auto &row : pieces)
    for (const Piece &piece : row)
      if (piece.node < first || piece.node >= first + n) ghosts.push_back(piece.node);
  AinsworthSortUnique(ghosts);
  PetscCall(coarse->cols.create(P.cols.layout, std::move(ghosts)));
  rows.n  = n;
  rows.br = rows.bc = k;
  rows.i.assign(n + 1, 0);
  for (PetscInt c = 0; c < n; c++) {
    PetscInt last = -1;

    for (const Piece &piece : pieces[c]) {
      const PetscInt e = piece.node - first;

      if (piece.node == last) continue;
      last = piece.node;
      rows.i[c + 1]++;
      if (e > c && e < n) rows.i[e + 1]++;
    }
  }
  for (PetscInt c = 0; c < n; c++) rows.i[c + 1] += rows.i[c];
  rows.j.resize(rows.i[n]);
  rows.a.assign((size_t)rows.i[n] * k * k, 0.0);
  at.assign(rows.i.begin(), rows.i.end() - 1);
  for (PetscInt c = 0; c < n; c++)
    for (size_t p = 0; p < pieces[c].size();) {
      const PetscInt node = pieces[c][p].node, e = coarse->cols.place(node), s = at[c]++;
      PetscScalar   *z = rows.block(s);

      rows.j[s] = e;
      for (; p < pieces[c].size() && pieces[c][p].node == node; p++)
        for (PetscInt q = 0; q < k * k; q++) z[q] += pieces[c][p].values[q];
      if (e > c && e < n) {
        const PetscInt t = at[e]++;
        PetscScalar   *y = rows.block(t);

        rows.j[t] = c;
        for (PetscInt a = 0; a < k; a++)
          for (PetscInt b = 0; b < k; b++) y[b * k + a] = PetscConj(z[a * k + b]);
      }
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

/*
   AinsworthGalerkin - P' X P for a Hermitian X, on the nodes of the columns of P; collective

   X may have rows without entries, and couple nodes that A does not: the surface part of M_* has its own neighbors. Two exchanges: rows of P of
   the neighbors of X, and coarse rows to their owners.
*/
PetscErrorCode AinsworthGalerkin(const AinsworthBlockMat &X, const AinsworthInterpolation &P, AinsworthBlockMat *coarse)
{
  const PetscInt                  k = P.rows.bc;
  Extended                        extended;
  AinsworthBlockRows              sent, arrived;
  std::vector<PetscInt>           owner;
  std::vector<PetscScalar>        values;
  std::vector<std::vector<Piece>> pieces(P.cols.local);

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscCall(extended.create(X, P));
  const Pattern           pattern(X.rows, extended);
  const AinsworthColumns &cols = extended.cols;
  AinsworthDispatch(X.rows.br, k, [&](auto B, auto K) { Multiply<B(), K()>(X.rows, extended, pattern, k, &values); });

  sent.n  = (PetscInt)P.cols.ghosts.size();
  sent.br = sent.bc = k;
  sent.i.assign(1, 0);
  for (PetscInt g = 0; g < sent.n; g++) {
    const PetscInt c = extended.fromOwn[P.cols.local + g];

    for (PetscInt s = pattern.ui[c]; s < pattern.ui[c + 1]; s++) sent.j.push_back(cols.node(pattern.uj[s]));
    sent.a.insert(sent.a.end(), values.begin() + (size_t)pattern.ui[c] * k * k, values.begin() + (size_t)pattern.ui[c + 1] * k * k);
    sent.i.push_back((PetscInt)sent.j.size());
  }
  PetscCall(AinsworthRowsToOwners(P.cols, sent, &owner, &arrived));
  for (PetscInt c = 0; c < cols.local; c++)
    for (PetscInt s = pattern.ui[c]; s < pattern.ui[c + 1]; s++) pieces[c].push_back({cols.node(pattern.uj[s]), &values[(size_t)s * k * k]});
  for (PetscInt r = 0; r < arrived.n; r++)
    for (PetscInt s = arrived.i[r]; s < arrived.i[r + 1]; s++) pieces[owner[r]].push_back({arrived.j[s], arrived.block(s)});
  for (auto &row : pieces) std::stable_sort(row.begin(), row.end(), [](const Piece &a, const Piece &b) { return a.node < b.node; });
  PetscCall(Assemble(P, pieces, k, coarse));
  PetscCall(PetscLogEventEnd(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
