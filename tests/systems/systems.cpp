static char help[] = "Saddle points as programs write them, each against a reference in extended precision.\n\
  systems -list | -only <name or family> | (all)\n\
  -out <file.csv>   a row for each           -mumps   MUMPS, without refinement, instead of what the options say\n\
  -verbose          what each refusal says   -write <prefix>  A, B, C, D, f, g to <prefix>_A.dat and so on instead\n\n";

#include "systems.h"
#include <petsctime.h>

enum Verdict {
  RIGHT,   /* a positive reason, both equations hold row by row, and x is the reference's */
  REFUSED, /* a reason or an error that is true of the system */
  OWED,    /* the same where there is an answer, and x is unique: it could have been solved */
  UNTRUE,  /* what the refusal says is not so */
  WRONG,   /* another answer, or ranks that do not agree */
  VERDICTS
};
static const char *const verdicts[] = {"right", "refused", "owed", "untrue", "wrong"};

/* Of each equation relative to its terms, and of x, in units of its own, relative to x or to what rounding the system may change */
static const double residualBound = 1e-5, errorBound = 1e-6, beyondReach = 1e3;

/* Systems that have an answer which is not found yet: they are not to be wrong, and one that is right may be taken from this list */
static const char *const owed[] = {"active_30_compliant",
                                   "active_50",
                                   "active_50_minus",
                                   "active_50_values",
                                   "active_90",
                                   "active_none",
                                   "asymmetric_10",
                                   "asymmetric_100",
                                   "asymmetric_30",
                                   "boundary_finer_2",
                                   "compliant_1e-16",
                                   "compliant_mass_1e-2",
                                   "compliant_mass_1e-8",
                                   "compliant_mass_1e2",
                                   "control_reduced_1e-10",
                                   "control_reduced_1e-2",
                                   "control_reduced_1e-6",
                                   "coulomb_2",
                                   "coulomb_5",
                                   "coulomb_9",
                                   "coulomb_compliant",
                                   "dirichlet_columns_active",
                                   "double_1",
                                   "double_dependent",
                                   "double_pascal",
                                   "double_stacked",
                                   "inequalities_end",
                                   "lp_degenerate_end",
                                   "lp_end_regular",
                                   "perturbed_scaled",
                                   "pspg_closed",
                                   "pspg_open",
                                   "pspg_weak",
                                   "qp_regular",
                                   "rows_inactive",
                                   "signs_flipped_D",
                                   "signs_flipped_first_D",
                                   "signs_identity",
                                   "signs_identity_indefinite",
                                   "signs_negated_D",
                                   "signs_negated_first_D",
                                   "signs_opposite_D",
                                   "staggered_nearly",
                                   "stick_slip_3",
                                   "stick_slip_9",
                                   NULL};

struct Answer {
  Verdict     verdict    = WRONG;
  PetscInt    iterations = -1;
  double      residual = NAN, error = NAN, reach = 0.0;
  std::string said;
};

Random SaddleRandom(const std::string &name)
{
  uint64_t hash = 1469598103934665603u; /* FNV-1a */

  for (char c : name) hash = (hash ^ (uint64_t)(unsigned char)c) * 1099511628211u;
  return Random((PetscInt64)(hash >> 1));
}

Saddle SaddleMake(const Entry &e)
{
  Saddle s;
  double second, column;

  s.family = e.family;
  s.name   = e.name;
  e.make(s);
  const double whole = s.convention == NEGATED ? -1.0 : 1.0;
  second             = s.convention == FLIPPED ? -1.0 : whole;
  column             = s.convention == OPPOSITE ? -1.0 : whole;
  s.block[0][0]      = whole * s.A;
  s.block[0][1]      = column * s.B.transpose();
  s.block[1][0]      = second * s.C;
  s.block[1][1]      = (s.convention == OPPOSITE ? 1.0 : -second) * s.D;
  s.rhs[0]           = whole * s.f;
  s.rhs[1]           = second * s.g;
  return s;
}

