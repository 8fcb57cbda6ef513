static char help[] = "Saddle points as programs write them, each against a reference in extended precision.\n\
  systems -list | -only <name or family> | (all)\n\
  -out <file.csv>   a row for each           -mumps   MUMPS, without refinement, instead of what the options say\n\
  -verbose          what each refusal says   -write <prefix>  A, B, C, D, f, g to <prefix>_A.dat and so on instead\n\n";

#include "systems.h"

static const char *const verdicts[] = {"right", "refused", "owed", "untrue", "wrong"};

/*
   Systems that have an answer which is not found yet: they are not to be wrong, and one that is right may be taken from
   this list
*/
static const char *const owed[] = {NULL};

/* Rows spread evenly, in whole blocks */
static PetscInt Share(int total, int bs)
{
  PetscMPIInt    rank, size;
  const PetscInt blocks = total / bs;

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return bs * (blocks / size + (rank < blocks % size));
}

/* On rank 0; what the generator says of its system has to be so */
static PetscErrorCode FindFacts(const Saddle &s, Facts *facts)
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (rank) PetscFunctionReturn(PETSC_SUCCESS);
  *facts = SaddleFacts(s);
  PetscCheck(facts->decided, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s cannot be decided: its generator is to be mended",
             s.name.c_str());
  PetscCheck(facts->solvable == s.solvable, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s is %ssolvable", s.name.c_str(),
             facts->solvable ? "" : "not ");
  PetscCheck(facts->unique == s.unique, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s: x is %sunique", s.name.c_str(),
             facts->unique ? "" : "not ");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Row(const Saddle &s, const Facts &facts, const Answer &a, SaddleVerdict verdict, FILE *csv,
                          bool verbose)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%-30s %4d %4d %-8s %4" PetscInt_FMT " residual %.1e error %.1e (%.0e)%s%s\n",
                        s.name.c_str(), (int)s.A.rows(), (int)s.C.rows(), verdicts[verdict], a.iterations, a.residual,
                        a.error, facts.reach, verbose || verdict >= SADDLE_UNTRUE ? "  " : "",
                        verbose || verdict >= SADDLE_UNTRUE ? a.said.c_str() : ""));
  if (csv)
    PetscCall(PetscFPrintf(PETSC_COMM_WORLD, csv, "%s,%s,%d,%d,%s,%" PetscInt_FMT ",%.1e,%.1e,%.0e\n", s.family.c_str(),
                           s.name.c_str(), (int)s.A.rows(), (int)s.C.rows(), verdicts[verdict], a.iterations,
                           a.residual, a.error, facts.reach));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For tests/bench/solve and errortime; D is zero where the program passes none */
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
    PetscCall(
      PetscViewerBinaryOpen(PETSC_COMM_WORLD, (prefix + "_" + M.name + ".dat").c_str(), FILE_MODE_WRITE, &viewer));
    PetscCall(MatView(mat, viewer));
    PetscCall(PetscViewerDestroy(&viewer));
    PetscCall(MatDestroy(&mat));
  }
  for (const auto &v : vectors) {
    Vec vec;

    PetscCall(VecCreateMPI(PETSC_COMM_WORLD, v.rows, PETSC_DETERMINE, &vec));
    PetscCall(Scatter(v.values.cast<PetscScalar>(), vec));
    PetscCall(
      PetscViewerBinaryOpen(PETSC_COMM_WORLD, (prefix + "_" + v.name + ".dat").c_str(), FILE_MODE_WRITE, &viewer));
    PetscCall(VecView(vec, viewer));
    PetscCall(PetscViewerDestroy(&viewer));
    PetscCall(VecDestroy(&vec));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char        only[128], out[PETSC_MAX_PATH_LEN], prefix[PETSC_MAX_PATH_LEN];
  PetscInt    count[SADDLE_VERDICTS] = {0}, total = 0, unexpected = 0;
  PetscBool   list = PETSC_FALSE, mumps = PETSC_FALSE, verbose = PETSC_FALSE, some, hasOut, write;
  FILE       *csv = NULL;
  PetscMPIInt rank;
  Entries     all;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-list", &list, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-mumps", &mumps, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-verbose", &verbose, NULL));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-only", only, sizeof(only), &some));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-out", out, sizeof(out), &hasOut));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-write", prefix, sizeof(prefix), &write));
  for (auto add : {AddContact, AddMultipliers, AddOptimization, AddFlow, AddStructures, AddPrograms}) add(all);
  if (hasOut) {
    PetscCall(PetscFOpen(PETSC_COMM_WORLD, out, "w", &csv));
    PetscCall(PetscFPrintf(PETSC_COMM_WORLD, csv, "family,name,n,m,verdict,iterations,residual,error,reach\n"));
  }
  for (const Entry &e : all) {
    PetscMPIInt verdict  = SADDLE_WRONG;
    bool        expected = false;
    Saddle      s;
    Facts       facts;
    Answer      answer;

    if (some && e.name != only && e.family != only) continue;
    total++;
    if (list) {
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%-24s %s\n", e.family.c_str(), e.name.c_str()));
      continue;
    }
    s.family = e.family;
    s.name   = e.name;
    e.make(s);
    SaddleStore(s);
    if (write) {
      PetscCall(Write(s, prefix));
      continue;
    }
    const PetscInt local[2] = {Share((int)s.A.rows(), s.bs), Share((int)s.C.rows(), 1)};

    PetscCall(FindFacts(s, &facts));
    PetscCall(SaddleSolve(s, local, mumps, answer));
    if (!rank) verdict = SaddleJudge(s, facts, !mumps, answer);
    PetscCallMPI(MPI_Bcast(&verdict, 1, MPI_INT, 0, PETSC_COMM_WORLD));
    count[verdict]++;
    PetscCall(Row(s, facts, answer, (SaddleVerdict)verdict, csv, verbose));
    for (const char *const *name = owed; *name; name++) expected = expected || e.name == *name;
    unexpected += verdict == SADDLE_WRONG || (verdict > SADDLE_REFUSED && !expected);
    if (expected && verdict == SADDLE_RIGHT && !mumps)
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s is owed no more\n", e.name.c_str()));
  }
  if (csv) PetscCall(PetscFClose(PETSC_COMM_WORLD, csv));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%" PetscInt_FMT " systems", total));
  for (int v = 0; v < SADDLE_VERDICTS && !list; v++)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, ", %" PetscInt_FMT " %s", count[v], verdicts[v]));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\n"));
  PetscCall(PetscFinalize());
  return !mumps && unexpected > 0;
}
