/* Watches a reduced solve: if the rest would take longer than a factorization of M_*, it ends (docs/extremes.md) */
#include "solver.h"
#include "../base/guard.h"

/*
   The convergence test of a watched solve: ends it if the rest would take longer than a factorization

   All ranks have the same norms and prices, so that all end alike
*/
static PetscErrorCode LookAhead(KSP ksp, PetscInt step, PetscReal norm, KSPConvergedReason *reason, void *ctx)
{
  AinsworthWatch  *watch  = (AinsworthWatch *)ctx;
  AinsworthSolver *solver = watch->solver;
  AinsworthEscape *e      = &solver->escape;

  PetscReal rtol, atol;

  PetscFunctionBegin;
  PetscCall((*watch->converged)(ksp, step, norm, reason, watch->test));
  if (!step) e->series = AinsworthSeries();
  e->series.norms.push_back((double)norm);
  PetscCall(KSPGetTolerances(ksp, &rtol, &atol, NULL, NULL));
  if (solver->settings.stop == AINSWORTH_STOP_ENERGY_ERROR) rtol = solver->settings.rtol;
  e->series.goal = PetscMax(rtol * (PetscReal)e->series.norms[0], atol);
  if (*reason || PetscIsInfOrNanReal(norm) || norm <= e->series.goal) PetscFunctionReturn(PETSC_SUCCESS);
  if (!AinsworthGivesUp(e->series, (double)AinsworthSolverEscapePrice(solver))) PetscFunctionReturn(PETSC_SUCCESS);
  if (e->facts.fill == 0.0) { /* it is predicted only where any factorization would be worth its price */
    PetscCall(AinsworthSolverEscapeCost(solver));
    if (!AinsworthGivesUp(e->series, (double)AinsworthSolverEscapePrice(solver))) PetscFunctionReturn(PETSC_SUCCESS);
  }
  watch->end = AINSWORTH_END_DEAR;
  *reason    = KSP_CONVERGED_ITS; /* not a failure */
  PetscCall(PetscSNPrintf(
    e->why, sizeof(e->why),
    "for %.2g operations, at the price of %.0f iterations with multigrid, of which more were left after %" PetscInt_FMT,
    e->facts.operations, (double)AinsworthSolverEscapePrice(solver), step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverWatchBegin - before a reduced solve, watches it if a factorization may replace multigrid */
PetscErrorCode AinsworthSolverWatchBegin(PC pc, AinsworthSolver *solver, AinsworthWatch *watch)
{
  AinsworthEscape    *e = &solver->escape;
  AinsworthLadderStep step;
  PetscInt            n;
  PetscReal           entries;
  KSPNormType         norm;

  PetscFunctionBegin;
  *watch        = AinsworthWatch();
  watch->solver = solver;
  watch->end    = AINSWORTH_END_ANSWER;
  PetscCall(KSPGetNormType(solver->inner.ksp, &norm));
  if (solver->history.factor == AINSWORTH_TAKEN || solver->age.type != PC_AINSWORTH_AGE_FRESH || norm == KSP_NORM_NONE)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSolverNextRung(pc, solver, AINSWORTH_END_DEAR, &step));
  if (step.next != AINSWORTH_RUNG_FACTOR) PetscFunctionReturn(PETSC_SUCCESS);
  if (e->facts.unknowns == 0.0) {
    PetscCall(AinsworthSolverMeasure(solver, &n, &entries));
    PetscCall(AinsworthSolverEscapeFacts(solver, n, entries));
  }
  PetscCall(KSPGetAndClearConvergenceTest(solver->inner.ksp, &watch->converged, &watch->test, &watch->destroy));
  PetscCall(KSPSetConvergenceTest(solver->inner.ksp, AinsworthGuarded<LookAhead>, watch, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverWatchEnd - restores the KSP, also after an error */
PetscErrorCode AinsworthSolverWatchEnd(AinsworthWatch *watch)
{
  AinsworthSolver *solver = watch->solver;
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  AinsworthTestDestroyFn *destroy;
  void                   *test;

  PetscFunctionBegin;
  if (!watch->converged) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetAndClearConvergenceTest(solver->inner.ksp, &converged, &test, &destroy));
  PetscCall(KSPSetConvergenceTest(solver->inner.ksp, watch->converged, watch->test, watch->destroy));
  /* the next matrix may be another one */
  if (watch->end != AINSWORTH_END_DEAR) solver->inner.order.reset();
  PetscFunctionReturn(PETSC_SUCCESS);
}
