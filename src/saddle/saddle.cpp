#include "saddle.h"

/* The matrix that holds the entries of C, and whether C is that matrix, its transpose or its adjoint */
static PetscErrorCode GetSource(Mat block, Mat transposed, Mat *source, PetscBool *transpose, PetscBool *hermitian)
{
  Mat view;

  PetscFunctionBegin;
  *source    = block ? block : transposed;
  *transpose = (PetscBool)!block;
  *hermitian = *transpose;
  if (!*source) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetTransposed(*source, &view, hermitian));
  if (view) {
    *source = view;
    if (*transpose) *transpose = PETSC_FALSE;
    else *transpose = PETSC_TRUE;
  } else *hermitian = *transpose; /* an absent block is the adjoint of the present one */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C as AIJ */
static PetscErrorCode GetConstraints(Mat source, PetscBool transpose, PetscBool hermitian, Mat *C)
{
  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(source, C));
  if (transpose) {
    Mat T = *C;
    if (hermitian) PetscCall(MatHermitianTranspose(T, MAT_INITIAL_MATRIX, C));
    else PetscCall(MatTranspose(T, MAT_INITIAL_MATRIX, C));
    PetscCall(MatDestroy(&T));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where there are constraints the entries of A are asked for: a copy takes the place of a small matrix that does not give them */
static PetscErrorCode CopyOpaque(AinsworthSaddle *sp)
{
  Mat          A = sp->block[AINSWORTH_BLOCK_A], copy;
  MatNullSpace nullsp, near;
  PetscBool    opaque = PETSC_FALSE;
  PetscInt     m;

  PetscFunctionBegin;
  PetscCall(MatGetSize(sp->C, &m, NULL));
  if (m) PetscCall(AinsworthCheckEntries(A, sp->name[AINSWORTH_BLOCK_A], "A", &opaque));
  if (!opaque) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(A, &copy));
  PetscCall(MatGetNullSpace(A, &nullsp));
  PetscCall(MatGetNearNullSpace(A, &near));
  PetscCall(MatSetNullSpace(copy, nullsp));
  PetscCall(MatSetNearNullSpace(copy, near));
  PetscCall(MatDestroy(&sp->block[AINSWORTH_BLOCK_A]));
  sp->block[AINSWORTH_BLOCK_A] = copy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses a block B that is not the adjoint of C, where the program passed both */
static PetscErrorCode CheckAdjoint(AinsworthSaddle *sp)
{
  Mat       block = sp->block[AINSWORTH_BLOCK_C], transposed = sp->block[AINSWORTH_BLOCK_B];
  Mat       C = sp->all ? sp->all : sp->C, source[2], other;
  PetscBool transpose[2], hermitian[2], opaque, same = PETSC_FALSE;
  PetscInt  row, col;
  PetscReal value[2];

  PetscFunctionBegin;
  if (!block || !transposed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetSource(block, NULL, &source[0], &transpose[0], &hermitian[0]));
  PetscCall(GetSource(NULL, transposed, &source[1], &transpose[1], &hermitian[1]));
  if (source[0] == source[1] && (!PetscDefined(USE_COMPLEX) || hermitian[0] || hermitian[1])) PetscFunctionReturn(PETSC_SUCCESS); /* a view of the other */
  PetscCall(AinsworthProbeAdjoint(C, transposed, &same, &sp->negated));
  if (sp->diag) sp->negated = PETSC_FALSE; /* with a diagonal block the sign matters */
  if (same || sp->negated) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCheckEntries(source[1], sp->name[AINSWORTH_BLOCK_B], "which is not the transpose of C", &opaque));
  PetscCall(GetConstraints(source[1], transpose[1], hermitian[1], &other));
  if (PetscDefined(USE_COMPLEX) && !hermitian[1]) { /* the adjoint of a transpose */
    Mat conjugate;

    PetscCall(MatDuplicate(other, MAT_COPY_VALUES, &conjugate));
    PetscCall(MatConjugate(conjugate));
    PetscCall(MatDestroy(&other));
    other = conjugate;
  }
  PetscCall(AinsworthMatFindDifference(C, other, &row, &col, value));
  PetscCall(MatDestroy(&other));
  PetscCheck(row < 0, PetscObjectComm((PetscObject)block), PETSC_ERR_ARG_INCOMP,
             "%s is not the %s of C, %s: entry (%" PetscInt_FMT ",%" PetscInt_FMT ") of C is %g, the other's is %g; only systems [A C'; C 0] can be solved",
             sp->name[AINSWORTH_BLOCK_B], PetscDefined(USE_COMPLEX) ? "adjoint" : "transpose", sp->name[AINSWORTH_BLOCK_C], row, col, (double)value[0],
             (double)value[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: NaN or Inf in A, whose norm is known, as a text for the user; empty where there is none */
static PetscErrorCode CheckFinite(Mat A, PetscReal norm, char bad[], size_t len)
{
  PetscInt  row, col;
  PetscBool has;
  Vec       x, y;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(A, MATOP_NORM, &has));
  if (!has) { /* a nest: NaN and Inf do not cancel in a product */
    PetscCall(MatCreateVecs(A, &x, &y));
    PetscCall(VecSet(x, 1.0));
    PetscCall(MatMult(A, x, y));
    PetscCall(VecNorm(y, NORM_1, &norm));
    if (PetscIsInfOrNanReal(norm)) PetscCall(PetscStrncpy(bad, "A holds NaN or Inf, or values too large", len));
    PetscCall(VecDestroy(&x));
    PetscCall(VecDestroy(&y));
  }
  if (!has || !PetscIsInfOrNanReal(norm)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthMatFindNotFinite(A, &row, &col)); /* the norm may overflow for large values */
  if (row >= 0) PetscCall(PetscSNPrintf(bad, len, "entry (%" PetscInt_FMT ",%" PetscInt_FMT ") of A is NaN or Inf", row, col));
  else if (PetscIsNanReal(norm)) PetscCall(PetscSNPrintf(bad, len, "A holds NaN"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sizes that do not fit together */
static PetscErrorCode CheckSizes(const AinsworthSaddleBlocks *b)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)b->block[AINSWORTH_BLOCK_A]);
  PetscInt n[2];

  PetscFunctionBegin;
  PetscCheck(b->block[AINSWORTH_BLOCK_C] || b->block[AINSWORTH_BLOCK_B], comm, PETSC_ERR_ARG_WRONG,
             "%s, C, is absent, and so is its transpose: PCAINSWORTH found no constraints; to solve without constraints pass a block with no rows",
             b->name[AINSWORTH_BLOCK_C]);
  PetscCall(MatGetSize(b->block[AINSWORTH_BLOCK_A], &n[0], &n[1]));
  PetscCheck(n[0] == n[1], comm, PETSC_ERR_ARG_SIZ, "%s, A, is not square: %" PetscInt_FMT " x %" PetscInt_FMT, b->name[AINSWORTH_BLOCK_A], n[0], n[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleSetUp - finds A and C in the matrix that the program passed, pmat; of amat only a null space is used, where pmat has none

   Blocks B and C are compared by one random product. Where values are NaN or Inf sp->bad says which, and nothing else of sp may be used but to ask
   whether the matrix changed.
*/
PetscErrorCode AinsworthSaddleSetUp(Mat amat, Mat pmat, AinsworthSaddle *sp)
{
  AinsworthSaddleBlocks found;
  PetscBool             transpose, hermitian, opaque;
  PetscReal             normA, normD;
  Mat                   source;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleFindBlocks(pmat, NULL, &found));
  PetscCall(CheckSizes(&found));
  PetscCall(AinsworthSaddleReset(sp));
  *(AinsworthSaddleBlocks *)sp = found;
  PetscCall(AinsworthSaddleGetWhole(amat, pmat, &sp->whole));
  PetscCall(PetscObjectReference((PetscObject)sp->whole));
  PetscCall(GetSource(sp->block[AINSWORTH_BLOCK_C], sp->block[AINSWORTH_BLOCK_B], &source, &transpose, &hermitian));
  PetscCall(AinsworthCheckEntries(source, sp->name[sp->block[AINSWORTH_BLOCK_C] ? AINSWORTH_BLOCK_C : AINSWORTH_BLOCK_B], "C", &opaque));
  PetscCall(GetConstraints(source, transpose, hermitian, &sp->C));
  PetscCall(CopyOpaque(sp));
  sp->A = sp->block[AINSWORTH_BLOCK_A];
  PetscCall(PetscObjectReference((PetscObject)sp->A));
  PetscCall(AinsworthBlockNorm(sp->A, &normA));
  PetscCall(AinsworthBlockNorm(sp->block[AINSWORTH_BLOCK_D], &normD));
  PetscCall(CheckFinite(sp->A, normA, sp->bad, sizeof(sp->bad)));
  if (!sp->bad[0]) PetscCall(AinsworthSaddleClassifyRows(sp, normD != 0.0 ? sp->block[AINSWORTH_BLOCK_D] : NULL));
  if (!sp->bad[0]) PetscCall(CheckAdjoint(sp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSaddleReset(AinsworthSaddle *sp)
{
  PetscFunctionBegin;
  PetscCall(AinsworthSaddleResetBlocks(sp));
  PetscCall(MatDestroy(&sp->A));
  PetscCall(MatDestroy(&sp->C));
  PetscCall(MatNullSpaceDestroy(&sp->whole));
  PetscCall(PetscFree(sp->kind));
  PetscCall(PetscFree(sp->diag));
  PetscCall(MatDestroy(&sp->all));
  for (int kind = 0; kind < AINSWORTH_ROW_KINDS; kind++) {
    sp->count[kind] = 0;
    PetscCall(MatDestroy(&sp->left[kind]));
    PetscCall(VecDestroy(&sp->part[kind]));
  }
  PetscCall(MatDestroy(&sp->absolute));
  sp->bad[0]  = 0;
  sp->negated = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
