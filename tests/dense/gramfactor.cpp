static char help[] = "The factorization of the Gram matrix by each package: whatever the scale of A, and where one is "
                     "chosen by predicted operations.\n\n";

#include "run.h"
#include <cmath>

/* What may factor the Gram matrix; the first is what is chosen for so few rows, dense inverses */
static std::vector<std::string> Packages()
{
  const std::string        cholesky = "-ainsworth_gram_pc_type cholesky -ainsworth_gram_pc_factor_mat_solver_type ";
  const std::string        usual    = PetscDefined(USE_COMPLEX)
                                        ? "-ainsworth_gram_pc_type lu -ainsworth_gram_pc_factor_mat_solver_type "
                                        : cholesky;
  std::vector<std::string> all      = {"", usual + "petsc"};

#if defined(PETSC_HAVE_SUITESPARSE) && !defined(PETSC_USE_COMPLEX)
  all.push_back(cholesky + "cholmod");
#endif
#if defined(PETSC_HAVE_MUMPS)
  all.push_back(usual + "mumps");
#endif
  return all;
}

static PetscErrorCode Iterations(const Run &run, PetscInt *iterations)
{
  PC  pc;
  KSP inner;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetIterationNumber(inner, iterations));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A and f in other units: x is the same, lambda is in the new units, and the iterations are the same */
