static char help[] = "Rows of C that are long, unknowns that many rows share or that A does nothing to: what M_* has "
                     "of them, by dense formulas.\n\n";

#include "pmatreference.h"
#include "run.h"
#include <algorithm>

static const char common[] = "-pc_ainsworth_penalty_factor 2.5 -ainsworth_ksp_rtol 1e-11 ";

/* A chain of springs, fixed at both ends; no rows yet */
static DenseSystem Springs(PetscInt n, PetscInt m)
{
  DenseSystem d;

  d.A = Dense::Zero(n, n);
  for (PetscInt i = 0; i < n; i++) {
    d.A(i, i) = 2.5 + 0.1 * Uniform(1, i, i);
    if (i) d.A(i, i - 1) = d.A(i - 1, i) = -1.0;
  }
  d.C = Dense::Zero(m, n);
  d.f = Column::Zero(n);
  d.g = Column::Zero(m);
  for (PetscInt i = 0; i < n; i++) d.f[i] = Uniform(2, i, 0);
  for (PetscInt i = 0; i < m; i++) d.g[i] = Uniform(3, i, 0);
  return d;
}

/* Set up with these options: M_*, and what the view says */
static PetscErrorCode SetUp(Run *run, Mat *M, std::string *view)
{
  PC  pc;
  KSP inner;

  PetscFunctionBeginUser;
  PetscCall(KSPSetUp(run->ksp));
  PetscCall(KSPGetPC(run->ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetOperators(inner, NULL, M));
  PetscCall(ViewText(run->ksp, *view));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckSolution(Run *run, const DenseSystem &d)
{
  Column x, lambda;

  PetscFunctionBeginUser;
  SolveSaddle(d, x, lambda);
  PetscCall(RunSolve(run));
  PetscCall(CheckTrue("converged", run->reason > 0));
  PetscCall(CheckEqual("x", run->x, x, 1e-8));
  PetscCall(CheckEqual("lambda", run->lambda, lambda, 1e-7));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Q_*' A Q_* + C' B C with Q_* = I - W C' Inv(S) C, Inv(S) the inverse 1-norms of the rows of S scaled to a unit
   diagonal
*/
static Dense Jcb(const Dense &A, const Dense &C, const Column &W, const Column &B)
{
  const Dense  S = C * W.asDiagonal() * C.adjoint();
  const Column D = S.diagonal().unaryExpr(
    [](PetscScalar s) { return s == 0.0 ? PetscScalar(0.0) : PetscScalar(1.0 / std::sqrt(std::abs(s))); });
  Column inverse(C.rows());

  for (Eigen::Index i = 0; i < C.rows(); i++) {
    const PetscReal sum = Dense(D.asDiagonal() * S * D.asDiagonal()).row(i).cwiseAbs().sum();
    inverse[i]          = sum > 0.0 ? PetscScalar(D[i] * D[i] / sum) : PetscScalar(0.0);
  }
  return ReducedOperator(
    A, C, Dense::Identity(A.rows(), A.rows()) - W.asDiagonal() * C.adjoint() * inverse.asDiagonal() * C, B);
}

/* Short rows and one over half of the unknowns, which alone holds them where they float */
static PetscErrorCode LongRow(bool floating, PCAinsworthPmatType type)
{
  const PetscInt    n = 240, m = 6, size = 120;
  const std::string line = std::string(common) +
                           "-ainsworth_pc_type jacobi -ainsworth_ksp_max_it 1000 -pc_ainsworth_pmat " + PmatName(type);
  Options     options(line);
  DenseSystem d = Springs(n, m);
  Dense       shortC, expected, got;
  Column      B, W, shift = Column::Zero(n);
  Run         run;
  Mat         M;
  std::string view;

  PetscFunctionBeginUser;
  Case("a long row, %s, %s", floating ? "floating" : "fixed", PmatName(type));
  if (floating)
    for (PetscInt i = n - size; i < n; i++) { /* nothing but the long row has an entry there */
      d.A(i, i)     = i == n - size || i == n - 1 ? 1.0 : 2.0;
      d.A(i, i - 1) = d.A(i - 1, i) = i == n - size ? 0.0 : -1.0;
    }
  for (PetscInt i = 0; i + 1 < m; i++)
    for (PetscInt k = 0; k < 3; k++) d.C(i, 9 * i + 2 * k) = k ? -1.0 : 2.0;
  for (PetscInt i = n - size; i < n; i++) d.C(m - 1, i) = 1.0 / size;
  B      = RowPenalty(d.A, d.C, 2.5);
  W      = DiagonalWeight(d.A);
  shortC = d.C;
  shortC.row(m - 1).setZero();
  /* of a preconditioner in double precision */
  for (PetscInt i = n - size; i < n; i++) shift[i] = 1e-7 * n / size / W[i];
  if (type == PC_AINSWORTH_PMAT_ID) expected = d.A + shortC.adjoint() * B.asDiagonal() * shortC;
  else expected = Jcb(d.A, shortC, W, B);
  expected += Dense(shift.asDiagonal());
  PetscCall(RunCreate(d, false, &run));
  PetscCall(SetUp(&run, &M, &view));
  PetscCall(Gather(M, got));
  PetscCall(CheckEqual("M", got, expected, 1e-13));
  PetscCall(CheckText("view", view, {"1 long row"}));
  PetscCall(CheckSolution(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Many unknowns follow one: jcb moves them and leaves it where it is */
static PetscErrorCode Shared()
{
  const PetscInt n = 200, m = 80;
  Options options(std::string(common) + "-ainsworth_pc_type jacobi -ainsworth_ksp_max_it 1000 -pc_ainsworth_pmat jcb");
  DenseSystem d = Springs(n, m);
  Column      W;
  Dense       got;
  Run         run;
  Mat         M;
  std::string view;

  PetscFunctionBeginUser;
  Case("80 unknowns that follow one");
  for (PetscInt i = 0; i < m; i++) {
    d.C(i, 2 * i + 1) = 1.0;
    d.C(i, n - 2)     = -1.0;
  }
  W        = DiagonalWeight(d.A);
  W[n - 2] = 0.0;
  PetscCall(RunCreate(d, false, &run));
  PetscCall(SetUp(&run, &M, &view));
  PetscCall(Gather(M, got));
  PetscCall(CheckEqual("M", got, Jcb(d.A, d.C, W, RowPenalty(d.A, d.C, 2.5)), 1e-13));
  PetscCall(CheckSolution(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Unknowns that A does nothing to are eliminated from the penalty, but for one that many rows share: it is held, as
   conjugate gradients move it
*/
static PetscErrorCode Loose(PCAinsworthPmatType type)
{
  const PetscInt links = 32, n = 340, many = 70, m = 2 * links + 3 + many, first = n - links - 1;
  Options     options(std::string(common) + "-ainsworth_pc_type jacobi -ainsworth_ksp_max_it 1000 -pc_ainsworth_pmat " +
                      PmatName(type));
  DenseSystem d = Springs(n, m);
  Dense       got, rest, with, on, K, full, expected;
  Column      B, W, P;
  Run         run;
  Mat         M;
  std::string view;

  PetscFunctionBeginUser;
  Case("unknowns that A does nothing to, %s", PmatName(type));
  for (PetscInt i = first; i < n; i++) {
    d.A.row(i).setZero();
    d.A.col(i).setZero();
  }
  for (PetscInt i = 0; i < 2 * links; i++) { /* pairs of unknowns by way of a loose one */
    d.C(i, first + i / 2) = 1.0 + 0.01 * (i / 2);
    d.C(i, 2 * i)         = -1.0;
  }
  d.C(2 * links, first)     = 10.0; /* three of them in a row */
  d.C(2 * links, first + 1) = d.C(2 * links + 1, first + 1) = -10.0;
  d.C(2 * links + 1, first + 2)                             = 10.0;
  d.C(2 * links + 2, 1)                                     = 1.0; /* a row without */
  d.C(2 * links + 2, 3)                                     = -1.0;
  for (PetscInt i = 0; i < many; i++) {
    d.C(m - many + i, n - 1)     = 1.0;
    d.C(m - many + i, 5 + 2 * i) = -1.0;
  }
  W = Column::Zero(n);
  for (PetscInt i = 0; i < first; i++) W[i] = 1.0 / d.A(i, i);
  WeighLoose(d.C, W);
  full = d.A; /* the stiffest of the others stands in for a diagonal of zero */
  for (PetscInt i = first; i < n; i++) full(i, i) = d.A.diagonal().cwiseAbs().maxCoeff();
  B    = RowPenalty(full, d.C, 2.5);
  rest = with = d.C;
  rest.topRows(2 * links + 2).setZero();
  rest.col(n - 1).setZero();
  with.bottomRows(many + 1).setZero();
  on = with.middleCols(first, links);
  with.rightCols(links + 1).setZero();
  P = 2.5 *
      (with.cwiseAbs2() * W.cwiseAbs() + 0.1 * on.cwiseAbs2() * W.segment(first, links).cwiseAbs()).cwiseInverse();
  P.tail(many + 1).setZero();
  K        = on.adjoint() * P.asDiagonal() * on;
  expected = with.adjoint() *
             (Dense(P.asDiagonal()) - P.asDiagonal() * on * K.inverse() * on.adjoint() * P.asDiagonal()) * with;
  expected.block(first, first, links, links) = K.diagonal().asDiagonal();
  if (type == PC_AINSWORTH_PMAT_ID) expected += d.A + rest.adjoint() * B.asDiagonal() * rest;
  else {
    W.tail(links + 1) *= 100.0;
    W[n - 1] = 0.0;
    expected += Jcb(d.A, rest, W, B);
  }
  expected(n - 1, n - 1) += (PetscReal)many * full(n - 1, n - 1);
  PetscCall(RunCreate(d, false, &run));
  PetscCall(SetUp(&run, &M, &view));
  PetscCall(Gather(M, got));
  PetscCall(CheckEqual("M", got, expected, 1e-10));
  PetscCall(CheckSolution(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* auto looks at the entries that a row has at each node: rows that turn mix components, whatever they do together */
static PetscErrorCode Turned(PetscReal angle, const char expected[])
{
  const PetscInt n = 240, m = 8;
  Options        options(std::string(common) + "-ainsworth_pc_type jacobi -ainsworth_ksp_max_it 1000");
  DenseSystem    d = Springs(n, m);
  Run            run;
  Mat            M;
  std::string    view;

  PetscFunctionBeginUser;
  Case("ties turned by %g", (double)angle);
  for (PetscInt i = 0; i < m; i += 2) {
    d.C(i, 2 * i) = d.C(i + 1, 2 * i + 1) = 1.0;
    d.C(i, 24 + 2 * i) = d.C(i + 1, 25 + 2 * i) = -std::cos(angle);
    d.C(i, 25 + 2 * i)                          = std::sin(angle);
    d.C(i + 1, 24 + 2 * i)                      = -std::sin(angle);
  }
  d.C = d.C.unaryExpr([](PetscScalar v) { return std::abs(v) < 1e-14 ? PetscScalar(0.0) : v; });
  PetscCall(RunCreate(d, true, &run));
  PetscCall(MatSetBlockSize(run.sys.A, 2));
  PetscCall(SetUp(&run, &M, &view));
  PetscCall(CheckText("view", view, {expected}));
  PetscCall(CheckSolution(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows over nodes at random: their rows of A meet all others, and M_jcb would be dense. jcb is refused, auto is id */
static PetscErrorCode RandomRows(bool chosen)
{
  const PetscInt        n = 7200, m = 80, size = n / m;
  Options               options(std::string("-ainsworth_pc_type jacobi ") + (chosen ? "-pc_ainsworth_pmat jcb" : ""));
  std::vector<PetscInt> order(n / 2);
  Run                   run;
  Mat                   M;
  PetscInt              start, end;
  std::string           view;

  PetscFunctionBeginUser;
  Case("rows over nodes at random, %s", chosen ? "jcb" : "auto");
  for (PetscInt i = 0; i < n / 2; i++) order[i] = i;
  std::sort(order.begin(), order.end(), [](PetscInt a, PetscInt b) { return Uniform(5, a, 0) < Uniform(5, b, 0); });
  PetscCall(MatCreate(PETSC_COMM_WORLD, &run.sys.A));
  PetscCall(MatSetSizes(run.sys.A, PETSC_DECIDE, PETSC_DECIDE, n, n));
  PetscCall(MatSetBlockSize(run.sys.A, 2));
  PetscCall(MatSetType(run.sys.A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(run.sys.A, 3, NULL));
  PetscCall(MatMPIAIJSetPreallocation(run.sys.A, 3, NULL, 2, NULL));
  PetscCall(MatGetOwnershipRange(run.sys.A, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = PetscMax(i - 1, 0); j <= PetscMin(i + 1, n - 1); j++)
      PetscCall(MatSetValue(run.sys.A, i, j, i == j ? 2.5 : -1.0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(run.sys.A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(run.sys.A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, end - start, m, n, size, NULL, size, NULL, &run.sys.C));
  PetscCall(MatGetOwnershipRange(run.sys.C, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt k = 0; k < size; k++)
      PetscCall(MatSetValue(run.sys.C, i, 2 * order[(i * size + k) / 2] + k % 2, 1.0 + k % 3, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(run.sys.C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(run.sys.C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateVecs(run.sys.C, &run.sys.f, &run.sys.g));
  PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, NULL, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  if (chosen)
    PetscCall(CheckError("set-up", [&] { return KSPSetUp(run.ksp); }, PETSC_ERR_ARG_OUTOFRANGE,
                         {"-pc_ainsworth_pmat jcb", "entries", "use id"}));
  else {
    PetscCall(SetUp(&run, &M, &view));
    PetscCall(CheckText("view", view, {"preconditioning matrix: id, as jcb would have too many entries"}));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int       exitcode;
  PetscBool refuse;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (bool floating : {false, true})
    for (PCAinsworthPmatType type : {PC_AINSWORTH_PMAT_ID, PC_AINSWORTH_PMAT_JCB}) PetscCall(LongRow(floating, type));
  PetscCall(Shared());
  for (PCAinsworthPmatType type : {PC_AINSWORTH_PMAT_ID, PC_AINSWORTH_PMAT_JCB}) PetscCall(Loose(type));
  PetscCall(Turned(0.0, "as the constraints keep components apart"));
  PetscCall(Turned(0.3, "as the constraints mix components"));
  PetscCall(RandomRows(false));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-refuse", &refuse)); /* what an error leaves behind is not freed */
  if (refuse) PetscCall(RandomRows(true));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
