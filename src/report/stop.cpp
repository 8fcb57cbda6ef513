/*
   Stopping criteria of the reduced solve: tolerances refer to the energy norm of x, not to that of x - R g, the unknown
   of the solve
*/
#include "report.h"
#include "../projection/inkernel.h"
#include <petsc/private/kspimpl.h> /* rnorm0 and ttol */

/* Relative accuracy of the entries of x: smaller errors need more digits */
static const PetscReal digits = 10 * PETSC_MACHINE_EPSILON;

/*
   AinsworthEnergy - computes |x|_A^2 by a product with A, and the squared energy norm of the rounding of x; x' A x is
   known only up to the rounding of its terms. Collective
*/
PetscErrorCode AinsworthEnergy(Mat A, Vec inverseDiagonal, Vec x, const Vec work[2], PetscReal *energy,
                               PetscReal *rounding)
{
  PetscScalar product, size;
  PetscReal   noise;

  PetscFunctionBegin;
  PetscCall(MatMult(A, x, work[0]));
  PetscCall(VecDot(work[0], x, &product));
  PetscCall(VecPointwiseDivide(work[0], x, inverseDiagonal));
  PetscCall(VecDot(work[0], x, &size));
  PetscCall(VecPointwiseMult(work[1], work[0], x));
  PetscCall(VecNorm(work[1], NORM_2, &noise)); /* the rounding errors of the terms are independent */
  *energy   = PetscMax(PetscRealPart(product), digits * noise);
  *rounding = digits * digits * PetscRealPart(size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for an iterate's x */
static PetscErrorCode Energy(AinsworthReport *report, Vec x, PetscReal *energy, PetscReal *rounding)
{
  const AinsworthReportSystem *system = &report->system;

  PetscFunctionBegin;
  for (Vec &work : report->work) {
    if (!work) PetscCall(VecDuplicate(system->inverseDiagonal, &work));
  }
  PetscCall(AinsworthEnergy(system->A, system->inverseDiagonal, x, report->work, energy, rounding));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the energy of the springs, |lambda|_D^2, if D is nonzero; lambda is that of the last AinsworthReportGetX() */
static PetscErrorCode AddSprings(AinsworthReport *report, const Mat_Ainsworth *ctx, PetscReal *energy)
{
  PetscReal springs = 0.0;

  PetscFunctionBegin;
  if (ctx->D) PetscCall(AinsworthFormValue(ctx->D, report->springs.dual, &springs));
  *energy += springs;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the context of the reduced operator if R g is nonzero, otherwise NULL */
static PetscErrorCode GetStart(const AinsworthReport *report, Mat_Ainsworth **ctx)
{
  PetscFunctionBegin;
  *ctx = NULL;
  if (report->system.reduced) PetscCall(MatAinsworthGetContext_Private(report->system.reduced, ctx));
  if (*ctx && (*ctx)->homogeneous) *ctx = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthReportSmallestRitzValue - gets the smallest Ritz value of conjugate gradients, 0 if their coefficients are
   not kept; collective
*/
PetscErrorCode AinsworthReportSmallestRitzValue(KSP ksp, PetscReal *smallest)
{
  PetscReal largest;
  PetscBool cg, kept;

  PetscFunctionBegin;
  *smallest = 0.0;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPCG, KSPPROJECTEDCG, ""));
  PetscCall(KSPGetComputeSingularValues(ksp, &kept));
  if (!cg || !kept) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPComputeExtremeSingularValues(ksp, &largest, smallest));
  if (largest == -1.0 && *smallest == -1.0) *smallest = 0.0; /* the method was set up without them */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the squared energy norm of x if R g strains what x does not, so that x is much smaller than x - R g = z,
   otherwise that of z; and of the rounding of x

   x' A x = (R g)' A R g - x' b + 2 f' z, despite cancellation, indicates a small x, of which one product with A gives
   the norm; if D is nonzero it is always made
*/
static PetscErrorCode EnergyOfX(AinsworthReport *report, Vec z, PetscReal zAz, PetscReal *energy, PetscReal *rounding)
{
  Mat_Ainsworth *ctx;
  PetscScalar    work;
  Vec            x;

  PetscFunctionBegin;
  *energy   = zAz;
  *rounding = 0.0;
  PetscCall(GetStart(report, &ctx));
  if (!ctx) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDot(z, report->b.primal, &work));
  if (!ctx->D && AinsworthIsLarge(ctx->energy, PetscRealPart(work), zAz)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthReportGetX(report, z, &x));
  PetscCall(Energy(report, x, energy, rounding));
  PetscCall(AddSprings(report, ctx, energy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthResidualBound - returns the residual, in the natural norm, with which the error of x is small relative to x

   PETSc's test compares r with the first residual, that of R g, in the natural norm. With b = Q' (f - A R g), the
   right-hand side in Ker C, and r = b - A z, conjugate gradients have r' z = 0 and z' A z = x' b. The error e of x has
   e' A e <= r' M^{-1} r / theta, theta the smallest eigenvalue, for which that of the Lanczos matrix stands in: where
   the preconditioner is weak it is small, and the residual shows little of the error

   z, energy, rounding: z' A z, and the squared energy norms of x and of its rounding; first: the first residual; ritz:
   the smallest Ritz value, 0 if it is not known
*/
PetscReal AinsworthResidualBound(PetscReal rtol, PetscReal z, PetscReal energy, PetscReal rounding, PetscReal first,
                                 PetscReal ritz)
{
  /* the bound lies above the error, as other eigenvalues are larger (docs/options.md) */
  static const PetscReal above = 2;
  const PetscReal        most = PetscSqr(first) / z, theta = ritz > 0.0 ? PetscMin(PetscSqr(above) * ritz, most) : most;
  const PetscReal        wanted = PetscSqr(rtol) * PetscMin(energy, z);

  return PetscSqrtReal(PetscMax(wanted, rounding) * theta);
}

/* Continues the solve if the residual is small relative to the first one, but the error is not small relative to x */
static PetscErrorCode GoOn(AinsworthReport *report, KSP ksp, PetscInt step, PetscReal norm, KSPConvergedReason *reason)
{
  Vec         x, b;
  PetscScalar dot;
  PetscReal   z, energy, rounding, bound, ritz, rtol, atol;

  PetscFunctionBegin;
  PetscCall(KSPBuildSolution(ksp, NULL, &x));
  PetscCall(KSPGetRhs(ksp, &b));
  PetscCall(KSPGetTolerances(ksp, &rtol, &atol, NULL, NULL));
  PetscCall(VecDot(x, b, &dot));
  z = PetscRealPart(dot);
  if (z <= 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(EnergyOfX(report, x, z, &energy, &rounding));
  PetscCall(AinsworthReportSmallestRitzValue(ksp, &ritz));
  bound = AinsworthResidualBound(rtol, z, energy, rounding, ksp->rnorm0, ritz);
  if (norm <= bound) {
    if (PetscSqr(rtol) * PetscMin(energy, z) >= rounding) PetscFunctionReturn(PETSC_SUCCESS);
    *reason = KSP_CONVERGED_ATOL;
    PetscCall(PetscInfo(ksp,
                        "Converged: the error is as small as rounding of x allows, which is more than %g times the "
                        "energy norm of x, %g\n",
                        (double)rtol, (double)PetscSqrtReal(energy)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!report->wentOn) report->patience = PetscMax(30, step);
  report->wentOn = PETSC_TRUE;
  report->found  = step;
  report->least  = norm;
  *reason        = KSP_CONVERGED_ITERATING;
  /* the test does not report convergence before */
  ksp->ttol = PetscMax(bound, atol);
  PetscCall(PetscInfo(ksp,
                      "The energy norm of x is %g, that of x - R g %g, the smallest Ritz value %g: the residual norm "
                      "has to come down to %g\n",
                      (double)PetscSqrtReal(energy), (double)PetscSqrtReal(z), (double)ritz, (double)ksp->ttol));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Ends the solve if the residual stagnates, long before the limit of iterations

   Multigrid needs tens of iterations; a simple preconditioner, in exact arithmetic, as many as there are unknowns.
   Methods that accumulate rounding errors, especially pipelined ones, may not reach the smaller tolerance of GoOn()
*/
static PetscErrorCode CheckStagnation(AinsworthReport *report, KSP ksp, PetscInt step, PetscReal norm,
                                      KSPConvergedReason *reason)
{
  PetscFunctionBegin;
  if (norm < report->least / 2) {
    report->least = norm;
    report->found = step;
  }
  if (step - report->found < report->patience) PetscFunctionReturn(PETSC_SUCCESS);
  *reason = KSP_DIVERGED_BREAKDOWN;
  PetscCall(PetscInfo(ksp, "The residual norm %g has not fallen by half for %" PetscInt_FMT " iterations%s\n",
                      (double)norm, report->patience,
                      report->wentOn ? ": a tolerance relative to x is out of reach" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the number of iterations that CheckStagnation() allows */
PetscErrorCode AinsworthReportSetPatience(AinsworthReport *report, KSP ksp)
{
  static const PetscInt usual = 1000,
                        /*
                           rounding delays the n-th step, with which Krylov methods end; ten times is plenty on 10^5
                           random systems
                        */
    rounds = 10;
  PetscBool multigrid;
  PetscInt  n;
  PC        pc;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(AinsworthGetInnermostPC(pc, &pc));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &multigrid, PCBLOCKSA, PCHYPRE, PCGAMG, PCML, PCMG, ""));
  PetscCall(VecGetSize(report->system.inverseDiagonal, &n));
  report->patience = multigrid || n <= usual ? PetscMin(usual, rounds * n) : n;
  report->least    = PETSC_MAX_REAL;
  report->found    = 0;
  report->wentOn   = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether the error is small enough in the energy norm; for R g != 0, x is multiplied by A only if the error
   would do for the largest possible x
*/
static PetscErrorCode ErrorReached(AinsworthReport *report, KSP ksp, bool *reached)
{
  const AinsworthEstimator *e    = &report->estimator;
  const PetscReal           rtol = report->settings->rtol, fallen = AinsworthEstimatorLower(e, 0);
  Mat_Ainsworth            *ctx;
  PetscBool                 guess;
  PetscReal                 most, energy, rounding;
  Vec                       x;

  PetscFunctionBegin;
  PetscCall(GetStart(report, &ctx));
  PetscCall(KSPGetInitialGuessNonzero(ksp, &guess));
  most     = guess ? PETSC_MAX_REAL : rtol * (fallen + (ctx ? PetscSqrtReal(PetscMax(ctx->energy, 0.0)) : 0.0));
  *reached = AinsworthEstimatorReached(e, PetscMin(most, report->bound));
  if (!*reached || (!guess && !ctx)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPBuildSolution(ksp, NULL, &x));
  PetscCall(AinsworthReportGetX(report, x, &x));
  PetscCall(Energy(report, x, &energy, &rounding));
  if (ctx) PetscCall(AddSprings(report, ctx, &energy));
  report->energy = PetscSqrtReal(energy);
  /* |x|_A is at least that of the iterate minus the error */
  report->bound = PetscSqrtReal(PetscMax(PetscSqr(rtol / (1 + rtol)) * energy, rounding));
  *reached      = AinsworthEstimatorReached(e, report->bound);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthReportStop(AinsworthReport *report, KSP ksp, PetscInt step, PetscReal norm,
                                   KSPConvergedReason *reason)
{
  bool reached = false;

  PetscFunctionBegin;
  if (report->settings->stop != AINSWORTH_STOP_ENERGY_ERROR) {
    if (report->tighten && step && *reason == KSP_CONVERGED_RTOL) PetscCall(GoOn(report, ksp, step, norm, reason));
    if (report->patient && *reason == KSP_CONVERGED_ITERATING)
      PetscCall(CheckStagnation(report, ksp, step, norm, reason));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (*reason == KSP_CONVERGED_RTOL) *reason = KSP_CONVERGED_ITERATING;
  if (*reason != KSP_CONVERGED_ITERATING) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ErrorReached(report, ksp, &reached));
  if (!reached) PetscFunctionReturn(PETSC_SUCCESS);
  *reason = KSP_CONVERGED_RTOL;
  PetscCall(PetscInfo(ksp, "Converged: the energy norm of the error was %g at iteration %" PetscInt_FMT " already\n",
                      (double)AinsworthEstimatorLower(&report->estimator, report->estimator.accurate - 1),
                      report->estimator.accurate - 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}
