static char help[] = "Traps of the inner solver: what it says, leaves behind or fails at in one solve must not be believed, or stay, in another.\n\n";

#include "run.h"
#include <petsc/private/pcimpl.h>
#include <base/petsccompat.h>

/* What the inner solver is told to do, counted from the first solve or application */
struct Plan {
  PetscInt           solves = 0, applications = 0;
  PetscInt           from = 0, to = 0; /* solves that end with `reason` after `steps` */
  PetscInt           steps   = 1;
  KSPConvergedReason reason  = KSP_CONVERGED_RTOL;
  KSPConvergedReason later   = KSP_CONVERGED_ITERATING; /* of the solves after `to`; ITERATING: the usual test */
  PetscInt           failing = 0;                       /* application that raises an error; 0: none */
  void              *usual   = NULL;
};

static PetscErrorCode Test(KSP ksp, PetscInt step, PetscReal norm, KSPConvergedReason *reason, void *ctx)
{
  Plan *plan = (Plan *)ctx;

  PetscFunctionBeginUser;
  if (!step) plan->solves++;
  PetscCall(KSPConvergedDefault(ksp, step, norm, reason, plan->usual));
  const KSPConvergedReason told = plan->solves > plan->to ? plan->later : plan->solves >= plan->from ? plan->reason : KSP_CONVERGED_ITERATING;
  if (told) *reason = step < plan->steps ? KSP_CONVERGED_ITERATING : told;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Identity(PC pc, Vec r, Vec z)
{
  Plan *plan;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, (void **)&plan));
  PetscCheck(++plan->applications != plan->failing, PetscObjectComm((PetscObject)pc), PETSC_ERR_USER, "an error in the middle");
  PetscCall(VecCopy(r, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Inner(const Run &run, KSP *inner, PC *pc)
{
  PC outer;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(run.ksp, &outer));
  PetscCall(PCAinsworthGetKSP(outer, inner));
  PetscCall(KSPGetPC(*inner, pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Obey(const Run &run, Plan *plan)
{
  KSP inner;
  PC  pc;

  PetscFunctionBeginUser;
  PetscCall(Inner(run, &inner, &pc));
  PetscCall(KSPConvergedDefaultCreate(&plan->usual));
  PetscCall(KSPSetConvergenceTest(inner, Test, plan, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Done(Run *run, Plan *plan)
{
  PetscFunctionBeginUser;
  PetscCall(RunDestroy(run));
#if PETSC_VERSION_LT(3, 24, 0)
  if (plan->usual) PetscCall(KSPConvergedDefaultDestroy(plan->usual));
#else
  if (plan->usual) PetscCall(KSPConvergedDefaultDestroy(&plan->usual));
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* GCR calls its limit of iterations convergence; a limit that the program takes for convergence is one */
static PetscErrorCode Limit()
{
  const DenseSystem d = SpringsCreate(40, 4, 1.0, 11);
  Run               run;
  const char       *why;
  PC                pc;

  PetscFunctionBeginUser;
  Case("limit of iterations of GCR");
  for (const char *more : {"", " -ainsworth_ksp_converged_maxits"}) {
    Options line(std::string("-ainsworth_ksp_type gcr -ainsworth_pc_type jacobi -ainsworth_ksp_max_it 2 -ainsworth_ksp_rtol 1e-10") + more);

    PetscCall(RunCreate(d, false, &run));
    PetscCall(RunSolve(&run));
    if (more[0]) PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    else {
      PetscCall(CheckFailed(run));
      PetscCall(KSPGetPC(run.ksp, &pc));
      PetscCall(PCAinsworthGetFailure(pc, &why));
      PetscCall(CheckText("the cause", why, {"The reduced solve ended without convergence (DIVERGED_ITS) after 2 iterations"}));
    }
    PetscCall(RunDestroy(&run));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first solve says that it converged, which is not true; the second, which refines it, ends at a number of iterations. What was asked for is that of the first */
static PetscErrorCode Refinement(const char *method)
{
  Options           line(std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10 -ainsworth_ksp_type ") + method);
  const DenseSystem d = SpringsCreate(40, 4, 1.0, 12);
  Run               run;
  Plan              plan;

  PetscFunctionBeginUser;
  Case("refinement by %s", method);
  plan.from = plan.to = 1;
  plan.later          = KSP_CONVERGED_ITS;
  PetscCall(RunCreate(d, false, &run));
  PetscCall(Obey(run, &plan));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue("another solve refines", plan.solves >= 2));
  PetscCall(CheckFailed(run));
  PetscCall(Done(&run, &plan));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a monitor is told of the residual of a method that iterates in Ker C */
static PetscErrorCode CompareResidual(KSP inner, PetscInt, PetscReal, void *ctx)
{
  const DenseSystem   *d = (const DenseSystem *)ctx;
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
  PetscCall(Check("built residual", (residual - rhs + proj.Q.adjoint() * (d->A * (proj.Q * iterate))).norm(), 1e-12 * rhs.norm()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Monitored()
{
  Options     line("-ainsworth_ksp_type fcg -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  DenseSystem d = SpringsCreate(40, 4, 1.0, 21);
  Run         run;
  KSP         inner;
  PC          pc;

  PetscFunctionBeginUser;
  Case("a monitor of the residual of FCG");
  PetscCall(RunCreate(d, false, &run));
  PetscCall(Inner(run, &inner, &pc));
  PetscCall(KSPMonitorSet(inner, CompareResidual, &d, NULL));
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A preconditioning matrix that is not what the chosen preconditioner, or any, needs is refused in the set-up */
static PetscErrorCode Refused(const char *type, const char *cause)
{
  Options     line(std::string("-ainsworth_pc_type ") + type);
  DenseSystem d = SpringsCreate(20, 4, 1.0, 23);
  Run         run;
  PC          pc;
  const char *why;

  PetscFunctionBeginUser;
  Case("refused, %s", type);
  d.A(15, 15) = -3.0;
  PetscCall(RunCreate(d, false, &run));
  PetscCall(RunSolve(&run));
  PetscCall(CheckFailed(run));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  PetscCall(CheckText("the cause", why, {cause}));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An error in the cycle of multigrid inside; the next solve, and the end, are as if there had been none */
static PetscErrorCode Multigrid()
{
  Options           line("-ainsworth_pc_type mg -ainsworth_ksp_rtol 1e-10");
  const DenseSystem d = SpringsCreate(20, 4, 1.0, 13);
  Run               run;
  Plan              plan;
  KSP               inner, coarse;
  PC                mg, pc;

  PetscFunctionBeginUser;
  Case("an error in PCMG");
  PetscCall(RunCreate(d, false, &run));
  PetscCall(Inner(run, &inner, &mg));
  PetscCall(PCSetType(mg, PCMG));
  PetscCall(PCMGSetLevels(mg, 1, NULL));
  PetscCall(PCMGGetCoarseSolve(mg, &coarse));
  PetscCall(KSPSetType(coarse, KSPPREONLY));
  PetscCall(KSPGetPC(coarse, &pc));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetApply(pc, Identity));
  PetscCall(PCShellSetContext(pc, &plan));
  PetscCall(CheckSolved(&run, d));
  plan.failing = plan.applications + 3;
  PetscCall(CheckError("the error is passed on", [&]() { return RunSolve(&run); }, PETSC_ERR_USER, {"an error in the middle"}));
  PetscCall(CheckSolved(&run, d));
  PetscCall(Done(&run, &plan));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* GMRES from the right applies its preconditioner a last time to get x: where that failed nothing has converged */
static PetscErrorCode LastApplication()
{
  Options           line("-ksp_type gmres -ksp_pc_side right -ksp_rtol 1e-6 -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  const DenseSystem d = SpringsCreate(20, 4, 1.0, 14);
  Run               run;
  Plan              plan;

  PetscFunctionBeginUser;
  Case("the last application");
  PetscCall(RunCreateWhole(d, &run));
  plan.from = plan.to = 3; /* each application has a second solve, as the norm of Jacobi is not the energy */
  plan.reason         = KSP_DIVERGED_NANORINF;
  PetscCall(Obey(run, &plan));
  PetscCall(RunSolve(&run));
  PetscCall(CheckInt("solves", plan.solves, 3));
  PetscCall(CheckFailed(run));
  PetscCall(CheckSolved(&run, d));
  PetscCall(Done(&run, &plan));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What failed in one application does not fail the next solve, whatever the outer method */
static PetscErrorCode Stale(const char *outer, const char *next)
{
  Options           line(std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -ksp_rtol 1e-10 -ksp_type ") + outer);
  const DenseSystem d = SpringsCreate(20, 4, 1.0, 15);
  Run               run;
  Plan              plan;

  PetscFunctionBeginUser;
  Case("after a failed application, %s, %s", outer, next);
  PetscCall(RunCreateWhole(d, &run));
  plan.from = plan.to = 1;
  plan.reason         = KSP_DIVERGED_NANORINF;
  PetscCall(Obey(run, &plan));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason < 0));
  if (next == std::string("another method")) PetscCall(KSPSetType(run.ksp, outer == std::string(KSPFGMRES) ? KSPGCR : KSPFGMRES));
  if (next == std::string("another nest of the same blocks")) {
    Mat Ct;

    PetscCall(MatDestroy(&run.nest));
    PetscCall(MatCreateHermitianTranspose(run.sys.C, &Ct));
    PetscCall(NestCreate(run.sys.A, Ct, run.sys.C, NULL, false, &run.nest));
    PetscCall(MatDestroy(&Ct));
    PetscCall(KSPSetOperators(run.ksp, run.nest, run.nest));
  }
  PetscCall(CheckSolved(&run, d));
  PetscCall(Done(&run, &plan));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The work vector that an outer method wants its answer in is no guess for the inner one: here it holds what marks a failure */
static PetscErrorCode Guess(const char *outer)
{
  Options     line(std::string("-ainsworth_ksp_initial_guess_nonzero -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -ksp_rtol 1e-10 -ksp_type ") + outer);
  DenseSystem d = SpringsCreate(20, 4, 1.0, 19), bad = d;
  Run         run;

  PetscFunctionBeginUser;
  Case("a guess from %s", outer);
  bad.f[3] = NAN;
  PetscCall(RunCreateWhole(d, &run));
  PetscCall(CheckSolved(&run, d));
  PetscCall(Scatter(bad.f, run.sys.f));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason < 0));
  PetscCall(Scatter(d.f, run.sys.f));
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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

/*
   A value in an unknown that no row of A or C reads, so that no residual tells: NaN, which a maximum over ranks may lose, or one so huge that the norm of an outer
   method, of P (b - K x), sees nothing else
*/
static PetscErrorCode Hidden(PetscReal value, PetscInt m, const std::string &outer)
{
  Options     line("-ksp_type " + outer);
  DenseSystem d = SpringsCreate(20, m, 1.0, 18);
  Run         run;
  Mat         A, Ct;
  PetscInt    n;
  KSP         inner;
  PC          pc;
  const char *why;

  PetscFunctionBeginUser;
  Case("%g in an unknown that no row reads, %d constraints, %s", (double)value, (int)m, outer.c_str());
  d.A.row(19).setZero();
  d.A.col(19).setZero();
  d.C.col(19).setZero();
  d.f[19] = 0.0;
  PetscCall(SystemFromDense(d, false, &run.sys));
  PetscCall(MatGetLocalSize(run.sys.A, &n, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, n, n, PETSC_DETERMINE, PETSC_DETERMINE, 3, NULL, 3, NULL, &A));
  PetscCall(WriteDense(d.A, A)); /* without the zero on its diagonal */
  PetscCall(MatCreateHermitianTranspose(run.sys.C, &Ct));
  PetscCall(NestCreate(A, Ct, run.sys.C, NULL, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&Ct));
  PetscCall(Inner(run, &inner, &pc));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetApply(pc, PoisonLast));
  PetscCall(PCShellSetContext(pc, &value));
  PetscCall(RunSolve(&run));
  PetscCall(CheckFailed(run));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  PetscCall(CheckText("the cause", why, {"Unknowns 19 of the primal field are in no equation"}));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FailingSetUp(PC pc)
{
  PetscFunctionBeginUser;
  PetscCall(AinsworthPCSetFailedReason(pc, PC_FACTOR_NUMERIC_ZEROPIVOT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An inner preconditioner fails in its set-up; another type of it, or the same for another A, does not */
static PetscErrorCode OtherType(bool type)
{
  Options     line("-ainsworth_ksp_rtol 1e-12 -ainsworth_pc_type shell");
  DenseSystem d = SpringsCreate(20, 4, 1.0, 16);
  Plan        plan;
  Run         run;
  KSP         inner;
  PC          pc;
  const char *why;

  PetscFunctionBeginUser;
  Case("after a failed set-up, %s", type ? "another type" : "the same type");
  PetscCall(RunCreate(d, false, &run));
  PetscCall(Inner(run, &inner, &pc));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetApply(pc, Identity));
  PetscCall(PCShellSetContext(pc, &plan));
  PetscCall(PCShellSetSetUp(pc, FailingSetUp));
  PetscCall(RunSolve(&run));
  PetscCall(CheckFailed(run));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  PetscCall(CheckText("the cause", why, {"The inner preconditioner, of type shell, failed (FACTOR_NUMERIC_ZEROPIVOT)"}));
  PetscCall(Inner(run, &inner, &pc));
  if (type) PetscCall(PCSetType(pc, PCJACOBI));
  else PetscCall(PCShellSetSetUp(pc, NULL));
  d.A *= 2.0;
  PetscCall(WriteDense(d.A, run.sys.A));
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(Limit());
  for (const char *method : {"projectedcg", "gcr", "gmres"}) PetscCall(Refinement(method));
  PetscCall(Monitored());
  PetscCall(Refused("jacobi -pc_ainsworth_penalty_factor 4e307", "of the preconditioning matrix holds NaN or Inf: the penalty factor"));
#if defined(PETSC_HAVE_HYPRE)
  PetscCall(Refused(PCHYPRE, "The preconditioning matrix is not positive definite, as BoomerAMG needs it: is A indefinite?"));
#endif
#if defined(PETSC_HAVE_SUITESPARSE) && !defined(PETSC_USE_COMPLEX)
  PetscMPIInt size;

  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  if (size == 1)
    PetscCall(Refused("cholesky -ainsworth_mat_cholmod_factor SUPERNODAL",
                      "The preconditioning matrix is not positive definite, as a Cholesky factorization needs it: is A indefinite?"));
#endif
  PetscCall(Multigrid());
  PetscCall(LastApplication());
  for (const char *outer : {"preonly", "fgmres", "gmres", "gcr"})
    for (const char *next : {"the same", "another nest of the same blocks", "another method"}) PetscCall(Stale(outer, next));
  for (const char *outer : {"fgmres", "gmres", "richardson"}) PetscCall(Guess(outer));
  for (PetscInt m : {0, 4}) PetscCall(Hidden(NAN, m, KSPPREONLY));
  for (const char *outer : {"gmres", "bcgs", "tfqmr"}) PetscCall(Hidden(1e20, 4, outer));
  for (bool type : {false, true}) PetscCall(OtherType(type));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
