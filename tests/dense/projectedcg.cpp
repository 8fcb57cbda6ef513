static char help[] = "KSPPROJECTEDCG: solutions, norms, spectra, costs and failures against dense linear algebra.\n\n";

#include "problem.h"
#include <algorithm>

/* At every iteration: the constraints hold, and the norm is what it says it is */
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
  residual = b - p->reduced * dx;
  z        = proj.Q * (DiagonalWeight(p->d.A).asDiagonal() * (proj.Q.adjoint() * residual));
  PetscCall(KSPGetNormType(ksp, &type));
  if (type == KSP_NORM_NATURAL) expected = PetscSqrtReal(PetscAbsScalar(residual.dot(z)));
  if (type == KSP_NORM_PRECONDITIONED) expected = z.norm();
  if (type == KSP_NORM_UNPRECONDITIONED) expected = residual.norm();
  PetscCall(Check(("norm at step " + std::to_string(step)).c_str(), PetscAbsReal(norm - expected), 1e-6 * expected + 1e-12));
  const Column drift = root.cwiseInverse().asDiagonal() * (p->d.C * dx) -
                       root.asDiagonal() * (proj.R.adjoint() * b); /* row penalty, diagonal weight: B^{-1} = diag(S) */
  PetscCall(Check(("constraints at step " + std::to_string(step)).c_str(), drift.norm(), 1e-12 * (root.asDiagonal() * (proj.R.adjoint() * b)).norm()));
  PetscCall(KSPBuildResidual(ksp, NULL, NULL, &r));
  PetscCall(Gather(r, dr));
  PetscCall(VecDestroy(&r));
  PetscCall(Check(("built residual at step " + std::to_string(step)).c_str(), (dr - residual).norm(), 1e-11 * b.norm()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Any right-hand side, any guess, four norms */
static PetscErrorCode Solutions(const Spec &spec)
{
  Problem p;

  PetscFunctionBeginUser;
  PetscCall(ProblemCreate(spec, false, &p));
  for (KSPNormType type : {KSP_NORM_NATURAL, KSP_NORM_PRECONDITIONED, KSP_NORM_UNPRECONDITIONED, KSP_NORM_NONE}) {
    for (int guess = 0; guess < 2; guess++) {
      const PetscReal    tolerance = spec.jump == 1.0 ? 1e-10 : 1e-5;
      Column             b, x, expected;
      KSPConvergedReason reason;
      PetscInt           steps;

      Case("%s, norm %s, guess %d", spec.name, KSPNormTypes[type], guess);
      PetscCall(KSPSetNormType(p.ksp, type));
      PetscCall(KSPSetTolerances(p.ksp, PETSC_DEFAULT, PETSC_DEFAULT, 1e10, PETSC_DEFAULT)); /* a bad guess for a stiff body is no divergence */
      if (type == KSP_NORM_NONE) {                                                           /* the last of the list */
        PetscCall(KSPSetConvergenceTest(p.ksp, KSPConvergedSkip, NULL, NULL));
        /* as many steps as Ker C has dimensions and some more, not so many that nothing but rounding is left of r' z */
        PetscCall(KSPSetTolerances(p.ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, spec.n + 2));
      }
      PetscCall(KSPMonitorCancel(p.ksp));
      if (!guess && spec.jump == 1.0 && type != KSP_NORM_NONE) PetscCall(KSPMonitorSet(p.ksp, Watch, &p, NULL));
      PetscCall(KSPSetInitialGuessNonzero(p.ksp, (PetscBool)guess));
      PetscCall(SetRandom(p.x, 50));
      PetscCall(KSPSolve(p.ksp, p.b, p.x));
      PetscCall(KSPGetConvergedReason(p.ksp, &reason));
      PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
      PetscCall(Gather(p.b, b));
      PetscCall(Gather(p.x, x));
      expected = p.reduced.fullPivLu().solve(b);
      PetscCall(CheckEqual("x", x, expected, tolerance));
      if (type != KSP_NORM_NONE && guess && spec.jump == 1.0) { /* the solution as its own guess */
        PetscCall(KSPSetTolerances(p.ksp, 1e-8, PETSC_DEFAULT, PETSC_DEFAULT, 1000));
        PetscCall(KSPSolve(p.ksp, p.b, p.x));
        PetscCall(KSPGetIterationNumber(p.ksp, &steps));
        PetscCall(CheckInt("steps from the solution", steps, 0));
        PetscCall(KSPSetTolerances(p.ksp, 1e-13, PETSC_DEFAULT, PETSC_DEFAULT, 1000));
      }
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
  PC                     pc;
  PetscInt               count;
  PetscReal              real[64], imaginary[64], high, low;
  std::vector<PetscReal> spectrum;

  PetscFunctionBeginUser;
  spec.n = 14;
  Case("eigenvalues with %s", pctype);
  PetscCall(ProblemCreate(spec, false, &p));
  PetscCall(KSPGetPC(p.ksp, &pc));
  PetscCall(PCSetType(pc, pctype));
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
  for (PetscInt k = 0; k < count; k++) PetscCall(CheckTrue("estimates are real and in order", imaginary[k] == 0.0 && (!k || real[k - 1] <= real[k])));
  PetscCall(CheckError("too little room", [&p, &real, &imaginary, &count]() { return KSPComputeEigenvalues(p.ksp, 1, real, imaginary, &count); },
                       PETSC_ERR_ARG_SIZ, {"eigenvalues"}));
  PetscCall(ProblemDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One product with A, one preconditioner, two solves with S per iteration */
static PetscErrorCode Costs()
{
  const PetscInt steps[2] = {4, 11}; /* with a measurement of the drift between them */
  Spec           spec;
  Problem        p;
  PC             pc;
  PetscReal      factor = 1.0;
  PetscInt       before, after, taken, solves[2], products2[2], preconditioned2[2];

  PetscFunctionBeginUser;
  Case("costs");
  PetscCall(ProblemCreate(spec, true, &p));
  PetscCall(KSPGetPC(p.ksp, &pc));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetApply(pc, CountedApply));
  PetscCall(PCShellSetContext(pc, &factor));
  PetscCall(MatAinsworthMultProjector(p.S, p.b, p.x)); /* the set-up comes before the counting */
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
  PetscCall(CheckInt("applications of the preconditioner", preconditioned2[1] - preconditioned2[0], steps[1] - steps[0]));
  PetscCall(CheckInt("solves with S", solves[1] - solves[0], 2 * (steps[1] - steps[0])));
  PetscCall(CheckInt("products with A before the first step", products2[0] - steps[0], 0));
  PetscCall(ProblemDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As many iterations as CG on the same operator where the penalty fits it */
static PetscErrorCode PlainCG()
{
  Spec     spec;
  Problem  p;
  PetscInt steps[2];

  PetscFunctionBeginUser;
  Case("against KSPCG");
  spec.n = 120;
  PetscCall(ProblemCreate(spec, false, &p));
  PetscCall(KSPSetTolerances(p.ksp, 1e-8, PETSC_DEFAULT, PETSC_DEFAULT, 1000));
  for (int run = 0; run < 2; run++) {
    PetscCall(KSPSetType(p.ksp, run ? KSPCG : KSPPROJECTEDCG));
    PetscCall(KSPSetNormType(p.ksp, KSP_NORM_NATURAL));
    PetscCall(KSPSolve(p.ksp, p.b, p.x));
    PetscCall(KSPGetIterationNumber(p.ksp, &steps[run]));
  }
  PetscCall(Check("steps of KSPPROJECTEDCG", (PetscReal)steps[0], (PetscReal)steps[1]));
  PetscCall(Check("steps of KSPCG", (PetscReal)steps[1], (PetscReal)(steps[0] + 8))); /* m = 5 more eigenvalues */
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
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
