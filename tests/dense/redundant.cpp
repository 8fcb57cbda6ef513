static char help[] = "Constraints of which many depend on others: as many are left out as the rank says, and what is "
                     "kept has the solution.\n\n";

#include "run.h"
#include <cmath>
#include <petscsnes.h>

/* Rows as lists of ties x_i - x_j, or of sums */
struct Ties {
  int                              n; /* unknowns */
  std::vector<std::pair<int, int>> pairs;
};

static Dense Rows(const Ties &ties)
{
  Dense C = Dense::Zero((int)ties.pairs.size(), ties.n);

  for (size_t i = 0; i < ties.pairs.size(); i++) {
    C(i, ties.pairs[i].first)  = 1.0;
    C(i, ties.pairs[i].second) = -1.0;
  }
  return C;
}

static int Below(int seed, int i, int bound)
{
  return (int)((0.5 + 0.5 * (double)Uniform(seed, i, 3)) * bound);
}

/* The edges of two grids of k x k nodes */
static Ties Grids(int k)
{
  Ties ties = {2 * k * k, {}};

  for (int part = 0; part < 2; part++) {
    for (int i = 0; i < k; i++) {
      for (int j = 0; j + 1 < k; j++) {
        ties.pairs.emplace_back(part * k * k + i * k + j, part * k * k + i * k + j + 1);
        ties.pairs.emplace_back(part * k * k + j * k + i, part * k * k + (j + 1) * k + i);
      }
    }
  }
  return ties;
}

static Ties Network(int nodes, int edges)
{
  Ties ties = {nodes, {}};

  for (int i = 0; i < nodes; i += 2) ties.pairs.emplace_back(i, (i + 1) % nodes); /* no node alone */
  for (int i = 0; (int)ties.pairs.size() < edges; i++) {
    const int a = Below(41, i, nodes), b = Below(42, i, nodes);
    if (a != b) ties.pairs.emplace_back(a, b);
  }
  return ties;
}

/* Opposite points of a cube of k^3 tied in each direction, edges and corners as well */
static Ties PeriodicCell(int k)
{
  Ties ties = {k * k * k, {}};

  for (int i = 0; i < k; i++) {
    for (int j = 0; j < k; j++) {
      const int far = k - 1;

      ties.pairs.emplace_back(far + k * (i + k * j), k * (i + k * j));
      ties.pairs.emplace_back(i + k * (far + k * j), i + k * (k * j));
      ties.pairs.emplace_back(i + k * (j + k * far), i + k * j);
    }
  }
  return ties;
}

/* Groups of three points, tied in a ring */
static Ties Rings(int groups)
{
  Ties ties = {3 * groups, {}};

  for (int i = 0; i < groups; i++)
    for (int j = 0; j < 3; j++) ties.pairs.emplace_back(3 * i + j, 3 * i + (j + 1) % 3);
  return ties;
}

/* Sparse rows of random values, each third a combination of two others; scales over 16 decades */
static Dense Combinations(int m, int n)
{
  Dense C = Dense::Zero(m, n);

  for (int i = 0; i < m; i++)
    for (int k = 0; k < 4; k++) C(i, Below(43, 4 * i + k, n)) = 1.5 + Uniform(44, i, k);
  for (int i = 2; i < m; i += 3) C.row(i) = C.row(i - 1) - (2.0 + Uniform(45, i, 0)) * C.row((i * 5) % (m / 3) * 3);
  for (int i = 0; i < m; i++) C.row(i) *= std::pow(10.0, 8.0 * (double)Uniform(46, i, 0));
  return C;
}

/* Dependence does not follow from the pattern: every row in the span of a few */
static Dense Span(int m, int n, int rank)
{
  Dense L(m, rank), R(rank, n);

  for (int k = 0; k < rank; k++) {
    for (int i = 0; i < m; i++) L(i, k) = Uniform(47, i, k);
    for (int j = 0; j < n; j++) R(k, j) = Uniform(48, k, j);
  }
  return L * R;
}

static int Rank(const Dense &C)
{
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  Long rows  = C.real().cast<long double>();

  for (int i = 0; i < rows.rows(); i++) rows.row(i) /= rows.row(i).norm();
  Eigen::ColPivHouseholderQR<Long> qr(rows);
  qr.setThreshold(1e-12L);
  return (int)qr.rank();
}

