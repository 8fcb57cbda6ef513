static char help[] = "Error against run time: one solver over a series of tolerances, against the exact solution.\n"
                     "The system is the two cubes, or that of -A -B -C -D -f -g; the solver is what the options say "
                     "(-options_file tests/bench/solvers/<name>.opts).\n\n";

#include "cubes.h"
#include "forms.h"
#include "reference.h"
#include "report.h"
#include "system.h"
#include <petsctime.h>
#include <sys/resource.h>
#include <string>

struct Choices {
  char      name[128], tolerance[128], reference[PETSC_MAX_PATH_LEN], out[PETSC_MAX_PATH_LEN];
  PetscBool hasReference, hasOut;
  FormType  form;
  PetscReal gamma, enough;
  PetscInt  first, last, step, repetitions;
};

struct System {
  SaddleBlocks blocks;
  Vec          f, g, x, lambda; /* with its exact solution */
};

static PetscErrorCode ChoicesGet(MPI_Comm comm, Choices *c)
{
  PetscFunctionBeginUser;
  *c             = Choices();
  c->form        = FORM_NEST;
  c->gamma       = 1;
  c->enough      = 20;
  c->first       = 1;
  c->last        = 12;
  c->step        = 1;
  c->repetitions = 3;
  PetscCall(PetscStrncpy(c->name, "solver", sizeof(c->name)));
  PetscCall(PetscStrncpy(c->tolerance, "ksp_rtol", sizeof(c->tolerance)));
  PetscOptionsBegin(comm, NULL, "Error against run time", NULL);
  PetscCall(
    PetscOptionsString("-name", "What the rows call the solver", NULL, c->name, c->name, sizeof(c->name), NULL));
  PetscCall(PetscOptionsEnum("-form", "What the solver gets", NULL, FormTypes, (PetscEnum)c->form,
                             (PetscEnum *)&c->form, NULL));
  PetscCall(PetscOptionsReal("-augmentation", "gamma of -form augmented [-]", NULL, c->gamma, &c->gamma, NULL));
  PetscCall(PetscOptionsString("-tolerance_option",
                               "Option that takes the tolerance; none: the solver has no tolerance", NULL, c->tolerance,
                               c->tolerance, sizeof(c->tolerance), NULL));
  PetscCall(PetscOptionsInt("-first", "Tolerances from 10^-first", NULL, c->first, &c->first, NULL));
  PetscCall(PetscOptionsInt("-last", "to 10^-last", NULL, c->last, &c->last, NULL));
  PetscCall(PetscOptionsInt("-step", "in steps of 10^-step", NULL, c->step, &c->step, NULL));
  PetscCall(
    PetscOptionsInt("-repetitions", "Times are the least of this many", NULL, c->repetitions, &c->repetitions, NULL));
  PetscCall(
    PetscOptionsReal("-enough", "Repeat a tolerance no more after this time [s]", NULL, c->enough, &c->enough, NULL));
  PetscCall(PetscOptionsString("-reference", "File of the exact solution; computed and written if it is not there",
                               NULL, "", c->reference, sizeof(c->reference), &c->hasReference));
  PetscCall(
    PetscOptionsString("-out", "Append the rows to this file, too", NULL, "", c->out, sizeof(c->out), &c->hasOut));
  PetscOptionsEnd();
  PetscCheck(c->first >= 0 && c->last >= c->first && c->last <= 15, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Options -first %" PetscInt_FMT " -last %" PetscInt_FMT ": 0 <= first <= last <= 15", c->first, c->last);
  PetscCheck(c->step >= 1, comm, PETSC_ERR_ARG_OUTOFRANGE, "Option -step is %" PetscInt_FMT ", it must be at least 1",
             c->step);
  PetscCheck(c->repetitions >= 1, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Option -repetitions is %" PetscInt_FMT ", it must be at least 1", c->repetitions);
  PetscCheck(c->gamma > 0, comm, PETSC_ERR_ARG_OUTOFRANGE, "Option -augmentation is %g, it must be positive",
             (double)c->gamma);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateSystem(MPI_Comm comm, const Choices &choices, System *s)
{
  CubesOptions options;
  CubesSystem  cubes;
  PetscBool    files, stored = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(SystemLoad(comm, &files, &s->blocks, &s->f, &s->g));
  if (!files) {
    PetscCall(CubesOptionsGet(comm, &options));
    PetscCall(CubesSystemCreate(comm, options, &cubes));
    s->blocks = {cubes.A, cubes.C};
    s->f      = cubes.f;
    s->g      = cubes.g;
  }
  PetscCall(VecDuplicate(s->f, &s->x));
  PetscCall(VecDuplicate(s->g, &s->lambda));
  if (choices.hasReference) PetscCall(PetscTestFile(choices.reference, 'r', &stored));
  if (stored) PetscCall(ReferenceLoad(choices.reference, s->x, s->lambda));
  else {
    PetscCall(ReferenceCompute(s->blocks, s->f, s->g, s->x, s->lambda));
    if (choices.hasReference) PetscCall(ReferenceSave(choices.reference, s->x, s->lambda));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DestroySystem(System *s)
{
  PetscFunctionBeginUser;
  PetscCall(SystemDestroy(&s->blocks));
  for (Vec *v : {&s->f, &s->g, &s->x, &s->lambda}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Now(MPI_Comm comm, PetscLogDouble *seconds)
{
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Barrier(comm));
  PetscCall(PetscTime(seconds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest resident memory so far, of all ranks together [MB] */
static PetscErrorCode PeakMemory(MPI_Comm comm, double *sum)
{
  struct rusage usage;
  double        mine;

  PetscFunctionBeginUser;
  getrusage(RUSAGE_SELF, &usage);
  mine = (double)usage.ru_maxrss / 1024; /* Linux: kilobytes */
  PetscCallMPI(MPI_Allreduce(&mine, sum, 1, MPI_DOUBLE, MPI_SUM, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

struct Result {
  PetscLogDouble     setup, solve;
  PetscInt           iterations;
  KSPConvergedReason reason;
  Vec                x, lambda;
};

/* Set-up and solve once; forming what the solver gets counts where it is work that the solver asked for */
static PetscErrorCode Solve(const System &s, const Choices &choices, Result *result)
{
  const bool     forming = choices.form == FORM_AUGMENTED || choices.form == FORM_ELIMINATED;
  MPI_Comm       comm    = PetscObjectComm((PetscObject)s.blocks.A);
  PetscLogDouble begin, formed, ready, end;
  PetscBool      split;
  Form           form;
  KSP            ksp;
  PC             pc;

  PetscFunctionBeginUser;
  PetscCall(Now(comm, &begin));
  PetscCall(FormCreate(s.blocks, s.f, s.g, choices.form, choices.gamma, &form));
  PetscCall(Now(comm, &formed));
  PetscCall(KSPCreate(comm, &ksp));
  PetscCall(KSPSetOperators(ksp, form.K, form.M));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCFIELDSPLIT, &split));
  if (split && form.fields[0]) {
    PetscCall(PCFieldSplitSetIS(pc, "0", form.fields[0]));
    PetscCall(PCFieldSplitSetIS(pc, "1", form.fields[1]));
  }
  PetscCall(KSPSetUp(ksp));
  PetscCall(KSPSetUpOnBlocks(ksp));
  PetscCall(Now(comm, &ready));
  PetscCall(KSPSolve(ksp, form.rhs, form.y));
  PetscCall(Now(comm, &end));
  result->setup = ready - (forming ? begin : formed);
  result->solve = end - ready;
  PetscCall(KSPGetConvergedReason(ksp, &result->reason));
  PetscCall(ReportIterations(ksp, &result->iterations));
  PetscCall(FormGetSolution(form, result->x, result->lambda));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(FormDestroy(&form));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sqrt(v' A v), or the 2-norm without A */
static PetscErrorCode Norm(Mat A, Vec v, PetscReal *norm)
{
  PetscScalar square;
  Vec         w;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(v, &w));
  if (A) PetscCall(MatMult(A, v, w));
  else PetscCall(VecCopy(v, w));
  PetscCall(VecDot(w, v, &square));
  *norm = PetscSqrtReal(PetscAbsScalar(square));
  PetscCall(VecDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RelativeError(Mat A, Vec exact, Vec v, PetscReal *error)
{
  PetscReal norm;
  Vec       e;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(v, &e));
  PetscCall(VecWAXPY(e, -1.0, v, exact));
  PetscCall(Norm(A, e, error));
  PetscCall(Norm(A, exact, &norm));
  if (norm > 0) *error /= norm;
  PetscCall(VecDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Write(MPI_Comm comm, const Choices &choices, const char text[])
{
  FILE *file;

  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(comm, "%s", text));
  if (!choices.hasOut) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFOpen(comm, choices.out, "a", &file));
  PetscCall(PetscFPrintf(comm, file, "%s", text));
  PetscCall(PetscFClose(comm, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One tolerance: the least times of the repetitions, the errors of the last */
static PetscErrorCode Run(const System &s, const Choices &choices, PetscInt digits, KSPConvergedReason *reason)
{
  const bool     direct    = std::string(choices.tolerance) == "none";
  const double   tolerance = direct ? 0 : PetscPowReal(10, -digits);
  MPI_Comm       comm      = PetscObjectComm((PetscObject)s.blocks.A);
  PetscLogDouble setup = PETSC_MAX_REAL, solve = PETSC_MAX_REAL, spent = 0;
  PetscReal      energy, multiplier, residuals[2];
  double         memory;
  char           text[512], value[32];
  Result         result;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(s.x, &result.x));
  PetscCall(VecDuplicate(s.lambda, &result.lambda));
  PetscCall(PetscSNPrintf(value, sizeof(value), "%g", tolerance));
  if (!direct) PetscCall(PetscOptionsSetValue(NULL, (std::string("-") + choices.tolerance).c_str(), value));
  for (PetscInt i = 0; i < choices.repetitions && spent <= choices.enough; i++) {
    PetscCall(Solve(s, choices, &result));
    setup = PetscMin(setup, result.setup);
    solve = PetscMin(solve, result.solve);
    spent += result.setup + result.solve;
    PetscCallMPI(MPI_Bcast(&spent, 1, MPI_DOUBLE, 0, comm));
  }
  PetscCall(RelativeError(s.blocks.A, s.x, result.x, &energy));
  PetscCall(RelativeError(NULL, s.lambda, result.lambda, &multiplier));
  PetscCall(ReportResiduals(s.blocks, s.f, s.g, result.x, result.lambda, residuals));
  PetscCall(PeakMemory(comm, &memory));
  PetscCall(PetscSNPrintf(text, sizeof(text), "%s,%g,%.6f,%.6f,%" PetscInt_FMT ",%.1f,%.4e,%.4e,%.4e,%.4e,%s\n",
                          choices.name, tolerance, (double)setup, (double)solve, result.iterations, memory,
                          (double)energy, (double)multiplier, (double)residuals[0], (double)residuals[1],
                          KSPConvergedReasons[result.reason]));
  PetscCall(Write(comm, choices, text));
  *reason = result.reason;
  PetscCall(VecDestroy(&result.x));
  PetscCall(VecDestroy(&result.lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  Choices            choices;
  System             system;
  PetscInt           m, n;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(ChoicesGet(PETSC_COMM_WORLD, &choices));
  PetscCall(CreateSystem(PETSC_COMM_WORLD, choices, &system));
  PetscCall(MatGetSize(system.blocks.C, &m, &n));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "# unknowns=%" PetscInt_FMT " constraints=%" PetscInt_FMT "\n", n, m));
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD,
                "solver,tolerance,setup_s,solve_s,iterations,memory_mb,energy_error,multiplier_error,primal_residual,"
                "constraint_residual,reason\n"));
  for (PetscInt digits = choices.first; digits <= choices.last && reason >= 0; digits += choices.step) {
    PetscCall(Run(system, choices, digits, &reason));
    if (std::string(choices.tolerance) == "none") break;
  }
  PetscCall(DestroySystem(&system));
  PetscCall(PetscFinalize());
  return 0;
}
