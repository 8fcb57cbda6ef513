/*
   Conjugate gradients in Ker C (Gould, Hribar, Nocedal 2001): Q' A x = b with x and the directions in Ker C, b in the
   range of Q', and the preconditioner Q M^{-1}. An iteration costs one product with A, one application of M^{-1} and
   two solves with the Gram matrix
*/
#include "inkernel.h"
#include "matainsworth.h"
#include "../base/layouts.h"

static const char reducedName[] = "AinsworthReduced"; /* of the reduced operator, composed with that in Ker C */

/* Computes y = Q' A x for an x in Ker C; what Q' leaves in the range of C' would grow in residuals */
static PetscErrorCode MatMult_InKernel(Mat operation, Vec x, Vec y)
{
  Mat            reduced;
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(operation, &reduced));
  PetscCall(MatAinsworthGetContext_Private(reduced, &ctx));
  PetscCall(MatMult(ctx->product ? ctx->product : ctx->A, x, y));
  PetscCall(MatAinsworthProjectForces_Private(reduced, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthInKernelCreateOperator(Mat reduced, Mat *operation)
{
  MatNullSpace nullspace;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateShell(reduced, reduced, operation));
  PetscCall(MatShellSetOperation(*operation, MATOP_MULT, (void (*)(void))MatMult_InKernel));
  PetscCall(PetscObjectCompose((PetscObject)*operation, reducedName, (PetscObject)reduced));
  PetscCall(MatGetNullSpace(reduced, &nullspace));
  if (nullspace) PetscCall(MatSetNullSpace(*operation, nullspace));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthInKernelIs(Mat operation, PetscBool *inKernel)
{
  PetscObject reduced;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)operation, reducedName, &reduced));
  *inKernel = (PetscBool)(reduced != NULL);
  PetscFunctionReturn(PETSC_SUCCESS);
}
