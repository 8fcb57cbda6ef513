/*
   The reduced solve: from f and g on the kept rows through the first door, by the inner KSP, and through the second
   (projection/matdoors.cpp); another solver may take the place of one that gives no answer
*/
#include "pcainsworth.h"
#include "../inner/together.h"
#include "../projection/matainsworth.h"
#include <petsc/private/kspimpl.h>
#include <petsctime.h>

/*
   Replaces a reduced right-hand side by zero if it is nothing but the rounding of the forces f and A R g that were
   projected out of it

   Constraints alone balance these forces then. In the norm of diag(A)^{-1} a force counts by the motion that it causes,
   and A R g by the energy of R g
*/
static PetscErrorCode ForgetRounding(const PC_Ainsworth *data, Vec f)
{
  PetscReal      norms[2];
  Mat_Ainsworth *ctx;
  Vec            work;

  PetscFunctionBegin;
  if (!data->saddle->constraints() || data->saddle->kept.D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAinsworthGetContext_Private(data->reduced->mat, &ctx));
  PetscCall(VecDuplicate(f, &work));
  for (int k = 0; k < 2; k++) {
    const Vec   v = k ? f : data->reduced->rhs;
    PetscScalar square;

    PetscCall(VecPointwiseMult(work, data->reduced->inverseDiagonal, v));
    PetscCall(VecDot(work, v, &square));
    norms[k] = PetscSqrtReal(PetscAbsScalar(square));
  }
  PetscCall(VecDestroy(&work));
  if (norms[0] <= AinsworthLeast * (norms[1] + PetscSqrtReal(PetscAbsReal(ctx->energy))))
    PetscCall(VecZeroEntries(data->reduced->rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthReduce_Private - computes the right-hand side of the reduced system for f and g on the kept rows */
PetscErrorCode PCAinsworthReduce_Private(PC_Ainsworth *data, PetscBool transpose, AinsworthSaddleVec b)
{
  PetscFunctionBegin;
  if (data->saddle->constraints())
    PetscCall(MatAinsworthReduce_Private(data->reduced->mat, transpose, b.primal, b.dual, data->reduced->rhs));
  else PetscCall(VecCopy(b.primal, data->reduced->rhs));
  PetscCall(ForgetRounding(data, b.primal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes x of a solve for several right-hand sides, with what the KSP tells of it */
static PetscErrorCode TakeFound(PC_Ainsworth *data, Vec x)
{
  const PCAinsworthFound         found  = data->found;
  const AinsworthTogetherColumn &column = found.all->columns[found.column];
  KSP                            ksp    = data->inner.ksp;

  PetscFunctionBegin;
  data->found = PCAinsworthFound(); /* another solve may follow */
  PetscCall(found.all->get(found.column, x));
  ksp->its    = column.iterations;
  ksp->rnorm  = column.norm;
  ksp->reason = column.reason;
  PetscCall(KSPConvergedReasonViewFromOptions(ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Solves the reduced system for f and g once, for at most `limit` iterations (0: those of the KSP); *end: why another
   solver has to take its place, if it has to

   watched: the report sees the solve, and its stop refers to x. The report restores the KSP also after an error, which
   is raised then
*/
static PetscErrorCode SolveOnce(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched, PetscInt limit,
                                AinsworthSaddleVec b, Vec x, AinsworthEnd *end)
{
  KSP            ksp = data->inner.ksp;
  Vec            rhs = data->reduced->rhs;
  PetscReal      rtol, atol, dtol;
  PetscInt       most;
  PetscLogDouble start;
  PetscErrorCode error;
  AinsworthWatch watch;

  PetscFunctionBegin;
  if (data->found.all) {
    *end = AINSWORTH_END_ANSWER;
    PetscCall(TakeFound(data, x));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscTime(&start));
  PetscCall(PCAinsworthReduce_Private(data, transpose, b));
  PetscCall(AinsworthSolverEnter(data, ksp, x));
  if (watched) PetscCall(PCAinsworthReportBegin_Private(data, b, start));
  PetscCall(AinsworthSolverWatchBegin(pc, data, &watch));
  PetscCall(AinsworthSolverKeepCoefficients(&data->inner));
  PetscCall(KSPGetTolerances(ksp, &rtol, &atol, &dtol, &most));
  if (limit) PetscCall(KSPSetTolerances(ksp, rtol, atol, dtol, limit));
  /* checked when everything is restored; conjugate gradients are for a symmetric A */
  error = transpose && !data->inner.operation ? KSPSolveTranspose(ksp, rhs, x) : KSPSolve(ksp, rhs, x);
  if (limit) PetscCall(KSPSetTolerances(ksp, rtol, atol, dtol, most));
  PetscCall(AinsworthSolverWatchEnd(&watch));
  if (watched && data->reporting.report)
    PetscCall(AinsworthReportEnd(data->reporting.report, ksp, (PetscBool)(error != PETSC_SUCCESS)));
  PetscCall(AinsworthSolverLeave(data, ksp));
  PetscCall(error);
  *end = watch.end;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Solves the reduced system for f and g, again as long as another solver takes the place of the last one, which may be
   one for the whole system
*/
static PetscErrorCode SolveInner(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched,
                                 AinsworthSaddleVec b, Vec x, KSPConvergedReason *reason)
{
  PetscBool    again = PETSC_TRUE;
  PetscInt     limit;
  AinsworthEnd end = AINSWORTH_END_ANSWER;

  PetscFunctionBegin;
  while (again && !data->whole.factor) {
    PetscCall(AinsworthSolverLimit(pc, data, &limit));
    PetscCall(SolveOnce(pc, data, transpose, watched, limit, b, x, &end));
    PetscCall(AinsworthSolverGetReason(data, (PetscBool)(data->outer.method == AINSWORTH_OUTER_ANSWER), reason));
    if (limit && *reason < 0) end = AINSWORTH_END_OLD;
    again = PETSC_FALSE;
    if (end == AINSWORTH_END_ANSWER) break;
    PetscCall(PCAinsworthReplan_Private(
      pc, data, end, end == AINSWORTH_END_DEAR ? "Multigrid is slow" : "The inner preconditioner is old", &again));
    if (!again) *reason = KSP_DIVERGED_PC_FAILED; /* the inner solver is lost */
  }
  /* refinements do not predict other solves */
  if (!data->whole.factor && *reason > 0 && watched) PetscCall(AinsworthSolverCount(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether the inner method claims to solve, so that its result is judged: not if it ends without a test, as
   after one cycle, and an outer method iterates

   That one measures the residual itself
*/
PetscErrorCode PCAinsworthIsClaim_Private(const PC_Ainsworth *data, PetscBool *claim)
{
  KSPNormType norm;

  PetscFunctionBegin;
  PetscCall(KSPGetNormType(data->inner.ksp, &norm));
  *claim = (PetscBool)(data->outer.method <= AINSWORTH_OUTER_ANSWER || norm != KSP_NORM_NONE);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Solves for x and lambda by the reduced system, all on kept rows; transpose: with the transpose of A; *known:
   data->reduced->Ax was computed as well
*/
static PetscErrorCode SolveReduced(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched,
                                   AinsworthSaddleVec b, AinsworthSaddleVec y, PetscBool *known,
                                   KSPConvergedReason *reason)
{
  const PCAinsworthFound found = data->found;
  PetscInt               n;

  PetscFunctionBegin;
  PetscCall(VecGetSize(y.primal, &n));
  *reason = KSP_CONVERGED_HAPPY_BREAKDOWN;
  /* Ker C = 0: the constraints alone determine x */
  if (data->saddle->constraints() == n && !data->saddle->kept.D) PetscCall(VecZeroEntries(y.primal));
  else PetscCall(SolveInner(pc, data, transpose, watched, b, y.primal, reason));
  PetscCall(PCAinsworthIsClaim_Private(data, known));
  *known = (PetscBool)(*known && !data->whole.factor && data->saddle->constraints() &&
                       data->saddle->A == data->saddle->block[AINSWORTH_BLOCK_A] && !data->saddle->known);
  if (data->whole.factor) { /* at once, or because the reduced solve was given up for it */
    *reason = KSP_CONVERGED_RTOL;
    PetscCall(AinsworthWholeSolve(data->whole.factor, transpose, b, y));
  } else if (data->saddle->constraints()) {
    if (found.all) PetscCall(found.all->getProduct(found.column, data->reduced->Ax));
    PetscCall(MatAinsworthRecover_Private(data->reduced->mat, transpose, (PetscBool)(found.all != NULL), b, y,
                                          *known || found.all ? (Vec)data->reduced->Ax : NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Restricts the program's fields to the kept rows, solves, and extends the solution */
PetscErrorCode PCAinsworthSolveFields_Private(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool watched,
                                              AinsworthSaddleVec b, AinsworthSaddleVec y, PetscBool *known,
                                              KSPConvergedReason *reason)
{
  const AinsworthReduced *r = data->reduced.get();

  PetscFunctionBegin;
  if (r->g) {
    const AinsworthSaddleVec kept = {r->f ? (Vec)r->f : b.primal, r->g};

    PetscCall(AinsworthSaddleRestrict(data->saddle.get(), b, kept));
    PetscCall(SolveReduced(pc, data, transpose, watched, kept, {y.primal, r->lambda}, known, reason));
    PetscCall(AinsworthSaddleExtend(data->saddle.get(), b, r->lambda, y));
  } else PetscCall(SolveReduced(pc, data, transpose, watched, b, y, known, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Solves for what an earlier solve left, to a relative tolerance of at least `loose`; stopped: rounding ended that one,
   so that this may not last longer
*/
PetscErrorCode PCAinsworthSolveLoosely_Private(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool stopped,
                                               PetscReal loose, AinsworthSaddleVec left, AinsworthSaddleVec p)
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
  PetscCall(KSPSetTolerances(data->inner.ksp, PetscMax(rtol, loose), atol, dtol,
                             stopped ? PetscMin(PetscMax(its, 1), limit) : limit));
  error = PCAinsworthSolveFields_Private(pc, data, transpose, PETSC_FALSE, left, p, &known, &reason);
  PetscCall(KSPSetTolerances(data->inner.ksp, rtol, atol, dtol, limit));
  data->inner.ksp->its   = its; /* what the program asks for is the solve of its system */
  data->inner.ksp->rnorm = rnorm;
  PetscCall(error);
  PetscCall(AinsworthSaddleRemoveNullSpace(data->saddle.get(), data->given.inputs.amat, transpose, p, &removed));
  PetscFunctionReturn(PETSC_SUCCESS);
}
