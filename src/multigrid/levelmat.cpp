#include "levelmat.h"
#include "../base/hermitian.h"
#include <petscblaslapack.h>
#include <petsc/private/matimpl.h>

PetscErrorCode AinsworthLevelMatGet(Mat mat, AinsworthLevel **level)
{
  PetscBool same;

  PetscFunctionBegin;
  *level = NULL;
  PetscCall(PetscObjectTypeCompare((PetscObject)mat, AINSWORTH_LEVEL_MAT, &same));
  if (same) PetscCall(MatShellGetContext(mat, level));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMult_Level(Mat mat, Vec x, Vec y)
{
  AinsworthLevel    *level;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  if (level->single) {
    PetscCall(level->single->mult(x, y));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArrayWrite(y, &to));
  PetscCall(level->product->mult(from, to));
  PetscCall(VecRestoreArrayWrite(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMultTranspose_Level(Mat mat, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(AinsworthApplyConjugated(x, y, [mat](Vec v, Vec w) { return MatMult_Level(mat, v, w); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the residual; in single precision the smoother has already done half of the work */
static PetscErrorCode MatResidual_Level(Mat mat, Vec b, Vec x, Vec r)
{
  AinsworthLevel *level;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  if (level->single) PetscCall(level->single->residual(b, x, r));
  else {
    PetscCall(MatMult(mat, x, r));
    PetscCall(VecAYPX(r, -1.0, b));
  }
  if (level->subspace) PetscCall(level->subspace->project(true, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatGetDiagonal_Level(Mat mat, Vec d)
{
  AinsworthLevel *level;
  PetscScalar    *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  PetscCall(VecGetArrayWrite(d, &to));
  std::copy(level->diagonal.begin(), level->diagonal.end(), to);
  PetscCall(VecRestoreArrayWrite(d, &to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetSymmetric(Mat mat)
{
  PetscFunctionBegin;
  PetscCall(MatSetOption(mat, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  if (!PetscDefined(USE_COMPLEX)) PetscCall(MatSetOption(mat, MAT_SPD, PETSC_TRUE)); /* implies A = A^T */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Converts to AIJ, for factorizations and for users of PCGetCoarseOperators() */
static PetscErrorCode MatConvert_Level_AIJ(Mat mat, MatType, MatReuse reuse, Mat *newmat)
{
  AinsworthLevel   *level;
  AinsworthBlockMat blocks;
  Mat               B;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  PetscCheck(level->product, PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP,
             "The finest level is stored in single precision: use -pc_blocksa_precision double");
  PetscCheck(reuse != MAT_REUSE_MATRIX, PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP,
             "MatConvert() of a level operator makes a new matrix only");
  const AinsworthBlockRows                &U = *level->product->upper, &rest = level->product->rest;
  const AinsworthColumns                  &cols = level->product->cols;
  std::vector<std::vector<AinsworthPiece>> pieces(U.n);
  for (PetscInt r = 0; r < U.n; r++) {
    for (PetscInt k = U.i[r]; k < U.i[r + 1]; k++) {
      pieces[r].push_back({cols.first + U.j[k], U.block(k), false});
      if (k > U.i[r]) pieces[U.j[k]].push_back({cols.first + r, U.block(k), true});
    }
    for (PetscInt k = rest.i[r]; k < rest.i[r + 1]; k++)
      pieces[r].push_back({cols.node(rest.j[k]), rest.block(k), false});
  }
  PetscCall(AinsworthBlockMatAssemble(cols.layout, U.br, pieces, &blocks));
  PetscCall(AinsworthBlocksToAIJ(blocks.rows, blocks.cols, mat, &B));
  PetscCall(SetSymmetric(B));
  if (reuse == MAT_INPLACE_MATRIX) PetscCall(MatHeaderReplace(mat, &B));
  else *newmat = B;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatDestroy_Level(Mat mat)
{
  AinsworthLevel *level;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  delete level;
  PetscCall(PetscObjectComposeFunction((PetscObject)mat, "MatConvert_" AINSWORTH_LEVEL_MAT "_aij_C", NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthLevelMatSet - creates a matrix for a level operator with bs unknowns per node, or replaces the operator of
   an existing one and increases its state
*/
PetscErrorCode AinsworthLevelMatSet(const AinsworthLayout &nodes, PetscInt bs, std::unique_ptr<AinsworthLevel> &&level,
                                    Mat *mat)
{
  AinsworthLevel *old;

  PetscFunctionBegin;
  if (*mat) {
    PetscCall(MatShellGetContext(*mat, &old));
    delete old;
    PetscCall(MatShellSetContext(*mat, level.release()));
    PetscCall(PetscObjectStateIncrease((PetscObject)*mat));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(
    MatCreateShell(nodes->comm, nodes->n * bs, nodes->n * bs, nodes->N * bs, nodes->N * bs, level.release(), mat));
  PetscCall(MatSetBlockSize(*mat, bs));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT, (void (*)(void))MatMult_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_TRANSPOSE, (void (*)(void))MatMultTranspose_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_RESIDUAL, (void (*)(void))MatResidual_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_GET_DIAGONAL, (void (*)(void))MatGetDiagonal_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_DESTROY, (void (*)(void))MatDestroy_Level));
  PetscCall(PetscObjectChangeTypeName((PetscObject)*mat, AINSWORTH_LEVEL_MAT));
  PetscCall(
    PetscObjectComposeFunction((PetscObject)*mat, "MatConvert_" AINSWORTH_LEVEL_MAT "_aij_C", MatConvert_Level_AIJ));
  PetscCall(SetSymmetric(*mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns a number in [-1, 1) that depends on l alone, so that it is the same on any number of ranks */
static PetscReal Hash(size_t l)
{
  unsigned long long s = (unsigned long long)l * 0x9E3779B97F4A7C15ull + 0x1234567ull;

  s ^= s >> 29;
  s *= 0xBF58476D1CE4E5B9ull;
  s ^= s >> 32;
  return (PetscReal)((double)(s >> 11) / 4503599627370496.0 - 1.0);
}

/*
   Gets the largest eigenvalue of the tridiagonal matrix with the diagonals d and e, which are overwritten; leaves it as
   it is if there was no step
*/
static PetscErrorCode LargestRitz(std::vector<PetscReal> &d, std::vector<PetscReal> &e, PetscReal *largest)
{
  PetscBLASInt one = 1, order, info;

  PetscFunctionBegin;
  if (d.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast((PetscInt)d.size(), &order));
  PetscCallBLAS("LAPACKREALsteqr", LAPACKREALsteqr_("N", &order, d.data(), e.data(), NULL, &one, NULL, &info));
  PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK routine steqr returned %d", (int)info);
  *largest = d.back();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Estimates the largest eigenvalue of D^{-1} A by steps of conjugate gradients with Jacobi; collective

   The first residual is r_i = sqrt(a_ii) times a random number, so that stiff and soft unknowns have the same share. w:
   scaling of the unknowns, NULL for none. start: r is zero in rows without entries there, NULL for none. left: the
   eigenvalue is that of A without the rows and columns of these nodes; NULL or empty: none
*/
template <class T>
static PetscErrorCode Estimate(AinsworthProduct<T> &A, const std::vector<PetscReal> &diagonal,
                               const std::vector<PetscReal> *w, PetscInt steps, const AinsworthBlockRows *start,
                               const std::vector<char> *left, PetscReal *largest)
{
  const PetscInt         bs = A.bs(), stride = A.stride();
  const size_t           n = (size_t)A.n() * stride, first = (size_t)A.cols.first * bs;
  std::vector<T>         inverse(n), r(n), p(n), q(n);
  std::vector<PetscReal> d, e; /* the tridiagonal Lanczos matrix */
  PetscReal              rz = 0.0, alpha = 0.0, beta = 0.0;

  auto energy = [&](size_t l) { return AinsworthConj(r[l]) * inverse[l] * r[l]; };
  /* sums over all unknowns of all ranks */
  auto sum = [&](auto f, PetscReal *total) -> PetscErrorCode {
    PetscReal local = 0.0;

    PetscFunctionBegin;
    for (size_t l = 0; l < n; l++) local += PetscRealPart((PetscScalar)f(l));
    PetscCall(MPIU_Allreduce(&local, total, 1, MPIU_REAL, MPIU_SUM, A.cols.layout->comm));
    PetscFunctionReturn(PETSC_SUCCESS);
  };

  PetscFunctionBegin;
  for (size_t l = 0; l < diagonal.size(); l++) {
    const size_t    at    = l / bs * stride + l % bs;
    const PetscReal scale = w ? (*w)[l] : 1.0;

    inverse[at] = (T)(1.0 / (diagonal[l] * scale * scale));
    if (left && !left->empty() && (*left)[l / bs]) inverse[at] = 0;
    if (!start || start->i[l / bs] < start->i[l / bs + 1])
      r[at] = (T)(PetscSqrtReal(diagonal[l]) * scale * Hash(first + l));
  }
  for (size_t l = 0; l < n; l++) p[l] = inverse[l] * r[l];
  PetscCall(sum(energy, &rz));
  for (PetscInt k = 0; k < steps && rz > 0.0; k++) {
    PetscReal pq, before = rz;

    PetscCall(A.mult(p.data(), q.data()));
    PetscCall(sum([&](size_t l) { return AinsworthConj(p[l]) * q[l]; }, &pq));
    if (!(pq > 0.0)) break;
    d.push_back(pq / rz + (k ? beta / alpha : 0.0));
    alpha = rz / pq;
    for (size_t l = 0; l < n; l++) r[l] -= T(alpha) * q[l];
    PetscCall(sum(energy, &rz));
    beta = rz / before;
    e.push_back(PetscSqrtReal(beta) / alpha);
    if (rz < 1e-10 * before) break;
    for (size_t l = 0; l < n; l++) p[l] = inverse[l] * r[l] + T(beta) * p[l];
  }
  *largest = 1.0;
  PetscCall(LargestRitz(d, e, largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthLevel::stay - keeps the cycle in a subspace on this level: W takes the place of the inverse diagonal where Q
   changes anything
*/
void AinsworthLevel::stay(const std::shared_ptr<const AinsworthLevelSubspace> &in)
{
  subspace = in;
  if (!single || !in) return;
  const PetscInt bs = single->product->bs(), stride = single->product->stride();

  for (size_t k = 0; k < in->at.size(); k++) {
    const PetscReal w = (*single->w)[in->at[k]];

    single->inverse[in->at[k] / bs * stride + in->at[k] % bs] = (AinsworthSingle)(in->space->weight[k] / (w * w));
  }
}

/*
   AinsworthLevel::estimateInSubspace - estimates the largest eigenvalue of Q W A, by steps of conjugate gradients in
   the subspace; collective

   mat: this level
*/
PetscErrorCode AinsworthLevel::estimateInSubspace(Mat mat)
{
  enum {
    steps = 10
  };
  std::vector<PetscReal> d, e; /* the tridiagonal Lanczos matrix */
  Vec                    r, z, p, q;
  PetscScalar           *a, rz, pq, before, alpha = 0.0, beta = 0.0;
  PetscInt               rstart, rend;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(mat, &r, &z));
  PetscCall(VecDuplicate(r, &p));
  PetscCall(VecDuplicate(r, &q));
  PetscCall(VecGetOwnershipRange(r, &rstart, &rend));
  PetscCall(VecGetArrayWrite(r, &a));
  for (PetscInt l = 0; l < rend - rstart; l++) a[l] = PetscSqrtReal(diagonal[l]) * Hash((size_t)(rstart + l));
  PetscCall(VecRestoreArrayWrite(r, &a));
  std::vector<PetscReal> w;
  for (PetscReal v : diagonal) w.push_back(1.0 / v);
  for (size_t k = 0; k < subspace->at.size(); k++) w[subspace->at[k]] = subspace->space->weight[k];
  auto precondition = [&]() -> PetscErrorCode {
    PetscFunctionBegin;
    PetscCall(VecCopy(r, z));
    PetscCall(VecGetArray(z, &a));
    for (size_t l = 0; l < w.size(); l++) a[l] *= w[l];
    PetscCall(VecRestoreArray(z, &a));
    PetscCall(subspace->project(false, z));
    PetscCall(VecDot(r, z, &rz));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  PetscCall(precondition());
  PetscCall(VecCopy(z, p));
  for (int k = 0; k < steps && PetscRealPart(rz) > 0.0; k++) {
    PetscCall(MatMult(mat, p, q));
    PetscCall(VecDot(q, p, &pq));
    if (!(PetscRealPart(pq) > 0.0)) break;
    d.push_back(PetscRealPart(pq / rz) + (k ? PetscRealPart(beta / alpha) : 0.0));
    alpha  = rz / pq;
    before = rz;
    PetscCall(VecAXPY(r, -alpha, q));
    PetscCall(precondition());
    beta = rz / before;
    e.push_back(PetscSqrtReal(PetscMax(PetscRealPart(beta), 0.0)) / PetscRealPart(alpha));
    PetscCall(VecAYPX(p, beta, z));
  }
  for (Vec *v : {&r, &z, &p, &q}) PetscCall(VecDestroy(v));
  PetscCall(LargestRitz(d, e, &largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthLevel::estimate - estimates the largest eigenvalue of D^{-1} M, somewhat from below; collective

   added: M is A plus a matrix with entries in these rows, and `largest` holds the eigenvalue of A. If that of M is
   larger, its eigenvector is near these rows, and starting there finds it in half of the steps (docs/multigrid.md)
*/
PetscErrorCode AinsworthLevel::estimate(const AinsworthBlockRows *added, const std::vector<char> *left)
{
  const PetscReal known = added ? largest : 0.0;
  const PetscInt  steps = added ? 5 : 10;

  PetscFunctionBegin;
  if (single) PetscCall(Estimate(*single->product, diagonal, single->w.get(), steps, added, left, &largest));
  else PetscCall(Estimate(*product, diagonal, NULL, steps, added, left, &largest));
  largest = PetscMax(largest, known);
  PetscFunctionReturn(PETSC_SUCCESS);
}
