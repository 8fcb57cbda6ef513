static char help[] = "What says to have converged is right, whatever inner method, side, norm and preconditioner; what failed says why.\n\n";

#include "run.h"
#include <cmath>

enum Kind {
  DEFINITE,
  INDEFINITE_ON_RANGE,
  INDEFINITE_ON_KERNEL,
  NEGATIVE,
  FLOATING,
  NOT_SYMMETRIC
};

/* A chain of springs with a stiff part, and rows that tie unknowns; of each kind A is what its name says */
static DenseSystem Chain(Kind kind)
{
  const PetscInt n = 24, m = 5;
  DenseSystem    d;

  d.A = Dense::Zero(n, n);
  d.C = Dense::Zero(m, n);
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal left = i > 12 ? 100.0 : 1.0, right = i > 11 ? 100.0 : 1.0;
    const bool      first = i == 0 || i == 12, last = i == 11 || i == n - 1; /* two bodies */

    d.A(i, i) = (first ? 1.0 : left) + (last ? 0.0 : right);
    if (!first) d.A(i, i - 1) = d.A(i - 1, i) = -left;
  }
  for (PetscInt i = 0; i < m; i++) {
    d.C(i, 2 * i)      = 1.0;
    d.C(i, 12 + 2 * i) = -1.0;
  }
  d.f = Column::LinSpaced(n, -1.0, 2.0);
  d.g = Column::LinSpaced(m, 0.5, 1.0);
  if (kind == INDEFINITE_ON_RANGE) d.A -= 50.0 * d.C.transpose() * d.C;
  if (kind == INDEFINITE_ON_KERNEL)
    for (int i : {1, 5, 9, 11}) d.A(i, i) -= 8.0;
  if (kind == NEGATIVE) d.A = -d.A;
  if (kind == NOT_SYMMETRIC)
    for (PetscInt i = 1; i < n; i++) d.A(i, i - 1) *= 0.7;
  if (kind == FLOATING) {
    d.A(12, 12) -= 1.0;
    d.C.setZero();
    for (PetscInt i = 0; i < m; i++) {
      d.C(i, 12 + 2 * i) = 1.0;
      d.C(i, 13 + 2 * i) = -1.0;
    }
  }
  return d;
}

/* Two unknowns more, so soft that the norm of a residual does not see them; where they do not move only the row without a diagonal is not met */
static DenseSystem SoftPair()
{
  const PetscReal soft = 1e-11;
  DenseSystem     d    = Chain(DEFINITE);
  const PetscInt  n    = d.A.rows();

  d.A.conservativeResizeLike(Dense::Zero(n + 2, n + 2));
  d.C.conservativeResizeLike(Dense::Zero(d.C.rows(), n + 2));
  d.f.conservativeResizeLike(Column::Zero(n + 2));
  d.A(n, n + 1) = d.A(n + 1, n) = d.A(n + 1, n + 1) = d.f[n] = soft;
  return d;
}

