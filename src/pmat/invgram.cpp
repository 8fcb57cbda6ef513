#include "pmat.h"
#include "../saddle/saddle.h"
#include "../events.h"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include <vector>

namespace
{
/* The rows of Inv(S) that a rank owns, in compressed form with ascending columns */
struct Rows {
  std::vector<PetscInt>    start{0}, columns;
  std::vector<PetscScalar> values;
  void                     close() { start.push_back((PetscInt)columns.size()); }
};

/* S, or the part of it within one block, seen from the rank that needs it; members are ascending */
struct Graph {
  const PetscInt    *ia, *ja;
  const PetscScalar *a;
  const PetscInt    *part; /* block of each row */
};

/* Conjugate gradients for column j of the inverse, on the entries that the iteration has reached only: the others stay zero */
class ColumnCG {
public:
  explicit ColumnCG(PetscInt m) : x(m, 0.0), r(m, 0.0), p(m, 0.0), q(m, 0.0), d(m, 0.0), reached(m, 0) { }
  void solve(const Graph &S, PetscInt j, PetscReal rtol, Rows &out);

private:
  std::vector<PetscScalar> x, r, p, q;
  std::vector<PetscReal>   d; /* diagonal of S, 0 where not reached yet */
  std::vector<char>        reached;
  std::vector<PetscInt>    support;

  void reach(const Graph &S, PetscInt i)
  {
    if (reached[i]) return;
    reached[i] = 1;
    support.push_back(i);
    for (PetscInt k = S.ia[i]; k < S.ia[i + 1]; k++)
      if (S.ja[k] == i) d[i] = PetscRealPart(S.a[k]);
  }
};

void ColumnCG::solve(const Graph &S, PetscInt j, PetscReal rtol, Rows &out)
{
  PetscReal rz, norm, norm0;

  support.clear();
  reach(S, j);
  r[j]  = 1.0;
  p[j]  = 1.0 / d[j];
  rz    = 1.0 / d[j];
  norm0 = norm = rz; /* 2-norm of the preconditioned residual, as KSPCG */
  for (size_t iteration = 0; norm > rtol * norm0 && iteration <= 2 * support.size(); iteration++) {
    const size_t present = support.size();
    PetscReal    pq = 0.0, rznew = 0.0;

    for (size_t s = 0; s < present; s++) {
      const PetscInt i = support[s];
      for (PetscInt k = S.ia[i]; k < S.ia[i + 1]; k++) {
        const PetscInt c = S.ja[k];
        if (S.part[c] != S.part[j]) continue;
        reach(S, c);
        q[c] += PetscConj(S.a[k]) * p[i]; /* column i of S is the adjoint of its row i */
      }
    }
    for (size_t s = 0; s < present; s++) pq += PetscRealPart(PetscConj(p[support[s]]) * q[support[s]]);
    if (!(pq > 0.0)) break;
    norm = 0.0;
    for (PetscInt i : support) {
      x[i] += rz / pq * p[i];
      r[i] -= rz / pq * q[i];
      q[i] = 0.0;
      rznew += PetscSqr(PetscAbsScalar(r[i])) / d[i];
      norm += PetscSqr(PetscAbsScalar(r[i]) / d[i]);
    }
    norm = std::sqrt(norm);
    for (PetscInt i : support) p[i] = r[i] / d[i] + rznew / rz * p[i];
    rz = rznew;
  }
  std::sort(support.begin(), support.end());
  for (PetscInt i : support) {
    if (x[i] != 0.0) {
      out.columns.push_back(i);
      out.values.push_back(PetscConj(x[i]));
    }
    x[i] = r[i] = p[i] = q[i] = 0.0;
    reached[i]                = 0;
  }
  out.close();
}

/* The exact inverse of one dense block; where it is not positive definite, the 1-norms of its rows stand in for it */
class BlockInverse {
public:
  PetscErrorCode factor(const Graph &S, const std::vector<PetscInt> &members);
  PetscErrorCode row(PetscInt local, Rows &out);

private:
  const std::vector<PetscInt> *members = nullptr;
  std::vector<PetscScalar>     L, e;
  bool                         definite = true;
};

PetscErrorCode BlockInverse::factor(const Graph &S, const std::vector<PetscInt> &block)
{
  const size_t n = block.size();
  PetscBLASInt nb, info;

  PetscFunctionBegin;
  members = &block;
  L.assign(n * n, 0.0);
  e.resize(n);
  PetscCall(PetscBLASIntCast((PetscInt)n, &nb));
  for (size_t i = 0; i < n; i++) {
    e[i] = 0.0;
    for (PetscInt k = S.ia[block[i]]; k < S.ia[block[i] + 1]; k++) {
      if (S.part[S.ja[k]] != S.part[block[i]]) continue;
      const size_t c = std::lower_bound(block.begin(), block.end(), S.ja[k]) - block.begin();
      L[i + c * n]   = S.a[k];
      e[i] += PetscAbsScalar(S.a[k]);
    }
  }
  PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &nb, L.data(), &nb, &info));
  definite = info == 0;
  if (definite) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(
    NULL, "A block of %" PetscInt_FMT " rows of the Gram matrix, with row %" PetscInt_FMT ", is not positive definite: its diagonal takes its place\n",
    (PetscInt)n, block[0]));
  L = e;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode BlockInverse::row(PetscInt local, Rows &out)
{
  const size_t n  = members->size();
  PetscBLASInt nb = (PetscBLASInt)n, one = 1, info;

  PetscFunctionBegin;
  std::fill(e.begin(), e.end(), 0.0);
  if (definite) {
    e[local] = 1.0;
    PetscCallBLAS("LAPACKpotrs", LAPACKpotrs_("L", &nb, &one, L.data(), &nb, e.data(), &nb, &info));
  } else e[local] = 1.0 / L[local];
  for (size_t i = 0; i < n; i++) {
    if (e[i] == 0.0) continue;
    out.columns.push_back((*members)[i]);
    out.values.push_back(PetscConj(e[i]));
  }
  out.close();
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

/* S as a whole on every rank that owns rows of it, nothing on the others */
static PetscErrorCode GatherEverywhere(Mat S, Mat **all)
{
  PetscInt m, local;
  IS       is;

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, &m, NULL));
  PetscCall(MatGetLocalSize(S, &local, NULL));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, local ? m : 0, 0, 1, &is));
  PetscCall(MatCreateSubMatrices(S, 1, &is, &is, MAT_INITIAL_MATRIX, all));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows rstart <= j < rend of Inv(S) */
