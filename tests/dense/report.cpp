static char help[] = "Error estimates, the error monitor and the error as stopping criterion against dense linear "
                     "algebra.\n\n";

#include "pmatreference.h"
#include <cmath>
#include <map>
#include <sstream>

/* One solve: the system, its dense solution, and the dense error of every iterate of the inner solver */
struct Run {
  System                 sys;
  DenseSystem            d;
  Mat                    nest = NULL;
  KSP                    ksp = NULL, inner = NULL;
  Vec                    b = NULL, y = NULL, exact[2] = {NULL, NULL}; /* of x and lambda, of x */
  Column                 x, weight, start;                            /* W; what iterates lack, R g in Ker C */
  Dense                  reduced;
  PetscReal              lowest;              /* eigenvalue of the preconditioned operator */
  std::vector<PetscReal> errors, multipliers; /* of x, of C' lambda */
  int                    solves = 0;
};

/* The iterates of the first solve: others may follow for what it has left */
static PetscErrorCode Watch(KSP ksp, PetscInt step, PetscReal, void *ctx)
{
  Run   *run = (Run *)ctx;
  Vec    iterate;
  Column x;

  PetscFunctionBeginUser;
  run->solves += !step;
  if (run->solves > 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPBuildSolution(ksp, NULL, &iterate));
  PetscCall(Gather(iterate, x));
  x = run->x - x - run->start;
  run->errors.push_back(std::sqrt(std::abs(x.dot(run->reduced * x))));
  /* lambda of this iterate, by its formula, against that of the solution */
  const Dense  C = run->d.C, CW = C * run->weight.asDiagonal();
  const Column force = C.adjoint() *
                       Column((CW * C.adjoint()).partialPivLu().solve(CW * (run->d.f - run->d.A * (run->x - x)))),
               held = run->d.f - run->d.A * run->x, unit = DiagonalWeight(run->d.A).cwiseAbs().cwiseSqrt();
  run->multipliers.push_back(unit.cwiseProduct(force - held).norm() / unit.cwiseProduct(held).norm());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The operator of the inner solver, by its formula, and the smallest eigenvalue with -ainsworth_pc_type none */
static PetscErrorCode FormReduced(Run *run, bool projected)
{
  const PmatChoice paper{
    PC_AINSWORTH_PMAT_JCB, MAT_AINSWORTH_WEIGHT_IDENTITY, AINSWORTH_PENALTY_NORM, PETSC_DEFAULT, PETSC_DECIDE, false};
  Dense  M;
  Column B = RowPenalty(run->d.A, run->d.C); /* in Ker C any will do */

  PetscFunctionBeginUser;
  if (!projected) PetscCall(PmatReference(run->d, true, paper, M, B));
  const Column        &W = run->weight = projected ? DiagonalWeight(run->d.A) : Column(Column::Ones(run->d.A.rows()));
  const DenseProjector proj(run->d.C, W);
  run->reduced = ReducedOperator(run->d.A, run->d.C, proj.Q, B);
  run->start   = projected ? Column(proj.R * run->d.g) : Column(Column::Zero(run->d.A.rows()));
  if (projected) { /* Q Q' A on Ker C, of which V is an orthonormal basis */
    const Eigen::ColPivHouseholderQR<Dense> qr(proj.Q);
    const Dense                             V  = Dense(qr.householderQ()).leftCols(run->d.A.rows() - run->d.C.rows());
    const Dense                             QQ = V.adjoint() * proj.Q * proj.Q.adjoint() * V;
    run->lowest                                = (QQ * (V.adjoint() * run->d.A * V)).eigenvalues().real().minCoeff();
  } else run->lowest = run->reduced.eigenvalues().real().minCoeff();
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RunCreate(const Spec &spec, Run *run)
{
  Column lambda, all;
  Mat    T;
  PC     pc;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &run->sys));
  PetscCall(Gather(run->sys, run->d));
  PetscCall(MatHermitianTranspose(run->sys.C, MAT_INITIAL_MATRIX, &T));
  PetscCall(NestCreate(run->sys.A, T, run->sys.C, NULL, false, &run->nest));
  PetscCall(MatDestroy(&T));
  PetscCall(SolverCreate(run->nest, &run->ksp));
  PetscCall(KSPGetPC(run->ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &run->inner));
  PetscCall(MatCreateVecs(run->nest, &run->y, &run->b));
  IS  is[2];
  Vec field;
  PetscCall(MatNestGetISs(run->nest, is, NULL));
  for (int i = 0; i < 2; i++) {
    PetscCall(VecGetSubVector(run->b, is[i], &field));
    PetscCall(VecCopy(i ? run->sys.g : run->sys.f, field));
    PetscCall(VecRestoreSubVector(run->b, is[i], &field));
  }
  SolveSaddle(run->d, run->x, lambda);
  PetscCall(VecDuplicate(run->b, &run->exact[0]));
  PetscCall(VecDuplicate(run->sys.f, &run->exact[1]));
  PetscCall(Scatter(run->x, run->exact[1]));
  PetscCall(VecSet(run->exact[0], 7.0)); /* the multipliers of a reference do not count */
  PetscCall(VecGetSubVector(run->exact[0], is[0], &field));
  PetscCall(VecCopy(run->exact[1], field));
  PetscCall(VecRestoreSubVector(run->exact[0], is[0], &field));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RunDestroy(Run *run)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&run->ksp));
  PetscCall(MatDestroy(&run->nest));
  PetscCall(VecDestroy(&run->b));
  PetscCall(VecDestroy(&run->y));
  for (Vec &v : run->exact) PetscCall(VecDestroy(&v));
  PetscCall(SystemDestroy(&run->sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns of a CSV file by their names; what is not there is NAN */
static std::map<std::string, std::vector<PetscReal>> Columns(const std::string &text)
{
  std::map<std::string, std::vector<PetscReal>> columns;
  std::vector<std::string>                      names;
  std::istringstream                            lines(text);

  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line + ",");
    size_t             c = 0;

    for (std::string cell; std::getline(cells, cell, ','); c++) {
      if (columns.size() < names.size() || names.empty() || line.compare(0, 5, "solve") == 0) names.push_back(cell);
      else if (c < names.size()) columns[names[c]].push_back(cell.empty() ? NAN : std::stod(cell));
    }
    for (const std::string &name : names) columns[name];
  }
  return columns;
}

