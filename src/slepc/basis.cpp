#include "basis.h"
#include <algorithm>
#include <cmath>

AinsworthBasis::~AinsworthBasis()
{
  for (BV *V : {&S, &KS, &MS}) (void)BVDestroy(V);
  (void)MatDestroy(&small);
}

PetscErrorCode AinsworthBasis::create(const AinsworthPencil *from, PetscInt most, bool anySign)
{
  Vec v;

  PetscFunctionBegin;
  pencil     = from;
  block      = most;
  indefinite = anySign;
  PetscCall(pencil->createVec(&v));
  comm = PetscObjectComm((PetscObject)v);
  for (BV *V : {&S, &KS, &MS}) {
    PetscCall(BVCreate(comm, V));
    PetscCall(BVSetSizesFromVec(*V, v, 3 * block));
    PetscCall(BVSetType(*V, BVSVEC));
  }
  PetscCall(VecDestroy(&v));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, 3 * block, 3 * block, NULL, &small));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthBasis::append(Vec v, Vec Kv, Vec Mv)
{
  PetscFunctionBegin;
  PetscCall(BVInsertVec(S, end, v));
  PetscCall(BVInsertVec(KS, end, Kv));
  PetscCall(BVInsertVec(MS, end, Mv));
  end++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes S' V for the columns of V from `first` on */
PetscErrorCode AinsworthBasis::gram(BV V, PetscInt first, PetscInt last, AinsworthSmall *G) const
{
  const PetscScalar *a;
  PetscInt           lda;

  PetscFunctionBegin;
  PetscCall(BVSetActiveColumns(S, 0, last));
  PetscCall(BVSetActiveColumns(V, first, last));
  PetscCall(BVDot(V, S, small));
  *G = AinsworthSmall(last, last - first);
  PetscCall(MatDenseGetLDA(small, &lda));
  PetscCall(MatDenseGetArrayRead(small, &a));
  for (PetscInt j = first; j < last; j++)
    for (PetscInt i = 0; i < last; i++) (*G)(i, j - first) = a[(size_t)j * lda + i];
  PetscCall(MatDenseRestoreArrayRead(small, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the columns from `first` on by those of [S_0 ... S_last-1] T, and the products likewise */
PetscErrorCode AinsworthBasis::transform(PetscInt last, PetscInt first, const AinsworthSmall &T)
{
  PetscScalar *a;
  PetscInt     lda;

  PetscFunctionBegin;
  PetscCall(MatDenseGetLDA(small, &lda));
  PetscCall(MatDenseGetArray(small, &a));
  for (PetscInt j = 0; j < T.cols; j++)
    for (PetscInt i = 0; i < T.rows; i++) a[(size_t)(first + j) * lda + i] = T(i, j);
  PetscCall(MatDenseRestoreArray(small, &a));
  for (BV V : {S, KS, MS}) {
    PetscCall(BVSetActiveColumns(V, 0, last));
    PetscCall(BVMultInPlace(V, small, first, first + T.cols));
  }
  end = first + T.cols;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Twice where needed: the first time leaves errors of eps over the smallest eigenvalue that is kept (Stathopoulos and
   Wu 2002)
*/
PetscErrorCode AinsworthBasis::orthonormalize()
{
  /* what a vector has outside of the others is at least 1e-4 of it; after that more than noise */
  const PetscReal least[] = {1e-8, 0.1};
  const PetscInt  first   = nx + np;

  PetscFunctionBegin;
  if (end == first) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscReal bound : least) {
    AinsworthSmall         G, old(first, end - first), inner(end - first, end - first), T, all;
    std::vector<PetscReal> diagonal;
    PetscReal              smallest;

    PetscCall(gram(KS, first, end, &G));
    for (PetscInt j = 0; j < G.cols; j++) {
      for (PetscInt i = 0; i < first; i++) old(i, j) = G(i, j);
      diagonal.push_back(PetscRealPart(G(first + j, j)));
    }
    inner = AinsworthSmallAdjointProduct(old, old);
    for (PetscInt j = 0; j < G.cols; j++)
      for (PetscInt i = 0; i < G.cols; i++)
        inner(i, j) = 0.5 * (G(first + i, j) + PetscConj(G(first + j, i))) - inner(i, j);
    PetscCall(AinsworthSmallOrthonormalize(comm, inner, diagonal, bound, &T, &smallest));
    if (smallest < -least[0] || *std::min_element(diagonal.begin(), diagonal.end()) < 0.0)
      PetscCall(pencil->refuseIndefinite());
    all = AinsworthSmall(end, T.cols);
    old = AinsworthSmallProduct(old, T);
    for (PetscInt j = 0; j < T.cols; j++) {
      for (PetscInt i = 0; i < first; i++) all(i, j) = -old(i, j);
      for (PetscInt i = 0; i < T.rows; i++) all(first + i, j) = T(i, j);
    }
    PetscCall(transform(end, first, all));
    if (smallest > least[1]) break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Coefficients of new directions: what Ritz vectors got from P and W, orthogonal to them (Hetmaniuk, Lehoucq 2006) */
static PetscErrorCode Directions(MPI_Comm comm, const AinsworthSmall &Y, PetscInt nx, const std::vector<char> &active,
                                 AinsworthSmall *Z)
{
  const PetscReal least = 1e-8; /* of a direction has to be outside of the others, as in orthonormalize() */
  PetscInt        n     = 0;

  PetscFunctionBegin;
  *Z = AinsworthSmall(Y.rows, Y.cols);
  for (PetscInt j = 0; j < Y.cols; j++) {
    if (j < (PetscInt)active.size() && !active[j]) continue;
    for (PetscInt i = nx; i < Y.rows; i++) (*Z)(i, n) = Y(i, j);
    n++;
  }
  Z->cols = n;
  Z->a.resize((size_t)n * Z->rows);
  for (int k = 0; k < 3; k++) {
    AinsworthSmall T;
    PetscReal      smallest;

    if (k) {
      const AinsworthSmall part = AinsworthSmallProduct(Y, AinsworthSmallAdjointProduct(Y, *Z));

      for (size_t i = 0; i < part.a.size(); i++) Z->a[i] -= part.a[i];
    }
    PetscCall(AinsworthSmallOrthonormalize(comm, AinsworthSmallAdjointProduct(*Z, *Z), {}, least, &T, &smallest));
    *Z = AinsworthSmallProduct(*Z, T);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthBasis::rayleighRitz(const std::vector<char> &active)
{
  static const PetscReal massless = 100 * PETSC_MACHINE_EPSILON, /* rounding of the mass of other vectors */
    negative                      = -1e-8;                       /* no rounding any more */
  AinsworthSmall         G, Y, Z, all;
  std::vector<PetscReal> nu;
  const PetscInt         n = end, before = nx;

  PetscFunctionBegin;
  PetscCall(gram(MS, 0, n, &G));
  PetscCall(AinsworthSmallEigen(comm, &G, &nu));
  nx = PetscMin(block, n);
  Y  = AinsworthSmall(n, nx);
  mu.resize(nx);
  const PetscReal zero = massless * PetscMax(PetscAbsReal(nu[0]), PetscAbsReal(nu[n - 1]));
  PetscCheck(indefinite || nu[0] >= negative * nu[n - 1], comm, PETSC_ERR_ARG_OUTOFRANGE,
             "M has a negative eigenvalue, %g of the largest one, where the constraints are met. For a buckling load "
             "pass minus the geometric stiffness first and K second, and use -eps_largest_real",
             (double)(nu[0] / nu[n - 1]));
  for (PetscInt j = 0; j < nx; j++) {
    const PetscReal value = nu[n - 1 - j];

    mu[j] = (indefinite ? PetscAbsReal(value) : value) > zero ? 1.0 / value : PETSC_MAX_REAL;
    for (PetscInt i = 0; i < n; i++) Y(i, j) = G(i, n - 1 - j);
  }
  PetscCall(Directions(comm, Y, before, active, &Z));
  np  = before ? Z.cols : 0;
  all = AinsworthSmall(n, nx + np);
  for (PetscInt j = 0; j < nx + np; j++)
    for (PetscInt i = 0; i < n; i++) all(i, j) = j < nx ? Y(i, j) : Z(i, j - nx);
  PetscCall(transform(n, 0, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x' (K + sigma M) x is 1 before, and x' M x is 1 / mu */
PetscErrorCode AinsworthBasis::changeShift(PetscReal before, PetscReal sigma)
{
  AinsworthSmall scale(nx, nx);

  PetscFunctionBegin;
  PetscCall(BVSetActiveColumns(KS, 0, nx));
  PetscCall(BVSetActiveColumns(MS, 0, nx));
  PetscCall(BVMult(KS, sigma - before, 1.0, MS, NULL));
  for (PetscInt j = 0; j < nx; j++) {
    scale(j, j) = 1.0 / std::sqrt(1.0 + (sigma - before) / mu[j]);
    mu[j] += sigma - before;
  }
  PetscCall(transform(nx, 0, scale));
  np = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthBasis::refresh(PetscInt j)
{
  Vec         x, product;
  PetscScalar energy[2];

  PetscFunctionBegin;
  PetscCall(BVGetColumn(S, j, &x));
  for (int k = 0; k < 2; k++) {
    BV V = k ? MS : KS;

    PetscCall(BVGetColumn(V, j, &product));
    if (k) PetscCall(pencil->multMass(x, product));
    else PetscCall(pencil->multShifted(x, product));
    PetscCall(VecDot(product, x, &energy[k]));
    PetscCall(BVRestoreColumn(V, j, &product));
  }
  PetscCall(BVRestoreColumn(S, j, &x));
  mu[j] = PetscRealPart(energy[0]) / PetscRealPart(energy[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthBasis::residual(PetscInt j, Vec r) const
{
  Vec v;

  PetscFunctionBegin;
  PetscCall(BVGetColumn(MS, j, &v));
  PetscCall(VecCopy(v, r));
  PetscCall(BVRestoreColumn(MS, j, &v));
  PetscCall(BVGetColumn(KS, j, &v));
  PetscCall(VecAYPX(r, -mu[j], v));
  PetscCall(BVRestoreColumn(KS, j, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthBasis::get(PetscInt j, Vec v) const
{
  PetscFunctionBegin;
  PetscCall(BVCopyVec(S, j, v));
  PetscFunctionReturn(PETSC_SUCCESS);
}
