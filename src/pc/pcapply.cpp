/* The way of a right-hand side through PCAINSWORTH: kept rows, reduced solve (operator/matdoors.cpp, ksp/), x and lambda, and what is left of both equations */
#include "pcainsworth.h"
#include "../hermitian.h"
#include "../operator/matainsworth.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>
#include <petsctime.h>

/* The reason of the inner solve; GCR calls the limit of iterations convergence, which only -ksp_converged_maxits and solves without a test may */
static PetscErrorCode GetReason(const PC_Ainsworth *data, KSPConvergedReason *reason)
{
  PetscErrorCode (*test)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  KSPNormType norm;
  PetscBool   asked = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(KSPGetConvergedReason(data->ksp, reason));
  PetscCall(KSPGetNormType(data->ksp, &norm));
  PetscCall(PetscOptionsGetBool(((PetscObject)data->ksp)->options, ((PetscObject)data->ksp)->prefix, "-ksp_converged_maxits", &asked, NULL));
  PetscCall(KSPGetConvergenceTest(data->ksp, &test, NULL, NULL));
  if (*reason == KSP_CONVERGED_ITS && norm != KSP_NORM_NONE && test == KSPConvergedDefault && !asked) *reason = KSP_DIVERGED_ITS;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   KSPSolve() for f and g, until the preconditioner is not changed for another; watched: the report sees it, and its stop refers to x. What the report has put
   into the KSP is taken out again after an error, too, which is passed on then
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
    if (watched) PetscCall(PCAinsworthReportBegin_Private(pc, data, b, start));
    PetscCall(PCAinsworthEscapeBegin_Private(pc, data));
    error = transpose ? KSPSolveTranspose(data->ksp, data->rhs, x) : KSPSolve(data->ksp, data->rhs, x);
    PetscCall(PCAinsworthEscapeEnd_Private(data));
    if (watched && data->report) PetscCall(AinsworthReportEnd(data->report, data->ksp, (PetscBool)(error != PETSC_SUCCESS)));
    PetscCall(error);
    PetscCall(PCAinsworthEscape_Private(pc, data, &again));
  }
  PetscCall(GetReason(data, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* SolveInner(), a second time with a preconditioner of the matrix at hand where an earlier one does not help */
static PetscErrorCode SolveOrRebuild(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched, AinsworthSaddleVec b, Vec x, KSPConvergedReason *reason)
{
  KSP       ksp = data->ksp;
  PetscInt  limit, most = ksp->max_it;
  PetscBool strict   = ksp->errorifnotconverged;
  char      why[512] = "";

  PetscFunctionBegin;
  PetscCall(PCAinsworthLimit_Private(pc, data, &limit));
  if (limit) {
    PetscErrorCode error;

    ksp->max_it              = limit;
    ksp->errorifnotconverged = PETSC_FALSE;
    error                    = SolveInner(pc, data, transpose, watched, b, x, reason); /* to be passed on when all is as it was */
    ksp->max_it              = most;
    ksp->errorifnotconverged = strict;
    PetscCall(error);
    if (*reason < 0) PetscCall(PCAinsworthRebuild_Private(pc, data, why, sizeof(why)));
  }
  if (!limit || (*reason < 0 && !why[0])) PetscCall(SolveInner(pc, data, transpose, watched, b, x, reason));
  if (*reason > 0 && watched) PetscCall(PCAinsworthCount_Private(data)); /* a refinement says nothing of other solves */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One step of steepest descent in the place of the reduced solve */
static PetscErrorCode StepInner(PC_Ainsworth *data, PetscBool transpose, AinsworthSaddleVec b, Vec x, KSPConvergedReason *reason)
{
  KSP            ksp = data->ksp;
  PC             inner;
  Mat            operation;
  Vec            product;
  PetscScalar    dots[2];
  PetscErrorCode error;

  PetscFunctionBegin;
  PetscCall(MatAinsworthReduce_Private(data->reduced, transpose, b.primal, b.dual, data->rhs));
  PetscCall(KSPGetPC(ksp, &inner));
  PetscCall(PCPreSolve(inner, ksp));
  error = KSP_PCApply(ksp, data->rhs, x); /* to be passed on when the preconditioner knows that it has ended */
  PetscCall(PCPostSolve(inner, ksp));
  PetscCall(error);
  PetscCall(KSPGetOperators(ksp, &operation, NULL));
  PetscCall(VecDuplicate(x, &product));
  PetscCall(KSP_MatMult(ksp, operation, x, product));
  PetscCall(VecDot(data->rhs, x, &dots[0]));
  PetscCall(VecDot(product, x, &dots[1]));
  *reason = PetscRealPart(dots[0]) > 0.0 && PetscRealPart(dots[1]) > 0.0 ? KSP_CONVERGED_ITS : KSP_DIVERGED_BREAKDOWN;
  PetscCall(VecScale(x, *reason > 0 ? dots[0] / dots[1] : 0.0));
  PetscCall(VecDestroy(&product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reduced solve between f, g and x, lambda, all on kept rows; transpose: with the transpose of A */
static PetscErrorCode SolveReduced(PC pc, PC_Ainsworth *data, PetscBool transpose, PCAinsworthExtent extent, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                   KSPConvergedReason *reason)
{
  const PetscBool watched = (PetscBool)(extent == PC_AINSWORTH_SOLVE_WATCHED);
  PetscInt        n;
  PetscBool       again = PETSC_FALSE;

  PetscFunctionBegin;
  data->knownAx = (PetscBool)(data->constraints && data->saddle.A == data->saddle.block[AINSWORTH_BLOCK_A] && !data->saddle.known);
  PetscCall(VecGetSize(y.primal, &n));
  *reason = KSP_CONVERGED_HAPPY_BREAKDOWN;
  if (data->constraints == n && !data->saddle.D) PetscCall(VecZeroEntries(y.primal)); /* Ker C = 0: the constraints alone determine x */
  else if (extent == PC_AINSWORTH_SOLVE_STEP) PetscCall(StepInner(data, transpose, b, y.primal, reason));
  else {
    PetscCall(SolveOrRebuild(pc, data, transpose, watched, b, y.primal, reason));
    if (*reason == KSP_DIVERGED_INDEFINITE_MAT && data->saddle.D) PetscCall(PCAinsworthTakeGMRES_Private(pc, data, &again));
    if (again) PetscCall(SolveInner(pc, data, transpose, watched, b, y.primal, reason));
  }
  if (data->constraints) PetscCall(MatAinsworthRecover_Private(data->reduced, transpose, b, y, data->knownAx ? data->Ax : NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fields of the program, reduced to the rows that are kept, solved, and extended */
PetscErrorCode PCAinsworthSolveFields_Private(PC pc, PC_Ainsworth *data, PetscBool transpose, PCAinsworthExtent extent, AinsworthSaddleVec b,
                                              AinsworthSaddleVec y, KSPConvergedReason *reason)
{
  PetscFunctionBegin;
  if (data->g) {
    const AinsworthSaddleVec kept = {data->f ? data->f : b.primal, data->g};

    PetscCall(AinsworthSaddleRestrict(&data->saddle, b, kept));
    PetscCall(SolveReduced(pc, data, transpose, extent, kept, {y.primal, data->lambda}, reason));
    PetscCall(AinsworthSaddleExtend(&data->saddle, b, data->lambda, y));
  } else PetscCall(SolveReduced(pc, data, transpose, extent, b, y, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A second solve, for what the first has left */
static PetscErrorCode Refine(PC pc, PC_Ainsworth *data, PetscBool transpose, AinsworthSaddleVec left, AinsworthSaddleVec y)
{
  AinsworthSaddleVec more;
  KSPConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleVecDuplicate(y, &more));
  PetscCall(VecZeroEntries(more.primal));
  PetscCall(PCAinsworthSolveFields_Private(pc, data, transpose, PC_AINSWORTH_SOLVE_AGAIN, left, more, &reason));
  if (reason >= 0) {
    PetscCall(VecAXPY(y.primal, 1.0, more.primal));
    PetscCall(VecAXPY(y.dual, 1.0, more.dual));
  }
  PetscCall(AinsworthSaddleVecDestroy(&more));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without the null space that the program attached to the whole matrix, and what is left of both equations then */
static PetscErrorCode Verify(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscReal tol, AinsworthSaddleVec b, AinsworthSaddleVec y, AinsworthSaddleVec left,
                             AinsworthVerdict *verdict, char why[], size_t len)
{
  PetscBool removed;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleRemoveNullSpace(&data->saddle, pc->mat, transpose, y, &removed));
  if (removed) data->knownAx = PETSC_FALSE;
  PetscCall(PCAinsworthVerify_Private(pc, data, transpose, tol, b, y, left, verdict, why, len));
  if (removed && *verdict == AINSWORTH_VERDICT_UNMET)
    PetscCall(PetscStrlcat(why, ", or is it the null space attached to the matrix, whose vectors mix x and lambda? Attach it to A", len));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A reduced solve that ended with a good reason is believed when the program's own system agrees; once it may be refined */
static PetscErrorCode VerifyAndRefine(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool stopped, PetscReal tol, AinsworthSaddleVec b,
                                      AinsworthSaddleVec y, AinsworthVerdict *verdict, char why[], size_t len)
{
  AinsworthSaddleVec left;
  PetscBool          refined   = PETSC_FALSE;
  char               more[256] = "";

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleVecDuplicate(b, &left));
  PetscCall(Verify(pc, data, transpose, tol, b, y, left, verdict, why, len));
  if (*verdict != AINSWORTH_VERDICT_SINGULAR) { /* a row may seem to contradict others that are not yet met well enough */
    PetscCall(PCAinsworthRefineRows_Private(pc, data, transpose, stopped, (PetscBool)(*verdict == AINSWORTH_VERDICT_MET), tol, b, y, left, &refined, more,
                                            sizeof(more)));
    if (refined) PetscCall(Verify(pc, data, transpose, tol, b, y, left, verdict, why, len));
    if (refined && more[0] && *verdict == AINSWORTH_VERDICT_MET) {
      *verdict = AINSWORTH_VERDICT_UNMET;
      PetscCall(PetscStrncpy(why, more, len));
    }
  }
  if ((*verdict == AINSWORTH_VERDICT_UNMET && !more[0]) || (*verdict == AINSWORTH_VERDICT_CONTRADICTION && !refined)) {
    PetscCall(PetscInfo(pc, "%s: a second solve follows\n", why));
    PetscCall(Refine(pc, data, transpose, left, y));
    data->knownAx = PETSC_FALSE;
    PetscCall(Verify(pc, data, transpose, tol, b, y, left, verdict, why, len));
  }
  PetscCall(AinsworthSaddleVecDestroy(&left));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves, and says what came of it */
static PetscErrorCode SolveAndVerify(PC pc, PC_Ainsworth *data, PetscBool transpose, AinsworthSaddleVec b, AinsworthSaddleVec y)
{
  KSPConvergedReason reason;
  AinsworthVerdict   verdict = AINSWORTH_VERDICT_MET;
  PetscReal          tol;
  char               why[512];

  PetscFunctionBegin;
  PetscCall(PCAinsworthSolveFields_Private(pc, data, transpose, transpose ? PC_AINSWORTH_SOLVE_AGAIN : PC_AINSWORTH_SOLVE_WATCHED, b, y, &reason));
  /* some methods end without any reason; where rounding stops one, further solves, which are fair to each row, may go on from what it has */
  PetscCall(PCAinsworthAskedFor_Private(data, reason, &tol));
  if (reason >= 0 || (reason == KSP_DIVERGED_BREAKDOWN && PCAinsworthRefinesRows_Private(data, tol))) {
    PetscCall(VerifyAndRefine(pc, data, transpose, (PetscBool)(reason < 0), tol, b, y, &verdict, why, sizeof(why)));
    if (verdict == AINSWORTH_VERDICT_MET) reason = KSP_CONVERGED_RTOL;
  }
  if (reason < 0 || verdict == AINSWORTH_VERDICT_UNMET) PetscCall(PCAinsworthExplain_Private(pc, data, y.primal, reason, why, sizeof(why)));
  /* residuals of an outer method are consistent to rounding alone: what the program passed was looked at in its first application */
  if (verdict == AINSWORTH_VERDICT_CONTRADICTION && data->applications > 2) verdict = AINSWORTH_VERDICT_MET;
  /* at the limit of iterations a flexible outer method may still use what there is; otherwise infinities tell it, which reads no reasons */
  data->usable = (PetscBool)((reason == KSP_DIVERGED_ITS && !data->rigid) || (reason >= 0 && verdict == AINSWORTH_VERDICT_MET));
  if (verdict == AINSWORTH_VERDICT_CONTRADICTION) PetscCall(PCAinsworthFail_Private(pc, data, PC_INCONSISTENT_RHS, PETSC_ERR_ARG_INCOMP, why));
  else if (reason < 0 || verdict != AINSWORTH_VERDICT_MET) PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_NOT_CONVERGED, why));
  else PetscCall(PCAinsworthAgreeOnFailure_Private(pc, PC_NOERROR));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same where rows of the program's matrix have other signs than the blocks; their transposes have other signs in the solution */
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

/* Why nothing can be solved for b, of these fields, and the error that this would be; empty where it can be tried */
static PetscErrorCode FindObstacle(const PC_Ainsworth *data, const IS fields[], Vec b, PetscErrorCode *code, char why[], size_t len)
{
  PetscBool          collide;
  PetscScalar        sum;
  AinsworthSaddleVec part;
  char               row[64];

  PetscFunctionBegin;
  why[0] = 0;
  PetscCall(VecSum(b, &sum)); /* a norm would be kept with b, and PETSc 3.18 then takes norms of other types for known zeros */
  PetscCall(PCAinsworthReductionsCollide_Private(data, b, &collide));
  *code = collide ? PETSC_ERR_SUP : PETSC_ERR_FP;
  if (collide)
    PetscCall(PetscSNPrintf(why, len, "The outer and the inner method, %s, are both pipelined, which PETSc cannot nest: choose -%sksp_type %s",
                            ((PetscObject)data->ksp)->type_name, ((PetscObject)data->ksp)->prefix, KSPPROJECTEDCG));
  if (why[0] || !PetscIsInfOrNanScalar(sum)) PetscFunctionReturn(PETSC_SUCCESS);
  if (data->failure[0] && !data->usable) { /* b is made of what a solve returned that failed: its cause is the true one */
    PetscCall(PetscStrncpy(why, data->failure, len));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleVecGet(b, fields, &part));
  PetscCall(AinsworthSaddleNameNotFinite(&data->saddle, part, row, sizeof(row)));
  PetscCall(AinsworthSaddleVecRestore(b, fields, &part));
  PetscCall(
    PetscSNPrintf(why, len, row[0] ? "The right-hand side holds NaN or Inf in %s" : "The right-hand side holds NaN or Inf, or values too large%s", row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCSetUp() looks at the state of the MatNest, which does not tell of a block changed in place, and at nothing where the preconditioner is to be kept */
static PetscErrorCode Refresh(PC pc)
{
  PC_Ainsworth *data = (PC_Ainsworth *)pc->data;
  PetscBool     changed;

  PetscFunctionBegin;
  PetscCall(PCAinsworthUpdateInputs_Private(pc, data));
  PetscCall(AinsworthSaddleChanged(&data->inputs, &data->saddle, &changed));
  if (data->ordered && !pc->reusepreconditioner) changed = PETSC_TRUE;
  if (changed || (data->stale && !data->refused)) PetscCall(PCSetUp_Ainsworth(pc)); /* PETSc does not repeat what ended with an error */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ApplyOrTranspose(PC pc, PetscBool transpose, Vec b, Vec y)
{
  PC_Ainsworth      *data = (PC_Ainsworth *)pc->data;
  const IS          *in   = transpose ? data->saddle.cols : data->saddle.rows;
  const IS          *out  = transpose ? data->saddle.rows : data->saddle.cols;
  AinsworthSaddleVec left, right;
  PetscErrorCode     code     = PETSC_SUCCESS;
  char               why[512] = "";

  PetscFunctionBegin;
  data->applied = PETSC_TRUE;
  if (!data->stale) PetscCall(FindObstacle(data, in, b, &code, why, sizeof(why)));
  if (data->stale || why[0]) {
    data->usable = PETSC_FALSE;
    PetscCall(VecFlag(y, 1));
    if (why[0]) PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, code, why)); /* otherwise the set-up has said it */
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  data->failure[0] = 0;
  if (data->applications) data->applications++;
  if (data->applications) PetscCall(VecZeroEntries(y)); /* a work vector of the outer method is no guess, whatever the inner one wants */
  PetscCall(AinsworthSaddleVecGet(b, in, &right));
  PetscCall(AinsworthSaddleVecGet(y, out, &left));
  code = data->saddle.sign ? SolveWithSigns(pc, data, transpose, right, left)
                           : SolveAndVerify(pc, data, transpose, right, left); /* to be passed on when the vectors are the program's again */
  if (data->saddle.negated) PetscCall(VecScale(left.dual, -1.0));
  PetscCall(AinsworthSaddleRemoveDualNullSpace(&data->saddle, left.dual));
  PetscCall(AinsworthSaddleVecRestore(b, in, &right));
  PetscCall(AinsworthSaddleVecRestore(y, out, &left));
  if (code) {
    data->stale = data->unfinished = PETSC_TRUE;
    PetscCall(PCAinsworthAfterError_Private(data));
  }
  PetscCall(code);
  PetscCall(VecFlag(y, !data->usable));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The program's vectors may be nests, of parts that are no fields of ours */
static PetscErrorCode ApplyFlat(PC pc, PetscBool transpose, Vec b, Vec y)
{
  const PetscBool other = (PetscBool)!transpose;
  Vec             flat[2];
  PetscErrorCode  code;

  PetscFunctionBegin;
  PetscCall(AinsworthVecGetFlat(pc->pmat, other, b, &flat[0]));
  PetscCall(AinsworthVecGetFlat(pc->pmat, transpose, y, &flat[1]));
  code = ApplyOrTranspose(pc, transpose, flat[0], flat[1]); /* to be passed on when nothing is left behind */
  PetscCall(AinsworthVecRestoreFlat(pc->pmat, other, b, PETSC_FALSE, &flat[0]));
  PetscCall(AinsworthVecRestoreFlat(pc->pmat, transpose, y, PETSC_TRUE, &flat[1]));
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCApply_Ainsworth(PC pc, Vec b, Vec y)
{
  PetscFunctionBegin;
  PetscCall(Refresh(pc));
  PetscCall(ApplyFlat(pc, PETSC_FALSE, b, y));
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
  PetscCall(AinsworthApplyConjugated(b, y, [=](Vec v, Vec w) { return ApplyFlat(pc, (PetscBool)!data->symmetric, v, w); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Column by column, as PETSc does by default, which forgets that one failed when the next one does not; a KSP cannot write Inf into a dense matrix */
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