static std::string Solver(bool projected, const char *rtol = "1e-11", const char *steps = "3000")
{
  return std::string("-ainsworth_pc_type none -ainsworth_ksp_rtol ") + rtol + " -ainsworth_ksp_max_it " + steps +
         " -pc_ainsworth_variant " + (projected ? "weighted" : "paper");
}

static std::string Text(PetscReal value)
{
  char text[32];

  (void)PetscSNPrintf(text, sizeof(text), "%.16e", (double)value);
  return text;
}

/* Every row of the monitor against the dense error; eigenvalue: the factor of the true one that is given, 0: none */
static PetscErrorCode Bounds(const Spec &spec, bool projected, PetscReal eigenvalue)
{
  Options     options(Solver(projected) + " -pc_ainsworth_monitor_error csv:report.csv");
  Run         run;
  PC          pc;
  std::string text;
  PetscInt    last;
  PetscReal   lower, upper;

  PetscFunctionBeginUser;
  Case("%s, %s, eigenvalue %g", spec.name, projected ? "projected CG" : "plain CG", (double)eigenvalue);
  PetscCall(RunCreate(spec, &run));
  PetscCall(KSPSetUp(run.ksp));
  PetscCall(FormReduced(&run, projected));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthSetReference(pc, run.exact[projected]));
  Options lowest(eigenvalue > 0 ? "-pc_ainsworth_error_eigenvalue " + Text(eigenvalue * run.lowest) : "");
  PetscCall(KSPSetFromOptions(run.ksp));
  PetscCall(KSPMonitorSet(run.inner, Watch, &run, NULL));
  PetscCall(KSPSolve(run.ksp, run.b, run.y));
  PetscCall(PCAinsworthGetErrorEstimate(pc, &last, &lower, &upper));
  PetscCall(KSPDestroy(&run.ksp)); /* closes the file */
  PetscCall(FileText("report.csv", text));

  auto            columns = Columns(text);
  const size_t    rows    = run.errors.size();
  const PetscReal energy  = std::sqrt(std::abs(run.x.dot(run.d.A * run.x)));
  PetscInt        bounded = 0;
  PetscCall(CheckInt("rows", (PetscInt)columns["iteration"].size(), (PetscInt)rows));
  PetscCall(CheckTrue("enough steps", rows > 8 && last + 1 < (PetscInt)rows));
  for (size_t k = 0; k < rows && columns["iteration"].size() == rows; k++) {
    const PetscReal   error = run.errors[k], floor = 1e-12 * run.errors[0];
    const std::string at = " at " + std::to_string(k);

    PetscCall(CheckInt(("iteration" + at).c_str(), (PetscInt)columns["iteration"][k], (PetscInt)k));
    PetscCall(CheckTrue(("seconds rise" + at).c_str(), columns["seconds"][k] >= (k ? columns["seconds"][k - 1] : 0.0)));
    PetscCall(Check(("true error" + at).c_str(), PetscAbsReal(columns["error_true"][k] - error), 1e-6 * error + floor));
    PetscCall(Check(("multipliers" + at).c_str(), PetscAbsReal(columns["multiplier_error"][k] - run.multipliers[k]),
                    1e-6 * run.multipliers[k] + 1e-11));
    if (k + 1 < rows)
      PetscCall(Check(("lower bound" + at).c_str(), columns["error_lower"][k], (1 + 1e-6) * error + floor));
    else PetscCall(CheckTrue("no lower bound of the last iterate", std::isnan(columns["error_lower"][k])));
    if ((PetscInt)k <= last && error <= 0.1 * run.errors[0])
      PetscCall(Check(("true error over lower bound" + at).c_str(), error / columns["error_lower"][k], 2.0));
    if (eigenvalue > 0 && eigenvalue < 1)
      PetscCall(Check(("true error" + at).c_str(), error, (1 + 1e-6) * columns["error_upper"][k] + floor));
    if (!std::isnan(columns["error_upper"][k]))
      PetscCall(Check(("relative error" + at).c_str(),
                      PetscAbsReal(columns["error_relative"][k] * energy - columns["error_upper"][k]),
                      1e-6 * columns["error_upper"][k]));
    if (eigenvalue == 0 && (PetscInt)k <= last && error <= 0.1 * run.errors[0])
      PetscCall(Check(("upper estimate over true error" + at).c_str(), columns["error_upper"][k] / error, 4.0));
    bounded += !std::isnan(columns["error_upper"][k]);
  }
  if (eigenvalue > 1)
    PetscCall(CheckTrue("an eigenvalue that is too large is found out", bounded < (PetscInt)rows && std::isnan(upper)));
  else PetscCall(CheckInt("rows with an upper bound", bounded, (PetscInt)rows));
  if (last >= 0 && last < (PetscInt)rows)
    PetscCall(Check("lower bound by function", lower, (1 + 1e-6) * run.errors[last]));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residuals of the original system */
