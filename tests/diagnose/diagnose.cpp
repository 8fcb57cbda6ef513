static char help[] = "Broken systems, and some that are not: what -pc_ainsworth_diagnose says of each.\n\
  -only <name>   one of them        -collection   no fatal advice for those of tests/systems that are solved\n\n";

#include "json.h"
#include "systems.h"
#include <fstream>
#include <sstream>

/*
   A system, the options that break it, where its matrices do not, and the first advice: its key, and what its sentence
   names
*/
struct Patient {
  const char                   *name, *options, *key, *says;
  std::function<void(Saddle &)> make;
};

static const int    cells[2] = {12, 6};
static const double stiff    = 10.0;

/*
   Two blocks, one on top of the other, the lower one clamped at its bottom; nodes of the upper one at the interface are
   tied to those below, two rows each
*/
static void Blocks(Saddle &s)
{
  const Grid grid = {cells[0], cells[1]};
  const int  each = 2 * grid.Nodes(), ties = 2 * (grid.nx + 1);
  Matrix     lower = PlaneStrain(
        grid, [](int, int) { return stiff; }, 0.3);
  Matrix upper = PlaneStrain(
    grid, [](int, int) { return 1.0; }, 0.3);
  Vector none = Vector::Zero(each);

  for (int i = 0; i <= grid.nx; i++)
    for (int d = 0; d < 2; d++) Clamp(lower, none, 2 * grid.Node(i, 0) + d);
  s.A = Diagonal({lower, upper});
  s.C = Matrix::Zero(ties, 2 * each);
  for (int i = 0; i <= grid.nx; i++) {
    for (int d = 0; d < 2; d++) {
      s.C(2 * i + d, each + 2 * grid.Node(i, 0) + d) = 1.0;
      s.C(2 * i + d, 2 * grid.Node(i, grid.ny) + d)  = -1.0;
    }
  }
  s.f = Vector::Zero(2 * each);
  s.g = Vector::Zero(ties);
  for (int i = 0; i <= grid.nx; i++) s.f[each + 2 * grid.Node(i, grid.ny) + 1] = -0.01;
  s.B  = s.C;
  s.bs = 2;
}

/* Another row of C */
static void Append(Saddle &s, const Vector &row, double g)
{
  const Eigen::Index m = s.C.rows();

  s.C.conservativeResize(m + 1, Eigen::NoChange);
  s.C.row(m) = row.transpose();
  s.g.conservativeResize(m + 1);
  s.g[m] = g;
  s.B    = s.C;
}

/* Unknowns without any entry */
static void AppendUnknowns(Saddle &s, int count)
{
  const Eigen::Index n = s.A.rows();

  s.A.conservativeResize(n + count, n + count);
  s.A.bottomRows(count).setZero();
  s.A.rightCols(count).setZero();
  s.C.conservativeResize(Eigen::NoChange, n + count);
  s.C.rightCols(count).setZero();
  s.B = s.C;
  s.f.conservativeResize(n + count);
  s.f.tail(count).setZero();
}

/* Only every other row of C: no tie holds the upper block horizontally */
static void Untie(Saddle &s)
{
  const Eigen::Index m = s.C.rows() / 2;
  Matrix             C(m, s.C.cols());

  for (Eigen::Index i = 0; i < m; i++) C.row(i) = s.C.row(2 * i + 1);
  s.C = s.B = C;
  s.g       = Vector::Zero(m);
}

/* BoomerAMG gives its levels away when it is asked for them: a set-up follows that is not told of again */
#if defined(PETSC_HAVE_HYPRE)
static const char otherMultigrid[] = "-ainsworth_pc_type hypre";
#else
static const char otherMultigrid[] = "-ainsworth_pc_type gamg";
#endif