/* A positive reason is checked against both equations and, where x is unique, against the dense solution; known: this method must solve the system */
static PetscErrorCode Solve(const char *name, const DenseSystem &d, const std::string &text, bool known, bool crossed)
{
  Options options(text);
  Run     run;
  Column  x, lambda;

  PetscFunctionBeginUser;
  Case("%s, crossed %d, %s", name, crossed, text.c_str());
  PetscCall(RunCreate(d, crossed, &run));
  PetscCall(RunSolve(&run));
  if (run.reason > 0) {
    PetscCall(CheckResiduals(run, d, 1e-5, 1e-10));
    SolveSaddle(d, x, lambda);
    PetscCall(CheckEqual("x", run.x, x, 1e-4));
  } else {
    const char *why;
    PC          pc;

    PetscCall(CheckFailed(run));
    PetscCall(CheckTrue("it is solved", !known));
    PetscCall(KSPGetPC(run.ksp, &pc));
    PetscCall(PCAinsworthGetFailure(pc, &why));
    PetscCall(CheckTrue("a failure has a text", why[0] != 0));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Methods(bool crossed)
{
  const char *methods[] = {"projectedcg", "cg",         "cg -ainsworth_ksp_cg_single_reduction",
                           "fcg",         "pipecg",     "minres",
                           "cr",          "cgs",        "bcgs",
                           "bcgsl",       "tfqmr",      "gmres",
                           "fgmres",      "gcr",        "symmlq",
                           "lsqr",        "richardson", "chebyshev"};
  struct {
    const char *name;
    Kind        kind;
  } kinds[] = {
    {"definite",                DEFINITE            },
    {"indefinite on the range", INDEFINITE_ON_RANGE },
    {"indefinite on Ker C",     INDEFINITE_ON_KERNEL},
    {"not symmetric",           NOT_SYMMETRIC       },
    {"negative",                NEGATIVE            }
  };
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (const auto &kind : kinds) {
    const DenseSystem d = Chain(kind.kind);

    for (const char *method : methods) {
      const bool isCG = std::string(method) == "projectedcg" || std::string(method) == "gmres";

      for (const char *pc : {"jacobi", "redundant", "hypre"}) {
        const bool known = (kind.kind == DEFINITE || kind.kind == NEGATIVE) && isCG && std::string(pc) != "hypre";
#if !defined(PETSC_HAVE_HYPRE)
        if (std::string(pc) == "hypre") continue;
#endif
        PetscCall(Solve(kind.name, d, std::string("-ainsworth_ksp_max_it 300 -ainsworth_ksp_type ") + method + " -ainsworth_pc_type " + pc, known, crossed));
      }
    }
    for (const char *norm : {"preconditioned", "unpreconditioned", "natural", "none -ainsworth_ksp_max_it 60"})
      PetscCall(Solve(kind.name, d, std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_norm_type ") + norm, false, crossed));
    for (const char *method : {"gmres", "bcgsl", "fgmres"})
      for (const char *side : {"left", "right"}) {
        if (std::string(method) == "fgmres" && std::string(side) == "left") continue;
        PetscCall(Solve(kind.name, d,
                        std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_max_it 300 -ainsworth_ksp_type ") + method + " -ainsworth_ksp_pc_side " + side,
                        false, crossed));
      }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Heat conduction in a cell of 5 x 4 nodes without a boundary condition: opposite edges differ by a given gradient, the mean value is given */
static DenseSystem Cell(Kind kind)
{
  const PetscInt nx = 5, ny = 4, n = nx * ny, m = nx + ny - 1;
  DenseSystem    d;

  d.A = Dense::Zero(n, n);
  d.C = Dense::Zero(m, n);
  d.g = Column::Zero(m);
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j : {i + 1, i + nx}) {
      const PetscReal k = 1.0 + 9.0 * (i % 3 == 0);

      if (j >= n || (j == i + 1 && j % nx == 0)) continue;
      d.A(i, i) += k;
      d.A(j, j) += k;
      d.A(i, j) = -k;
      d.A(j, i) = kind == NOT_SYMMETRIC ? -0.5 * k : -k; /* carried along by a flow */
    }
  for (PetscInt i = 0; i < m - 1; i++) {
    d.C(i, i < ny ? nx * i : i - ny)                   = -1.0;
    d.C(i, i < ny ? nx * i + nx - 1 : n - nx + i - ny) = 1.0;
    d.g[i]                                             = i < ny ? 0.5 : -0.2;
  }
  if (kind != FLOATING) d.C.row(m - 1).setConstant(1.0 / n);
  else d.C.row(m - 1) = d.C.row(0) + 0.5 * d.C.row(ny); /* its mean value is not held, another row is there */
  if (kind == FLOATING) d.g[m - 1] = d.g[0] + 0.5 * d.g[ny];
  d.f = Column::LinSpaced(n, -1.0, 2.0);
  if (kind == INDEFINITE_ON_KERNEL) d.A -= 3.0 * Dense::Identity(n, n); /* a vibration above the first frequency */
  if (kind == NEGATIVE) d.A = -d.A;
  return d;
}

/* The failure begins with the cause, and says in its first sentence all of `parts` */
static PetscErrorCode CheckCause(const std::string &why, const std::vector<std::string> &parts)
{
  PetscFunctionBeginUser;
  PetscCall(CheckText("the first sentence", why.substr(0, why.find(". ")), parts));
  PetscCall(CheckTrue(("the cause comes first: " + why).c_str(), why.compare(0, parts[0].size(), parts[0]) == 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Cause(const char *name, const DenseSystem &d, const std::string &text, const std::vector<std::string> &parts, const std::string &outer)
{
  Options     options(text + " -ksp_type " + outer);
  const bool  strict = outer.find("error") != std::string::npos;
  Run         run;
  const char *why;
  PC          pc;

  PetscFunctionBeginUser;
  Case("cause: %s, of %d unknowns, outer %s", name, (int)d.A.rows(), outer.c_str());
  if (outer == KSPGMRES) PetscCall(RunCreateWhole(d, &run));
  else PetscCall(RunCreate(d, false, &run));
  PetscCall(KSPGetPC(run.ksp, &pc));
  if (strict) {
    PetscErrorCode code;

    PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
    code = KSPSetUp(run.ksp);
    if (!code) code = RunSolve(&run);
    PetscCall(PetscPopErrorHandler());
    PetscCall(CheckTrue("an error", code != PETSC_SUCCESS));
  } else {
    PetscCall(RunSolve(&run));
    PetscCall(CheckFailed(run));
  }
  PetscCall(PCAinsworthGetFailure(pc, &why));
  PetscCall(CheckCause(why, parts));
  if (!strict) PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of C as they came, with one more */
static void AddRow(DenseSystem &d, const Dense &row, PetscReal g)
{
  const PetscInt m = d.C.rows();

  d.C.conservativeResize(m + 1, Eigen::NoChange);
  d.C.row(m) = row;
  d.g.conservativeResize(m + 1);
  d.g[m] = g;
}

static PetscErrorCode Causes(DenseSystem (*make)(Kind), const std::string &outer)
{
  const std::string jacobi = "-ainsworth_pc_type jacobi ";
  const DenseSystem good   = make(DEFINITE);
  const std::string last   = std::to_string(good.C.rows());
  DenseSystem       d;

  PetscFunctionBeginUser;
  for (const std::string &pc : {std::string(), jacobi}) PetscCall(Cause("floating", make(FLOATING), pc, {"A body floats", "MatSetNullSpace()"}, outer));
  PetscCall(Cause("indefinite", make(INDEFINITE_ON_KERNEL), jacobi, {"A is indefinite on Ker C", "-ainsworth_ksp_type gmres"}, outer));
  for (const std::string &pc : {std::string(), jacobi}) PetscCall(Solve("-A", make(NEGATIVE), pc, true, false));
  PetscCall(Cause("too few iterations", good, jacobi + "-ainsworth_ksp_max_it 2",
                  {"The reduced solve ended without convergence", "DIVERGED_ITS", "2 iterations"}, outer));
  PetscCall(Cause("stagnation", good, jacobi + "-ainsworth_ksp_type richardson -ainsworth_ksp_richardson_scale 1e-9",
                  {"The reduced solve stagnates", "after " + std::to_string(10 * good.A.rows()) + " iterations", "-ainsworth_pc_type"}, outer));
  for (const std::string key : {"ksp_atol", "ksp_rtol"})
    PetscCall(Cause("wrong prefix", good, jacobi + "-ainsworth_ksp_max_it 3 -" + key + " 1e-3",
                    {"The reduced solve ended without convergence", "-" + key + " is that of the outer solver, the reduced solve has -ainsworth_" + key},
                    outer));
  PetscCall(Cause("not symmetric", make(NOT_SYMMETRIC), jacobi + "-ainsworth_ksp_type cg -ainsworth_ksp_max_it 4",
                  {"A is not symmetric", "-ainsworth_ksp_type gmres"}, outer));
  d      = good;
  d.f[3] = NAN;
  PetscCall(Cause("NaN in f", d, jacobi, {"The right-hand side holds NaN or Inf in row 3 of the primal field"}, outer));
  d      = good;
  d.g[1] = NAN;
  PetscCall(Cause("NaN in g", d, jacobi, {"The right-hand side holds NaN or Inf in row 1 of the multiplier field"}, outer));
  d = good;
  AddRow(d, Dense::Zero(1, d.A.rows()), 1.0);
  PetscCall(Cause("zero row", d, jacobi, {"The right-hand side of the constraints is nonzero on a row of C that is zero (rows " + last}, outer));
  d = good;
  AddRow(d, d.C.row(0) + d.C.row(1), 7.0);
  PetscCall(Cause("contradictory rows", d, jacobi, {"The right-hand side of the constraints is not that of the other rows of C", "(rows "}, outer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C itself, and not its transpose, beside A; below it C, or its transpose */
static PetscErrorCode Untransposed(DenseSystem (*make)(Kind), bool below)
{
  const DenseSystem d = make(DEFINITE);
  const std::string n = std::to_string(d.A.rows()), m = std::to_string(d.C.rows());
  Mat               Ct;
  Run               run;

  PetscFunctionBeginUser;
  Case("C in the place of C', C' in that of C %d, of %d unknowns", below, (int)d.A.rows());
  PetscCall(SystemFromDense(d, false, &run.sys));
  PetscCall(MatTranspose(run.sys.C, MAT_INITIAL_MATRIX, &Ct));
  Mat blocks[] = {run.sys.A, run.sys.C, below ? Ct : run.sys.C, NULL};

  const std::vector<std::string> parts = below ? std::vector<std::string>{"Block (1,0) of the MatNest, C, has " + m + " columns, A has " + n}
                                               : std::vector<std::string>{"Block (0,1) of the MatNest, C', is " + m + " x " + n + ", not " + n + " x " + m +
                                                                            ": it is C, or of its size",
                                                                          "pass its transpose"};
  PetscCall(CheckError(
    "nest",
    [&]() -> PetscErrorCode {
      PetscFunctionBeginUser;
      PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &run.nest));
      PetscCall(SolverCreate(run.nest, &run.ksp));
      PetscCall(KSPSetUp(run.ksp));
      PetscFunctionReturn(PETSC_SUCCESS);
    },
    PETSC_ERR_ARG_SIZ, parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Another right-hand side after one that has no solution, with methods that look at the state of their preconditioner before they apply it */
static PetscErrorCode After(const char *outer)
{
  Options     options(std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -ksp_type ") + outer);
  DenseSystem d = Chain(DEFINITE);
  Column      x, lambda;
  Mat         Ct;
  Run         run;

  PetscFunctionBeginUser;
  Case("after a contradiction, outer %s", outer);
  AddRow(d, d.C.row(0) + d.C.row(1), 7.0);
  PetscCall(SystemFromDense(d, false, &run.sys));
  PetscCall(MatHermitianTranspose(run.sys.C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(NestCreate(run.sys.A, Ct, run.sys.C, NULL, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason < 0));
  PetscCall(CheckInt("failure", run.failure, PC_INCONSISTENT_RHS));
  d.g[5] = d.g[0] + d.g[1];
  PetscCall(Scatter(d.g, run.sys.g));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
  SolveSaddle(Chain(DEFINITE), x, lambda);
  PetscCall(CheckEqual("x", run.x, x, 1e-4));
  PetscCall(MatDestroy(&Ct));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A tolerance that nothing heeds */
static PetscErrorCode Unheeded(DenseSystem (*make)(Kind))
{
  Options options("-pc_ainsworth_error_rtol 1e-3");
  Run     run;

  PetscFunctionBeginUser;
  Case("an error tolerance without its stop");
  PetscCall(CheckError("options", [&]() { return RunCreate(make(DEFINITE), false, &run); }, PETSC_ERR_ARG_INCOMP,
                       {"-pc_ainsworth_error_rtol is a tolerance that nothing heeds: it needs -pc_ainsworth_stop energy_error"}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An outer method that opens a reduction around its preconditioner, and an inner one that opens its own: what cannot be nested is said; others work after it */
static PetscErrorCode Pipelined(const char *outer, const char *inner)
{
  Mat     Ct;
  Options options(std::string("-ksp_rtol 1e-7 -ksp_max_it 40 -ksp_type ") + outer + " -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-3 -ainsworth_ksp_type " +
                  inner);
  Run     run;
  PC      pc;
  const char *why;
  DenseSystem d = Chain(DEFINITE);
  Column      x, lambda;

  PetscFunctionBeginUser;
  Case("outer %s, inner %s", outer, inner);
  SolveSaddle(d, x, lambda);
  PetscCall(SystemFromDense(d, false, &run.sys));
  PetscCall(MatHermitianTranspose(run.sys.C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(NestCreate(run.sys.A, Ct, run.sys.C, NULL, false, &run.nest)); /* products with all of it */
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(RunSolve(&run));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  if (why[0]) {
    PetscCall(CheckTrue("only what is pipelined fails", std::string(inner) == "pipecg"));
    PetscCall(CheckText("failure", why, {"are both pipelined", "-ainsworth_ksp_type projectedcg"}));
  } else {
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    PetscCall(CheckEqual("x", run.x, x, 1e-4));
  }
  PetscCall(MatDestroy(&Ct));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Right-hand sides, and systems, of any size */
static PetscErrorCode Scales(bool crossed)
{
  PetscFunctionBeginUser;
  for (PetscReal scale : {1e-120, 1e-60, 1.0, 1e60, 1e120}) {
    DenseSystem d = Chain(DEFINITE);

    d.f *= scale;
    d.g *= scale;
    PetscCall(Solve("scaled right-hand side", d, "-ainsworth_pc_type jacobi", true, crossed));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (bool crossed : {false, true}) {
    PetscCall(Methods(crossed));
    PetscCall(Scales(crossed));
    PetscCall(Solve("a soft row without a diagonal", SoftPair(),
                    "-ainsworth_pc_type none -ainsworth_ksp_type gmres -ainsworth_ksp_norm_type unpreconditioned -ainsworth_ksp_rtol 1e-9", false, crossed));
  }
  for (DenseSystem (*make)(Kind) : {Chain, Cell}) {
    for (const char *outer : {KSPPREONLY, KSPPREONLY " -ksp_error_if_not_converged", KSPGMRES}) PetscCall(Causes(make, outer));
    for (bool below : {false, true}) PetscCall(Untransposed(make, below));
    PetscCall(Unheeded(make));
  }
  for (const char *outer : {"pgmres", "pipegcr", "pipefcg", "fgmres"}) {
    if (PetscDefined(USE_COMPLEX) && std::string(outer).compare(0, 4, "pipe") == 0) continue; /* PETSc has them for real numbers */
    for (const char *inner : {"projectedcg", "pipecg", "cg"}) PetscCall(Pipelined(outer, inner));
  }
  for (const char *outer : {"preonly", "fgmres", "gmres", "bcgs"}) PetscCall(After(outer));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
