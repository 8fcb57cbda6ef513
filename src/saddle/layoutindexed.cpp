/* One matrix of any type with index sets of its fields: blocks are submatrices, made again for what changed only */
#include "saddle.h"
#include <petsc/private/petscimpl.h>
#include <cstring>

/* A number for the values of this rank */
static PetscErrorCode Digest(Mat M, uint64_t *digest)
{
  Mat       block[2] = {M, NULL};
  PetscBool mpi;

  PetscFunctionBegin;
  *digest = 0;
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)M, MATMPIAIJ, &mpi));
  if (mpi) PetscCall(MatMPIAIJGetSeqAIJ(M, &block[0], &block[1], NULL));
  for (Mat part : block) {
    MatInfo            info;
    const PetscScalar *v;

    if (!part) continue;
    PetscCall(MatGetInfo(part, MAT_LOCAL, &info));
    PetscCall(MatSeqAIJGetArrayRead(part, &v));
    const size_t size = (size_t)info.nz_used * sizeof(PetscScalar);

    for (size_t k = 0; k < size; k += sizeof(uint64_t)) {
      uint64_t bits = 0;

      memcpy(&bits, (const char *)v + k, PetscMin(sizeof(bits), size - k));
      *digest = AinsworthMixState(*digest, bits + 1);
    }
    PetscCall(MatSeqAIJRestoreArrayRead(part, &v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Is the matrix that of the last time, with the same nonzero pattern? */
static PetscErrorCode SamePattern(Mat mat, int which, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found, PetscBool *same)
{
  PetscBool tells;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)mat, &found->whole[which]));
  PetscCall(MatGetNonzeroState(mat, &found->pattern[which]));
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)mat, &tells, MATSEQAIJ, MATMPIAIJ, MATSEQBAIJ, MATMPIBAIJ, MATSEQSBAIJ, MATMPISBAIJ, ""));
  *same = (PetscBool)(tells && last && last->whole[which] == found->whole[which] && last->pattern[which] == found->pattern[which]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   found->block[k], rows and columns of whole, in the block of the last time where its pattern is the same

   Where its values are the same, too, its state stays what it was, so that nothing that depends on it is made again.
*/
static PetscErrorCode Extract(Mat whole, int k, PetscBool same, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  const int        row = k == AINSWORTH_BLOCK_C || k == AINSWORTH_BLOCK_D, col = k == AINSWORTH_BLOCK_B || k == AINSWORTH_BLOCK_D;
  Mat             *M     = &found->block[k];
  PetscBool        reuse = (PetscBool)(same && last->block[k]), equal;
  PetscObjectState state;
  uint64_t         before, now;

  PetscFunctionBegin;
  found->made[k] = PETSC_TRUE;
  if (reuse) {
    *M = last->block[k];
    PetscCall(PetscObjectReference((PetscObject)*M));
    PetscCall(PetscObjectStateGet((PetscObject)*M, &state));
    PetscCall(Digest(*M, &before));
  }
  PetscCall(MatCreateSubMatrix(whole, found->rows[row], found->cols[col], reuse ? MAT_REUSE_MATRIX : MAT_INITIAL_MATRIX, M));
  PetscCall(AinsworthChangeSign(found, k, *M));
  if (!reuse) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Digest(*M, &now));
  equal = (PetscBool)(now == before);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &equal, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)whole)));
  if (equal) PetscCall(PetscObjectStateSet((PetscObject)*M, state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthExtractBlocks - the blocks of mat, and the primal one of Pmat; last: those of the same index sets at the last set-up, or NULL */
PetscErrorCode AinsworthExtractBlocks(const AinsworthSaddleInputs *in, Mat mat, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  const char *const letters[] = {"A", "B", "C", "D"};
  PetscBool         same, opaque;
  PetscInt          size[2];
  Mat               whole;

  PetscFunctionBegin;
  PetscCall(SamePattern(mat, 0, last, found, &same));
  PetscCall(AinsworthCheckEntries(mat, "The matrix", "of a saddle point", &opaque));
  PetscCall(AinsworthGetAIJ(mat, &whole));
  for (int k = 0; k < AINSWORTH_BLOCK_P; k++) {
    PetscCall(Extract(whole, k, same, last, found));
    PetscCall(PetscObjectSetName((PetscObject)found->block[k], letters[k]));
  }
  PetscCall(MatDestroy(&whole));
  PetscCall(MatGetSize(mat, &size[0], NULL));
  PetscCall(MatGetSize(in->pmat, &size[1], NULL));
  if (in->pmat == mat || size[0] != size[1]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SamePattern(in->pmat, 1, last, found, &same));
  PetscCall(AinsworthCheckEntries(in->pmat, "Pmat", "of a saddle point", &opaque));
  PetscCall(AinsworthGetAIJ(in->pmat, &whole));
  PetscCall(Extract(whole, AINSWORTH_BLOCK_P, (PetscBool)(same && last->block[AINSWORTH_BLOCK_P] != last->block[AINSWORTH_BLOCK_A]), last, found));
  PetscCall(MatDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}
