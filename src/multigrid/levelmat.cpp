#include "levelmat.h"
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
    PetscCall(AinsworthScaledMult(level->single.get(), x, y));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArrayWrite(y, &to));
  PetscCall(level->product->mult(from, to));
  PetscCall(VecRestoreArrayWrite(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#if defined(PETSC_USE_COMPLEX)
static PetscErrorCode MatMultTranspose_Level(Mat mat, Vec x, Vec y)
{
  Vec conjugate;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(x, &conjugate));
  PetscCall(VecCopy(x, conjugate));
  PetscCall(VecConjugate(conjugate));
  PetscCall(MatMult_Level(mat, conjugate, y));
  PetscCall(VecConjugate(y));
  PetscCall(VecDestroy(&conjugate));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#endif

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

/* For -ksp_view: entries as a matrix without symmetry would have them */
static PetscErrorCode MatGetInfo_Level(Mat mat, MatInfoType flag, MatInfo *info)
{
  AinsworthLevel *level;
  PetscLogDouble  entries;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  PetscCall(PetscMemzero(info, sizeof(*info)));
  const PetscInt bs   = level->single ? level->single->product.bs() : level->product->bs();
  const size_t   half = level->single ? level->single->product.upper->j.size() : level->product->upper->j.size();
  const size_t   rest = level->single ? level->single->product.rest.j.size() : level->product->rest.j.size();
  entries             = (PetscLogDouble)(bs * bs) * (2.0 * (double)half - (double)level->diagonal.size() / (double)bs + (double)rest);
  info->block_size    = bs;
  info->nz_used       = entries;
  info->nz_allocated  = entries;
  if (flag == MAT_GLOBAL_SUM || flag == MAT_GLOBAL_MAX) {
    PetscCallMPI(
      MPI_Allreduce(MPI_IN_PLACE, &info->nz_used, 1, MPIU_PETSCLOGDOUBLE, flag == MAT_GLOBAL_SUM ? MPI_SUM : MPI_MAX, PetscObjectComm((PetscObject)mat)));
    info->nz_allocated = info->nz_used;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddBlock(Mat B, PetscInt bs, PetscInt row, PetscInt col, const PetscScalar *a, PetscBool adjoint, std::vector<PetscScalar> &work)
{
  PetscFunctionBegin;
  if (adjoint) {
    work.resize(bs * bs);
    for (PetscInt p = 0; p < bs; p++)
      for (PetscInt q = 0; q < bs; q++) work[q * bs + p] = PetscConj(a[p * bs + q]);
    a = work.data();
  }
  PetscCall(MatSetValuesBlocked(B, 1, &row, 1, &col, a, ADD_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As AIJ, for factorizations and for users of PCGetCoarseOperators() */
static PetscErrorCode MatConvert_Level_AIJ(Mat mat, MatType, MatReuse reuse, Mat *newmat)
{
  AinsworthLevel          *level;
  Mat                      B;
  PetscInt                 n, N, first;
  std::vector<PetscInt>    diagonal, other;
  std::vector<PetscScalar> work;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  PetscCheck(level->product, PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP,
             "The finest level is stored in single precision: use -pc_blocksa_precision double");
  PetscCheck(reuse == MAT_INITIAL_MATRIX || reuse == MAT_INPLACE_MATRIX, PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP,
             "MatConvert() of the operator of a level makes a new matrix only");
  const AinsworthUpper<PetscScalar> &U  = *level->product->upper;
  const AinsworthRest<PetscScalar>  &E  = level->product->rest;
  const AinsworthColumns            &co = level->product->cols;
  diagonal.assign(U.n, 0);
  other.assign(U.n, 0);
  for (PetscInt i = 0; i < U.n; i++) {
    diagonal[i] += U.i[i + 1] - U.i[i];
    for (PetscInt k = U.i[i] + 1; k < U.i[i + 1]; k++) diagonal[U.j[k]]++;
  }
  for (size_t r = 0; r < E.row.size(); r++)
    for (PetscInt k = E.i[r]; k < E.i[r + 1]; k++) (E.j[k] < co.local ? diagonal : other)[E.row[r]]++;
  PetscCall(MatGetLocalSize(mat, &n, NULL));
  PetscCall(MatGetSize(mat, &N, NULL));
  for (PetscInt &c : diagonal) c = PetscMin(c, U.n); /* blocks that were added are counted twice */
  for (PetscInt &c : other) c = PetscMin(c, N / U.bs - U.n);
  PetscCall(MatCreate(PetscObjectComm((PetscObject)mat), &B));
  PetscCall(MatSetSizes(B, n, n, N, N));
  PetscCall(MatSetBlockSize(B, U.bs));
  PetscCall(MatSetType(B, MATAIJ));
  PetscCall(MatXAIJSetPreallocation(B, U.bs, diagonal.data(), other.data(), NULL, NULL));
  first = co.first;
  for (PetscInt i = 0; i < U.n; i++)
    for (PetscInt k = U.i[i]; k < U.i[i + 1]; k++) {
      const PetscScalar *a = U.a.data() + (size_t)k * U.bs * U.bs;
      PetscCall(AddBlock(B, U.bs, first + i, first + U.j[k], a, PETSC_FALSE, work));
      if (k > U.i[i]) PetscCall(AddBlock(B, U.bs, first + U.j[k], first + i, a, PETSC_TRUE, work));
    }
  for (size_t r = 0; r < E.row.size(); r++)
    for (PetscInt k = E.i[r]; k < E.i[r + 1]; k++)
      PetscCall(AddBlock(B, U.bs, first + E.row[r], co.node(E.j[k]), E.a.data() + (size_t)k * U.bs * U.bs, PETSC_FALSE, work));
  PetscCall(MatAssemblyBegin(B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(B, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  if (!PetscDefined(USE_COMPLEX)) PetscCall(MatSetOption(B, MAT_SPD, PETSC_TRUE)); /* it includes A = A^T */
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

/* AinsworthLevelMatCreate - a matrix for the operator of a level with nodes of bs unknowns, which AinsworthLevelMatSet() fills */
PetscErrorCode AinsworthLevelMatCreate(PetscLayout nodes, PetscInt bs, Mat *mat)
{
  PetscInt n, N;

  PetscFunctionBegin;
  PetscCall(PetscLayoutGetLocalSize(nodes, &n));
  PetscCall(PetscLayoutGetSize(nodes, &N));
  PetscCall(MatCreate(nodes->comm, mat));
  PetscCall(MatSetSizes(*mat, n * bs, n * bs, N * bs, N * bs));
  PetscCall(MatSetBlockSize(*mat, bs));
  PetscCall(MatSetType(*mat, MATSHELL));
  PetscCall(MatSetUp(*mat));
  PetscCall(MatShellSetContext(*mat, new AinsworthLevel));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT, (void (*)(void))MatMult_Level));
#if defined(PETSC_USE_COMPLEX)
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_TRANSPOSE, (void (*)(void))MatMultTranspose_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_HERMITIAN_TRANSPOSE, (void (*)(void))MatMult_Level));
#else
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_TRANSPOSE, (void (*)(void))MatMult_Level));
#endif
  PetscCall(MatShellSetOperation(*mat, MATOP_GET_DIAGONAL, (void (*)(void))MatGetDiagonal_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_GETINFO, (void (*)(void))MatGetInfo_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_DESTROY, (void (*)(void))MatDestroy_Level));
  PetscCall(PetscObjectChangeTypeName((PetscObject)*mat, AINSWORTH_LEVEL_MAT));
  PetscCall(PetscObjectComposeFunction((PetscObject)*mat, "MatConvert_" AINSWORTH_LEVEL_MAT "_aij_C", MatConvert_Level_AIJ));
  PetscCall(MatSetOption(*mat, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  if (!PetscDefined(USE_COMPLEX)) PetscCall(MatSetOption(*mat, MAT_SPD, PETSC_TRUE)); /* it includes A = A^T */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the matrix is from now on; its users see that it changed */
PetscErrorCode AinsworthLevelMatSet(Mat mat, std::unique_ptr<AinsworthLevel> &&level)
{
  AinsworthLevel *old;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &old));
  delete old;
  PetscCall(MatShellSetContext(mat, level.release()));
  PetscCall(PetscObjectStateIncrease((PetscObject)mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A number in [-1, 1) that depends on l alone, so that it is the same on any number of ranks */
static PetscReal Hash(size_t l)
{
  unsigned long long s = (unsigned long long)l * 0x9E3779B97F4A7C15ull + 0x1234567ull;

  s ^= s >> 29;
  s *= 0xBF58476D1CE4E5B9ull;
  s ^= s >> 32;
  return (PetscReal)((double)(s >> 11) / 4503599627370496.0 - 1.0);
}

/* The largest eigenvalue of a symmetric tridiagonal matrix of order k */
static PetscErrorCode LargestOfTridiagonal(PetscInt k, PetscReal *d, PetscReal *e, PetscReal *largest)
{
  PetscBLASInt n, info, one = 1;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(k, &n));
  PetscCallBLAS("LAPACKREALsteqr", LAPACKREALsteqr_("N", &n, d, e, NULL, &one, NULL, &info));
  PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK routine steqr returned %d", (int)info);
  *largest = d[k - 1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sum of f(l) over all unknowns of all ranks */
template <class F>
static PetscErrorCode Sum(MPI_Comm comm, size_t n, F f, PetscReal *sum)
{
  PetscReal local = 0.0;

  PetscFunctionBegin;
  for (size_t l = 0; l < n; l++) local += PetscRealPart((PetscScalar)f(l));
  PetscCall(MPIU_Allreduce(&local, sum, 1, MPIU_REAL, MPIU_SUM, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ten steps of conjugate gradients with Jacobi from r_i = sqrt(a_ii) times a random number, of which stiff and soft unknowns have the same share */
template <class T>
static PetscErrorCode Estimate(AinsworthProduct<T> &A, const std::vector<T> &inverse, const std::vector<T> &start, PetscReal *largest)
{
  const PetscInt         steps = 10;
  const size_t           n     = start.size();
  MPI_Comm               comm  = A.cols.layout->comm;
  std::vector<T>         r(start), p(n), q(n);
  std::vector<PetscReal> d, e;
  PetscReal              rz = 0.0, alpha = 0.0, beta = 0.0;

  PetscFunctionBegin;
  for (size_t l = 0; l < n; l++) p[l] = inverse[l] * r[l];
  PetscCall(Sum(
    comm, n, [&](size_t l) { return AinsworthConj(r[l]) * inverse[l] * r[l]; }, &rz));
  for (PetscInt k = 0; k < steps && rz > 0.0; k++) {
    PetscReal pq, before = rz;

    PetscCall(A.mult(p.data(), q.data()));
    PetscCall(Sum(
      comm, n, [&](size_t l) { return AinsworthConj(p[l]) * q[l]; }, &pq));
    if (!(pq > 0.0)) break;
    d.push_back(pq / rz + (k ? beta / alpha : 0.0));
    alpha = rz / pq;
    for (size_t l = 0; l < n; l++) r[l] -= T(alpha) * q[l];
    PetscCall(Sum(
      comm, n, [&](size_t l) { return AinsworthConj(r[l]) * inverse[l] * r[l]; }, &rz));
    beta = rz / before;
    e.push_back(PetscSqrtReal(beta) / alpha);
    if (rz < 1e-10 * before) break;
    for (size_t l = 0; l < n; l++) p[l] = inverse[l] * r[l] + T(beta) * p[l];
  }
  *largest = 1.0;
  if (d.size()) PetscCall(LargestOfTridiagonal((PetscInt)d.size(), d.data(), e.data(), largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthLevelEstimate - the largest eigenvalue of D^{-1} M, somewhat from below; collective */
PetscErrorCode AinsworthLevelEstimate(AinsworthLevel *level)
{
  const std::vector<PetscReal> &diagonal = level->diagonal;

  PetscFunctionBegin;
  if (level->single) {
    AinsworthScaled             &L  = *level->single;
    const PetscInt               bs = L.product.bs(), stride = L.product.stride();
    const size_t                 first = (size_t)L.product.cols.first * bs;
    std::vector<AinsworthSingle> start(L.inverse.size(), AinsworthSingle(0));

    for (size_t l = 0; l < diagonal.size(); l++) start[l / bs * stride + l % bs] = (AinsworthSingle)(PetscSqrtReal(diagonal[l]) * (*L.w)[l] * Hash(first + l));
    PetscCall(Estimate(L.product, L.inverse, start, &level->largest));
  } else {
    AinsworthProduct<PetscScalar> &A     = *level->product;
    const size_t                   first = (size_t)A.cols.first * A.bs();
    std::vector<PetscScalar>       start(diagonal.size()), inverse(diagonal.size());

    for (size_t l = 0; l < diagonal.size(); l++) {
      inverse[l] = 1.0 / diagonal[l];
      start[l]   = PetscSqrtReal(diagonal[l]) * Hash(first + l);
    }
    PetscCall(Estimate(A, inverse, start, &level->largest));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
