static char help[] = "Traps that the attack has found: what a failure, a kept preconditioner or a null space leaves behind for the next solve.\n\n";

#include "run.h"
#include <cmath>

/* Springs of stiffness `stiffness` between neighbors and to the ground; rows of C tie unknowns far from each other */
static DenseSystem Springs(PetscInt n, PetscInt m, PetscReal stiffness, PetscInt seed)
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

static PetscErrorCode Write(const Dense &values, Mat M)
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

static PetscErrorCode Solved(Run *run, const DenseSystem &d)
{
  PetscFunctionBeginUser;
  PetscCall(RunSolve(run));
  PetscCall(CheckTrue(KSPConvergedReasons[run->reason], run->reason > 0));
  PetscCall(CheckResiduals(*run, d, 1e-7, 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -ksp_reuse_preconditioner keeps the inner preconditioner, never the constraints; A changes in place, C too, rows come and go */
static PetscErrorCode Reuse(const char *options, PetscInt pmats)
{
  Options     line(options);
  DenseSystem d = Springs(24, 5, 1.0, 1);
  Run         run;
  PetscInt    before, after;

  PetscFunctionBeginUser;
  Case("reuse, %s", options);
  PetscCall(RunCreate(d, false, &run));
  PetscCall(Solved(&run, d));
  PetscCall(KSPSetReusePreconditioner(run.ksp, PETSC_TRUE));
  PetscCall(EventCount("AinsPMat", &before));
  d.C *= 2.0;
  d.C(0, 24 / 2) = 0.7;
  PetscCall(Write(d.C, run.sys.C));
  PetscCall(Solved(&run, d));
  d.A *= 1.5;
  PetscCall(Write(d.A, run.sys.A));
  PetscCall(Solved(&run, d));
  for (PetscInt m : {7, 0, 3}) { /* another nest with other rows, of the same total length on each rank */
    Mat nest;

    const DenseSystem other = Springs(24, m, 1.5, 1);

    d.C = other.C;
    d.g = other.g;
    PetscCall(MatDestroy(&run.sys.C));
    PetscCall(VecDestroy(&run.sys.g));
    Run rows;
    PetscCall(SystemFromDense(d, false, &rows.sys));
    PetscCall(PetscObjectReference((PetscObject)rows.sys.C));
    PetscCall(PetscObjectReference((PetscObject)rows.sys.g));
    run.sys.C = rows.sys.C;
    run.sys.g = rows.sys.g;
    PetscCall(SystemDestroy(&rows.sys));
    PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, NULL, false, &nest));
    PetscCall(KSPReset(run.ksp));
    PetscCall(KSPSetOperators(run.ksp, nest, nest));
    PetscCall(MatDestroy(&run.nest));
    run.nest = nest;
    PetscCall(Solved(&run, d));
    if (m) d.C.row(0) *= 3.0;
    if (m) PetscCall(Write(d.C, run.sys.C));
    PetscCall(Solved(&run, d));
  }
  PetscCall(EventCount("AinsPMat", &after));
  PetscCall(CheckInt("preconditioning matrices for three nests", after - before, pmats));
  PetscCall(KSPSetReusePreconditioner(run.ksp, PETSC_FALSE));
  PetscCall(Solved(&run, d));
  PetscCall(EventCount("AinsPMat", &before));
  PetscCall(CheckInt("and one for the matrix at hand when nothing is kept any more", before - after, 1));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A set-up that was refused, then the block mended in place: an outer method asks before it applies */
static PetscErrorCode Mended()
{
  Options           line("-ksp_type fgmres -ksp_rtol 1e-10 -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  const DenseSystem d   = Springs(20, 4, 1.0, 2);
  DenseSystem       bad = d;
  Run               run;
  Mat               Ct;
  PetscErrorCode    code;

  PetscFunctionBeginUser;
  Case("mended in place");
  PetscCall(SystemFromDense(d, false, &run.sys));
  PetscCall(MatCreateHermitianTranspose(run.sys.C, &Ct));
  PetscCall(NestCreate(run.sys.A, Ct, run.sys.C, NULL, false, &run.nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(Solved(&run, d));
  bad.C(1, 1) = NAN;
  PetscCall(Write(bad.C, run.sys.C));
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  code = RunSolve(&run);
  PetscCall(PetscPopErrorHandler());
  PetscCall(CheckTrue("NaN in C is refused", code || run.reason < 0));
  PetscCall(Write(d.C, run.sys.C));
  PetscCall(Solved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NaN in an A that has no norm */
static PetscErrorCode NestedNaN()
{
  DenseSystem d = Springs(12, 2, 1.0, 3);
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

/* Two equal rows: their multipliers have a null vector, in which the program left a rounding error of x. Where lambda is 1e60 times x a KSP makes noise of x */
static PetscErrorCode MixedNullSpace(PetscReal stiffness, bool right)
{
  Options      line("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  DenseSystem  d = Springs(12, 2, stiffness, 4);
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
  PetscCall(Solved(&run, d)); /* without: what is attached later counts too */
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 1, &v, &nullspace));
  PetscCall(MatSetNullSpace(run.nest, nullspace));
  PetscCall(MatNullSpaceDestroy(&nullspace));
  PetscCall(VecDestroy(&v));
  if (right) PetscCall(Solved(&run, d));
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
  const DenseSystem d = Springs(20, 4, 1.0, 6);
  Run               run;
  PC                pc;

  PetscFunctionBeginUser;
  Case("variant after another method");
  {
    Options line("-ainsworth_ksp_type gmres -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10");

    PetscCall(RunCreate(d, false, &run));
    PetscCall(Solved(&run, d));
  }
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthSetVariant(pc, PC_AINSWORTH_PAPER));
  PetscCall(Solved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPSetFromOptions() after KSPReset() and a set-up that ended before it had an A; then the matrix again */
static PetscErrorCode OptionsWithoutA()
{
  Options           line("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10");
  const DenseSystem d = Springs(20, 4, 1.0, 10);
  Run               run;
  Mat               wrong;

  PetscFunctionBeginUser;
  Case("options without A");
  PetscCall(RunCreate(d, false, &run));
  PetscCall(Solved(&run, d));
  PetscCall(KSPReset(run.ksp));
  PetscCall(KSPSetOperators(run.ksp, run.sys.A, run.sys.A));
  PetscCall(CheckError("no nest", [&]() { return KSPSetUp(run.ksp); }, PETSC_ERR_ARG_WRONG, {"pass a MatNest"}));
  PetscCall(KSPSetFromOptions(run.ksp));
  PetscCall(KSPReset(run.ksp));
  PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, NULL, false, &wrong));
  PetscCall(KSPSetOperators(run.ksp, wrong, wrong));
  PetscCall(MatDestroy(&run.nest));
  run.nest = wrong;
  PetscCall(Solved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#if defined(PETSC_HAVE_HYPRE)
/* BoomerAMG after a solve that failed, and where a method wants its transpose */
static PetscErrorCode BoomerAMG()
{
  const DenseSystem d = Springs(30, 4, 1.0, 7);
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
    PetscCall(Solved(&run, d));
    PetscCall(RunDestroy(&run));
  }
  {
    Options line("-ainsworth_pc_type hypre -ainsworth_ksp_type cgne -ainsworth_ksp_rtol 1e-10");

    Case("BoomerAMG in CGNE");
    PetscCall(RunCreate(d, false, &run));
    PetscCall(Solved(&run, d));
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
      DenseSystem s = Springs(120, 0, 1.0, 9);
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
  PetscCall(Reuse("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10", 2)); /* of three, one has no constraints */
  PetscCall(Reuse("-ainsworth_pc_type jacobi -ainsworth_ksp_type gmres -ainsworth_ksp_rtol 1e-10 -pc_ainsworth_pmat jcb", 2));
  PetscCall(Reuse("-ainsworth_pc_type blocksa -ainsworth_ksp_rtol 1e-10", 6)); /* its levels get each surface */
  PetscCall(Mended());
  PetscCall(NestedNaN());
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