/* A: diagonal over `decades`, with weak couplings where it has one scale. The right-hand side is that of some x */
static PetscErrorCode Solve(const char *name, const Dense &C, double decades, bool crossed, int rowsPerRank)
{
  const int   n = (int)C.cols(), m = (int)C.rows(), missing = m - Rank(C);
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10 -pc_ainsworth_rows_per_rank " +
                      std::to_string(rowsPerRank));
  DenseSystem d;
  Run         run;
  Column      x(n);
  std::string text;

  PetscFunctionBeginUser;
  Case("%s, A over %g decades, crossed %d, %d rows per rank", name, decades, crossed, rowsPerRank);
  d.A = Dense::Zero(n, n);
  d.C = C;
  d.f = Column::Zero(n);
  for (int i = 0; i < n; i++) {
    d.A(i, i) = (decades == 0.0 ? 2.0 : 1.0) * std::pow(10.0, decades * (double)Uniform(51, i, 0) / 2.0);
    d.f[i]    = Uniform(52, i, 0);
    x[i]      = Uniform(53, i, 0);
    if (i && decades == 0.0) d.A(i, i - 1) = d.A(i - 1, i) = 0.5 * Uniform(54, i, 0);
  }
  d.g = C * x;
  PetscCall(RunCreate(d, crossed, &run));
  PetscCall(RunSolve(&run));
  PetscCall(ViewText(run.ksp, text));
  PetscCall(CheckTrue(run.reason > 0 ? "" : text.c_str(), run.reason > 0));
  if (run.reason > 0) PetscCall(CheckResiduals(run, d, 1e-8, 1e-10));
  if (C.rows() > n && decades == 12.0 && missing == m - n)
    PetscCall(CheckText("view", text, {"weight: identity, as rows of C differ only where"}));
  if (missing)
    PetscCall(
      CheckText("view", text,
                {": " + std::to_string(m - missing) + ", " + std::to_string(missing) + " dependent rows left out"}));
  else PetscCall(CheckTrue("no dependent rows in the view", text.find("dependent") == std::string::npos));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With rows on as few ranks as there can be, and, with 2 rows per rank, components that ranks share */
