/* If multigrid does not fit, M_* is factored and the solve repeated (docs/models.md) */
#include "pcainsworth.h"
#include "../guard.h"
#include "../operator/matainsworth.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>

/* Gets the number of unknowns, and of the entries of A; a choice stands as long as the former stays the same and the latter about the same */
static PetscErrorCode Measure(const PC_Ainsworth *data, PetscInt *n, PetscReal *entries)
{
  Mat     aij;
  MatInfo info;

  PetscFunctionBegin;
  PetscCall(MatGetSize(data->saddle.A, n, NULL));
  PetscCall(AinsworthGetAIJ(data->saddle.A, &aij));
  PetscCall(MatGetInfo(aij, MAT_GLOBAL_SUM, &info));
  *entries = (PetscReal)info.nz_used;
  PetscCall(MatDestroy(&aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthEscapeAtOnce_Private - chooses a factorization at once if the system is too small for multigrid to be worth its set-up */
PetscErrorCode PCAinsworthEscapeAtOnce_Private(PC pc, PC_Ainsworth *data, PetscBool *factor)
{
  PCAinsworthEscape  *e = &data->escape;
  AinsworthLadderStep step;

  PetscFunctionBegin;
  PetscCall(PCAinsworthNextRung_Private(pc, data, PETSC_TRUE, AINSWORTH_END_ANSWER, &step));
  *factor = (PetscBool)(step.next == AINSWORTH_RUNG_FACTOR);
  if (!*factor) PetscFunctionReturn(PETSC_SUCCESS);
  e->taken = PETSC_TRUE;
  PetscCall(Measure(data, &e->n, &e->entries));
  PetscCall(PetscSNPrintf(e->why, sizeof(e->why), "at once, as %s for %" PetscInt_FMT " unknowns", step.why, e->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthEscapeReview_Private - checks before a set-up whether an earlier choice holds for the current matrix */
PetscErrorCode PCAinsworthEscapeReview_Private(PC pc, PC_Ainsworth *data)
{
  PCAinsworthEscape *e = &data->escape;
  PetscInt           n;
  PetscReal          entries;
  PetscBool          type;
  MatSolverType      package;
  PC                 inner;

  PetscFunctionBegin;
  e->facts = AinsworthPriceFacts();
  if (!e->taken && !e->refused) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &type, PCCHOLESKY, PCLU, ""));
  if (e->taken && (!type || !data->ownChoice)) { /* the program has made its own choice since */
    e->taken = PETSC_FALSE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(Measure(data, &n, &entries));
  if (n == e->n && PetscAbsReal(entries - e->entries) <= 0.25 * e->entries) {
    PCType wanted = PCAinsworthFactorType_Private(data, &package);

    if (e->refused || !wanted) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(PetscObjectTypeCompare((PetscObject)inner, wanted, &type));
    if (type) PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscInfo(pc, "The matrix is another one: multigrid is tried again\n"));
  e->refused = PETSC_FALSE;
  if (!e->taken) PetscFunctionReturn(PETSC_SUCCESS);
  e->taken = PETSC_FALSE;
  PetscCall(PCAinsworthChooseType_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks by a solve whether the factorization is accurate: M may be singular to rounding without a bad pivot */
static PetscErrorCode Solves(PC inner, Mat M, PetscBool *good)
{
  static const PetscReal enough = 1e-3;
  Vec                    x, b, y;
  PetscReal              norm, error;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(M, &x, &b));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecSetRandom(x, NULL));
  PetscCall(MatMult(M, x, b));
  PetscCall(PCApply(inner, b, y));
  PetscCall(VecAXPY(y, -1.0, x));
  PetscCall(VecNorm(x, NORM_2, &norm));
  PetscCall(VecNorm(y, NORM_2, &error));
  *good = (PetscBool)(error <= enough * norm); /* not for NaN */
  for (Vec *v : {&x, &b, &y}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthEscapeCheck_Private - after a set-up, returns to multigrid, for another set-up (*again), if M_* could not be factored by our choice */
PetscErrorCode PCAinsworthEscapeCheck_Private(PC pc, PC_Ainsworth *data, PetscBool definite, PetscBool *again)
{
  PCFailedReason      reason;
  PetscBool           good = definite;
  AinsworthLadderStep step;
  Mat                 M;
  PC                  inner;

  PetscFunctionBegin;
  *again = PETSC_FALSE;
  if (!data->escape.taken) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(data->ksp, &inner));
  if (definite) {
    PetscCall(PCGetFailedReason(inner, &reason));
    PetscCall(PCGetOperators(inner, NULL, &M));
    if (reason) good = PETSC_FALSE;
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &good, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)pc)));
    if (good) PetscCall(Solves(inner, M, &good));
  }
  if (good) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthNextRung_Private(pc, data, PETSC_FALSE, AINSWORTH_END_SETUP, &step));
  if (step.next != AINSWORTH_RUNG_MULTIGRID) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(pc, "The preconditioning matrix cannot be factored: multigrid takes its place\n"));
  data->escape.taken   = PETSC_FALSE;
  data->escape.refused = *again = PETSC_TRUE;
  PetscCall(PCAinsworthChooseType_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Replaces the convergence test: ends the solve if the rest would take longer than a factorization

   All ranks have the same norms and prices, so that all end alike
*/
static PetscErrorCode LookAhead(KSP ksp, PetscInt step, PetscReal norm, KSPConvergedReason *reason, void *ctx)
{
  PC                 pc   = (PC)ctx;
  PC_Ainsworth      *data = (PC_Ainsworth *)pc->data;
  PCAinsworthEscape *e    = &data->escape;

  PetscFunctionBegin;
  PetscCall((*e->converged)(ksp, step, norm, reason, e->test));
  if (!step) e->series = AinsworthSeries();
  e->series.norms.push_back((double)norm);
  e->series.goal = PetscMax((data->reporting.stop == AINSWORTH_STOP_ENERGY_ERROR ? data->reporting.rtol : ksp->rtol) * (PetscReal)e->series.norms[0],
                            ksp->abstol);
  if (*reason || PetscIsInfOrNanReal(norm) || norm <= e->series.goal) PetscFunctionReturn(PETSC_SUCCESS);
  if (!AinsworthGivesUp(e->series, (double)PCAinsworthEscapePrice_Private(data))) PetscFunctionReturn(PETSC_SUCCESS);
  if (e->facts.fill == 0.0) { /* it is predicted only where any factorization would be worth its price */
    PetscCall(PCAinsworthEscapeCost_Private(pc, data));
    if (!AinsworthGivesUp(e->series, (double)PCAinsworthEscapePrice_Private(data))) PetscFunctionReturn(PETSC_SUCCESS);
  }
  e->now  = PETSC_TRUE;
  *reason = KSP_CONVERGED_ITS; /* not a failure, which -ksp_error_if_not_converged would turn into an error */
  PetscCall(PetscSNPrintf(e->why, sizeof(e->why),
                          "for %.2g operations, at the price of %.0f iterations with multigrid, of which more were left after %" PetscInt_FMT,
                          e->facts.operations, (double)PCAinsworthEscapePrice_Private(data), step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthEscapeBegin_Private - before a reduced solve, watches it if a factorization may replace multigrid

   The failure of a solve with a factorization of our choice is not an error yet
*/
PetscErrorCode PCAinsworthEscapeBegin_Private(PC pc, PC_Ainsworth *data)
{
  PCAinsworthEscape  *e = &data->escape;
  AinsworthLadderStep step;
  PetscBool           multigrid, may;
  PetscInt            n;
  PetscReal           entries;
  KSPNormType         norm;
  PC                  inner;

  PetscFunctionBegin;
  e->now   = PETSC_FALSE;
  e->error = data->ksp->errorifnotconverged;
  if (e->taken) data->ksp->errorifnotconverged = PETSC_FALSE;
  PetscCall(PCAinsworthIsOld_Private(data, &may));
  if (e->taken || may) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCAinsworthIsOwnMultigrid_Private(data, &multigrid));
  PetscCall(KSPGetNormType(data->ksp, &norm));
  if (!multigrid || norm == KSP_NORM_NONE) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthNextRung_Private(pc, data, PETSC_FALSE, AINSWORTH_END_DEAR, &step));
  if (step.next != AINSWORTH_RUNG_FACTOR) PetscFunctionReturn(PETSC_SUCCESS);
  if (e->facts.unknowns == 0.0) {
    PetscCall(Measure(data, &n, &entries));
    PetscCall(PCAinsworthEscapeFacts_Private(pc, data, n, entries));
  }
  PetscCall(KSPGetAndClearConvergenceTest(data->ksp, &e->converged, &e->test, &e->destroy));
  PetscCall(KSPSetConvergenceTest(data->ksp, AinsworthGuarded<LookAhead>, pc, NULL));
  e->watching = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthEscapeEnd_Private - restores the KSP, also after an error */
PetscErrorCode PCAinsworthEscapeEnd_Private(PC_Ainsworth *data)
{
  PCAinsworthEscape *e = &data->escape;
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  AinsworthTestDestroyFn *destroy;
  void                   *test;

  PetscFunctionBegin;
  data->ksp->errorifnotconverged = e->error;
  if (!e->watching) PetscFunctionReturn(PETSC_SUCCESS);
  e->watching = PETSC_FALSE;
  PetscCall(KSPGetAndClearConvergenceTest(data->ksp, &converged, &test, &destroy));
  PetscCall(KSPSetConvergenceTest(data->ksp, e->converged, e->test, e->destroy));
  if (!e->now) PetscCall(ISDestroy(&data->order)); /* the next matrix may be another one */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthEscapeTake_Private - factors M_* and sets up the inner solver with it; failure: why that cannot be, else empty */
PetscErrorCode PCAinsworthEscapeTake_Private(PC pc, PC_Ainsworth *data, const char why[], char failure[], size_t len)
{
  PCAinsworthEscape *e       = &data->escape;
  Mat_Ainsworth     *reduced = NULL;

  PetscFunctionBegin;
  if (why != e->why) PetscCall(PetscStrncpy(e->why, why, sizeof(e->why)));
  PetscCall(Measure(data, &e->n, &e->entries));
  e->now   = PETSC_FALSE;
  e->taken = PETSC_TRUE;
  PetscCall(PCAinsworthChooseType_Private(pc, data));
  PetscCall(PetscInfo(pc, "The preconditioning matrix is factored %s\n", e->why));
  if (data->constraints) PetscCall(MatAinsworthSetUpProjector_Private(data->reduced, &reduced));
  failure[0] = 0;
  PetscCall(PCAinsworthSetUpInner_Private(pc, data, reduced, PETSC_FALSE, failure, len));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthEscape_Private - after a reduced solve, replaces the preconditioner if the solve has to be repeated (*again) with another one */
PetscErrorCode PCAinsworthEscape_Private(PC pc, PC_Ainsworth *data, PetscBool *again)
{
  PetscFunctionBegin;
  *again = data->escape.now;
  if (!*again) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthEscapeTake_Private(pc, data, data->escape.why, data->failure, sizeof(data->failure)));
  if (data->failure[0]) PetscCall(PCAinsworthClimb_Private(pc, data, AINSWORTH_END_SETUP, data->failure, again));
  if (data->whole) *again = PETSC_FALSE;
  if (*again || data->whole) data->failure[0] = 0;
  else {
    data->stale       = PETSC_TRUE;
    data->ksp->reason = KSP_DIVERGED_PC_FAILED;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
