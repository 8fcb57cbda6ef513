static char help[] = "PCAINSWORTH where systems are tiny, singular, nearly dependent, one-sided or not finite, against dense linear algebra.\n\n";

#include "run.h"
#include <cmath>

static Column RandomColumn(PetscInt size, PetscInt seed)
{
  Column v(size);

  for (PetscInt i = 0; i < size; i++) v[i] = Uniform(seed, i, 0);
  return v;
}

/* A chain of springs of stiffness 1, held at its ends if fixed; rows of C and right-hand sides at random */
static DenseSystem Chain(PetscInt n, PetscInt m, bool fixed)
{
  DenseSystem d;

  d.A = Dense::Zero(n, n);
  d.C = Dense::Zero(m, n);
  for (PetscInt i = 0; i < n; i++) {
    d.A(i, i) = (i || fixed ? 1.0 : 0.0) + (i < n - 1 || fixed ? 1.0 : 0.0);
    if (i) d.A(i, i - 1) = d.A(i - 1, i) = -1.0;
  }
  for (PetscInt i = 0; i < m; i++)
    for (PetscInt j = 0; j < n; j++) d.C(i, j) = Uniform(7, i, j);
  d.f = RandomColumn(n, 8);
  d.g = RandomColumn(m, 9);
  return d;
}

