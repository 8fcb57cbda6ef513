/* Weight, projector and penalty, made anew where A, the blocks of the constraints or a choice changed */
#include "matainsworth.h"
#include "../guard.h"
#include "../projector/shared.h"
#include <petsc/private/matimpl.h>

/* The penalty and the work space of the rows, where the projector has them now */
static PetscErrorCode PlacePenalty(Mat_Ainsworth *ctx)
{
  PetscFunctionBegin;
  PetscCall(VecDestroy(&ctx->placed));
  PetscCall(VecDestroy(&ctx->rowWork));
  PetscCall(VecDuplicate(ctx->proj.rowValues, &ctx->placed));
  PetscCall(VecDuplicate(ctx->proj.rowValues, &ctx->rowWork));
  PetscCall(AinsworthProjectorPlace(&ctx->proj, ctx->penalty, ctx->placed));
  PetscCall(AinsworthProjectorSetPenalty(&ctx->proj, ctx->penalty));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Did C, B or D change since the last set-up? Their states become those of now */
static PetscErrorCode ConstraintsChanged(Mat_Ainsworth *ctx, PetscBool *changed)
{
  const Mat mats[] = {ctx->C, ctx->B, ctx->D};

  PetscFunctionBegin;
  *changed = (PetscBool)!ctx->current;
  for (int k = 0; k < 3; k++) {
    PetscObjectState state = 0;

    if (mats[k]) PetscCall(PetscObjectStateGet((PetscObject)mats[k], &state));
    if (state != ctx->stateC[k]) *changed = PETSC_TRUE;
    ctx->stateC[k] = state;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The weight of the projector: W, but diag(A)^{-1} without the unknowns that many rows share */
static PetscErrorCode SetMobility(Mat_Ainsworth *ctx)
{
  PetscBool shared;

  PetscFunctionBegin;
  PetscCall(VecDestroy(&ctx->mobility));
  if (ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL) {
    PetscCall(VecDuplicate(ctx->weight, &ctx->mobility));
    PetscCall(VecCopy(ctx->weight, ctx->mobility));
    PetscCall(AinsworthSharedUnweigh(ctx->C, ctx->B, ctx->mobility, &shared));
    if (shared) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(VecDestroy(&ctx->mobility));
  }
  PetscCall(PetscObjectReference((PetscObject)ctx->weight));
  ctx->mobility = ctx->weight;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds weight and projector where A, the blocks of the constraints or the choice of W are not those of the last time */
static PetscErrorCode SetUpProjector(Mat mat, Mat_Ainsworth **out)
{
  Mat_Ainsworth   *ctx;
  PetscObjectState stateA;
  PetscBool        changedA, changedC;
  const char      *prefix;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  *out = ctx;
  PetscCheck(ctx->A, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONGSTATE, "The matrix of type %s has no A and C: call MatAinsworthSetMats() first",
             MATAINSWORTH);
  PetscCall(PetscObjectStateGet((PetscObject)ctx->A, &stateA));
  changedA = (PetscBool)(!ctx->current || stateA != ctx->stateA);
  PetscCall(ConstraintsChanged(ctx, &changedC));
  if (changedA) PetscCall(MatDestroy(&ctx->product));
  if (!changedA && !changedC) PetscFunctionReturn(PETSC_SUCCESS);
  ctx->current = PETSC_FALSE;
  if (ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL && changedA) {
    PetscCall(VecDestroy(&ctx->weight));
    PetscCall(AinsworthWeightCreate(ctx->A, &ctx->weight));
  }
  if (changedC || ctx->D || ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL) { /* otherwise neither C nor W changed */
    const AinsworthProjectorBlocks blocks          = {ctx->C, ctx->B, ctx->D};
    Vec                            inverseDiagonal = ctx->weight;

    if (ctx->D && ctx->weightType != MAT_AINSWORTH_WEIGHT_DIAGONAL) PetscCall(AinsworthWeightCreate(ctx->A, &inverseDiagonal));
    PetscCall(SetMobility(ctx));
    PetscCall(MatGetOptionsPrefix(mat, &prefix));
    PetscCall(AinsworthProjectorSetUp(&ctx->proj, &blocks, ctx->mobility, inverseDiagonal, ctx->rowsPerRank, (PetscObject)mat, prefix));
    if (inverseDiagonal != ctx->weight) PetscCall(VecDestroy(&inverseDiagonal));
  }
  if (!ctx->work) PetscCall(MatCreateVecs(ctx->A, &ctx->work, NULL));
  if (!ctx->userPenalty) PetscCall(VecDestroy(&ctx->penalty));
  PetscCall(VecDestroy(&ctx->placed));                               /* the places of the rows may be others */
  PetscCall(PetscObjectStateGet((PetscObject)ctx->A, &ctx->stateA)); /* which may have been raised here */
  ctx->current = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MatAinsworthSetUpProjector_Private(Mat mat, Mat_Ainsworth **out)
{
  PetscFunctionBegin;
  PetscCall(AinsworthGuarded<SetUpProjector>(mat, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Weight, projector, and the penalty, which PCAINSWORTH sets before it is needed */
PetscErrorCode MatAinsworthSetUp_Private(Mat mat, Mat_Ainsworth **out)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUpProjector_Private(mat, out));
  ctx = *out;
  if (!ctx->penalty) {
    Vec D = ctx->weight;

    if (ctx->weightType != MAT_AINSWORTH_WEIGHT_DIAGONAL) PetscCall(AinsworthWeightCreate(ctx->A, &D));
    PetscCall(AinsworthRowPenaltyCreate(ctx->C, D, 1.0, &ctx->penalty));
    if (ctx->weightType != MAT_AINSWORTH_WEIGHT_DIAGONAL) PetscCall(VecDestroy(&D));
  }
  if (!ctx->placed) PetscCall(PlacePenalty(ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}
