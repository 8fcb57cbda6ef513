#include "report.h"
#include "observed.h"
#include "../guard.h"
#include "../objects.h"
#include "../ksp/projectedcg.h"

/* Creates the exact solution of the reduced system from a reference, which is x alone or the whole solution */
static PetscErrorCode CreateExact(const AinsworthReportSystem *system, Vec reference, Vec *exact)
{
  MPI_Comm   comm = PetscObjectComm((PetscObject)system->A);
  PetscInt   size, n, start, end;
  IS         field = system->primal;
  VecScatter scatter;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(system->A, exact, NULL));
  PetscCall(VecGetSize(*exact, &n));
  PetscCall(VecGetSize(reference, &size));
  PetscCheck(size == n || size == system->size, comm, PETSC_ERR_ARG_SIZ,
             "The reference solution has %" PetscInt_FMT " entries: it must have %" PetscInt_FMT " (x and the multipliers) or %" PetscInt_FMT
             " (x alone); give another file to -pc_ainsworth_reference",
             size, system->size, n);
  PetscCall(VecGetOwnershipRange(*exact, &start, &end));
  if (size == n) PetscCall(ISCreateStride(comm, end - start, start, 1, &field));
  PetscCall(VecScatterCreate(reference, field, *exact, NULL, &scatter));
  PetscCall(VecScatterBegin(scatter, reference, *exact, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, reference, *exact, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterDestroy(&scatter));
  if (size == n) PetscCall(ISDestroy(&field));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthReportCreate(AinsworthReportSettings *settings, const AinsworthReportSystem *system, AinsworthReport **out)
{
  AinsworthReport *report  = new AinsworthReport();
  const PetscBool  monitor = settings->viewer ? PETSC_TRUE : PETSC_FALSE;

  PetscFunctionBegin;
  *out             = report;
  report->settings = settings;
  report->system   = *system;
  if (monitor && settings->reference) PetscCall(CreateExact(system, settings->reference, &report->exact));
  if (monitor) {
    PetscCall(MatCreateVecs(system->A, report->exact ? &report->x : NULL, &report->r));
    if (system->reduced) PetscCall(MatCreateVecs(system->C, NULL, &report->residual));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthReportDestroy(AinsworthReport **out)
{
  AinsworthReport *report = *out;

  PetscFunctionBegin;
  if (!report) PetscFunctionReturn(PETSC_SUCCESS);
  for (Vec *v : {&report->exact, &report->x, &report->r, &report->residual, &report->work[0], &report->work[1], &report->springs.primal, &report->springs.dual})
    PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&report->observed));
  PetscCall(MatDestroy(&report->operation));
  delete report;
  *out = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the 2-norm by VecDot(): VecNorm() would cache norms of other types in a subvector, which PETSc 3.18 takes for known zeros */
static PetscErrorCode Length(Vec v, PetscReal *length)
{
  PetscScalar square;

  PetscFunctionBegin;
  PetscCall(VecDot(v, v, &square));
  *length = PetscSqrtReal(PetscRealPart(square));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthReportGetX(AinsworthReport *report, Vec iterate, Vec *x)
{
  Mat_Ainsworth *ctx = NULL;

  PetscFunctionBegin;
  *x = iterate;
  if (report->system.reduced) PetscCall(MatAinsworthGetContext_Private(report->system.reduced, &ctx));
  if (!ctx || !ctx->D) PetscFunctionReturn(PETSC_SUCCESS);
  if (!report->springs.primal) PetscCall(MatCreateVecs(ctx->C, &report->springs.primal, &report->springs.dual));
  PetscCall(VecCopy(iterate, report->springs.primal));
  PetscCall(MatAinsworthRecover_Private(report->system.reduced, PETSC_FALSE, report->b, report->springs, NULL));
  *x = report->springs.primal;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes f - A x - B' lambda, in place of f - A x, and g - C x + D lambda, with x and lambda of this iterate */
static PetscErrorCode LeaveMultipliers(AinsworthReport *report, Vec x)
{
  Mat            reduced = report->system.reduced;
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(reduced, &ctx));
  PetscCall(MatMult(report->system.C, x, report->residual));
  PetscCall(VecAYPX(report->residual, -1.0, report->b.dual));
  if (ctx->D) {
    PetscCall(VecScale(report->springs.dual, -1.0));
    PetscCall(MatMultHermitianTransposeAdd(ctx->B, report->springs.dual, report->r, report->r));
    PetscCall(VecScale(report->springs.dual, -1.0));
    PetscCall(MatMultAdd(ctx->D, report->springs.dual, report->residual, report->residual));
  } else PetscCall(MatAinsworthMultTransposeProjector(reduced, report->r, report->r)); /* r - B' R' r */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the norm of a force, of diag(A)^{-1}, in which it counts by the motion that it causes */
static PetscErrorCode ForceNorm(AinsworthReport *report, Vec force, PetscReal *norm)
{
  PetscScalar square;

  PetscFunctionBegin;
  if (!report->work[0]) PetscCall(VecDuplicate(force, &report->work[0]));
  PetscCall(VecPointwiseMult(report->work[0], report->system.inverseDiagonal, force));
  PetscCall(VecDot(report->work[0], force, &square));
  *norm = PetscSqrtReal(PetscAbsScalar(square));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the error of C' lambda, C' (lambda_k - lambda) = A (x - x_k) - r, relative to it; redundant rows leave lambda open, but not C' lambda. r is kept */
static PetscErrorCode MultiplierError(AinsworthReport *report, Vec x, PetscReal *error)
{
  Vec force;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(x, &force));
  PetscCall(VecWAXPY(report->x, -1.0, x, report->exact));
  PetscCall(MatMult(report->system.A, report->x, force));
  PetscCall(VecAXPY(force, -1.0, report->r));
  PetscCall(ForceNorm(report, force, error));
  if (report->held > 0.0) *error /= report->held;
  PetscCall(VecDestroy(&force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes ||f - A x - C' lambda|| / ||f|| with lambda = R' (f - A x), ||g - C x|| / ||g||, and the energy norm of x; absolute if f or g is zero */
static PetscErrorCode Residuals(AinsworthReport *report, Vec iterate, AinsworthReportRow *row)
{
  const AinsworthReportSystem *system = &report->system;
  PetscScalar                  energy;
  Vec                          x;

  PetscFunctionBegin;
  PetscCall(AinsworthReportGetX(report, iterate, &x));
  PetscCall(MatMult(system->A, x, report->r));
  PetscCall(VecDot(report->r, x, &energy));
  if (!report->exact) report->energy = PetscSqrtReal(PetscAbsScalar(energy));
  PetscCall(VecAYPX(report->r, -1.0, report->b.primal));
  if (system->reduced) {
    PetscCall(LeaveMultipliers(report, x));
    if (report->exact) PetscCall(MultiplierError(report, x, &row->multipliers));
    PetscCall(VecNorm(report->residual, NORM_2, &row->constraint));
    if (report->norm[1] > 0.0) row->constraint /= report->norm[1];
  } else row->constraint = 0.0;
  PetscCall(VecNorm(report->r, NORM_2, &row->primal));
  if (report->norm[0] > 0.0) row->primal /= report->norm[0];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes sqrt((x - x_k)' A~ (x - x_k)), with A in place of A~ in Ker C, where they agree; excludes the energy of springs */
static PetscErrorCode TrueError(AinsworthReport *report, Vec iterate, PetscReal *error)
{
  PetscScalar square;
  Vec         x;

  PetscFunctionBegin;
  PetscCall(AinsworthReportGetX(report, iterate, &x));
  PetscCall(VecWAXPY(report->x, -1.0, x, report->exact));
  PetscCall(MatMult(report->system.reduced && !report->kernel && x == iterate ? report->system.reduced : report->system.A, report->x, report->r));
  PetscCall(VecDot(report->r, report->x, &square));
  *error = PetscSqrtReal(PetscAbsScalar(square));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets alpha of the last step, and r' z */
static PetscErrorCode GetCoefficients(AinsworthReport *report, KSP ksp, PetscInt step, PetscReal norm, PetscReal *alpha, PetscReal *rz)
{
  PetscInt  products;
  PetscReal pAp;

  PetscFunctionBegin;
  PetscCall(AinsworthObservedGet(report->observed, &products, &pAp, &report->observing));
  PetscCheck(products == step, PetscObjectComm((PetscObject)ksp), PETSC_ERR_SUP,
             "The error cannot be estimated from this form of KSPCG: leave out -ksp_cg_single_reduction, or -pc_ainsworth_monitor_error and "
             "-pc_ainsworth_stop energy_error");
  *rz    = norm * norm;
  *alpha = step ? report->estimator.rz / pAp : 0.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Records an iteration; replaces the convergence test of the KSP, and calls it */
static PetscErrorCode Record(KSP ksp, PetscInt step, PetscReal norm, KSPConvergedReason *reason, void *ctx)
{
  AinsworthReport   *report = (AinsworthReport *)ctx;
  AinsworthReportRow row    = {NAN, NAN, NAN, NAN, NAN, NAN};
  PetscLogDouble     now, end;
  PetscReal          alpha = 0.0, rz = 0.0;
  Vec                iterate;

  PetscFunctionBegin;
  PetscCall(PetscTime(&now));
  if (report->estimate) {
    PetscCall(GetCoefficients(report, ksp, step, norm, &alpha, &rz));
    if (step == 0) AinsworthEstimatorStart(&report->estimator, PetscMax(report->settings->eigenvalue, 0.0), rz);
    else AinsworthEstimatorStep(&report->estimator, alpha, rz);
    row.natural = PetscSqrtReal(rz);
  }
  if (report->settings->viewer) {
    row.seconds = now - report->start - report->spent - report->observing;
    PetscCall(KSPBuildSolution(ksp, NULL, &iterate));
    PetscCall(Residuals(report, iterate, &row));
    if (report->exact) PetscCall(TrueError(report, iterate, &row.error));
    report->rows.push_back(row);
    PetscCall(AinsworthReportPrint(report, PETSC_FALSE));
  }
  PetscCall(PetscTime(&end));
  report->spent += end - now;
  PetscCall((*report->converged)(ksp, step, norm, reason, report->test));
  PetscCall(AinsworthReportStop(report, ksp, step, norm, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Determines whether the coefficients of conjugate gradients are available, and whether the residual tolerance is made relative to x */
static PetscErrorCode ChooseCoefficients(AinsworthReport *report, KSP ksp)
{
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  PetscBool      cg;
  KSPNormType    norm;
  KSPType        type;
  Mat_Ainsworth *ctx = NULL;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPCG, KSPPROJECTEDCG, ""));
  PetscCall(KSPGetNormType(ksp, &norm));
  PetscCall(KSPGetType(ksp, &type));
  PetscCall(KSPGetConvergenceTest(ksp, &converged, NULL, NULL));
  PetscCall(KSPProjectedCGGetUse_Private(ksp, &report->kernel));
  if (report->system.reduced) PetscCall(MatAinsworthGetContext_Private(report->system.reduced, &ctx));
  report->watch    = (PetscBool)(report->settings->viewer || report->settings->stop == AINSWORTH_STOP_ENERGY_ERROR);
  report->estimate = (PetscBool)(report->watch && cg && norm == KSP_NORM_NATURAL);
  report->patient  = (PetscBool)(converged == KSPConvergedDefault && norm != KSP_NORM_NONE);
  report->tighten  = (PetscBool)((report->kernel || (ctx && ctx->D)) && report->patient && norm == KSP_NORM_NATURAL);
  if (report->estimate || !report->watch) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(report->settings->stop != AINSWORTH_STOP_ENERGY_ERROR, PetscObjectComm((PetscObject)ksp), PETSC_ERR_SUP,
             "-pc_ainsworth_stop energy_error needs the coefficients of conjugate gradients: the inner KSP is %s with norm type %s, it must be %s or %s with "
             "-ksp_norm_type natural",
             type, KSPNormTypes[norm], KSPPROJECTEDCG, KSPCG);
  PetscCall(PetscInfo(ksp, "The error of %s with norm type %s is not estimated\n", type, KSPNormTypes[norm]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Puts an observer around the operator of the method, or removes it */
static PetscErrorCode Observe(AinsworthReport *report, KSP ksp, PetscBool begin)
{
  Mat            mat, pmat;
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  if (!report->estimate) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetOperators(ksp, &mat, &pmat));
  if (begin) {
    if (report->kernel) {
      PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
      mat = ctx->product ? ctx->product : ctx->A;
    }
    PetscCall(AinsworthShare(mat, &report->operation));
    PetscCall(AinsworthObservedCreate(mat, ksp, &report->observed));
  }
  if (report->kernel) PetscCall(MatAinsworthSetProduct_Private(report->system.reduced, begin ? report->observed : report->operation));
  else PetscCall(KSPSetOperators(ksp, begin ? report->observed : report->operation, pmat));
  if (!begin) {
    PetscCall(MatDestroy(&report->operation));
    PetscCall(MatDestroy(&report->observed));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Watches the next solve until AinsworthReportEnd(), which restores the KSP */
PetscErrorCode AinsworthReportBegin(AinsworthReport *report, KSP ksp, AinsworthSaddleVec b, PetscLogDouble start)
{
  PetscLogDouble before, after;
  PetscScalar    energy;

  PetscFunctionBegin;
  PetscCall(PetscTime(&before));
  PetscCall(ChooseCoefficients(report, ksp));
  if (!report->watch && !report->patient) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthReportSetPatience(report, ksp));
  report->b = b;
  report->rows.clear();
  report->printed = 0;
  report->spent = report->observing = 0.0;
  report->bound                     = PETSC_MAX_REAL;
  if (report->settings->viewer) {
    PetscCall(Length(b.primal, &report->norm[0]));
    if (report->system.reduced) PetscCall(Length(b.dual, &report->norm[1]));
    if (report->exact) {
      PetscCall(MatMult(report->system.A, report->exact, report->r));
      PetscCall(VecDot(report->r, report->exact, &energy));
      report->energy = PetscSqrtReal(PetscAbsScalar(energy));
      PetscCall(VecAYPX(report->r, -1.0, b.primal));
      PetscCall(ForceNorm(report, report->r, &report->held));
    }
    PetscCall(AinsworthReportHeader(report));
  }
  PetscCall(Observe(report, ksp, PETSC_TRUE));
  PetscCall(KSPGetAndClearConvergenceTest(ksp, &report->converged, &report->test, &report->destroy));
  PetscCall(KSPSetConvergenceTest(ksp, AinsworthGuarded<Record>, report, NULL));
  report->installed = PETSC_TRUE;
  PetscCall(PetscTime(&after));
  report->start = start + after - before;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Shows the last rows, unless the solve failed with an error, and restores the KSP in any case */
PetscErrorCode AinsworthReportEnd(AinsworthReport *report, KSP ksp, PetscBool failed)
{
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  AinsworthTestDestroyFn *destroy;
  void                   *test;

  PetscFunctionBegin;
  if (!report->installed) PetscFunctionReturn(PETSC_SUCCESS);
  report->installed = PETSC_FALSE;
  PetscCall(KSPGetAndClearConvergenceTest(ksp, &converged, &test, &destroy));
  PetscCall(KSPSetConvergenceTest(ksp, report->converged, report->test, report->destroy));
  PetscCall(Observe(report, ksp, PETSC_FALSE));
  if (report->settings->viewer && !failed) {
    PetscCall(AinsworthReportPrint(report, PETSC_TRUE));
    PetscCall(AinsworthReportDraw(report));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
