static char help[] = "Traps that the attack has found: what a failure, an option or a null space leaves behind for the next solve.\n\n";

#include "run.h"
#include <cmath>

/* A set-up that was refused, then the block mended in place: an outer method asks before it applies */
static PetscErrorCode Mended()
{
  Options           line("-ksp_type fgmres -ksp_rtol 1e-10 -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  const DenseSystem d   = SpringsCreate(20, 4, 1.0, 2);
  DenseSystem       bad = d;
  Run               run;
  PetscErrorCode    code;

  PetscFunctionBeginUser;
  Case("mended in place");
  PetscCall(RunCreateWhole(d, &run));
  PetscCall(CheckSolved(&run, d));
  bad.C(1, 1) = NAN;
  PetscCall(WriteDense(bad.C, run.sys.C));
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  code = RunSolve(&run);
  PetscCall(PetscPopErrorHandler());
  PetscCall(CheckTrue("NaN in C is refused", code || run.reason < 0));
  PetscCall(WriteDense(d.C, run.sys.C));
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NaN in an A that has no norm */
static PetscErrorCode NestedNaN()
{
  DenseSystem d = SpringsCreate(12, 2, 1.0, 3);
  Run         run;
  Mat         parts;
  const char *why;
  PC          pc;

  PetscFunctionBeginUser;
  Case("NaN in a nested A");
  d.A(3, 3) = NAN;
  PetscCall(SystemFromDense(d, false, &run.sys));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 1, NULL, 1, NULL, &run.sys.A, &parts));
  PetscCall(NestCreate(parts, NULL, run.sys.C, NULL, false, &run.nest));
  PetscCall(MatDestroy(&parts));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(RunSolve(&run));
  PetscCall(CheckFailed(run));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  PetscCall(CheckText("the cause", why, {"of A is NaN or Inf"}));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A so soft that the squares of f underflow: outer methods take it for zero, and x = 0 for the answer, without a look at A, where there is a NaN then */
static PetscErrorCode Underflow(const char *outer)
{
  Options     line(std::string("-ksp_rtol 1e-10 -ksp_atol 0 -ksp_reuse_preconditioner -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -ksp_type ") + outer);
  DenseSystem d = SpringsCreate(20, 4, 1.0, 17), soft = d;
  Run         run;
  const char *why;
  PC          pc;

  PetscFunctionBeginUser;
  Case("underflow, %s", outer);
  soft.A *= 1e-200;
  soft.f *= 1e-200;
  soft.g *= 0.0;
  PetscCall(RunCreateWhole(d, &run));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(CheckSolved(&run, d));
  PetscCall(WriteDense(soft.A, run.sys.A));
  PetscCall(Scatter(soft.f, run.sys.f));
  PetscCall(Scatter(soft.g, run.sys.g));
  PetscCall(RunSolve(&run));
  PetscCall(CheckFailed(run));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  PetscCall(CheckText("the cause", why, {"takes the right-hand side for zero", "e-201", "-ksp_type preonly"}));
  soft.A(2, 2) = NAN;
  PetscCall(WriteDense(soft.A, run.sys.A));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason < 0));
  PetscCall(WriteDense(d.A, run.sys.A));
  PetscCall(Scatter(d.f, run.sys.f));
  PetscCall(Scatter(d.g, run.sys.g));
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A spring of D with the other sign that gives what A takes: the matrix is singular, and an x of 1e15 balances to rounding */
static PetscErrorCode Driven()
{
  Options        line("-ainsworth_ksp_type minres -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10 -pc_ainsworth_multiplier_fields 1");
  const PetscInt n = 20, last = n - 1;
  DenseSystem    d = SpringsCreate(n, 2, 1.0, 20);
  Dense          D = Dense::Zero(2, 2);
  Run            run;
  Mat            block;
  PetscInt       m;
  const char    *why;
  bool           named = false;
  PC             pc;

  PetscFunctionBeginUser;
  Case("a spring that drives");
  d.A.row(last).setZero();
  d.A.col(last).setZero();
  d.C.row(0).setZero();
  d.g.setZero();
  d.C(0, last) = -1.0;
  D(0, 0) = d.A(last, last) = 1.0;
  PetscCall(SystemFromDense(d, false, &run.sys));
  PetscCall(VecGetLocalSize(run.sys.g, &m));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &block));
  PetscCall(WriteDense(D, block));
  PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, block, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(MatDestroy(&block));
  PetscCall(RunSolve(&run));
  PetscCall(CheckFailed(run));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  /* rounding decides whether x drowns, or another solve disagrees or does not help; on several ranks, and with complex numbers, it ends before */
  for (const char *cause : {"drown in the rounding of its terms", "of what they are allowed, which another solve takes for", "says that it converged, but row"})
    named = named || std::string(why).find(cause) != std::string::npos;
  if (m == 2 && !PetscDefined(USE_COMPLEX)) PetscCall(CheckTrue(why, named));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block size that is part of A's type, and another that the options want, without constraints: A itself goes to the inner solver */
