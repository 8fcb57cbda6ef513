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
  Options another("-pc_ainsworth_pmat id");
  PetscCall(PCSetFromOptions(pc)); /* set up again, with errors */
  PetscCall(CheckError("solve", [=]() { return KSPSolve(ksp, b, y); }, PETSC_ERR_NOT_CONVERGED, {"ended without convergence (DIVERGED_ITS)"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(Destroy(&sys, &nest, &b, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A Gram matrix that cannot be factored, and not because rows depend on each other */
static PetscErrorCode Unfactored(bool uneven)
{
  Options options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -pc_ainsworth_weight identity");
  Spec    spec;
  System  sys;
  Mat     nest;
  Vec     b, y;
  KSP     ksp;

  PetscFunctionBeginUser;
  spec.uneven = uneven;
  Case("Gram matrix not factored, uneven %d", uneven);
  PetscCall(Create(spec, &sys, &nest, &b, &y));
  {
    Options large("-ainsworth_gram_pc_type lu -ainsworth_gram_pc_factor_zeropivot 1e30"); /* every pivot counts as zero */
    PetscCall(SolverCreate(nest, &ksp));
    for (int repeat = 0; repeat < 2; repeat++) {
      PetscCall(KSPSolve(ksp, b, y));
      PetscCall(CheckReason(ksp, KSP_DIVERGED_PC_FAILED, PC_FACTOR_NUMERIC_ZEROPIVOT));
    }
    PetscCall(KSPDestroy(&ksp));
    PetscCall(SolverCreate(nest, &ksp));
    PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
    PetscCall(CheckError("solve", [=]() { return KSPSolve(ksp, b, y); }, PETSC_ERR_MAT_CH_ZRPVT, {"Gram matrix C W C'", "FACTOR_NUMERIC_ZEROPIVOT"}));
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(Destroy(&sys, &nest, &b, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Entry (i, j) of a matrix; ranks that do not own row i do nothing */
static PetscErrorCode SetEntry(Mat M, PetscInt i, PetscInt j, PetscScalar value)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(M, &start, &end));
  if (i >= start && i < end) PetscCall(MatSetValue(M, i, j, value, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NaN in A and Inf in C: a reason on every rank, or an error that names the place, and a solver that can be used again */
static PetscErrorCode NotFinite(bool uneven)
{
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  Spec        spec;
  System      sys;
  Mat         nest;
  Vec         b, y;
  KSP         ksp;
  PetscScalar good;
  PetscInt    column;

  PetscFunctionBeginUser;
  spec.uneven = uneven;
  PetscCall(Create(spec, &sys, &nest, &b, &y));
  PetscCall(SolverCreate(nest, &ksp));
  for (bool inC : {false, true}) {
    Mat   M = inC ? sys.C : sys.A;
    Dense dense;

    Case("not finite, in C %d, uneven %d", inC, uneven);
    PetscCall(Gather(M, dense));
    column = 0;
    while (dense(3, column) == 0.0) column++;
    good = dense(3, column);
    PetscCall(SetEntry(M, 3, column, inC ? (PetscReal)INFINITY : NAN));
    for (int repeat = 0; repeat < 2; repeat++) {
      PetscCall(KSPSolve(ksp, b, y));
      PetscCall(CheckReason(ksp, KSP_DIVERGED_PC_FAILED, PC_FACTOR_OTHER));
    }
    PetscCall(SetEntry(M, 3, column, good));
    PetscCall(SolveWell(ksp, b, y, 1e-8));
    PetscCall(SetEntry(M, 3, column, inC ? (PetscReal)INFINITY : NAN));
    {
      KSP strict;

      PetscCall(SolverCreate(nest, &strict));
      PetscCall(KSPSetErrorIfNotConverged(strict, PETSC_TRUE));
      PetscCall(CheckError("set-up", [=]() { return KSPSetUp(strict); }, PETSC_ERR_FP,
                           {"NaN or Inf", inC ? "row 3 of C" : "entry (3," + std::to_string(column) + ") of A"}));
      PetscCall(KSPDestroy(&strict));
    }
    PetscCall(SetEntry(M, 3, column, good));
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(Destroy(&sys, &nest, &b, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A preconditioner that hides a residual, and an A that is singular on Ker C: what the inner solver calls converged is no solution */
static PetscErrorCode FalseConvergence(bool strict)
{
  Options options("-ainsworth_pc_type shell -ainsworth_ksp_rtol 1e-12");
  Spec    spec;
  System  sys;
  Mat     nest;
  Vec     b, y;
  KSP     ksp, inner;
  PC      pc, shell;

  PetscFunctionBeginUser;
  Case("false convergence, strict %d", strict);
  PetscCall(Create(spec, &sys, &nest, &b, &y));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPSetErrorIfNotConverged(ksp, (PetscBool)strict));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetPC(inner, &shell));
  PetscCall(PCSetType(shell, PCSHELL));
  PetscCall(PCShellSetApply(shell, [](PC, Vec, Vec z) { return VecZeroEntries(z); }));
  if (strict)
    PetscCall(CheckError("blind preconditioner", [=]() { return KSPSolve(ksp, b, y); }, PETSC_ERR_NOT_CONVERGED,
                         {"says that it converged, but row", "its preconditioner, does not see this"}));
  else {
    PetscCall(KSPSolve(ksp, b, y));
    PetscCall(CheckReason(ksp, KSP_DIVERGED_PC_FAILED, PC_SUBPC_ERROR));
  }
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
  PetscCall(CheckError("solve", [=]() { return KSPSolve(ksp, b, y); }, PETSC_ERR_ARG_INCOMP,
                       {"nonzero on a row of C that is zero (rows 1, 4 of", "no solution exists"}));
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

  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(Create(spec, &sys, &nest, &b, &y));
  PetscCall(SolverCreate(nest, &ksp));
  Case("A negative definite"); /* conjugate gradients may well find the solution: that, or a reason */
  PetscCall(MatScale(sys.A, -1.0));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  if (reason > 0) PetscCall(SolveWell(ksp, b, y, 1e-6));
  else PetscCall(CheckReason(ksp, KSP_DIVERGED_PC_FAILED, PC_SUBPC_ERROR));
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
  for (bool uneven : {false, true}) PetscCall(Unfactored(uneven));
  for (bool uneven : {false, true}) PetscCall(NotFinite(uneven));
  for (bool strict : {false, true}) PetscCall(FalseConvergence(strict));
  PetscCall(Inconsistent());
  PetscCall(Indefinite());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