/* One unknown, one row, as many rows as unknowns, on fewer unknowns than ranks */
static PetscErrorCode Sizes(const char *inner)
{
  const PetscInt sizes[][2] = {
    {1, 0},
    {1, 1},
    {2, 1},
    {2, 2},
    {9, 1},
    {9, 8},
    {9, 9}
  };

  PetscFunctionBeginUser;
  for (const PetscInt *size : sizes) {
    for (bool crossed : {false, true}) {
      const DenseSystem d = Chain(size[0], size[1], true);
      Options           options(std::string("-ainsworth_ksp_rtol 1e-13 ") + inner);
      Run               run;

      Case("n = %d, m = %d, crossed %d, %s", (int)size[0], (int)size[1], crossed, inner);
      PetscCall(RunCreate(d, crossed, &run));
      PetscCall(CheckSolution(run.ksp, run.sys, d, false, false, 1e-9));
      PetscCall(RunDestroy(&run));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A chain that nothing holds, or an unknown that no spring has; C does not hold them either, and the program does not say so */
static PetscErrorCode SingularOnKernel(bool loose, bool balanced, bool crossed)
{
  Options     options(loose ? "" : "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12"); /* a loose unknown is refused before they are read */
  DenseSystem d = Chain(8, 2, loose);
  Run         run;

  PetscFunctionBeginUser;
  Case("A singular on Ker C, loose unknown %d, balanced %d, crossed %d", loose, balanced, crossed);
  d.C.setZero();
  d.C(0, 0) = d.C(1, 1) = 1.0;
  d.C(0, 3) = d.C(1, 6) = -1.0;
  if (loose) {
    d.A.row(7).setZero();
    d.A.col(7).setZero();
    d.f[7] = balanced ? 0.0 : 1.0;
  } else d.f.array() += (balanced ? 0.0 : 1.0) - d.f.mean();
  PetscCall(RunCreate(d, crossed, &run));
  PetscCall(RunSolve(&run));
  if (balanced && !loose) {
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    PetscCall(CheckResiduals(run, d, 1e-9, 1e-12));
  } else PetscCall(CheckFailed(run));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Row 3 is row 0 plus `distance` at another unknown; g may tell them apart, which makes x large, or be that of a moderate x. Close rows may be
   refused for a reason; what counts as solved must satisfy both equations to the tolerances of docs/method.md.
*/
static PetscErrorCode NearlyDependent(PetscReal distance, bool apart, bool crossed)
{
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  DenseSystem d = Chain(12, 4, true);
  Run         run;

  PetscFunctionBeginUser;
  Case("rows %g apart, told apart by g %d, crossed %d", (double)distance, apart, crossed);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 12; j++)
      if (j % 3 != i) d.C(i, j) = 0.0;
  d.C.row(3) = d.C.row(0);
  d.C(3, 1) += distance;
  if (!apart) d.g = d.C * RandomColumn(12, 10);
  PetscCall(RunCreate(d, crossed, &run));
  PetscCall(RunSolve(&run));
  if (run.reason > 0) {
    Column x, lambda;

    PetscCall(CheckResiduals(run, d, 1e-7, 1e-8));
    SolveSaddle(d, x, lambda);
    if (distance >= 1e-3) PetscCall(CheckEqual("x", run.x, x, 1e-8));
  } else {
    PetscCall(CheckFailed(run));
    PetscCall(CheckTrue("rows so far apart are solved", distance < 1e-4));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* [A C'; C -D] where A + C' D^{-1} C has rows of equal pattern, inodes, and A has none: factored with each ordering */
static PetscErrorCode Penalised(const char *ordering, bool crossed)
{
  Options     options(std::string("-ainsworth_pc_type redundant -ainsworth_redundant_pc_factor_mat_ordering_type ") + ordering);
  DenseSystem d = Chain(9, 1, true);
  Dense       K = Dense::Zero(10, 10);
  Column      b(10), y;
  PetscInt    lm, start, end;
  Mat         D;
  Run         run;

  PetscFunctionBeginUser;
  Case("eliminated row, ordering %s, crossed %d", ordering, crossed);
  for (int j : {0, 7, 8}) d.C(0, j) = 0.0;
  PetscCall(SystemFromDense(d, crossed, &run.sys));
  PetscCall(MatGetLocalSize(run.sys.C, &lm, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, lm, lm, 1, 1, 1, NULL, 0, NULL, &D));
  PetscCall(MatGetOwnershipRange(D, &start, &end));
  if (start < end) PetscCall(MatSetValue(D, 0, 0, -0.5, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(D, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(D, MAT_FINAL_ASSEMBLY));
  PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, D, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
  K.topLeftCorner(9, 9)    = d.A;
  K.topRightCorner(9, 1)   = d.C.adjoint();
  K.bottomLeftCorner(1, 9) = d.C;
  K(9, 9)                  = -0.5;
  b << d.f, d.g;
  y = K.fullPivLu().solve(b);
  PetscCall(CheckEqual("x", run.x, y.head(9), 1e-7));
  PetscCall(CheckEqual("lambda", run.lambda, y.tail(1), 1e-7));
  PetscCall(MatDestroy(&D));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* [A -C'; C 0], two right-hand sides, and the transpose, which is said to be impossible */
static PetscErrorCode Negated(bool crossed)
{
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13");
  DenseSystem d = Chain(9, 3, true), twin;
  Mat         Ct;
  Vec         b, y;
  Run         run;

  PetscFunctionBeginUser;
  Case("blocks C and -C', crossed %d", crossed);
  PetscCall(SystemFromDense(d, crossed, &run.sys));
  PetscCall(MatHermitianTranspose(run.sys.C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(MatScale(Ct, -1.0));
  PetscCall(NestCreate(run.sys.A, Ct, run.sys.C, NULL, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  for (int repeat = 0; repeat < 2; repeat++) {
    PetscCall(RunSolve(&run));
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    run.lambda = -run.lambda;
    PetscCall(CheckResiduals(run, d, 1e-11, 1e-13));
    d.f = RandomColumn(9, 12);
    d.g = RandomColumn(3, 13);
    PetscCall(Scatter(d.f, run.sys.f));
    PetscCall(Scatter(d.g, run.sys.g));
  }
  PetscCall(MatCreateVecs(run.nest, &y, &b));
  PetscCall(SetRandom(b, 14));
  PetscCall(CheckError("transpose", [&]() { return KSPSolveTranspose(run.ksp, b, y); }, PETSC_ERR_SUP, {"transpose", "not C and -C'"}));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(MatDestroy(&Ct));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What PetscInfo() tells while action runs, the text of rank 0 on all ranks */
static PetscErrorCode InfoText(const std::function<PetscErrorCode()> &action, std::string &text)
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(PetscInfoAllow(PETSC_TRUE));
  PetscCall(PetscInfoSetFile("info.txt", "w"));
  PetscCall(action());
  PetscCall(PetscInfoAllow(PETSC_FALSE));
  PetscCall(FileText("info.txt.0", text));
  if (rank) remove(("info.txt." + std::to_string(rank)).c_str());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A Dirichlet condition whose row became that of the identity while its column stayed: A is not symmetric */
static PetscErrorCode OneSided(bool gmres, bool crossed)
{
  Options     options(std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12") + (gmres ? " -ainsworth_ksp_type gmres" : ""));
  DenseSystem d = Chain(12, 3, true);
  std::string text;
  Column      x, lambda;
  Run         run;

  PetscFunctionBeginUser;
  Case("one-sided Dirichlet row, gmres %d, crossed %d", gmres, crossed);
  d.A.row(4).setZero();
  d.A(4, 4) = 1.0;
  PetscCall(RunCreate(d, crossed, &run));
  PetscCall(InfoText([&]() { return RunSolve(&run); }, text));
  if (gmres || run.reason > 0) {
    SolveSaddle(d, x, lambda);
    PetscCall(CheckEqual("x", run.x, x, 1e-8));
    PetscCall(CheckEqual("lambda", run.lambda, lambda, 1e-8));
  } else {
    PetscCall(CheckFailed(run));
    PetscCall(CheckText("PetscInfo", text, {"-ainsworth_ksp_type gmres does not need it to be"}));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block whose values were set, on its first rank alone, but not assembled: an error on every rank */
static PetscErrorCode Unassembled(int block, bool crossed)
{
  const DenseSystem d = Chain(9, 3, true);
  PetscInt          start, end;
  Mat               Ct;
  Run               run;

  PetscFunctionBeginUser;
  Case("block %d not assembled, crossed %d", block, crossed);
  PetscCall(SystemFromDense(d, crossed, &run.sys));
  PetscCall(MatHermitianTranspose(run.sys.C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(NestCreate(run.sys.A, Ct, run.sys.C, NULL, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  const Mat   blocks[] = {run.sys.A, Ct, run.sys.C};
  const char *names[]  = {"Block (0,0)", "Block (0,1)", "Block (1,0)"};
  PetscCall(MatGetOwnershipRange(blocks[block], &start, &end));
  if (!start && end) PetscCall(MatSetValue(blocks[block], 0, 0, 0.0, ADD_VALUES));
  PetscCall(CheckError("set-up", [&]() { return KSPSetUp(run.ksp); }, PETSC_ERR_ARG_WRONGSTATE, {names[block], "not assembled", "MatAssemblyBegin()"}));
  PetscCall(MatAssemblyBegin(blocks[block], MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(blocks[block], MAT_FINAL_ASSEMBLY));
  PetscCall(MatDestroy(&Ct));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NaN on the right-hand side, also where C alone determines x; then a good one with the same solver */
static PetscErrorCode NotFinite(PetscInt m, bool inG, bool crossed)
{
  Options           options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13");
  const DenseSystem d = Chain(6, m, true);
  Run               run;

  PetscFunctionBeginUser;
  Case("NaN in %s, m = %d, crossed %d", inG ? "g" : "f", (int)m, crossed);
  PetscCall(RunCreate(d, crossed, &run));
  Vec bad = inG ? run.sys.g : run.sys.f;
  PetscCall(VecSetValue(bad, 0, NAN, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(bad));
  PetscCall(VecAssemblyEnd(bad));
  PetscCall(RunSolve(&run));
  PetscCall(CheckFailed(run));
  PetscCall(Scatter(d.f, run.sys.f));
  PetscCall(Scatter(d.g, run.sys.g));
  PetscCall(CheckSolution(run.ksp, run.sys, d, false, false, 1e-9));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The inner preconditioner fails on the last rank alone, as it is set up or as it is applied: all ranks hear of it, and the solver can be used again */
static PetscErrorCode OneRankFails(bool setup, bool crossed)
{
  Options           options("-ainsworth_pc_type shell -ainsworth_ksp_rtol 1e-13");
  const DenseSystem d = Chain(9, 3, true);
  static bool       broken;
  static int        last;
  PetscMPIInt       rank, size;
  KSP               inner;
  PC                pc, shell;
  Run               run;

  PetscFunctionBeginUser;
  Case("failure on one rank, at set-up %d, crossed %d", setup, crossed);
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  last   = rank == (crossed ? 0 : size - 1); /* a rank with unknowns */
  broken = true;
  PetscCall(RunCreate(d, crossed, &run));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetPC(inner, &shell));
  PetscCall(PCSetType(shell, PCSHELL));
  if (setup) PetscCall(PCShellSetSetUp(shell, [](PC self) { return PCSetFailedReason(self, broken && last ? PC_FACTOR_NUMERIC_ZEROPIVOT : PC_NOERROR); }));
  PetscCall(PCShellSetApply(shell, [](PC, Vec x, Vec y) {
    PetscFunctionBeginUser;
    PetscCall(VecCopy(x, y));
    if (broken && last) {
      PetscScalar *a;

      PetscCall(VecGetArray(y, &a));
      a[0] = NAN;
      PetscCall(VecRestoreArray(y, &a));
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }));
  PetscCall(RunSolve(&run));
  PetscCall(CheckFailed(run));
  broken = false;
  for (PetscReal factor : {2.0, 0.5}) PetscCall(MatScale(run.sys.A, factor)); /* to be set up anew */
  PetscCall(CheckSolution(run.ksp, run.sys, d, false, false, 1e-9));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const char *inner : {"", "-ainsworth_pc_type jacobi", "-pc_ainsworth_variant paper -ainsworth_pc_type redundant"}) PetscCall(Sizes(inner));
  for (bool crossed : {false, true}) {
    for (bool loose : {false, true})
      for (bool balanced : {false, true}) PetscCall(SingularOnKernel(loose, balanced, crossed));
    for (PetscReal distance : {1e-1, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-9, 1e-12})
      for (bool apart : {false, true}) PetscCall(NearlyDependent(distance, apart, crossed));
    for (const char *ordering : {"natural", "nd", "rcm"}) PetscCall(Penalised(ordering, crossed));
    PetscCall(Negated(crossed));
    for (bool gmres : {false, true}) PetscCall(OneSided(gmres, crossed));
    for (int block = 0; block < 3; block++) PetscCall(Unassembled(block, crossed));
    for (PetscInt m : {2, 6})
      for (bool inG : {false, true}) PetscCall(NotFinite(m, inG, crossed));
    for (bool setup : {false, true}) PetscCall(OneRankFails(setup, crossed));
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
