/* Both ends of the reduced system: from f and g to its right-hand side, and from its solution to x and lambda */
#include "matainsworth.h"
#include "../base/events.h"
#include "../base/layouts.h"
#include "dependent.h"
#include <petsc/private/petscimpl.h>

/* Computes y = op(A) x in the form with the fastest products; one that is not A itself is symmetric */
static PetscErrorCode MultiplyA(const Mat_Ainsworth *ctx, PetscBool transpose, Vec x, Vec y)
{
  PetscFunctionBegin;
  if (ctx->product) PetscCall(MatMult(ctx->product, x, y));
  else PetscCall((transpose ? MatMultTranspose : MatMult)(ctx->A, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes x += R (g - C x), so that C x = g to rounding, whatever the tolerance of the reduced solve

   With D, computes x += R r and mu -= S^{-1} r with r = g - C x + N mu. Each further call is a step of iterative
   refinement. zero: x and mu are 0.
*/
static PetscErrorCode ProjectOntoConstraints(Mat_Ainsworth *ctx, PetscBool zero, Vec g, Vec x)
{
  AinsworthProjector *proj = &ctx->proj;

  PetscFunctionBegin;
  if (!ctx->residual) PetscCall(AinsworthCreateVecs(ctx->C, NULL, &ctx->residual));
  if (zero) PetscCall(VecCopy(g, ctx->residual));
  else {
    PetscCall(MatMult(ctx->C, x, ctx->residual));
    PetscCall(VecAYPX(ctx->residual, -1.0, g));
  }
  if (ctx->D) PetscCall(MatMultAdd(proj->compliance.N, ctx->mu, ctx->residual, ctx->residual));
  PetscCall(AinsworthProjectorRightInverse(proj, ctx->residual, ctx->work));
  PetscCall(VecAXPY(x, 1.0, ctx->work));
  if (!ctx->D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthProjectorReturn(proj, proj->rowSolution, ctx->residual));
  PetscCall(VecAXPY(ctx->mu, -1.0, ctx->residual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes x, and with D ctx->mu, from the solution of the reduced system; zero: x = 0 on input, and x = R g */
static PetscErrorCode Complete(Mat_Ainsworth *ctx, PetscBool zero, Vec g, Vec x)
{
  PetscFunctionBegin;
  if (ctx->D) {
    if (!ctx->mu) PetscCall(AinsworthCreateVecs(ctx->C, NULL, &ctx->mu));
    PetscCall(VecZeroEntries(ctx->mu));
  }
  for (int k = 0; k < (ctx->doubtful ? AinsworthRefinements : 1); k++)
    PetscCall(ProjectOntoConstraints(ctx, (PetscBool)(zero && !k), g, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   MatAinsworthReduce_Private - computes the right-hand side of the reduced system, C' B g + Q' (f - op(A) R g); g may
   be NULL for zero. Collective

   With D it is Q' (f - op(A) R g) + C' S^{-1} E S^{-1} g.
*/
PetscErrorCode MatAinsworthReduce_Private(Mat mat, PetscBool transpose, Vec f, Vec g, Vec rhs)
{
  Mat_Ainsworth *ctx;
  Vec            x, before = NULL, after = NULL;
  PetscReal      norm   = 0.0;
  PetscScalar    energy = 0.0;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(PetscLogEventBegin(AINSWORTH_RHS, mat, f, g, rhs));
  if (g) PetscCall(VecNorm(g, NORM_INFINITY, &norm));
  ctx->homogeneous = (PetscBool)(norm == 0.0);
  if (norm == 0.0) {
    PetscCall(VecCopy(f, rhs));
    PetscCall(AinsworthProjectorMultTranspose(&ctx->proj, rhs, NULL, NULL, rhs));
  } else {
    PetscCall(VecDuplicate(f, &x));
    PetscCall(VecZeroEntries(x));
    PetscCall(Complete(ctx, PETSC_TRUE, g, x));
    PetscCall(MultiplyA(ctx, transpose, x, rhs));
    PetscCall(VecDot(rhs, x, &energy));
    PetscCall(VecDestroy(&x));
    PetscCall(VecAYPX(rhs, -1.0, f));
    if (ctx->D) {
      before = ctx->rowWork;
      PetscCall(AinsworthProjectorPlace(&ctx->proj, ctx->mu, ctx->proj.rowValues));
      PetscCall(AinsworthProjectorMultEnergy(&ctx->proj, ctx->proj.rowValues, before));
    } else if (!ctx->omitPenalty) {
      after = ctx->rowWork;
      PetscCall(AinsworthProjectorPlace(&ctx->proj, g, after));
      PetscCall(VecPointwiseMult(after, ctx->placed, after));
    }
    PetscCall(AinsworthProjectorMultTranspose(&ctx->proj, rhs, before, after, rhs));
  }
  /*
     if f - A R g is a force of the constraints alone, one projection leaves its rounding, half of which is outside the
     range of Q' A Q
  */
  if (ctx->omitPenalty && !ctx->D) PetscCall(MatAinsworthProjectForces_Private(mat, rhs));
  ctx->energy = PetscRealPart(energy);
  PetscCall(PetscLogEventEnd(AINSWORTH_RHS, mat, f, g, rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Refines lambda by S^{-1} G^{-1} (N mu - D lambda), several times

   Where D couples rows and is much more compliant than A, lambda is determined by D lambda = C x - g rather than by f -
   A x, except for what a singular D leaves free.
*/
static PetscErrorCode TakeFromSprings(Mat_Ainsworth *ctx, Vec lambda)
{
  AinsworthProjector *proj = &ctx->proj;
  Vec                 rest;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(lambda, &rest));
  for (int k = 0; k < AinsworthRefinements; k++) {
    PetscCall(MatMult(ctx->D, lambda, rest));
    PetscCall(VecScale(rest, -1.0));
    PetscCall(MatMultAdd(proj->compliance.N, ctx->mu, rest, rest));
    PetscCall(AinsworthProjectorRightInverse(proj, rest, ctx->work));
    PetscCall(AinsworthProjectorReturn(proj, proj->rowSolution, rest));
    PetscCall(VecAXPY(lambda, proj->compliance.soft, rest));
  }
  PetscCall(VecDestroy(&rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes lambda = S^{-1} (C W (f - op(A) x) + E mu), which is R' (f - op(A) x) without D; product: op(A) x, or NULL

   If S is nearly singular, refines lambda with the residuals f - op(A) x - B' lambda and E mu - N lambda.
*/
static PetscErrorCode ComputeMultiplier(Mat mat, PetscBool transpose, Vec f, Vec x, Vec lambda, Vec product)
{
  Mat_Ainsworth *ctx;
  Vec            rest, left, more = NULL, loads = NULL;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(PetscLogEventBegin(AINSWORTH_Multiplier, mat, f, x, lambda));
  PetscCheck(!ctx->D || ctx->mu, PetscObjectComm((PetscObject)mat), PETSC_ERR_ORDER,
             "The multipliers of a system [A B'; C -D] come with its solution");
  PetscCall(VecDuplicate(f, &rest));
  if (product) PetscCall(VecCopy(product, rest));
  else PetscCall(MultiplyA(ctx, transpose, x, rest));
  PetscCall(VecAYPX(rest, -1.0, f));
  if (ctx->D) {
    PetscCall(VecDuplicate(lambda, &loads));
    PetscCall(MatMult(ctx->proj.compliance.E, ctx->mu, loads));
  }
  PetscCall(AinsworthProjectorMultiplier(&ctx->proj, true, rest, loads, lambda));
  if (ctx->doubtful) {
    PetscCall(VecDuplicate(lambda, &more));
    PetscCall(VecDuplicate(f, &left));
    for (int k = 1; k < AinsworthRefinements; k++) {
      PetscCall(MatMultHermitianTranspose(ctx->B, lambda, left));
      PetscCall(VecAYPX(left, -1.0, rest));
      if (ctx->D) {
        PetscCall(MatMult(ctx->proj.compliance.E, ctx->mu, loads));
        PetscCall(MatMult(ctx->proj.compliance.N, lambda, more));
        PetscCall(VecAXPY(loads, -1.0, more));
      }
      PetscCall(AinsworthProjectorMultiplier(&ctx->proj, true, left, loads, more));
      PetscCall(VecAXPY(lambda, 1.0, more));
    }
    PetscCall(VecDestroy(&left));
  }
  if (ctx->D && ctx->proj.compliance.soft > 0.0) PetscCall(TakeFromSprings(ctx, lambda));
  for (Vec *v : {&rest, &more, &loads}) PetscCall(VecDestroy(v));
  PetscCall(PetscLogEventEnd(AINSWORTH_Multiplier, mat, f, x, lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MatAinsworthComplete_Private - computes x, with C x - D lambda = g, from the reduced solution. Collective */
PetscErrorCode MatAinsworthComplete_Private(Mat mat, Vec g, Vec x)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(Complete(ctx, PETSC_FALSE, g, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   MatAinsworthRecover_Private - recovers x with C x - D lambda = g and lambda from the reduced solution in y.primal.
   Collective

   product (may be NULL) becomes op(A) x. complete: y.primal is x already, and product, if there is one, op(A) x
*/
PetscErrorCode MatAinsworthRecover_Private(Mat mat, PetscBool transpose, PetscBool complete, AinsworthSaddleVec b,
                                           AinsworthSaddleVec y, Vec product)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  if (!complete) PetscCall(Complete(ctx, PETSC_FALSE, b.dual, y.primal));
  if (!complete && product) /* it judges x: with the matrix of the program */
    PetscCall((transpose ? MatMultTranspose : MatMult)(ctx->A, y.primal, product));
  PetscCall(ComputeMultiplier(mat, transpose, b.primal, y.primal, y.dual, product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds rows of C to drop; if there are none, whether and how accurately the Gram matrix can be solved
   (AinsworthProjectorDiagnose()). Collective
*/
PetscErrorCode MatAinsworthDiagnose_Private(Mat mat, PetscInt *pass, PetscInt *n, PetscInt **dependent,
                                            PCFailedReason *reason, PetscBool *hidden)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUpProjector_Private(mat, &ctx));
  PetscCall(AinsworthProjectorDiagnose(&ctx->proj, ctx->mobility, pass, n, dependent, reason, hidden, &ctx->doubtful));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds rows of C that are nearly dependent: their numbers, the same on all ranks; free with PetscFree(). Collective */
PetscErrorCode MatAinsworthFindNear_Private(Mat mat, PetscInt *n, PetscInt **rows)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUpProjector_Private(mat, &ctx));
  PetscCall(AinsworthProjectorFindNear(&ctx->proj, ctx->mobility, n, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether rows of C are nearly dependent, so that solves with the Gram matrix are refined */
PetscErrorCode MatAinsworthIsDoubtful_Private(Mat mat, PetscBool *doubtful)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  *doubtful = (PetscBool)ctx->doubtful;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets C, W C' and S = C W C' + N on all ranks, placed; W C' is NULL where it is not there, or no longer. The caller
   destroys W C' and S, C is borrowed. Collective
*/
PetscErrorCode MatAinsworthGetPlaced_Private(Mat mat, Mat *C, Mat *WCt, Mat *S)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  *C   = ctx->proj.C;
  *WCt = NULL;
  if (ctx->proj.polynomial) {
    PetscCall(AinsworthShare((Mat)ctx->proj.polynomial->WCt, WCt));
    PetscCall(AinsworthShare((Mat)ctx->proj.polynomial->S, S));
    ctx->proj.polynomial->WCt.reset();
  } else PetscCall(AinsworthGramGetWhole(&ctx->proj.gram, S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets what is solved with: S, or with a polynomial that of private unknowns; borrowed */
PetscErrorCode MatAinsworthGetGram_Private(Mat mat, const AinsworthGram **gram)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  *gram = &ctx->proj.gram;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthComputeRHS - computes f~ = C' B g + Q' (f - A R g), the right-hand side of the reduced system A~ x = f~

   Collective

   Input Parameters:
+  mat - the matrix, of type `MATAINSWORTH`
.  f   - the right-hand side of the primal rows, of length n
-  g   - the right-hand side of the constraints, of length m; `NULL` for zero

   Output Parameter:
.  rhs - f~, of length n; must not be f

   Level: intermediate

   Note:
   This is equation (3) of Robert, Jolivet, Jamond and Badri, for any W and B.

   Errors:
   `PETSC_ERR_ARG_IDN` if f and rhs are the same vector, `PETSC_ERR_ARG_WRONGSTATE` if `mat` has no A and C.

.seealso: `MATAINSWORTH`, `MatAinsworthComputeMultiplier()`
@*/
PetscErrorCode MatAinsworthComputeRHS(Mat mat, Vec f, Vec g, Vec rhs)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(f, VEC_CLASSID, 2);
  if (g) PetscValidHeaderSpecific(g, VEC_CLASSID, 3);
  PetscValidHeaderSpecific(rhs, VEC_CLASSID, 4);
  PetscCheck(f != rhs, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_IDN, "f and rhs must be different vectors");
  PetscCall(MatAinsworthReduce_Private(mat, PETSC_FALSE, f, g, rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthComputeMultiplier - computes the Lagrange multipliers lambda = R' (f - A x) of a solution x

   Collective

   Input Parameters:
+  mat - the matrix, of type `MATAINSWORTH`
.  f   - the right-hand side of the primal rows, of length n
-  x   - the solution of the reduced system, of length n

   Output Parameter:
.  multiplier - lambda, of length m

   Level: intermediate

   Note:
   See Robert, Jolivet, Jamond and Badri, section 3.2, c).

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` if `mat` has no A and C.

.seealso: `MATAINSWORTH`, `MatAinsworthComputeRHS()`
@*/
PetscErrorCode MatAinsworthComputeMultiplier(Mat mat, Vec f, Vec x, Vec multiplier)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(f, VEC_CLASSID, 2);
  PetscValidHeaderSpecific(x, VEC_CLASSID, 3);
  PetscValidHeaderSpecific(multiplier, VEC_CLASSID, 4);
  PetscCall(ComputeMultiplier(mat, PETSC_FALSE, f, x, multiplier, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}
