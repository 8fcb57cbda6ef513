/* Application of PCAINSWORTH: kept rows, reduced solve (operator/matdoors.cpp, ksp/), x and lambda, and residuals of both equations */
#include "pcainsworth.h"
#include "../hermitian.h"
#include "../operator/matainsworth.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>
#include <petsctime.h>

/*
   Replaces a reduced right-hand side by zero if it is nothing but the rounding of the forces f and A R g that were projected out of it

   Constraints alone balance these forces then. In the norm of diag(A)^{-1} a force counts by the motion that it causes, and A R g by the energy of R g
*/
static PetscErrorCode ForgetRounding(const PC_Ainsworth *data, Vec f)
{
  PetscReal      norms[2];
  Mat_Ainsworth *ctx;
  Vec            work;

  PetscFunctionBegin;
  if (!data->constraints || data->saddle.D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAinsworthGetContext_Private(data->reduced, &ctx));
  PetscCall(VecDuplicate(f, &work));
  for (int k = 0; k < 2; k++) {
    const Vec   v = k ? f : data->rhs;
    PetscScalar square;

    PetscCall(VecPointwiseMult(work, data->inverseDiagonal, v));
    PetscCall(VecDot(work, v, &square));
    norms[k] = PetscSqrtReal(PetscAbsScalar(square));
  }
  PetscCall(VecDestroy(&work));
  if (norms[0] <= AinsworthLeast * (norms[1] + PetscSqrtReal(PetscAbsReal(ctx->start[0])))) PetscCall(VecZeroEntries(data->rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Solves the reduced system for f and g, again as long as the preconditioner is replaced

   watched: the report sees the solve, and its stop refers to x. The report restores the KSP also after an error, which is raised then
*/
static PetscErrorCode SolveInner(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched, AinsworthSaddleVec b, Vec x, KSPConvergedReason *reason)
{
  PetscBool again = PETSC_TRUE;

  PetscFunctionBegin;
  while (again) {
    PetscLogDouble start;
    PetscErrorCode error;

    PetscCall(PetscTime(&start));
    if (data->constraints) PetscCall(MatAinsworthReduce_Private(data->reduced, transpose, b.primal, b.dual, data->rhs));
    else PetscCall(VecCopy(b.primal, data->rhs));
    PetscCall(ForgetRounding(data, b.primal));
    if (watched) PetscCall(PCAinsworthReportBegin_Private(pc, data, b, start));
    PetscCall(PCAinsworthEscapeBegin_Private(pc, data));
    PetscCall(PCAinsworthKeepCoefficients_Private(data));
    error = transpose ? KSPSolveTranspose(data->ksp, data->rhs, x) : KSPSolve(data->ksp, data->rhs, x);
    PetscCall(PCAinsworthEscapeEnd_Private(data));
    if (watched && data->report) PetscCall(AinsworthReportEnd(data->report, data->ksp, (PetscBool)(error != PETSC_SUCCESS)));
    PetscCall(error);
    PetscCall(PCAinsworthEscape_Private(pc, data, &again));
  }
  PetscCall(PCAinsworthGetReason_Private(data, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls SolveInner(), a second time with a new preconditioner if that of an earlier matrix does not help */
static PetscErrorCode SolveOrRebuild(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched, AinsworthSaddleVec b, Vec x, KSPConvergedReason *reason)
{
  KSP       ksp = data->ksp;
  PetscInt  limit, most = ksp->max_it;
  PetscBool strict = ksp->errorifnotconverged;

  PetscFunctionBegin;
  PetscCall(PCAinsworthLimit_Private(pc, data, &limit));
  if (limit) {
    PetscErrorCode error;

    ksp->max_it              = limit;
    ksp->errorifnotconverged = PETSC_FALSE;
    error                    = SolveInner(pc, data, transpose, watched, b, x, reason); /* checked when everything is restored */
    ksp->max_it              = most;
    ksp->errorifnotconverged = strict;
    PetscCall(error);
    if (*reason < 0 && !data->failure[0]) PetscCall(PCAinsworthRebuild_Private(pc, data));
    if (data->failure[0]) *reason = KSP_DIVERGED_PC_FAILED;
  }
  if (!limit || (*reason < 0 && !data->failure[0])) PetscCall(SolveInner(pc, data, transpose, watched, b, x, reason));
  if (*reason > 0 && watched) PetscCall(PCAinsworthCount_Private(data)); /* refinements do not predict other solves */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves for x and lambda by the reduced system, all on kept rows; transpose: with the transpose of A */
static PetscErrorCode SolveReduced(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                   KSPConvergedReason *reason)
{
  PetscInt n;

  PetscFunctionBegin;
  data->knownAx = (PetscBool)(data->constraints && data->saddle.A == data->saddle.block[AINSWORTH_BLOCK_A] && !data->saddle.known);
  PetscCall(VecGetSize(y.primal, &n));
  *reason = KSP_CONVERGED_HAPPY_BREAKDOWN;
  if (data->constraints == n && !data->saddle.D) PetscCall(VecZeroEntries(y.primal)); /* Ker C = 0: the constraints alone determine x */
  else if (!data->whole) PetscCall(SolveOrRebuild(pc, data, transpose, watched, b, y.primal, reason));
  if (data->whole) { /* at once, or because the reduced solve was given up for it */
    data->knownAx = PETSC_FALSE;
    *reason       = KSP_CONVERGED_RTOL;
    PetscCall(AinsworthWholeSolve(data->whole, transpose, b, y));
  } else if (data->constraints) PetscCall(MatAinsworthRecover_Private(data->reduced, transpose, b, y, data->knownAx ? data->Ax : NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Restricts the program's fields to the kept rows, solves, and extends the solution */
static PetscErrorCode SolveFields(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                  KSPConvergedReason *reason)
{
  PetscFunctionBegin;
  if (data->g) {
    const AinsworthSaddleVec kept = {data->f ? data->f : b.primal, data->g};

    PetscCall(AinsworthSaddleRestrict(&data->saddle, b, kept));
    PetscCall(SolveReduced(pc, data, transpose, watched, kept, {y.primal, data->lambda}, reason));
    PetscCall(AinsworthSaddleExtend(&data->saddle, b, data->lambda, y));
  } else PetscCall(SolveReduced(pc, data, transpose, watched, b, y, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves for what an earlier solve left, to a relative tolerance of at least `loose`; stopped: rounding ended that one, so that this may not last longer */
static PetscErrorCode SolveLoosely(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool stopped, PetscReal loose, AinsworthSaddleVec left,
                                   AinsworthSaddleVec p)
{
  const PetscInt     its   = data->ksp->its;
  const PetscReal    rnorm = data->ksp->rnorm;
  PetscReal          rtol, atol, dtol;
  PetscInt           limit;
  PetscBool          removed;
  PetscErrorCode     error;
  KSPConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(VecZeroEntries(p.primal));
  PetscCall(KSPGetTolerances(data->ksp, &rtol, &atol, &dtol, &limit));
  PetscCall(KSPSetTolerances(data->ksp, PetscMax(rtol, loose), atol, dtol, stopped ? PetscMin(PetscMax(its, 1), limit) : limit));
  error = SolveFields(pc, data, transpose, PETSC_FALSE, left, p, &reason);
  PetscCall(KSPSetTolerances(data->ksp, rtol, atol, dtol, limit));
  data->ksp->its   = its; /* what the program asks for is the solve of its system */
  data->ksp->rnorm = rnorm;
  PetscCall(error);
  PetscCall(AinsworthSaddleRemoveNullSpace(&data->saddle, pc->mat, transpose, p, &removed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refines the solution of a reduced solve, and gets the verdict of the program's own system on it; why is set unless that is MET */
static PetscErrorCode RefineAndJudge(PC pc, PC_Ainsworth *data, PetscBool transpose, KSPConvergedReason reason, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                     AinsworthVerdict *verdict, char why[], size_t len)
{
  const PetscBool       stopped = (PetscBool)(reason < 0);
  const AinsworthSolver solver  = [=](AinsworthSaddleVec r, PetscReal loose, AinsworthSaddleVec p) {
    return SolveLoosely(pc, data, transpose, stopped, loose, r, p);
  };
  AinsworthSaddleVec left;
  PetscBool          removed;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleVecDuplicate(b, &left));
  PetscCall(AinsworthSaddleRemoveNullSpace(&data->saddle, pc->mat, transpose, y, &removed));
  if (removed) data->knownAx = PETSC_FALSE;
  PetscCall(PCAinsworthJudge_Private(pc, data, transpose, reason, solver, b, y, left, verdict, why, len));
  if (removed && *verdict == AINSWORTH_VERDICT_UNMET)
    PetscCall(PetscStrlcat(why, ", or is it the null space attached to the matrix, whose vectors mix x and lambda? Attach it to A", len));
  PetscCall(AinsworthSaddleVecDestroy(&left));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Says in the words of the ladder how a solve ended whose answer was not accepted */
static AinsworthEnd End(KSPConvergedReason reason)
{
  if (reason == KSP_DIVERGED_INDEFINITE_MAT || reason == KSP_DIVERGED_INDEFINITE_PC) return AINSWORTH_END_INDEFINITE;
  return reason < 0 ? AINSWORTH_END_BREAKDOWN : AINSWORTH_END_INACCURATE;
}

/*
   Checks whether the result has to be judged: not if the inner method ends without a test, as after one cycle, and so claims nothing, and an outer method iterates

   That one measures the residual itself
*/
static PetscErrorCode IsJudged(const PC_Ainsworth *data, KSPConvergedReason reason, PetscBool *judged)
{
  KSPNormType norm;

  PetscFunctionBegin;
  PetscCall(KSPGetNormType(data->ksp, &norm));
  *judged = (PetscBool)(data->outer == AINSWORTH_OUTER_ANSWER || norm != KSP_NORM_NONE || data->whole || reason < 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves, judges, and sets or raises the failure */
static PetscErrorCode SolveAndVerify(PC pc, PC_Ainsworth *data, PetscBool transpose, AinsworthSaddleVec b, AinsworthSaddleVec y)
{
  KSPConvergedReason reason;
  AinsworthVerdict   verdict = AINSWORTH_VERDICT_UNMET;
  PetscBool          again   = PETSC_TRUE, judged;
  char               why[512];

  PetscFunctionBegin;
  while (again) {
    again = PETSC_FALSE;
    PetscCall(SolveFields(pc, data, transpose, (PetscBool)!transpose, b, y, &reason));
    PetscCall(IsJudged(data, reason, &judged));
    if (!judged) {
      verdict = AINSWORTH_VERDICT_MET;
      break;
    }
    PetscCall(PetscStrncpy(why, KSPConvergedReasons[reason], sizeof(why)));
    /* some methods end without a reason; what rounding has stopped may be a solution all the same */
    if (reason >= 0 || reason == KSP_DIVERGED_BREAKDOWN || reason == KSP_DIVERGED_INDEFINITE_MAT) {
      PetscCall(RefineAndJudge(pc, data, transpose, reason, b, y, &verdict, why, sizeof(why)));
      if (verdict == AINSWORTH_VERDICT_MET) reason = KSP_CONVERGED_RTOL;
    }
    if (verdict == AINSWORTH_VERDICT_UNMET && reason != KSP_DIVERGED_ITS) PetscCall(PCAinsworthClimb_Private(pc, data, End(reason), why, &again));
    if (again) PetscCall(VecZeroEntries(y.primal));
  }
  /* an iteration gets one explanation: the next applications end in the same way */
  if (verdict == AINSWORTH_VERDICT_UNMET && (data->outer == AINSWORTH_OUTER_ANSWER || data->applications <= 1))
    PetscCall(PCAinsworthExplain_Private(pc, data, y.primal, reason, why, sizeof(why)));
  /* residuals of an outer method are consistent only to rounding; the program's right-hand side was checked in its first application */
  if (verdict == AINSWORTH_VERDICT_CONTRADICTION && data->applications > 1) verdict = AINSWORTH_VERDICT_MET;
  /* a flexible outer method may use the result at the limit of iterations; others get infinities, because they do not read reasons */
  data->usable = (PetscBool)((reason == KSP_DIVERGED_ITS && data->outer != AINSWORTH_OUTER_RIGID) || (reason >= 0 && verdict == AINSWORTH_VERDICT_MET));
  if (verdict == AINSWORTH_VERDICT_CONTRADICTION) PetscCall(PCAinsworthFail_Private(pc, data, PC_INCONSISTENT_RHS, PETSC_ERR_ARG_INCOMP, why));
  else if (verdict != AINSWORTH_VERDICT_MET) PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_NOT_CONVERGED, why));
  else {
    data->failure[0] = 0; /* of a solve that was not needed in the end */
    PetscCall(PCAinsworthAgreeOnFailure_Private(pc, PC_NOERROR));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls SolveAndVerify() if rows of the program's matrix have other signs than the blocks; transposed, the solution has other signs */
static PetscErrorCode SolveWithSigns(PC pc, PC_Ainsworth *data, PetscBool transpose, AinsworthSaddleVec b, AinsworthSaddleVec y)
{
  Vec                sign = data->saddle.sign;
  AinsworthSaddleVec given;

  PetscFunctionBegin;
  if (transpose) {
    PetscCall(SolveAndVerify(pc, data, transpose, b, y));
    PetscCall(VecPointwiseMult(y.primal, y.primal, sign));
    PetscCall(VecScale(y.dual, -1.0));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleVecDuplicate(b, &given));
  PetscCall(VecPointwiseMult(given.primal, b.primal, sign));
  PetscCall(VecAXPBY(given.dual, -1.0, 0.0, b.dual));
  PetscCall(SolveAndVerify(pc, data, transpose, given, y));
  PetscCall(AinsworthSaddleVecDestroy(&given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds why nothing can be solved for b, and the error code of that; why is empty if a solve can be tried */
static PetscErrorCode FindObstacle(const PC_Ainsworth *data, AinsworthSaddleVec b, PetscErrorCode *code, char why[], size_t len)
{
  PetscBool   collide;
  PetscScalar sum[2];
  char        row[64];

  PetscFunctionBegin;
  why[0] = 0;
  PetscCall(VecSum(b.primal, &sum[0])); /* a norm would be cached in b, and PETSc 3.18 would take norms of other types for known zeros */
  PetscCall(VecSum(b.dual, &sum[1]));
  PetscCall(PCAinsworthReductionsCollide_Private(data, b.primal, &collide));
  *code = collide ? PETSC_ERR_SUP : PETSC_ERR_FP;
  if (collide)
    PetscCall(PetscSNPrintf(why, len, "The outer and the inner method, %s, are both pipelined, which PETSc cannot nest: choose -%sksp_type %s",
                            ((PetscObject)data->ksp)->type_name, ((PetscObject)data->ksp)->prefix, KSPPROJECTEDCG));
  if (why[0] || !PetscIsInfOrNanScalar(sum[0] + sum[1])) PetscFunctionReturn(PETSC_SUCCESS);
  if (data->failure[0] && !data->usable) { /* b comes from the result of a failed solve, whose cause is the true one */
    PetscCall(PetscStrncpy(why, data->failure, len));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleNameNotFinite(&data->saddle, b, row, sizeof(row)));
  PetscCall(
    PetscSNPrintf(why, len, row[0] ? "The right-hand side holds NaN or Inf in %s" : "The right-hand side holds NaN or Inf, or values too large%s", row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up again after changes that PCSetUp() does not see: of a block of a MATNEST in place, or of anything if the preconditioner is reused */
static PetscErrorCode Refresh(PC pc)
{
  PC_Ainsworth *data = (PC_Ainsworth *)pc->data;
  PetscBool     changed;

  PetscFunctionBegin;
  PetscCall(PCAinsworthUpdateInputs_Private(pc, data));
  PetscCall(AinsworthSaddleChanged(&data->inputs, &data->saddle, &changed));
  if (data->keptForProgram && !pc->reusepreconditioner) changed = PETSC_TRUE;
  if (changed || (data->stale && !data->refused)) PetscCall(PCSetUp_Ainsworth(pc)); /* PETSc does not repeat a set-up that failed */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ApplyOrTranspose(PC pc, PetscBool transpose, Vec b, Vec y)
{
  PC_Ainsworth      *data  = (PC_Ainsworth *)pc->data;
  AinsworthSaddle   *sp    = &data->saddle;
  const PetscBool    other = (PetscBool)!transpose; /* b has the numbering of the rows */
  AinsworthSaddleVec left, right;
  PetscErrorCode     code = PETSC_SUCCESS;
  char               why[512];

  PetscFunctionBegin;
  data->applied = PETSC_TRUE;
  if (data->stale) { /* set-up has reported the failure */
    data->usable = PETSC_FALSE;
    PetscCall(VecFlag(y, 1));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleGetFields(sp, pc->pmat, other, PETSC_FALSE, b, &right));
  PetscCall(FindObstacle(data, right, &code, why, sizeof(why)));
  if (why[0]) {
    data->usable = PETSC_FALSE;
    PetscCall(AinsworthSaddleRestoreFields(sp, other, &right));
    PetscCall(VecFlag(y, 1));
    PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, code, why));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  data->failure[0] = 0;
  PetscCall(AinsworthSaddleGetFields(sp, pc->pmat, transpose, PETSC_TRUE, y, &left));
  if (data->applications >= 0) {
    data->applications++;
    PetscCall(AinsworthSaddleVecZero(left)); /* a work vector of an outer method is no initial guess */
  }
  code = sp->sign ? SolveWithSigns(pc, data, transpose, right, left) : SolveAndVerify(pc, data, transpose, right, left); /* checked when all is restored */
  if (sp->negated) PetscCall(VecScale(left.dual, -1.0));
  PetscCall(AinsworthSaddleRemoveDualNullSpace(sp, left.dual));
  PetscCall(AinsworthSaddleRestoreFields(sp, other, &right));
  PetscCall(AinsworthSaddleRestoreFields(sp, transpose, &left));
  if (code) {
    data->stale = data->unfinished = PETSC_TRUE;
    PetscCall(PCAinsworthAfterError_Private(data));
  }
  PetscCall(code);
  PetscCall(VecFlag(y, !data->usable));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCApply_Ainsworth(PC pc, Vec b, Vec y)
{
  PetscFunctionBegin;
  PetscCall(Refresh(pc));
  PetscCall(ApplyOrTranspose(pc, PETSC_FALSE, b, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCApplyTranspose_Ainsworth(PC pc, Vec b, Vec y)
{
  PC_Ainsworth *data = (PC_Ainsworth *)pc->data;

  PetscFunctionBegin;
  PetscCall(Refresh(pc));
  PetscCheck(!data->saddle.negated && data->adjoint && !data->saddle.known, PetscObjectComm((PetscObject)pc), PETSC_ERR_SUP,
             "The transpose of PCAINSWORTH needs blocks C and C', not C and -C' or another, and no Dirichlet rows with columns left in place");
  PetscCheck(!PetscDefined(USE_COMPLEX) || data->symmetric, PetscObjectComm((PetscObject)pc), PETSC_ERR_SUP,
             "The transpose of PCAINSWORTH needs a Hermitian A in complex arithmetic");
  /* [A C'; C 0] is Hermitian when A is */
  PetscCall(AinsworthApplyConjugated(b, y, [=](Vec v, Vec w) { return ApplyOrTranspose(pc, (PetscBool)!data->symmetric, v, w); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Applies the preconditioner column by column, like PETSc's default, but with an error if a column fails

   PETSc forgets the failure at the next column, and a KSP cannot write Inf into a dense matrix
*/
PetscErrorCode PCMatApply_Ainsworth(PC pc, Mat X, Mat Y)
{
  PC_Ainsworth  *data = (PC_Ainsworth *)pc->data;
  PCFailedReason reason;
  PetscInt       n;

  PetscFunctionBegin;
  PetscCall(MatGetSize(X, NULL, &n));
  for (PetscInt j = 0; j < n; j++) {
    Vec x, y;

    PetscCall(MatDenseGetColumnVecRead(X, j, &x));
    PetscCall(MatDenseGetColumnVecWrite(Y, j, &y));
    PetscCall(PCApply(pc, x, y));
    PetscCall(MatDenseRestoreColumnVecWrite(Y, j, &y));
    PetscCall(MatDenseRestoreColumnVecRead(X, j, &x));
    PetscCall(PCGetFailedReason(pc, &reason));
    PetscCheck(!reason, PetscObjectComm((PetscObject)pc), PETSC_ERR_NOT_CONVERGED, "Column %" PetscInt_FMT " of the right-hand sides: %s", j, data->failure);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
