/* The type MATAINSWORTH: its products and other operations */
#include "matainsworth.h"
#include "../base/events.h"
#include "../base/hermitian.h"

/*
   Computes y = C' B C x + Q' op(A) Q x, where op(A) is A or its adjoint, with two solves with S

   With D, S^{-1} E S^{-1} replaces the penalty B (docs/method.md, compliance).
*/
static PetscErrorCode MultOrAdjoint(Mat mat, PetscBool adjoint, Vec x, Vec y)
{
  Mat_Ainsworth *ctx;
  Vec            before = NULL, after = NULL;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(PetscLogEventBegin(AINSWORTH_MatMult, mat, x, y, 0));
  PetscCall(AinsworthProjectorMult(&ctx->proj, x, ctx->work));
  if (ctx->D) {
    before = ctx->rowWork;
    PetscCall(AinsworthProjectorMultEnergy(&ctx->proj, ctx->proj.rowSolution, before));
  } else if (!ctx->omitPenalty) {
    after = ctx->rowWork;
    PetscCall(VecPointwiseMult(after, ctx->placed, ctx->proj.rowValues));
  }
  if (adjoint) PetscCall(MatMultHermitianTranspose(ctx->A, ctx->work, y));
  else PetscCall(MatMult(ctx->product ? ctx->product : ctx->A, ctx->work, y));
  PetscCall(AinsworthProjectorMultTranspose(&ctx->proj, y, before, after, y));
  PetscCall(PetscLogEventEnd(AINSWORTH_MatMult, mat, x, y, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Raises an error if the operator has no transpose, because B is not C or D is not Hermitian */
static PetscErrorCode CheckAdjoint(Mat mat)
{
  Mat_Ainsworth *ctx;
  const char    *prefix;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &ctx));
  PetscCall(MatGetOptionsPrefix(mat, &prefix));
  PetscCheck(ctx->adjoint, PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP,
             "The blocks (0,1) and (1,0) are not adjoint, or the multipliers' is not: the reduced operator has no "
             "transpose, use a method without one, "
             "as -%sainsworth_ksp_type gmres",
             prefix ? prefix : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMult_Ainsworth(Mat mat, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(MultOrAdjoint(mat, PETSC_FALSE, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#if defined(PETSC_USE_COMPLEX)
static PetscErrorCode MatMultHermitianTranspose_Ainsworth(Mat mat, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(CheckAdjoint(mat));
  PetscCall(MultOrAdjoint(mat, PETSC_TRUE, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#endif

static PetscErrorCode MatMultTranspose_Ainsworth(Mat mat, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(CheckAdjoint(mat));
  PetscCall(AinsworthApplyConjugated(x, y, [mat](Vec v, Vec w) { return MultOrAdjoint(mat, PETSC_TRUE, v, w); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatDuplicate_Ainsworth(Mat mat, MatDuplicateOption, Mat *copy)
{
  Mat_Ainsworth *ctx, *dup;
  const char    *prefix;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscCheck(ctx->A, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONGSTATE,
             "The matrix of type %s has no A and C: call MatAinsworthSetMats() first", MATAINSWORTH);
  PetscCall(MatAinsworthCreate_Private(ctx->A, ctx->C, copy));
  PetscCall(MatAinsworthSetOtherBlocks_Private(*copy, ctx->B == ctx->C ? NULL : ctx->B, ctx->D, ctx->adjoint));
  PetscCall(MatGetOptionsPrefix(mat, &prefix));
  PetscCall(MatSetOptionsPrefix(*copy, prefix));
  PetscCall(MatAinsworthGetContext_Private(*copy, &dup));
  dup->gramChoices = ctx->gramChoices;
  dup->omitPenalty = ctx->omitPenalty;
  if (ctx->weightType == MAT_AINSWORTH_WEIGHT_USER) PetscCall(MatAinsworthSetWeight(*copy, ctx->weight));
  else PetscCall(MatAinsworthSetWeightType(*copy, ctx->weightType));
  if (ctx->userPenalty) PetscCall(MatAinsworthSetPenalty(*copy, ctx->penalty));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatDestroy_Ainsworth(Mat mat)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &ctx));
  PetscCall(MatAinsworthReset_Private(ctx));
  delete ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatView_Ainsworth(Mat mat, PetscViewer viewer)
{
  Mat_Ainsworth *ctx;
  PetscBool      ascii;
  PetscInt       m;
  char           penalty[64] = "";

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  if (!ctx->C) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "not set up\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetSize(ctx->C, &m, NULL));
  if (ctx->penalty) {
    PetscReal low, high;
    PetscCall(VecMin(ctx->penalty, NULL, &low));
    PetscCall(VecMax(ctx->penalty, NULL, &high));
    PetscCall(PetscSNPrintf(penalty, sizeof(penalty), ", penalty: %g to %g", (double)low, (double)high));
  }
  PetscCall(PetscViewerASCIIPrintf(viewer, "constraints=%" PetscInt_FMT ", weight: %s%s%s%s\n", m,
                                   MatAinsworthWeightTypes[ctx->weightType], penalty,
                                   ctx->omitPenalty ? ", without C' B C" : "",
                                   ctx->doubtful ? ", projections refined: the Gram matrix is ill-conditioned" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   MATAINSWORTH - the reduced operator A~ = C' B C + Q' A Q of a saddle-point system [A C'; C 0], never assembled

   Level: intermediate

   Notes:
   A~ x = f~, with f~ from `MatAinsworthComputeRHS()`, has the same solution x as the saddle-point system. A~ is
   symmetric positive definite if A is so on Ker C.

   A product costs one product with A, two with C and with C', and two solves with the Gram matrix C W C'. The `KSP` of
   the Gram matrix has the options prefix `ainsworth_gram_`, after the prefix of the matrix.

   `MatDuplicate()` creates a second matrix with the same A and C.

   References:
   V. Robert, P. Jolivet, O. Jamond, M. A. Badri, Calcul haute performance pour les problemes de point-selle en
   mecanique du contact, CSMA, equation (3).

.seealso: `MatCreateAinsworth()`, `PCAINSWORTH`, `KSPPROJECTEDCG`
M*/
PetscErrorCode MatCreate_Ainsworth(Mat mat)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  ctx                   = new Mat_Ainsworth();
  ctx->weightType       = MAT_AINSWORTH_WEIGHT_DIAGONAL;
  ctx->gramChoices.type = AINSWORTH_GRAM_FACTOR; /* R g is then the shortest x with C x = g */
  ctx->proj.gram.group = ctx->proj.gramB.group = MPI_COMM_NULL;
  PetscCall(MatSetType(mat, MATSHELL));
  PetscCall(MatShellSetContext(mat, ctx));
  /* MatScale() and the like raise an error, because a duplicate would lose the scaling */
  PetscCall(MatShellSetManageScalingShifts(mat));
  PetscCall(MatShellSetOperation(mat, MATOP_MULT, (void (*)(void))MatMult_Ainsworth));
  PetscCall(MatShellSetOperation(mat, MATOP_MULT_TRANSPOSE, (void (*)(void))MatMultTranspose_Ainsworth));
#if defined(PETSC_USE_COMPLEX)
  PetscCall(
    MatShellSetOperation(mat, MATOP_MULT_HERMITIAN_TRANSPOSE, (void (*)(void))MatMultHermitianTranspose_Ainsworth));
#endif
  PetscCall(MatShellSetOperation(mat, MATOP_DUPLICATE, (void (*)(void))MatDuplicate_Ainsworth));
  PetscCall(MatShellSetOperation(mat, MATOP_DESTROY, (void (*)(void))MatDestroy_Ainsworth));
  PetscCall(MatShellSetOperation(mat, MATOP_VIEW, (void (*)(void))MatView_Ainsworth));
  PetscCall(PetscObjectChangeTypeName((PetscObject)mat, MATAINSWORTH));
  PetscFunctionReturn(PETSC_SUCCESS);
}