static PetscErrorCode Residuals(bool projected)
{
  Options     options(Solver(projected, "1e-11", "3") + " -pc_ainsworth_monitor_error csv:report.csv");
  Spec        spec;
  std::string text;
  Run         run;
  Column      x;
  PetscReal   primal, constraint;

  PetscFunctionBeginUser;
  Case("residuals, %s", projected ? "projected CG" : "plain CG");
  PetscCall(RunCreate(spec, &run));
  PetscCall(KSPSetUp(run.ksp));
  PetscCall(KSPSolve(run.ksp, run.b, run.y));
  PetscCall(KSPDestroy(&run.ksp));
  PetscCall(FileText("report.csv", text));
  auto columns = Columns(text);
  PetscCall(CheckInt("rows", (PetscInt)columns["iteration"].size(), 4));
  primal     = columns["primal_residual"].at(0);
  constraint = columns["constraint_residual"].at(0);
  /* the first iterate is R g, or zero */
  const Column         W = projected ? DiagonalWeight(run.d.A) : Column(Column::Ones(spec.n));
  const DenseProjector proj(run.d.C, W);
  x = Column(Column::Zero(spec.n));
  if (projected) x = proj.R * run.d.g;
  const Column r = proj.Q.adjoint() * (run.d.f - run.d.A * x);
  PetscCall(Check("first block", PetscAbsReal(primal - r.norm() / run.d.f.norm()), 1e-7 * primal));
  PetscCall(Check("second block", PetscAbsReal(constraint - (run.d.g - run.d.C * x).norm() / run.d.g.norm()), 1e-12));
  PetscCall(CheckTrue("true error unknown", std::isnan(columns["error_true"].at(0))));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The exact solution from a file, and a bound of the spectrum, in the table as text */
static PetscErrorCode Table()
{
  Spec        spec;
  Run         run;
  PetscViewer viewer;
  std::string text;

  PetscFunctionBeginUser;
  Case("table");
  Options options(Solver(true, "1e-11", "3"));
  PetscCall(RunCreate(spec, &run));
  PetscCall(PetscViewerBinaryOpen(PETSC_COMM_WORLD, "exact.bin", FILE_MODE_WRITE, &viewer));
  PetscCall(PetscViewerBinarySetSkipInfo(viewer, PETSC_TRUE));
  PetscCall(VecView(run.exact[1], viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  Options more("-pc_ainsworth_reference exact.bin -pc_ainsworth_monitor_error ascii:table.txt "
               "-pc_ainsworth_error_eigenvalue 0.125");
  PetscCall(KSPSetFromOptions(run.ksp));
  PetscCall(KSPSolve(run.ksp, run.b, run.y));
  PetscCall(ViewText(run.ksp, text));
  PetscCall(CheckText("view", text, {"error against run time: monitored, reference solution"}));
  PetscCall(RunDestroy(&run)); /* closes the file */
  PetscCall(FileText("table.txt", text));
  PetscCall(CheckText("table", text, {"upper: bound for eigenvalues from 0.125 on", "true error"}));
  PetscCall(FileText("exact.bin", text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The error ends the solve, whatever the tolerance of the residual; neither sooner than it may nor much later */
static PetscErrorCode Stop(bool projected)
{
  Spec spec;

  PetscFunctionBeginUser;
  spec.n = 200;
  for (PetscReal rtol : {1e-2, 1e-5, 1e-8}) {
    for (const char *residual : {"0.5", "1e-14"}) {
      Options options(Solver(projected, residual) + " -pc_ainsworth_stop energy_error -pc_ainsworth_error_rtol " +
                      Text(rtol));
      Run     run;
      KSPConvergedReason reason;
      PetscInt           steps, needed = 0;

      Case("stop at %g, residual tolerance %s, %s", (double)rtol, residual, projected ? "projected CG" : "plain CG");
      PetscCall(RunCreate(spec, &run));
      PetscCall(KSPSetUp(run.ksp));
      PetscCall(FormReduced(&run, projected));
      PetscCall(KSPMonitorSet(run.inner, Watch, &run, NULL));
      for (int solve = 0; solve < 2; solve++) {
        run.errors.clear();
        run.solves = 0;
        PetscCall(KSPSolve(run.ksp, run.b, run.y));
        PetscCall(KSPGetConvergedReason(run.inner, &reason));
        PetscCall(KSPGetIterationNumber(run.inner, &steps));
        PetscCall(CheckTrue(KSPConvergedReasons[reason], reason == KSP_CONVERGED_RTOL));
        PetscCall(CheckInt("errors", (PetscInt)run.errors.size(), steps + 1));
        const PetscReal allowed = rtol * std::sqrt(std::abs(run.x.dot(run.d.A * run.x)));
        PetscCall(Check("error at the end", run.errors.back(), allowed));
        while (needed < steps && run.errors[needed] > allowed) needed++;
        PetscCall(Check("steps", (PetscReal)steps, (PetscReal)needed + 12));
      }
      PetscCall(RunDestroy(&run));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the inner KSP had before a solve it has afterwards, and unused there is no trace */
static PetscErrorCode Traces()
{
  for (bool projected : {true, false}) {
    Options  options(Solver(projected));
    Spec     spec;
    Run      run;
    PC       pc;
    Mat      S, before;
    PetscInt dots[3], steps[2];
    PetscInt last;

    PetscFunctionBeginUser;
    Case("traces, %s", projected ? "projected CG" : "plain CG");
    PetscCall(RunCreate(spec, &run));
    PetscCall(KSPGetPC(run.ksp, &pc));
    PetscCall(KSPSetUp(run.ksp));
    PetscCall(KSPGetOperators(run.inner, &before, NULL));
    for (int solve = 0; solve < 2; solve++) {
      if (solve) {
        Options back("-pc_ainsworth_stop residual");
        PetscCall(KSPSetFromOptions(run.ksp));
      }
      if (!solve)
        PetscCall(CheckError("no estimate",
                             [pc, &last]() { return PCAinsworthGetErrorEstimate(pc, &last, NULL, NULL); },
                             PETSC_ERR_ARG_WRONGSTATE, {"-pc_ainsworth_monitor_error"}));
      PetscCall(EventCount("VecDot", &dots[0]));
      PetscCall(KSPSolve(run.ksp, run.b, run.y));
      PetscCall(EventCount("VecDot", &dots[1]));
      PetscCall(KSPGetIterationNumber(run.inner, &steps[0]));
      {
        Options stop("-pc_ainsworth_stop energy_error -pc_ainsworth_error_rtol 1e-3");
        PetscCall(KSPSetFromOptions(run.ksp));
      }
      PetscCall(KSPSolve(run.ksp, run.b, run.y));
      PetscCall(EventCount("VecDot", &dots[2]));
      PetscCall(KSPGetIterationNumber(run.inner, &steps[1]));
      PetscCall(CheckTrue("the criterion counted", steps[1] < steps[0]));
      /* one inner product more in every iteration, some once a solve */
      const PetscInt per = (dots[1] - dots[0]) / steps[0];
      PetscCall(Check("inner products of the estimate", (PetscReal)(dots[2] - dots[1]),
                      (PetscReal)((per + 1) * steps[1] + 16)));
      PetscCall(KSPGetOperators(run.inner, &S, NULL));
      PetscCall(CheckTrue("operator", S == before));
    }
    PetscCall(RunDestroy(&run));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  for (bool projected : {true, false}) {
    for (PetscReal jump : {1.0, 100.0}) {
      Spec spec;

      spec.n    = 160;
      spec.m    = 12;
      spec.jump = jump;
      for (PetscReal eigenvalue : {0.0, 0.999, 1.5}) PetscCall(Bounds(spec, projected, eigenvalue));
    }
    PetscCall(Residuals(projected));
    PetscCall(Stop(projected));
  }
  PetscCall(Table());
  PetscCall(Traces());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