static PetscErrorCode Scene(const char *name, const Dense &C)
{
  PetscFunctionBeginUser;
  for (double decades : {0.0, 12.0})
    for (int rowsPerRank : {25000, 2}) PetscCall(Solve(name, C, decades, rowsPerRank == 2, rowsPerRank));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Several right-hand sides at once; where one contradicts the rows, no later one makes that good */
static PetscErrorCode Several(bool contradicts)
{
  const Options options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10");
  DenseSystem   d;
  Run           run;
  Mat           B, X;
  IS            fields[2];
  PetscInt      n;

  PetscFunctionBeginUser;
  Case("several right-hand sides, one contradicts the rows: %d", contradicts);
  d.C = Rows(Rings(8));
  d.A = 2.0 * Dense::Identity(d.C.cols(), d.C.cols());
  d.f = Column::Ones(d.C.cols());
  d.g = Column::Zero(d.C.rows());
  PetscCall(RunCreateWhole(d, &run));
  PetscCall(MatGetLocalSize(run.nest, &n, NULL));
  PetscCall(MatNestGetISs(run.nest, fields, NULL));
  PetscCall(MatCreateDense(PETSC_COMM_WORLD, n, PETSC_DECIDE, PETSC_DETERMINE, 3, NULL, &B));
  for (PetscInt j = 0; j < 3; j++) {
    Vec b;

    PetscCall(MatDenseGetColumnVecWrite(B, j, &b));
    PetscCall(VecISSet(b, fields[0], 1.0 + (PetscReal)j));
    PetscCall(VecISSet(b, fields[1], contradicts && !j ? 1.0 : 0.0)); /* around a ring */
    PetscCall(MatDenseRestoreColumnVecWrite(B, j, &b));
  }
  PetscCall(MatDuplicate(B, MAT_DO_NOT_COPY_VALUES, &X));
  if (contradicts)
    PetscCall(CheckError("KSPMatSolve", [&]() { return KSPMatSolve(run.ksp, B, X); }, PETSC_ERR_NOT_CONVERGED,
                         {"Column 0 of", "is not that of the other rows"}));
  else PetscCall(KSPMatSolve(run.ksp, B, X));
  for (PetscInt j = 0; j < 3 && !contradicts; j++) {
    Vec       x, b, difference;
    PetscReal norm;

    PetscCall(MatCreateVecs(run.nest, NULL, &difference));
    PetscCall(MatDenseGetColumnVecRead(X, j, &x));
    PetscCall(MatMult(run.nest, x, difference));
    PetscCall(MatDenseRestoreColumnVecRead(X, j, &x));
    PetscCall(MatDenseGetColumnVecRead(B, j, &b));
    PetscCall(VecAXPY(difference, -1.0, b));
    PetscCall(MatDenseRestoreColumnVecRead(B, j, &b));
    PetscCall(VecNorm(difference, NORM_INFINITY, &norm));
    PetscCall(Check("K x - b", norm, 1e-9));
    PetscCall(VecDestroy(&difference));
  }
  PetscCall(MatDestroy(&X));
  PetscCall(MatDestroy(&B));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A x + k x^3 + C' l = f, C x = g */
struct Cubic {
  Run       linear, tangent; /* both of A without the cube */
  PetscReal k;
  IS        is[2];
  Vec       b;
};

static PetscErrorCode ComputeResidual(SNES, Vec y, Vec r, void *ctx)
{
  Cubic *cubic = (Cubic *)ctx;
  Vec    x, cube;

  PetscFunctionBeginUser;
  PetscCall(MatMult(cubic->linear.nest, y, r));
  PetscCall(VecAXPY(r, -1.0, cubic->b));
  PetscCall(VecGetSubVector(y, cubic->is[0], &x));
  PetscCall(VecDuplicate(x, &cube));
  PetscCall(VecPointwiseMult(cube, x, x));
  PetscCall(VecPointwiseMult(cube, cube, x));
  PetscCall(VecRestoreSubVector(y, cubic->is[0], &x));
  PetscCall(VecGetSubVector(r, cubic->is[0], &x));
  PetscCall(VecAXPY(x, cubic->k, cube));
  PetscCall(VecRestoreSubVector(r, cubic->is[0], &x));
  PetscCall(VecDestroy(&cube));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ComputeTangent(SNES, Vec y, Mat J, Mat, void *ctx)
{
  Cubic *cubic = (Cubic *)ctx;
  Vec    x, square;

  PetscFunctionBeginUser;
  PetscCall(VecGetSubVector(y, cubic->is[0], &x));
  PetscCall(VecDuplicate(x, &square));
  PetscCall(VecPointwiseMult(square, x, x));
  PetscCall(VecRestoreSubVector(y, cubic->is[0], &x));
  PetscCall(VecScale(square, 3.0 * cubic->k));
  PetscCall(MatCopy(cubic->linear.sys.A, cubic->tangent.sys.A, SAME_NONZERO_PATTERN));
  PetscCall(MatDiagonalSet(cubic->tangent.sys.A, square, ADD_VALUES));
  PetscCall(VecDestroy(&square));
  PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The last residuals of Newton's method are the rounding of x: rows that depend on others contradict them there, by
   much of what the last steps are
*/
static PetscErrorCode Newton(const Dense &C)
{
  Options             options("-snes_rtol 1e-30 -snes_atol 1e-30 -snes_stol 1e-14 -pc_type ainsworth -ksp_type preonly "
                                          "-ainsworth_pc_type jacobi");
  DenseSystem         d = SpringsCreate(C.cols(), 1, 2e4, 19);
  Cubic               cubic;
  SNES                snes;
  Vec                 y, r;
  PetscReal           first, last;
  SNESConvergedReason reason;

  PetscFunctionBeginUser;
  Case("Newton's method");
  cubic.k = 2e4;
  d.C     = C;
  d.g     = C * Column::NullaryExpr(C.cols(), [](Eigen::Index i) { return Uniform(21, (PetscInt)i, 0); });
  for (Run *run : {&cubic.linear, &cubic.tangent}) PetscCall(RunCreateWhole(d, run));
  PetscCall(MatNestGetISs(cubic.linear.nest, cubic.is, NULL));
  PetscCall(MatCreateVecs(cubic.linear.nest, &y, &r));
  PetscCall(VecDuplicate(r, &cubic.b));
  for (int k = 0; k < 2; k++) {
    Vec part;

    PetscCall(VecGetSubVector(cubic.b, cubic.is[k], &part));
    PetscCall(VecCopy(k ? cubic.linear.sys.g : cubic.linear.sys.f, part));
    PetscCall(VecRestoreSubVector(cubic.b, cubic.is[k], &part));
  }
  PetscCall(SNESCreate(PETSC_COMM_WORLD, &snes));
  PetscCall(SNESSetFunction(snes, r, ComputeResidual, &cubic));
  PetscCall(SNESSetJacobian(snes, cubic.tangent.nest, cubic.tangent.nest, ComputeTangent, &cubic));
  PetscCall(SNESSetFromOptions(snes));
  PetscCall(ComputeResidual(snes, y, r, &cubic));
  PetscCall(VecNorm(r, NORM_2, &first));
  PetscCall(SNESSolve(snes, NULL, y));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  PetscCall(CheckTrue(SNESConvergedReasons[reason], reason > 0));
  PetscCall(ComputeResidual(snes, y, r, &cubic));
  PetscCall(VecNorm(r, NORM_2, &last));
  PetscCall(Check("the residual", last, 1e-13 * first));
  PetscCall(SNESDestroy(&snes));
  for (Vec *v : {&y, &r, &cubic.b}) PetscCall(VecDestroy(v));
  for (Run *run : {&cubic.linear, &cubic.tangent}) PetscCall(RunDestroy(run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (bool contradicts : {false, true}) PetscCall(Several(contradicts));
  PetscCall(Newton(Rows(PeriodicCell(3))));
  PetscCall(Newton(Rows(Rings(12))));
  PetscCall(Scene("edges of grids", Rows(Grids(7))));
  PetscCall(Scene("nodes of grids", Rows(Grids(7)).transpose()));
  PetscCall(Scene("edges of network", Rows(Network(40, 120))));
  PetscCall(Scene("nodes of network", Rows(Network(60, 90)).transpose()));
  PetscCall(Scene("periodic cell", Rows(PeriodicCell(5))));
  PetscCall(Scene("rings", Rows(Rings(30))));
  PetscCall(Scene("combinations", Combinations(60, 70)));
  PetscCall(Scene("span", Span(40, 50, 23)));
  PetscCall(Scene("span of all", Span(40, 30, 30)));
  PetscCall(Scene("independent", Span(30, 50, 50)));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
