#include "matainsworth.h"
#include <petsc/private/matimpl.h>

/*@
   MatAinsworthGetMats - gets the blocks A and C of a `MATAINSWORTH`

   Not Collective

   Input Parameter:
.  mat - the matrix

   Output Parameters:
+  A - n x n, or `NULL` before `MatAinsworthSetMats()`; not to be destroyed; pass `NULL` if not needed
-  C - m x n, likewise

   Level: intermediate

.seealso: `MATAINSWORTH`, `MatAinsworthSetMats()`
@*/
PetscErrorCode MatAinsworthGetMats(Mat mat, Mat *A, Mat *C)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  if (A) *A = ctx->A;
  if (C) *C = ctx->C;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The other blocks of [A B'; C -D], AIJ, laid out as the rows of C: B NULL for C, D NULL for 0; adjoint: B is C, and D = D' */
PetscErrorCode MatAinsworthSetOtherBlocks_Private(Mat mat, Mat B, Mat D, PetscBool adjoint)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  for (Mat *M : {&ctx->B, &ctx->D}) PetscCall(MatDestroy(M));
  if (B) PetscCall(AinsworthGetAIJ(B, &ctx->B));
  else {
    PetscCall(PetscObjectReference((PetscObject)ctx->C));
    ctx->B = ctx->C;
  }
  if (D) PetscCall(AinsworthGetAIJ(D, &ctx->D));
  ctx->adjoint = adjoint;
  ctx->current = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthSetWeightType - chooses the diagonal weight W of the projector

   Logically Collective

   Input Parameters:
+  mat  - the matrix
-  type - `MAT_AINSWORTH_WEIGHT_DIAGONAL` (W = diag(A)^{-1}; where an entry is not positive, the 1-norm of the row of A stands in for it) or
          `MAT_AINSWORTH_WEIGHT_IDENTITY`

   Level: intermediate

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` for `MAT_AINSWORTH_WEIGHT_USER` without a vector.

.seealso: `MATAINSWORTH`, `MatAinsworthSetWeight()`, `MatAinsworthWeightType`
@*/
PetscErrorCode MatAinsworthSetWeightType(Mat mat, MatAinsworthWeightType type)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscValidLogicalCollectiveEnum(mat, type, 2);
  if (type == ctx->weightType) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(type != MAT_AINSWORTH_WEIGHT_USER, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONGSTATE,
             "The weight of type user needs a vector: call MatAinsworthSetWeight()");
  PetscCall(VecDestroy(&ctx->weight));
  ctx->weightType = type;
  ctx->current    = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthSetWeight - gives the diagonal of the weight W

   Collective

   Input Parameters:
+  mat    - the matrix, with its A and C set
-  weight - length n, laid out as the columns of A, every entry real and positive, in units of inverse stiffness; copied

   Level: intermediate

   Errors:
   `PETSC_ERR_ARG_OUTOFRANGE` naming the smallest entry if it is not positive; `PETSC_ERR_ARG_SIZ` for another length.

.seealso: `MATAINSWORTH`, `MatAinsworthSetWeightType()`, `PCAinsworthSetWeight()`
@*/
PetscErrorCode MatAinsworthSetWeight(Mat mat, Vec weight)
{
  Mat_Ainsworth *ctx;
  PetscReal      smallest;
  PetscInt       where, length, n;
  PetscBool      other;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscValidHeaderSpecific(weight, VEC_CLASSID, 2);
  PetscCheck(ctx->A, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONGSTATE, "Call MatAinsworthSetMats() before MatAinsworthSetWeight()");
  PetscCall(VecGetSize(weight, &length));
  PetscCall(MatGetSize(ctx->A, NULL, &n));
  PetscCheck(length == n, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_SIZ, "The weight has length %" PetscInt_FMT ", A has %" PetscInt_FMT " columns",
             length, n);
  PetscCall(VecGetLocalSize(weight, &length));
  PetscCall(MatGetLocalSize(ctx->A, NULL, &n));
  other = (PetscBool)(length != n);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &other, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)mat)));
  PetscCheck(!other, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_SIZ, "The weight is not laid out over the ranks as the columns of A are");
  PetscCall(VecMin(weight, &where, &smallest));
  PetscCheck(smallest > 0.0, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_OUTOFRANGE,
             "Entry %" PetscInt_FMT " of the weight is %g: the entries must be positive", where, (double)smallest);
  PetscCall(VecDestroy(&ctx->weight));
  PetscCall(VecDuplicate(weight, &ctx->weight));
  PetscCall(VecCopy(weight, ctx->weight));
  ctx->weightType = MAT_AINSWORTH_WEIGHT_USER;
  ctx->current    = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthSetPenalty - gives the diagonal of the penalty B

   Collective

   Input Parameters:
+  mat     - the matrix, with its A and C set
-  penalty - length m, laid out as the rows of C, every entry real and positive, in units of stiffness over the square of the row's
             scale; copied; `NULL` for the default, 1 / (C diag(A)^{-1} C')_ii

   Level: intermediate

   Errors:
   `PETSC_ERR_ARG_OUTOFRANGE` naming the smallest entry if it is not positive; `PETSC_ERR_ARG_SIZ` for another length.

.seealso: `MATAINSWORTH`, `MatAinsworthGetPenalty()`, `PCAINSWORTH`
@*/
PetscErrorCode MatAinsworthSetPenalty(Mat mat, Vec penalty)
{
  Mat_Ainsworth *ctx;
  PetscReal      smallest;
  PetscInt       where, length, m;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscCheck(ctx->A, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONGSTATE, "Call MatAinsworthSetMats() before MatAinsworthSetPenalty()");
  if (!penalty) {
    ctx->userPenalty = PETSC_FALSE;
    ctx->current     = PETSC_FALSE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscValidHeaderSpecific(penalty, VEC_CLASSID, 2);
  PetscCall(VecGetSize(penalty, &length));
  PetscCall(MatGetSize(ctx->C, &m, NULL));
  PetscCheck(length == m, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_SIZ, "The penalty has length %" PetscInt_FMT ", C has %" PetscInt_FMT " rows",
             length, m);
  PetscCall(VecMin(penalty, &where, &smallest));
  PetscCheck(smallest > 0.0, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_OUTOFRANGE,
             "Entry %" PetscInt_FMT " of the penalty is %g: the entries must be positive", where, (double)smallest);
  PetscCall(VecDestroy(&ctx->penalty));
  PetscCall(VecDestroy(&ctx->placed));
  PetscCall(VecDuplicate(penalty, &ctx->penalty));
  PetscCall(VecCopy(penalty, ctx->penalty));
  ctx->userPenalty = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthGetPenalty - gets the diagonal of the penalty B

   Collective

   Input Parameter:
.  mat - the matrix, with its A and C set

   Output Parameter:
.  penalty - length m; not to be changed nor destroyed

   Level: advanced

.seealso: `MATAINSWORTH`, `MatAinsworthSetPenalty()`
@*/
PetscErrorCode MatAinsworthGetPenalty(Mat mat, Vec *penalty)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUp_Private(mat, &ctx));
  PetscAssertPointer(penalty, 2);
  *penalty = ctx->penalty;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthSetRowsPerRank - bounds the number of ranks that solve with the Gram matrix

   Logically Collective

   Input Parameters:
+  mat  - the matrix
-  rows - connected components of the Gram matrix with more than 32 rows, m rows together, are solved with on ceil(m / rows) ranks, at most as
          many as have rows of C, whole unless one has more than 16 times as many rows; 25000 by default

   Level: advanced

.seealso: `MATAINSWORTH`, `MatAinsworthGetGramKSP()`
@*/
PetscErrorCode MatAinsworthSetRowsPerRank(Mat mat, PetscInt rows)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscValidLogicalCollectiveInt(mat, rows, 2);
  PetscCheck(rows > 0, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_OUTOFRANGE, "The number of rows per rank must be positive, not %" PetscInt_FMT, rows);
  if (rows != ctx->rowsPerRank) ctx->current = PETSC_FALSE;
  ctx->rowsPerRank = rows;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthGetGramKSP - gets the solver of the Gram matrix

   Collective

   Input Parameter:
.  mat - the matrix, with its A and C set

   Output Parameter:
.  ksp - the solver, with options prefix `ainsworth_gram_`; `NULL` on ranks that solve for no row of the Gram matrix

   Level: advanced

   Notes:
   Each rank solves with whole connected components of the Gram matrix, on its own; only where a piece has more than 16 times the rows that
   a rank is given (`MatAinsworthSetRowsPerRank()`) the solver is one that several ranks share.

   The matrix of the solver is the Gram matrix scaled to a unit diagonal, its rows piece by piece.

.seealso: `MATAINSWORTH`, `MatAinsworthSetRowsPerRank()`
@*/
PetscErrorCode MatAinsworthGetGramKSP(Mat mat, KSP *ksp)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUpProjector_Private(mat, &ctx));
  PetscAssertPointer(ksp, 2);
  *ksp = ctx->proj.gram.placement.sizes.size() ? ctx->proj.gram.ksp : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S = C W C' + N, m x m, MATAIJ, rows distributed as those of C */
PetscErrorCode MatAinsworthGetGramMat_Private(Mat mat, Mat *S)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUpProjector_Private(mat, &ctx));
  *S = ctx->proj.gram.S;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sums of the rows of |D|, negative where D_ii is, m, distributed as the rows of C; NULL where D is zero */
PetscErrorCode MatAinsworthGetCompliance_Private(Mat mat, Vec *sums)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUpProjector_Private(mat, &ctx));
  *sums = ctx->D ? ctx->proj.compliance.sums : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}
