static char help[] = "KSPPROJECTEDCG where it must not or cannot work, and the refinement of its projection.\n\n";

#include "problem.h"

/* The middle of the spectrum of A on Ker C, of which V is an orthonormal basis */
static PetscReal Middle(const Problem &p)
{
  const Eigen::ColPivHouseholderQR<Dense> qr(DenseProjector(p.d.C, DiagonalWeight(p.d.A)).Q);
  const Dense                             V      = Dense(qr.householderQ()).leftCols(p.d.A.rows() - p.d.C.rows());
  const auto                              values = Dense(V.adjoint() * p.d.A * V).eigenvalues().real().eval();

  return (values.minCoeff() + values.maxCoeff()) / 2;
}

/* -1 where the number is odd */
static PetscErrorCode IndefiniteApply(PC, Vec x, Vec y)
{
  PetscInt     start, end;
  PetscScalar *values;

  PetscFunctionBeginUser;
  PetscCall(VecCopy(x, y));
  PetscCall(VecGetOwnershipRange(y, &start, &end));
  PetscCall(VecGetArray(y, &values));
  for (PetscInt i = start; i < end; i++)
    if (i % 2) values[i - start] = -values[i - start];
  PetscCall(VecRestoreArray(y, &values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Operators and preconditioners that are negative definite, which CG solves as well, or indefinite, or no numbers at all */
static PetscErrorCode Failures()
{
  const struct {
    const char        *name;
    PetscReal          A, M;
    PetscReal          shift; /* of A, in units of the middle of its spectrum on Ker C */
    bool               alternate;
    KSPConvergedReason reason;
    const char        *text;
  } cases[] = {
    {"A negative definite",   -1.0, 1.0,            0.0,  false, KSP_CONVERGED_RTOL,          ""                         },
    {"M negative definite",   1.0,  -1.0,           0.0,  false, KSP_CONVERGED_RTOL,          ""                         },
    {"A indefinite on Ker C", 1.0,  1.0,            -1.0, false, KSP_DIVERGED_INDEFINITE_MAT, "indefinite matrix"        },
    {"M indefinite",          1.0,  1.0,            0.0,  true,  KSP_DIVERGED_INDEFINITE_PC,  "indefinite preconditioner"},
    {"M infinite",            1.0,  PETSC_INFINITY, 0.0,  false, KSP_DIVERGED_NANORINF,       ""                         }
  };

  PetscFunctionBeginUser;
  for (const auto &c : cases) {
    Spec               spec;
    Problem            p;
    PC                 pc;
    PetscReal          factor = c.M;
    KSPConvergedReason reason;

    if (PetscDefined(USE_COMPLEX) && c.alternate) continue; /* KSPCG does not look at the sign of r' z there */
    Case("%s", c.name);
    PetscCall(ProblemCreate(spec, false, &p));
    PetscCall(MatScale(p.sys.A, c.A));
    PetscCall(MatShift(p.sys.A, c.shift * Middle(p)));
    PetscCall(KSPGetPC(p.ksp, &pc));
    PetscCall(PCSetType(pc, PCSHELL));
    PetscCall(PCShellSetApply(pc, c.alternate ? IndefiniteApply : CountedApply));
    PetscCall(PCShellSetContext(pc, &factor));
    PetscCall(KSPSolve(p.ksp, p.b, p.x));
    PetscCall(KSPGetConvergedReason(p.ksp, &reason));
    PetscCall(CheckInt("reason", reason, c.reason));
    if (reason > 0) {
      const Dense A = c.A * p.d.A;
      Column      W = A.diagonal().cwiseAbs(), b, x;

      for (Eigen::Index i = 0; i < W.size(); i++) /* what stands in for an entry that is not positive */
        W[i] = 1.0 / (PetscRealPart(A(i, i)) > 0.0 ? A(i, i) : PetscScalar(A.row(i).cwiseAbs().sum()));
      const DenseProjector proj(p.d.C, W);
      PetscCall(Gather(p.b, b));
      PetscCall(Gather(p.x, x));
      PetscCall(CheckEqual("x", x, ReducedOperator(A, p.d.C, proj.Q, proj.S.diagonal().cwiseInverse()).fullPivLu().solve(b), 1e-9));
    }
    if (*c.text) {
      PetscCall(KSPSetErrorIfNotConverged(p.ksp, PETSC_TRUE));
      PetscCall(CheckError("solve", [&p]() { return KSPSolve(p.ksp, p.b, p.x); }, PETSC_ERR_NOT_CONVERGED, {c.text}));
    }
    PetscCall(ProblemDestroy(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A matrix without a projector, a preconditioner on the wrong side, estimates that were not asked for */
static PetscErrorCode Misuse()
{
  Spec      spec;
  Problem   p;
  PC        pc;
  PetscReal high, low;

  PetscFunctionBeginUser;
  Case("misuse");
  PetscCall(ProblemCreate(spec, false, &p));
  PetscCall(KSPSolve(p.ksp, p.b, p.x));
  PetscCall(
    CheckError("estimates not asked for", [&]() { return KSPComputeExtremeSingularValues(p.ksp, &high, &low); }, PETSC_ERR_ARG_WRONGSTATE, {"not requested"}));
  PetscCall(KSPSetOperators(p.ksp, p.sys.A, p.sys.A));
  PetscCall(CheckError("a matrix of type aij in a second solve", [&]() { return KSPSolve(p.ksp, p.b, p.x); }, PETSC_ERR_ARG_WRONG,
                       {"aij", MATAINSWORTH, "no projector"}));
  PetscCall(KSPReset(p.ksp));
  PetscCall(KSPSetOperators(p.ksp, p.sys.A, p.sys.A));
  PetscCall(CheckError("a matrix of type aij", [&]() { return KSPSetUp(p.ksp); }, PETSC_ERR_ARG_WRONG, {"aij", MATAINSWORTH, "no projector"}));
  PetscCall(KSPReset(p.ksp)); /* and it can be used again */
  PetscCall(KSPSetOperators(p.ksp, p.S, p.sys.A));
  PetscCall(KSPSolve(p.ksp, p.b, p.x));
  PetscCall(KSPGetPC(p.ksp, &pc));
  PetscCall(PCSetDiagonalScale(pc, p.sys.w));
  PetscCall(CheckError("diagonal scaling", [&]() { return KSPSolve(p.ksp, p.b, p.x); }, PETSC_ERR_SUP, {"projectedcg does not support diagonal scaling"}));
  PetscCall(ProblemDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A right-hand side without a part in Ker C, and no norm that would tell: the solution is that of the range; KSPCG counts the step that it does not take */
static PetscErrorCode Nothing()
{
  Spec               spec;
  Problem            p;
  Column             x, b;
  PetscInt           steps;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("nothing in Ker C");
  PetscCall(ProblemCreate(spec, false, &p));
  PetscCall(KSPSetNormType(p.ksp, KSP_NORM_NONE));
  PetscCall(MatMultHermitianTranspose(p.sys.C, p.sys.g, p.b));
  PetscCall(KSPSolve(p.ksp, p.b, p.x));
  PetscCall(KSPGetConvergedReason(p.ksp, &reason));
  PetscCall(KSPGetIterationNumber(p.ksp, &steps));
  PetscCall(CheckInt("reason", reason, KSP_CONVERGED_ATOL));
  PetscCall(CheckInt("steps", steps, 1));
  PetscCall(Gather(p.b, b));
  PetscCall(Gather(p.x, x));
  PetscCall(CheckEqual("x", x, p.reduced.fullPivLu().solve(b), 1e-12));
  PetscCall(ProblemDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PETSc's own monitor of true residuals; the refinement comes on where rows of C are nearly dependent, and not before */
static PetscErrorCode Drift()
{
  Spec        spec;
  Problem     p;
  std::string text;
  PetscInt    n, m, start, end;
  Mat         C;
  PC          pc;

  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  {
    Options options("-ksp_monitor_true_residual :monitor.txt");
    Case("true residual monitor");
    PetscCall(ProblemCreate(spec, false, &p));
    PetscCall(KSPSolve(p.ksp, p.b, p.x));
    PetscCall(KSPMonitorCancel(p.ksp)); /* closes the file */
    PetscCall(FileText("monitor.txt", text));
    PetscCall(CheckText("monitor", text, {"0 KSP", "1 KSP", "true resid norm"}));
  }
  PetscCall(ViewText(p.ksp, text));
  PetscCall(CheckText("view", text, {"type: projectedcg"}));
  PetscCall(CheckTrue("not refined where rows of C are far from dependent", text.find("refinement of the projection") == std::string::npos));

  Case("nearly dependent rows of C");
  p.d.C.row(1) = p.d.C.row(0) + 1e-6 * p.d.C.row(1);
  PetscCall(MatGetLocalSize(p.sys.C, &m, &n));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, n, PETSC_DETERMINE, PETSC_DETERMINE, spec.n, NULL, spec.n, NULL, &C));
  PetscCall(MatGetOwnershipRange(C, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < spec.n; j++)
      if (p.d.C(i, j) != 0.0) PetscCall(MatSetValue(C, i, j, p.d.C(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAinsworthSetMats(p.S, p.sys.A, C));
  PetscCall(KSPGetPC(p.ksp, &pc));
  PetscCall(PCSetType(pc, PCNONE)); /* Jacobi would keep Ker C by itself: it is W */
  PetscCall(KSPSolve(p.ksp, p.b, p.x));
  PetscCall(ViewText(p.ksp, text));
  PetscCall(CheckText("view", text, {"refinement of the projection: on"}));
  PetscCall(KSPGetConvergedReason(p.ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(MatDestroy(&C));
  PetscCall(ProblemDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(Failures());
  PetscCall(Misuse());
  PetscCall(Nothing());
  PetscCall(Drift());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
