#include "pmat.h"
#include "../base/events.h"
#include "../base/layouts.h"
#include "../projection/graph.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../saddle/saddle.h"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include <vector>

/*
   AinsworthInvertBlock - inverts one block of S, Hermitian, as a dense matrix after a relative shift of its diagonal.
   block: its rows, ascending
*/
PetscErrorCode AinsworthInvertBlock(const AinsworthCSR &S, const std::vector<PetscInt> &block, PetscReal shift,
                                    std::vector<PetscScalar> *inverse, PetscBool *definite)
{
  const size_t n = block.size();
  PetscBLASInt nb, info;

  PetscFunctionBegin;
  inverse->assign(n * n, 0.0);
  PetscCall(PetscBLASIntCast((PetscInt)n, &nb));
  for (size_t i = 0; i < n; i++) {
    for (PetscInt k = S.ia[block[i]]; k < S.ia[block[i] + 1]; k++) {
      const size_t c = std::lower_bound(block.begin(), block.end(), S.ja[k]) - block.begin();

      if (c < n && block[c] == S.ja[k]) (*inverse)[i + c * n] = i == c ? S.a[k] * (1.0 + shift) : S.a[k];
    }
  }
  PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &nb, inverse->data(), &nb, &info));
  if (!info) PetscCallBLAS("LAPACKpotri", LAPACKpotri_("L", &nb, inverse->data(), &nb, &info));
  *definite = (PetscBool)!info;
  for (size_t i = 0; i < n; i++)
    for (size_t c = 0; c < i; c++) (*inverse)[c + i * n] = PetscConj((*inverse)[i + c * n]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* The whole of S, on ranks that own rows of it, and the block of each row */
struct Blocks : AinsworthCSR {
  PetscInt                           rstart = 0, rend = 0; /* local rows */
  Mat                               *whole = NULL;
  std::vector<PetscInt>              part;
  std::vector<std::vector<PetscInt>> members; /* rows of each block, ascending */

  PetscErrorCode create(Mat S, PetscInt blocks);
  PetscErrorCode destroy();
};

PetscErrorCode Blocks::create(Mat S, PetscInt blocks)
{
  IS parts, all;

  PetscFunctionBegin;
  PetscCall(AinsworthGraphCut(S, blocks, &parts));
  PetscCall(ISAllGather(parts, &all));
  PetscCall(AinsworthISToList(all, &part));
  PetscCall(ISDestroy(&parts));
  PetscCall(ISDestroy(&all));
  members.resize(blocks);
  for (size_t i = 0; i < part.size(); i++) members[part[i]].push_back((PetscInt)i);
  PetscCall(MatGetOwnershipRange(S, &rstart, &rend));
  PetscCall(AinsworthGraphGather(S, rend > rstart, &whole));
  PetscCall(open(whole[0]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Blocks::destroy()
{
  PetscFunctionBegin;
  PetscCall(close());
  PetscCall(MatDestroySubMatrices(1, &whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Conjugate gradients for column j of the inverse, restricted to the entries that the iteration has reached; the others
   stay zero
*/
class ColumnCG {
public:
  explicit ColumnCG(PetscInt m) : x(m, 0.0), r(m, 0.0), p(m, 0.0), q(m, 0.0), d(m, 0.0), reached(m, 0) { }
  void solve(const Blocks &S, PetscInt j, PetscReal rtol, AinsworthEntries &out);

private:
  std::vector<PetscScalar> x, r, p, q;
  std::vector<PetscReal>   d; /* diagonal of S, 0 if not reached yet */
  std::vector<char>        reached;
  std::vector<PetscInt>    support;

  void reach(const Blocks &S, PetscInt i)
  {
    if (reached[i]) return;
    reached[i] = 1;
    support.push_back(i);
    for (PetscInt k = S.ia[i]; k < S.ia[i + 1]; k++)
      if (S.ja[k] == i) d[i] = PetscRealPart(S.a[k]);
  }
};

void ColumnCG::solve(const Blocks &S, PetscInt j, PetscReal rtol, AinsworthEntries &out)
{
  PetscReal rz, norm, norm0;

  support.clear();
  reach(S, j);
  r[j]  = 1.0;
  p[j]  = 1.0 / d[j];
  rz    = 1.0 / d[j];
  norm0 = norm = rz; /* 2-norm of the preconditioned residual, as in KSPCG */
  for (size_t iteration = 0; norm > rtol * norm0 && iteration <= 2 * support.size(); iteration++) {
    const size_t present = support.size();
    PetscReal    pq = 0.0, rznew = 0.0;

    for (size_t s = 0; s < present; s++) {
      const PetscInt i = support[s];
      for (PetscInt k = S.ia[i]; k < S.ia[i + 1]; k++) {
        const PetscInt c = S.ja[k];
        if (S.part[c] != S.part[j]) continue;
        reach(S, c);
        q[c] += PetscConj(S.a[k]) * p[i]; /* column i of S is the adjoint of row i */
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
    if (x[i] != 0.0) out.add(i, PetscConj(x[i]));
    x[i] = r[i] = p[i] = q[i] = 0.0;
    reached[i]                = 0;
  }
  out.endRow();
}

/* Inverts one block; if it is not positive definite, uses the inverse 1-norms of its rows instead */
PetscErrorCode InvertOrNorms(const Blocks &S, const std::vector<PetscInt> &block, std::vector<PetscScalar> &inverse)
{
  const size_t n = block.size();
  PetscBool    definite;

  PetscFunctionBegin;
  PetscCall(AinsworthInvertBlock(S, block, 0.0, &inverse, &definite));
  if (definite) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(NULL,
                      "A block of %" PetscInt_FMT " rows of the Gram matrix, with row %" PetscInt_FMT
                      ", is not positive definite: its diagonal takes its place\n",
                      (PetscInt)n, block[0]));
  inverse.assign(n * n, 0.0);
  for (size_t i = 0; i < n; i++) {
    PetscReal sum = 0.0;

    for (PetscInt k = S.ia[block[i]]; k < S.ia[block[i] + 1]; k++)
      if (S.part[S.ja[k]] == S.part[block[i]]) sum += PetscAbsScalar(S.a[k]);
    inverse[i + i * n] = 1.0 / sum;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode InvertExactly(Mat S, const AinsworthPmatOptions *, PetscInt blocks, AinsworthEntries &rows)
{
  Blocks                                all;
  std::vector<std::vector<PetscScalar>> inverse(blocks);

  PetscFunctionBegin;
  PetscCall(all.create(S, blocks));
  for (PetscInt j = all.rstart; j < all.rend; j++) {
    const std::vector<PetscInt> &block = all.members[all.part[j]];
    std::vector<PetscScalar>    &dense = inverse[all.part[j]];
    const size_t                 row   = std::lower_bound(block.begin(), block.end(), j) - block.begin();

    if (dense.empty()) PetscCall(InvertOrNorms(all, block, dense));
    for (size_t i = 0; i < block.size(); i++)
      if (dense[row + i * block.size()] != 0.0) rows.add(block[i], dense[row + i * block.size()]);
    rows.endRow();
  }
  PetscCall(all.destroy());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode InvertByCG(Mat S, const AinsworthPmatOptions *opt, PetscInt blocks, AinsworthEntries &rows)
{
  Blocks all;

  PetscFunctionBegin;
  PetscCall(all.create(S, blocks));
  ColumnCG cg(all.n);
  for (PetscInt j = all.rstart; j < all.rend; j++) cg.solve(all, j, opt->rtol, rows);
  PetscCall(all.destroy());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Creates the inverse 1-norms of the rows of S (paper, Table 1). Collective

   With rowScaling, takes the norms of D S D, D = diag(S)^{-1/2}, and scales back by D on both sides, so that M_* does
   not depend on the scale of the rows of C.
*/
PetscErrorCode CreateInverseNorms(Mat S, const AinsworthPmatOptions *opt, Vec *D)
{
  Mat SD = S;
  Vec sums;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(S, D, &sums));
  PetscCall(VecSet(*D, 1.0));
  if (opt->rowScaling) {
    PetscCall(MatGetDiagonal(S, *D));
    PetscCall(VecSqrtAbs(*D));
    PetscCall(VecReciprocal(*D));
    PetscCall(AinsworthScaleColumns(S, *D, &SD));
  }
  PetscCall(AinsworthRowSums(SD, 1, sums));
  PetscCall(VecPointwiseDivide(*D, *D, sums));
  PetscCall(VecDestroy(&sums));
  if (opt->rowScaling) PetscCall(MatDestroy(&SD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode InvertRowNorms(Mat S, const AinsworthPmatOptions *opt, PetscInt, AinsworthEntries &rows)
{
  Vec      D;
  PetscInt rstart;

  PetscFunctionBegin;
  PetscCall(CreateInverseNorms(S, opt, &D));
  PetscCall(MatGetOwnershipRange(S, &rstart, NULL));
  PetscCall(AinsworthForEntries({D}, [&](PetscInt i, PetscScalar inverse) {
    rows.add(rstart + i, inverse);
    rows.endRow();
  }));
  PetscCall(VecDestroy(&D));
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

const char *const PCAinsworthPmatTypes[] = {
  "jcb", "id", "cc", "cg", "bj_cc", "bj_cg", "auto", "PCAinsworthPmatType", "PC_AINSWORTH_PMAT_", NULL};

/* Inv(S) of each PCAinsworthPmatType (paper, Table 1); to add one, add its name above and its row here */
static const struct {
  PetscErrorCode (*invert)(Mat S, const AinsworthPmatOptions *, PetscInt blocks, AinsworthEntries &);
  bool dense; /* S is one block; otherwise METIS cuts it */
} approximations[] = {
  {InvertRowNorms, false}, /* jcb */
  {NULL,           false}, /* id: none, Q_* = I */
  {InvertExactly,  true }, /* cc */
  {InvertByCG,     true }, /* cg */
  {InvertExactly,  false}, /* bj_cc */
  {InvertByCG,     false}  /* bj_cg */
};

/* Limit for a single block: 4000 dense rows take 128 MB, and seconds to factor */
static const PetscInt mostDenseRows = 4000;

/*
   AinsworthInvGramCreate - creates the sparse approximation Inv(S) of S^{-1} as an AIJ matrix, laid out as S; NULL for
   id. Collective

   Row j is the adjoint of the approximate solution of S z = e_j.
*/
PetscErrorCode AinsworthInvGramCreate(Mat S, const AinsworthPmatOptions *opt, Mat *inverse)
{
  const auto      &chosen = approximations[opt->type];
  MPI_Comm         comm   = PetscObjectComm((PetscObject)S);
  PetscInt         m, blocks = chosen.dense ? 1 : opt->blocks;
  AinsworthEntries rows;

  PetscFunctionBegin;
  *inverse = NULL;
  if (!chosen.invert) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(AINSWORTH_InvGram, S, 0, 0, 0));
  PetscCall(MatGetSize(S, &m, NULL));
  PetscCheck(!chosen.dense || m <= mostDenseRows, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_ainsworth_pmat %s may give a dense matrix and C has %" PetscInt_FMT " rows, more than %" PetscInt_FMT
             ": use id, jcb, bj_cc or bj_cg",
             PCAinsworthPmatTypes[opt->type], m, mostDenseRows);
  if (blocks == PETSC_DECIDE) blocks = 1 + (m - 1) / 32;
  PetscCall(chosen.invert(S, opt, PetscMin(blocks, m), rows));
  PetscCall(AinsworthCreateAIJLike(S, rows, inverse));
  PetscCall(PetscLogEventEnd(AINSWORTH_InvGram, S, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthInvGramMultiply - computes Inv(S) C. Collective */
PetscErrorCode AinsworthInvGramMultiply(Mat S, const AinsworthPmatOptions *opt, Mat C, Mat *product)
{
  Mat inverse;
  Vec D;

  PetscFunctionBegin;
  if (approximations[opt->type].invert == InvertRowNorms) {
    PetscCall(PetscLogEventBegin(AINSWORTH_InvGram, S, 0, 0, 0));
    PetscCall(CreateInverseNorms(S, opt, &D));
    PetscCall(PetscLogEventEnd(AINSWORTH_InvGram, S, 0, 0, 0));
    PetscCall(MatDuplicate(C, MAT_COPY_VALUES, product));
    PetscCall(MatDiagonalScale(*product, D, NULL));
    PetscCall(VecDestroy(&D));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthInvGramCreate(S, opt, &inverse));
  PetscCall(AinsworthMultiply(inverse, C, product));
  PetscCall(MatDestroy(&inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}
