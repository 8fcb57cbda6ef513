/* Errors of an iterate: residuals, the error of x where the solution is known, that of the multipliers */
#include "report.h"
#include "../base/layouts.h"

PetscErrorCode AinsworthReportGetX(AinsworthReport *report, Vec iterate, Vec *x)
{
  Mat_Ainsworth *ctx = NULL;

  PetscFunctionBegin;
  *x = iterate;
  if (report->system.reduced) PetscCall(MatAinsworthGetContext_Private(report->system.reduced, &ctx));
  if (!ctx || !(ctx->D || report->kernel) || (report->kernel && ctx->homogeneous)) PetscFunctionReturn(PETSC_SUCCESS);
  if (!report->springs.primal) PetscCall(AinsworthCreateVecs(ctx->C, &report->springs.primal, &report->springs.dual));
  PetscCall(VecCopy(iterate, report->springs.primal));
  *x = report->springs.primal;
  if (ctx->D)
    PetscCall(
      MatAinsworthRecover_Private(report->system.reduced, PETSC_FALSE, PETSC_FALSE, report->b, report->springs, NULL));
  else PetscCall(MatAinsworthComplete_Private(report->system.reduced, report->b.dual, *x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes the 2-norm by VecDot(): VecNorm() would cache norms of other types in a subvector, which PETSc 3.18 takes
   for known zeros
*/
static PetscErrorCode Length(Vec v, PetscReal *length)
{
  PetscScalar square;

  PetscFunctionBegin;
  PetscCall(VecDot(v, v, &square));
  *length = PetscSqrtReal(PetscRealPart(square));
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

/*
   Gets the norms of f and g and, where the solution is known, its energy norm and the norm of C' lambda: errors are
   relative to them
*/
PetscErrorCode AinsworthReportSizes(AinsworthReport *report)
{
  PetscScalar energy;

  PetscFunctionBegin;
  PetscCall(Length(report->b.primal, &report->norm[0]));
  if (report->system.reduced) PetscCall(Length(report->b.dual, &report->norm[1]));
  if (!report->exact) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatMult(report->system.A, report->exact, report->r));
  PetscCall(VecDot(report->r, report->exact, &energy));
  report->energy = PetscSqrtReal(PetscAbsScalar(energy));
  PetscCall(VecAYPX(report->r, -1.0, report->b.primal));
  PetscCall(ForceNorm(report, report->r, &report->held));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes the error of C' lambda, C' (lambda_k - lambda) = A (x - x_k) - r, relative to it; redundant rows leave
   lambda open, but not C' lambda. r is kept
*/
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

/*
   Computes ||f - A x - C' lambda|| / ||f|| with lambda = R' (f - A x), ||g - C x|| / ||g||, and the energy norm of x;
   absolute if f or g is zero
*/
PetscErrorCode AinsworthReportResiduals(AinsworthReport *report, Vec iterate, AinsworthReportRow *row)
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

/*
   Computes sqrt((x - x_k)' A~ (x - x_k)), with A in place of A~ in Ker C, where they agree; excludes the energy of
   springs
*/
PetscErrorCode AinsworthReportTrueError(AinsworthReport *report, Vec iterate, PetscReal *error)
{
  PetscScalar square;
  Vec         x;

  PetscFunctionBegin;
  PetscCall(AinsworthReportGetX(report, iterate, &x));
  PetscCall(VecWAXPY(report->x, -1.0, x, report->exact));
  PetscCall(
    MatMult(report->system.reduced && !report->kernel && x == iterate ? report->system.reduced : report->system.A,
            report->x, report->r));
  PetscCall(VecDot(report->r, report->x, &square));
  *error = PetscSqrtReal(PetscAbsScalar(square));
  PetscFunctionReturn(PETSC_SUCCESS);
}
