/* Blocks as submatrices of one matrix of any type; only blocks that changed are made again */
#include "saddle.h"
#include "split.h"
#include "../base/objects.h"

/*
   Tells whether blocks were filled from the same matrix, with the same nonzero pattern and index sets, at the last
   set-up
*/
static PetscErrorCode SamePattern(Mat mat, int which, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found,
                                  PetscBool *same)
{
  PetscBool tells;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)mat, &found->whole[which]));
  PetscCall(MatGetNonzeroState(mat, &found->pattern[which]));
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)mat, &tells, MATSEQAIJ, MATMPIAIJ, MATSEQBAIJ, MATMPIBAIJ,
                                          MATSEQSBAIJ, MATMPISBAIJ, ""));
  *same = (PetscBool)(tells && last && last->split[which] && last->whole[which] == found->whole[which] &&
                      last->pattern[which] == found->pattern[which]);
  for (int k = 0; k < 2 && *same; k++)
    *same = (PetscBool)(last->rows[k] == found->rows[k] && last->cols[k] == found->cols[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Extracts `wanted` blocks from found->block[first] on; refills those of the last set-up if the pattern is the same */
static PetscErrorCode Extract(Mat mat, int which, int first, int wanted, Vec sign, const AinsworthSaddleBlocks *last,
                              AinsworthSaddleBlocks *found)
{
  Mat                                    whole;
  PetscBool                              same  = PETSC_FALSE;
  std::shared_ptr<const AinsworthSplit> &split = found->split[which];

  PetscFunctionBegin;
  PetscCall(SamePattern(mat, which, last, found, &same));
  if (sign || (last && last->sign)) same = PETSC_FALSE;
  PetscCall(AinsworthGetAIJ(mat, &whole));
  if (same) split = last->split[which];
  else PetscCall(AinsworthSplitCreate(whole, found->rows, found->cols, &split));
  for (int k = first; k < first + wanted; k++) {
    found->made[k] = PETSC_TRUE;
    if (same) found->block[k] = last->block[k];
    else if (!split) {
      const IS rows = found->rows[AinsworthBlockRow[k]], cols = found->cols[AinsworthBlockColumn[k]];

      PetscCall(MatCreateSubMatrix(whole, rows, cols, MAT_INITIAL_MATRIX, found->block[k].out()));
    }
  }
  if (same) PetscCall(AinsworthSplitRefill(whole, split.get(), wanted, found->block + first));
  else if (split) PetscCall(AinsworthSplitFill(whole, split.get(), wanted, found->block + first));
  for (int k = first; k < first + wanted; k++) PetscCall(AinsworthChangeSign(sign, k, found->block[k]));
  PetscCall(MatDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthExtractBlocks - extracts the blocks A to D of mat; last: result of the last set-up, or NULL. Collective */
PetscErrorCode AinsworthExtractBlocks(Mat mat, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  const char *const letters[] = {"A", "B", "C", "D"};
  PetscBool         opaque;

  PetscFunctionBegin;
  PetscCall(AinsworthCheckEntries(mat, "The matrix", "of a saddle point", &opaque));
  PetscCall(Extract(mat, 0, AINSWORTH_BLOCK_A, AINSWORTH_BLOCK_P, found->sign, last, found));
  for (int k = 0; k < AINSWORTH_BLOCK_P; k++) PetscCall(PetscObjectSetName((PetscObject)found->block[k], letters[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthExtractPrimal - extracts the primal block of Pmat, with the signs changed as those of the other blocks.
   Collective
*/
PetscErrorCode AinsworthExtractPrimal(Mat pmat, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  PetscBool opaque;
  Vec       sign = NULL; /* Pmat may have other Dirichlet rows than Amat */

  PetscFunctionBegin;
  PetscCall(AinsworthCheckEntries(pmat, "Pmat", "of a saddle point", &opaque));
  if (found->sign) PetscCall(AinsworthFindSign(pmat, found->rows[0], &sign));
  PetscCall(Extract(pmat, 1, AINSWORTH_BLOCK_P, 1, sign, last, found));
  PetscCall(VecDestroy(&sign));
  PetscFunctionReturn(PETSC_SUCCESS);
}
