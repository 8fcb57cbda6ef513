static char
  help[] = "Situations of PCAINSWORTH, each a row: a system, options, what is done, and what comes of it.\n\n";

#include "situations.h"
#include <cstring>

std::string        common;
static std::string only; /* rows whose name has this in it */

static bool Same(const Dense &a, const Dense &b) /* bit by bit: NaN is NaN */
{
  return a.size() == b.size() && !memcmp(a.data(), b.data(), a.size() * sizeof(PetscScalar));
}

/* What differs, at places that are there or new ones */
static PetscErrorCode WriteChanges(const Dense &now, const Dense &before, Mat M)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  if (!M || Same(now, before)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRange(M, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < now.cols(); j++)
      if (now(i, j) != 0.0 || before(i, j) != 0.0) PetscCall(MatSetValue(M, i, j, now(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Live::Write()
{
  PetscFunctionBeginUser;
  PetscCall(WriteChanges(d.A, written.A, sys.A));
  PetscCall(WriteChanges(d.C, written.C, sys.C));
  if (!(storage & VIEW)) PetscCall(WriteChanges(d.Upper(), written.Upper(), Ct));
  PetscCall(Scatter(d.f, sys.f));
  PetscCall(Scatter(d.g, sys.g));
  written = d;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode UpperCreate(Live &s)
{
  PetscFunctionBeginUser;
  if (s.storage & VIEW) PetscCall(MatCreateHermitianTranspose(s.sys.C, &s.Ct));
  if (s.storage & EXPLICIT) PetscCall(MatHermitianTranspose(s.sys.C, MAT_INITIAL_MATRIX, &s.Ct));
  if (s.d.B.size()) PetscCall(WriteChanges(s.d.Upper(), s.d.C.adjoint(), s.Ct));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Live::Create()
{
  PetscInt m;

  PetscFunctionBeginUser;
  if (d.spec.name) {
    PetscCall(SystemCreate(PETSC_COMM_WORLD, d.spec, &sys));
    PetscCall(Gather(sys, d));
    original = d;
  } else PetscCall(SystemFromDense(d, storage & CROSSED, &sys));
  for (Mat M : {sys.A, sys.C}) PetscCall(MatSetOption(M, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(UpperCreate(*this));
  if (d.D.size()) {
    PetscCall(VecGetLocalSize(sys.g, &m));
    PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &D));
    PetscCall(WriteDense(d.D, D));
  }
  written = d;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Live::Renew(const std::string &some)
{
  const auto renewed = [&](char block) { return some.find(block) != std::string::npos; };
  Live       other(d, storage);
  Mat        old = nest;

  PetscFunctionBeginUser;
  other.d.spec.name = NULL;
  if (!some.empty()) PetscCall(other.Create());
  if (renewed('A')) std::swap(sys.A, other.sys.A);
  if (renewed('B')) std::swap(Ct, other.Ct);
  if (renewed('C')) {
    std::swap(sys.C, other.sys.C);
    std::swap(sys.f, other.sys.f);
    std::swap(sys.g, other.sys.g);
  }
  PetscCall(NestCreate(sys.A, Ct, sys.C, D, storage & FIRST, &nest));
  PetscCall(KSPSetOperators(ksp, nest, nest));
  PetscCall(MatDestroy(&old));
  PetscCall(other.Destroy());
  written = d;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Live::Solve(bool transposed)
{
  PetscFunctionBeginUser;
  PetscCall(Write());
  PetscCall(SolveFields(ksp, sys, storage & FIRST, false, x, lambda, transposed));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(PCGetFailedReason(pc, &failure));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Live::Destroy()
{
  PetscFunctionBeginUser;
  for (Mat *M : {&Ct, &D}) PetscCall(MatDestroy(M));
  PetscCall(RunDestroy(this));
  PetscFunctionReturn(PETSC_SUCCESS);
}

Action Edit(const std::function<void(Saddle &)> &change)
{
  return [=](Live &s) {
    change(s.d);
    return PETSC_SUCCESS;
  };
}

Action Original()
{
  return [](Live &s) {
    s.d = s.original;
    return PETSC_SUCCESS;
  };
}

Action Reread(const std::string &line)
{
  return [=](Live &s) {
    s.options.reset();
    s.options.reset(new Options(common + " " + line));
    return KSPSetFromOptions(s.ksp);
  };
}

Action Inner(const std::function<PetscErrorCode(KSP, PC)> &change)
{
  return [=](Live &s) -> PetscErrorCode {
    KSP inner;
    PC  pc;

    PetscFunctionBeginUser;
    PetscCall(PCAinsworthGetKSP(s.pc, &inner));
    PetscCall(KSPGetPC(inner, &pc));
    PetscCall(change(inner, pc));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

Action Shell(PetscErrorCode (*apply)(PC, Vec, Vec), void *ctx)
{
  return Inner([=](KSP, PC pc) -> PetscErrorCode {
    PetscFunctionBeginUser;
    PetscCall(PCSetType(pc, PCSHELL));
    PetscCall(PCShellSetApply(pc, apply));
    PetscCall(PCShellSetContext(pc, ctx));
    PetscFunctionReturn(PETSC_SUCCESS);
  });
}

/* A fresh solver, and what it says of its last failure */
PetscErrorCode Failure(const Live &s, std::string &why)
{
  const char *text;

  PetscFunctionBeginUser;
  PetscCall(PCAinsworthGetFailure(s.pc, &text));
  why = text;
  PetscFunctionReturn(PETSC_SUCCESS);
}

Action Residuals(PetscReal primal, PetscReal constraint)
{
  return [=](Live &s) -> PetscErrorCode {
    const Column force = s.d.Upper() * s.lambda;
    PetscReal    worst = 0.0;

    PetscFunctionBeginUser;
    for (Eigen::Index i = 0; i < s.d.C.rows(); i++)
      worst = PetscMax(worst, PetscAbsScalar((s.d.C.row(i) * s.x)[0] - s.d.g[i]) /
                                (s.d.C.row(i).norm() * s.x.norm() + PetscAbsScalar(s.d.g[i])));
    PetscCall(Check("C x - g", worst, constraint));
    PetscCall(Check("A x + B' lambda - f", (s.d.A * s.x + force - s.d.f).norm(),
                    primal * (s.d.A.norm() * s.x.norm() + force.norm() + s.d.f.norm())));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

static void DenseSolve(const Saddle &d, bool transposed, Column &x, Column &lambda)
{
  const Eigen::Index n = d.A.rows(), m = d.C.rows();
  Dense              K(n + m, n + m);
  Column             b(n + m), y;

  K.topLeftCorner(n, n)     = d.A;
  K.topRightCorner(n, m)    = d.Upper();
  K.bottomLeftCorner(m, n)  = d.C;
  K.bottomRightCorner(m, m) = d.D.size() ? d.D : Dense::Zero(m, m);
  if (transposed) K.transposeInPlace();
  b << d.f, d.g;
  y      = K.fullPivLu().solve(b); /* zero where rows of C are */
  x      = y.head(n);
  lambda = y.tail(m);
}

Action Equal(PetscReal tolerance, bool transposed)
{
  return [=](Live &s) -> PetscErrorCode {
    Column x, lambda;

    PetscFunctionBeginUser;
    DenseSolve(s.d, transposed, x, lambda);
    PetscCall(CheckEqual("x", s.x, x, tolerance));
    PetscCall(CheckEqual("lambda", s.lambda, lambda, tolerance));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

Action EqualX(PetscReal tolerance)
{
  return [=](Live &s) {
    Column x, lambda;

    SolveSaddle(s.d, x, lambda);
    return CheckEqual("x", s.x, x, tolerance);
  };
}

Action Fails(const Parts &why, PCFailedReason failure)
{
  return [=](Live &s) -> PetscErrorCode {
    std::string text;

    PetscFunctionBeginUser;
    PetscCall(CheckFailed(s));
    if (failure != PC_NOERROR) PetscCall(CheckInt("failure of the PC", s.failure, failure));
    PetscCall(Failure(s, text));
    PetscCall(CheckTrue("a failure has a text", !text.empty()));
    PetscCall(CheckText("the cause", text, why));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

Action Either(const Action &good, const Action &bad, bool transposed)
{
  return [=](Live &s) -> PetscErrorCode {
    PetscFunctionBeginUser;
    PetscCall(s.Solve(transposed));
    const Action &judge = s.reason > 0 ? good : bad;
    PetscCall(CheckTrue(KSPConvergedReasons[s.reason], (bool)judge));
    if (judge) PetscCall(judge(s));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

static PetscErrorCode Nothing(Live &)
{
  return PETSC_SUCCESS;
}

Action Positive()
{
  return Either(Nothing, nullptr);
}
Action Negative()
{
  return Either(nullptr, Nothing);
}
Action Solved(PetscReal primal, PetscReal constraint)
{
  return Either(Residuals(primal, constraint), nullptr);
}
Action Right(PetscReal tolerance)
{
  return Either(Equal(tolerance), nullptr);
}
Action Failed(const Parts &why, PCFailedReason failure)
{
  return Either(nullptr, Fails(why, failure));
}

Action Exact(PetscReal tolerance)
{
  return [=](Live &s) -> PetscErrorCode {
    PetscFunctionBeginUser;
    PetscCall(s.Write());
    PetscCall(CheckSolution(s.ksp, s.sys, s.d, false, false, tolerance));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

Action Raised(PetscErrorCode code, const Parts &parts)
{
  return [=](Live &s) {
    return CheckError(
      "solve", [&]() { return s.Solve(); }, code, parts);
  };
}

Action TransposeRaised(PetscErrorCode code, const Parts &parts)
{
  return [=](Live &s) {
    return CheckError(
      "transposed solve", [&]() { return s.Solve(true); }, code, parts);
  };
}

Action SetUpRaised(PetscErrorCode code, const Parts &parts)
{
  return [=](Live &s) -> PetscErrorCode {
    PetscFunctionBeginUser;
    PetscCall(s.Write());
    PetscCall(CheckError(
      "set-up", [&]() { return KSPSetUp(s.ksp); }, code, parts));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

DenseSystem Chain(PetscInt n, PetscInt m, PetscReal diagonal)
{
  DenseSystem d;

  d.A = Dense::Zero(n, n);
  d.C.resize(m, n);
  d.f.resize(n);
  d.g.resize(m);
  for (PetscInt i = 0; i < n; i++) {
    d.A(i, i) = diagonal;
    if (i) d.A(i, i - 1) = d.A(i - 1, i) = -1.0;
    d.f[i] = Uniform(8, i, 0);
  }
  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt j = 0; j < n; j++) d.C(i, j) = Uniform(7, i, j);
    d.g[i] = Uniform(9, i, 0);
  }
  return d;
}

PetscErrorCode Live::Start(const std::string &line, const Action &blocks)
{
  PetscFunctionBeginUser;
  options.reset(new Options(common + " " + line));
  PetscCall(Create());
  if (blocks) PetscCall(blocks(*this));
  PetscCall(NestCreate(sys.A, Ct, sys.C, D, storage & FIRST, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Row(const std::string &name, const Saddle &system, const std::string &options,
                   const std::vector<Action> &actions, int storage, const Action &blocks)
{
  Live s(system, storage);

  PetscFunctionBeginUser;
  if (name.find(only) == std::string::npos) PetscFunctionReturn(PETSC_SUCCESS);
  Case("%s", name.c_str());
  PetscCall(s.Start(options, blocks));
  for (const Action &action : actions) PetscCall(action(s));
  PetscCall(s.Destroy());
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int  exitcode;
  char part[256] = "";

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscOptionsGetString(NULL, NULL, "-row", part, sizeof(part), NULL));
  only = part;
  for (auto table : {Systems, InnerSolver, Sequences, Truth, Refusals}) PetscCall(table());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
