/* Application of PCAINSWORTH: kept rows, reduced solve (operator/matdoors.cpp, ksp/inkernel.cpp), x and lambda, and residuals of both equations */
#include "pcainsworth.h"
#include "../hermitian.h"
#include "../operator/matainsworth.h"
#include <petsc/private/kspimpl.h>
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
  if (!data->saddle.constraints() || data->saddle.D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAinsworthGetContext_Private(data->reduced.mat, &ctx));
  PetscCall(VecDuplicate(f, &work));
  for (int k = 0; k < 2; k++) {
    const Vec   v = k ? f : data->reduced.rhs;
    PetscScalar square;

    PetscCall(VecPointwiseMult(work, data->reduced.inverseDiagonal, v));
    PetscCall(VecDot(work, v, &square));
    norms[k] = PetscSqrtReal(PetscAbsScalar(square));
  }
  PetscCall(VecDestroy(&work));
  if (norms[0] <= AinsworthLeast * (norms[1] + PetscSqrtReal(PetscAbsReal(ctx->energy)))) PetscCall(VecZeroEntries(data->reduced.rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Solves the reduced system for f and g once, for at most `limit` iterations (0: those of the KSP); *end: why another solver has to take its place, if it has to

   watched: the report sees the solve, and its stop refers to x. The report restores the KSP also after an error, which is raised then
*/
static PetscErrorCode SolveOnce(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched, PetscInt limit, AinsworthSaddleVec b, Vec x,
                                AinsworthEnd *end)
{
  KSP              ksp = data->inner.ksp;
  Vec              rhs = data->reduced.rhs;
  PetscReal        rtol, atol, dtol;
  PetscInt         most;
  PetscLogDouble   start;
  PetscErrorCode   error;
  PCAinsworthWatch watch;

  PetscFunctionBegin;
  PetscCall(PetscTime(&start));
  if (data->saddle.constraints()) PetscCall(MatAinsworthReduce_Private(data->reduced.mat, transpose, b.primal, b.dual, rhs));
  else PetscCall(VecCopy(b.primal, rhs));
  PetscCall(ForgetRounding(data, b.primal));
  PetscCall(PCAinsworthEnter_Private(data, ksp, x));
  if (watched) PetscCall(PCAinsworthReportBegin_Private(data, b, start));
  PetscCall(PCAinsworthWatchBegin_Private(pc, data, &watch));
  PetscCall(PCAinsworthKeepCoefficients_Private(&data->inner));
  PetscCall(KSPGetTolerances(ksp, &rtol, &atol, &dtol, &most));
  if (limit) PetscCall(KSPSetTolerances(ksp, rtol, atol, dtol, limit));
  /* checked when everything is restored; conjugate gradients are for a symmetric A */
  error = transpose && !data->inner.operation ? KSPSolveTranspose(ksp, rhs, x) : KSPSolve(ksp, rhs, x);
  if (limit) PetscCall(KSPSetTolerances(ksp, rtol, atol, dtol, most));
  PetscCall(PCAinsworthWatchEnd_Private(&watch));
  if (watched && data->reporting.report) PetscCall(AinsworthReportEnd(data->reporting.report, ksp, (PetscBool)(error != PETSC_SUCCESS)));
  PetscCall(PCAinsworthLeave_Private(data, ksp));
  PetscCall(error);
  *end = watch.end;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the reduced system for f and g, again as long as another solver takes the place of the last one, which may be one for the whole system */
static PetscErrorCode SolveInner(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched, AinsworthSaddleVec b, Vec x, KSPConvergedReason *reason)
{
  PetscBool    again = PETSC_TRUE;
  PetscInt     limit;
  AinsworthEnd end = AINSWORTH_END_ANSWER;

  PetscFunctionBegin;
  while (again && !data->whole.factor) {
    PetscCall(PCAinsworthLimit_Private(pc, data, &limit));
    PetscCall(SolveOnce(pc, data, transpose, watched, limit, b, x, &end));
    PetscCall(PCAinsworthGetReason_Private(data, reason));
    if (limit && *reason < 0) end = AINSWORTH_END_OLD;
    again = PETSC_FALSE;
    if (end == AINSWORTH_END_ANSWER) break;
    PetscCall(PCAinsworthReplan_Private(pc, data, end, end == AINSWORTH_END_DEAR ? "Multigrid is slow" : "The inner preconditioner is old", &again));
    if (!again) *reason = KSP_DIVERGED_PC_FAILED; /* the inner solver is lost */
  }
  if (!data->whole.factor && *reason > 0 && watched) PetscCall(PCAinsworthCount_Private(data)); /* refinements do not predict other solves */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether the inner method claims to solve, so that its result is judged: not if it ends without a test, as after one cycle, and an outer method iterates

   That one measures the residual itself
*/
static PetscErrorCode IsClaim(const PC_Ainsworth *data, PetscBool *claim)
{
  KSPNormType norm;

  PetscFunctionBegin;
  PetscCall(KSPGetNormType(data->inner.ksp, &norm));
  *claim = (PetscBool)(data->outer.method <= AINSWORTH_OUTER_ANSWER || norm != KSP_NORM_NONE);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves for x and lambda by the reduced system, all on kept rows; transpose: with the transpose of A; *known: data->reduced.Ax was computed as well */
static PetscErrorCode SolveReduced(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                   PetscBool *known, KSPConvergedReason *reason)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecGetSize(y.primal, &n));
  *reason = KSP_CONVERGED_HAPPY_BREAKDOWN;
  if (data->saddle.constraints() == n && !data->saddle.D) PetscCall(VecZeroEntries(y.primal)); /* Ker C = 0: the constraints alone determine x */
  else PetscCall(SolveInner(pc, data, transpose, watched, b, y.primal, reason));
  PetscCall(IsClaim(data, known));
  *known = (PetscBool)(*known && !data->whole.factor && data->saddle.constraints() && data->saddle.A == data->saddle.block[AINSWORTH_BLOCK_A] &&
                       !data->saddle.known);
  if (data->whole.factor) { /* at once, or because the reduced solve was given up for it */
    *reason = KSP_CONVERGED_RTOL;
    PetscCall(AinsworthWholeSolve(data->whole.factor, transpose, b, y));
  } else if (data->saddle.constraints()) PetscCall(MatAinsworthRecover_Private(data->reduced.mat, transpose, b, y, *known ? data->reduced.Ax : NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Restricts the program's fields to the kept rows, solves, and extends the solution */
static PetscErrorCode SolveFields(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                  PetscBool *known, KSPConvergedReason *reason)
{
  PCAinsworthReduced *r = &data->reduced;

  PetscFunctionBegin;
  if (r->g) {
    const AinsworthSaddleVec kept = {r->f ? r->f : b.primal, r->g};

    PetscCall(AinsworthSaddleRestrict(&data->saddle, b, kept));
    PetscCall(SolveReduced(pc, data, transpose, watched, kept, {y.primal, r->lambda}, known, reason));
    PetscCall(AinsworthSaddleExtend(&data->saddle, b, r->lambda, y));
  } else PetscCall(SolveReduced(pc, data, transpose, watched, b, y, known, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves for what an earlier solve left, to a relative tolerance of at least `loose`; stopped: rounding ended that one, so that this may not last longer */
static PetscErrorCode SolveLoosely(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool stopped, PetscReal loose, AinsworthSaddleVec left,
                                   AinsworthSaddleVec p)
{
  const PetscInt     its   = data->inner.ksp->its;
  const PetscReal    rnorm = data->inner.ksp->rnorm;
  PetscReal          rtol, atol, dtol;
  PetscInt           limit;
  PetscBool          removed, known;
  PetscErrorCode     error;
  KSPConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(VecZeroEntries(p.primal));
  PetscCall(KSPGetTolerances(data->inner.ksp, &rtol, &atol, &dtol, &limit));
  PetscCall(KSPSetTolerances(data->inner.ksp, PetscMax(rtol, loose), atol, dtol, stopped ? PetscMin(PetscMax(its, 1), limit) : limit));
  error = SolveFields(pc, data, transpose, PETSC_FALSE, left, p, &known, &reason);
  PetscCall(KSPSetTolerances(data->inner.ksp, rtol, atol, dtol, limit));
  data->inner.ksp->its   = its; /* what the program asks for is the solve of its system */
  data->inner.ksp->rnorm = rnorm;
  PetscCall(error);
  PetscCall(AinsworthSaddleRemoveNullSpace(&data->saddle, data->given.inputs.amat, transpose, p, &removed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refines the solution of a reduced solve, and gets the verdict of the program's own system on it; why is set unless that is MET */
static PetscErrorCode RefineAndJudge(PC pc, PC_Ainsworth *data, PetscBool transpose, KSPConvergedReason reason, PetscBool known, AinsworthSaddleVec b,
                                     AinsworthSaddleVec y, AinsworthVerdict *verdict, char why[], size_t len)
{
  const PetscBool       stopped = (PetscBool)(reason < 0);
  const AinsworthSolver solver  = [=](AinsworthSaddleVec r, PetscReal loose, AinsworthSaddleVec p) {
    return SolveLoosely(pc, data, transpose, stopped, loose, r, p);
  };
  AinsworthSaddleVec left;
  PetscBool          removed;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleVecDuplicate(b, &left));
  PetscCall(AinsworthSaddleRemoveNullSpace(&data->saddle, data->given.inputs.amat, transpose, y, &removed));
  PetscCall(PCAinsworthJudge_Private(pc, data, transpose, reason, solver, (PetscBool)(known && !removed), b, y, left, verdict, why, len));
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

/* Solves, judges, and sets or raises the failure */
static PetscErrorCode SolveAndVerify(PC pc, PC_Ainsworth *data, PetscBool transpose, AinsworthSaddleVec b, AinsworthSaddleVec y)
{
  KSPConvergedReason reason;
  AinsworthVerdict   verdict = AINSWORTH_VERDICT_UNMET;
  PetscBool          again   = PETSC_TRUE, judged, known;
  char               why[512];

  PetscFunctionBegin;
  while (again) {
    again = PETSC_FALSE;
    PetscCall(SolveFields(pc, data, transpose, (PetscBool)!transpose, b, y, &known, &reason));
    PetscCall(IsClaim(data, &judged));
    if (!judged && reason >= 0 && !data->whole.factor) {
      verdict = AINSWORTH_VERDICT_MET;
      break;
    }
    PetscCall(PetscStrncpy(why, KSPConvergedReasons[reason], sizeof(why)));
    /* some methods end without a reason; what rounding has stopped may be a solution all the same */
    if (reason >= 0 || reason == KSP_DIVERGED_BREAKDOWN || End(reason) == AINSWORTH_END_INDEFINITE) {
      PetscCall(RefineAndJudge(pc, data, transpose, reason, known, b, y, &verdict, why, sizeof(why)));
      if (verdict == AINSWORTH_VERDICT_MET) reason = KSP_CONVERGED_RTOL;
    }
    if (verdict == AINSWORTH_VERDICT_UNMET && reason != KSP_DIVERGED_ITS) PetscCall(PCAinsworthReplan_Private(pc, data, End(reason), why, &again));
    if (again) PetscCall(VecZeroEntries(y.primal));
  }
  /* an iteration gets one explanation: the next applications end in the same way */
  if (verdict == AINSWORTH_VERDICT_UNMET && (data->outer.method <= AINSWORTH_OUTER_ANSWER || data->outer.applications <= 1))
    PetscCall(PCAinsworthExplain_Private(pc, data, data->inner.ksp, y.primal, reason, why, sizeof(why)));
  /* residuals of an outer method are consistent only to rounding; the program's right-hand side was checked in its first application */
  if (verdict == AINSWORTH_VERDICT_CONTRADICTION && data->outer.applications > 1) verdict = AINSWORTH_VERDICT_MET;
  /* a flexible outer method may use the result at the limit of iterations; others get infinities, because they do not read reasons */
  data->outcome.usable = (PetscBool)((reason == KSP_DIVERGED_ITS && data->outer.method != AINSWORTH_OUTER_RIGID) ||
                                     (reason >= 0 && verdict == AINSWORTH_VERDICT_MET));
  if (verdict == AINSWORTH_VERDICT_CONTRADICTION) PetscCall(PCAinsworthFail_Private(pc, data, PC_INCONSISTENT_RHS, PETSC_ERR_ARG_INCOMP, why));
  else if (verdict != AINSWORTH_VERDICT_MET) PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_NOT_CONVERGED, why));
  else {
    data->outcome.why[0] = 0; /* of a solve that was not needed in the end */
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

/* Finds why nothing can be solved for b, and the error code of that, PETSC_SUCCESS if a solve can be tried */
static PetscErrorCode FindObstacle(const PC_Ainsworth *data, AinsworthSaddleVec b, PetscErrorCode *code, char why[], size_t len)
{
  PetscBool   collide;
  PetscScalar sum[2];
  char        row[64];

  PetscFunctionBegin;
  *code = PETSC_SUCCESS;
  PetscCall(VecSum(b.primal, &sum[0])); /* a norm would be cached in b, and PETSc 3.18 would take norms of other types for known zeros */
  PetscCall(VecSum(b.dual, &sum[1]));
  PetscCall(PCAinsworthReductionsCollide_Private(data, b.primal, &collide));
  if (collide) {
    *code = PETSC_ERR_SUP;
    PetscCall(PetscSNPrintf(why, len, "The outer and the inner method, %s, are both pipelined, which PETSc cannot nest: choose -%sksp_type %s",
                            PCAinsworthTypeName_Private((PetscObject)data->inner.ksp), PCAinsworthPrefix_Private(data), KSPPROJECTEDCG));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!PetscIsInfOrNanScalar(sum[0] + sum[1])) PetscFunctionReturn(PETSC_SUCCESS);
  *code = PETSC_ERR_FP;
  if (data->outcome.why[0] && !data->outcome.usable) { /* b comes from the result of a failed solve, whose cause is the true one */
    PetscCall(PetscStrncpy(why, data->outcome.why, len));
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
  PC_Ainsworth *data = PCAinsworthData_Private(pc);
  PetscBool     changed, reuse;

  PetscFunctionBegin;
  PetscCall(PCAinsworthUpdateInputs_Private(pc, data));
  PetscCall(AinsworthSaddleChanged(&data->given.inputs, &data->saddle, &changed));
  PetscCall(PCGetReusePreconditioner(pc, &reuse));
  if (data->age.forProgram && !reuse) changed = PETSC_TRUE;
  if (changed || data->state == PC_AINSWORTH_NONE || data->state == PC_AINSWORTH_STALE)
    PetscCall(PCSetUp_Ainsworth(pc)); /* PETSc does not repeat a set-up that failed */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ApplyOrTranspose(PC pc, PetscBool transpose, Vec b, Vec y)
{
  PC_Ainsworth      *data  = PCAinsworthData_Private(pc);
  AinsworthSaddle   *sp    = &data->saddle;
  const PetscBool    other = (PetscBool)!transpose; /* b has the numbering of the rows */
  AinsworthSaddleVec left, right;
  PetscErrorCode     code = PETSC_SUCCESS;
  char               why[512];

  PetscFunctionBegin;
  data->outer.applications++;
  if (data->state < PC_AINSWORTH_READY) { /* set-up has reported the failure */
    data->outcome.usable = PETSC_FALSE;
    PetscCall(VecFlag(y, 1));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleGetFields(sp, other, PETSC_FALSE, b, &right));
  PetscCall(FindObstacle(data, right, &code, why, sizeof(why)));
  if (code) {
    data->outcome.usable = PETSC_FALSE;
    PetscCall(AinsworthSaddleRestoreFields(sp, other, &right));
    PetscCall(VecFlag(y, 1));
    PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, code, why));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  data->outcome.why[0] = 0;
  PetscCall(AinsworthSaddleGetFields(sp, transpose, PETSC_TRUE, y, &left));
  if (data->outer.method != AINSWORTH_OUTER_NONE) PetscCall(AinsworthSaddleVecZero(left)); /* a work vector of an outer method is no initial guess */
  code = sp->sign ? SolveWithSigns(pc, data, transpose, right, left) : SolveAndVerify(pc, data, transpose, right, left); /* checked when all is restored */
  if (sp->negated) PetscCall(VecScale(left.dual, -1.0));
  PetscCall(AinsworthSaddleRemoveDualNullSpace(sp, left.dual));
  PetscCall(AinsworthSaddleRestoreFields(sp, other, &right));
  PetscCall(AinsworthSaddleRestoreFields(sp, transpose, &left));
  if (code) {
    data->state = PC_AINSWORTH_NONE;
    PetscCall(PCAinsworthAfterError_Private(data));
  }
  PetscCall(code);
  PetscCall(VecFlag(y, !data->outcome.usable));
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
  PC_Ainsworth *data = PCAinsworthData_Private(pc);

  PetscFunctionBegin;
  PetscCall(Refresh(pc));
  PetscCheck(!data->saddle.negated && data->saddle.adjoint && !data->saddle.known, PetscObjectComm((PetscObject)pc), PETSC_ERR_SUP,
             "The transpose of PCAINSWORTH needs blocks C and C', not C and -C' or another, and no Dirichlet rows with columns left in place");
  PetscCheck(!PetscDefined(USE_COMPLEX) || data->saddle.symmetric, PetscObjectComm((PetscObject)pc), PETSC_ERR_SUP,
             "The transpose of PCAINSWORTH needs a Hermitian A in complex arithmetic");
  /* [A C'; C 0] is Hermitian when A is */
  PetscCall(AinsworthApplyConjugated(b, y, [=](Vec v, Vec w) { return ApplyOrTranspose(pc, (PetscBool)!data->saddle.symmetric, v, w); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Applies the preconditioner column by column, like PETSc's default, but with an error if a column fails

   PETSc forgets the failure at the next column, and a KSP cannot write Inf into a dense matrix
*/
PetscErrorCode PCMatApply_Ainsworth(PC pc, Mat X, Mat Y)
{
  PC_Ainsworth  *data = PCAinsworthData_Private(pc);
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
    PetscCheck(!reason, PetscObjectComm((PetscObject)pc), PETSC_ERR_NOT_CONVERGED, "Column %" PetscInt_FMT " of the right-hand sides: %s", j,
               data->outcome.why);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
