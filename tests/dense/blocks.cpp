#include "blocks.h"
#include <cmath>
#include <cstring>

PetscScalar Entry(PetscInt seed, PetscInt i, PetscInt j)
{
#if defined(PETSC_USE_COMPLEX)
  return PetscCMPLX(Uniform(seed, i, j), Uniform(seed + 50, i, j));
#else
  return Uniform(seed, i, j);
#endif
}

/* Entries in few places, the same pattern in both triangles */
static Dense Sparse(PetscInt seed, PetscInt m, PetscInt n, PetscReal share)
{
  Dense M = Dense::Zero(m, n);

  for (PetscInt i = 0; i < m; i++)
    for (PetscInt j = 0; j < n; j++)
      if (Uniform(seed + 7, PetscMin(i, j), PetscMax(i, j)) < 2.0 * share - 1.0) M(i, j) = Entry(seed, i, j);
  return M;
}

Blocks Draw(const Kind &kind, PetscInt seed)
{
  const PetscInt n = 40, m = 14;
  Blocks         b;

  b.A = Sparse(seed, n, n, 0.1);
  if (kind.symmetric) b.A = Dense(b.A + b.A.adjoint());
  for (PetscInt i = 0; i < n; i++) b.A(i, i) = kind.definite ? 10.0 : 3.0 * Uniform(seed + 1, i, i);
  for (PetscInt i = 0; i + 1 < n && !kind.diagonal; i += 3) {
    b.A(i, i)     = 0.0;
    b.A(i, i + 1) = b.A(i + 1, i) = 3.0; /* the system stays regular */
  }
  b.C = Sparse(seed + 2, m, n, 0.1);
  for (PetscInt i = 0; i < m; i++) b.C(i, 2 * i + 1) = 2.0;
  b.B = b.C;
  if (!kind.symmetric) b.B += 0.3 * Sparse(seed + 3, m, n, 0.1);
  b.D = Dense::Zero(m, m);
  if (kind.compliance == COUPLED) b.D = Sparse(seed + 4, m, m, 0.2);
  if (kind.symmetric) b.D = Dense(b.D + b.D.adjoint());
  for (PetscInt i = 0; i < m && kind.compliance != NO_D; i++)
    b.D(i, i) = i % 4 == 1 ? 0.0 : 1.0 + Uniform(seed + 5, i, i);
  if (kind.decades > 0.0) {
    Column x(n), l(m);

    for (PetscInt i = 0; i < n; i++) x[i] = PetscPowReal(10.0, kind.decades * Uniform(seed + 8, i, 0));
    for (PetscInt i = 0; i < m; i++) l[i] = PetscPowReal(10.0, kind.decades * Uniform(seed + 9, i, 0));
    b.A = x.asDiagonal() * b.A * x.asDiagonal();
    b.B = l.asDiagonal() * b.B * x.asDiagonal();
    b.C = l.asDiagonal() * b.C * x.asDiagonal();
    b.D = l.asDiagonal() * b.D * l.asDiagonal();
  }
  return b;
}

Column Equilibrate(const Dense &K)
{
  Column s = Column::Ones(K.rows());

  for (int step = 0; step < 40; step++) {
    const Dense scaled = s.asDiagonal() * K * s.asDiagonal();

    for (Eigen::Index i = 0; i < s.size(); i++) {
      const PetscReal largest = PetscMax(scaled.row(i).cwiseAbs().maxCoeff(), scaled.col(i).cwiseAbs().maxCoeff());
      if (largest > 0.0) s[i] *= 1.0 / std::sqrt(largest);
    }
  }
  for (PetscScalar &v : s) v = std::exp2(std::round(std::log2(PetscRealPart(v))));
  return s;
}

/* Stores nonzero entries only */
static PetscErrorCode Store(const Dense &d, PetscInt m, PetscInt n, const char type[], Mat *M)
{
  PetscInt start, end;
  Mat      aij;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, n, (PetscInt)d.rows(), (PetscInt)d.cols(), (PetscInt)d.cols(), NULL,
                         (PetscInt)d.cols(), NULL, &aij));
  PetscCall(MatGetOwnershipRange(aij, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < d.cols(); j++)
      if (d(i, j) != 0.0) PetscCall(MatSetValue(aij, i, j, d(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(aij, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(aij, MAT_FINAL_ASSEMBLY));
  if (!strcmp(type, MATAIJ)) *M = aij;
  else {
    if (!strcmp(type, MATSBAIJ)) PetscCall(MatSetOption(aij, MAT_SYMMETRIC, PETSC_TRUE));
    PetscCall(MatConvert(aij, type, MAT_INITIAL_MATRIX, M));
    PetscCall(MatDestroy(&aij));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SaddleCreate(const Blocks &b, const Kind &kind, AinsworthSaddle *sp)
{
  PetscMPIInt rank, size;
  PetscInt    n = PETSC_DECIDE, m = PETSC_DECIDE, N = b.n(), M = b.m();

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(PetscSplitOwnership(PETSC_COMM_WORLD, &n, &N));
  PetscCall(PetscSplitOwnership(PETSC_COMM_WORLD, &m, &M));
  if (kind.uneven) {
    n = rank == 0 ? N : 0;
    m = rank == size - 1 ? M : 0;
  }
  *sp = AinsworthSaddle();
  PetscCall(Store(b.A, n, n, kind.type, sp->A.out()));
  PetscCall(Store(b.C, m, n, MATAIJ, sp->kept.C.out()));
  if (kind.symmetric) sp->kept.B = sp->kept.C;
  else PetscCall(Store(b.B, m, n, MATAIJ, sp->kept.B.out()));
  if (kind.compliance != NO_D) PetscCall(Store(b.D, m, m, MATAIJ, sp->kept.D.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode VecsCreate(const AinsworthSaddle &sp, const Column &values, AinsworthSaddleVec *v)
{
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(sp.kept.C, &v->primal, &v->dual));
  PetscCall(VecGetSize(v->primal, &n));
  PetscCall(Scatter(values.head(n), v->primal));
  PetscCall(Scatter(values.tail(values.size() - n), v->dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GatherBoth(AinsworthSaddleVec v, Column &values)
{
  Column x, l;

  PetscFunctionBeginUser;
  PetscCall(Gather(v.primal, x));
  PetscCall(Gather(v.dual, l));
  values.resize(x.size() + l.size());
  values << x, l;
  PetscFunctionReturn(PETSC_SUCCESS);
}
