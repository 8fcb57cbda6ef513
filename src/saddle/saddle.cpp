#include "saddle.h"
#include "../base/objects.h"

/* Creates the adjoint of a block as AIJ: that of a transpose view is the matrix that it shows, or its conjugate */
static PetscErrorCode CreateAdjoint(Mat block, Mat *adjoint)
{
  Mat       view, aij;
  PetscBool hermitian;

  PetscFunctionBegin;
  PetscCall(AinsworthGetTransposed(block, &view, &hermitian));
  PetscCall(AinsworthGetAIJ(view ? view : block, &aij));
  if (!view) PetscCall(MatHermitianTranspose(aij, MAT_INITIAL_MATRIX, adjoint));
  else if (PetscDefined(USE_COMPLEX) && !hermitian) {
    PetscCall(MatDuplicate(aij, MAT_COPY_VALUES, adjoint));
    PetscCall(MatConjugate(*adjoint));
  } else PetscCall(AinsworthShare(aij, adjoint));
  PetscCall(MatDestroy(&aij));
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
  const Mat B = sp->block[AINSWORTH_BLOCK_B];
  PetscBool opaque, same = (PetscBool)(!B || !sp->block[AINSWORTH_BLOCK_C]);

  PetscFunctionBegin;
  if (!same) PetscCall(AinsworthProbeAdjoint(sp->rowsC, B, &same, &sp->negated));
  if (same || sp->negated) {
    PetscCall(AinsworthShare(sp->rowsC, &sp->rowsB));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthCheckEntries(B, sp->name[AINSWORTH_BLOCK_B], "which is not the transpose of C", &opaque));
  PetscCall(CreateAdjoint(B, &sp->rowsB));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Creates sp->rowsD: the negative of block (1,1), or the block itself if lambda is the negative of the program's

   last: the previous rowsD, or NULL. It is used again if the block is the same object with the same pattern, which
   keeps results that depend on patterns.
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

/* Describes NaN or Inf in A for the user; bad is empty if there is none. Collective */
static PetscErrorCode CheckFinite(Mat A, char bad[], size_t len)
{
  PetscReal norm;
  PetscInt  row, col;
  PetscBool has;
  Vec       x, y;

  PetscFunctionBegin;
  PetscCall(AinsworthBlockNorm(A, &norm));
  if (!PetscIsInfOrNanReal(norm)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatHasOperation(A, MATOP_GET_ROW, &has));
  if (has) { /* the norm of finite values may overflow */
    PetscCall(AinsworthMatFindEntry(A, AinsworthIsNotFinite, &row, &col));
    if (row < 0) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(PetscSNPrintf(bad, len, "entry (%" PetscInt_FMT ",%" PetscInt_FMT ") of A is NaN or Inf", row, col));
  } else { /* for example a nest: NaN and Inf survive a product */
    PetscCall(MatCreateVecs(A, &x, &y));
    PetscCall(VecSet(x, 1.0));
    PetscCall(MatMult(A, x, y));
    PetscCall(VecNorm(y, NORM_1, &norm));
    if (PetscIsInfOrNanReal(norm)) PetscCall(PetscStrncpy(bad, "A holds NaN or Inf, or values too large", len));
    PetscCall(VecDestroy(&x));
    PetscCall(VecDestroy(&y));
  }
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
             "%s, C, is absent, and so is its transpose: PCAINSWORTH found no constraints; to solve without "
             "constraints pass a block with no rows",
             b->name[AINSWORTH_BLOCK_C]);
  PetscCall(MatGetSize(b->block[AINSWORTH_BLOCK_A], &n[0], &n[1]));
  PetscCheck(n[0] == n[1], comm, PETSC_ERR_ARG_SIZ, "%s, A, is not square: %" PetscInt_FMT " x %" PetscInt_FMT,
             b->name[AINSWORTH_BLOCK_A], n[0], n[1]);
  if (C) PetscCall(MatGetSize(C, &n[1], &cols));
  else PetscCall(MatGetSize(B, &cols, &n[1]));
  rows = n[1];
  PetscCheck(cols == n[0], comm, PETSC_ERR_ARG_SIZ, "%s, %s, has %" PetscInt_FMT " %s, A has %" PetscInt_FMT,
             b->name[C ? AINSWORTH_BLOCK_C : AINSWORTH_BLOCK_B], C ? "C" : "C'", cols, C ? "columns" : "rows", n[0]);
  if (!C || !B) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetSize(B, &given[0], &given[1]));
  PetscCheck(given[0] == cols && given[1] == rows, comm, PETSC_ERR_ARG_SIZ,
             "%s, C', is %" PetscInt_FMT " x %" PetscInt_FMT ", not %" PetscInt_FMT " x %" PetscInt_FMT "%s",
             b->name[AINSWORTH_BLOCK_B], given[0], given[1], cols, rows,
             given[0] == rows && given[1] == cols
               ? ": it is C, or of its size; pass its transpose, MatCreateTranspose() makes it, or no block"
               : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forgets all but the transfers, which the next set-up may use again */
static PetscErrorCode Forget(AinsworthSaddle *sp)
{
  PetscFunctionBegin;
  PetscCall(AinsworthSaddleResetBlocks(sp));
  for (Mat *M : {&sp->A, &sp->P, &sp->C, &sp->B, &sp->D, &sp->rowsC, &sp->rowsB, &sp->rowsD, &sp->givenC})
    PetscCall(MatDestroy(M));
  for (Vec *v :
       {&sp->balance, &sp->known, &sp->stiffness, &sp->scale.primal, &sp->scale.dual, &sp->work[0], &sp->work[1]})
    PetscCall(VecDestroy(v));
  PetscCall(MatNullSpaceDestroy(&sp->nullSpace));
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
  PetscBool             opaque, same = PETSC_FALSE;
  Mat                   last;
  int                   k;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleFindBlocks(in, PETSC_FALSE, sp, &found));
  PetscCall(CheckSizes(&found));
  last      = sp->rowsD;
  sp->rowsD = NULL;
  PetscCall(Forget(sp));
  *(AinsworthSaddleBlocks *)sp = found;
  PetscCall(AinsworthSaddleGetNullSpace(in->amat, in->pmat, &sp->nullSpace));
  PetscCall(PetscObjectReference((PetscObject)sp->nullSpace));
  k = sp->block[AINSWORTH_BLOCK_C] ? AINSWORTH_BLOCK_C : AINSWORTH_BLOCK_B;
  PetscCall(AinsworthCheckEntries(sp->block[k], sp->name[k], "C", &opaque));
  PetscCall((k == AINSWORTH_BLOCK_C ? AinsworthGetAIJ : CreateAdjoint)(sp->block[k], &sp->rowsC));
  PetscCall(AinsworthShare(sp->rowsC, &sp->givenC));
  PetscCall(CopyOpaque(sp));
  PetscCall(AinsworthShare(sp->block[AINSWORTH_BLOCK_A], &sp->A));
  PetscCall(AinsworthShare(sp->block[AINSWORTH_BLOCK_P], &sp->P));
  PetscCall(CheckFinite(sp->A, sp->bad, sizeof(sp->bad)));
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

/*
   Tells whether the layout, the blocks, their values, the fields or null spaces have changed since the last set-up; the
   same answer on all ranks. Collective
*/
PetscErrorCode AinsworthSaddleChanged(const AinsworthSaddleInputs *in, const AinsworthSaddle *sp, PetscBool *changed)
{
  AinsworthSaddleBlocks now;
  MatNullSpace          nullSpace;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleFindBlocks(in, PETSC_TRUE, sp, &now));
  PetscCall(AinsworthSaddleGetNullSpace(in->amat, in->pmat, &nullSpace));
  *changed = (PetscBool)(now.layout != sp->layout || now.extracted != sp->extracted || nullSpace != sp->nullSpace);
  for (int k = 0; k < AINSWORTH_BLOCKS; k++)
    if (now.state[k] != sp->state[k]) *changed = PETSC_TRUE;
  PetscCall(
    MPIU_Allreduce(MPI_IN_PLACE, changed, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)in->pmat)));
  for (int k = 0; k < 2 && !*changed; k++) {
    PetscBool rows, cols;

    PetscCall(ISEqualUnsorted(now.rows[k], sp->rows[k], &rows));
    PetscCall(ISEqualUnsorted(now.cols[k], sp->cols[k], &cols));
    *changed = (PetscBool)(!rows || !cols);
  }
  PetscCall(AinsworthSaddleResetBlocks(&now));
  PetscFunctionReturn(PETSC_SUCCESS);
}
