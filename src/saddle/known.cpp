/* Unknowns that their own row determines, as Dirichlet conditions do whose columns were left in place: they are known, and their columns move */
#include "terms.h"
#include "../loops.h"
#include "../objects.h"
#include <petsc/private/matimpl.h>

/* 1 / A_ii where nothing but A_ii is in row i of [A B'], else 0; some: there are such rows */
static PetscErrorCode FindOwnRows(const AinsworthSaddle *sp, Mat A, Vec known, PetscBool *some)
{
  PetscInt                 found = 0;
  Vec                      work;
  std::vector<PetscScalar> inverse;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(sp->rowsB, NULL, &work));
  PetscCall(VecSet(work, 1.0));
  PetscCall(AinsworthAbsoluteMultTranspose(sp->rowsB, work, known));
  PetscCall(VecDestroy(&work));
  PetscCall(AinsworthForRows(A, [&](const AinsworthMatRow &row) {
    PetscInt    n        = 0;
    PetscScalar diagonal = 0.0;

    for (PetscInt c = 0; c < row.n; c++) {
      if (row.j[c] == row.number) diagonal = row.a[c];
      else n += row.a[c] != 0.0;
    }
    inverse.push_back(!n && diagonal != 0.0 ? 1.0 / diagonal : 0.0);
  }));
  PetscCall(AinsworthUpdate(known, [&](PetscInt i, PetscScalar &size) {
    size = size == 0.0 ? inverse[i] : 0.0;
    found += size != 0.0;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  *some = (PetscBool)(found > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A without the columns that mask leaves out, but for the diagonal */
static PetscErrorCode CopyWithoutColumns(Mat A, Vec mask, Mat *copy)
{
  Vec          diagonal;
  MatNullSpace near;

  PetscFunctionBegin;
  PetscCall(AinsworthScaleColumns(A, mask, copy));
  PetscCall(AinsworthCreateDiagonal(A, &diagonal));
  PetscCall(MatSetOption(*copy, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE)); /* an entry of the diagonal that is zero may not be stored */
  PetscCall(MatDiagonalSet(*copy, diagonal, INSERT_VALUES));
  PetscCall(AinsworthMakePatternSymmetric(copy));
  (*copy)->symmetric = (*copy)->hermitian = PETSC_BOOL3_UNKNOWN; /* a matrix with scaled columns is taken for one that is not */
  PetscCall(VecDestroy(&diagonal));
  PetscCall(MatGetNearNullSpace(A, &near));
  PetscCall(MatSetNearNullSpace(*copy, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sp->P without the same columns, where A lost them and its own entries are known */
static PetscErrorCode MovePmat(AinsworthSaddle *sp, Mat A, Vec mask)
{
  Mat      opaque, P = NULL, copy;
  PetscInt bs;

  PetscFunctionBegin;
  PetscCall(AinsworthFindOpaque(sp->P, &opaque));
  if (sp->P == sp->block[AINSWORTH_BLOCK_A] || opaque) PetscCall(AinsworthShare(A, &copy));
  else {
    PetscCall(AinsworthGetAIJ(sp->P, &P));
    PetscCall(CopyWithoutColumns(P, mask, &copy));
    PetscCall(MatGetBlockSize(sp->P, &bs));
    PetscCall(MatSetBlockSize(copy, bs));
    PetscCall(MatDestroy(&P));
  }
  PetscCall(MatDestroy(&sp->P));
  sp->P = copy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleFindKnown - takes the columns of known unknowns out of a copy of A, and of C, where A is not symmetric and becomes so without them, or where B,
   which has nothing in these columns, is not C. An A that is symmetric has nothing there, and stays

   Collective, before the rows of C are classified: one that held known unknowns only is a row of zeros then.
*/
PetscErrorCode AinsworthSaddleFindKnown(AinsworthSaddle *sp)
{
  Mat       A, copy, C;
  Vec       known, mask;
  PetscBool has, symmetric, some = PETSC_FALSE;
  PetscInt  bs;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(sp->A, MATOP_GET_ROW, &has));
  PetscCall(AinsworthProbeSymmetry(sp->A, &symmetric));
  if (!has || (symmetric && sp->rowsB == sp->rowsC)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(sp->A, &A));
  PetscCall(MatCreateVecs(A, NULL, &known));
  PetscCall(FindOwnRows(sp, A, known, &some));
  if (some) {
    PetscCall(VecDuplicate(known, &mask));
    PetscCall(AinsworthUpdate(mask, {known}, [](PetscInt, PetscScalar &m, PetscScalar k) { m = k == 0.0 ? 1.0 : 0.0; }));
    if (symmetric) PetscCall(AinsworthShare(sp->A, &copy));
    else {
      PetscCall(CopyWithoutColumns(A, mask, &copy));
      PetscCall(MatGetBlockSize(sp->A, &bs));
      PetscCall(MatSetBlockSize(copy, bs));
      PetscCall(AinsworthProbeSymmetry(copy, &symmetric));
    }
    if (symmetric || sp->rowsB != sp->rowsC) {
      PetscCall(PetscInfo(sp->A, "Rows of A that hold nothing but their diagonal determine their unknowns: their columns move to the right-hand side\n"));
      PetscCall(MovePmat(sp, copy, mask));
      PetscCall(MatDestroy(&sp->A));
      sp->A     = copy;
      sp->known = known;
      known     = NULL;
      if (sp->rowsB != sp->rowsC) { /* B has nothing in these columns */
        PetscCall(AinsworthScaleColumns(sp->rowsC, mask, &C));
        PetscCall(MatDestroy(&sp->rowsC));
        sp->rowsC = C;
      }
    } else PetscCall(MatDestroy(&copy));
    PetscCall(VecDestroy(&mask));
  }
  PetscCall(VecDestroy(&known));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* moved -= A x and rest -= C x, of the program's A and C, with the known unknowns as x, which becomes them; rows of known unknowns become 0 */
PetscErrorCode AinsworthSaddleMoveColumns(const AinsworthSaddle *sp, Vec f, Vec x, Vec work, Vec moved, Vec rest)
{
  Vec product;

  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(x, sp->known, f));
  PetscCall(MatMult(sp->givenC, x, work));
  PetscCall(VecAXPY(rest, -1.0, work));
  PetscCall(VecDuplicate(x, &product));
  PetscCall(MatMult(sp->block[AINSWORTH_BLOCK_A], x, product));
  PetscCall(VecAXPY(moved, -1.0, product));
  PetscCall(VecDestroy(&product));
  PetscCall(AinsworthUpdate(moved, {sp->known}, [](PetscInt, PetscScalar &m, PetscScalar k) {
    if (k != 0.0) m = 0.0;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x, which is 0 there yet but for rounding, gets its known unknowns */
PetscErrorCode AinsworthSaddleSetKnown(const AinsworthSaddle *sp, Vec f, Vec x)
{
  PetscFunctionBegin;
  PetscCall(AinsworthUpdate(x, {sp->known, f}, [](PetscInt, PetscScalar &v, PetscScalar k, PetscScalar r) {
    if (k != 0.0) v = k * r;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}
