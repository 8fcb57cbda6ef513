/* What is done in a row of a table, and what is asked of a solve */
#include "situations.h"
#include <map>

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
    s.options.reset(new Options(line));
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

Action Limit(PetscInt steps)
{
  return Inner(
    [=](KSP inner, PC) { return KSPSetTolerances(inner, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, steps); });
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

Action Both(const Action &first, const Action &second)
{
  return [=](Live &s) -> PetscErrorCode {
    PetscFunctionBeginUser;
    PetscCall(first(s));
    PetscCall(second(s));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

Action Viewed(const Parts &parts)
{
  return [=](Live &s) -> PetscErrorCode {
    std::string text;

    PetscFunctionBeginUser;
    PetscCall(ViewText(s.ksp, text));
    PetscCall(CheckText("view", text, parts));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

Action NotViewed(const std::string &part)
{
  return [=](Live &s) -> PetscErrorCode {
    std::string text;

    PetscFunctionBeginUser;
    PetscCall(ViewText(s.ksp, text));
    PetscCall(CheckTrue((part + " is not in the view").c_str(), text.find(part) == std::string::npos));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/* How often each of these happened since it was counted last; negative: this begins now */
Action Counted(const Parts &events, PetscInt expected)
{
  return [=](Live &) -> PetscErrorCode {
    static std::map<std::string, PetscInt> before;

    PetscFunctionBeginUser;
    for (const std::string &event : events) {
      PetscInt now;

      PetscCall(EventCount(event.c_str(), &now));
      if (expected >= 0) PetscCall(CheckInt(event.c_str(), now - before[event], expected));
      before[event] = now;
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

Action InnerType(const std::string &expected)
{
  return Inner([=](KSP inner, PC) -> PetscErrorCode {
    KSPType type;

    PetscFunctionBeginUser;
    PetscCall(KSPGetType(inner, &type));
    PetscCall(CheckTrue(type, type == expected));
    PetscFunctionReturn(PETSC_SUCCESS);
  });
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

Action Exact(PetscReal tolerance, bool nested, PetscReal rounding)
{
  return [=](Live &s) -> PetscErrorCode {
    PetscFunctionBeginUser;
    PetscCall(s.Write());
    PetscCall(CheckSolution(s.ksp, s.sys, s.d, false, nested, tolerance, rounding));
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