/* clang-format off */
static const std::vector<Patient> patients = {
  {"healthy", "", "", "", [](Saddle &) {}},
  {"healthy_springs", "", "", "", [](Saddle &s) { s.D = 1e-3 * Matrix::Identity(s.C.rows(), s.C.rows()); }},
  {"healthy_opposite", "", "", "", [](Saddle &s) { s.convention = OPPOSITE; }},
  {"healthy_inactive", "", "", "",
   [](Saddle &s) {
     s.C.row(3).setZero();
     s.B = s.C;
   }},
  {"healthy_alone", "", "", "",
   [](Saddle &s) { /* no constraints */
     Matrix lower = s.A.topLeftCorner(s.A.rows() / 2, s.A.rows() / 2);
     s.A          = lower;
     s.C = s.B = Matrix::Zero(0, lower.rows());
     s.f       = Vector::Ones(lower.rows());
     s.g       = Vector::Zero(0);
   }},
  {"floating", "", "trial", "A body floats that no constraint holds", Untie},
  {"floating_other", otherMultigrid, "trial", "A body floats that no constraint holds", Untie},
  {"contradicting", "", "failure",
   /* one is twice the other */
   "it depends (rows 4 of the multiplier field)|it depends (rows 26 of the multiplier field)",
   [](Saddle &s) { Append(s, 2.0 * s.C.row(4).transpose(), 1.0); }},
  {"contradicting_zero", "", "failure", "nonzero on a row of C that is zero (rows 26 of the multiplier field)",
   [](Saddle &s) { Append(s, 0.0 * s.C.row(4).transpose(), 1.0); }},
  {"dependent", "", "dependent", "2 rows of C are combinations of others",
   [](Saddle &s) {
     Append(s, s.C.row(4).transpose(), 0.0);
     Append(s, s.C.row(7).transpose() - 3.0 * s.C.row(9).transpose(), 0.0);
   }},
  {"dependent_refused", "-pc_ainsworth_redundant error", "error", "1 rows of C are linear combinations of others",
   [](Saddle &s) { Append(s, s.C.row(4).transpose(), 0.0); }},
  {"nearly_dependent", "", "nearly_dependent", "1 rows of C are nearly combinations of others",
   [](Saddle &s) {
     Vector row = s.C.row(4).transpose();
     row[7] += 1e-4;
     Append(s, row, 0.0);
   }},
  {"block_size", "", "block_size_forgotten", "Nodes have 2 unknowns",
   [](Saddle &s) {
     for (Eigen::Index i = 0; i < s.A.rows(); i += 2) /* zeros are not stored in this test */
       for (Eigen::Index j = 0; j < s.A.cols(); j += 2)
         if (s.A.block(i, j, 2, 2).cwiseAbs().sum() > 0.0) s.A.block(i, j, 2, 2).array() += 1e-20;
     s.bs = 1;
   }},
  {"units", "", "scales_of_rows", "differ by a factor of 1e+12, from row 5 ",
   [](Saddle &s) {
     s.C.row(5) *= 1e-12;
     s.B = s.C;
   }},
  {"penalty", "", "penalty_in_A", "beta C'C", [](Saddle &s) { s.A += 1e6 * s.C.transpose() * s.C; }},
  {"loose", "", "loose_unknowns", "2 unknowns are in no equation, the first is row 364 of the primal field",
   [](Saddle &s) { AppendUnknowns(s, 2); }},
  {"massless", "", "", "",
   [](Saddle &s) { /* a reference node that rows hold */
     AppendUnknowns(s, 2);
     for (int d = 0; d < 2; d++) {
       Vector row              = Vector::Zero(s.A.rows());
       row[s.A.rows() - 2 + d] = 1.0;
       row[20 + d]             = -1.0;
       Append(s, row, 0.0);
     }
   }},
  {"negative", "", "negative_diagonal", "1 of 364 entries of the diagonal of A are negative, the first in row 200",
   [](Saddle &s) { s.A(200, 200) *= -1.0; }},
  {"mean_value", "", "long_row", "Row 26 of the multiplier field has 364 entries",
   [](Saddle &s) { Append(s, Vector::Ones(s.A.rows()), 0.0); }},
  {"spider", "", "shared_unknown", "is in 109 of 135 rows of C",
   [](Saddle &s) { /* all ties in one direction to one unknown, as those of a rigid body that only moves up */
     const int master = 27;
     for (int i = 0; i < 109; i++) {
       Vector row              = Vector::Zero(s.A.rows());
       row[s.A.rows() - 1 - i] = 1.0;
       row[master]             = -1.0;
       Append(s, row, 0.0);
     }
   }},
  {"transpose", "", "C_for_transpose", "Block (0,1) is C itself",
   [](Saddle &s) {
     const Eigen::Index n = s.A.rows();
     s.C                  = Matrix::Identity(n, n);
     for (Eigen::Index i = 0; i + 1 < n; i++) s.C(i, i + 1) = -0.5;
     s.B = s.C.transpose();
     s.g = Vector::Zero(n);
     s.D = Matrix::Identity(n, n);
   }},
  {"not_transpose", "", "not_transpose", "Block (0,1) is not the transpose of C though A is symmetric",
   [](Saddle &s) { s.B.row(3) *= 1.5; }},
  {"together", "", "gram_inexact", "Rows of C taken together are nearly dependent",
   [](Saddle &s) { /* each has an unknown of its own once those before it are gone */
     Matrix unlike = Matrix::Identity(s.C.rows(), s.C.rows());
     for (Eigen::Index i = 0; i < unlike.rows(); i++)
       unlike.row(i).tail(unlike.rows() - 1 - i).setConstant(-0.6);
     s.C = s.B = unlike * s.C;
   }},
  {"sizes", "-pc_ainsworth_block_size 5", "error", "does not divide the number of rows", [](Saddle &) {}},
  {"fields", "-pc_ainsworth_multiplier_fields 7", "error", "names field 7; there are 2", [](Saddle &) {}},
  {"nan_in_A", "", "failure", "entry (21,20) of A is NaN or Inf", [](Saddle &s) { s.A(21, 20) = NAN; }},
  {"nan_in_C", "", "failure", "row 3 of C, or of the other blocks of the multipliers, holds NaN or Inf",
   [](Saddle &s) {
     s.C(3, 20) = NAN;
     s.B        = s.C;
   }},
  {"nan_in_f", "", "failure", "The right-hand side holds NaN or Inf in row 9 of the primal field",
   [](Saddle &s) { s.f[9] = NAN; }},
  {"nan_in_g", "", "failure", "The right-hand side holds NaN or Inf in row 2 of the multiplier field",
   [](Saddle &s) { s.g[2] = INFINITY; }},
  {"sign_of_D", "", "D_sign", "wrong sign in 26 rows, the first is 0 of the multiplier field",
   [](Saddle &s) { s.D = -1e-3 * Matrix::Identity(s.C.rows(), s.C.rows()); }},
  {"contrast", "", "jump_in_A", "The stiffness jumps by a factor of",
   [](Saddle &s) {
     const Grid grid                   = {cells[0], cells[1]};
     const int  each                   = 2 * grid.Nodes();
     s.A.bottomRightCorner(each, each) = PlaneStrain(
       grid, [](int i, int) { return i % 4 ? 1.0 : 1e7; }, 0.3);
   }},
  {"modes", "-ainsworth_pc_type blocksa -ainsworth_pc_blocksa_coarse_eq_limit 30", "modes_forgotten",
   "Multigrid does not know the rigid-body modes",
   [](Saddle &s) {
     const Grid grid                   = {cells[0], cells[1], 1.0, 30.0};
     const int  each                   = 2 * grid.Nodes();
     s.A.bottomRightCorner(each, each) = PlaneStrain(
       grid, [](int, int) { return 1.0; }, 0.3);
   }},
  {"modes_and_size", "-ainsworth_pc_type blocksa -ainsworth_pc_blocksa_coarse_eq_limit 30", "modes_forgotten",
   "Multigrid does not know the rigid-body modes",
   [](Saddle &s) {
     const Grid grid                   = {cells[0], cells[1], 1.0, 30.0};
     const int  each                   = 2 * grid.Nodes();
     s.bs                              = 1;
     s.A.bottomRightCorner(each, each) = PlaneStrain(
       grid, [](int, int) { return 1.0; }, 0.3);
   }},
  {"slow", "-ainsworth_pc_type none", "slow", "multigrid does not fit A",
   [](Saddle &s) {
     const Grid grid                   = {cells[0], cells[1], 1.0, 30.0};
     const int  each                   = 2 * grid.Nodes();
     s.A.bottomRightCorner(each, each) = PlaneStrain(
       grid, [](int, int) { return 1.0; }, 0.3);
   }},
};
/* clang-format on */

