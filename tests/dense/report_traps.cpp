static char help[] = "The error monitor after errors inside the inner KSP, after options read twice, and of two KSPs in one file.\n\n";

#include "dense.h"

static System sys;
static Mat    nest;

/* Jacobi's preconditioner that raises an error at one of its calls */
static int calls, failing;

static PetscErrorCode Precondition(PC pc, Vec r, Vec z)
{
  Vec *weight;

  PetscFunctionBeginUser;
  PetscCheck(++calls != failing, PetscObjectComm((PetscObject)pc), PETSC_ERR_USER, "an error in the middle");
  PetscCall(PCShellGetContext(pc, (void **)&weight));
  PetscCall(VecPointwiseMult(z, r, *weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

struct Solver {
  KSP      ksp = NULL, inner = NULL;
  Vec      b = NULL, y = NULL, weight = NULL;
  PetscInt steps = 0;
};

static PetscErrorCode SolverSetUp(Solver *s)
{
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &s->ksp));
  PetscCall(KSPSetType(s->ksp, KSPPREONLY));
  PetscCall(KSPSetOperators(s->ksp, nest, nest));
  PetscCall(KSPGetPC(s->ksp, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(PCAinsworthGetKSP(pc, &s->inner));
  PetscCall(KSPGetPC(s->inner, &pc));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetApply(pc, Precondition));
  PetscCall(PCShellSetContext(pc, &s->weight));
  PetscCall(MatCreateVecs(sys.A, &s->weight, NULL));
  PetscCall(MatGetDiagonal(sys.A, s->weight));
  PetscCall(VecReciprocal(s->weight));
  PetscCall(MatCreateVecs(nest, &s->y, &s->b));
  PetscCall(SetRandom(s->b, 3));
  PetscCall(KSPSetFromOptions(s->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SolverDestroy(Solver *s)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&s->ksp));
  PetscCall(VecDestroy(&s->b));
  PetscCall(VecDestroy(&s->y));
  PetscCall(VecDestroy(&s->weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(Solver *s)
{
  PetscFunctionBeginUser;
  PetscCall(KSPSolve(s->ksp, s->b, s->y));
  PetscCall(KSPGetIterationNumber(s->inner, &s->steps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An error in the solve is passed on; the next solves are as if there had been none. PETSc itself does not allow for a second error */
static PetscErrorCode AfterError(const std::string &line)
{
  Options  options("-ainsworth_ksp_rtol 1e-10 " + line);
  Solver   s;
  Mat      before, after;
  PetscInt steps;
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);

  PetscFunctionBeginUser;
  Case("an error in the solve, %s", line.c_str());
  failing = 0;
  PetscCall(SolverSetUp(&s));
  PetscCall(Solve(&s));
  steps = s.steps;
  PetscCall(KSPGetOperators(s.inner, &before, NULL));
  calls   = 0;
  failing = 4;
  PetscCall(CheckError("solve", [&s]() { return Solve(&s); }, PETSC_ERR_USER, {"an error in the middle"}));
  failing = 0;
  PetscCall(KSPGetConvergenceTest(s.inner, &converged, NULL, NULL));
  PetscCall(CheckTrue("the KSP has its own test again", converged == KSPConvergedDefault));
  PetscCall(KSPGetOperators(s.inner, &after, NULL));
  PetscCall(CheckTrue("and its operator", after == before));
  for (int repeat = 0; repeat < 2; repeat++) {
    PetscCall(Solve(&s));
    PetscCall(CheckInt("steps after the error", s.steps, steps));
  }
  PetscCall(SolverDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A KSP that was left by an error can be taken apart */
static PetscErrorCode DestroyedAfterError()
{
  Options options("-pc_ainsworth_stop energy_error");
  Solver  s;

  PetscFunctionBeginUser;
  Case("destroyed after an error");
  PetscCall(SolverSetUp(&s));
  calls   = 0;
  failing = 3;
  PetscCall(CheckError("solve", [&s]() { return Solve(&s); }, PETSC_ERR_USER, {"an error in the middle"}));
  failing = 0;
  PetscCall(KSPReset(s.ksp));
  PetscCall(KSPSetOperators(s.ksp, nest, nest));
  PetscCall(Solve(&s));
  PetscCall(SolverDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How often a text stands in another */
static PetscInt Count(const std::string &text, const std::string &part)
{
  PetscInt count = 0;

  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) count++;
  return count;
}

/* One header, one number for each solve, whoever solves: KSPs on one communicator share a file, and what is read twice begins nothing anew */
static PetscErrorCode OneFile(const std::string &first, const std::string &second)
{
  Solver      s[2];
  std::string text;

  PetscFunctionBeginUser;
  Case("one file, %s and %s", first.c_str(), second.c_str());
  for (int k = 0; k < 2; k++) {
    Options options("-pc_ainsworth_monitor_error " + (k ? second : first));
    PetscCall(SolverSetUp(&s[k]));
    PetscCall(Solve(&s[k]));
  }
  for (int turn = 0; turn < 2; turn++) {
    for (int k = 0; k < 2; k++) {
      Options options("-pc_ainsworth_monitor_error " + (turn ? first : second));
      PetscCall(KSPSetFromOptions(s[k].ksp));
      PetscCall(Solve(&s[k]));
    }
  }
  for (Solver &solver : s) PetscCall(SolverDestroy(&solver));
  PetscCall(FileText("one.csv", text));
  PetscCall(CheckInt("headers", Count(text, "solve,seconds"), 1));
  PetscCall(CheckInt("at the top", text.find("solve,seconds"), 0));
  for (const char *solve : {"1", "2", "3", "4", "5", "6"})
    PetscCall(CheckInt((std::string("rows of the first iterate, solve ") + solve).c_str(), Count(text, std::string("\n") + solve + ",0."), s[0].steps + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file that is appended to has its header already */
static PetscErrorCode Appended()
{
  std::string text;

  PetscFunctionBeginUser;
  Case("appended");
  for (int k = 0; k < 2; k++) {
    Options options("-pc_ainsworth_monitor_error ascii:one.csv:ascii_csv:append");
    Solver  s;

    PetscCall(SolverSetUp(&s));
    PetscCall(Solve(&s));
    PetscCall(SolverDestroy(&s));
  }
  PetscCall(FileText("one.csv", text));
  PetscCall(CheckInt("headers", Count(text, "solve,seconds"), 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const Spec spec;
  int        exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
  for (const char *variant : {"", " -pc_ainsworth_variant paper"}) {
    for (const char *line : {"", "-pc_ainsworth_stop energy_error -pc_ainsworth_error_rtol 1e-8", "-pc_ainsworth_monitor_error ascii:table.txt"})
      PetscCall(AfterError(std::string(line) + variant));
  }
  PetscCall(DestroyedAfterError());
  PetscCall(OneFile("csv:one.csv", "csv:one.csv"));
  PetscCall(OneFile("csv:one.csv", "ascii:one.csv:ascii_csv"));
  PetscCall(Appended());
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
