static char help[] = "Systems that are not the usual ones: blocks without entries, many rows, null spaces of the whole, NaN in g, tiny stiffness.\n\n";

#include "run.h"
#include <cmath>

/* Springs of stiffness 1 between neighbors and to the ground; m rows at random of C */
static DenseSystem Springs(PetscInt n, PetscInt m)
{
  DenseSystem d;

  d.A = Dense::Zero(n, n);
  d.C = Dense::Zero(m, n);
  for (PetscInt i = 0; i < n; i++) {
    d.A(i, i) = 3.0;
    if (i) d.A(i, i - 1) = d.A(i - 1, i) = -1.0;
  }
  for (PetscInt i = 0; i < m; i++)
    for (PetscInt j = 0; j < n; j++) d.C(i, j) = Uniform(7, i, j);
  d.f.resize(n);
  d.g.resize(m);
  for (PetscInt i = 0; i < n; i++) d.f[i] = Uniform(8, i, 0);
  for (PetscInt i = 0; i < m; i++) d.g[i] = Uniform(9, i, 0);
  return d;
}

/* A shell of few unknowns is solved */
static PetscErrorCode SmallShell(bool diagonal, bool ofC, bool crossed)
{
  Options           options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13");
  const DenseSystem d = Springs(12, 3);
  Mat               shell;
  Run               run;

  PetscFunctionBeginUser;
  Case("small shell, diagonal %d, of C %d, crossed %d", diagonal, ofC, crossed);
  PetscCall(SystemFromDense(d, crossed, &run.sys));
  PetscCall(ShellCreate(ofC ? run.sys.C : run.sys.A, diagonal, false, &shell));
  PetscCall(NestCreate(ofC ? run.sys.A : shell, NULL, ofC ? shell : run.sys.C, NULL, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(CheckSolution(run.ksp, run.sys, d, false, false, 1e-10));
  PetscCall(MatDestroy(&shell));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An identity of n unknowns, its first two tied */
static PetscErrorCode TiedIdentity(PetscInt n, Mat *A, Mat *C)
{
  PetscInt start, end, local;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n, n, 1, NULL, 0, NULL, A));
  PetscCall(MatGetOwnershipRange(*A, &start, &end));
  for (PetscInt i = start; i < end; i++) PetscCall(MatSetValue(*A, i, i, 1.0, INSERT_VALUES));
  PetscCall(MatGetLocalSize(*A, &local, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, local, 1, n, 2, NULL, 2, NULL, C));
  PetscCall(MatGetOwnershipRange(*C, &start, &end));
  for (PetscInt j = 0; j < 2 && start < end; j++) PetscCall(MatSetValue(*C, 0, j, j ? -1.0 : 1.0, INSERT_VALUES));
  for (Mat M : {*A, *C}) {
    PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One of many unknowns is refused, in a block or a part of one */
static PetscErrorCode LargeShell()
{
  const PetscInt n = 1200;
  Mat            A, C, shell, parts, composite, nest;

  PetscFunctionBeginUser;
  Case("large shell");
  PetscCall(TiedIdentity(n, &A, &C));
  PetscCall(ShellCreate(A, true, false, &shell));
  Mat one[] = {shell};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 1, NULL, 1, NULL, one, &parts));
  PetscCall(MatCreateComposite(PETSC_COMM_WORLD, 1, &A, &composite));
  for (Mat block : {shell, parts, composite}) {
    KSP               ksp;
    const std::string what = block == shell ? "has type shell" : (block == parts ? "has a part of type shell" : "has type composite");

    PetscCall(NestCreate(block, NULL, C, NULL, false, &nest));
    PetscCall(SolverCreate(nest, &ksp));
    PetscCall(CheckError(what.c_str(), [=]() { return KSPSetUp(ksp); }, PETSC_ERR_SUP, {"Block (0,0) of the MatNest, A, " + what, "1200 products", "MATAIJ"}));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&nest));
  }
  PetscCall(MatDestroy(&shell));
  PetscCall(ShellCreate(C, false, false, &shell));
  for (bool first : {false, true}) {
    KSP ksp;

    PetscCall(NestCreate(A, NULL, shell, NULL, first, &nest));
    PetscCall(SolverCreate(nest, &ksp));
    PetscCall(CheckError("C", [=]() { return KSPSetUp(ksp); }, PETSC_ERR_SUP,
                         {first ? "Block (0,1) of the MatNest, C, has type shell" : "Block (1,0) of the MatNest, C, has type shell", "1200 products"}));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&nest));
  }
  for (Mat *mat : {&A, &C, &shell, &parts, &composite}) PetscCall(MatDestroy(mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the second solve the program passes something else than a nest */
static PetscErrorCode OtherMatrix()
{
  Options           options("-ainsworth_pc_type jacobi");
  const DenseSystem d = Springs(12, 3);
  Mat               whole, nest, Ct;
  Vec               b, y;
  Run               run;

  PetscFunctionBeginUser;
  Case("the whole as AIJ, or as a nest of one block, at the second solve");
  PetscCall(RunCreate(d, false, &run));
  PetscCall(RunSolve(&run));
  PetscCall(MatHermitianTranspose(run.sys.C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(NestCreate(run.sys.A, Ct, run.sys.C, NULL, false, &nest));
  PetscCall(MatCreateVecs(nest, &y, &b));
  PetscCall(SetRandom(b, 71));
  PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, &whole));
  PetscCall(MatDestroy(&nest));
  PetscCall(KSPSetOperators(run.ksp, whole, whole));
  Mat one[] = {whole};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 1, NULL, 1, NULL, one, &nest));
  for (Mat mat : {whole, nest}) {
    PetscReal residual, norm;
    Vec       r;

    PetscCall(KSPSetOperators(run.ksp, mat, mat));
    PetscCall(KSPSolve(run.ksp, b, y));
    PetscCall(VecNorm(b, NORM_2, &norm));
    PetscCall(VecDuplicate(b, &r));
    PetscCall(MatMult(whole, y, r));
    PetscCall(VecAXPY(r, -1.0, b));
    PetscCall(VecNorm(r, NORM_2, &residual));
    PetscCall(Check("residual", residual, 1e-6 * norm));
    PetscCall(VecDestroy(&r));
  }
  PetscCall(KSPSetOperators(run.ksp, run.nest, run.nest));
  PetscCall(CheckSolution(run.ksp, run.sys, d, false, false, 1e-6));
  for (Mat *mat : {&nest, &whole, &Ct}) PetscCall(MatDestroy(mat));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The diagonal block of the multipliers */
static PetscErrorCode DiagonalBlock(Mat C, const Column &values, Mat *D)
{
  PetscInt m, start, end;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(C, &m, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, D));
  PetscCall(MatGetOwnershipRange(*D, &start, &end));
  for (PetscInt i = start; i < end; i++) PetscCall(MatSetValue(*D, i, i, values[i], INSERT_VALUES));
  PetscCall(MatAssemblyBegin(*D, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*D, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* More rows of C than unknowns; all but 3 are zero, inactive (an entry of D alone), or have an entry of D */
static PetscErrorCode InactiveRows(const char *kind, bool diagonalA, bool crossed)
{
  Options        options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13");
  const bool     zero = kind == std::string("zero"), penalised = kind == std::string("penalised");
  const PetscInt n = 6, m = 10;
  DenseSystem    d     = Springs(n, m);
  Column         D     = Column::Zero(m), b(n + m), y;
  Dense          K     = Dense::Zero(n + m, n + m);
  Mat            block = NULL;
  Run            run;

  PetscFunctionBeginUser;
  Case("%s rows, more than unknowns, A diagonal %d, crossed %d", kind, diagonalA, crossed);
  if (diagonalA) d.A = Dense(d.A.diagonal().asDiagonal());
  for (PetscInt i = 0; i < m; i++) {
    if (i % 4 == 1) continue;
    if (!penalised) d.C.row(i).setZero();
    if (zero) d.g[i] = 0.0;
    else D[i] = -0.5 - 0.1 * i;
  }
  PetscCall(SystemFromDense(d, crossed, &run.sys));
  if (!zero) PetscCall(DiagonalBlock(run.sys.C, D, &block));
  PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, block, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
  if (zero)
    D = Column::Constant(m, -1.0).cwiseProduct(Column(d.C.rowwise().norm().unaryExpr([](PetscReal r) { return r > 0.0 ? 0.0 : 1.0; }).cast<PetscScalar>()));
  K.topLeftCorner(n, n)     = d.A;
  K.topRightCorner(n, m)    = d.C.adjoint();
  K.bottomLeftCorner(m, n)  = d.C;
  K.bottomRightCorner(m, m) = D.asDiagonal();
  b << d.f, d.g;
  y = K.fullPivLu().solve(b);
  PetscCall(CheckEqual("x", run.x, y.head(n), 1e-8));
  PetscCall(CheckEqual("lambda", run.lambda, y.tail(m), 1e-8));
  PetscCall(MatDestroy(&block));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* More rows than unknowns that are no zero rows depend on each other: left out, or refused where that was asked for */
static PetscErrorCode DependentRows(bool strict, bool crossed)
{
  Options     options(std::string("-ainsworth_pc_type jacobi") + (strict ? " -pc_ainsworth_redundant error" : ""));
  DenseSystem d = Springs(6, 8);
  Run         run;

  PetscFunctionBeginUser;
  Case("8 dependent rows of 6 unknowns, strict %d, crossed %d", strict, crossed);
  d.C.setZero();
  for (int i = 0; i < 8; i++) {
    d.C(i, i % 6) = 1.0;
    d.g[i]        = 0.5 + i % 6;
  }
  PetscCall(RunCreate(d, crossed, &run));
  if (strict) PetscCall(CheckError("set-up", [&]() { return KSPSetUp(run.ksp); }, PETSC_ERR_MAT_CH_ZRPVT, {"2 rows of C are linear combinations of others"}));
  else {
    PetscCall(RunSolve(&run));
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    PetscCall(CheckResiduals(run, d, 1e-12, 1e-14));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A ring of ties, one too many, that several ranks share: each is left with one between unknowns that others have, too, and rank 0 finds it */
static PetscErrorCode Ring(bool strict)
{
  Options        options(std::string("-ainsworth_pc_type jacobi -pc_ainsworth_rows_per_rank 2") + (strict ? " -pc_ainsworth_redundant error" : ""));
  const PetscInt n = 40;
  DenseSystem    d = Springs(n + 1, n);
  Run            run;

  PetscFunctionBeginUser;
  Case("a ring, strict %d", strict);
  d.C.setZero();
  for (PetscInt i = 0; i < n; i++) {
    d.C(i, i)           = 1.0;
    d.C(i, (i + 1) % n) = -1.0;
  }
  d.g -= Column::Constant(n, d.g.mean());
  PetscCall(RunCreate(d, false, &run));
  if (strict) PetscCall(CheckError("set-up", [&]() { return KSPSetUp(run.ksp); }, PETSC_ERR_MAT_CH_ZRPVT, {"1 rows of C are linear combinations of others"}));
  else {
    PetscCall(RunSolve(&run));
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    PetscCall(CheckResiduals(run, d, 1e-12, 1e-12));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NaN or Inf in g, on a row that is zero, dependent, or one that is kept beside such a row */
static PetscErrorCode NotFinite(const char *where, PetscReal value, bool strict, bool crossed)
{
  Options        options(std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13") + (strict ? " -ksp_error_if_not_converged" : ""));
  const bool     dependent = where == std::string("dependent"), zero = where == std::string("zero");
  const PetscInt row = zero ? 1 : (dependent ? 3 : 2);
  DenseSystem    d   = Springs(12, 4), good;
  Run            run;

  PetscFunctionBeginUser;
  Case("g is %g on a %s row, strict %d, crossed %d", (double)value, where, strict, crossed);
  d.C.row(1).setZero();
  d.g[1] = 0.0;
  if (dependent) {
    d.C.row(3) = d.C.row(0);
    d.g[3]     = d.g[0];
  }
  good     = d;
  d.g[row] = value;
  PetscCall(RunCreate(d, crossed, &run));
  if (strict)
    PetscCall(CheckError("solve", [&]() { return RunSolve(&run); }, PETSC_ERR_FP,
                         {"right-hand side holds NaN or Inf in row " + std::to_string(row) + " of the multiplier field"}));
  else {
    PetscCall(RunSolve(&run));
    PetscCall(CheckFailed(run));
    PetscCall(Scatter(good.g, run.sys.g));
    PetscCall(RunSolve(&run));
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    PetscCall(CheckResiduals(run, good, 1e-11, 1e-12));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Springs without ground, A 1 = 0, ties with C 1 = 0; that is told by a null space of the whole matrix: 0 of both, 1 of Amat alone, 2 with a second vector */
static PetscErrorCode WholeNullSpace(int declared, bool first, bool crossed)
{
  Options        options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13");
  const PetscInt n = 9;
  DenseSystem    d = Springs(n, 3);
  Run            run;
  Mat            Ct, other, S, M;
  IS             is[2];
  Vec            v[2], sub, b, y;
  MatNullSpace   nullsp, got;
  KSP            inner;
  PC             pc;
  Dense          K;
  Column         db, dy, one;

  PetscFunctionBeginUser;
  Case("null space of the whole, declared %d, first %d, crossed %d", declared, first, crossed);
  for (PetscInt i = 0; i < n; i++) d.A(i, i) = i && i < n - 1 ? 2.0 : 1.0;
  d.C.setZero();
  for (int i = 0; i < 3; i++) {
    d.C(i, i)     = 1.0;
    d.C(i, i + 5) = -1.0;
  }
  PetscCall(SystemFromDense(d, crossed, &run.sys));
  PetscCall(MatCreateHermitianTranspose(run.sys.C, &Ct));
  PetscCall(NestCreate(run.sys.A, Ct, run.sys.C, NULL, first, &run.nest));
  PetscCall(NestCreate(run.sys.A, Ct, run.sys.C, NULL, first, &other));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatNestGetISs(run.nest, is, NULL));
  PetscCall(MatCreateVecs(run.nest, &v[0], NULL));
  PetscCall(VecDuplicate(v[0], &v[1]));
  for (Vec vec : v) PetscCall(VecZeroEntries(vec));
  for (int k = 0; k < 2; k++) { /* the second is no null vector of K, and A does not take its primal part to zero */
    PetscCall(VecGetSubVector(v[k], is[first ? 1 : 0], &sub));
    if (k) PetscCall(Scatter(Springs(n, 3).f - Column::Constant(n, Springs(n, 3).f.mean()), sub));
    else PetscCall(VecSet(sub, 1.0 / std::sqrt((double)n)));
    PetscCall(VecRestoreSubVector(v[k], is[first ? 1 : 0], &sub));
    PetscCall(VecNormalize(v[k], NULL));
  }
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, declared == 2 ? 2 : 1, v, &nullsp));
  PetscCall(MatSetNullSpace(run.nest, nullsp));
  PetscCall(MatNullSpaceDestroy(&nullsp));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  if (declared == 1) PetscCall(KSPSetOperators(run.ksp, run.nest, other));
  PetscCall(KSPSetUp(run.ksp));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetOperators(inner, &S, &M));
  for (Mat mat : {S, M}) {
    PetscBool  constant;
    PetscInt   nv = 0;
    const Vec *vecs;

    PetscCall(MatGetNullSpace(mat, &got));
    PetscCall(CheckTrue("null space", got != NULL));
    if (!got) continue;
    PetscCall(MatNullSpaceGetVecs(got, &constant, &nv, &vecs));
    PetscCall(CheckInt("dimension", nv + (constant ? 1 : 0), 1));
    if (nv != 1) continue;
    PetscCall(Gather(vecs[0], one));
    PetscCall(Check("distance from a constant", (one - Column::Constant(n, one.mean())).norm(), 1e-13));
  }
  if (declared < 2) { /* a right-hand side that has a solution, which is not unique */
    PetscCall(MatCreateVecs(run.nest, &y, &b));
    PetscCall(SetRandom(y, 80));
    PetscCall(MatMult(run.nest, y, b));
    PetscCall(KSPSolve(run.ksp, b, y));
    PetscCall(KSPGetConvergedReason(run.ksp, &run.reason));
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    PetscCall(Gather(run.nest, K));
    PetscCall(Gather(b, db));
    PetscCall(Gather(y, dy));
    PetscCall(CheckEqual("residual of the full system", K * dy, db, 1e-10));
    PetscCall(VecDestroy(&b));
    PetscCall(VecDestroy(&y));
  }
  for (Vec &vec : v) PetscCall(VecDestroy(&vec));
  PetscCall(MatDestroy(&other));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stiffness far from 1, and forces such that what the inner solver looks at, energies or residuals, is about 1 */
static PetscErrorCode Scaled(PetscReal scale, bool symmetric, bool crossed)
{
  Options         options(std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13") + (symmetric ? "" : " -ainsworth_ksp_type gmres"));
  const PetscReal force = symmetric ? PetscSqrtReal(scale) : 1.0, length = force / scale;
  DenseSystem     d = Springs(12, 3);
  Run             run;
  Column          x, lambda;

  PetscFunctionBeginUser;
  Case("A times %g, symmetric %d, crossed %d", (double)scale, symmetric, crossed);
  if (!symmetric)
    for (int i = 1; i < 12; i++) d.A(i, i - 1) = -0.6;
  SolveSaddle(d, x, lambda);
  d.A *= scale;
  d.f *= force;
  d.g *= length;
  PetscCall(RunCreate(d, crossed, &run));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
  PetscCall(CheckEqual("x", run.x / length, x, 1e-10));
  PetscCall(CheckEqual("lambda", run.lambda / force, lambda, 1e-10));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#if defined(PETSC_HAVE_HYPRE)
/* Chebyshev smoothing is for a spectrum that is known to be real */
static PetscErrorCode Smoother(bool symmetric)
{
  const int   n = 120;
  Options     options("-ainsworth_pc_type hypre -ainsworth_ksp_rtol 1e-12");
  DenseSystem d = Springs(n, 3);
  Run         run;
  Column      x, lambda;
  std::string text;

  PetscFunctionBeginUser;
  Case("BoomerAMG, symmetric %d", symmetric);
  if (!symmetric)
    for (int i = 1; i < n; i++) d.A(i, i - 1) = -0.6;
  SolveSaddle(d, x, lambda);
  PetscCall(RunCreate(d, false, &run));
  PetscCall(RunSolve(&run));
  PetscCall(CheckEqual("x", run.x, x, 1e-9));
  PetscCall(ViewText(run.ksp, text));
  PetscCall(CheckTrue("Chebyshev smoothing", (text.find("Chebyshev") != std::string::npos) == symmetric));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#endif

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (bool crossed : {false, true}) {
    for (bool diagonal : {false, true}) PetscCall(SmallShell(diagonal, false, crossed));
    PetscCall(SmallShell(false, true, crossed));
    for (const char *kind : {"zero", "inactive", "penalised"})
      for (bool diagonalA : {false, true}) PetscCall(InactiveRows(kind, diagonalA, crossed));
    for (bool strict : {false, true}) PetscCall(DependentRows(strict, crossed));
    for (const char *where : {"zero", "dependent", "kept"})
      for (PetscReal value : {(PetscReal)NAN, (PetscReal)INFINITY})
        for (bool strict : {false, true}) PetscCall(NotFinite(where, value, strict, crossed));
    for (int declared = 0; declared < 3; declared++)
      for (bool first : {false, true}) PetscCall(WholeNullSpace(declared, first, crossed));
    for (PetscReal scale : {1e-200, 1e-100, 1e100, 1e200})
      for (bool symmetric : {true, false}) PetscCall(Scaled(scale, symmetric, crossed));
  }
  for (bool strict : {false, true}) PetscCall(Ring(strict));
  PetscCall(LargeShell());
  PetscCall(OtherMatrix());
#if defined(PETSC_HAVE_HYPRE)
  for (bool symmetric : {true, false}) PetscCall(Smoother(symmetric));
#endif
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
