/* The two doors of the reduced system: from f and g to its right-hand side, and from its solution to x and lambda */
#include "matainsworth.h"
#include "../events.h"
#include "../projector/dependent.h"
#include <petsc/private/matimpl.h>

/* Projections on C x = g, and computations of lambda, where the Gram matrix is nearly singular: each is a step of iterative refinement */
static const int refinements = 4;

/* y = op(A) x, op(A) = A or, for the transposed system, its transpose */
static PetscErrorCode MultA(const Mat_Ainsworth *ctx, PetscBool transpose, Vec x, Vec y)
{
  PetscFunctionBegin;
  if (transpose) PetscCall(MatMultTranspose(ctx->A, x, y));
  else PetscCall(MatMult(ctx->A, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x += R (g - C x): C x = g to rounding, whatever the tolerance of the reduced solve */
static PetscErrorCode ProjectOntoConstraints(Mat mat, Mat_Ainsworth *ctx, Vec g, Vec x)
{
  PetscFunctionBegin;
  if (!ctx->residual) PetscCall(MatCreateVecs(ctx->C, NULL, &ctx->residual));
  PetscCall(MatMult(ctx->C, x, ctx->residual));
  PetscCall(VecAYPX(ctx->residual, -1.0, g));
  PetscCall(MatAinsworthMultRightInverse(mat, ctx->residual, ctx->work));
  PetscCall(VecAXPY(x, 1.0, ctx->work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rhs = C' B g + Q' (f - op(A) R g); without g both of its terms are left out */
static PetscErrorCode ComputeRHS(Mat mat, PetscBool transpose, Vec f, Vec g, Vec rhs)
{
  Mat_Ainsworth *ctx;
  PetscReal      norm     = 0.0;
  PetscScalar    start[2] = {0.0, 0.0};

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(PetscLogEventBegin(AINSWORTH_RHS, mat, f, g, rhs));
  if (g) PetscCall(VecNorm(g, NORM_INFINITY, &norm));
  ctx->homogeneous = (PetscBool)(norm == 0.0);
  if (norm == 0.0) {
    PetscCall(VecCopy(f, rhs));
    PetscCall(AinsworthProjectorMultTranspose(&ctx->proj, rhs, NULL, rhs));
  } else {
    PetscCall(AinsworthProjectorRightInverse(&ctx->proj, g, ctx->work));
    PetscCall(MultA(ctx, transpose, ctx->work, rhs));
    PetscCall(VecDot(rhs, ctx->work, &start[0]));
    PetscCall(VecDot(f, ctx->work, &start[1]));
    PetscCall(VecAYPX(rhs, -1.0, f));
    if (!ctx->omitPenalty) {
      PetscCall(AinsworthProjectorPlace(&ctx->proj, g, ctx->rowWork));
      PetscCall(VecPointwiseMult(ctx->rowWork, ctx->B, ctx->rowWork));
    }
    PetscCall(AinsworthProjectorMultTranspose(&ctx->proj, rhs, ctx->omitPenalty ? NULL : ctx->rowWork, rhs));
  }
  for (int i = 0; i < 2; i++) ctx->start[i] = PetscRealPart(start[i]);
  PetscCall(PetscLogEventEnd(AINSWORTH_RHS, mat, f, g, rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* multiplier = R' (f - op(A) x) */
static PetscErrorCode ComputeMultiplier(Mat mat, PetscBool transpose, Vec f, Vec x, Vec multiplier)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(PetscLogEventBegin(AINSWORTH_Multiplier, mat, f, x, multiplier));
  PetscCall(MultA(ctx, transpose, x, ctx->work));
  PetscCall(VecAYPX(ctx->work, -1.0, f));
  PetscCall(AinsworthProjectorRightInverseTranspose(&ctx->proj, ctx->work, multiplier));
  PetscCall(PetscLogEventEnd(AINSWORTH_Multiplier, mat, f, x, multiplier));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   MatAinsworthReduce_Private - (f, g) to the right-hand side of the reduced system

   Where the Gram matrix is nearly singular with op(A) e taken from f, e being what refinement adds to R g
*/
PetscErrorCode MatAinsworthReduce_Private(Mat mat, PetscBool transpose, Vec f, Vec g, Vec rhs)
{
  Mat_Ainsworth *ctx;
  Vec            x, first, rest;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  if (!ctx->doubtful || !g) {
    PetscCall(ComputeRHS(mat, transpose, f, g, rhs));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecDuplicate(f, &x));
  PetscCall(VecDuplicate(f, &first));
  PetscCall(VecDuplicate(f, &rest));
  PetscCall(VecZeroEntries(x));
  for (int k = 0; k < refinements; k++) {
    PetscCall(ProjectOntoConstraints(mat, ctx, g, x));
    if (!k) PetscCall(VecCopy(x, first));
  }
  PetscCall(VecAXPY(x, -1.0, first));
  PetscCall(MultA(ctx, transpose, x, rest));
  PetscCall(VecAYPX(rest, -1.0, f));
  PetscCall(ComputeRHS(mat, transpose, rest, g, rhs));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&first));
  PetscCall(VecDestroy(&rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* lambda = R' (f - op(A) x) and, where the Gram matrix is nearly singular, lambda += R' (f - op(A) x - C' lambda) */
static PetscErrorCode RefinedMultiplier(Mat mat, PetscBool transpose, Vec f, Vec x, Vec lambda)
{
  Mat_Ainsworth *ctx;
  Vec            rest, more;

  PetscFunctionBegin;
  PetscCall(ComputeMultiplier(mat, transpose, f, x, lambda));
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  if (!ctx->doubtful) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(f, &rest));
  PetscCall(VecDuplicate(lambda, &more));
  for (int k = 1; k < refinements; k++) {
    PetscCall(MatMultHermitianTranspose(ctx->C, lambda, rest));
    PetscCall(VecAYPX(rest, -1.0, f));
    PetscCall(ComputeMultiplier(mat, transpose, rest, x, more));
    PetscCall(VecAXPY(lambda, 1.0, more));
  }
  PetscCall(VecDestroy(&rest));
  PetscCall(VecDestroy(&more));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MatAinsworthRecover_Private - the reduced solution, in x, to x with C x = g, and lambda */
PetscErrorCode MatAinsworthRecover_Private(Mat mat, PetscBool transpose, Vec f, Vec g, Vec x, Vec lambda)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  for (int k = 0; k < (ctx->doubtful ? refinements : 1); k++) PetscCall(ProjectOntoConstraints(mat, ctx, g, x));
  PetscCall(RefinedMultiplier(mat, transpose, f, x, lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of C to leave out; where there are none, whether and how well the Gram matrix can be solved with (AinsworthGramDiagnose()) */
PetscErrorCode MatAinsworthDiagnose_Private(Mat mat, PetscInt *pass, PetscInt *n, PetscInt **dependent, PCFailedReason *reason, PetscBool *hidden)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUpProjector_Private(mat, &ctx));
  PetscCall(AinsworthGramDiagnose(&ctx->proj.gram, ctx->proj.C, ctx->weight, pass, n, dependent, reason, hidden, &ctx->doubtful));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Are rows of C nearly dependent, so that solves with the Gram matrix are refined? */
PetscErrorCode MatAinsworthIsDoubtful_Private(Mat mat, PetscBool *doubtful)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  *doubtful = (PetscBool)ctx->doubtful;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MatAinsworthViewGram_Private(Mat mat, PetscViewer viewer)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscCall(AinsworthGramView(&ctx->proj.gram, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is left out of the solver of the Gram matrix */
PetscErrorCode MatAinsworthGetGramEconomy_Private(Mat mat, const char **text)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscCall(AinsworthGramGetEconomy(&ctx->proj.gram, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthComputeRHS - f~ = C' B g + Q' (f - A R g), the right-hand side of the reduced system A~ x = f~

   Collective

   Input Parameters:
+  mat - the matrix
.  f   - length n, right-hand side of the primal rows
-  g   - length m, right-hand side of the constraints; `NULL` for zero

   Output Parameter:
.  rhs - length n, not f

   Level: intermediate

   Note:
   Paper, equation (3), for any W and B.

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
   MatAinsworthComputeMultiplier - lambda = R' (f - A x), the Lagrange multipliers that belong to x

   Collective

   Input Parameters:
+  mat - the matrix
.  f   - length n, right-hand side of the primal rows
-  x   - length n, solution of the reduced system

   Output Parameter:
.  multiplier - length m

   Level: intermediate

   Note:
   Paper, section 3.2, c).

.seealso: `MATAINSWORTH`, `MatAinsworthComputeRHS()`
@*/
PetscErrorCode MatAinsworthComputeMultiplier(Mat mat, Vec f, Vec x, Vec multiplier)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(f, VEC_CLASSID, 2);
  PetscValidHeaderSpecific(x, VEC_CLASSID, 3);
  PetscValidHeaderSpecific(multiplier, VEC_CLASSID, 4);
  PetscCall(RefinedMultiplier(mat, PETSC_FALSE, f, x, multiplier));
  PetscFunctionReturn(PETSC_SUCCESS);
}
