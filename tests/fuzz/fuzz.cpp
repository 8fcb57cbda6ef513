static char help[] = "Random saddle-point systems and options: each ends with the solution or with a reason.\n\
  -cases <1000>   how many        -seed <1>      other systems\n\
  -only <k>       case k alone    -first <0>      the first case\n\
  -timeout <60>   seconds a case  -verbose       each case before it is solved, and its verdict\n\
  -errors <1>     also systems that are to be refused\n\
  -general <0>    share of [A B'; C -D]  -structured <0>  share of systems as programs write them\n\
A long run:  mpiexec -n 2 fuzz -cases 1000000 -seed 17\n\n";

#include "randomsaddle.h"
#include "structured.h"
#include <csignal>
#include <cstdio>
#include <cstring>
#include <unistd.h>

static char last[2048]; /* what a hang is reported with */

/* Nothing that allocates may be called here */
static void Hang(int)
{
  static const char what[] = "hang: ";

  if (write(STDOUT_FILENO, what, strlen(what)) < 0 || write(STDOUT_FILENO, last, strlen(last)) < 0) _exit(4);
  _exit(3);
}

enum Verdict {
  SOLVED,
  REASON,   /* a failure, with a reason, of a system that has no solution or is not promised one */
  REFUSED,  /* an error at set-up, where it belongs */
  UNSOLVED, /* a failure where a solution was promised */
  UNTRUE,   /* a reason, or an error, whose words are not true of the system */
  WRONG,    /* another solution, success without one, an error out of place, or ranks that do not agree */
  VERDICTS
};
static const char *const verdicts[] = {"solved", "with a reason", "refused", "unsolved", "untrue", "wrong"};

/*
   The solution is one if its error in x is at most the second figure times the condition number, relative to x and
   lambda, or, where it is not unique, its residual relative to |K| |y| + |b| at most the first plus rounding (with
   stiffnesses within 6 decades); all scaled. It is promised, rather than a reason, where condition numbers are below
   1e4, that of the Gram matrix too, and stiffnesses within 6 decades.
*/
static const PetscReal residualBound = 1e-7, errorBound = 1e-7;

/* A line of options; quick: the inner solver is direct */
static std::string RandomOptions(Random &r, const RandomSystem &s, const Truth &truth)
{
  static const char *const pmats[] = {"jcb", "id", "cc", "cg", "bj_cc", "bj_cg"};
  std::string              line    = "-ainsworth_ksp_rtol 1e-12 -ainsworth_ksp_max_it 3000";

  if (!s.uneven && r.Chance(0.3)) line += " -pc_ainsworth_variant paper";
  else if (!s.uneven && r.Chance(0.1)) line += " -pc_ainsworth_weight identity";
  else if (!s.uneven && r.Chance(0.1)) line += " -pc_ainsworth_penalty norm";
  if (r.Chance(0.5)) line += std::string(" -pc_ainsworth_pmat ") + pmats[r.Int(0, 5)]; /* otherwise auto, the default */
  if (!s.uneven && r.Chance(0.3)) line += " -pc_ainsworth_rows_per_rank " + std::to_string(r.Int(1, 4));
  if (!s.symmetric) line += " -ainsworth_ksp_type gmres -ainsworth_ksp_gmres_restart 100";
  switch (s.difficult || !truth.unique ? r.Int(1, 9) : r.Int(0, 9)) {
  case 0:
    break; /* hypre, whose errors on singular matrices outlive it */
  case 1:
  case 2:
  case 3:
    line += " -ainsworth_pc_type jacobi";
    break;
  default:
    line += s.symmetric ? " -ainsworth_pc_type redundant -ainsworth_redundant_pc_type cholesky"
                        : " -ainsworth_pc_type redundant";
  }
  return line;
}

static PetscErrorCode KeepMessage(MPI_Comm, int, const char *, const char *, PetscErrorCode code, PetscErrorType type,
                                  const char *message, void *ctx)
{
  if (type == PETSC_ERROR_INITIAL && message) *(std::string *)ctx = message;
  return code;
}

