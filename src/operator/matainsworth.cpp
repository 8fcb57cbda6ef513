#include "matainsworth.h"
#include "../projector/shared.h"
#include "../events.h"
#include "../guard.h"
#include "../hermitian.h"
#include "../objects.h"
#include <petsc/private/matimpl.h>

const char *const MatAinsworthWeightTypes[] = {"diagonal", "identity", "user", "MatAinsworthWeightType", "MAT_AINSWORTH_WEIGHT_", NULL};

PetscErrorCode MatAinsworthGetContext_Private(Mat mat, Mat_Ainsworth **ctx)
{
  PetscBool match;

  PetscFunctionBegin;
  PetscValidHeaderSpecific(mat, MAT_CLASSID, 1);
  PetscCall(PetscObjectTypeCompare((PetscObject)mat, MATAINSWORTH, &match));
  PetscCheck(match, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONG,
             "The matrix has type %s, not %s: it has no projector; create it with MatCreateAinsworth()",
             ((PetscObject)mat)->type_name ? ((PetscObject)mat)->type_name : "(not set)", MATAINSWORTH);
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

/* Tells whether C, B or D changed since the last call, and stores their states */
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

/* Sets the weight of the projector: W; diag(A)^{-1} is set to zero for unknowns shared by many rows, and raised for unknowns with zero rows in A */
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
  if (changedC || ctx->D || ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL) { /* otherwise neither C nor W has changed */
    const AinsworthProjectorBlocks blocks          = {ctx->C, ctx->B, ctx->D};
    Vec                            inverseDiagonal = ctx->weight;

    if (ctx->D && ctx->weightType != MAT_AINSWORTH_WEIGHT_DIAGONAL) PetscCall(AinsworthWeightCreate(ctx->A, &inverseDiagonal));
    PetscCall(SetMobility(ctx));
    PetscCall(AinsworthProjectorSetUp(&ctx->proj, &blocks, ctx->mobility, inverseDiagonal, ctx->rowsPerRank, (PetscObject)mat));
    if (inverseDiagonal != ctx->weight) PetscCall(VecDestroy(&inverseDiagonal));
  }
  if (!ctx->work) PetscCall(MatCreateVecs(ctx->A, &ctx->work, NULL));
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

/* Sets a matrix with the same products as A, used until A changes; NULL: A itself */
PetscErrorCode MatAinsworthSetProduct_Private(Mat mat, Mat product)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(AinsworthReplace(product, &ctx->product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  } else if (!ctx->omitPenalty && !ctx->inKernel) {
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

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &ctx));
  PetscCheck(ctx->adjoint, PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP,
             "The blocks (0,1) and (1,0) are not adjoint, or the multipliers' is not: the reduced operator has no transpose, use a method without one, "
             "as -%sainsworth_ksp_type gmres",
             ((PetscObject)mat)->prefix ? ((PetscObject)mat)->prefix : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMult_Ainsworth(Mat mat, Vec x, Vec y)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &ctx));
  if (ctx->inKernel && ctx->direction) { /* Q x = x */
    PetscCall(MatMult(ctx->product ? ctx->product : ctx->A, x, y));
    PetscCall(AinsworthProjectorMultTranspose(&ctx->proj, y, NULL, NULL, y));
    ctx->direction = PETSC_FALSE;
  } else PetscCall(MultOrAdjoint(mat, PETSC_FALSE, x, y));
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
  PetscCheck(ctx->A, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONGSTATE, "The matrix of type %s has no A and C: call MatAinsworthSetMats() first",
             MATAINSWORTH);
  PetscCall(MatCreateAinsworth(ctx->A, ctx->C, copy));
  PetscCall(MatAinsworthSetOtherBlocks_Private(*copy, ctx->B == ctx->C ? NULL : ctx->B, ctx->D, ctx->adjoint));
  PetscCall(MatGetOptionsPrefix(mat, &prefix));
  PetscCall(MatSetOptionsPrefix(*copy, prefix));
  PetscCall(MatAinsworthGetContext_Private(*copy, &dup));
  dup->rowsPerRank = ctx->rowsPerRank;
  dup->omitPenalty = ctx->omitPenalty;
  if (ctx->weightType == MAT_AINSWORTH_WEIGHT_USER) PetscCall(MatAinsworthSetWeight(*copy, ctx->weight));
  else PetscCall(MatAinsworthSetWeightType(*copy, ctx->weightType));
  if (ctx->userPenalty) PetscCall(MatAinsworthSetPenalty(*copy, ctx->penalty));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Resets the matrix to its state before MatAinsworthSetMats() */
