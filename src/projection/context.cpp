/* The context of a MATAINSWORTH: access, set-up of the weight, the projector and the penalty, reset */
#include "matainsworth.h"
#include "../base/guard.h"
#include "../base/layouts.h"
#include "../base/objects.h"
#include "shared.h"
#include <petsc/private/petscimpl.h>

PetscErrorCode MatAinsworthGetContext_Private(Mat mat, Mat_Ainsworth **ctx)
{
  PetscBool match;
  MatType   type;

  PetscFunctionBegin;
  PetscValidHeaderSpecific(mat, MAT_CLASSID, 1);
  PetscCall(PetscObjectTypeCompare((PetscObject)mat, MATAINSWORTH, &match));
  PetscCall(MatGetType(mat, &type));
  PetscCheck(match, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONG,
             "The matrix has type %s, not %s: it has no projector; create it with MatCreateAinsworth()",
             type ? type : "(not set)", MATAINSWORTH);
  PetscCall(MatShellGetContext(mat, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Places the penalty and creates the work vector of the rows */
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

/* Checks whether C, B or D changed since the last call, and stores their states */
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

/*
   Sets the weight of the projector: W; diag(A)^{-1} is set to zero for unknowns shared by many rows, and raised for
   unknowns with zero rows in A
*/
static PetscErrorCode SetMobility(Mat_Ainsworth *ctx)
{
  PetscBool shared, loose;

  PetscFunctionBegin;
  PetscCall(VecDestroy(&ctx->mobility));
  if (ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL) {
    PetscCall(AinsworthVecClone(ctx->weight, &ctx->mobility));
    PetscCall(AinsworthWeightLoosen(ctx->A, ctx->C, ctx->D, ctx->mobility, &loose));
    PetscCall(AinsworthSharedUnweigh(ctx->C, ctx->B, ctx->mobility, &shared));
    if (loose || shared) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(VecDestroy(&ctx->mobility));
  }
  PetscCall(AinsworthShare(ctx->weight, &ctx->mobility));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the weight and the projector if A, the constraint blocks or the choice of W have changed. Collective */
static PetscErrorCode SetUpProjector(Mat mat, Mat_Ainsworth **out)
{
  Mat_Ainsworth   *ctx;
  PetscObjectState stateA;
  PetscBool        changedA, changedC;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  *out = ctx;
  PetscCheck(ctx->A, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONGSTATE,
             "The matrix of type %s has no A and C: call MatAinsworthSetMats() first", MATAINSWORTH);
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
  /* otherwise neither C nor W has changed */
  if (changedC || ctx->D || ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL) {
    const AinsworthProjectorBlocks blocks          = {ctx->C, ctx->B, ctx->D};
    Vec                            inverseDiagonal = ctx->weight;

    if (ctx->D && ctx->weightType != MAT_AINSWORTH_WEIGHT_DIAGONAL)
      PetscCall(AinsworthWeightCreate(ctx->A, &inverseDiagonal));
    PetscCall(SetMobility(ctx));
    PetscCall(
      AinsworthProjectorSetUp(&ctx->proj, &blocks, ctx->mobility, inverseDiagonal, ctx->gramChoices, (PetscObject)mat));
    if (inverseDiagonal != ctx->weight) PetscCall(VecDestroy(&inverseDiagonal));
  }
  if (!ctx->work) PetscCall(AinsworthCreateVecs(ctx->A, &ctx->work, NULL));
  if (!ctx->userPenalty) PetscCall(VecDestroy(&ctx->penalty));
  PetscCall(VecDestroy(&ctx->placed));                               /* the placement of the rows may have changed */
  PetscCall(PetscObjectStateGet((PetscObject)ctx->A, &ctx->stateA)); /* may have increased above */
  ctx->current = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MatAinsworthSetUpProjector_Private(Mat mat, Mat_Ainsworth **out)
{
  PetscFunctionBegin;
  PetscCall(AinsworthGuarded<SetUpProjector>(mat, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the weight, the projector and the penalty; PCAINSWORTH sets its penalty before this is called. Collective */
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

/* Resets the matrix to its state before MatAinsworthSetMats() */
PetscErrorCode MatAinsworthReset_Private(Mat_Ainsworth *ctx)
{
  PetscFunctionBegin;
  for (Mat *M : {&ctx->A, &ctx->C, &ctx->B, &ctx->D, &ctx->product}) PetscCall(MatDestroy(M));
  for (Vec *v :
       {&ctx->weight, &ctx->mobility, &ctx->penalty, &ctx->placed, &ctx->work, &ctx->rowWork, &ctx->residual, &ctx->mu})
    PetscCall(VecDestroy(v));
  PetscCall(AinsworthProjectorReset(&ctx->proj));
  ctx->doubtful    = false;
  ctx->current     = PETSC_FALSE;
  ctx->userPenalty = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
