static char help[] = "The whole system [A B'; C -D], equilibrated and factored, against dense LU.\n\n";

#include "blocks.h"
#include "inner/whole.h"
#include <algorithm>

/* The assembled matrix is that of the blocks in PETSc's numbering of a nest, and each diagonal entry is stored */
static PetscErrorCode CheckAssembly(const AinsworthSaddle &sp, const Dense &K)
{
  Mat                   whole;
  Dense                 got, expected(K.rows(), K.cols());
  PetscMPIInt           size;
  const PetscInt       *n, *m;
  PetscInt              start, end;
  bool                  stored = true;
  std::vector<PetscInt> number;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(MatGetOwnershipRangesColumn(sp.kept.C, &n));
  PetscCall(MatGetOwnershipRanges(sp.kept.C, &m));
  for (PetscMPIInt r = 0; r < size; r++) {
    for (PetscInt i = n[r]; i < n[r + 1]; i++) number.push_back(i);
    for (PetscInt i = m[r]; i < m[r + 1]; i++) number.push_back(n[size] + i);
  }
  for (size_t i = 0; i < number.size(); i++)
    for (size_t j = 0; j < number.size(); j++) expected(i, j) = K(number[i], number[j]);
  PetscCall(AinsworthWholeAssemble(&sp, &whole));
  PetscCall(Gather(whole, got));
  PetscCall(CheckEqual("K", got, expected, 0.0));
  PetscCall(MatGetOwnershipRange(whole, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscInt        length;
    const PetscInt *j;

    PetscCall(MatGetRow(whole, i, &length, &j, NULL));
    stored = stored && std::count(j, j + length, i) == 1;
    PetscCall(MatRestoreRow(whole, i, &length, &j, NULL));
  }
  PetscCall(CheckTrue("each diagonal entry is stored", stored));
  PetscCall(MatDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RefinedSolve(const AinsworthWhole *whole, const Dense &K, PetscBool transpose, int steps,
                                   AinsworthSaddleVec b, AinsworthSaddleVec y)
{
  AinsworthSaddleVec r;
  Column             rhs, x;
  PetscInt           n;

  PetscFunctionBeginUser;
  PetscCall(AinsworthWholeSolve(whole, transpose, b, y));
  PetscCall(AinsworthSaddleVecDuplicate(b, &r));
  PetscCall(VecGetSize(r.primal, &n));
  PetscCall(GatherBoth(b, rhs));
  for (int step = 0; step < steps; step++) {
    PetscCall(GatherBoth(y, x));
    x = rhs - K * x;
    PetscCall(Scatter(x.head(n), r.primal));
    PetscCall(Scatter(x.tail(x.size() - n), r.dual));
    PetscCall(AinsworthWholeSolve(whole, transpose, r, r));
    PetscCall(AinsworthSaddleVecAXPY(y, 1.0, r));
  }
  PetscCall(AinsworthSaddleVecDestroy(&r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(const Kind &kind, PetscInt seed)
{
  const Blocks       b      = Draw(kind, seed);
  const Dense        K      = b.K();
  const Column       s      = Equilibrate(K);
  const Dense        scaled = s.asDiagonal() * K * s.asDiagonal();
  Column             rhs(K.rows()), got;
  AinsworthSaddle    sp;
  AinsworthSaddleVec scale, f, y;
  AinsworthWhole    *whole;
  char               why[256];

  PetscFunctionBeginUser;
  Case("%s, seed %d", kind.name, (int)seed);
  const Options options(kind.options);

  for (Eigen::Index i = 0; i < rhs.size(); i++) rhs[i] = Entry(seed + 20, (PetscInt)i, 0) / s[i];
  PetscCall(SaddleCreate(b, kind, &sp));
  PetscCall(VecsCreate(sp, s, &scale));
  PetscCall(VecsCreate(sp, rhs, &f));
  PetscCall(AinsworthSaddleVecDuplicate(f, &y));
  PetscCall(CheckAssembly(sp, K));
  PetscCall(AinsworthWholeCreate(&sp, (PetscBool)kind.symmetric, scale, "test_", &whole, why, sizeof(why)));
  PetscCall(CheckTrue(why, whole != NULL && !why[0]));
  for (int transpose = 0; whole && transpose <= kind.transpose; transpose++) {
    const Column
      exact = (transpose ? Dense(scaled.transpose()) : scaled).fullPivLu().solve(Column(s.cwiseProduct(rhs)));

    PetscCall(RefinedSolve(whole, transpose ? Dense(K.transpose()) : K, (PetscBool)transpose, kind.steps, f, y));
    PetscCall(GatherBoth(y, got));
    PetscCall(
      CheckEqual(transpose ? "the solution of the transpose" : "the solution", got.cwiseQuotient(s), exact, 1e-9));
  }
  if (whole && !kind.steps) { /* in place */
    PetscCall(AinsworthWholeSolve(whole, PETSC_FALSE, f, f));
    PetscCall(GatherBoth(f, got));
    PetscCall(CheckEqual("the solution in place", scaled * got.cwiseQuotient(s), s.cwiseProduct(rhs), 1e-9));
  }
  PetscCall(AinsworthWholeDestroy(&whole));
  PetscCall(CheckTrue("gone", !whole));
  for (AinsworthSaddleVec *v : {&scale, &f, &y}) PetscCall(AinsworthSaddleVecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An unknown in no equation, and a row without unknowns: the same words on all ranks, and no error */
static PetscErrorCode Singular(bool row, const char options[])
{
  Kind               kind{"singular"};
  Blocks             b = Draw(kind, 1);
  AinsworthSaddle    sp;
  AinsworthSaddleVec scale;
  AinsworthWhole    *whole;
  char               why[256], first[256];
  const PetscInt     i = 11;

  PetscFunctionBeginUser;
  Case("singular, %s, %s", row ? "a row" : "an unknown", options);
  const Options given(options);

  if (row) b.C.row(5).setZero();
  else {
    b.C.col(i).setZero();
    b.A.col(i).setZero();
    b.A.row(i).setZero();
  }
  PetscCall(SaddleCreate(b, kind, &sp));
  PetscCall(VecsCreate(sp, Equilibrate(b.K()), &scale));
  PetscCall(AinsworthWholeCreate(&sp, PETSC_TRUE, scale, "test_", &whole, why, sizeof(why)));
  PetscCall(CheckTrue("no factor", !whole));
  PetscCall(CheckText("why", why, {"the whole system cannot be factored: "}));
  PetscCall(PetscStrncpy(first, why, sizeof(first)));
  PetscCallMPI(MPI_Bcast(first, sizeof(first), MPI_CHAR, 0, PETSC_COMM_WORLD));
  PetscCall(CheckTrue("the same on all ranks", !strcmp(first, why)));
  PetscCall(AinsworthWholeDestroy(&whole));
  PetscCall(AinsworthSaddleVecDestroy(&scale));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A full matrix has a full factor */
static PetscErrorCode Predict(bool symmetric)
{
  const Kind      kind{"full", symmetric};
  Blocks          b = Draw(kind, 1);
  AinsworthSaddle sp;
  AinsworthCost   cost;
  PetscReal       N, expected[2] = {0.0, 0.0};

  PetscFunctionBeginUser;
  Case("prediction");
  for (Dense *M : {&b.A, &b.B, &b.C}) M->array() += 20.0;
  N = (PetscReal)(b.n() + b.m());
  /* C is eliminated last, or first: there are no entries in D, but the elimination of any unknown fills it */
  PetscCall(SaddleCreate(b, kind, &sp));
  PetscCall(AinsworthWholePredict(&sp, (PetscBool)symmetric, &cost));
  for (PetscReal k = 1.0; k <= N; k++) {
    expected[0] += k;
    expected[1] += k * k;
  }
  for (PetscReal &e : expected) e *= symmetric && !PetscDefined(USE_COMPLEX) ? 1.0 : 2.0;
  PetscCall(Check("the entries", cost.entries, expected[0]));
  PetscCall(Check("the operations", cost.operations, expected[1]));
  PetscCall(Check("the entries expected", 0.8 * expected[0], cost.entries));
  PetscCall(Check("the operations expected", 0.8 * expected[1], cost.operations));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode View()
{
  const Kind         kind{"view"};
  const Blocks       b = Draw(kind, 1);
  AinsworthSaddle    sp;
  AinsworthSaddleVec scale;
  AinsworthWhole    *whole;
  PetscViewer        viewer;
  char               why[256];
  std::string        text;

  PetscFunctionBeginUser;
  Case("view");
  PetscCall(SaddleCreate(b, kind, &sp));
  PetscCall(VecsCreate(sp, Equilibrate(b.K()), &scale));
  PetscCall(AinsworthWholeCreate(&sp, PETSC_TRUE, scale, "test_", &whole, why, sizeof(why)));
  PetscCall(PetscViewerASCIIOpen(PETSC_COMM_WORLD, "whole.txt", &viewer));
  PetscCall(AinsworthWholeView(whole, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(FileText("whole.txt", text));
  PetscCall(CheckText("the view", text,
                      {"the whole system [A B'; C -D], 54 unknowns, equilibrated and factored:", "(test_whole_)"}));
  PetscCall(AinsworthWholeDestroy(&whole));
  PetscCall(AinsworthSaddleVecDestroy(&scale));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static std::vector<Kind> Kinds()
{
  std::vector<Kind> kinds;
  const auto        add = [&](const char *name) -> Kind        &{
    return kinds.emplace_back(), kinds.back().name = name, kinds.back();
  };

  add("definite");
  add("indefinite").definite   = false;
  add("unsymmetric").symmetric = false;
  add("D diagonal").compliance = DIAGONAL;
  add("D coupled").compliance  = COUPLED;
  add("no diagonal").diagonal  = false;
  add("uneven").uneven         = true;
  add("SBAIJ").type            = PetscDefined(USE_COMPLEX) ? MATBAIJ : MATSBAIJ;
  add("badly scaled").decades  = 8.0;

  Kind &hard     = add("all of it");
  hard.symmetric = hard.definite = hard.diagonal = false;
  hard.compliance                                = COUPLED;
  hard.decades                                   = 8.0;
  hard.uneven                                    = true;

  Kind &quasi    = add("all of it, symmetric");
  quasi.definite = quasi.diagonal = false;
  quasi.compliance                = COUPLED;
  quasi.decades                   = 8.0;
  return kinds;
}

/* What is chosen where PETSc has no MUMPS, by options */
static PetscErrorCode Packages(PetscMPIInt size)
{
  struct Package {
    bool        all;      /* on several ranks, too */
    bool        perturbs; /* pivots: the answer is refined, and a singular system may be factored */
    std::string options;
  };
  const std::string package     = "-test_whole_pc_factor_mat_solver_type ",
                    each        = "-test_whole_pc_type redundant -test_whole_redundant_pc_factor_mat_solver_type ";
  std::vector<Package> packages = {
    {false, true, package + "petsc"},
    {true,  true, each + "petsc"   }
  };

  PetscFunctionBeginUser;
#if defined(PETSC_HAVE_MUMPS)
  packages.push_back({true, false, "-test_whole_pc_type lu"});
#elif defined(PETSC_HAVE_SUPERLU_DIST)
  packages.push_back({true, true, size > 1 ? "" : package + "superlu_dist"});
#else
  packages.push_back({true, true, ""});
#endif
#if defined(PETSC_HAVE_SUITESPARSE)
  packages.push_back({false, false, package + "umfpack"});
  packages.push_back({true, false, each + "umfpack"});
#endif
#if defined(PETSC_HAVE_SUPERLU_DIST)
  packages.push_back({true, true, package + "superlu_dist"});
#endif
  for (const Package &p : packages) {
    if (size > 1 && !p.all) continue;
    for (Kind kind : Kinds()) {
      const std::string name = kind.name + (" with " + p.options);

      kind.name    = name.c_str();
      kind.options = p.options.c_str();
      kind.steps   = p.perturbs ? 4 : 0;
      /* not with SuperLU_DIST */
      kind.transpose = kind.symmetric || !p.perturbs || p.options.find("petsc") != std::string::npos;
      PetscCall(Solve(kind, 1));
    }
    if (p.perturbs) continue;
    for (bool row : {false, true}) PetscCall(Singular(row, p.options.c_str()));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int         exitcode;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
#if defined(PETSC_HAVE_MUMPS)
  for (const Kind &kind : Kinds())
    for (PetscInt seed : {1, 1001, 2001}) PetscCall(Solve(kind, seed));
  for (bool row : {false, true}) PetscCall(Singular(row, ""));
#endif
  PetscCall(Packages(size));
  for (bool symmetric : {true, false}) PetscCall(Predict(symmetric));
  PetscCall(View());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