static PetscErrorCode KeepMessage(MPI_Comm, int, const char *, const char *, PetscErrorCode code, PetscErrorType type, const char *message, void *ctx)
{
  if (type == PETSC_ERROR_INITIAL && message) *(std::string *)ctx = message;
  return code;
}

/* Rows spread evenly, in whole blocks */
static PetscInt Share(int total, int bs)
{
  PetscMPIInt    rank, size;
  const PetscInt blocks = total / bs;

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return bs * (blocks / size + (rank < blocks % size));
}

static PetscErrorCode CreateNest(const Saddle &s, Mat *nest)
{
  const PetscInt local[2]     = {Share((int)s.A.rows(), s.bs), Share((int)s.C.rows(), 1)};
  Mat            blocks[2][2] = {
               {NULL, NULL},
               {NULL, NULL}
  };

  PetscFunctionBeginUser;
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++)
      if (s.block[i][j].size())
        PetscCall(RandomFill(PETSC_COMM_WORLD, s.block[i][j].cast<PetscScalar>(), local[i], local[j], i + j ? 1 : s.bs, false, &blocks[i][j]));
  PetscCall(NestCreate(blocks[0][0], blocks[0][1], blocks[1][0], blocks[1][1], s.first, nest));
  for (auto &row : blocks)
    for (Mat &M : row) PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of x, or of lambda, of a vector of the nest */
static PetscErrorCode Field(const Saddle &s, Mat nest, Vec all, int k, const std::function<PetscErrorCode(Vec)> &action)
{
  IS  is[2];
  Vec sub;

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(nest, is, NULL));
  PetscCall(VecGetSubVector(all, is[s.first ? 1 - k : k], &sub));
  PetscCall(action(sub));
  PetscCall(VecRestoreSubVector(all, is[s.first ? 1 - k : k], &sub));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateSolver(const Saddle &s, Mat nest, bool mumps, KSP *ksp)
{
  PC  pc;
  Mat aij;

  PetscFunctionBeginUser;
  if (!mumps) {
    PetscCall(SolverCreate(nest, ksp));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  const bool symmetric = s.block[0][0] == s.block[0][0].transpose() && s.block[1][0] == s.block[0][1].transpose();

  PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, &aij));
  PetscCall(MatSetOption(aij, MAT_SYMMETRIC, symmetric ? PETSC_TRUE : PETSC_FALSE));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, ksp));
  PetscCall(KSPSetOperators(*ksp, aij, aij));
  PetscCall(MatDestroy(&aij));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, symmetric ? PCCHOLESKY : PCLU));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The iterations of the reduced solve, and what it says of a failure */
static PetscErrorCode AskSolver(KSP ksp, Answer &a)
{
  PC          pc;
  KSP         inner;
  PetscBool   ours;
  const char *why;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCAINSWORTH, &ours));
  if (!ours) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetIterationNumber(inner, &a.iterations));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  a.said = why;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Judge(const Saddle &s, const Facts &facts, bool ours, bool answered, const Vector &x, const Vector &lambda, Answer &a)
{
  a.reach = facts.reach;
  if (!answered) {
    a.verdict = ours && !SaddleSaysTrue(s, facts, a.said) ? UNTRUE : facts.solvable && facts.unique ? OWED : REFUSED;
    return;
  }
  a.residual = SaddleResidual(s, x, lambda);
  a.error    = SaddleError(facts, x);
  a.verdict  = facts.solvable && a.residual <= residualBound && (!facts.unique || a.error <= std::max(errorBound, beyondReach * facts.reach)) ? RIGHT : WRONG;
}