/* The verdict as this rank sees it */
static PetscErrorCode Judge(const RandomSystem &s, const Truth &truth, KSPConvergedReason reason, const Column &x,
                            const Column &lambda, Verdict *verdict, std::string &why)
{
  const bool promised = truth.consistent && truth.unique && !s.difficult && truth.condition < 1e4 && truth.gram < 1e4 &&
                        s.decades <= 6.0;
  const PetscReal residual = reason > 0 ? truth.Residual(s, x, lambda) : 0.0, error = reason > 0 ? truth.Error(x) : 0.0;
  char            text[256];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text), "%s, residual %g, error %g, condition %g, %s, %s",
                          KSPConvergedReasons[reason], (double)residual, (double)error, (double)truth.condition,
                          truth.contradictory ? "contradictory"
                          : truth.consistent  ? "consistent"
                                              : "nearly consistent",
                          truth.unique ? "unique" : "not unique"));
  why = text;
  if (reason <= 0) *verdict = promised ? UNSOLVED : REASON;
  else if (truth.contradictory) *verdict = WRONG;
  else if (truth.unique && truth.consistent)
    *verdict = error <= errorBound * PetscMax(1.0, truth.condition) ? SOLVED : WRONG;
  else
    *verdict = residual <= residualBound + PETSC_MACHINE_EPSILON * truth.condition || s.decades > 6.0 ? SOLVED : WRONG;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(const RandomSystem &s, const Truth &truth, Random &r, Verdict *verdict, std::string &why)
{
  Mat                nest;
  Vec                b, y;
  KSP                ksp;
  PC                 pc;
  KSPConvergedReason reason;
  PCFailedReason     failure;
  PetscErrorCode     code;
  std::string        message;
  Column             x, lambda;
  PetscMPIInt        agreed[4];

  PetscFunctionBeginUser;
  PetscCall(RandomNestCreate(PETSC_COMM_WORLD, s, r, &nest, &b));
  PetscCall(VecDuplicate(b, &y));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(PetscPushErrorHandler(KeepMessage, &message));
  code = KSPSolve(ksp, b, y);
  PetscCall(PetscPopErrorHandler());
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetFailedReason(pc, &failure));
  if (code) {
    *verdict = WRONG;
    why      = message;
  } else {
    PetscCall(RandomNestSplit(s, nest, y, x, lambda));
    PetscCall(Judge(s, truth, reason, x, lambda, verdict, why));
    if (reason < 0) why = std::string(PCFailedReasons[failure]) + ", " + why;
  }
  agreed[0] = (PetscMPIInt)code;
  agreed[1] = -agreed[0];
  agreed[2] = code ? 0 : (PetscMPIInt)reason;
  agreed[3] = -agreed[2];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, agreed, 4, MPI_INT, MPI_MAX, PETSC_COMM_WORLD));
  if (agreed[0] != -agreed[1] || agreed[2] != -agreed[3]) {
    *verdict = WRONG;
    why += "; ranks disagree";
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void SetVerdict(SaddleVerdict judged, bool promised, const Facts &facts, const Answer &answer, Verdict *verdict,
                       std::string &why)
{
  char text[160];

  switch (judged) {
  case SADDLE_RIGHT:
    *verdict = SOLVED;
    break;
  case SADDLE_REFUSED:
  case SADDLE_OWED:
    *verdict = promised ? UNSOLVED : answer.code ? REFUSED : REASON;
    break;
  case SADDLE_UNTRUE:
    *verdict = UNTRUE;
    break;
  default:
    *verdict = WRONG;
  }
  (void)snprintf(text, sizeof(text), "residual %g, error %g, reach %g, left %g, %s%s%s; ", answer.residual,
                 answer.error, facts.reach, facts.left, facts.decided ? "" : "undecided, ",
                 facts.solvable ? "solvable" : "not solvable", facts.unique ? "" : ", not unique");
  why = text + answer.said;
}

/* A system of the normal form, the same way */
static PetscErrorCode SolveGeneral(const RandomSaddle &p, Random &r, Verdict *verdict, std::string &why)
{
  const PetscInt local[2] = {RandomShare(PETSC_COMM_WORLD, r, (int)p.s.A.rows(), p.s.bs),
                             RandomShare(PETSC_COMM_WORLD, r, (int)p.s.C.rows(), 1)};
  const Facts    facts    = SaddleFacts(p.s);
  const double   asked    = 1e-11; /* of each row relative to its terms: ten times the tolerance */
  Answer         answer;

  PetscFunctionBeginUser;
  PetscCall(SaddleSolve(p.s, local, false, answer));
  const SaddleVerdict judged = SaddleJudge(p.s, facts, true, answer, asked / PETSC_MACHINE_EPSILON);

  SetVerdict(judged, RandomSaddlePromised(p, facts), facts, answer, verdict, why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* And a sparse one, judged on rank 0 */
static PetscErrorCode SolveStructured(const Structured &s, Random &r, Verdict *verdict, std::string &why)
{
  const PetscInt local[2] = {RandomShare(PETSC_COMM_WORLD, r, (int)s.A.rows(), s.bs),
                             RandomShare(PETSC_COMM_WORLD, r, (int)s.C.rows(), 1)};
  Answer         answer;
  PetscMPIInt    rank, said = WRONG;

  PetscFunctionBeginUser;
  PetscCall(StructuredSolve(s, local, answer));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (!rank) {
    const StructuredFacts facts  = StructuredTruth(s);
    const SaddleVerdict   judged = StructuredJudge(s, facts, answer);

    SetVerdict(judged, StructuredPromised(s, facts), facts, answer, verdict, why);
    said = *verdict;
  }
  PetscCallMPI(MPI_Bcast(&said, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  *verdict = (Verdict)said;
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscInt  cases = 1000, seed = 1, only = -1, first = 0, timeout = 60, count[VERDICTS] = {0};
  PetscBool verbose = PETSC_FALSE, errors = PETSC_TRUE, mixed = PETSC_TRUE;
  PetscReal general = 0.0, structured = 0.0;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  (void)setvbuf(stdout, NULL, _IOLBF, 0); /* a hang would take the lines before it away */
  (void)signal(SIGALRM, Hang);
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-timeout", &timeout, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-cases", &cases, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-seed", &seed, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-only", &only, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-first", &first, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-verbose", &verbose, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-errors", &errors, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-mix", &mixed, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-general", &general, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-structured", &structured, NULL));
  for (PetscInt k = only < 0 ? first : only; k < (only < 0 ? first + cases : only + 1); k++) {
    const PetscInt64 number = (PetscInt64)seed * 1000003 + k;
    /* streams of seeds in a row are shifts of each other */
    Random      mix(number), r(mixed ? (PetscInt64)(mix.Bits() >> 1) : number);
    std::string text, line, why;
    Verdict     verdict = WRONG;

    (void)snprintf(last, sizeof(last), "-seed %d -only %d\n", (int)seed, (int)k);
    (void)alarm((unsigned)timeout);
    if (structured > 0.0 && r.Chance(structured)) {
      const Structured system(r);
      Options          options(line = system.options);

      text = system.text;
      if (verbose)
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, "case %" PetscInt_FMT ": %s; %s\n", k, text.c_str(), line.c_str()));
      PetscCall(SolveStructured(system, r, &verdict, why));
    } else if (general > 0.0 && r.Chance(general)) {
      const RandomSaddle system(r);
      Options            options(line = system.options);

      text = system.text;
      if (verbose)
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, "case %" PetscInt_FMT ": %s; %s\n", k, text.c_str(), line.c_str()));
      PetscCall(SolveGeneral(system, r, &verdict, why));
    } else {
      const RandomSystem system(r, errors);
      const Truth        truth(system);
      Options            options(line = RandomOptions(r, system, truth));

      text = system.text;
      if (verbose)
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, "case %" PetscInt_FMT ": %s; %s\n", k, text.c_str(), line.c_str()));
      PetscCall(Solve(system, truth, r, &verdict, why));
    }
    (void)alarm(0);
    count[verdict]++;
    if (verbose || verdict >= UNSOLVED)
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: -seed %" PetscInt_FMT " -only %" PetscInt_FMT ": %s; %s; %s\n",
                            verdicts[verdict], seed, k, why.c_str(), text.c_str(), line.c_str()));
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%" PetscInt_FMT " cases:", only < 0 ? cases : 1));
  for (int v = 0; v < VERDICTS; v++)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s %" PetscInt_FMT " %s", v ? "," : "", count[v], verdicts[v]));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\n"));
  CheckLeaks();
  PetscCall(PetscFinalize());
  return count[UNSOLVED] + count[UNTRUE] + count[WRONG] > 0;
}