PetscErrorCode MatAinsworthReset_Private(Mat_Ainsworth *ctx)
{
  PetscFunctionBegin;
  for (Mat *M : {&ctx->A, &ctx->C, &ctx->B, &ctx->D, &ctx->product}) PetscCall(MatDestroy(M));
  for (Vec *v : {&ctx->weight, &ctx->mobility, &ctx->penalty, &ctx->placed, &ctx->work, &ctx->rowWork, &ctx->residual, &ctx->mu}) PetscCall(VecDestroy(v));
  for (std::vector<Vec> *vecs : {&ctx->lifted, &ctx->motions, &ctx->motionForces}) {
    for (Vec &v : *vecs) PetscCall(VecDestroy(&v));
    vecs->clear();
  }
  ctx->shared.clear();
  ctx->longFactor.clear();
  ctx->liftedBy.clear();
  PetscCall(AinsworthProjectorReset(&ctx->proj));
  ctx->longest     = PETSC_MAX_INT;
  ctx->moved       = false;
  ctx->doubtful    = false;
  ctx->current     = PETSC_FALSE;
  ctx->userPenalty = PETSC_FALSE;
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
  PetscCall(PetscViewerASCIIPrintf(viewer, "constraints=%" PetscInt_FMT ", weight: %s%s%s%s\n", m, MatAinsworthWeightTypes[ctx->weightType], penalty,
                                   ctx->omitPenalty ? ", without C' B C" : "",
                                   ctx->refine ? ", refinement of the projection: on, the constraints drifted" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatCreateAinsworth - creates the reduced operator A~ = C' B C + Q' A Q as a matrix-free matrix

   Collective

   Input Parameters:
+  A - n x n, of any type with a product and a diagonal; referenced, never changed
-  C - m x n, `MATAIJ` with the column layout of A and linearly independent rows; referenced, never changed

   Output Parameter:
.  S - the matrix, n x n, of type `MATAINSWORTH`

   Level: intermediate

   Notes:
   Q = I - W C' (C W C')^{-1} C is the projector onto Ker C. By default W = diag(A)^{-1}, and B is diagonal with one penalty per row of C, see
   `MatAinsworthSetPenalty()`. `MatAinsworthSetWeightType()`, `MatAinsworthSetWeight()` and `MatAinsworthSetPenalty()` change them.

   Robert, Jolivet, Jamond and Badri have W = I and B = beta I in equation (3).

   In complex arithmetic ' is the adjoint.

   Errors:
   Those of `MatAinsworthSetMats()`.

.seealso: `MATAINSWORTH`, `MatAinsworthComputeRHS()`, `MatAinsworthComputeMultiplier()`, `MatAinsworthMultProjector()`, `PCAINSWORTH`
@*/
PetscErrorCode MatCreateAinsworth(Mat A, Mat C, Mat *S)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(A, MAT_CLASSID, 1);
  PetscValidHeaderSpecific(C, MAT_CLASSID, 2);
  PetscAssertPointer(S, 3);
  PetscCall(AinsworthInitializePackage());
  PetscCall(MatCreate(PetscObjectComm((PetscObject)A), S));
  PetscCall(MatSetType(*S, MATAINSWORTH));
  PetscCall(MatAinsworthSetMats(*S, A, C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   MATAINSWORTH - the reduced operator A~ = C' B C + Q' A Q of a saddle-point system [A C'; C 0], never assembled

   Level: intermediate

   Notes:
   A~ x = f~, with f~ from `MatAinsworthComputeRHS()`, has the same solution x as the saddle-point system. A~ is symmetric positive definite if A is so on Ker
   C.

   A product costs one product with A, two with C and with C', and two solves with the Gram matrix C W C'. The `KSP` of the Gram matrix has the options prefix
   `ainsworth_gram_`, after the prefix of the matrix.

   `MatDuplicate()` creates a second matrix with the same A and C.

   References:
   V. Robert, P. Jolivet, O. Jamond, M. A. Badri, Calcul haute performance pour les problemes de point-selle en mecanique du contact, CSMA, equation (3).

.seealso: `MatCreateAinsworth()`, `PCAINSWORTH`, `KSPPROJECTEDCG`
M*/
PetscErrorCode MatCreate_Ainsworth(Mat mat)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  ctx                  = new Mat_Ainsworth();
  ctx->weightType      = MAT_AINSWORTH_WEIGHT_DIAGONAL;
  ctx->rowsPerRank     = 25000; /* docs/gram.md */
  ctx->proj.gram.group = ctx->proj.gramB.group = MPI_COMM_NULL;
  PetscCall(MatSetType(mat, MATSHELL));
  PetscCall(MatShellSetContext(mat, ctx));
  PetscCall(MatShellSetManageScalingShifts(mat)); /* MatScale() and the like raise an error, because a duplicate would lose the scaling */
  PetscCall(MatShellSetOperation(mat, MATOP_MULT, (void (*)(void))MatMult_Ainsworth));
  PetscCall(MatShellSetOperation(mat, MATOP_MULT_TRANSPOSE, (void (*)(void))MatMultTranspose_Ainsworth));
#if defined(PETSC_USE_COMPLEX)
  PetscCall(MatShellSetOperation(mat, MATOP_MULT_HERMITIAN_TRANSPOSE, (void (*)(void))MatMultHermitianTranspose_Ainsworth));
#endif
  PetscCall(MatShellSetOperation(mat, MATOP_DUPLICATE, (void (*)(void))MatDuplicate_Ainsworth));
  PetscCall(MatShellSetOperation(mat, MATOP_DESTROY, (void (*)(void))MatDestroy_Ainsworth));
  PetscCall(MatShellSetOperation(mat, MATOP_VIEW, (void (*)(void))MatView_Ainsworth));
  PetscCall(PetscObjectChangeTypeName((PetscObject)mat, MATAINSWORTH));
  PetscFunctionReturn(PETSC_SUCCESS);
}
