static char help[] = "Solves that went wrong where the inner solver does not see it, or that cannot be done: a reason, or an error that says what.\n\n";

#include "layout.h"

/* A solve fails with this reason of the PC; strict: with this error */
static PetscErrorCode CheckFailure(KSP ksp, const System &sys, bool strict, const char *message)
{
  KSPConvergedReason reason;
  PCFailedReason     got;
  PC                 pc;
  Column             x, lambda;

  PetscFunctionBeginUser;
  if (strict) {
    PetscCall(CheckError("solve", [&]() { return SolveFields(ksp, sys, false, false, x, lambda); }, PETSC_ERR_NOT_CONVERGED, {message}));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(SolveFields(ksp, sys, false, false, x, lambda));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(PCGetFailedReason(pc, &got));
  PetscCall(CheckInt("reason", reason, KSP_DIVERGED_PC_FAILED));
  PetscCall(CheckInt("failure of the PC", got, PC_SUBPC_ERROR));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One body floats and no constraint holds it; rounding, or a shift, makes a huge x of that */
static PetscErrorCode Floating(bool strict)
{
  Options options("-ainsworth_ksp_type preonly -ainsworth_pc_type redundant -ainsworth_redundant_pc_type lu -ainsworth_redundant_pc_factor_shift_type nonzero");
  Spec    spec;
  System  sys;
  Mat     nest;
  KSP     ksp;

  PetscFunctionBeginUser;
  Case("a floating body, strict %d", strict);
  spec.semidefinite = true;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(MatZeroEntries(sys.C));
  PetscCall(VecZeroEntries(sys.g));
  PetscCall(LayoutCreate(sys, Layout(), &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPSetErrorIfNotConverged(ksp, (PetscBool)strict));
  PetscCall(CheckFailure(ksp, sys, strict, "A is singular on Ker C"));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solver of the Gram matrix that is not accurate at the set-up, and bad afterwards: C x = g is not met. One that stops: a reason, too */
static PetscErrorCode GramSolver(bool stops, bool uneven, bool strict)
{
  Options options(std::string("-ainsworth_pc_type jacobi -pc_ainsworth_pmat id -ainsworth_gram_ksp_type cg -ainsworth_gram_pc_type none "
                              "-ainsworth_gram_ksp_rtol 1e-5 ") +
                  (stops ? "" : "-ainsworth_ksp_type preonly -ainsworth_ksp_norm_type none"));
  Spec    spec;
  System  sys;
  Mat     nest;
  KSP     ksp, gram;
  PC      pc;

  PetscFunctionBeginUser;
  Case("Gram solver that %s, uneven %d, strict %d", stops ? "stops" : "is not accurate", uneven, strict);
  spec.n      = 160;
  spec.m      = 60;
  spec.uneven = uneven;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(LayoutCreate(sys, Layout(), &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPSetErrorIfNotConverged(ksp, (PetscBool)strict));
  PetscCall(KSPSetUp(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetGramKSP(pc, &gram));
  if (gram && stops) PetscCall(KSPSetTolerances(gram, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, 1));
  if (gram && !stops) PetscCall(KSPSetTolerances(gram, 0.5, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(CheckFailure(ksp, sys, strict, stops ? "Solves with the Gram matrix S = C W C' do not converge" : "the Gram matrix C W C' is ill-conditioned"));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows whose squares are below the smallest number: nothing is known of their direction, and g = 0 alone can be met without them */
static PetscErrorCode Tiny()
{
  Options            options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  Spec               spec;
  System             sys;
  Mat                nest;
  KSP                ksp;
  KSPConvergedReason reason;
  Column             x, lambda;

  PetscFunctionBeginUser;
  Case("rows of C of 1e-200");
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(MatScale(sys.C, 1e-200));
  PetscCall(LayoutCreate(sys, Layout(), &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(SolveFields(ksp, sys, false, false, x, lambda));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckInt("reason", reason, KSP_DIVERGED_PC_FAILED));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Blocks C and -C' cannot be transposed */
static PetscErrorCode Negated()
{
  Options options("-ainsworth_pc_type jacobi");
  Spec    spec;
  System  sys;
  Mat     nest, Ct;
  Vec     b, y;
  KSP     ksp;

  PetscFunctionBeginUser;
  Case("transpose of C and -C'");
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(MatHermitianTranspose(sys.C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(MatScale(Ct, -1.0));
  PetscCall(NestCreate(sys.A, Ct, sys.C, NULL, false, &nest));
  PetscCall(MatCreateVecs(nest, &y, &b));
  PetscCall(SetRandom(b, 4));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(CheckError("solve", [=]() { return KSPSolveTranspose(ksp, b, y); }, PETSC_ERR_SUP, {"blocks C and C', not C and -C'"}));
  for (Vec *v : {&b, &y}) PetscCall(VecDestroy(v));
  PetscCall(KSPDestroy(&ksp));
  for (Mat *mat : {&nest, &Ct}) PetscCall(MatDestroy(mat));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (bool strict : {false, true}) {
    PetscCall(Floating(strict));
    for (bool stops : {false, true})
      for (bool uneven : {false, true}) PetscCall(GramSolver(stops, uneven, strict));
  }
  PetscCall(Tiny());
  PetscCall(Negated());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
