/*
   A package for factorizations of sparse matrices that are nearly full, as the coarsest level often is: LAPACK's dense
   L D L^T, or L U of complex ones
*/
#include "blocksa.h"
#include "../base/guard.h"
#include "../base/loops.h"
#include <petsc/private/matimpl.h>
#include <petscblaslapack.h>
#include <vector>

namespace
{
struct DenseFactor {
  PetscBLASInt              n = 0;
  std::vector<PetscScalar>  values; /* by columns */
  std::vector<PetscBLASInt> pivots;
};
} // namespace

/* Factors dense->values, or with length -1 finds the length of work */
static PetscErrorCode Factor(DenseFactor *dense, PetscScalar *work, PetscBLASInt length, PetscBLASInt *info)
{
  PetscFunctionBegin;
#if defined(PETSC_USE_COMPLEX)
  *work = 0.0;
  if (length < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallBLAS("LAPACKgetrf",
                LAPACKgetrf_(&dense->n, &dense->n, dense->values.data(), &dense->n, dense->pivots.data(), info));
#else
  PetscCallBLAS("LAPACKsytrf", LAPACKsytrf_("L", &dense->n, dense->values.data(), &dense->n, dense->pivots.data(), work,
                                            &length, info));
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FactorMatrix(Mat F, Mat A)
{
  DenseFactor             *dense;
  PetscBLASInt             info;
  PetscScalar              length;
  std::vector<PetscScalar> work;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(F, &dense));
  PetscCall(PetscBLASIntCast(A->rmap->n, &dense->n));
  dense->values.assign((size_t)dense->n * dense->n, 0.0);
  dense->pivots.resize(dense->n);
  PetscCall(AinsworthForRows(A, [&](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n; k++) dense->values[(size_t)row.j[k] * dense->n + row.number] = row.a[k];
  }));
  PetscCall(Factor(dense, &length, -1, &info));
  work.resize((size_t)PetscRealPart(length) + 1);
  PetscCall(Factor(dense, work.data(), (PetscBLASInt)work.size(), &info));
  F->factorerrortype = info ? MAT_FACTOR_NUMERIC_ZEROPIVOT : MAT_FACTOR_NOERROR; /* also for NaN */
  F->assembled       = PETSC_TRUE;
  PetscCall(PetscLogFlops(1.0 / 3.0 * dense->n * dense->n * dense->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Numeric(Mat F, Mat A, const MatFactorInfo *)
{
  PetscFunctionBegin;
  PetscCall(AinsworthGuarded<FactorMatrix>(F, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The work is done by Numeric() */
static PetscErrorCode Symbolic(Mat F, Mat, IS, const MatFactorInfo *)
{
  PetscFunctionBegin;
  F->ops->choleskyfactornumeric = Numeric;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SymbolicLU(Mat F, Mat, IS, IS, const MatFactorInfo *)
{
  PetscFunctionBegin;
  F->ops->lufactornumeric = Numeric;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SolveWith(Mat F, const char transpose[], Vec b, Vec x)
{
  DenseFactor *dense;
  PetscScalar *values;
  PetscBLASInt one = 1, info;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(F, &dense));
  PetscCall(VecCopy(b, x));
  PetscCall(VecGetArray(x, &values));
#if defined(PETSC_USE_COMPLEX)
  PetscCallBLAS("LAPACKgetrs", LAPACKgetrs_(transpose, &dense->n, &one, dense->values.data(), &dense->n,
                                            dense->pivots.data(), values, &dense->n, &info));
#else
  (void)transpose; /* the matrix is symmetric */
  PetscCallBLAS("LAPACKsytrs", LAPACKsytrs_("L", &dense->n, &one, dense->values.data(), &dense->n, dense->pivots.data(),
                                            values, &dense->n, &info));
#endif
  PetscCall(VecRestoreArray(x, &values));
  PetscCall(PetscLogFlops(2.0 * dense->n * dense->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(Mat F, Vec b, Vec x)
{
  PetscFunctionBegin;
  PetscCall(SolveWith(F, "N", b, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SolveTranspose(Mat F, Vec b, Vec x)
{
  PetscFunctionBegin;
  PetscCall(SolveWith(F, "T", b, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(Mat F)
{
  DenseFactor *dense;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(F, &dense));
  delete dense;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetInfo(Mat F, MatInfoType, MatInfo *info)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(info, sizeof(*info)));
  info->block_size = 1.0;
  info->nz_used = info->nz_allocated = (PetscLogDouble)F->rmap->n * (PetscLogDouble)F->rmap->n;
  info->memory                       = info->nz_used * (PetscLogDouble)sizeof(PetscScalar);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetType(Mat, MatSolverType *type)
{
  PetscFunctionBegin;
  *type = AinsworthDense;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the factor of A, without values yet */
static PetscErrorCode GetFactor(Mat A, MatFactorType type, Mat *F)
{
  PetscFunctionBegin;
  PetscCall(MatCreateShell(PETSC_COMM_SELF, A->rmap->n, A->cmap->n, A->rmap->n, A->cmap->n, new DenseFactor, F));
  PetscCall(MatShellSetOperation(*F, MATOP_DESTROY, (void (*)(void))Destroy));
  PetscCall(MatSetUp(*F));
  (*F)->ops->choleskyfactorsymbolic = Symbolic;
  (*F)->ops->lufactorsymbolic       = SymbolicLU;
  (*F)->ops->solve                  = Solve;
  (*F)->ops->solvetranspose         = SolveTranspose;
  (*F)->ops->getinfo                = GetInfo;
  (*F)->factortype                  = type;
  (*F)->canuseordering              = PETSC_FALSE;
  PetscCall(PetscFree((*F)->solvertype));
  PetscCall(PetscStrallocpy(AinsworthDense, &(*F)->solvertype));
  PetscCall(PetscObjectComposeFunction((PetscObject)*F, "MatFactorGetSolverType_C", GetType));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthDenseFactorRegister - registers the package for what the coarsest level of PCBLOCKSA is factored with */
PetscErrorCode AinsworthDenseFactorRegister()
{
  PetscFunctionBegin;
  PetscCall(MatSolverTypeRegister(AinsworthDense, MATSEQAIJ,
                                  PetscDefined(USE_COMPLEX) ? MAT_FACTOR_LU : MAT_FACTOR_CHOLESKY,
                                  AinsworthGuarded<GetFactor>));
  PetscFunctionReturn(PETSC_SUCCESS);
}
