#include "coarsen.h"
#include "../events.h"
#include <algorithm>

namespace
{
/* The rows of P for all columns of X, owned and ghost; columns are places in cols, whose ghosts are those of both */
struct Extended {
  AinsworthColumns              cols;
  std::vector<PetscInt>         i, j;
  const AinsworthInterpolation *own;
  AinsworthBlockRows            ghost;
  std::vector<PetscInt>         fromOwn; /* place in cols of each place in P.cols */
  std::vector<PetscMPIInt>      owner;   /* rank that owns each place */

  const PetscScalar *block(PetscInt k, PetscScalar *room) const
  {
    const PetscInt n = (PetscInt)own->rows.j.size();
    return k < n ? own->block(k, room) : ghost.block(k - n);
  }
  /* For two nodes with the same owner the upper block is enough */
  bool wanted(PetscInt c, PetscInt e) const { return e >= c || owner[c] != owner[e]; }

  PetscErrorCode create(const AinsworthBlockMat &X, const AinsworthInterpolation &P)
  {
    AinsworthBlockRows       sent(P.rows.br, P.rows.bc);
    std::vector<PetscInt>    nodes(P.cols.ghosts);
    std::vector<PetscScalar> room(P.rows.size());

    PetscFunctionBegin;
    own = &P;
    if (X.cols.sf) { /* send only the rows that other ranks need */
      const PetscInt *degree;

      PetscCall(PetscSFComputeDegreeBegin(X.cols.sf.get(), &degree));
      PetscCall(PetscSFComputeDegreeEnd(X.cols.sf.get(), &degree));
      for (PetscInt r = 0; r < P.rows.n; r++, sent.endRow())
        for (PetscInt k = P.rows.i[r]; degree[r] && k < P.rows.i[r + 1]; k++) {
          const PetscScalar *a = P.block(k, room.data());
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
    for (PetscInt p = 0; p < cols.count(); p++) PetscCall(PetscLayoutFindOwner(P.cols.layout.get(), cols.node(p), &owner[p]));
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

/* Computes P' X P row by row of X: w = (X P)_r, then P_rc' w is added to row c; X P is never stored */
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
} // namespace

/*
   AinsworthGalerkin - computes P' X P for a Hermitian X; collective

   X may have empty rows and couple nodes that A does not: the surface part of M_* has its own neighbors. There are two exchanges: rows of P for the ghosts of
   X, and coarse rows to their owners.
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
    sent.a.insert(sent.a.end(), values.begin() + (size_t)pattern.ui[c] * k * k, values.begin() + (size_t)pattern.ui[c + 1] * k * k);
  }
  PetscCall(AinsworthRowsToOwners(P.cols, sent, &owner, &arrived));
  /* the lower half is the adjoint of the upper half */
  auto take = [&](PetscInt row, PetscInt node, const PetscScalar *block) {
    pieces[row].push_back({node, block, false});
    if (cols.owns(node) && node != cols.first + row) pieces[node - cols.first].push_back({cols.first + row, block, true});
  };
  for (PetscInt c = 0; c < cols.local; c++)
    for (PetscInt s = pattern.ui[c]; s < pattern.ui[c + 1]; s++) take(c, cols.node(pattern.uj[s]), &values[(size_t)s * k * k]);
  for (PetscInt r = 0; r < arrived.n; r++)
    for (PetscInt s = arrived.i[r]; s < arrived.i[r + 1]; s++) take(owner[r], arrived.j[s], arrived.block(s));
  PetscCall(AinsworthBlockMatAssemble(P.cols.layout, k, pieces, coarse));
  PetscCall(PetscLogEventEnd(AINSWORTH_Galerkin, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
