/* Application of PCAINSWORTH: fields of the program's vectors, a solve, and the verdict on it */
#include "pcainsworth.h"
#include "../base/hermitian.h"

/*
   Refines the solution of a reduced solve, and gets the verdict of the program's own system on it; why is set unless
   that is MET
*/
static PetscErrorCode RefineAndJudge(PC pc, PC_Ainsworth *data, PetscBool transpose, KSPConvergedReason reason,
                                     PetscBool known, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                     AinsworthVerdict *verdict, char why[], size_t len)
{
  const PetscBool        stopped = (PetscBool)(reason < 0);
  const AinsworthSolveFn solver  = [=](AinsworthSaddleVec r, PetscReal loose, AinsworthSaddleVec p) {
    return PCAinsworthSolveLoosely_Private(pc, data, transpose, stopped, loose, r, p);
  };
  AinsworthSaddleVec left;
  PetscBool          removed;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleVecDuplicate(b, &left));
  PetscCall(AinsworthSaddleRemoveNullSpace(data->saddle.get(), data->given.inputs.amat, transpose, y, &removed));
  PetscCall(PCAinsworthJudge_Private(pc, data, transpose, reason, solver, (PetscBool)(known && !removed), b, y, left,
                                     verdict, why, len));
  if (removed && *verdict == AINSWORTH_VERDICT_UNMET)
    PetscCall(PetscStrlcat(
      why, ", or is it the null space attached to the matrix, whose vectors mix x and lambda? Attach it to A", len));
  PetscCall(AinsworthSaddleVecDestroy(&left));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Says in the words of the ladder how a solve ended whose answer was not accepted */
static AinsworthEnd End(KSPConvergedReason reason)
{
  if (reason == KSP_DIVERGED_INDEFINITE_MAT || reason == KSP_DIVERGED_INDEFINITE_PC) return AINSWORTH_END_INDEFINITE;
  return reason < 0 ? AINSWORTH_END_BREAKDOWN : AINSWORTH_END_INACCURATE;
}

