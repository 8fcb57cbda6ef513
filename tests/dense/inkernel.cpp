static char help
  [] = "Conjugate gradients in Ker C: solutions, norms, spectra, costs and failures against dense linear algebra.\n\n";

#include "dense.h"
#include "projection/inkernel.h"
#include "projection/matainsworth.h"
#include <algorithm>

/* KSPPROJECTEDCG with the operator in Ker C, and Jacobi of A in its preconditioner; A counts its products */
struct Problem {
  System      sys;
  DenseSystem d;
  Mat         A = NULL, reduced = NULL, operation = NULL;
  PC          inner = NULL, around = NULL;
  KSP         ksp = NULL;
  Vec         b = NULL, x = NULL; /* in the range of Q', in Ker C */
  Dense       V;                  /* orthonormal basis of Ker C */
};

/* calls of A and of CountedApply(), whose context is a factor */
static int products = 0, preconditioned = 0;

static PetscErrorCode CountedMult(Mat shell, Vec x, Vec y)
{
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(shell, &A));
  products++;
  PetscCall(MatMult(A, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CountedApply(PC pc, Vec x, Vec y)
{
  PetscReal *factor;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &factor));
  preconditioned++;
  PetscCall(VecCopy(x, y));
  PetscCall(VecScale(y, *factor));
  PetscFunctionReturn(PETSC_SUCCESS);
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

/* Makes the solver for the present A and C */
static PetscErrorCode Prepare(Problem *p)
{
  PetscFunctionBeginUser;
  PetscCall(PCDestroy(&p->around));
  PetscCall(MatDestroy(&p->operation));
  PetscCall(AinsworthInKernelCreateOperator(p->reduced, &p->operation));
  PetscCall(AinsworthInKernelCreatePC(p->reduced, p->operation, p->inner, AinsworthLeftOut(), &p->around));
  PetscCall(PCSetOperators(p->around, p->operation, p->sys.A));
  PetscCall(KSPSetPC(p->ksp, p->around));
  PetscCall(MatAinsworthMultTransposeProjector(p->reduced, p->b, p->b));
  p->V = Dense(Eigen::HouseholderQR<Dense>(p->d.C.adjoint()).householderQ()).rightCols(p->d.A.rows() - p->d.C.rows());
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ProblemCreate(const Spec &spec, Problem *p)
{
  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &p->sys));
  PetscCall(Gather(p->sys, p->d));
  PetscCall(ShellCreate(p->sys.A, true, false, &p->A));
  PetscCall(MatShellSetOperation(p->A, MATOP_MULT, (void (*)(void))CountedMult));
  PetscCall(MatCreateAinsworth(p->A, p->sys.C, &p->reduced));
  PetscCall(PCCreate(PETSC_COMM_WORLD, &p->inner));
  PetscCall(PCSetType(p->inner, PCJACOBI));
  PetscCall(PCSetOperators(p->inner, p->sys.A, p->sys.A));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &p->ksp));
  PetscCall(KSPSetType(p->ksp, KSPPROJECTEDCG));
  PetscCall(KSPSetTolerances(p->ksp, 1e-13, PETSC_DEFAULT, PETSC_DEFAULT, 1000));
  PetscCall(VecDuplicate(p->sys.f, &p->b));
  PetscCall(VecDuplicate(p->sys.f, &p->x));
  PetscCall(SetRandom(p->b, 40));
  PetscCall(Prepare(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ProblemDestroy(Problem *p)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&p->ksp));
  PetscCall(PCDestroy(&p->around));
  PetscCall(PCDestroy(&p->inner));
  for (Mat *M : {&p->operation, &p->reduced, &p->A}) PetscCall(MatDestroy(M));
  for (Vec *v : {&p->b, &p->x}) PetscCall(VecDestroy(v));
  PetscCall(SystemDestroy(&p->sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Compares x with the solution in Ker C */
static PetscErrorCode CheckSolution(const Problem &p, PetscReal tolerance)
{
  Column b, x;

  PetscFunctionBeginUser;
  PetscCall(Gather(p.b, b));
  PetscCall(Gather(p.x, x));
  PetscCall(
    CheckEqual("x", x, p.V * Dense(p.V.adjoint() * p.d.A * p.V).fullPivLu().solve(p.V.adjoint() * b), tolerance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At every iteration: the iterate is in Ker C, and the norm is what it says it is */
static PetscErrorCode Watch(KSP ksp, PetscInt step, PetscReal norm, void *ctx)
{
  const Problem       *p = (Problem *)ctx;
  const DenseProjector proj(p->d.C, DiagonalWeight(p->d.A));
  const Column         root = proj.S.diagonal().cwiseSqrt();
  Vec                  x, r;
  Column               dx, dr, b, residual, z;
  KSPNormType          type;
  PetscReal            expected = 0.0;

  PetscFunctionBeginUser;
  PetscCall(KSPBuildSolution(ksp, NULL, &x));
  PetscCall(Gather(x, dx));
  PetscCall(Gather(p->b, b));
  residual = b - proj.Q.adjoint() * (p->d.A * dx);
  z        = proj.Q * (DiagonalWeight(p->d.A).asDiagonal() * residual);
  PetscCall(KSPGetNormType(ksp, &type));
  if (type == KSP_NORM_NATURAL) expected = PetscSqrtReal(PetscAbsScalar(residual.dot(z)));
  if (type == KSP_NORM_PRECONDITIONED) expected = z.norm();
  if (type == KSP_NORM_UNPRECONDITIONED) expected = residual.norm();
  PetscCall(
    Check(("norm at step " + std::to_string(step)).c_str(), PetscAbsReal(norm - expected), 1e-6 * expected + 1e-12));
  PetscCall(Check(("C x at step " + std::to_string(step)).c_str(),
                  (root.cwiseInverse().asDiagonal() * (p->d.C * dx)).norm(), 1e-12 * b.norm()));
  PetscCall(KSPBuildResidual(ksp, NULL, NULL, &r));
  PetscCall(Gather(r, dr));
  PetscCall(VecDestroy(&r));
  PetscCall(
    Check(("built residual at step " + std::to_string(step)).c_str(), (dr - residual).norm(), 1e-11 * b.norm()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Any right-hand side, any guess, four norms */
static PetscErrorCode Solutions(const Spec &spec)
{
  Problem p;

  PetscFunctionBeginUser;
  PetscCall(ProblemCreate(spec, &p));
  for (KSPNormType type : {KSP_NORM_NATURAL, KSP_NORM_PRECONDITIONED, KSP_NORM_UNPRECONDITIONED, KSP_NORM_NONE}) {
    for (int guess = 0; guess < 2; guess++) {
      KSPConvergedReason reason;

      Case("%s, norm %s, guess %d", spec.name, KSPNormTypes[type], guess);
      PetscCall(KSPSetNormType(p.ksp, type));
      /* a bad guess for a stiff body is no divergence */
      PetscCall(KSPSetTolerances(p.ksp, PETSC_DEFAULT, PETSC_DEFAULT, 1e10, PETSC_DEFAULT));
      if (type == KSP_NORM_NONE) { /* the last of the list */
        PetscCall(KSPSetConvergenceTest(p.ksp, KSPConvergedSkip, NULL, NULL));
        /* as many steps as Ker C has dimensions: then nothing but rounding is left of r' z */
        PetscCall(KSPSetTolerances(p.ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, spec.n - spec.m));
      }
      PetscCall(KSPMonitorCancel(p.ksp));
      if (!guess && spec.jump == 1.0 && type != KSP_NORM_NONE) PetscCall(KSPMonitorSet(p.ksp, Watch, &p, NULL));
      PetscCall(KSPSetInitialGuessNonzero(p.ksp, (PetscBool)guess));
      PetscCall(SetRandom(p.x, 50));
      PetscCall(MatAinsworthMultProjector(p.reduced, p.x, p.x));
      PetscCall(KSPSolve(p.ksp, p.b, p.x));
      PetscCall(KSPGetConvergedReason(p.ksp, &reason));
      PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
      PetscCall(CheckSolution(p, spec.jump == 1.0 ? 1e-10 : 1e-5));
    }
  }
  PetscCall(ProblemDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ritz values of a run to the end against the spectrum of Q M^{-1} Q' A on Ker C */
static PetscErrorCode Spectrum(const char *pctype)
{
  Spec                   spec;
  Problem                p;
  PetscInt               count;
  PetscReal              real[64], imaginary[64], high, low;
  std::vector<PetscReal> spectrum;

  PetscFunctionBeginUser;
  spec.n = 14;
  Case("eigenvalues with %s", pctype);
  PetscCall(ProblemCreate(spec, &p));
  PetscCall(PCSetType(p.inner, pctype));
  PetscCall(KSPSetComputeEigenvalues(p.ksp, PETSC_TRUE));
  PetscCall(KSPSolve(p.ksp, p.b, p.x));
  PetscCall(KSPComputeEigenvalues(p.ksp, 64, real, imaginary, &count));
  PetscCall(KSPComputeExtremeSingularValues(p.ksp, &high, &low));

  const DenseProjector proj(p.d.C, DiagonalWeight(p.d.A));
  const Column         M      = std::string(pctype) == PCNONE ? Column(Column::Ones(spec.n)) : DiagonalWeight(p.d.A);
  const Dense          op     = proj.Q * M.asDiagonal() * proj.Q.adjoint() * p.d.A * proj.Q;
  const auto           values = op.eigenvalues();
  for (Eigen::Index i = 0; i < values.size(); i++)
    if (std::abs(values[i]) > 1e-8) spectrum.push_back(values[i].real());
  std::sort(spectrum.begin(), spectrum.end());
  PetscCall(CheckInt("eigenvalues on Ker C", (PetscInt)spectrum.size(), spec.n - spec.m));
  PetscCall(Check("smallest", PetscAbsReal(low - spectrum.front()), 1e-6 * spectrum.front()));
  PetscCall(Check("largest", PetscAbsReal(high - spectrum.back()), 1e-6 * spectrum.back()));
  for (PetscReal value : spectrum) {
    PetscReal nearest = PETSC_MAX_REAL;
    for (PetscInt k = 0; k < count; k++) nearest = PetscMin(nearest, PetscAbsReal(real[k] - value));
    PetscCall(Check("distance of an eigenvalue from the nearest estimate", nearest, 1e-5 * value));
  }
  PetscCall(ProblemDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One product with A, one preconditioner, two solves with S per iteration */
static PetscErrorCode Costs()
{
  const PetscInt steps[2] = {4, 11};
  Spec           spec;
  Problem        p;
  PetscReal      factor = 1.0;
  PetscInt       before, after, taken, solves[2], products2[2], preconditioned2[2];

  PetscFunctionBeginUser;
  Case("costs");
  PetscCall(ProblemCreate(spec, &p));
  PetscCall(PCSetType(p.inner, PCSHELL));
  PetscCall(PCShellSetApply(p.inner, CountedApply));
  PetscCall(PCShellSetContext(p.inner, &factor));
  for (int run = 0; run < 2; run++) {
    PetscCall(KSPSetTolerances(p.ksp, 1e-30, PETSC_DEFAULT, PETSC_DEFAULT, steps[run]));
    products = preconditioned = 0;
    PetscCall(EventCount("AinsGramSolve", &before));
    PetscCall(KSPSolve(p.ksp, p.b, p.x));
    PetscCall(EventCount("AinsGramSolve", &after));
    PetscCall(KSPGetIterationNumber(p.ksp, &taken));
    PetscCall(CheckInt("steps", taken, steps[run]));
    solves[run]          = after - before;
    products2[run]       = products;
    preconditioned2[run] = preconditioned;
  }
  PetscCall(CheckInt("products with A", products2[1] - products2[0], steps[1] - steps[0]));
  PetscCall(
    CheckInt("applications of the preconditioner", preconditioned2[1] - preconditioned2[0], steps[1] - steps[0]));
  PetscCall(CheckInt("solves with S", solves[1] - solves[0], 2 * (steps[1] - steps[0])));
  PetscCall(CheckInt("products with A before the first step", products2[0] - steps[0], 0));
  PetscCall(ProblemDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As many iterations as conjugate gradients on A~ where the penalty fits it */
static PetscErrorCode PlainCG()
{
  Spec     spec;
  Problem  p;
  PetscInt steps[2];

  PetscFunctionBeginUser;
  Case("against KSPCG");
  spec.n = 120;
  PetscCall(ProblemCreate(spec, &p));
  PetscCall(KSPSetTolerances(p.ksp, 1e-8, PETSC_DEFAULT, PETSC_DEFAULT, 1000));
  for (int run = 0; run < 2; run++) {
    if (run) {
      PetscCall(KSPSetType(p.ksp, KSPCG));
      PetscCall(KSPSetNormType(p.ksp, KSP_NORM_NATURAL));
      PetscCall(KSPSetPC(p.ksp, p.inner));
      PetscCall(KSPSetOperators(p.ksp, p.reduced, p.sys.A));
    }
    PetscCall(KSPSolve(p.ksp, p.b, p.x));
    PetscCall(KSPGetIterationNumber(p.ksp, &steps[run]));
  }
  PetscCall(Check("steps in Ker C", (PetscReal)steps[0], (PetscReal)steps[1]));
  PetscCall(Check("steps of KSPCG", (PetscReal)steps[1], (PetscReal)(steps[0] + 8))); /* m = 5 more eigenvalues */
  PetscCall(ProblemDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Operators and preconditioners that are negative definite, which CG solves as well, or indefinite, or no numbers at
   all
*/
static PetscErrorCode Failures()
{
  const struct {
    const char        *name;
    PetscReal          A, M;
    PetscReal          shift; /* of A, in units of the middle of its spectrum on Ker C */
    bool               alternate;
    KSPConvergedReason reason;
  } cases[] = {
    {"A negative definite",   -1.0, 1.0,            0.0,  false, KSP_CONVERGED_RTOL         },
    {"M negative definite",   1.0,  -1.0,           0.0,  false, KSP_CONVERGED_RTOL         },
    {"A indefinite on Ker C", 1.0,  1.0,            -1.0, false, KSP_DIVERGED_INDEFINITE_MAT},
    {"M indefinite",          1.0,  1.0,            0.0,  true,  KSP_DIVERGED_INDEFINITE_PC },
    {"M infinite",            1.0,  PETSC_INFINITY, 0.0,  false, KSP_DIVERGED_NANORINF      }
  };

  PetscFunctionBeginUser;
  for (const auto &c : cases) {
    Spec               spec;
    Problem            p;
    PetscReal          factor = c.M;
    KSPConvergedReason reason;

    if (PetscDefined(USE_COMPLEX) && c.alternate) continue; /* KSPCG does not look at the sign of r' z there */
    Case("%s", c.name);
    PetscCall(ProblemCreate(spec, &p));
    const auto values = Dense(p.V.adjoint() * p.d.A * p.V).eigenvalues().real().eval();
    PetscCall(MatScale(p.sys.A, c.A));
    PetscCall(MatShift(p.sys.A, c.shift * (values.minCoeff() + values.maxCoeff()) / 2));
    PetscCall(Gather(p.sys, p.d));
    PetscCall(PCSetType(p.inner, PCSHELL));
    PetscCall(PCShellSetApply(p.inner, c.alternate ? IndefiniteApply : CountedApply));
    PetscCall(PCShellSetContext(p.inner, &factor));
    PetscCall(KSPSolve(p.ksp, p.b, p.x));
    PetscCall(KSPGetConvergedReason(p.ksp, &reason));
    PetscCall(CheckInt("reason", reason, c.reason));
    if (reason > 0) PetscCall(CheckSolution(p, 1e-9));
    PetscCall(ProblemDestroy(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The Gram matrix is ill-conditioned: projections are refined */
static PetscErrorCode NearlyDependent()
{
  Spec               spec;
  Problem            p;
  PetscInt           n, m, start, end, pass = 0, dependent, *rows = NULL;
  Mat                C;
  PCFailedReason     failed;
  PetscBool          hidden, doubtful;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("nearly dependent rows of C");
  PetscCall(ProblemCreate(spec, &p));
  p.d.C.row(1) = p.d.C.row(0) + 1e-6 * p.d.C.row(1);
  PetscCall(MatGetLocalSize(p.sys.C, &m, &n));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, n, PETSC_DETERMINE, PETSC_DETERMINE, spec.n, NULL, spec.n, NULL, &C));
  PetscCall(MatGetOwnershipRange(C, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < spec.n; j++)
      if (p.d.C(i, j) != 0.0) PetscCall(MatSetValue(C, i, j, p.d.C(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAinsworthIsDoubtful_Private(p.reduced, &doubtful));
  PetscCall(CheckTrue("not where rows of C are far from dependent", !doubtful));
  PetscCall(MatAinsworthSetMats(p.reduced, p.A, C));
  PetscCall(MatAinsworthDiagnose_Private(p.reduced, &pass, &dependent, &rows, &failed, &hidden));
  PetscCall(CheckInt("dependent rows", dependent, 0));
  PetscCall(PetscFree(rows));
  PetscCall(MatAinsworthIsDoubtful_Private(p.reduced, &doubtful));
  PetscCall(CheckTrue("projections are refined", doubtful));
  PetscCall(PCSetType(p.inner, PCNONE)); /* Jacobi would keep Ker C by itself: it is W */
  PetscCall(Prepare(&p));
  PetscCall(KSPSetTolerances(p.ksp, 1e-11, PETSC_DEFAULT, PETSC_DEFAULT, 1000));
  PetscCall(KSPSetFromOptions(p.ksp));
  PetscCall(KSPSolve(p.ksp, p.b, p.x));
  PetscCall(KSPGetConvergedReason(p.ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(CheckSolution(p, 1e-8));
  PetscCall(MatDestroy(&C));
  PetscCall(ProblemDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  for (const Spec &spec : UsualSpecs())
    if (spec.symmetric) PetscCall(Solutions(spec));
  for (const char *type : {PCNONE, PCJACOBI}) PetscCall(Spectrum(type));
  PetscCall(Costs());
  PetscCall(PlainCG());
  PetscCall(Failures());
  PetscCall(NearlyDependent());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