static PetscErrorCode Solve(const Saddle &s, const Facts &facts, bool mumps, Answer &a)
{
  Mat                nest;
  Vec                b, y;
  KSP                ksp;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  PetscErrorCode     code;
  PetscMPIInt        agreed[4], rank;
  Column             part[2];
  std::string        message;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(CreateNest(s, &nest));
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, Share((int)s.A.rows(), s.bs) + Share((int)s.C.rows(), 1), PETSC_DETERMINE, &b));
  for (int k = 0; k < 2; k++) PetscCall(Field(s, nest, b, k, [&](Vec v) { return Scatter(s.rhs[k].cast<PetscScalar>(), v); }));
  PetscCall(VecDuplicate(b, &y));
  PetscCall(CreateSolver(s, nest, mumps, &ksp));
  PetscCall(PetscPushErrorHandler(KeepMessage, &message));
  code = KSPSolve(ksp, b, y);
  PetscCall(PetscPopErrorHandler());
  if (code) a.said = message;
  else {
    PetscCall(KSPGetConvergedReason(ksp, &reason));
    PetscCall(AskSolver(ksp, a));
    for (int k = 0; k < 2; k++) PetscCall(Field(s, nest, y, k, [&](Vec v) { return Gather(v, part[k]); }));
  }
  if (!rank) Judge(s, facts, !mumps, !code && reason > 0, part[0].real(), part[1].real(), a);
  agreed[0] = (PetscMPIInt)code;
  agreed[1] = -agreed[0];
  agreed[2] = code ? 0 : (PetscMPIInt)reason;
  agreed[3] = -agreed[2];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, agreed, 4, MPI_INT, MPI_MAX, PETSC_COMM_WORLD));
  if (agreed[0] != -agreed[1] || agreed[2] != -agreed[3]) {
    a.verdict = WRONG;
    a.said += "; ranks disagree";
  }
  PetscCallMPI(MPI_Bcast(&a.verdict, (PetscMPIInt)sizeof(a.verdict), MPI_BYTE, 0, PETSC_COMM_WORLD));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0; what the generator says of its system has to be so */
static PetscErrorCode FindFacts(const Saddle &s, Facts *facts)
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (rank) PetscFunctionReturn(PETSC_SUCCESS);
  *facts = SaddleFacts(s);
  PetscCheck(facts->solvable == s.solvable, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s is %ssolvable", s.name.c_str(), facts->solvable ? "" : "not ");
  PetscCheck(facts->unique == s.unique, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s: x is %sunique", s.name.c_str(), facts->unique ? "" : "not ");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Row(const Saddle &s, const Answer &a, FILE *csv, bool verbose)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%-30s %4d %4d %-8s %4" PetscInt_FMT " residual %.1e error %.1e (%.0e)%s%s\n", s.name.c_str(), (int)s.A.rows(),
                        (int)s.C.rows(), verdicts[a.verdict], a.iterations, a.residual, a.error, a.reach, verbose || a.verdict >= UNTRUE ? "  " : "",
                        verbose || a.verdict >= UNTRUE ? a.said.c_str() : ""));
  if (csv)
    PetscCall(PetscFPrintf(PETSC_COMM_WORLD, csv, "%s,%s,%d,%d,%s,%" PetscInt_FMT ",%.1e,%.1e,%.0e\n", s.family.c_str(), s.name.c_str(), (int)s.A.rows(),
                           (int)s.C.rows(), verdicts[a.verdict], a.iterations, a.residual, a.error, a.reach));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For tutorials/benchmark/solve and errortime; D is zero where the program passes none */