/* Explains a failure, unless a set-up in the middle of this application did */
static PetscErrorCode Explain(PC pc, PC_Ainsworth *data, Vec x, KSPConvergedReason reason, char why[], size_t len)
{
  PetscFunctionBegin;
  if (data->state < PC_AINSWORTH_READY) PetscCall(PetscStrncpy(why, data->outcome.why, len));
  else PetscCall(AinsworthExplain(pc, data, data->inner.ksp, x, reason, why, len));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves, judges, and sets or raises the failure */
static PetscErrorCode SolveAndVerify(PC pc, PC_Ainsworth *data, PetscBool transpose, AinsworthSaddleVec b,
                                     AinsworthSaddleVec y)
{
  KSPConvergedReason reason;
  AinsworthVerdict   verdict = AINSWORTH_VERDICT_UNMET;
  PetscBool          again   = PETSC_TRUE, judged, known;
  char               why[512];

  PetscFunctionBegin;
  while (again) {
    again = PETSC_FALSE;
    PetscCall(PCAinsworthSolveFields_Private(pc, data, transpose, (PetscBool)!transpose, b, y, &known, &reason));
    PetscCall(PCAinsworthIsClaim_Private(data, &judged));
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
    if (verdict == AINSWORTH_VERDICT_UNMET && reason != KSP_DIVERGED_ITS)
      PetscCall(PCAinsworthReplan_Private(pc, data, End(reason), why, &again));
    if (again) PetscCall(VecZeroEntries(y.primal));
  }
  /* an iteration gets one explanation: the next applications end in the same way */
  if (verdict == AINSWORTH_VERDICT_UNMET &&
      (data->outer.method <= AINSWORTH_OUTER_ANSWER || data->outer.applications <= 1))
    PetscCall(Explain(pc, data, y.primal, reason, why, sizeof(why)));
  /*
     residuals of an outer method are consistent only to rounding; the program's right-hand side was checked in its
     first application
  */
  if (verdict == AINSWORTH_VERDICT_CONTRADICTION && data->outer.applications > 1) verdict = AINSWORTH_VERDICT_MET;
  /*
     a flexible outer method may use the result at the limit of iterations; others get infinities, because they do not
     read reasons
  */
  data->outcome.usable = (PetscBool)((reason == KSP_DIVERGED_ITS && data->outer.method != AINSWORTH_OUTER_RIGID) ||
                                     (reason >= 0 && verdict == AINSWORTH_VERDICT_MET));
  if (verdict == AINSWORTH_VERDICT_CONTRADICTION)
    PetscCall(PCAinsworthFail_Private(pc, data, PC_INCONSISTENT_RHS, PETSC_ERR_ARG_INCOMP, why));
  else if (verdict != AINSWORTH_VERDICT_MET)
    PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_NOT_CONVERGED, why));
  else {
    data->outcome.why[0] = 0; /* of a solve that was not needed in the end */
    PetscCall(PCAinsworthAgreeOnFailure_Private(pc, PC_NOERROR));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Calls SolveAndVerify() if rows of the program's matrix have other signs than the blocks; transposed, the solution has
   other signs
*/
static PetscErrorCode SolveWithSigns(PC pc, PC_Ainsworth *data, PetscBool transpose, AinsworthSaddleVec b,
                                     AinsworthSaddleVec y)
{
  Vec                sign = data->saddle->sign;
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
static PetscErrorCode FindObstacle(const PC_Ainsworth *data, AinsworthSaddleVec b, PetscErrorCode *code, char why[],
                                   size_t len)
{
  PetscBool   collide;
  PetscScalar sum[2];
  char        row[64];

  PetscFunctionBegin;
  *code = PETSC_SUCCESS;
  /* a norm would be cached in b, and PETSc 3.18 would take norms of other types for known zeros */
  PetscCall(VecSum(b.primal, &sum[0]));
  PetscCall(VecSum(b.dual, &sum[1]));
  PetscCall(PCAinsworthReductionsCollide_Private(data, b.primal, &collide));
  if (collide) {
    *code = PETSC_ERR_SUP;
    PetscCall(PetscSNPrintf(
      why, len,
      "The outer and the inner method, %s, are both pipelined, which PETSc cannot nest: choose -%sksp_type %s",
      AinsworthTypeName((PetscObject)data->inner.ksp), AinsworthSolverPrefix(data), KSPPROJECTEDCG));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!PetscIsInfOrNanScalar(sum[0] + sum[1])) PetscFunctionReturn(PETSC_SUCCESS);
  *code = PETSC_ERR_FP;
  /* b comes from the result of a failed solve, whose cause is the true one */
  if (data->outcome.why[0] && !data->outcome.usable) {
    PetscCall(PetscStrncpy(why, data->outcome.why, len));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleNameNotFinite(data->saddle.get(), b, row, sizeof(row)));
  PetscCall(PetscSNPrintf(why, len,
                          row[0] ? "The right-hand side holds NaN or Inf in %s"
                                 : "The right-hand side holds NaN or Inf, or values too large%s",
                          row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthRefresh_Private - sets up again after changes that PCSetUp() does not see: of a block of a MATNEST in
   place, or of anything if the preconditioner is reused
*/
PetscErrorCode PCAinsworthRefresh_Private(PC pc)
{
  PC_Ainsworth *data    = PCAinsworthData_Private(pc);
  PetscBool     changed = PETSC_TRUE, reuse;

  PetscFunctionBegin;
  PetscCall(PCAinsworthUpdateInputs_Private(pc, data));
  if (data->saddle) PetscCall(AinsworthSaddleChanged(&data->given.inputs, data->saddle.get(), &changed));
  PetscCall(PCGetReusePreconditioner(pc, &reuse));
  if (data->age.forProgram && !reuse) changed = PETSC_TRUE;
  if (changed || data->state == PC_AINSWORTH_NONE || data->state == PC_AINSWORTH_STALE)
    PetscCall(PCSetUp_Ainsworth(pc)); /* PETSc does not repeat a set-up that failed */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves for the fields of a right-hand side; y: the program's vector for the solution */
static PetscErrorCode SolveInFields(PC pc, PC_Ainsworth *data, PetscBool transpose, AinsworthSaddleVec b, Vec y)
{
  const AinsworthSaddle *sp = data->saddle.get();
  /* a work vector of an outer method is no initial guess */
  const AinsworthAccess access = data->outer.method == AINSWORTH_OUTER_NONE ? AINSWORTH_ACCESS_UPDATE
                                                                            : AINSWORTH_ACCESS_WRITE;

  PetscFunctionBegin;
  data->outcome.why[0] = 0;
  PetscCall(AinsworthSaddleUseFields(sp, transpose, access, y, [=](AinsworthSaddleVec left) {
    PetscFunctionBegin;
    if (access == AINSWORTH_ACCESS_WRITE) PetscCall(AinsworthSaddleVecZero(left));
    PetscCall((sp->sign ? SolveWithSigns : SolveAndVerify)(pc, data, transpose, b, left));
    if (sp->negated) PetscCall(VecScale(left.dual, -1.0));
    PetscCall(AinsworthSaddleRemoveDualNullSpace(sp, left.dual));
    PetscFunctionReturn(PETSC_SUCCESS);
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthAfterError_Private - gives up what an error has left of the solver, in the middle of an application */
PetscErrorCode PCAinsworthAfterError_Private(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  data->state = PC_AINSWORTH_NONE;
  PetscCall(AinsworthSolverAfterError(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ApplyOrTranspose(PC pc, PetscBool transpose, Vec b, Vec y)
{
  PC_Ainsworth   *data     = PCAinsworthData_Private(pc);
  const PetscBool other    = (PetscBool)!transpose; /* b has the numbering of the rows */
  PetscErrorCode  obstacle = PETSC_SUCCESS, code;
  char            why[512];

  PetscFunctionBegin;
  data->outer.applications++;
  if (data->state < PC_AINSWORTH_READY) { /* set-up has reported the failure */
    data->outcome.usable = PETSC_FALSE;
    PetscCall(VecFlag(y, 1));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  code = AinsworthSaddleUseFields(data->saddle.get(), other, AINSWORTH_ACCESS_READ, b, [&](AinsworthSaddleVec right) {
    PetscFunctionBegin;
    PetscCall(FindObstacle(data, right, &obstacle, why, sizeof(why)));
    if (!obstacle) PetscCall(SolveInFields(pc, data, transpose, right, y));
    PetscFunctionReturn(PETSC_SUCCESS);
  });
  if (code) PetscCall(PCAinsworthAfterError_Private(data));
  PetscCall(code);
  if (obstacle) data->outcome.usable = PETSC_FALSE;
  PetscCall(VecFlag(y, !data->outcome.usable));
  if (obstacle) PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, obstacle, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCApply_Ainsworth(PC pc, Vec b, Vec y)
{
  PetscFunctionBegin;
  PetscCall(PCAinsworthRefresh_Private(pc));
  PetscCall(ApplyOrTranspose(pc, PETSC_FALSE, b, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCApplyTranspose_Ainsworth(PC pc, Vec b, Vec y)
{
  PC_Ainsworth *data = PCAinsworthData_Private(pc);

  PetscFunctionBegin;
  PetscCall(PCAinsworthRefresh_Private(pc));
  PetscCheck(!data->saddle->negated && data->saddle->adjoint && !data->saddle->known, PetscObjectComm((PetscObject)pc),
             PETSC_ERR_SUP,
             "The transpose of PCAINSWORTH needs blocks C and C', not C and -C' or another, and no Dirichlet rows with "
             "columns left in place");
  PetscCheck(!PetscDefined(USE_COMPLEX) || data->saddle->symmetric, PetscObjectComm((PetscObject)pc), PETSC_ERR_SUP,
             "The transpose of PCAINSWORTH needs a Hermitian A in complex arithmetic");
  /* [A C'; C 0] is Hermitian when A is */
  PetscCall(AinsworthApplyConjugated(
    b, y, [=](Vec v, Vec w) { return ApplyOrTranspose(pc, (PetscBool)!data->saddle->symmetric, v, w); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}
