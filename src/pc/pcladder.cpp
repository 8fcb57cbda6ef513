/* The ladder: where a solve gives no answer, or would take too long, another solver takes its place, and is judged in the same way (docs/method.md) */
#include "pcainsworth.h"
#include <petsc/private/pcimpl.h>

/* Systems with at most this many unknowns are factored at once: PCBLOCKSA would have a single level, and factor it */
static const PetscInt tiny = 600;

/* Restricts the scale to kept rows, which may have been balanced */
static PetscErrorCode KeptScale(const AinsworthSaddle *sp, Vec *kept)
{
  PetscFunctionBegin;
  PetscCall(MatCreateVecs(sp->C, NULL, kept));
  PetscCall(AinsworthSaddleGetKept(sp, sp->scale.dual, *kept));
  if (sp->balance) PetscCall(VecPointwiseDivide(*kept, *kept, sp->balance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tells whether the program attached a null space to A, or to the whole matrix; known: from set-up */
static PetscErrorCode IsRegular(const PC_Ainsworth *data, PetscBool known, bool *regular)
{
  MatNullSpace common;

  PetscFunctionBegin;
  known = (PetscBool)(known && data->constraints);
  if (known) PetscCall(MatGetNullSpace(data->reduced, &common));
  else PetscCall(AinsworthSaddleCreateNullSpace(&data->saddle, &common));
  *regular = !common;
  if (!known) PetscCall(MatNullSpaceDestroy(&common));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthNextRung_Private - chooses the solver after the present one, which ended like `end`, or the first one. Collective, the same on all ranks */
PetscErrorCode PCAinsworthNextRung_Private(PC pc, PC_Ainsworth *data, PetscBool first, AinsworthEnd end, AinsworthLadderStep *step)
{
  const AinsworthSaddle *sp = &data->saddle;
  AinsworthLadderFacts   facts;
  AinsworthCost          cost;
  MatSolverType          package;
  PetscBool              open = PETSC_FALSE;
  PetscReal              memory;
  PetscInt               n;
  Mat                    opaque;

  PetscFunctionBegin;
  PetscCall(MatGetSize(sp->A, &n, NULL));
  if (!first && end != AINSWORTH_END_DEAR) PetscCall(PCAinsworthMethodIsOpen_Private(pc, data, &open)); /* these never change the method */
  if (!first)
    facts.now = data->wholeTried     ? AINSWORTH_RUNG_WHOLE
                : data->indefinite   ? AINSWORTH_RUNG_GMRES
                : data->escape.taken ? AINSWORTH_RUNG_FACTOR
                                     : AINSWORTH_RUNG_MULTIGRID;
  facts.end     = end;
  facts.cap     = data->choices.ladder;
  facts.own     = data->ownChoice;
  facts.small   = n <= tiny;
  facts.gmres   = !open || data->reporting.stop == AINSWORTH_STOP_ENERGY_ERROR; /* GMRES has no estimate of that error */
  facts.factors = !data->escape.refused && data->choices.pmat.penalty == AINSWORTH_PENALTY_ROW && PCAinsworthFactorType_Private(data, &package);
  PetscCall(IsRegular(data, (PetscBool)(end == AINSWORTH_END_DEAR), &facts.regular));
  *step = AinsworthLadderNext(facts);
  if (step->next != AINSWORTH_RUNG_WHOLE) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthFindOpaque(sp->A, &opaque)); /* what follows costs something */
  facts.regular = facts.regular && !sp->nullSpace;
  facts.entries = !opaque;
  if (facts.regular && facts.entries) {
    PetscCall(AinsworthWholePredict(sp, (PetscBool)(data->symmetric && data->adjoint), &cost));
    PetscCall(PCAinsworthLeastMemory_Private(PetscObjectComm((PetscObject)pc), &memory));
    facts.bytes  = PCAinsworthFactorBytes_Private(&cost);
    facts.memory = memory;
  }
  *step = AinsworthLadderNext(facts);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors the whole system; all later solves with this matrix take it, too. failure: why that cannot be, else empty */
static PetscErrorCode FactorWhole(PC_Ainsworth *data, const char why[], char failure[], size_t len)
{
  AinsworthSaddle   *sp    = &data->saddle;
  AinsworthSaddleVec scale = {sp->scale.primal, NULL};
  const char        *prefix;

  PetscFunctionBegin;
  data->wholeTried = true;
  PetscCall(KSPGetOptionsPrefix(data->ksp, &prefix));
  PetscCall(KeptScale(sp, &scale.dual));
  PetscCall(AinsworthWholeCreate(sp, (PetscBool)(data->symmetric && data->adjoint), scale, prefix, &data->whole, failure, len));
  PetscCall(VecDestroy(&scale.dual));
  if (data->whole) PetscCall(PetscStrncpy(data->climbed, why, sizeof(data->climbed)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthClimb_Private - takes the next solver that can be set up, once the present one ended like `end`; *climbed: there is one. Collective

   why: what the present one ended with, in words
*/
PetscErrorCode PCAinsworthClimb_Private(PC pc, PC_Ainsworth *data, AinsworthEnd end, const char why[], PetscBool *climbed)
{
  AinsworthLadderStep step;
  char                cause[256], failure[256];

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(cause, why, sizeof(cause)));
  for (*climbed = PETSC_FALSE; !*climbed; end = AINSWORTH_END_SETUP) {
    PetscCall(PCAinsworthNextRung_Private(pc, data, PETSC_FALSE, end, &step));
    if (step.next == AINSWORTH_RUNG_NONE) {
      PetscCall(PetscInfo(pc, "%s: no other solver, as %s\n", cause, step.why));
      break;
    }
    PetscCall(PetscInfo(pc, "%s: next is %s, as %s\n", cause, AinsworthRungName(step.next), step.why));
    failure[0] = 0;
    if (step.next == AINSWORTH_RUNG_FACTOR)
      PetscCall(PCAinsworthEscapeTake_Private(pc, data, "as the solve with multigrid gave no answer", failure, sizeof(failure)));
    else if (step.next == AINSWORTH_RUNG_GMRES) PetscCall(PCAinsworthTakeGMRES_Private(data));
    else PetscCall(FactorWhole(data, cause, failure, sizeof(failure)));
    *climbed = (PetscBool)!failure[0];
    if (failure[0]) PetscCall(PetscStrncpy(cause, failure, sizeof(cause)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthForgetWhole_Private - starts with the reduced system again, for another matrix */
PetscErrorCode PCAinsworthForgetWhole_Private(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(AinsworthWholeDestroy(&data->whole));
  data->wholeTried = false;
  PetscFunctionReturn(PETSC_SUCCESS);
}
