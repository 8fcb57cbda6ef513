#include "report.h"
#include "observed.h"
#include "../base/guard.h"
#include "../base/layouts.h"
#include "../base/objects.h"
#include "../projection/inkernel.h"

/* Creates the exact solution of the reduced system from a reference, which is x alone or the whole solution */
static PetscErrorCode CreateExact(const AinsworthReportSystem *system, Vec reference, Vec *exact)
{
  MPI_Comm   comm = PetscObjectComm((PetscObject)system->A);
  PetscInt   size, n, start, end;
  IS         field = system->primal;
  VecScatter scatter;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(system->A, exact, NULL));
  PetscCall(VecGetSize(*exact, &n));
  PetscCall(VecGetSize(reference, &size));
  PetscCheck(size == n || size == system->size, comm, PETSC_ERR_ARG_SIZ,
             "The reference solution has %" PetscInt_FMT " entries: it must have %" PetscInt_FMT
             " (x and the multipliers) or %" PetscInt_FMT " (x alone); give another file to -pc_ainsworth_reference",
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

PetscErrorCode AinsworthReportCreate(AinsworthReportSettings *settings, const AinsworthReportSystem *system,
                                     AinsworthReport **out)
{
  AinsworthReport *report  = new AinsworthReport();
  const PetscBool  monitor = settings->viewer ? PETSC_TRUE : PETSC_FALSE;

  PetscFunctionBegin;
  *out             = report;
  report->settings = settings;
  report->system   = *system;
  if (monitor && settings->reference) PetscCall(CreateExact(system, settings->reference, &report->exact));
  if (monitor) {
    PetscCall(AinsworthCreateVecs(system->A, report->exact ? &report->x : NULL, &report->r));
    if (system->reduced) PetscCall(AinsworthCreateVecs(system->C, NULL, &report->residual));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthReportDestroy(AinsworthReport **out)
{
  AinsworthReport *report = *out;

  PetscFunctionBegin;
  if (!report) PetscFunctionReturn(PETSC_SUCCESS);
  for (Vec *v : {&report->exact, &report->x, &report->r, &report->residual, &report->work[0], &report->work[1],
                 &report->springs.primal, &report->springs.dual})
    PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&report->observed));
  PetscCall(MatDestroy(&report->operation));
  delete report;
  *out = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets alpha of the last step, and r' z */
static PetscErrorCode GetCoefficients(AinsworthReport *report, KSP ksp, PetscInt step, PetscReal norm, PetscReal *alpha,
                                      PetscReal *rz)
{
  PetscInt  products;
  PetscReal pAp;

  PetscFunctionBegin;
  PetscCall(AinsworthObservedGet(report->observed, &products, &pAp, &report->observing));
  PetscCheck(products == step, PetscObjectComm((PetscObject)ksp), PETSC_ERR_SUP,
             "The error cannot be estimated from this form of KSPCG: leave out -ksp_cg_single_reduction, or "
             "-pc_ainsworth_monitor_error and "
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
    PetscCall(AinsworthReportResiduals(report, iterate, &row));
    if (report->exact) PetscCall(AinsworthReportTrueError(report, iterate, &row.error));
    report->rows.push_back(row);
    PetscCall(AinsworthReportPrint(report, PETSC_FALSE));
  }
  PetscCall(PetscTime(&end));
  report->spent += end - now;
  PetscCall((*report->converged)(ksp, step, norm, reason, report->test));
  PetscCall(AinsworthReportStop(report, ksp, step, norm, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Determines whether the coefficients of conjugate gradients are available, and whether the residual tolerance is made
   relative to x
*/
static PetscErrorCode ChooseCoefficients(AinsworthReport *report, KSP ksp)
{
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  PetscBool      cg;
  KSPNormType    norm;
  KSPType        type;
  Mat_Ainsworth *ctx = NULL;
  Mat            mat;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPCG, KSPPROJECTEDCG, ""));
  PetscCall(KSPGetNormType(ksp, &norm));
  PetscCall(KSPGetType(ksp, &type));
  PetscCall(KSPGetConvergenceTest(ksp, &converged, NULL, NULL));
  PetscCall(KSPGetOperators(ksp, &mat, NULL));
  PetscCall(AinsworthInKernelIs(mat, &report->kernel));
  if (report->system.reduced) PetscCall(MatAinsworthGetContext_Private(report->system.reduced, &ctx));
  report->watch    = (PetscBool)(report->settings->viewer || report->settings->stop == AINSWORTH_STOP_ENERGY_ERROR);
  report->estimate = (PetscBool)(report->watch && cg && norm == KSP_NORM_NATURAL);
  report->patient  = (PetscBool)(converged == KSPConvergedDefault && norm != KSP_NORM_NONE);
  report->tighten  = (PetscBool)((report->kernel || (ctx && ctx->D)) && report->patient && norm == KSP_NORM_NATURAL);
  if (report->estimate || !report->watch) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(report->settings->stop != AINSWORTH_STOP_ENERGY_ERROR, PetscObjectComm((PetscObject)ksp), PETSC_ERR_SUP,
             "-pc_ainsworth_stop energy_error needs the coefficients of conjugate gradients: the inner KSP is %s with "
             "norm type %s, it must be %s or %s with "
             "-ksp_norm_type natural",
             type, KSPNormTypes[norm], KSPPROJECTEDCG, KSPCG);
  PetscCall(PetscInfo(ksp, "The error of %s with norm type %s is not estimated\n", type, KSPNormTypes[norm]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Puts an observer around the operator of the method, or removes it */
static PetscErrorCode Observe(AinsworthReport *report, KSP ksp, PetscBool begin)
{
  Mat mat, pmat;

  PetscFunctionBegin;
  if (!report->estimate) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetOperators(ksp, &mat, &pmat));
  if (begin) {
    PetscCall(AinsworthShare(mat, &report->operation));
    PetscCall(AinsworthObservedCreate(mat, ksp, &report->observed));
  }
  PetscCall(KSPSetOperators(ksp, begin ? report->observed : report->operation, pmat));
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
    PetscCall(AinsworthReportSizes(report));
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
