/* The last rung of the ladder: where the reduced solve gives no answer the whole system is factored, and judged in the same way (docs/method.md) */
#include "pcainsworth.h"
#include "../loops.h"
#include <petsc/private/pcimpl.h>

const char *const PCAinsworthRungs[] = {"multigrid", "factor", "gmres", "whole", "PCAinsworthRung", "PC_AINSWORTH_RUNG_", NULL};

/* Restricts the scale to kept rows, which may have been balanced */
static PetscErrorCode KeptScale(const AinsworthSaddle *sp, Vec *kept)
{
  PetscScalar *k;
  PetscInt     n = 0;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(sp->C, NULL, kept));
  PetscCall(VecGetArrayWrite(*kept, &k));
  PetscCall(AinsworthForEntries({sp->scale.dual}, [&](PetscInt i, PetscScalar s) {
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) k[n++] = s;
  }));
  PetscCall(VecRestoreArrayWrite(*kept, &k));
  if (sp->balance) PetscCall(VecPointwiseDivide(*kept, *kept, sp->balance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the whole system may be factored: allowed, not tried for this matrix, accessible, regular as far as the program tells, and within memory */
static PetscErrorCode MayFactor(const PC_Ainsworth *data, PetscBool symmetric, PetscBool *may, const char **why)
{
  const AinsworthSaddle *sp = &data->saddle;
  MatNullSpace           common;
  Mat                    opaque;
  AinsworthCost          cost;

  PetscFunctionBegin;
  *may = PETSC_FALSE;
  *why = "was tried before";
  if (data->rung == PC_AINSWORTH_RUNG_WHOLE) PetscFunctionReturn(PETSC_SUCCESS);
  *why = "is more than -pc_ainsworth_ladder allows";
  if (data->choices.ladder < PC_AINSWORTH_RUNG_WHOLE) PetscFunctionReturn(PETSC_SUCCESS);
  *why = "needs entries that are not accessible";
  PetscCall(AinsworthFindOpaque(sp->A, &opaque));
  if (opaque) PetscFunctionReturn(PETSC_SUCCESS);
  *why = "has the null space that the program attached";
  PetscCall(AinsworthSaddleCreateNullSpace(sp, &common));
  *may = (PetscBool)(!common && !sp->nullSpace);
  PetscCall(MatNullSpaceDestroy(&common));
  if (!*may) PetscFunctionReturn(PETSC_SUCCESS);
  *why = "does not fit in memory";
  PetscCall(AinsworthWholePredict(sp, symmetric, &cost));
  PetscCall(PCAinsworthFits_Private(PetscObjectComm((PetscObject)sp->A), cost.entries, may));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthClimb_Private - factors the whole system once its reduced form has been given up for `why`; *climbed: the next solve is with that factor. Collective

   All later solves with this matrix take it, too
*/
PetscErrorCode PCAinsworthClimb_Private(PC pc, PC_Ainsworth *data, const char why[], PetscBool *climbed)
{
  const PetscBool    symmetric = (PetscBool)(data->symmetric && data->adjoint);
  AinsworthSaddle   *sp        = &data->saddle;
  AinsworthSaddleVec scale     = {sp->scale.primal, NULL};
  const char        *obstacle, *prefix;
  char               cause[256];

  PetscFunctionBegin;
  PetscCall(MayFactor(data, symmetric, climbed, &obstacle));
  if (!*climbed) {
    PetscCall(PetscInfo(pc, "%s: a factorization of the whole system %s\n", why, obstacle));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscInfo(pc, "%s: the whole system is factored\n", why));
  data->rung = PC_AINSWORTH_RUNG_WHOLE;
  PetscCall(KSPGetOptionsPrefix(data->ksp, &prefix));
  PetscCall(KeptScale(sp, &scale.dual));
  PetscCall(AinsworthWholeCreate(sp, symmetric, scale, prefix, &data->whole, cause, sizeof(cause)));
  PetscCall(VecDestroy(&scale.dual));
  *climbed = (PetscBool)(data->whole != NULL);
  if (!*climbed) PetscCall(PetscInfo(pc, "%s\n", cause));
  else PetscCall(PetscStrncpy(data->climbed, why, sizeof(data->climbed)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthForgetWhole_Private - starts with the reduced system again, for another matrix */
PetscErrorCode PCAinsworthForgetWhole_Private(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(AinsworthWholeDestroy(&data->whole));
  data->rung = PC_AINSWORTH_RUNG_MULTIGRID;
  PetscFunctionReturn(PETSC_SUCCESS);
}
