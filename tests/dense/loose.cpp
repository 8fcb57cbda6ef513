static char help[] = "PCAINSWORTH with loose inner tolerances, inside FGMRES, for many right-hand sides, and with zero rows of C.\n\n";

#include "layout.h"

/* C x = g to rounding whatever the inner tolerance, and FGMRES makes a solution of it; many right-hand sides at once */
static PetscErrorCode Loose(const Spec &spec)
{
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-2");
  System      sys;
  DenseSystem d;
  Mat         nest, X, Y;
  KSP         ksp, inner;
  PC          pc;
  Column      x, lambda;
  PetscInt    n, N;
  Dense       dense, columns;

  PetscFunctionBeginUser;
  Case("%s, inner tolerance 1e-2", spec.name);
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(LayoutCreate(sys, Layout(), &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(SolveFields(ksp, sys, false, false, x, lambda));
  PetscCall(Check("C x - g", (d.C * x - d.g).norm() / d.g.norm(), 1e-13));
  Case("%s, FGMRES around an inner tolerance of 1e-2", spec.name);
  PetscCall(KSPSetType(ksp, KSPFGMRES));
  PetscCall(KSPSetTolerances(ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(CheckSolution(ksp, sys, d, false, true, 1e-9));
  PetscCall(CheckSolution(ksp, sys, d, false, false, 1e-9));

  Case("%s, PCMatApply()", spec.name);
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPSetTolerances(inner, 1e-13, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(MatGetLocalSize(nest, &n, NULL));
  PetscCall(MatGetSize(nest, &N, NULL));
  PetscCall(MatCreateDense(PETSC_COMM_WORLD, n, PETSC_DECIDE, N, 3, NULL, &X));
  for (PetscInt j = 0; j < 3; j++) {
    Vec v;
    PetscCall(MatDenseGetColumnVecWrite(X, j, &v));
    PetscCall(SetRandom(v, 30 + j));
    PetscCall(MatDenseRestoreColumnVecWrite(X, j, &v));
  }
  PetscCall(MatDuplicate(X, MAT_DO_NOT_COPY_VALUES, &Y));
  PetscCall(PCMatApply(pc, X, Y));
  PetscCall(Gather(nest, dense));
  PetscCall(Gather(X, columns));
  const Dense expected = dense.fullPivLu().solve(columns);
  PetscCall(Gather(Y, columns));
  PetscCall(CheckEqual("three solutions", columns, expected, 1e-10));
  PetscCall(MatDestroy(&X));
  PetscCall(MatDestroy(&Y));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of C that are zero: lambda = 0 there, and no solution where g is not */
static PetscErrorCode ZeroRows(bool uneven)
{
  Options               options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  Spec                  spec;
  System                sys;
  DenseSystem           d, reduced;
  Mat                   nest;
  KSP                   ksp;
  PC                    pc;
  Column                x, lambda, expectedX, expectedLambda;
  KSPConvergedReason    reason;
  PCFailedReason        failure;
  std::vector<PetscInt> kept;

  PetscFunctionBeginUser;
  spec.zeroRows = true;
  spec.uneven   = uneven;
  Case("zero rows of C, uneven %d", uneven);
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (PetscInt i = 0; i < spec.m; i++)
    if (d.C.row(i).norm() > 0.0) kept.push_back(i);
    else d.g[i] = 0.0;
  PetscCall(CheckTrue("some rows are zero", (PetscInt)kept.size() < spec.m));
  reduced   = d;
  reduced.C = d.C(kept, Eigen::all);
  reduced.g = d.g(kept);
  PetscCall(LayoutCreate(sys, Layout(), &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(SolveFields(ksp, sys, false, false, x, lambda));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckInt("reason with g on a zero row", reason, KSP_DIVERGED_PC_FAILED));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetFailedReason(pc, &failure));
  PetscCall(CheckInt("failure with g on a zero row", failure, PC_INCONSISTENT_RHS));
  PetscCall(Scatter(d.g, sys.g));
  PetscCall(SolveFields(ksp, sys, false, true, x, lambda));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue("solved with g = 0 on the zero rows", reason > 0));
  SolveSaddle(reduced, expectedX, expectedLambda);
  PetscCall(CheckEqual("x", x, expectedX, 1e-10));
  PetscCall(CheckEqual("lambda", lambda(kept), expectedLambda, 1e-10));
  PetscCall(CheckTrue("lambda = 0 on the zero rows", lambda.norm() == lambda(kept).norm()));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (int k : {0, 4}) PetscCall(Loose(UsualSpecs()[k]));
  for (bool uneven : {false, true}) PetscCall(ZeroRows(uneven));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
