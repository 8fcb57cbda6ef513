/* The inner solver: what it says, leaves behind or fails at in one solve must not be believed, or stay, in another */
#include "situations.h"
#include <petsc/private/pcimpl.h>

/* What the inner solver is told to do, counted from the first solve or application */
static struct Plan {
  PetscInt           from = 0, to = 0; /* solves that end with reason, after a step */
  KSPConvergedReason reason = KSP_CONVERGED_RTOL;
  KSPConvergedReason later  = KSP_CONVERGED_ITERATING; /* of the solves after: ITERATING: the usual test */
  PetscInt           solves = 0, applications = 0;
  PetscInt           failing = 0; /* application that raises an error; 0: none */
  PetscInt           steps   = 0; /* of a solve that others are compared with */
  Mat                mat     = NULL;
} plan;

static PetscErrorCode Test(KSP ksp, PetscInt step, PetscReal norm, KSPConvergedReason *reason, void *usual)
{
  PetscFunctionBeginUser;
  if (!step) plan.solves++;
  PetscCall(KSPConvergedDefault(ksp, step, norm, reason, usual));
  const KSPConvergedReason told = plan.solves > plan.to      ? plan.later
                                  : plan.solves >= plan.from ? plan.reason
                                                             : KSP_CONVERGED_ITERATING;
  if (told) *reason = step ? told : KSP_CONVERGED_ITERATING;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Action Obey(PetscInt solve, KSPConvergedReason reason, KSPConvergedReason later = KSP_CONVERGED_ITERATING)
{
  return Inner([=](KSP inner, PC) -> PetscErrorCode {
    void *usual;

    PetscFunctionBeginUser;
    plan      = Plan();
    plan.from = plan.to = solve;
    plan.reason         = reason;
    plan.later          = later;
    PetscCall(KSPConvergedDefaultCreate(&usual));
    PetscCall(KSPSetConvergenceTest(inner, Test, usual, KSPConvergedDefaultDestroy));
    PetscFunctionReturn(PETSC_SUCCESS);
  });
}

static PetscErrorCode Identity(PC pc, Vec r, Vec z)
{
  PetscFunctionBeginUser;
  PetscCheck(++plan.applications != plan.failing, PetscObjectComm((PetscObject)pc), PETSC_ERR_USER,
             "an error in the middle");
  PetscCall(VecCopy(r, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solve is left by an error at one of the next applications */
static Action Left(PetscInt application)
{
  return [=](Live &s) {
    plan.failing = plan.applications + application;
    return Raised(PETSC_ERR_USER, {"an error in the middle"})(s);
  };
}

/* What a monitor is told of the residual of a method that iterates in Ker C */
static PetscErrorCode CompareResidual(KSP inner, PetscInt, PetscReal, void *ctx)
{
  const Saddle        *d = (const Saddle *)ctx;
  const DenseProjector proj(d->C, DiagonalWeight(d->A));
  Vec                  b, x, r;
  Column               rhs, iterate, residual;

  PetscFunctionBeginUser;
  PetscCall(KSPGetRhs(inner, &b));
  PetscCall(KSPBuildSolution(inner, NULL, &x));
  PetscCall(KSPBuildResidual(inner, NULL, NULL, &r));
  PetscCall(Gather(b, rhs));
  PetscCall(Gather(x, iterate));
  PetscCall(Gather(r, residual));
  PetscCall(VecDestroy(&r));
  PetscCall(Check("built residual", (residual - rhs + proj.Q.adjoint() * (d->A * (proj.Q * iterate))).norm(),
                  1e-12 * rhs.norm()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A preconditioner that writes this value into the last unknown */
static PetscErrorCode PoisonLast(PC pc, Vec r, Vec z)
{
  PetscInt   N;
  PetscReal *value;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, (void **)&value));
  PetscCall(VecCopy(r, z));
  PetscCall(VecGetSize(z, &N));
  PetscCall(VecSetValue(z, N - 1, *value, INSERT_VALUES)); /* on all ranks: the owner's is the last */
  PetscCall(VecAssemblyBegin(z));
  PetscCall(VecAssemblyEnd(z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ShellOneLevel(KSP, PC mg)
{
  KSP coarse;
  PC  pc;

  PetscFunctionBeginUser;
  plan = Plan();
  PetscCall(PCSetType(mg, PCMG));
  PetscCall(PCMGSetLevels(mg, 1, NULL));
  PetscCall(PCMGGetCoarseSolve(mg, &coarse));
  PetscCall(KSPSetType(coarse, KSPPREONLY));
  PetscCall(KSPGetPC(coarse, &pc));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetApply(pc, Identity));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FailingSetUp(PC pc)
{
  return AinsworthPCSetFailedReason(pc, PC_FACTOR_NUMERIC_ZEROPIVOT);
}

static bool broken; /* the preconditioner, on this rank */

static PetscErrorCode SetUpOrFail(PC pc)
{
  return PCSetFailedReason(pc, broken ? PC_FACTOR_NUMERIC_ZEROPIVOT : PC_NOERROR);
}

static PetscErrorCode ApplyOrNaN(PC, Vec x, Vec y)
{
  PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(VecCopy(x, y));
  PetscCall(VecGetArray(y, &a));
  if (broken) a[0] = NAN;
  PetscCall(VecRestoreArray(y, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is said of one solve is not believed, and does not stay */
static PetscErrorCode Reasons()
{
  const std::string jacobi = "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 ",
                    outer  = jacobi + "-ksp_rtol 1e-10 -ksp_type ";
  const std::string
    gcr = "-ainsworth_ksp_type gcr -ainsworth_pc_type jacobi -ainsworth_ksp_max_it 2 -ainsworth_ksp_rtol 1e-10 ";
  const DenseSystem large = SpringsCreate(40, 4, 1.0, 12), d = SpringsCreate(20, 4, 1.0, 15);
  static PetscReal  value;

  PetscFunctionBeginUser;
  /* GCR calls its limit of iterations convergence; a limit that the program takes for convergence is one */
  PetscCall(Row("limit of iterations of GCR", large, gcr,
                {Failed({"The reduced solve ended without convergence (DIVERGED_ITS) after 2 iterations"})}));
  PetscCall(
    Row("a limit of iterations that is convergence", large, gcr + "-ainsworth_ksp_converged_maxits", {Positive()}));
  /* the first solve says, wrongly, that it converged; the second, which refines it, ends at a number of iterations */
  for (const std::string method : {"projectedcg", "gcr", "gmres"})
    PetscCall(Row("refinement by " + method, large, jacobi + "-ainsworth_ksp_type " + method,
                  {Obey(1, KSP_CONVERGED_RTOL, KSP_CONVERGED_ITS), Failed(),
                   [](Live &) { return CheckTrue("another solve refines", plan.solves >= 2); }}));
  PetscCall(Row(
    "a monitor of the residual of FCG", large, jacobi + "-ainsworth_ksp_type fcg",
    {[](Live &s) { return Inner([&](KSP inner, PC) { return KSPMonitorSet(inner, CompareResidual, &s.d, NULL); })(s); },
     Solved()}));
  /* GMRES from the right applies its preconditioner a last time to get x: where that failed nothing has converged */
  PetscCall(
    Row("the last application", d, jacobi + "-ksp_type gmres -ksp_pc_side right -ksp_rtol 1e-6",
        {Obey(3, KSP_DIVERGED_NANORINF), Failed(), [](Live &) { return CheckInt("solves", plan.solves, 3); }, Solved()},
        VIEW));
  /* what failed in one application does not fail the next solve */
  for (const std::string method : {"preonly", "fgmres", "gmres", "gcr"}) {
    const std::vector<Action> next = {
      [](Live &) { return PETSC_SUCCESS; }, [](Live &s) { return s.Renew(""); },
      [=](Live &s) { return KSPSetType(s.ksp, method == KSPFGMRES ? KSPGCR : KSPFGMRES); }};
    for (size_t k = 0; k < next.size(); k++)
      PetscCall(
        Row("after a failed application, " + method + ", the same, another nest, another method: " + std::to_string(k),
            d, outer + method, {Obey(1, KSP_DIVERGED_NANORINF), Negative(), next[k], Solved()}, VIEW));
  }
  /* the work vector that an outer method wants its answer in is no guess: here it holds what marks a failure */
  for (const std::string method : {"fgmres", "gmres", "richardson"})
    PetscCall(Row("a guess from " + method, d, outer + method + " -ainsworth_ksp_initial_guess_nonzero",
                  {Solved(), Edit([](Saddle &s) { s.f[3] = NAN; }), Negative(), Original(), Solved()}, VIEW));
  /*
     A value in an unknown that no row reads, so that no residual tells: NaN, which a maximum over ranks may lose, or
     one so huge that the norm of an outer method, of P (b - K x), sees nothing else
  */
  for (const std::string method : {"preonly", "preonly, no constraints", "gmres", "bcgs", "tfqmr"}) {
    const bool  preonly = method.compare(0, 7, "preonly") == 0;
    DenseSystem hidden  = SpringsCreate(20, method.size() > 7 ? 0 : 4, 1.0, 18);

    hidden.A.row(19).setZero();
    hidden.A.col(19).setZero();
    hidden.C.col(19).setZero();
    hidden.f[19] = 0.0;
    value        = preonly ? NAN : 1e20;
    PetscCall(Row(
      "a value in an unknown that no row reads, " + method, hidden, "-ksp_type " + method.substr(0, method.find(',')),
      {Shell(PoisonLast, &value), Failed({"Unknowns 19 of the primal field are in no equation"})}, VIEW, WithoutZeros));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A preconditioner that cannot be set up, or applied, or that does not see what is left */
static PetscErrorCode Preconditioners()
{
  const DenseSystem d          = SpringsCreate(20, 4, 1.0, 16);
  DenseSystem       indefinite = d;
  PetscMPIInt       rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  indefinite.A(15, 15) = -3.0;
  PetscCall(Row("refused, a penalty", indefinite, "-ainsworth_pc_type jacobi -pc_ainsworth_penalty_factor 4e307",
                {Failed({"of the preconditioning matrix holds NaN or Inf: the penalty factor"})}));
#if defined(PETSC_HAVE_SUITESPARSE) && !defined(PETSC_USE_COMPLEX)
  if (size == 1)
    PetscCall(Row("refused, CHOLMOD", indefinite,
                  "-ainsworth_pc_type cholesky -ainsworth_mat_cholmod_factor SUPERNODAL",
                  {Failed({"The preconditioning matrix is not positive definite, as a Cholesky factorization needs it: "
                           "is A indefinite, or does a body float?"})}));
#endif
  PetscCall(Row("an error in PCMG", SpringsCreate(20, 4, 1.0, 13), "-ainsworth_pc_type mg -ainsworth_ksp_rtol 1e-10",
                {Inner(ShellOneLevel), Solved(), Left(3), Solved()}));
  for (bool type : {false, true})
    PetscCall(Row("after a failed set-up, another type " + std::to_string(type), d,
                  "-ainsworth_ksp_rtol 1e-12 -ainsworth_pc_type shell",
                  {Shell(Identity), Inner([](KSP, PC pc) { return PCShellSetSetUp(pc, FailingSetUp); }),
                   Failed({"The inner preconditioner, of type shell, failed (FACTOR_NUMERIC_ZEROPIVOT)"}),
                   Inner([=](KSP, PC pc) { return type ? PCSetType(pc, PCJACOBI) : PCShellSetSetUp(pc, NULL); }),
                   Edit([](Saddle &s) { s.A *= 2.0; }), Solved()}));
  /* on one rank alone, with unknowns, as it is set up or as it is applied: all ranks hear of it */
  for (bool setup : {false, true})
    for (int crossed : {0, (int)CROSSED}) {
      const bool chosen = rank == (crossed ? 0 : size - 1);

      PetscCall(Row(Text("failure on one rank, at set-up %d, crossed %d", setup, crossed), Chain(9, 3, 2.0),
                    "-ainsworth_pc_type shell -ainsworth_ksp_rtol 1e-13",
                    {Shell(ApplyOrNaN), Inner([=](KSP, PC pc) {
                       broken = chosen;
                       return PCShellSetSetUp(pc, setup ? SetUpOrFail : NULL);
                     }),
                     Failed(),
                     [](Live &s) {
                       broken = false;
                       return PetscObjectStateIncrease((PetscObject)s.sys.A); /* to be set up anew */
                     },
                     Exact(1e-9)},
                    crossed));
    }
  for (const std::string strict : {"", " -ksp_error_if_not_converged"})
    PetscCall(Row("false convergence" + strict, Spec(), "-ainsworth_pc_type shell -ainsworth_ksp_rtol 1e-12" + strict,
                  {Shell([](PC, Vec, Vec z) { return VecZeroEntries(z); }),
                   strict.empty() ? Failed({}, PC_SUBPC_ERROR)
                                  : Raised(PETSC_ERR_NOT_CONVERGED, {"says that it converged, but row",
                                                                     "its preconditioner, does not see this"})}));
#if defined(PETSC_HAVE_HYPRE)
  const std::string hypre = "-ainsworth_pc_type hypre -ainsworth_ksp_rtol 1e-10 ";
  DenseSystem       alone = SpringsCreate(120, 0, 1.0, 9), other = d;

  DenseSystem floating = Chain(3, 0, 2.0);

  /* elimination on the coarsest level of BoomerAMG would raise an error, on the one rank that has it */
  floating.A(0, 0) = floating.A(2, 2) = 1.0;
  floating.f                          = floating.A * RandomColumn(3, 31);
  PetscCall(Row("a floating body without constraints", floating, hypre, {Solved()}));
  alone.A(60, 60) = -3.0;
  other.A(0, 1)   = 0.5;
  PetscCall(
    Row("refused, hypre", indefinite, "-ainsworth_pc_type hypre",
        {Failed({"The preconditioning matrix is not positive definite, as BoomerAMG needs it: is A indefinite?"})}));
  PetscCall(
    Row("BoomerAMG after a failure", SpringsCreate(30, 4, 1.0, 7), hypre, {Limit(1), Failed(), Limit(500), Solved()}));
  PetscCall(Row("BoomerAMG in CGNE", SpringsCreate(30, 4, 1.0, 7), hypre + "-ainsworth_ksp_type cgne", {Solved()}));
  PetscCall(Row("BoomerAMG, transposed", other, hypre + "-ainsworth_ksp_type gmres",
                {TransposeRaised(PETSC_ERR_SUP, {"hypre", "another -ainsworth_pc_type"})}, EXPLICIT));
  PetscCall(Row("BoomerAMG, an indefinite A alone", alone, "-ainsworth_pc_type hypre",
                {Failed({"not positive definite", "Choose another -ainsworth_pc_type"})}));
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How often a text stands in another */
static PetscInt Count(const std::string &text, const std::string &part)
{
  PetscInt count = 0;

  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) count++;
  return count;
}

/* One header, one number for each solve: KSPs of one communicator share a file; options read twice begin nothing */
static PetscErrorCode OneFile(const std::string &second)
{
  const std::string line[] = {"-ainsworth_pc_type jacobi -pc_ainsworth_monitor_error csv:one.csv",
                              "-ainsworth_pc_type jacobi -pc_ainsworth_monitor_error " + second};
  Live              s[2]   = {
                   {Spec(), 0},
                   {Spec(), 0}
  };
  PetscInt    steps;
  std::string text;

  PetscFunctionBeginUser;
  Case("one file, csv:one.csv and %s", second.c_str());
  for (int turn = 0; turn < 3; turn++)
    for (int k = 0; k < 2; k++) {
      PetscCall(turn ? Reread(line[turn == 1])(s[k]) : s[k].Start(line[k]));
      PetscCall(Positive()(s[k]));
      s[k].options.reset();
    }
  PetscCall(Inner([&](KSP inner, PC) { return KSPGetIterationNumber(inner, &steps); })(s[0]));
  for (Live &solver : s) PetscCall(solver.Destroy());
  PetscCall(FileText("one.csv", text));
  PetscCall(CheckInt("headers", Count(text, "solve,seconds"), 1));
  PetscCall(CheckInt("at the top", text.find("solve,seconds"), 0));
  for (const std::string solve : {"1", "2", "3", "4", "5", "6"})
    PetscCall(
      CheckInt(("rows of the first iterate, solve " + solve).c_str(), Count(text, "\n" + solve + ",0."), steps + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An error is passed on; later solves are as if there had been none. PETSc itself does not allow for a second error */
PetscErrorCode Monitored()
{
  const Action steps    = Inner([](KSP inner, PC) -> PetscErrorCode {
    PetscInt count;

    PetscFunctionBeginUser;
    PetscCall(KSPGetOperators(inner, &plan.mat, NULL));
    PetscCall(KSPGetIterationNumber(inner, &count));
    if (plan.steps) PetscCall(CheckInt("steps after the error", count, plan.steps));
    plan.steps = count;
    PetscFunctionReturn(PETSC_SUCCESS);
  });
  const Action restored = Inner([](KSP inner, PC) -> PetscErrorCode {
    Mat mat;
    PetscErrorCode (*test)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);

    PetscFunctionBeginUser;
    PetscCall(KSPGetConvergenceTest(inner, &test, NULL, NULL));
    PetscCall(CheckTrue("the KSP has its own test again", test == KSPConvergedDefault));
    PetscCall(KSPGetOperators(inner, &mat, NULL));
    PetscCall(CheckTrue("and its operator", mat == plan.mat));
    PetscFunctionReturn(PETSC_SUCCESS);
  });
  std::string  text;

  PetscFunctionBeginUser;
  for (const std::string variant : {"", " -pc_ainsworth_variant paper"})
    for (const std::string line : {"", "-pc_ainsworth_stop energy_error -pc_ainsworth_error_rtol 1e-8",
                                   "-pc_ainsworth_monitor_error ascii:table.txt"})
      PetscCall(Row("an error in the solve, " + line + variant, Spec(), "-ainsworth_ksp_rtol 1e-10 " + line + variant,
                    {[](Live &) { return plan = Plan(), PETSC_SUCCESS; }, Shell(Identity), Positive(), steps, Left(4),
                     restored, Positive(), steps, Positive(), steps}));
  PetscCall(Row("reset after an error", Spec(), "-pc_ainsworth_stop energy_error",
                {[](Live &) { return plan = Plan(), PETSC_SUCCESS; }, Shell(Identity), Left(3),
                 [](Live &s) { return KSPReset(s.ksp); },
                 [](Live &s) { return KSPSetOperators(s.ksp, s.nest, s.nest); }, Positive()}));
  for (const std::string second : {"csv:one.csv", "ascii:one.csv:ascii_csv"}) PetscCall(OneFile(second));
  for (int k = 0; k < 2; k++) /* a file that is appended to has its header already */
    PetscCall(Row("appended", Spec(),
                  "-ainsworth_pc_type jacobi -pc_ainsworth_monitor_error ascii:one.csv:ascii_csv:append",
                  {Positive()}));
  PetscCall(FileText("one.csv", text));
  PetscCall(CheckInt("headers", Count(text, "solve,seconds"), 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode InnerSolver()
{
  PetscFunctionBeginUser;
  for (auto table : {Smoothers, Mended, Reasons, Preconditioners, Stops}) PetscCall(table());
  PetscFunctionReturn(PETSC_SUCCESS);
}
