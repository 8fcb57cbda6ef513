#include "saddle.h"
#include "../base/objects.h"

/* Gets the matrix that has the entries of C, and whether C is that matrix, its transpose or its adjoint */
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
    *source    = view;
    *transpose = (PetscBool) !*transpose;
  } else *hermitian = *transpose; /* an absent block is the adjoint of the other one */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates C as AIJ */
static PetscErrorCode GetConstraints(Mat source, PetscBool transpose, PetscBool hermitian, Mat *C)
{
  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(source, C));
  if (transpose) {
    Mat T = *C;
    PetscCall((hermitian ? MatHermitianTranspose : MatTranspose)(T, MAT_INITIAL_MATRIX, C));
    PetscCall(MatDestroy(&T));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces a small A with inaccessible entries by a copy, because constraints need the entries of A */
static PetscErrorCode CopyOpaque(AinsworthSaddle *sp)
{
  Mat       A      = sp->block[AINSWORTH_BLOCK_A], copy;
  PetscBool opaque = PETSC_FALSE;
  PetscInt  m;

  PetscFunctionBegin;
  PetscCall(MatGetSize(sp->rowsC, &m, NULL));
  if (m) PetscCall(AinsworthCheckEntries(A, sp->name[AINSWORTH_BLOCK_A], "A", &opaque));
  if (!opaque) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(A, &copy));
  PetscCall(AinsworthCopyNullSpaces(A, copy));
  if (sp->block[AINSWORTH_BLOCK_P] == A) {
    PetscCall(MatDestroy(&sp->block[AINSWORTH_BLOCK_P]));
    PetscCall(AinsworthShare(copy, &sp->block[AINSWORTH_BLOCK_P]));
  }
  PetscCall(MatDestroy(&sp->block[AINSWORTH_BLOCK_A]));
  sp->block[AINSWORTH_BLOCK_A] = copy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates sp->rowsB: C itself if blocks (1,0) and (0,1) are adjoint or negative adjoint, or if one of them is absent */
static PetscErrorCode GetOtherSide(AinsworthSaddle *sp)
{
  Mat       block = sp->block[AINSWORTH_BLOCK_C], transposed = sp->block[AINSWORTH_BLOCK_B], source[2], other;
  PetscBool transpose[2], hermitian[2], opaque, same = (PetscBool)(!block || !transposed);

  PetscFunctionBegin;
  if (!same) {
    PetscCall(GetSource(block, NULL, &source[0], &transpose[0], &hermitian[0]));
    PetscCall(GetSource(NULL, transposed, &source[1], &transpose[1], &hermitian[1]));
    same = (PetscBool)(source[0] == source[1] && (!PetscDefined(USE_COMPLEX) || hermitian[0] || hermitian[1])); /* one is a view of the other */
  }
  if (!same) PetscCall(AinsworthProbeAdjoint(sp->rowsC, transposed, &same, &sp->negated));
  if (same || sp->negated) {
    PetscCall(AinsworthShare(sp->rowsC, &sp->rowsB));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthCheckEntries(source[1], sp->name[AINSWORTH_BLOCK_B], "which is not the transpose of C", &opaque));
  PetscCall(GetConstraints(source[1], transpose[1], hermitian[1], &other));
  if (PetscDefined(USE_COMPLEX) && !hermitian[1]) { /* the adjoint is the conjugate of the transpose */
    PetscCall(MatDuplicate(other, MAT_COPY_VALUES, &sp->rowsB));
    PetscCall(MatConjugate(sp->rowsB));
    PetscCall(MatDestroy(&other));
  } else sp->rowsB = other;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Creates sp->rowsD: the negative of block (1,1), or the block itself if lambda is the negative of the program's

   last: the previous rowsD, or NULL. It is used again if the block is the same object with the same pattern, which keeps results that depend on patterns.
*/
static PetscErrorCode GetCompliance(AinsworthSaddle *sp, Mat last)
{
  Mat              block = sp->block[AINSWORTH_BLOCK_D], aij;
  PetscReal        norm;
  PetscBool        opaque;
  PetscObjectId    id;
  PetscObjectState pattern;

  PetscFunctionBegin;
  PetscCall(AinsworthBlockNorm(block, &norm));
  if (norm == 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCheckEntries(block, sp->name[AINSWORTH_BLOCK_D], "D", &opaque));
  PetscCall(AinsworthGetAIJ(block, &aij));
  PetscCall(PetscObjectGetId((PetscObject)aij, &id));
  PetscCall(MatGetNonzeroState(aij, &pattern));
  if (last && id == sp->idD && pattern == sp->patternD) {
    PetscCall(AinsworthShare(last, &sp->rowsD));
    PetscCall(MatCopy(aij, sp->rowsD, SAME_NONZERO_PATTERN));
  } else PetscCall(MatDuplicate(aij, MAT_COPY_VALUES, &sp->rowsD));
  sp->idD      = id;
  sp->patternD = pattern;
  PetscCall(MatDestroy(&aij));
  if (!sp->negated) PetscCall(MatScale(sp->rowsD, -1.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Describes NaN or Inf in A, whose norm is given, for the user; bad is empty if there is none. Collective */
static PetscErrorCode CheckFinite(Mat A, PetscReal norm, char bad[], size_t len)
{
  PetscInt  row, col;
  PetscBool has;
  Vec       x, y;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(A, MATOP_NORM, &has));
  if (!has) { /* for example a nest: NaN and Inf survive a product */
    PetscCall(MatCreateVecs(A, &x, &y));
    PetscCall(VecSet(x, 1.0));
    PetscCall(MatMult(A, x, y));
    PetscCall(VecNorm(y, NORM_1, &norm));
    if (PetscIsInfOrNanReal(norm)) PetscCall(PetscStrncpy(bad, "A holds NaN or Inf, or values too large", len));
    PetscCall(VecDestroy(&x));
    PetscCall(VecDestroy(&y));
  }
  if (!has || !PetscIsInfOrNanReal(norm)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthMatFindNotFinite(A, &row, &col)); /* the norm of finite values may overflow */
  if (row >= 0) PetscCall(PetscSNPrintf(bad, len, "entry (%" PetscInt_FMT ",%" PetscInt_FMT ") of A is NaN or Inf", row, col));
  else if (PetscIsNanReal(norm)) PetscCall(PetscSNPrintf(bad, len, "A holds NaN"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Raises an error if the sizes of the blocks do not match */
static PetscErrorCode CheckSizes(const AinsworthSaddleBlocks *b)
{
  const Mat C = b->block[AINSWORTH_BLOCK_C], B = b->block[AINSWORTH_BLOCK_B];
  MPI_Comm  comm = PetscObjectComm((PetscObject)b->block[AINSWORTH_BLOCK_A]);
  PetscInt  n[2], given[2], rows, cols;

  PetscFunctionBegin;
  PetscCheck(C || B, comm, PETSC_ERR_ARG_WRONG,
             "%s, C, is absent, and so is its transpose: PCAINSWORTH found no constraints; to solve without constraints pass a block with no rows",
             b->name[AINSWORTH_BLOCK_C]);
  PetscCall(MatGetSize(b->block[AINSWORTH_BLOCK_A], &n[0], &n[1]));
  PetscCheck(n[0] == n[1], comm, PETSC_ERR_ARG_SIZ, "%s, A, is not square: %" PetscInt_FMT " x %" PetscInt_FMT, b->name[AINSWORTH_BLOCK_A], n[0], n[1]);
  if (C) PetscCall(MatGetSize(C, &n[1], &cols));
  else PetscCall(MatGetSize(B, &cols, &n[1]));
  rows = n[1];
  PetscCheck(cols == n[0], comm, PETSC_ERR_ARG_SIZ, "%s, %s, has %" PetscInt_FMT " %s, A has %" PetscInt_FMT,
             b->name[C ? AINSWORTH_BLOCK_C : AINSWORTH_BLOCK_B], C ? "C" : "C'", cols, C ? "columns" : "rows", n[0]);
  if (!C || !B) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetSize(B, &given[0], &given[1]));
  PetscCheck(given[0] == cols && given[1] == rows, comm, PETSC_ERR_ARG_SIZ,
             "%s, C', is %" PetscInt_FMT " x %" PetscInt_FMT ", not %" PetscInt_FMT " x %" PetscInt_FMT "%s", b->name[AINSWORTH_BLOCK_B], given[0], given[1],
             cols, rows,
             given[0] == rows && given[1] == cols ? ": it is C, or of its size; pass its transpose, MatCreateTranspose() makes it, or no block" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forgets all but the transfers, which the next set-up may use again */
static PetscErrorCode Forget(AinsworthSaddle *sp)
{
  PetscFunctionBegin;
  PetscCall(AinsworthSaddleResetBlocks(sp));
  for (Mat *M : {&sp->A, &sp->P, &sp->C, &sp->B, &sp->D, &sp->rowsC, &sp->rowsB, &sp->rowsD, &sp->givenC}) PetscCall(MatDestroy(M));
  for (Vec *v : {&sp->balance, &sp->known, &sp->stiffness, &sp->scale.primal, &sp->scale.dual, &sp->work[0], &sp->work[1]}) PetscCall(VecDestroy(v));
  PetscCall(MatNullSpaceDestroy(&sp->nullSpace));
  PetscCall(MatDestroy(&sp->numbering));
  PetscCall(PetscFree(sp->kind));
  for (PetscInt &count : sp->count) count = 0;
  sp->bad[0]  = 0;
  sp->negated = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleSetUp - brings what the program passed to the normal form. Collective

   If values are NaN or Inf, sp->bad says which, and sp may then only be passed to AinsworthSaddleChanged().
*/
PetscErrorCode AinsworthSaddleSetUp(const AinsworthSaddleInputs *in, AinsworthSaddle *sp)
{
  AinsworthSaddleBlocks found;
  PetscBool             transpose, hermitian, opaque, same = PETSC_FALSE;
  PetscReal             norm;
  Mat                   source, last;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleFindBlocks(in, PETSC_FALSE, sp, &found));
  PetscCall(CheckSizes(&found));
  last      = sp->rowsD;
  sp->rowsD = NULL;
  PetscCall(Forget(sp));
  *(AinsworthSaddleBlocks *)sp = found;
  PetscCall(AinsworthSaddleGetNullSpace(in->amat, in->pmat, &sp->numbering, &sp->nullSpace));
  PetscCall(PetscObjectReference((PetscObject)sp->nullSpace));
  PetscCall(PetscObjectReference((PetscObject)sp->numbering));
  PetscCall(GetSource(sp->block[AINSWORTH_BLOCK_C], sp->block[AINSWORTH_BLOCK_B], &source, &transpose, &hermitian));
  PetscCall(AinsworthCheckEntries(source, sp->name[sp->block[AINSWORTH_BLOCK_C] ? AINSWORTH_BLOCK_C : AINSWORTH_BLOCK_B], "C", &opaque));
  PetscCall(GetConstraints(source, transpose, hermitian, &sp->rowsC));
  PetscCall(AinsworthShare(sp->rowsC, &sp->givenC));
  PetscCall(CopyOpaque(sp));
  PetscCall(AinsworthShare(sp->block[AINSWORTH_BLOCK_A], &sp->A));
  PetscCall(AinsworthShare(sp->block[AINSWORTH_BLOCK_P], &sp->P));
  PetscCall(AinsworthBlockNorm(sp->A, &norm));
  PetscCall(CheckFinite(sp->A, norm, sp->bad, sizeof(sp->bad)));
  if (!sp->bad[0]) {
    PetscCall(GetOtherSide(sp));
    PetscCall(GetCompliance(sp, last));
  }
  PetscCall(MatDestroy(&last));
  if (sp->bad[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSaddleFindKnown(sp));
  if (sp->rowsC != sp->givenC) { /* without these columns C may equal B */
    PetscCall(AinsworthMatEqual(sp->rowsC, sp->rowsB, &same));
    if (same) {
      PetscCall(MatDestroy(&sp->rowsB));
      PetscCall(AinsworthShare(sp->rowsC, &sp->rowsB));
    }
  }
  PetscCall(AinsworthSaddleClassifyRows(sp));
  if (sp->bad[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSaddleScale(sp));
  PetscCall(AinsworthProbeSymmetry(sp->A, &sp->symmetric));
  sp->adjoint = (PetscBool)(sp->B == sp->C);
  if (sp->adjoint && sp->D) PetscCall(AinsworthProbeSymmetry(sp->D, &sp->adjoint));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSaddleReset(AinsworthSaddle *sp)
{
  PetscFunctionBegin;
  PetscCall(Forget(sp));
  for (AinsworthTransfer &transfer : sp->transfer) PetscCall(AinsworthTransferDestroy(&transfer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tells whether the layout, the blocks, their values, the fields or null spaces have changed since the last set-up; the same answer on all ranks. Collective */
PetscErrorCode AinsworthSaddleChanged(const AinsworthSaddleInputs *in, const AinsworthSaddle *sp, PetscBool *changed)
{
  AinsworthSaddleBlocks now;
  MatNullSpace          nullSpace;
  Mat                   mat;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleFindBlocks(in, PETSC_TRUE, sp, &now));
  PetscCall(AinsworthSaddleGetNullSpace(in->amat, in->pmat, &mat, &nullSpace));
  *changed = (PetscBool)(now.layout != sp->layout || now.extracted != sp->extracted || nullSpace != sp->nullSpace);
  for (int k = 0; k < AINSWORTH_BLOCKS; k++)
    if (now.state[k] != sp->state[k]) *changed = PETSC_TRUE;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, changed, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)in->pmat)));
  for (int k = 0; k < 2 && !*changed; k++) {
    PetscBool rows, cols;

    PetscCall(ISEqualUnsorted(now.rows[k], sp->rows[k], &rows));
    PetscCall(ISEqualUnsorted(now.cols[k], sp->cols[k], &cols));
    *changed = (PetscBool)(!rows || !cols);
  }
  PetscCall(AinsworthSaddleResetBlocks(&now));
  PetscFunctionReturn(PETSC_SUCCESS);
}
