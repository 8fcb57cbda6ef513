/*
   The one way back: where a solve gives no answer, or would take too long, another solver takes its place, and is
   judged in the same way (docs/method.md)
*/
#include "pcainsworth.h"
#include "../base/layouts.h"

/* Restricts the scale to kept rows, which may have been balanced */
static PetscErrorCode KeptScale(const AinsworthSaddle *sp, Vec *kept)
{
  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(sp->kept.C, NULL, kept));
  PetscCall(AinsworthSaddleGetKept(sp, sp->scale.dual, *kept));
  if (sp->balance) PetscCall(VecPointwiseDivide(*kept, *kept, sp->balance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors the whole system; all later solves with this matrix take it, too. failure: why that cannot be */
static PetscErrorCode FactorWhole(PC_Ainsworth *data, const char why[], char failure[], size_t len)
{
  const AinsworthSaddle *sp    = data->saddle.get();
  AinsworthSaddleVec     scale = {sp->scale.primal, NULL};
  const char            *prefix;

  PetscFunctionBegin;
  data->history.whole = AINSWORTH_FAILED;
  PetscCall(KSPGetOptionsPrefix(data->inner.ksp, &prefix));
  PetscCall(KeptScale(sp, &scale.dual));
  PetscCall(AinsworthWholeCreate(sp, (PetscBool)(sp->symmetric && sp->adjoint), scale, prefix, &data->whole.factor,
                                 failure, len));
  PetscCall(VecDestroy(&scale.dual));
  if (!data->whole.factor) PetscFunctionReturn(PETSC_SUCCESS);
  data->history.whole = AINSWORTH_TAKEN;
  PetscCall(PetscStrncpy(data->whole.why, why, sizeof(data->whole.why)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Remembers for the plan what the next solver is, and what became of the last one, which ended like `end` */
static PetscErrorCode Remember(PC_Ainsworth *data, AinsworthRung next, AinsworthEnd end)
{
  const char *given = end == AINSWORTH_END_DEAR ? data->escape.why : "as the solve with multigrid gave no answer";

  PetscFunctionBegin;
  if (end == AINSWORTH_END_OLD) PetscFunctionReturn(PETSC_SUCCESS); /* the same solver, rebuilt */
  if (end == AINSWORTH_END_UNFIT) data->history.blocks = AINSWORTH_FAILED;
  else if (next == AINSWORTH_RUNG_MULTIGRID) PetscCall(AinsworthSolverRememberFactor(data, AINSWORTH_FAILED, ""));
  else if (next == AINSWORTH_RUNG_FACTOR) PetscCall(AinsworthSolverRememberFactor(data, AINSWORTH_TAKEN, given));
  else data->history.gmres = AINSWORTH_TAKEN;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthReplan_Private - takes the next solver that can be set up, once the present one ended like `end`; *again:
   there is one. Collective

   why: what the present one ended with, in words. If none is left after a set-up failed, data->outcome.why says why,
   and the next solve begins with a set-up
*/
PetscErrorCode PCAinsworthReplan_Private(PC pc, PC_Ainsworth *data, AinsworthEnd end, const char why[],
                                         PetscBool *again)
{
  AinsworthLadderStep step;
  char                cause[256], failure[256];
  bool                lost = false;

  PetscFunctionBegin;
  *again = PETSC_FALSE;
  PetscCall(PetscStrncpy(cause, why, sizeof(cause)));
  while (!*again) {
    failure[0] = 0;
    PetscCall(AinsworthSolverNextRung(pc, data, end, &step));
    if (step.next == AINSWORTH_RUNG_NONE) {
      PetscCall(PetscInfo(pc, "%s: no other solver, as %s\n", cause, step.why));
      break;
    }
    PetscCall(PetscInfo(pc, "%s: next is %s, as %s\n", cause, AinsworthRungName(step.next), step.why));
    if (step.next == AINSWORTH_RUNG_WHOLE) {
      PetscCall(FactorWhole(data, cause, failure, sizeof(failure)));
      end = data->whole.factor ? AINSWORTH_END_ANSWER : AINSWORTH_END_SETUP;
    } else {
      PetscCall(Remember(data, step.next, end));
      if (step.next == AINSWORTH_RUNG_GMRES) PetscCall(AinsworthSolverChangeMethod(pc, data, &end));
      else PetscCall(AinsworthSolverSetUpInner(pc, data, PETSC_FALSE, &end, failure, sizeof(failure)));
      lost = end != AINSWORTH_END_ANSWER;
    }
    *again = (PetscBool)(end == AINSWORTH_END_ANSWER);
    if (!*again) PetscCall(PetscStrncpy(cause, failure, sizeof(cause)));
  }
  if (*again || !lost) PetscFunctionReturn(PETSC_SUCCESS);
  data->state = PC_AINSWORTH_STALE;
  PetscCall(PetscStrncpy(data->outcome.why, cause, sizeof(data->outcome.why)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthForgetWhole_Private - starts with the reduced system again, for another matrix */
PetscErrorCode PCAinsworthForgetWhole_Private(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(AinsworthWholeDestroy(&data->whole.factor));
  data->history.whole = AINSWORTH_UNTRIED;
  PetscFunctionReturn(PETSC_SUCCESS);
}
