static char help[] = "Sequences of up to ten actions on one KSP, a solve after each: right, refused, or a defect.\n\
  -steps <1000>   solves in all         -seed <1>      other sequences\n\
  -first <0>      the first sequence    -sequence <k>  sequence k alone\n\
  -timeout <60>   seconds for one step  -verbose       each step and its verdict\n\
A long run:  mpiexec -n 2 attack -steps 50000 -seed 17\n\n";

#include "attack.h"
#include <csignal>
#include <cstdio>
#include <cstring>
#include <execinfo.h>
#include <unistd.h>

static const char *const verdicts[] = {"right", "refused", "unsolved", "wrong"};
static char              last[8192]; /* what a crash or a hang is reported with */

/* Of a crash or a time-out; nothing that allocates may be called here */
static void Died(int number)
{
  void *frames[64];

  const char *const what = number == SIGALRM ? "HANG: " : "CRASH: ";

  if (write(STDOUT_FILENO, what, strlen(what)) < 0 || write(STDOUT_FILENO, last, strlen(last)) < 0) _exit(4);
  backtrace_symbols_fd(frames, backtrace(frames, 64), STDOUT_FILENO);
  _exit(3);
}

static std::string Reproducer(PetscInt seed, PetscInt sequence, PetscInt step)
{
  PetscMPIInt size;

  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return "mpiexec -n " + std::to_string(size) + " attack -seed " + std::to_string(seed) + " -sequence " +
         std::to_string(sequence) + " # step " + std::to_string(step);
}

struct Counts {
  PetscInt steps = 0, of[VERDICTS] = {0};
};

static PetscErrorCode Report(Counts &counts, Verdict verdict, bool verbose, const std::string &reproducer,
                             const std::string &why, const Attack &a)
{
  PetscFunctionBeginUser;
  counts.steps++;
  counts.of[verdict]++;
  if (verbose || verdict >= UNSOLVED)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: %s: %s\n    %s\n", verdicts[verdict], reproducer.c_str(), why.c_str(),
                          a.story.c_str()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What was for one step only is undone, then something is done */
static PetscErrorCode Prepare(Attack &a, PetscInt step, PetscErrorCode *code, std::string &message)
{
  PetscFunctionBeginUser;
  PetscCall(AttackCall(
    [&a, step]() -> PetscErrorCode {
      PetscFunctionBeginUser;
      if (!step) {
        PetscCall(AttackBuild(a, false));
        AttackChooseOptions(a, true);
        PetscCall(AttackSolver(a));
        PetscFunctionReturn(PETSC_SUCCESS);
      }
      PetscCall(AttackUndo(a));
      PetscCall(AttackAct(a));
      PetscFunctionReturn(PETSC_SUCCESS);
    },
    code, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Sequence(PetscInt seed, PetscInt sequence, PetscInt steps, PetscInt timeout, bool verbose,
                               Counts &counts)
{
  /* streams of seeds in a row are shifts of each other */
  Random         mix((PetscInt64)seed * 1000003 + sequence), r((PetscInt64)(mix.Bits() >> 1));
  RandomSystem   system(r, false);
  Attack         a((PetscInt64)r.Bits(), system);
  const PetscInt length = r.Int(1, 10);

  PetscFunctionBeginUser;
  a.story = system.text + " storage=" + std::to_string((int)a.storage) + (a.split ? " split" : "") +
            (a.s.nested ? " nested" : "");
  for (PetscInt step = 0; step <= length && counts.steps < steps; step++) {
    const std::string reproducer = Reproducer(seed, sequence, step);
    std::string       message, why;
    PetscErrorCode    code;
    Verdict           verdict = WRONG;

    (void)alarm((unsigned)timeout);
    snprintf(last, sizeof(last), "%s: in an action after\n    %s\n", reproducer.c_str(), a.story.c_str());
    PetscCall(Prepare(a, step, &code, message));
    snprintf(last, sizeof(last), "%s\n    %s\n", reproducer.c_str(), a.story.c_str());
    if (code) { /* the program cannot go on from here */
      PetscCall(Report(counts, AttackInternal(code, message) ? WRONG : REFUSED, verbose, reproducer,
                       "error in an action: " + message, a));
      break;
    }
    if (a.r.Chance(0.05)) {
      PetscCall(AttackElsewhere(a, &verdict, why));
      PetscCall(Report(counts, verdict, verbose, reproducer, why, a));
    }
    PetscCall(AttackSolve(a, &verdict, why));
    PetscCall(Report(counts, verdict, verbose, reproducer, why, a));
    if (a.errors == 2) break; /* after two errors in a solve a PCPreSolve() of PETSc's refuses any other */
  }
  std::string    message;
  PetscErrorCode code;

  PetscCall(AttackCall(
    [&a]() -> PetscErrorCode {
      PetscFunctionBeginUser;
      PetscCall(KSPDestroy(&a.ksp));
      PetscCall(AttackClear(a));
      PetscFunctionReturn(PETSC_SUCCESS);
    },
    &code, message));
  (void)alarm(0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscInt  steps = 1000, seed = 1, first = 0, only = -1, timeout = 60;
  PetscBool verbose = PETSC_FALSE;
  Counts    counts;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  (void)setvbuf(stdout, NULL, _IOLBF, 0); /* a crash would take the lines before it away */
  PetscCall(PetscPopSignalHandler());
  for (int number : {SIGALRM, SIGSEGV, SIGBUS, SIGFPE, SIGABRT, SIGILL}) (void)signal(number, Died);
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-steps", &steps, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-seed", &seed, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-first", &first, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-sequence", &only, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-timeout", &timeout, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-verbose", &verbose, NULL));
  {
    Options base("-ainsworth_ksp_rtol 1e-10 -ainsworth_ksp_max_it 500 -ksp_rtol 1e-10 -ksp_atol 0 -ksp_max_it 200");

    for (PetscInt sequence = only < 0 ? first : only; counts.steps < steps && (only < 0 || sequence == only);
         sequence++)
      PetscCall(Sequence(seed, sequence, steps, timeout, verbose, counts));
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%" PetscInt_FMT " steps:", counts.steps));
  for (int v = 0; v < VERDICTS; v++)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s %" PetscInt_FMT " %s", v ? "," : "", counts.of[v], verdicts[v]));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\n"));
  CheckLeaks();
  PetscCall(PetscFinalize());
  /* a plugin that refuses all would have nothing wrong */
  return counts.of[UNSOLVED] + counts.of[WRONG] > 0 || (counts.steps > 100 && 3 * counts.of[RIGHT] < counts.steps);
}