static PetscErrorCode Scaled(const std::string &package, bool crossed)
{
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10 " + package);
  Spec        spec;
  System      sys;
  DenseSystem d;
  Column      x, lambda;
  PetscInt    expected = 0;

  PetscFunctionBeginUser;
  spec.m = 9;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(SystemDestroy(&sys));
  SolveSaddle(d, x, lambda);
  for (int power : {0, -120, -60, 60, 120}) { /* of 2, which no rounding sees: 1e-36 to 1e36 */
    const PetscReal scale  = std::ldexp(1.0, power);
    DenseSystem     scaled = d;
    Run             run;
    PetscInt        got;

    Case("A times %g, crossed %d, %s", (double)scale, crossed, package.empty() ? "default" : package.c_str());
    scaled.A *= scale;
    scaled.f *= scale;
    PetscCall(RunCreate(scaled, crossed, &run));
    PetscCall(RunSolve(&run));
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    PetscCall(CheckEqual("x", run.x, x, 1e-8));
    PetscCall(CheckEqual("lambda", run.lambda / scale, lambda, 1e-8));
    PetscCall(Iterations(run, &got));
    if (!power) expected = got;
    PetscCall(CheckInt("iterations", got, expected));
    PetscCall(RunDestroy(&run));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* m rows that share one unknown, so that S is dense; A is a diagonal. The last row may repeat the first one */
static DenseSystem Shared(int m, bool dependent)
{
  DenseSystem d;

  d.A = Dense::Zero(m + 1, m + 1);
  d.C = Dense::Zero(m, m + 1);
  d.f = Column::Zero(m + 1);
  d.g = Column::Zero(m);
  for (int i = 0; i <= m; i++) {
    d.A(i, i) = 2.0 + Uniform(1, i, 0);
    d.f[i]    = Uniform(2, i, 0);
  }
  for (int i = 0; i < m; i++) {
    d.C(i, i) = 1.0;
    d.C(i, m) = -1.0;
  }
  if (dependent) d.C.row(m - 1) = -3.0 * d.C.row(0);
  return d;
}

/* x from the Schur complement of A, without the last row where that depends on the first one */
static Column SharedSolution(const DenseSystem &d, bool dependent)
{
  const Dense  C       = d.C.topRows(d.C.rows() - dependent);
  const Column inverse = d.A.diagonal().cwiseInverse();
  const Dense  schur   = C * inverse.asDiagonal() * C.adjoint();
  const Column lambda  = schur.llt().solve(C * inverse.asDiagonal() * d.f);

  return inverse.asDiagonal() * (d.f - C.adjoint() * lambda);
}

/*
   Above the bound of operations; values change once, the pattern stays. rows: per rank; less than there are: several
   ranks share S
*/
static PetscErrorCode ManyOperations(bool dependent, int rows)
{
  const int m = 760; /* m^3 / 3 operations */
  Options   options("-ainsworth_pc_type jacobi -pc_ainsworth_pmat id -pc_ainsworth_weight identity -ainsworth_ksp_rtol "
                      "1e-12 -pc_ainsworth_rows_per_rank " +
                    std::to_string(rows));
  DenseSystem d = Shared(m, dependent);
  Run         run;
  std::string text;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(RunCreate(d, false, &run));
  for (PetscReal factor : {1.0, 4.0}) {
    Case("%d rows that share an unknown, dependent %d, %d rows per rank, A times %g", m, dependent, rows,
         (double)factor);
    PetscCall(MatScale(run.sys.A, factor));
    d.A *= factor;
    PetscCall(RunSolve(&run));
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    PetscCall(CheckEqual("x", run.x, SharedSolution(d, dependent), 1e-9));
  }
  PetscCall(ViewText(run.ksp, text));
  PetscCall(CheckTrue("dependent rows in the view", (text.find("1 dependent row") != std::string::npos) == dependent));
#if defined(PETSC_HAVE_SUITESPARSE) && !defined(PETSC_USE_COMPLEX)
  if (size == 1 || rows > m)
    PetscCall(CheckText(
      "view", text,
      {"factored by cholmod, for 1.5e+08 operations predicted", "package used to perform factorization: cholmod"}));
#endif
#if defined(PETSC_HAVE_MUMPS)
  if (size > 1 && rows < m) PetscCall(CheckText("view", text, {"package used to perform factorization: mumps"}));
#endif
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   With the usual weight S is not dense: the unknown that rows share has none, unless the rows have no others. id, jcb:
   both know of it
*/
static PetscErrorCode SharedUnknown(bool dependent, bool alone, const std::string &pmat)
{
  const int   m = 150;
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -pc_ainsworth_pmat " + pmat);
  DenseSystem d = Shared(m, dependent);
  Run         run;
  Column      x;
  std::string text;

  PetscFunctionBeginUser;
  Case("%d rows that share an unknown, dependent %d, one has no other %d, pmat %s", m, dependent, alone, pmat.c_str());
  x = SharedSolution(d, dependent);
  if (alone) { /* it holds the shared unknown, and so all others that are tied to it */
    d.C(1, 1) = 0.0;
    x.setZero();
    for (int i : {1, m - 1})
      if (i == 1 || dependent) x[i] = d.f[i] / d.A(i, i);
  }
  for (bool crossed : {false, true}) {
    PetscCall(RunCreate(d, crossed, &run));
    PetscCall(RunSolve(&run));
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    PetscCall(CheckEqual("x", run.x, x, 1e-9));
    PetscCall(ViewText(run.ksp, text));
    PetscCall(
      CheckTrue("dependent rows in the view", (text.find("1 dependent row") != std::string::npos) == dependent));
    PetscCall(CheckTrue("components in the view", (text.find("1 connected component,") != std::string::npos) == alone));
    PetscCall(RunDestroy(&run));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Below the bound: PETSc's own */
static PetscErrorCode FewOperations()
{
  Options     options("-ainsworth_pc_type jacobi -pc_ainsworth_pmat id -ainsworth_ksp_rtol 1e-12");
  DenseSystem d = Shared(60, false);
  Run         run;
  std::string text;

  PetscFunctionBeginUser;
  Case("60 rows that share an unknown");
  PetscCall(RunCreate(d, false, &run));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
  PetscCall(CheckEqual("x", run.x, SharedSolution(d, false), 1e-9));
  PetscCall(ViewText(run.ksp, text));
  PetscCall(
    CheckText("view", text,
              {"factored by petsc, for 7.4e+04 operations predicted", "package used to perform factorization: petsc"}));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const std::string &package : Packages())
    for (bool crossed : {false, true}) PetscCall(Scaled(package, crossed));
  PetscCall(FewOperations());
  for (bool dependent : {false, true})
    for (int rows : {25000, 40}) PetscCall(ManyOperations(dependent, rows));
  for (const char *pmat : {"id", "jcb"})
    for (bool dependent : {false, true})
      for (bool alone : {false, true}) PetscCall(SharedUnknown(dependent, alone, pmat));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
