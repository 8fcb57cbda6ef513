#include "fewrows.h"
#include "kernels.h"
#include <algorithm>
#include <numeric>
#include <petscblaslapack.h>

/* A row is dependent if orthogonalization leaves at most this part of its length */
static const PetscReal dependent = 1e-8;

/* Computes y = C x or, if weighted, C W x; collective */
PetscErrorCode AinsworthFewRows::multiply(const PetscScalar *x, bool weighted, std::vector<PetscScalar> *y) const
{
  PetscFunctionBegin;
  y->assign(c.size(), 0.0);
  for (size_t k = 0; k < c.size(); k++)
    for (size_t l = 0; l < w.size(); l++) (*y)[k] += c[k][l] * x[l] * (weighted ? w[l] : 1.0);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, y->data(), (PetscMPIInt)y->size(), MPIU_SCALAR, MPIU_SUM, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Orthonormalizes the rows, given by their adjoints, in two passes, and drops dependent ones; collective */
PetscErrorCode AinsworthFewRows::create(const std::vector<Vec> &rows, const std::vector<PetscReal> &weight)
{
  PetscFunctionBegin;
  comm = PetscObjectComm((PetscObject)rows[0]);
  w    = weight;
  for (Vec row : rows) {
    const PetscScalar       *a;
    std::vector<PetscScalar> v(w.size()), h;
    PetscReal                length[2];

    PetscCall(VecGetArrayRead(row, &a));
    std::transform(a, a + w.size(), v.begin(), [](PetscScalar x) { return PetscConj(x); });
    PetscCall(VecRestoreArrayRead(row, &a));
    auto norm = [&](PetscReal *square) -> PetscErrorCode {
      PetscFunctionBegin;
      *square = 0.0;
      for (size_t l = 0; l < w.size(); l++) *square += PetscRealPart(v[l] * PetscConj(v[l])) * w[l];
      PetscCall(MPIU_Allreduce(MPI_IN_PLACE, square, 1, MPIU_REAL, MPIU_SUM, comm));
      PetscFunctionReturn(PETSC_SUCCESS);
    };
    PetscCall(norm(&length[0]));
    for (int pass = 0; pass < 2; pass++) {
      std::vector<PetscScalar> x(v.size());

      std::transform(v.begin(), v.end(), x.begin(), [](PetscScalar a) { return PetscConj(a); });
      PetscCall(multiply(x.data(), true, &h));
      for (size_t k = 0; k < c.size(); k++)
        for (size_t l = 0; l < w.size(); l++) v[l] -= PetscConj(h[k]) * c[k][l];
    }
    PetscCall(norm(&length[1]));
    if (!(length[1] > dependent * dependent * length[0])) continue;
    for (PetscScalar &x : v) x /= PetscSqrtReal(length[1]);
    c.push_back(std::move(v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces x by Q x or Q' x; collective */
PetscErrorCode AinsworthFewRows::project(bool adjoint, Vec x) const
{
  std::vector<PetscScalar> t;
  PetscScalar             *a;

  PetscFunctionBegin;
  PetscCall(VecGetArray(x, &a));
  PetscCall(multiply(a, adjoint, &t));
  for (size_t k = 0; k < c.size(); k++)
    for (size_t l = 0; l < w.size(); l++) a[l] -= (adjoint ? 1.0 : w[l]) * PetscConj(c[k][l]) * t[k];
  PetscCall(VecRestoreArray(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds C' C, which is about as stiff as W^{-1} and acts on what the rows exclude alone, to an AIJ matrix; collective */
PetscErrorCode AinsworthFewRows::addSquare(Mat A) const
{
  PetscInt              n = (PetscInt)w.size(), N, rstart, first = 0;
  PetscMPIInt           size, count = 0;
  std::vector<PetscInt> columns, own(n);

  PetscFunctionBegin;
  PetscCall(MatGetSize(A, &N, NULL));
  PetscCall(MatGetOwnershipRange(A, &rstart, NULL));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  std::vector<PetscMPIInt> counts(size), starts(size, 0);
  count = (PetscMPIInt)n;
  PetscCallMPI(MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, comm));
  std::partial_sum(counts.begin(), counts.end() - 1, starts.begin() + 1);
  std::iota(own.begin(), own.end(), rstart);
  PetscCall(MatSetOption(A, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatSetOption(A, MAT_NEW_NONZERO_LOCATIONS, PETSC_TRUE));
  for (const std::vector<PetscScalar> &row : c) {
    std::vector<PetscScalar> all(N), values;
    std::vector<PetscInt>    here, there;

    PetscCallMPI(
      MPI_Allgatherv(row.data(), count, MPIU_SCALAR, all.data(), counts.data(), starts.data(), MPIU_SCALAR, comm));
    for (first = 0; first < N; first++)
      if (all[first] != 0.0) there.push_back(first);
    for (PetscInt l = 0; l < n; l++)
      if (row[l] != 0.0) here.push_back(rstart + l);
    for (PetscInt i : here)
      for (PetscInt j : there) values.push_back(PetscConj(all[i]) * all[j]);
    PetscCall(MatSetValues(A, (PetscInt)here.size(), here.data(), (PetscInt)there.size(), there.data(), values.data(),
                           ADD_VALUES));
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthFewRowsSubspaceCreate - creates the kernel of the rows as a subspace of their level; collective */
PetscErrorCode AinsworthFewRowsSubspaceCreate(const std::shared_ptr<const AinsworthFewRows> &rows,
                                              std::shared_ptr<const AinsworthLevelSubspace> *subspace)
{
  auto space = std::make_shared<AinsworthSubspace>();
  Vec  values;

  PetscFunctionBegin;
  space->places.resize(rows->w.size());
  std::iota(space->places.begin(), space->places.end(), 0);
  space->weight = rows->w;
  PetscCall(VecCreateMPI(rows->comm, (PetscInt)rows->w.size(), PETSC_DETERMINE, &values));
  space->values = values;
  std::shared_ptr<std::remove_pointer<Vec>::type> owned(values, [](Vec v) { (void)VecDestroy(&v); });
  space->project = [rows, owned](bool adjoint, Vec x) { return rows->project(adjoint, x); };
  *subspace      = std::make_shared<AinsworthLevelSubspace>(space, std::vector<PetscInt>());
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* The solver of the coarsest level on the kernel of the rows: M^{-1} - Z (C Z)^{-1} Z' with Z = M^{-1} C' */
struct Bordered {
  std::shared_ptr<const AinsworthFewRows> rows;
  PC                                      inner = NULL; /* referenced by the wrapper */
  std::vector<Vec>                        lifted;       /* Z */
  std::vector<PetscScalar>                factor;       /* Cholesky factor of C Z */
};
} // namespace

static PetscErrorCode Apply(PC pc, Vec r, Vec z)
{
  Bordered                *data;
  std::vector<PetscScalar> t;
  const PetscScalar       *a;
  PetscBLASInt             n, one = 1, info;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &data));
  PetscCall(PCApply(data->inner, r, z));
  PetscCall(VecGetArrayRead(z, &a));
  PetscCall(data->rows->multiply(a, false, &t));
  PetscCall(VecRestoreArrayRead(z, &a));
  PetscCall(PetscBLASIntCast((PetscInt)t.size(), &n));
  PetscCallBLAS("LAPACKpotrs", LAPACKpotrs_("L", &n, &one, data->factor.data(), &n, t.data(), &n, &info));
  for (PetscScalar &v : t) v = -v;
  PetscCall(VecMAXPY(z, (PetscInt)t.size(), t.data(), data->lifted.data()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(PC pc)
{
  Bordered *data;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &data));
  for (Vec &v : data->lifted) PetscCall(VecDestroy(&v));
  delete data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFewRowsPCCreate - creates the solver on the kernel of the rows from one of M, set up and referenced; NULL if
   C M^{-1} C' cannot be factored. Collective
*/
PetscErrorCode AinsworthFewRowsPCCreate(const std::shared_ptr<const AinsworthFewRows> &rows, PC inner, PC *pc)
{
  auto         data = std::make_unique<Bordered>();
  const size_t n    = rows->c.size();
  Vec          row;
  PetscScalar *to;
  PetscBLASInt size, info;

  PetscFunctionBegin;
  data->rows  = rows;
  data->inner = inner;
  PetscCall(VecCreateMPI(rows->comm, (PetscInt)rows->w.size(), PETSC_DETERMINE, &row));
  for (const std::vector<PetscScalar> &c : rows->c) {
    std::vector<PetscScalar> products;
    const PetscScalar       *from;
    Vec                      z;

    PetscCall(VecDuplicate(row, &z));
    data->lifted.push_back(z);
    PetscCall(VecGetArrayWrite(row, &to));
    std::transform(c.begin(), c.end(), to, [](PetscScalar v) { return PetscConj(v); });
    PetscCall(VecRestoreArrayWrite(row, &to));
    PetscCall(PCApply(inner, row, z));
    PetscCall(VecGetArrayRead(z, &from));
    PetscCall(rows->multiply(from, false, &products));
    PetscCall(VecRestoreArrayRead(z, &from));
    data->factor.insert(data->factor.end(), products.begin(), products.end());
  }
  PetscCall(VecDestroy(&row));
  PetscCall(PetscBLASIntCast((PetscInt)n, &size));
  PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &size, data->factor.data(), &size, &info));
  *pc = NULL;
  if (info) {
    for (Vec &v : data->lifted) PetscCall(VecDestroy(&v));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSubspacePCWrap(inner, "on the kernel of few rows", pc));
  PetscCall(PCShellSetContext(*pc, data.release()));
  PetscCall(PCShellSetApply(*pc, Apply));
  PetscCall(PCShellSetDestroy(*pc, Destroy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
