/*
   Unknowns determined by their own row, such as Dirichlet conditions whose columns were left in place: their columns
   move to the right-hand side
*/
#include "saddle.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"

/* Sets known_i = 1 / A_ii if row i of [A B'] has only A_ii, else 0; some: there are such rows. Collective */
static PetscErrorCode FindOwnRows(const AinsworthSaddle *sp, const AinsworthMatFacts *facts, Vec known, PetscBool *some)
{
  Vec       work;
  PetscReal most;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(sp->kept.B, NULL, &work));
  PetscCall(VecSet(work, 1.0));
  PetscCall(AinsworthAbsoluteMultTranspose(sp->kept.B, work, known));
  PetscCall(VecDestroy(&work));
  PetscCall(AinsworthUpdate(known, {facts->diagonal}, [=](PetscInt i, PetscScalar &size, PetscScalar d) {
    size = size == 0.0 && facts->alone[i] ? 1.0 / d : 0.0;
  }));
  PetscCall(VecNorm(known, NORM_INFINITY, &most));
  *some = (PetscBool)(most > 0.0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies a block as AIJ without the columns where mask is 0, except for their diagonal entries */
static PetscErrorCode CopyWithoutColumns(Mat block, Vec mask, Mat *copy)
{
  Mat          A;
  Vec          diagonal;
  MatNullSpace near;
  PetscInt     bs;

  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(block, &A));
  PetscCall(AinsworthScaleColumns(A, mask, copy));
  PetscCall(AinsworthCreateDiagonal(A, &diagonal));
  PetscCall(AinsworthStoreDiagonal(copy));
  PetscCall(MatDiagonalSet(*copy, diagonal, INSERT_VALUES));
  /* a new matrix, while MatDiagonalScale() declared the scaled one not symmetric */
  PetscCall(AinsworthMakePatternSymmetric(copy));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(MatGetNearNullSpace(A, &near));
  PetscCall(MatSetNearNullSpace(*copy, near));
  PetscCall(MatGetBlockSize(block, &bs));
  PetscCall(MatSetBlockSize(*copy, bs));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes the same columns from sp->P, provided that its entries are accessible; otherwise replaces it by A */
static PetscErrorCode MovePmat(AinsworthSaddle *sp, Mat A, Vec mask)
{
  Mat opaque, copy;

  PetscFunctionBegin;
  PetscCall(AinsworthFindOpaque(sp->P, &opaque));
  if (sp->P == sp->block[AINSWORTH_BLOCK_A] || opaque) sp->P = AinsworthRetain(A);
  else {
    PetscCall(CopyWithoutColumns(sp->P, mask, &copy));
    sp->P = AinsworthOwn(copy);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleFindKnown - removes the columns of known unknowns from copies of A and kept.C. Collective

   This is done if A becomes symmetric by it, or if B, which has nothing in these columns, is not C. A symmetric A has
   nothing there and is not copied. To be called before the rows of C are classified, because rows with only known
   unknowns become zero rows.
*/
PetscErrorCode AinsworthSaddleFindKnown(AinsworthSaddle *sp)
{
  const AinsworthMatFacts *facts;
  AinsworthRef<Mat>        A = sp->A;
  AinsworthRef<Vec>        known, mask;
  PetscBool                symmetric, some = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(AinsworthGetFacts(sp->A, &facts));
  symmetric = facts->symmetric;
  if (!facts->some || (symmetric && sp->oneSided())) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(facts->diagonal, known.out()));
  PetscCall(FindOwnRows(sp, facts, known, &some));
  if (!some) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(known, mask.out()));
  PetscCall(AinsworthUpdate(mask, {known}, [](PetscInt, PetscScalar &m, PetscScalar k) { m = k == 0.0 ? 1.0 : 0.0; }));
  if (!symmetric) {
    PetscCall(CopyWithoutColumns(sp->A, mask, A.out()));
    PetscCall(AinsworthProbeSymmetry(A, &symmetric));
  }
  if (!symmetric && sp->oneSided()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(sp->A, "Rows of A that hold nothing but their diagonal determine their unknowns: their columns "
                             "move to the right-hand side\n"));
  PetscCall(MovePmat(sp, A, mask));
  sp->A     = A;
  sp->known = known;
  /* B has nothing in these columns */
  if (!sp->oneSided()) PetscCall(AinsworthScaleColumns(sp->all.C, mask, sp->kept.C.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Subtracts A x from moved and C x from rest, for the program's A and C; x becomes the known unknowns, and moved
   becomes 0 in their rows
*/
PetscErrorCode AinsworthSaddleMoveColumns(const AinsworthSaddle *sp, Vec f, Vec x, Vec work, Vec moved, Vec rest)
{
  Vec product;

  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(x, sp->known, f));
  PetscCall(MatMult(sp->all.C, x, work));
  PetscCall(VecAXPY(rest, -1.0, work));
  PetscCall(VecDuplicate(x, &product));
  PetscCall(MatMult(sp->block[AINSWORTH_BLOCK_A], x, product));
  PetscCall(VecAXPY(moved, -1.0, product));
  PetscCall(VecDestroy(&product));
  PetscCall(AinsworthSaddleClearKnown(sp, moved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the entries of known unknowns to 0 */
PetscErrorCode AinsworthSaddleClearKnown(const AinsworthSaddle *sp, Vec v)
{
  PetscFunctionBegin;
  if (!sp->known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthUpdate(v, {sp->known}, [](PetscInt, PetscScalar &entry, PetscScalar k) {
    if (k != 0.0) entry = 0.0;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}
