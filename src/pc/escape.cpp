/* Watches a reduced solve: if the rest would take longer than a factorization of M_*, it ends (docs/extremes.md) */
#include "pcainsworth.h"
#include "../guard.h"

/*
   The convergence test of a watched solve: ends it if the rest would take longer than a factorization

   All ranks have the same norms and prices, so that all end alike
*/
static PetscErrorCode LookAhead(KSP ksp, PetscInt step, PetscReal norm, KSPConvergedReason *reason, void *ctx)
{
  PCAinsworthWatch  *watch = (PCAinsworthWatch *)ctx;
  PC_Ainsworth      *data  = watch->data;
  PCAinsworthEscape *e     = &data->escape;

  PetscReal rtol, atol;

  PetscFunctionBegin;
  PetscCall((*watch->converged)(ksp, step, norm, reason, watch->test));
  if (!step) e->series = AinsworthSeries();
  e->series.norms.push_back((double)norm);
  PetscCall(KSPGetTolerances(ksp, &rtol, &atol, NULL, NULL));
  if (data->reporting.settings.stop == AINSWORTH_STOP_ENERGY_ERROR) rtol = data->reporting.settings.rtol;
  e->series.goal = PetscMax(rtol * (PetscReal)e->series.norms[0], atol);
  if (*reason || PetscIsInfOrNanReal(norm) || norm <= e->series.goal) PetscFunctionReturn(PETSC_SUCCESS);
  if (!AinsworthGivesUp(e->series, (double)PCAinsworthEscapePrice_Private(data))) PetscFunctionReturn(PETSC_SUCCESS);
  if (e->facts.fill == 0.0) { /* it is predicted only where any factorization would be worth its price */
    PetscCall(PCAinsworthEscapeCost_Private(data));
    if (!AinsworthGivesUp(e->series, (double)PCAinsworthEscapePrice_Private(data))) PetscFunctionReturn(PETSC_SUCCESS);
  }
  watch->end = AINSWORTH_END_DEAR;
  *reason    = KSP_CONVERGED_ITS; /* not a failure */
  PetscCall(PetscSNPrintf(e->why, sizeof(e->why),
                          "for %.2g operations, at the price of %.0f iterations with multigrid, of which more were left after %" PetscInt_FMT,
                          e->facts.operations, (double)PCAinsworthEscapePrice_Private(data), step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthWatchBegin_Private - before a reduced solve, watches it if a factorization may replace multigrid */
PetscErrorCode PCAinsworthWatchBegin_Private(PC pc, PC_Ainsworth *data, PCAinsworthWatch *watch)
{
  PCAinsworthEscape  *e = &data->escape;
  AinsworthLadderStep step;
  PetscInt            n;
  PetscReal           entries;
  KSPNormType         norm;

  PetscFunctionBegin;
  *watch      = PCAinsworthWatch();
  watch->data = data;
  watch->end  = AINSWORTH_END_ANSWER;
  PetscCall(KSPGetNormType(data->inner.ksp, &norm));
  if (data->history.factor == AINSWORTH_TAKEN || data->age.type != PC_AINSWORTH_AGE_FRESH || norm == KSP_NORM_NONE) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthNextRung_Private(pc, data, AINSWORTH_END_DEAR, &step));
  if (step.next != AINSWORTH_RUNG_FACTOR) PetscFunctionReturn(PETSC_SUCCESS);
  if (e->facts.unknowns == 0.0) {
    PetscCall(PCAinsworthMeasure_Private(data, &n, &entries));
    PetscCall(PCAinsworthEscapeFacts_Private(data, n, entries));
  }
  PetscCall(KSPGetAndClearConvergenceTest(data->inner.ksp, &watch->converged, &watch->test, &watch->destroy));
  PetscCall(KSPSetConvergenceTest(data->inner.ksp, AinsworthGuarded<LookAhead>, watch, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthWatchEnd_Private - restores the KSP, also after an error */
PetscErrorCode PCAinsworthWatchEnd_Private(PCAinsworthWatch *watch)
{
  PC_Ainsworth *data = watch->data;
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  AinsworthTestDestroyFn *destroy;
  void                   *test;

  PetscFunctionBegin;
  if (!watch->converged) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetAndClearConvergenceTest(data->inner.ksp, &converged, &test, &destroy));
  PetscCall(KSPSetConvergenceTest(data->inner.ksp, watch->converged, watch->test, watch->destroy));
  if (watch->end != AINSWORTH_END_DEAR) PetscCall(ISDestroy(&data->inner.order)); /* the next matrix may be another one */
  PetscFunctionReturn(PETSC_SUCCESS);
}
