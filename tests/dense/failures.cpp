static char help[] = "Failures of PCAINSWORTH: a reason on all ranks, an error where that is asked for, and a solver that can be used again.\n\n";

#include "dense.h"

static PetscErrorCode CheckReason(KSP ksp, KSPConvergedReason expected, PCFailedReason failure)
{
  PC                 pc;
  KSPConvergedReason reason;
  PCFailedReason     got;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckInt("reason", reason, expected));
  PetscCall(PCGetFailedReason(pc, &got));
  PetscCall(CheckInt("failure of the PC", got, failure));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The present system, with whatever ksp is set to */
static PetscErrorCode SolveWell(KSP ksp, Vec b, Vec y, PetscReal tolerance)
{
  KSPConvergedReason reason;
  Column             x, whole;
  Mat                nest;
  Dense              K;

  PetscFunctionBeginUser;
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(KSPGetOperators(ksp, &nest, NULL));
  PetscCall(Gather(nest, K));
  PetscCall(Gather(y, x));
  PetscCall(Gather(b, whole));
  PetscCall(CheckEqual("solution", x, K.fullPivLu().solve(whole), tolerance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Create(const Spec &spec, System *sys, Mat *nest, Vec *b, Vec *y)
{
  Mat Ct;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, sys));
  PetscCall(MatCreateHermitianTranspose(sys->C, &Ct));
  PetscCall(NestCreate(sys->A, Ct, sys->C, NULL, false, nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatCreateVecs(*nest, y, b));
  PetscCall(SetRandom(*b, 90));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(System *sys, Mat *nest, Vec *b, Vec *y)
{
  PetscFunctionBeginUser;
  PetscCall(MatDestroy(nest));
  PetscCall(VecDestroy(b));
  PetscCall(VecDestroy(y));
  PetscCall(SystemDestroy(sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The inner solver stops before it has converged */
static PetscErrorCode InnerLimit(bool uneven)
{
  Options options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -ainsworth_ksp_max_it 1");
  Spec    spec;
  System  sys;
  Mat     nest;
  Vec     b, y;
  KSP     ksp, inner;
  PC      pc;

  PetscFunctionBeginUser;
  spec.uneven = uneven;
  Case("inner limit of one iteration, uneven %d", uneven);
  PetscCall(Create(spec, &sys, &nest, &b, &y));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(CheckReason(ksp, KSP_DIVERGED_PC_FAILED, PC_SUBPC_ERROR));
  PetscCall(KSPSolve(ksp, b, y)); /* no success by forgetting */
  PetscCall(CheckReason(ksp, KSP_DIVERGED_PC_FAILED, PC_SUBPC_ERROR));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPSetTolerances(inner, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, 1000));
  PetscCall(SolveWell(ksp, b, y, 1e-9));

  Case("FGMRES around an inner limit, uneven %d", uneven);
  PetscCall(KSPSetTolerances(inner, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, 4));
  PetscCall(KSPSetType(ksp, KSPFGMRES));
  PetscCall(KSPSetTolerances(ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, 200));
  PetscCall(SolveWell(ksp, b, y, 1e-8));

  Case("errors asked for, uneven %d", uneven);
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(PCAinsworthSetPmatType(pc, PC_AINSWORTH_PMAT_ID)); /* set up again, with errors */
  PetscCall(CheckError("solve", [=]() { return KSPSolve(ksp, b, y); }, PETSC_ERR_NOT_CONVERGED, {"not converge"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(Destroy(&sys, &nest, &b, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two rows of C are the same: no Cholesky factors of the Gram matrix */
static PetscErrorCode Dependent(bool uneven)
{
  Options  options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -pc_ainsworth_weight identity");
  Spec     spec;
  System   sys;
  Mat      nest;
  Vec      b, y;
  KSP      ksp;
  PetscInt start, end, twin[2] = {0, 1};

  PetscFunctionBeginUser;
  spec.uneven = uneven;
  Case("dependent rows, uneven %d", uneven);
  PetscCall(Create(spec, &sys, &nest, &b, &y));
  PetscCall(MatGetOwnershipRange(sys.C, &start, &end));
  PetscCall(MatZeroRows(sys.C, start == 0 && end > 0 ? 1 : 0, &twin[0], 0.0, NULL, NULL));
  PetscCall(MatZeroRows(sys.C, start <= 1 && end > 1 ? 1 : 0, &twin[1], 0.0, NULL, NULL));
  PetscCall(MatSetOption(sys.C, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  for (PetscInt i : twin) {
    if (i < start || i >= end) continue;
    PetscCall(MatSetValue(sys.C, i, 3, 1.0, INSERT_VALUES));
    PetscCall(MatSetValue(sys.C, i, spec.n - 1, 1.0, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(sys.C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(sys.C, MAT_FINAL_ASSEMBLY));
  PetscCall(SolverCreate(nest, &ksp));
  for (int repeat = 0; repeat < 2; repeat++) {
    PetscCall(KSPSolve(ksp, b, y));
    PetscCall(CheckReason(ksp, KSP_DIVERGED_PC_FAILED, PC_FACTOR_NUMERIC_ZEROPIVOT));
  }
  if (1 >= start && 1 < end) PetscCall(MatSetValue(sys.C, 1, 3, 2.0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(sys.C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(sys.C, MAT_FINAL_ASSEMBLY));
  Case("after the repair of dependent rows, uneven %d", uneven);
  PetscCall(SolveWell(ksp, b, y, 1e-9));
  if (1 >= start && 1 < end) PetscCall(MatSetValue(sys.C, 1, 3, 1.0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(sys.C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(sys.C, MAT_FINAL_ASSEMBLY));
  Case("dependent rows again, with errors, uneven %d", uneven);
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(CheckReason(ksp, KSP_DIVERGED_PC_FAILED, PC_FACTOR_NUMERIC_ZEROPIVOT));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(CheckError("solve after a failure", [=]() { return KSPSolve(ksp, b, y); }, PETSC_ERR_NOT_CONVERGED, {"FACTOR_NUMERIC_ZEROPIVOT"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(CheckError("solve", [=]() { return KSPSolve(ksp, b, y); }, PETSC_ERR_MAT_CH_ZRPVT, {"Gram matrix C W C'", "linearly dependent"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(Destroy(&sys, &nest, &b, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* g is not zero where the row of C is, with errors asked for (without: solve.cpp) */
static PetscErrorCode Inconsistent()
{
  Options options("-ainsworth_pc_type jacobi -ksp_error_if_not_converged");
  Spec    spec;
  System  sys;
  Mat     nest;
  Vec     b, y;
  KSP     ksp;

  PetscFunctionBeginUser;
  spec.zeroRows = true;
  Case("right-hand side on a zero row, with errors");
  PetscCall(Create(spec, &sys, &nest, &b, &y));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(CheckError("solve", [=]() { return KSPSolve(ksp, b, y); }, PETSC_ERR_ARG_INCOMP, {"nonzero on a row of C that is zero", "no solution exists"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(Destroy(&sys, &nest, &b, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A, or the preconditioner, that is not what the inner method needs; a not-a-number on the right-hand side */
static PetscErrorCode Indefinite()
{
  Options options("-ainsworth_pc_type jacobi");
  Spec    spec;
  System  sys;
  Mat     nest;
  Vec     b, y;
  KSP     ksp;

  PetscFunctionBeginUser;
  PetscCall(Create(spec, &sys, &nest, &b, &y));
  PetscCall(SolverCreate(nest, &ksp));
  Case("A negative definite");
  PetscCall(MatScale(sys.A, -1.0));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(CheckReason(ksp, KSP_DIVERGED_PC_FAILED, PC_SUBPC_ERROR));
  Case("A positive definite again");
  PetscCall(MatScale(sys.A, -1.0));
  PetscCall(SolveWell(ksp, b, y, 1e-6));
  Case("right-hand side with Inf");
  PetscCall(VecSetValue(b, 0, PETSC_INFINITY, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(b));
  PetscCall(VecAssemblyEnd(b));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(CheckReason(ksp, KSP_DIVERGED_PC_FAILED, PC_SUBPC_ERROR));
  Case("after a right-hand side with Inf");
  PetscCall(SetRandom(b, 91));
  PetscCall(SolveWell(ksp, b, y, 1e-6));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(Destroy(&sys, &nest, &b, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (bool uneven : {false, true}) PetscCall(InnerLimit(uneven));
  for (bool uneven : {false, true}) PetscCall(Dependent(uneven));
  PetscCall(Inconsistent());
  PetscCall(Indefinite());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
