#include "matainsworth.h"
#include <petsc/private/petscimpl.h>

/*@
   MatAinsworthMultProjector - computes y = Q x, the projection of x onto Ker C along Im(W C')

   Neighbor-wise Collective

   Input Parameters:
+  mat - the matrix, of type `MATAINSWORTH`
-  x   - of length n

   Output Parameter:
.  y - of length n, with C y = 0; may be x

   Level: advanced

   Notes:
   Q = I - W C' S^{-1} C, with S = C W C' (Robert, Jolivet, Jamond and Badri, section 3.2, for any W).

   The call is collective if A, C or W has changed since the last one, because it then sets up the projector.

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` if `mat` has no A and C.

.seealso: `MATAINSWORTH`, `MatAinsworthMultTransposeProjector()`, `MatAinsworthMultRightInverse()`
@*/
PetscErrorCode MatAinsworthMultProjector(Mat mat, Vec x, Vec y)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscValidHeaderSpecific(x, VEC_CLASSID, 2);
  PetscValidHeaderSpecific(y, VEC_CLASSID, 3);
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(AinsworthProjectorMult(&ctx->proj, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthMultTransposeProjector - computes y = Q' x

   Neighbor-wise Collective

   Input Parameters:
+  mat - the matrix, of type `MATAINSWORTH`
-  x   - of length n

   Output Parameter:
.  y - of length n; may be x

   Level: advanced

   Notes:
   Q' = I - C' S^{-1} C W, the adjoint in complex arithmetic, with S = C W C' (Robert, Jolivet, Jamond and Badri,
   section 3.2, for any W).

   The call is collective if A, C or W has changed since the last one, because it then sets up the projector.

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` if `mat` has no A and C.

.seealso: `MATAINSWORTH`, `MatAinsworthMultProjector()`
@*/
PetscErrorCode MatAinsworthMultTransposeProjector(Mat mat, Vec x, Vec y)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscValidHeaderSpecific(x, VEC_CLASSID, 2);
  PetscValidHeaderSpecific(y, VEC_CLASSID, 3);
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(AinsworthProjectorMultTranspose(&ctx->proj, x, NULL, NULL, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthMultRightInverse - computes x = R g, which has the smallest W^{-1}-norm of all x with C x = g

   Neighbor-wise Collective

   Input Parameters:
+  mat - the matrix, of type `MATAINSWORTH`
-  g   - of length m

   Output Parameter:
.  x - of length n

   Level: advanced

   Notes:
   R = W C' S^{-1}, with S = C W C' (Robert, Jolivet, Jamond and Badri, section 3.2, for any W).

   The call is collective if A, C or W has changed since the last one, because it then sets up the projector.

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` if `mat` has no A and C.

.seealso: `MATAINSWORTH`, `MatAinsworthMultTransposeRightInverse()`
@*/
PetscErrorCode MatAinsworthMultRightInverse(Mat mat, Vec g, Vec x)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscValidHeaderSpecific(g, VEC_CLASSID, 2);
  PetscValidHeaderSpecific(x, VEC_CLASSID, 3);
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(AinsworthProjectorRightInverse(&ctx->proj, g, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthMultTransposeRightInverse - computes l = R' r

   Neighbor-wise Collective

   Input Parameters:
+  mat - the matrix, of type `MATAINSWORTH`
-  r   - of length n

   Output Parameter:
.  l - of length m

   Level: advanced

   Notes:
   R' = S^{-1} C W, the adjoint in complex arithmetic, with S = C W C' (Robert, Jolivet, Jamond and Badri, section 3.2,
   for any W).

   The call is collective if A, C or W has changed since the last one, because it then sets up the projector.

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` if `mat` has no A and C.

.seealso: `MATAINSWORTH`, `MatAinsworthMultRightInverse()`, `MatAinsworthComputeMultiplier()`
@*/
PetscErrorCode MatAinsworthMultTransposeRightInverse(Mat mat, Vec r, Vec l)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscValidHeaderSpecific(r, VEC_CLASSID, 2);
  PetscValidHeaderSpecific(l, VEC_CLASSID, 3);
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscCall(AinsworthProjectorMultiplier(&ctx->proj, true, r, NULL, l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Projects x onto Ker C, with iterative refinement if S is nearly singular */
PetscErrorCode MatAinsworthProject_Private(Mat mat, Vec x)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  for (int k = 0; k < (ctx->doubtful ? AinsworthRefinements : 1); k++)
    PetscCall(AinsworthProjectorMult(&ctx->proj, x, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Projects forces onto the range of Q', in the same way */
PetscErrorCode MatAinsworthProjectForces_Private(Mat mat, Vec f)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  for (int k = 0; k < (ctx->doubtful ? AinsworthRefinements : 1); k++)
    PetscCall(AinsworthProjectorMultTranspose(&ctx->proj, f, NULL, NULL, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Applies (M_*^+)^{-1}, which includes the springs of D; apply is the action of M_*^{-1} or of its transpose */
PetscErrorCode MatAinsworthPrecondition_Private(Mat mat, PC pc, PetscErrorCode (*apply)(PC, Vec, Vec), Vec r, Vec z)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscCall(AinsworthProjectorPrecondition(&ctx->proj, pc, apply, r, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Omits C' B C from the matrix and C' B g from the right-hand side

   Preconditioned by M from the right, the iterates are then those of the projected preconditioner Q M^{-1} Q', up to
   their part in Im(W C'), which the last projection replaces by R g.
*/
PetscErrorCode MatAinsworthOmitPenalty_Private(Mat mat, PetscBool flag)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  ctx->omitPenalty = flag;
  PetscFunctionReturn(PETSC_SUCCESS);
}