static PetscErrorCode InvertRows(Mat S, const AinsworthPmatOptions *opt, PetscInt blocks, PetscInt rstart, PetscInt rend, Rows &rows)
{
  const bool            exact = opt->type == PC_AINSWORTH_PMAT_CC || opt->type == PC_AINSWORTH_PMAT_BJ_CC;
  PetscInt              m, n;
  const PetscScalar    *a;
  Graph                 graph;
  PetscBool             done;
  std::vector<PetscInt> part;

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, &m, NULL));
  part.resize(m);
  PetscCall(AinsworthBlocksCreate(S, blocks, part.data()));
  PetscCall(MatGetRowIJ(S, 0, PETSC_FALSE, PETSC_FALSE, &n, &graph.ia, &graph.ja, &done));
  PetscCall(MatSeqAIJGetArrayRead(S, &a));
  graph.a    = a;
  graph.part = part.data();
  if (exact) {
    std::vector<std::vector<PetscInt>> members(blocks);
    std::vector<Rows>                  inverse(rend - rstart);
    BlockInverse                       block;

    for (PetscInt i = 0; i < m; i++) members[part[i]].push_back(i);
    for (const std::vector<PetscInt> &list : members) {
      bool factored = false;
      for (size_t i = 0; i < list.size(); i++) {
        if (list[i] < rstart || list[i] >= rend) continue;
        if (!factored) PetscCall(block.factor(graph, list));
        factored = true;
        PetscCall(block.row((PetscInt)i, inverse[list[i] - rstart]));
      }
    }
    for (Rows &row : inverse) {
      rows.columns.insert(rows.columns.end(), row.columns.begin(), row.columns.end());
      rows.values.insert(rows.values.end(), row.values.begin(), row.values.end());
      rows.close();
      row = Rows();
    }
  } else {
    ColumnCG cg(m);
    for (PetscInt j = rstart; j < rend; j++) cg.solve(graph, j, opt->rtol, rows);
  }
  PetscCall(MatSeqAIJRestoreArrayRead(S, &a));
  PetscCall(MatRestoreRowIJ(S, 0, PETSC_FALSE, PETSC_FALSE, &n, &graph.ia, &graph.ja, &done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Diagonal of the inverse 1-norms of the rows of S (paper, Table 1); scaled: of D S D with D = diag(S)^{-1/2}, brought back by D on both
   sides, which makes M_* the same whatever the scale of the rows of C
*/
static PetscErrorCode InvertRowNorms(Mat S, PetscBool scaled, Rows &rows)
{
  Mat                SD = S;
  Vec                D  = NULL, sums;
  PetscInt           rstart, rend;
  const PetscScalar *d = NULL, *sum;

  PetscFunctionBegin;
  if (scaled) {
    PetscCall(MatCreateVecs(S, &D, NULL));
    PetscCall(MatGetDiagonal(S, D));
    PetscCall(VecSqrtAbs(D));
    PetscCall(VecReciprocal(D));
    PetscCall(MatDuplicate(S, MAT_COPY_VALUES, &SD));
    PetscCall(MatDiagonalScale(SD, NULL, D));
    PetscCall(VecGetArrayRead(D, &d));
  }
  PetscCall(MatCreateVecs(S, NULL, &sums));
  PetscCall(AinsworthRowSums(SD, 1, sums));
  PetscCall(MatGetOwnershipRange(S, &rstart, &rend));
  PetscCall(VecGetArrayRead(sums, &sum));
  for (PetscInt i = rstart; i < rend; i++) {
    rows.columns.push_back(i);
    rows.values.push_back((d ? PetscRealPart(d[i - rstart]) : 1.0) / PetscRealPart(sum[i - rstart]));
    rows.close();
  }
  PetscCall(VecRestoreArrayRead(sums, &sum));
  PetscCall(VecDestroy(&sums));
  if (scaled) {
    PetscCall(VecRestoreArrayRead(D, &d));
    PetscCall(VecDestroy(&D));
    PetscCall(MatDestroy(&SD));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of cc and cg: what 4000 dense rows add to A takes 128 MB, and its factorization seconds */
static const PetscInt mostDenseRows = 4000;

/*
   AinsworthInvGramCreate - the sparse approximation Inv(S) of S^{-1} as an AIJ matrix, m x m, rows distributed as those of S; NULL for id

   Row j is the adjoint of the approximate solution of S z = e_j (paper, Table 1). cc and cg are bj_cc and bj_cg with one block.
*/
PetscErrorCode AinsworthInvGramCreate(Mat S, const AinsworthPmatOptions *opt, Mat *inverse)
{
  const bool dense = opt->type == PC_AINSWORTH_PMAT_CC || opt->type == PC_AINSWORTH_PMAT_CG;
  MPI_Comm   comm  = PetscObjectComm((PetscObject)S);
  PetscInt   m, local, rstart, rend, blocks = dense ? 1 : opt->blocks;
  Rows       rows;

  PetscFunctionBegin;
  *inverse = NULL;
  if (opt->type == PC_AINSWORTH_PMAT_ID) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(AINSWORTH_InvGram, S, 0, 0, 0));
  PetscCall(MatGetSize(S, &m, NULL));
  PetscCall(MatGetOwnershipRange(S, &rstart, &rend));
  PetscCheck(!dense || m <= mostDenseRows, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_ainsworth_pmat %s may give a dense matrix and C has %" PetscInt_FMT " rows, more than %" PetscInt_FMT ": use id, jcb, bj_cc or bj_cg",
             PCAinsworthPmatTypes[opt->type], m, mostDenseRows);
  if (blocks == PETSC_DECIDE) blocks = 1 + (m - 1) / 32;
  blocks = PetscMin(blocks, m);
  if (opt->type == PC_AINSWORTH_PMAT_JCB) PetscCall(InvertRowNorms(S, opt->rowScaling, rows));
  else {
    Mat *all;

    PetscCall(GatherEverywhere(S, &all));
    if (rend > rstart) PetscCall(InvertRows(all[0], opt, blocks, rstart, rend, rows));
    PetscCall(MatDestroySubMatrices(1, &all));
  }
  local = rend - rstart;
  PetscCall(MatCreate(comm, inverse));
  PetscCall(MatSetSizes(*inverse, local, local, m, m));
  PetscCall(MatSetType(*inverse, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(*inverse, rows.start.data(), rows.columns.data(), rows.values.data()));
  PetscCall(MatMPIAIJSetPreallocationCSR(*inverse, rows.start.data(), rows.columns.data(), rows.values.data()));
  PetscCall(PetscLogEventEnd(AINSWORTH_InvGram, S, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