static PetscErrorCode BlockSize(const char *type)
{
  Options           line("-pc_ainsworth_block_size 1 -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  const DenseSystem d = SpringsCreate(20, 0, 1.0, 23);
  Run               run;
  Mat               A;

  PetscFunctionBeginUser;
  Case("block size of %s", type);
  PetscCall(SystemFromDense(d, true, &run.sys));
  PetscCall(MatSetBlockSize(run.sys.A, 2));
  PetscCall(MatSetOption(run.sys.A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatConvert(run.sys.A, type, MAT_INITIAL_MATRIX, &A));
  PetscCall(NestCreate(A, NULL, run.sys.C, NULL, false, &run.nest));
  PetscCall(MatDestroy(&A));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* GAMG and ML smooth with the first of their operators on the finest level: this must be M_*, as products with the reduced operator take solves with S */
static PetscErrorCode Smoothers(const char *inner, const char *coarse)
{
  Options           line(std::string("-ainsworth_ksp_rtol 1e-8 -ainsworth_pc_type ") + inner + " -ainsworth_" + coarse + " 8");
  const DenseSystem d = SpringsCreate(100, 4, 1.0, 24);
  Run               run;
  KSP               ksp;
  PC                pc;
  PetscInt          levels, steps, before, after;

  PetscFunctionBeginUser;
  Case("smoothers of %s", inner);
  PetscCall(RunCreate(d, false, &run));
  PetscCall(KSPSetUp(run.ksp));
  PetscCall(EventCount("AinsGramSolve", &before));
  PetscCall(RunSolve(&run));
  PetscCall(EventCount("AinsGramSolve", &after));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &ksp));
  PetscCall(KSPGetIterationNumber(ksp, &steps));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCMGGetLevels(pc, &levels));
  PetscCall(CheckTrue("there is a finest level", levels > 1));
  PetscCall(Check("solves with S", (PetscReal)(after - before), 2.0 * steps + 8.0)); /* one each for C and C', and those of R g and lambda */
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two equal rows: their multipliers have a null vector, in which the program left a rounding error of x. Where lambda is 1e60 times x a KSP makes noise of x */
static PetscErrorCode MixedNullSpace(PetscReal stiffness, bool right)
{
  Options      line("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  DenseSystem  d = SpringsCreate(12, 2, stiffness, 4);
  Run          run;
  Vec          v, part;
  IS           is[2];
  MatNullSpace nullspace;
  Column       x(12), lambda(2);

  PetscFunctionBeginUser;
  Case("null space, stiffness %g", (double)stiffness);
  d.C.row(1) = d.C.row(0);
  d.g[1]     = d.g[0];
  PetscCall(RunCreate(d, false, &run));
  PetscCall(MatCreateVecs(run.nest, &v, NULL));
  PetscCall(MatNestGetISs(run.nest, is, NULL));
  for (PetscInt i = 0; i < 12; i++) x[i] = 1e-17 * Uniform(5, i, 0);
  lambda << PetscSqrtReal(0.5), -PetscSqrtReal(0.5);
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(v, is[k], &part));
    PetscCall(Scatter(k ? lambda : x, part));
    PetscCall(VecRestoreSubVector(v, is[k], &part));
  }
  PetscCall(CheckSolved(&run, d)); /* without: what is attached later counts too */
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 1, &v, &nullspace));
  PetscCall(MatSetNullSpace(run.nest, nullspace));
  PetscCall(MatNullSpaceDestroy(&nullspace));
  PetscCall(VecDestroy(&v));
  if (right) PetscCall(CheckSolved(&run, d));
  else {
    PetscCall(RunSolve(&run));
    PetscCall(CheckFailed(run));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A variant that is set brings its own method, whose norm and side are not those of the method before */
static PetscErrorCode Variant()
{
  const DenseSystem d = SpringsCreate(20, 4, 1.0, 6);
  Run               run;
  PC                pc;

  PetscFunctionBeginUser;
  Case("variant after another method");
  {
    Options line("-ainsworth_ksp_type gmres -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10");

    PetscCall(RunCreate(d, false, &run));
    PetscCall(CheckSolved(&run, d));
  }
  PetscCall(KSPGetPC(run.ksp, &pc));
  {
    Options line("-pc_ainsworth_variant paper");

    PetscCall(PCSetFromOptions(pc));
  }
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPSetFromOptions() after KSPReset() and a set-up that ended before it had an A; then the matrix again */
static PetscErrorCode OptionsWithoutA()
{
  Options           line("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10");
  const DenseSystem d = SpringsCreate(20, 4, 1.0, 10);
  Run               run;
  Mat               wrong;

  PetscFunctionBeginUser;
  Case("options without A");
  PetscCall(RunCreate(d, false, &run));
  PetscCall(CheckSolved(&run, d));
  PetscCall(KSPReset(run.ksp));
  PetscCall(KSPSetOperators(run.ksp, run.sys.A, run.sys.A));
  PetscCall(CheckError("no nest", [&]() { return KSPSetUp(run.ksp); }, PETSC_ERR_ARG_WRONG, {"pass a MatNest"}));
  PetscCall(KSPSetFromOptions(run.ksp));
  PetscCall(KSPReset(run.ksp));
  PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, NULL, false, &wrong));
  PetscCall(KSPSetOperators(run.ksp, wrong, wrong));
  PetscCall(MatDestroy(&run.nest));
  run.nest = wrong;
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#if defined(PETSC_HAVE_HYPRE)
/* BoomerAMG after a solve that failed, and where a method wants its transpose */
static PetscErrorCode BoomerAMG()
{
  const DenseSystem d = SpringsCreate(30, 4, 1.0, 7);
  Run               run;
  KSP               inner;
  PC                pc;
  const char       *why;

  PetscFunctionBeginUser;
  Case("BoomerAMG after a failure");
  {
    Options line("-ainsworth_pc_type hypre -ainsworth_ksp_rtol 1e-10");

    PetscCall(RunCreate(d, false, &run));
    PetscCall(KSPGetPC(run.ksp, &pc));
    PetscCall(PCAinsworthGetKSP(pc, &inner));
    PetscCall(KSPSetTolerances(inner, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, 1));
    PetscCall(RunSolve(&run));
    PetscCall(CheckFailed(run));
    PetscCall(KSPSetTolerances(inner, 1e-10, PETSC_DEFAULT, PETSC_DEFAULT, 500));
    PetscCall(CheckSolved(&run, d));
    PetscCall(RunDestroy(&run));
  }
  {
    Options line("-ainsworth_pc_type hypre -ainsworth_ksp_type cgne -ainsworth_ksp_rtol 1e-10");

    Case("BoomerAMG in CGNE");
    PetscCall(RunCreate(d, false, &run));
    PetscCall(CheckSolved(&run, d));
    PetscCall(RunDestroy(&run));
  }
  {
    Options     line("-ainsworth_pc_type hypre -ainsworth_ksp_type gmres -ainsworth_ksp_rtol 1e-10");
    DenseSystem other = d;
    Vec         b, y;

    Case("BoomerAMG, transposed");
    other.A(0, 1) = 0.5;
    PetscCall(RunCreate(other, false, &run));
    PetscCall(MatCreateVecs(run.nest, &y, &b));
    PetscCall(SetRandom(b, 8));
    PetscCall(CheckError("KSPSolveTranspose()", [&]() { return KSPSolveTranspose(run.ksp, b, y); }, PETSC_ERR_SUP, {"hypre", "another -ainsworth_pc_type"}));
    PetscCall(VecDestroy(&b));
    PetscCall(VecDestroy(&y));
    PetscCall(RunDestroy(&run));
  }
  {
    Options           line("-ainsworth_pc_type hypre");
    const DenseSystem indefinite = [] {
      DenseSystem s = SpringsCreate(120, 0, 1.0, 9);
      s.A(60, 60)   = -3.0;
      return s;
    }();

    Case("BoomerAMG, an indefinite A alone");
    PetscCall(RunCreate(indefinite, false, &run));
    PetscCall(RunSolve(&run));
    PetscCall(CheckFailed(run));
    PetscCall(KSPGetPC(run.ksp, &pc));
    PetscCall(PCAinsworthGetFailure(pc, &why));
    PetscCall(CheckText("the cause", why, {"not positive definite", "Choose another -ainsworth_pc_type"}));
    PetscCall(RunDestroy(&run));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
#endif

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  PetscCall(Mended());
  PetscCall(NestedNaN());
  for (const char *outer : {"fgmres", "gcr"}) PetscCall(Underflow(outer));
  PetscCall(Driven());
  PetscCall(Smoothers(PCGAMG, "pc_gamg_coarse_eq_limit"));
#if defined(PETSC_HAVE_ML)
  PetscCall(Smoothers(PCML, "pc_ml_maxCoarseSize"));
#endif
  for (const char *type : {MATAIJ, MATBAIJ, MATSBAIJ})
    if (!PetscDefined(USE_COMPLEX) || type != std::string(MATSBAIJ)) PetscCall(BlockSize(type));
  PetscCall(MixedNullSpace(1.0, true));
  PetscCall(MixedNullSpace(1e60, false));
  PetscCall(Variant());
  PetscCall(OptionsWithoutA());
#if defined(PETSC_HAVE_HYPRE)
  PetscCall(BoomerAMG());
#endif
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
