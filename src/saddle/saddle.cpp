#include "saddle.h"
#include "../base/layouts.h"
#include "../base/objects.h"

/* Creates the adjoint of a block as AIJ: that of a transpose view is the matrix that it shows, or its conjugate */
static PetscErrorCode CreateAdjoint(Mat block, Mat *adjoint)
{
  Mat       view, aij;
  PetscBool hermitian;

  PetscFunctionBegin;
  PetscCall(AinsworthGetTransposed(block, &view, &hermitian));
  PetscCall(AinsworthGetHostAIJ(view ? view : block, &aij));
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
  const Mat A      = sp->block[AINSWORTH_BLOCK_A];
  PetscBool opaque = PETSC_FALSE;
  PetscInt  m;
  Mat       copy;

  PetscFunctionBegin;
  PetscCall(MatGetSize(sp->all.C, &m, NULL));
  if (m) PetscCall(AinsworthCheckEntries(A, sp->name[AINSWORTH_BLOCK_A], "A", &opaque));
  if (!opaque) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(A, &copy));
  PetscCall(AinsworthCopyNullSpaces(A, copy));
  if (sp->block[AINSWORTH_BLOCK_P] == A) sp->block[AINSWORTH_BLOCK_P] = AinsworthRetain(copy);
  sp->block[AINSWORTH_BLOCK_A] = AinsworthOwn(copy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets sp->all.B: C itself if blocks (1,0) and (0,1) are adjoint or negative adjoint, or if one of them is absent */
static PetscErrorCode GetOtherSide(AinsworthSaddle *sp)
{
  const Mat B = sp->block[AINSWORTH_BLOCK_B];
  PetscBool opaque, same = (PetscBool)(!B || !sp->block[AINSWORTH_BLOCK_C]);

  PetscFunctionBegin;
  if (!same) PetscCall(AinsworthProbeAdjoint(sp->all.C, B, &same, &sp->negated));
  if (same || sp->negated) {
    sp->all.B = sp->all.C;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthCheckEntries(B, sp->name[AINSWORTH_BLOCK_B], "which is not the transpose of C", &opaque));
  PetscCall(CreateAdjoint(B, sp->all.B.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets sp->all.D: the negative of block (1,1), or the block itself if lambda is the negative of the program's

   last: the previous system, or NULL. Its D is used again if the block is the same object with the same pattern, which
   keeps results that depend on patterns.
*/
static PetscErrorCode GetCompliance(AinsworthSaddle *sp, const AinsworthSaddle *last)
{
  const Mat block = sp->block[AINSWORTH_BLOCK_D];
  Mat       aij;
  PetscBool opaque, zero;

  PetscFunctionBegin;
  PetscCall(AinsworthIsZero(block, &zero));
  if (zero) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCheckEntries(block, sp->name[AINSWORTH_BLOCK_D], "D", &opaque));
  PetscCall(AinsworthGetHostAIJ(block, &aij));
  PetscCall(PetscObjectGetId((PetscObject)aij, &sp->idD));
  PetscCall(MatGetNonzeroState(aij, &sp->patternD));
  if (last && last->all.D && sp->idD == last->idD && sp->patternD == last->patternD) {
    sp->all.D = last->all.D;
    PetscCall(MatCopy(aij, sp->all.D, SAME_NONZERO_PATTERN));
  } else PetscCall(MatDuplicate(aij, MAT_COPY_VALUES, sp->all.D.out()));
  PetscCall(MatDestroy(&aij));
  if (!sp->negated) PetscCall(MatScale(sp->all.D, -1.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Describes NaN or Inf in A for the user; bad is empty if there is none. Collective */
static PetscErrorCode CheckFinite(Mat A, char bad[], size_t len)
{
  const AinsworthMatFacts *facts;
  AinsworthRef<Mat>        aij;
  PetscInt                 row, col;

  PetscFunctionBegin;
  PetscCall(AinsworthGetFacts(A, &facts));
  if (facts->finite) PetscFunctionReturn(PETSC_SUCCESS);
  if (!facts->rows) {
    PetscCall(PetscStrncpy(bad, "A holds NaN or Inf, or values too large", len));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthGetAIJ(A, aij.out()));
  PetscCall(AinsworthMatFindEntry(aij, AinsworthIsNotFinite, &row, &col));
  PetscCall(PetscSNPrintf(bad, len, "entry (%" PetscInt_FMT ",%" PetscInt_FMT ") of A is NaN or Inf", row, col));
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
             "constraints pass a block with no rows%s",
             b->name[AINSWORTH_BLOCK_C], b->blame);
  PetscCall(MatGetSize(b->block[AINSWORTH_BLOCK_A], &n[0], &n[1]));
  PetscCheck(n[0] == n[1], comm, PETSC_ERR_ARG_SIZ, "%s, A, is not square: %" PetscInt_FMT " x %" PetscInt_FMT "%s",
             b->name[AINSWORTH_BLOCK_A], n[0], n[1], b->blame);
  if (C) PetscCall(MatGetSize(C, &n[1], &cols));
  else PetscCall(MatGetSize(B, &cols, &n[1]));
  rows = n[1];
  PetscCheck(cols == n[0], comm, PETSC_ERR_ARG_SIZ, "%s, %s, has %" PetscInt_FMT " %s, A has %" PetscInt_FMT "%s%s",
             b->name[C ? AINSWORTH_BLOCK_C : AINSWORTH_BLOCK_B], C ? "C" : "C'", cols, C ? "columns" : "rows", n[0],
             rows == n[0]
               ? (C ? ": it looks like C', which belongs in the block beside A; C has a row for each constraint"
                    : ": it looks like C, which belongs in the block below A; C' has a column for each constraint")
               : "",
             b->blame);
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

/* Makes the transfers of right-hand sides and solutions; takes those of the last set-up for the same fields */
static PetscErrorCode MakeTransfers(const AinsworthSaddleInputs *in, const AinsworthSaddle *last, AinsworthSaddle *sp)
{
  AinsworthRef<Vec> given[2], primal[2], dual; /* of solutions, and of right-hand sides */
  Mat               mat;

  PetscFunctionBegin;
  if (last && last->transfer[0].part[0] && last->rows[0] == sp->rows[0] && last->rows[1] == sp->rows[1] &&
      last->cols[0] == sp->cols[0] && last->cols[1] == sp->cols[1]) {
    for (int k = 0; k < 2; k++) sp->transfer[k] = last->transfer[k];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthChooseMatrix(in, &mat));
  PetscCall(AinsworthCreateVecs(mat, given[0].out(), given[1].out()));
  PetscCall(AinsworthCreateVecs(sp->A, primal[0].out(), primal[1].out()));
  PetscCall(AinsworthCreateVecs(sp->all.C, NULL, dual.out()));
  PetscCall(AinsworthTransferCreate(given[1], sp->rows, primal[1], dual, &sp->transfer[0]));
  PetscCall(AinsworthTransferCreate(given[0], sp->cols, primal[0], dual, &sp->transfer[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills in the normal form of the blocks found; ends early if sp->bad says why values are unusable */
static PetscErrorCode Complete(const AinsworthSaddleInputs *in, const AinsworthSaddle *last, AinsworthSaddle *sp)
{
  const int    k = sp->block[AINSWORTH_BLOCK_C] ? AINSWORTH_BLOCK_C : AINSWORTH_BLOCK_B;
  PetscBool    opaque, same = PETSC_FALSE;
  MatNullSpace nullSpace;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleGetNullSpace(in->amat, in->pmat, &nullSpace));
  sp->nullSpace = AinsworthRetain(nullSpace);
  PetscCall(AinsworthCheckEntries(sp->block[k], sp->name[k], "C", &opaque));
  PetscCall((k == AINSWORTH_BLOCK_C ? AinsworthGetHostAIJ : CreateAdjoint)(sp->block[k], sp->all.C.out()));
  PetscCall(CopyOpaque(sp));
  sp->A = sp->block[AINSWORTH_BLOCK_A];
  sp->P = sp->block[AINSWORTH_BLOCK_P];
  PetscCall(CheckFinite(sp->A, sp->bad, sizeof(sp->bad)));
  if (sp->bad[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetOtherSide(sp));
  PetscCall(GetCompliance(sp, last));
  PetscCall(MakeTransfers(in, last, sp));
  sp->kept = sp->all;
  PetscCall(AinsworthSaddleFindKnown(sp));
  if (sp->kept.C != sp->all.C) { /* without these columns C may equal B */
    PetscCall(AinsworthMatEqual(sp->kept.C, sp->kept.B, &same));
    if (same) sp->all.B = sp->kept.B = sp->kept.C;
  }
  PetscCall(AinsworthSaddleClassifyRows(sp));
  if (sp->bad[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSaddleScale(sp));
  PetscCall(AinsworthCreateVecs(sp->all.C, sp->work[0].out(), sp->work[1].out()));
  PetscCall(AinsworthProbeSymmetry(sp->A, &sp->symmetric));
  sp->adjoint = (PetscBool)sp->oneSided();
  if (sp->adjoint && sp->kept.D) PetscCall(AinsworthProbeSymmetry(sp->kept.D, &sp->adjoint));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleBuild - brings what the program passed to the normal form. Collective

   Input Parameter:
.  last - the previous system, or NULL: what has not changed is taken from it; its other parts are given up first

   If values are NaN or Inf, built->bad says which, and it may then only be passed to AinsworthSaddleChanged().
*/
PetscErrorCode AinsworthSaddleBuild(const AinsworthSaddleInputs *in, AinsworthSaddleStage last,
                                    AinsworthSaddleStage *built)
{
  auto sp = std::make_unique<AinsworthSaddle>();

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleFindBlocks(in, PETSC_FALSE, last.get(), sp.get()));
  PetscCall(CheckSizes(sp.get()));
  if (last) {
    auto rest = std::make_unique<AinsworthSaddle>();

    for (int k = 0; k < 2; k++) {
      rest->rows[k]     = last->rows[k];
      rest->cols[k]     = last->cols[k];
      rest->transfer[k] = last->transfer[k];
    }
    rest->all.D    = last->all.D;
    rest->idD      = last->idD;
    rest->patternD = last->patternD;
    last           = std::move(rest);
  }
  PetscCall(Complete(in, last.get(), sp.get()));
  *built = std::move(sp);
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
  *changed = (PetscBool)(now.layout != sp->layout || nullSpace != sp->nullSpace);
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
  PetscFunctionReturn(PETSC_SUCCESS);
}
