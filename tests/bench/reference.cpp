/* The exact solution of a saddle-point system: direct, with iterative refinement in extended precision */
#include "reference.h"
#include "forms.h"
#include <complex>
#include <type_traits>
#include <vector>

/* A solution as the unevaluated sum of two vectors */
struct Refined {
  Vec high, low;
};

using Extended = std::conditional<std::is_same<PetscScalar, PetscReal>::value, long double,
                                  std::complex<long double>>::type;

/* r = b - K (high + low), each entry summed in extended precision; whole has room for a vector on every rank */
static PetscErrorCode Residual(Mat K, Vec b, const Refined &y, VecScatter toAll, const Refined &whole, Vec r)
{
  const PetscScalar *high, *low, *rhs;
  PetscScalar       *out;
  PetscInt           start, end;

  PetscFunctionBeginUser;
  for (int part = 0; part < 2; part++) {
    PetscCall(
      VecScatterBegin(toAll, part ? y.low : y.high, part ? whole.low : whole.high, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(
      VecScatterEnd(toAll, part ? y.low : y.high, part ? whole.low : whole.high, INSERT_VALUES, SCATTER_FORWARD));
  }
  PetscCall(VecGetArrayRead(whole.high, &high));
  PetscCall(VecGetArrayRead(whole.low, &low));
  PetscCall(VecGetArrayRead(b, &rhs));
  PetscCall(VecGetArrayWrite(r, &out));
  PetscCall(MatGetOwnershipRange(K, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    const PetscInt    *columns;
    const PetscScalar *values;
    PetscInt           count;
    Extended           sum = rhs[i - start];

    PetscCall(MatGetRow(K, i, &count, &columns, &values));
    for (PetscInt k = 0; k < count; k++)
      sum -= (Extended)values[k] * ((Extended)high[columns[k]] + (Extended)low[columns[k]]);
    PetscCall(MatRestoreRow(K, i, &count, &columns, &values));
    out[i - start] = (PetscScalar)sum;
  }
  PetscCall(VecRestoreArrayWrite(r, &out));
  PetscCall(VecRestoreArrayRead(b, &rhs));
  PetscCall(VecRestoreArrayRead(whole.low, &low));
  PetscCall(VecRestoreArrayRead(whole.high, &high));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* high + low += step, without loss */
static PetscErrorCode Add(const Refined &y, Vec step)
{
  PetscScalar *high, *low, *add;
  PetscInt     n;

  PetscFunctionBeginUser;
  PetscCall(VecGetLocalSize(step, &n));
  PetscCall(VecGetArray(y.high, &high));
  PetscCall(VecGetArray(y.low, &low));
  PetscCall(VecGetArray(step, &add));
  for (PetscInt i = 0; i < n; i++) {
    const Extended sum = (Extended)high[i] + (Extended)low[i] + (Extended)add[i];

    high[i] = (PetscScalar)sum;
    low[i]  = (PetscScalar)(sum - (Extended)high[i]);
  }
  PetscCall(VecRestoreArray(step, &add));
  PetscCall(VecRestoreArray(y.low, &low));
  PetscCall(VecRestoreArray(y.high, &high));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateSolver(Mat K, bool symmetric, KSP *ksp)
{
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)K), ksp));
  PetscCall(KSPSetOptionsPrefix(*ksp, "reference_"));
  PetscCall(KSPSetOperators(*ksp, K, K));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPSetErrorIfNotConverged(*ksp, PETSC_TRUE));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, symmetric ? PCCHOLESKY : PCLU));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReferenceCompute(const SaddleBlocks &s, Vec f, Vec g, Vec x, Vec lambda)
{
  const int  most = 12;
  Form       form;
  KSP        ksp;
  Refined    y, whole;
  Vec        r, step;
  VecScatter toAll;
  PetscReal  change = PETSC_MAX_REAL, last, size;

  PetscFunctionBeginUser;
  PetscCall(FormCreate(s, f, g, FORM_AIJ, 0.0, &form));
  PetscCall(CreateSolver(form.K, !s.B, &ksp));
  for (Vec *v : {&y.high, &y.low, &r, &step}) {
    PetscCall(VecDuplicate(form.y, v));
    PetscCall(VecSet(*v, 0.0));
  }
  PetscCall(VecScatterCreateToAll(y.high, &toAll, &whole.high));
  PetscCall(VecDuplicate(whole.high, &whole.low));
  for (int i = 0; i < most; i++) {
    last = change;
    PetscCall(Residual(form.K, form.rhs, y, toAll, whole, r));
    PetscCall(KSPSolve(ksp, r, step));
    PetscCall(Add(y, step));
    PetscCall(VecNorm(step, NORM_2, &change));
    PetscCall(VecNorm(y.high, NORM_2, &size));
    if (change <= PETSC_MACHINE_EPSILON * size || change > last / 2) break;
  }
  PetscCheck(PetscMin(change, last) <= 1e-13 * size, PetscObjectComm((PetscObject)s.A), PETSC_ERR_NOT_CONVERGED,
             "The reference solution is not exact: the last correction is %g of it", (double)(change / size));
  PetscCall(VecCopy(y.high, form.y));
  PetscCall(FormGetSolution(form, x, lambda));
  for (Vec *v : {&y.high, &y.low, &whole.high, &whole.low, &r, &step}) PetscCall(VecDestroy(v));
  PetscCall(VecScatterDestroy(&toAll));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(FormDestroy(&form));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Without the companion file .info: the block size in it, of the last vector, would become that of A, whose layout x
   shares
*/
static PetscErrorCode Open(MPI_Comm comm, const char file[], PetscFileMode mode, PetscViewer *viewer)
{
  PetscFunctionBeginUser;
  PetscCall(PetscViewerCreate(comm, viewer));
  PetscCall(PetscViewerSetType(*viewer, PETSCVIEWERBINARY));
  PetscCall(PetscViewerBinarySetSkipInfo(*viewer, PETSC_TRUE));
  PetscCall(PetscViewerFileSetMode(*viewer, mode));
  PetscCall(PetscViewerFileSetName(*viewer, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReferenceSave(const char file[], Vec x, Vec lambda)
{
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(Open(PetscObjectComm((PetscObject)x), file, FILE_MODE_WRITE, &viewer));
  PetscCall(VecView(x, viewer));
  PetscCall(VecView(lambda, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReferenceLoad(const char file[], Vec x, Vec lambda)
{
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(Open(PetscObjectComm((PetscObject)x), file, FILE_MODE_READ, &viewer));
  PetscCall(VecLoad(x, viewer));
  PetscCall(VecLoad(lambda, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