static PetscInt Share(Eigen::Index total, int bs)
{
  PetscMPIInt    rank, size;
  const PetscInt blocks = (PetscInt)total / bs;

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return bs * (blocks / size + (rank < blocks % size));
}

/* What PETSc prints on this rank, and how */
static std::string printed;
static PetscErrorCode (*print)(FILE *, const char[], va_list);

static PetscErrorCode Listen(FILE *file, const char format[], va_list arguments)
{
  char    text[16384];
  va_list copy;

  va_copy(copy, arguments);
  if (file == stdout && vsnprintf(text, sizeof(text), format, copy) > 0) printed += text;
  va_end(copy);
  return (*print)(file, format, arguments);
}

/* Each finding of the JSON is a line of what was printed, once */
static PetscErrorCode CompareForms(const Saddle &s, const Json &diagnosis)
{
  PetscFunctionBeginUser;
  for (const char *part : {"facts", "advice"})
    for (const Json &finding : diagnosis.object.at(part).list) {
      const std::string line  = finding.object.at("sentence").text + "\n";
      const size_t      first = printed.find(line);

      PetscCheck(first != std::string::npos && printed.find(line, first + 1) == std::string::npos, PETSC_COMM_SELF,
                 PETSC_ERR_PLIB, "%s: not printed once: %s", s.name.c_str(), line.c_str());
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file that cannot be written is refused by all ranks */
static PetscErrorCode CheckUnwritable()
{
  PC             pc;
  PetscErrorCode code;

  PetscFunctionBeginUser;
  PetscCall(PCCreate(PETSC_COMM_WORLD, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(PetscOptionsSetValue(NULL, "-pc_ainsworth_diagnose", "no/such/folder.json"));
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  code = PCSetFromOptions(pc);
  PetscCall(PetscPopErrorHandler());
  PetscCall(PetscOptionsClearValue(NULL, "-pc_ainsworth_diagnose"));
  PetscCheck(code == PETSC_ERR_FILE_OPEN, PETSC_COMM_SELF, PETSC_ERR_PLIB, "A file that cannot be written: error %d",
             (int)code);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves with a diagnosis, and reads it: on rank 0, which wrote it */
static PetscErrorCode Diagnose(Saddle &s, const char options[], Answer *answer, Json *diagnosis)
{
  static const char file[] = "diagnosis.json";
  PetscMPIInt       rank;
  PetscOptions      given;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  SaddleStore(s);
  if (!rank) (void)remove(file);
  PetscCall(PetscOptionsCreate(&given));
  PetscCall(PetscOptionsInsertString(given, options));
  PetscCall(PetscOptionsPush(given));
  PetscCall(PetscOptionsSetValue(NULL, "-pc_ainsworth_diagnose", file));
  const PetscInt n        = Share(s.A.rows(), s.A.rows() % 2 ? 1 : 2),
                 local[2] = {n, s.C.rows() == s.A.rows() ? n : Share(s.C.rows(), 1)};
  printed.clear();
  print         = PetscVFPrintf;
  PetscVFPrintf = Listen;
  PetscCall(SaddleSolve(s, local, false, *answer));
  PetscVFPrintf = print;
  PetscCall(PetscOptionsPop());
  PetscCall(PetscOptionsDestroy(&given));
  PetscCheck(answer->agreed, PETSC_COMM_WORLD, PETSC_ERR_PLIB, "%s: ranks do not agree", s.name.c_str());
  if (rank) PetscFunctionReturn(PETSC_SUCCESS);
  std::ifstream     in(file);
  std::stringstream text;

  text << in.rdbuf();
  *diagnosis = JsonParse(text.str());
  PetscCheck(diagnosis->type == Json::OBJECT && diagnosis->object["facts"].list.size() > 1 &&
               diagnosis->object["advice"].type == Json::LIST,
             PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s: no valid JSON", s.name.c_str());
  PetscCall(CompareForms(s, *diagnosis));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Does a sentence have one of these parts, with | between them? */
static bool Says(const std::string &sentence, const std::string &parts)
{
  size_t from = 0, to;

  do {
    to = parts.find('|', from);
    if (sentence.find(parts.substr(from, to - from)) != std::string::npos) return true;
    from = to + 1;
  } while (to != std::string::npos);
  return false;
}

static PetscErrorCode RunPatient(const Patient &c)
{
  PetscMPIInt rank;
  Saddle      s;
  Answer      answer;
  Json        diagnosis;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  s.name = c.name;
  Blocks(s);
  c.make(s);
  PetscCall(Diagnose(s, c.options, &answer, &diagnosis));
  if (rank) PetscFunctionReturn(PETSC_SUCCESS);
  const std::vector<Json> &advice = diagnosis.object["advice"].list;
  const std::string        key    = advice.empty() ? "" : advice[0].object.at("key").text,
                    sentence      = advice.empty() ? "" : advice[0].object.at("sentence").text;

  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s: %s: %s\n", c.name, key.c_str(), sentence.c_str()));
  PetscCheck(key == c.key && Says(sentence, c.says), PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "%s: the first advice is %s, %s, and not %s, %s", c.name, key.c_str(), sentence.c_str(), c.key, c.says);
  PetscCheck(!key.empty() || answer.solved, PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "%s: nothing to complain about, and no solution", c.name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A system that is solved right has no fatal advice, one that has no solution has some */
static PetscErrorCode RunCollection(const Entry &e)
{
  PetscMPIInt rank;
  Saddle      s;
  Answer      answer;
  Json        diagnosis;
  bool        fatal = false;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  s.name = e.name;
  e.make(s);
  PetscCall(Diagnose(s, "", &answer, &diagnosis));
  if (rank) PetscFunctionReturn(PETSC_SUCCESS);
  for (const Json &advice : diagnosis.object["advice"].list) {
    fatal |= advice.object.at("type").text == "fatal";
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s: %s: %s: %s\n", e.name.c_str(), advice.object.at("type").text.c_str(),
                          advice.object.at("key").text.c_str(), advice.object.at("sentence").text.c_str()));
  }
  PetscCheck(fatal != answer.solved, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s: %s, and %s fatal advice", e.name.c_str(),
             answer.solved ? "solved" : "not solved", fatal ? "there is" : "there is no");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char      only[64];
  PetscBool some, collection = PETSC_FALSE, list = PETSC_FALSE;
  PetscInt  count = 0;
  Entries   all;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscOptionsGetString(NULL, NULL, "-only", only, sizeof(only), &some));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-collection", &collection, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-list", &list, NULL));
  for (const Patient &c : patients) {
    if (collection || list || (some && strcmp(only, c.name))) continue;
    PetscCall(RunPatient(c));
    count++;
  }
  if (collection || list)
    for (auto add : {AddContact, AddMultipliers, AddOptimization, AddFlow, AddStructures}) add(all);
  for (const Entry &e : all) {
    if (some && e.name != only) continue;
    if (list) {
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s\n", e.name.c_str()));
      continue;
    }
    PetscCall(RunCollection(e));
    count++;
  }
  if (!some && !list) PetscCall(CheckUnwritable()); /* the last: its error leaves a PC behind */
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%" PetscInt_FMT " diagnoses\n", count));
  PetscCall(PetscFinalize());
}