static PetscErrorCode Write(const Saddle &s, const std::string &prefix)
{
  const PetscInt n = Share((int)s.A.rows(), s.bs), m = Share((int)s.C.rows(), 1);
  const Matrix   D = s.D.size() ? s.D : Matrix::Zero(s.C.rows(), s.C.rows());
  const struct {
    const char   *name;
    const Matrix &values;
    PetscInt      rows, columns;
  } matrices[] = {
    {"A", s.A, n, n},
    {"B", s.B, m, n},
    {"C", s.C, m, n},
    {"D", D,   m, m}
  };
  const struct {
    const char   *name;
    const Vector &values;
    PetscInt      rows;
  } vectors[] = {
    {"f", s.f, n},
    {"g", s.g, m}
  };
  PetscViewer viewer;

  PetscFunctionBeginUser;
  for (const auto &M : matrices) {
    Mat mat;

    PetscCall(RandomFill(PETSC_COMM_WORLD, M.values.cast<PetscScalar>(), M.rows, M.columns, 1, false, &mat));
    PetscCall(PetscViewerBinaryOpen(PETSC_COMM_WORLD, (prefix + "_" + M.name + ".dat").c_str(), FILE_MODE_WRITE, &viewer));
    PetscCall(MatView(mat, viewer));
    PetscCall(PetscViewerDestroy(&viewer));
    PetscCall(MatDestroy(&mat));
  }
  for (const auto &v : vectors) {
    Vec vec;

    PetscCall(VecCreateMPI(PETSC_COMM_WORLD, v.rows, PETSC_DETERMINE, &vec));
    PetscCall(Scatter(v.values.cast<PetscScalar>(), vec));
    PetscCall(PetscViewerBinaryOpen(PETSC_COMM_WORLD, (prefix + "_" + v.name + ".dat").c_str(), FILE_MODE_WRITE, &viewer));
    PetscCall(VecView(vec, viewer));
    PetscCall(PetscViewerDestroy(&viewer));
    PetscCall(VecDestroy(&vec));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char      only[128], out[PETSC_MAX_PATH_LEN], prefix[PETSC_MAX_PATH_LEN];
  PetscInt  count[VERDICTS] = {0}, total = 0, unexpected = 0;
  PetscBool list = PETSC_FALSE, mumps = PETSC_FALSE, verbose = PETSC_FALSE, some, hasOut, write;
  FILE     *csv = NULL;
  Entries   all;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-list", &list, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-mumps", &mumps, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-verbose", &verbose, NULL));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-only", only, sizeof(only), &some));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-out", out, sizeof(out), &hasOut));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-write", prefix, sizeof(prefix), &write));
  for (auto add : {AddContact, AddMultipliers, AddOptimization, AddFlow, AddStructures}) add(all);
  if (hasOut) {
    PetscCall(PetscFOpen(PETSC_COMM_WORLD, out, "w", &csv));
    PetscCall(PetscFPrintf(PETSC_COMM_WORLD, csv, "family,name,n,m,verdict,iterations,residual,error,reach\n"));
  }
  for (const Entry &e : all) {
    Answer answer;
    bool   expected = false;

    if (some && e.name != only && e.family != only) continue;
    total++;
    if (list) {
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%-24s %s\n", e.family.c_str(), e.name.c_str()));
      continue;
    }
    const Saddle s = SaddleMake(e);
    Facts        facts;

    if (write) {
      PetscCall(Write(s, prefix));
      continue;
    }
    PetscCall(FindFacts(s, &facts));
    PetscCall(Solve(s, facts, mumps, answer));
    count[answer.verdict]++;
    PetscCall(Row(s, answer, csv, verbose));
    for (const char *const *name = owed; *name; name++) expected = expected || e.name == *name;
    unexpected += answer.verdict == WRONG || (answer.verdict > REFUSED && !expected);
    if (expected && answer.verdict == RIGHT && !mumps) PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s is owed no more\n", e.name.c_str()));
  }
  if (csv) PetscCall(PetscFClose(PETSC_COMM_WORLD, csv));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%" PetscInt_FMT " systems", total));
  for (int v = 0; v < VERDICTS && !list; v++) PetscCall(PetscPrintf(PETSC_COMM_WORLD, ", %" PetscInt_FMT " %s", count[v], verdicts[v]));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\n"));
  PetscCall(PetscFinalize());
  return !mumps && unexpected > 0;
}
