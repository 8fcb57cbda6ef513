#include "run.h"

PetscErrorCode SystemFromDense(const DenseSystem &d, bool crossed, System *sys)
{
  const PetscInt n = (PetscInt)d.A.rows(), m = (PetscInt)d.C.rows();
  PetscInt       ln = PETSC_DECIDE, lm = PETSC_DECIDE, start, end;
  PetscMPIInt    rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  if (crossed) {
    ln = rank ? 0 : n;
    lm = rank < size - 1 ? 0 : m;
  }
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, ln, ln, n, n, n, NULL, n, NULL, &sys->A));
  PetscCall(MatGetLocalSize(sys->A, &ln, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, lm, ln, m, n, n, NULL, n, NULL, &sys->C));
  for (Mat M : {sys->A, sys->C}) {
    const Dense &values = M == sys->A ? d.A : d.C;

    PetscCall(MatGetOwnershipRange(M, &start, &end));
    for (PetscInt i = start; i < end; i++)
      for (PetscInt j = 0; j < n; j++)
        if (values(i, j) != 0.0 || (M == sys->A && i == j))
          PetscCall(MatSetValue(M, i, j, values(i, j), INSERT_VALUES));
    PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(MatCreateVecs(sys->C, &sys->f, &sys->g));
  PetscCall(Scatter(d.f, sys->f));
  PetscCall(Scatter(d.g, sys->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RunCreate(const DenseSystem &d, bool crossed, Run *run)
{
  PetscFunctionBeginUser;
  PetscCall(SystemFromDense(d, crossed, &run->sys));
  PetscCall(NestCreate(run->sys.A, NULL, run->sys.C, NULL, false, &run->nest));
  PetscCall(SolverCreate(run->nest, &run->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RunCreateWhole(const DenseSystem &d, Run *run)
{
  Mat Ct;

  PetscFunctionBeginUser;
  PetscCall(SystemFromDense(d, false, &run->sys));
  PetscCall(MatCreateHermitianTranspose(run->sys.C, &Ct));
  PetscCall(NestCreate(run->sys.A, Ct, run->sys.C, NULL, false, &run->nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(SolverCreate(run->nest, &run->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RunSolve(Run *run)
{
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(SolveFields(run->ksp, run->sys, false, false, run->x, run->lambda));
  PetscCall(KSPGetConvergedReason(run->ksp, &run->reason));
  PetscCall(KSPGetPC(run->ksp, &pc));
  PetscCall(PCGetFailedReason(pc, &run->failure));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RunDestroy(Run *run)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&run->ksp));
  PetscCall(MatDestroy(&run->nest));
  PetscCall(SystemDestroy(&run->sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckFailed(const Run &run)
{
  PetscFunctionBeginUser;
  PetscCall(CheckInt("reason", run.reason, KSP_DIVERGED_PC_FAILED));
  PetscCall(CheckTrue("the PC says that it failed", run.failure != PC_NOERROR));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckResiduals(const Run &run, const DenseSystem &d, PetscReal primal, PetscReal constraint)
{
  const Column force = d.C.adjoint() * run.lambda;
  PetscReal    worst = 0.0;

  PetscFunctionBeginUser;
  for (Eigen::Index i = 0; i < d.C.rows(); i++)
    worst = PetscMax(worst, PetscAbsScalar((d.C.row(i) * run.x)[0] - d.g[i]) /
                              (d.C.row(i).norm() * run.x.norm() + PetscAbsScalar(d.g[i])));
  PetscCall(Check("C x - g", worst, constraint));
  PetscCall(Check("A x + C' lambda - f", (d.A * run.x + force - d.f).norm(),
                  primal * (d.A.norm() * run.x.norm() + force.norm() + d.f.norm())));
  PetscFunctionReturn(PETSC_SUCCESS);
}

DenseSystem SpringsCreate(PetscInt n, PetscInt m, PetscReal stiffness, PetscInt seed)
{
  DenseSystem d;

  d.A = Dense::Zero(n, n);
  d.C = Dense::Zero(m, n);
  d.f.resize(n);
  d.g.resize(m);
  for (PetscInt i = 0; i < n; i++) {
    d.A(i, i) = 3.0 * stiffness;
    if (i) d.A(i, i - 1) = d.A(i - 1, i) = -stiffness;
    d.f[i] = stiffness * Uniform(seed, i, 0);
  }
  for (PetscInt i = 0; i < m; i++) {
    d.C(i, i)     = 1.0 + 0.1 * Uniform(seed, i, 1);
    d.C(i, n / 2) = -1.0;
    d.g[i]        = Uniform(seed, i, 2);
  }
  return d;
}

PetscErrorCode WriteDense(const Dense &values, Mat M)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(M, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < values.cols(); j++)
      if (values(i, j) != 0.0) PetscCall(MatSetValue(M, i, j, values(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckSolved(Run *run, const DenseSystem &d)
{
  PetscFunctionBeginUser;
  PetscCall(RunSolve(run));
  PetscCall(CheckTrue(KSPConvergedReasons[run->reason], run->reason > 0));
  PetscCall(CheckResiduals(*run, d, 1e-7, 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}
