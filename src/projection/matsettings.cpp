/* What is given to a MATAINSWORTH: A and C, the other blocks, the weight, the penalty */
#include "matainsworth.h"
#include "../base/objects.h"
#include <petsc/private/petscimpl.h>

const char *const MatAinsworthWeightTypes[] = {
  "diagonal", "identity", "user", "MatAinsworthWeightType", "MAT_AINSWORTH_WEIGHT_", NULL};

/*@
   MatAinsworthSetMats - sets the blocks A and C of a `MATAINSWORTH`

   Collective

   Input Parameters:
+  mat - the matrix, of type `MATAINSWORTH`
.  A   - n x n, of any type with a product and a diagonal; referenced, never changed
-  C   - m x n, `MATAIJ` with the column layout of A and linearly independent rows; referenced, never changed

   Level: intermediate

   Notes:
   `mat` gets the sizes, the block size and the vector type of A. The next product notices new values of A and C.

   A weight and a penalty that were set before are dropped: W is diag(A)^{-1} again, unless the weight type is the
   identity.

   Errors:
   `PETSC_ERR_ARG_SIZ` if A is not square, or if C and A differ in the number or the layout of their columns;
   `PETSC_ERR_ARG_WRONG` if C is not `MATAIJ`.

.seealso: `MATAINSWORTH`, `MatCreateAinsworth()`, `MatAinsworthGetMats()`
@*/
PetscErrorCode MatAinsworthSetMats(Mat mat, Mat A, Mat C)
{
  Mat_Ainsworth *ctx;
  PetscInt       n, N, cols, Cn, CN, bs;
  PetscBool      aij, known, flag, other;
  MatType        type;
  VecType        vtype;
  MPI_Comm       comm;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscValidHeaderSpecific(A, MAT_CLASSID, 2);
  PetscValidHeaderSpecific(C, MAT_CLASSID, 3);
  PetscCheckSameComm(mat, 1, A, 2);
  PetscCheckSameComm(mat, 1, C, 3);
  comm = PetscObjectComm((PetscObject)mat);
  PetscCall(MatGetSize(A, &N, &cols));
  PetscCheck(N == cols, comm, PETSC_ERR_ARG_SIZ, "A is not square: %" PetscInt_FMT " x %" PetscInt_FMT, N, cols);
  PetscCall(MatGetSize(C, NULL, &CN));
  PetscCheck(CN == N, comm, PETSC_ERR_ARG_SIZ, "C has %" PetscInt_FMT " columns, A has %" PetscInt_FMT, CN, N);
  PetscCall(MatGetLocalSize(A, NULL, &n));
  PetscCall(MatGetLocalSize(C, NULL, &Cn));
  other = (PetscBool)(Cn != n);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &other, 1, AINSWORTH_MPI_BOOL, MPI_LOR, comm));
  PetscCheck(!other, comm, PETSC_ERR_ARG_SIZ, "C has other local columns than A: give C the column layout of A");
  PetscCall(MatGetType(C, &type));
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)C, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCheck(aij, comm, PETSC_ERR_ARG_WRONG, "C has type %s, MATAINSWORTH needs %s: use MatConvert()", type, MATAIJ);
  PetscCall(PetscObjectReference((PetscObject)A));
  PetscCall(AinsworthGetAIJ(C, &C)); /* adds a reference, or gets the sequential form on one rank */
  PetscCall(MatAinsworthReset_Private(ctx));
  PetscCall(AinsworthShare(C, &ctx->B));
  ctx->A       = A;
  ctx->C       = C;
  ctx->adjoint = PETSC_TRUE;
  /* the user's vector was destroyed */
  if (ctx->weightType == MAT_AINSWORTH_WEIGHT_USER) ctx->weightType = MAT_AINSWORTH_WEIGHT_DIAGONAL;
  PetscCall(MatSetSizes(mat, n, n, N, N));
  PetscCall(MatGetBlockSize(A, &bs));
  PetscCall(MatSetBlockSize(mat, bs));
  PetscCall(MatGetVecType(A, &vtype));
  PetscCall(MatSetVecType(mat, vtype));
  PetscCall(MatSetUp(mat));
  PetscCall(MatIsSymmetricKnown(A, &known, &flag));
  if (known) PetscCall(MatSetOption(mat, MAT_SYMMETRIC, flag));
  PetscCall(MatIsHermitianKnown(A, &known, &flag));
  if (known) PetscCall(MatSetOption(mat, MAT_HERMITIAN, flag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a MATAINSWORTH of A and C where the plugin is registered */
PetscErrorCode MatAinsworthCreate_Private(Mat A, Mat C, Mat *S)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(A, MAT_CLASSID, 1);
  PetscValidHeaderSpecific(C, MAT_CLASSID, 2);
  PetscAssertPointer(S, 3);
  PetscCall(MatCreate(PetscObjectComm((PetscObject)A), S));
  PetscCall(MatSetType(*S, MATAINSWORTH));
  PetscCall(MatAinsworthSetMats(*S, A, C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthGetMats - gets the blocks A and C of a `MATAINSWORTH`

   Not Collective

   Input Parameter:
.  mat - the matrix, of type `MATAINSWORTH`

   Output Parameters:
+  A - n x n, `NULL` before `MatAinsworthSetMats()`; do not destroy it; pass `NULL` if not needed
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

/*
   Sets the other blocks of [A B'; C -D], AIJ, laid out as the rows of C: B is NULL if it is C, D if it is 0; adjoint: B
   is C and D = D'
*/
PetscErrorCode MatAinsworthSetOtherBlocks_Private(Mat mat, Mat B, Mat D, PetscBool adjoint)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  for (Mat *M : {&ctx->B, &ctx->D}) PetscCall(MatDestroy(M));
  if (B) PetscCall(AinsworthGetAIJ(B, &ctx->B));
  else PetscCall(AinsworthShare(ctx->C, &ctx->B));
  if (D) PetscCall(AinsworthGetAIJ(D, &ctx->D));
  ctx->adjoint = adjoint;
  ctx->current = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthSetWeightType - sets the type of the diagonal weight W of the projector

   Logically Collective

   Input Parameters:
+  mat  - the matrix, of type `MATAINSWORTH`
-  type - `MAT_AINSWORTH_WEIGHT_DIAGONAL`, the default, or `MAT_AINSWORTH_WEIGHT_IDENTITY`

   Level: intermediate

   Note:
   `MAT_AINSWORTH_WEIGHT_DIAGONAL` is W = diag(A)^{-1}. If a diagonal entry is not positive, the 1-norm of its row of A
   replaces it.

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` for `MAT_AINSWORTH_WEIGHT_USER` if no weight is set.

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

/*
   Copies v after checking that its entries are positive and that it is laid out as the columns of A or the rows of C;
   what: its name in messages
*/
static PetscErrorCode CopyPositive(Mat block, bool columns, Vec v, const char what[], Vec *copy)
{
  MPI_Comm    comm = PetscObjectComm((PetscObject)block);
  const char *of   = columns ? "columns of A" : "rows of C";
  PetscReal   smallest;
  PetscInt    where, size, local, sizes[2], locals[2];
  PetscBool   other;

  PetscFunctionBegin;
  PetscCall(VecGetSize(v, &size));
  PetscCall(VecGetLocalSize(v, &local));
  PetscCall(MatGetSize(block, &sizes[0], &sizes[1]));
  PetscCall(MatGetLocalSize(block, &locals[0], &locals[1]));
  PetscCheck(size == sizes[columns], comm, PETSC_ERR_ARG_SIZ,
             "The %s has length %" PetscInt_FMT ", the %s are %" PetscInt_FMT, what, size, of, sizes[columns]);
  other = (PetscBool)(local != locals[columns]);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &other, 1, AINSWORTH_MPI_BOOL, MPI_LOR, comm));
  PetscCheck(!other, comm, PETSC_ERR_ARG_SIZ, "The %s is not laid out over the ranks as the %s are", what, of);
  PetscCall(VecMin(v, &where, &smallest));
  PetscCheck(smallest > 0.0, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Entry %" PetscInt_FMT " of the %s is %g: the entries must be positive", where, what, (double)smallest);
  PetscCall(VecDestroy(copy));
  PetscCall(AinsworthVecClone(v, copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthSetWeight - sets the diagonal of the weight W of the projector

   Collective

   Input Parameters:
+  mat    - the matrix, of type `MATAINSWORTH`, with its A and C set
-  weight - of length n, with the layout of the columns of A, real and positive, in units of inverse stiffness; copied

   Level: intermediate

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` before `MatAinsworthSetMats()`; `PETSC_ERR_ARG_SIZ` for another length or layout;
   `PETSC_ERR_ARG_OUTOFRANGE`, with the smallest entry in the message, if that is not positive.

.seealso: `MATAINSWORTH`, `MatAinsworthSetWeightType()`, `PCAinsworthSetWeight()`
@*/
PetscErrorCode MatAinsworthSetWeight(Mat mat, Vec weight)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscValidHeaderSpecific(weight, VEC_CLASSID, 2);
  PetscCheck(ctx->A, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONGSTATE,
             "Call MatAinsworthSetMats() before MatAinsworthSetWeight()");
  PetscCall(CopyPositive(ctx->A, true, weight, "weight", &ctx->weight));
  ctx->weightType = MAT_AINSWORTH_WEIGHT_USER;
  ctx->current    = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatAinsworthSetPenalty - sets the diagonal of the penalty B

   Collective

   Input Parameters:
+  mat     - the matrix, of type `MATAINSWORTH`, with its A and C set
-  penalty - of length m, with the layout of the rows of C, real and positive; copied; `NULL` for the default

   Level: intermediate

   Note:
   The units of entry i are those of a stiffness divided by the square of the scale of row i. The default is 1 / (C
   diag(A)^{-1} C')_ii.

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` before `MatAinsworthSetMats()`; `PETSC_ERR_ARG_SIZ` for another length or layout;
   `PETSC_ERR_ARG_OUTOFRANGE`, with the smallest entry in the message, if that is not positive.

.seealso: `MATAINSWORTH`, `PCAINSWORTH`
@*/
PetscErrorCode MatAinsworthSetPenalty(Mat mat, Vec penalty)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  PetscCheck(ctx->A, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONGSTATE,
             "Call MatAinsworthSetMats() before MatAinsworthSetPenalty()");
  if (penalty) {
    PetscValidHeaderSpecific(penalty, VEC_CLASSID, 2);
    PetscCall(CopyPositive(ctx->C, false, penalty, "penalty", &ctx->penalty));
  } else PetscCall(VecDestroy(&ctx->penalty));
  PetscCall(VecDestroy(&ctx->placed));
  ctx->userPenalty = (PetscBool)(penalty != NULL);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets how and where solves with the Gram matrix are done */
PetscErrorCode MatAinsworthSetGramChoices_Private(Mat mat, const AinsworthGramChoices &choices)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(mat, &ctx));
  if (choices != ctx->gramChoices) ctx->current = PETSC_FALSE;
  ctx->gramChoices = choices;
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

/* Gets what D adds to the projection; NULL without D. Borrowed */
PetscErrorCode MatAinsworthGetCompliance_Private(Mat mat, const AinsworthCompliance **compliance)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUpProjector_Private(mat, &ctx));
  *compliance = ctx->D ? &ctx->proj.compliance : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}
