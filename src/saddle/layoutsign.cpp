/* Minus a saddle point: no diagonal entry of A is positive, except in Dirichlet rows, which have no other entry */
#include "saddle.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"

/* AinsworthClassifyDiagonal - replaces the diagonal of mat, in entries, by the kind of each entry. Collective */
PetscErrorCode AinsworthClassifyDiagonal(Mat mat, Vec entries)
{
  const AinsworthMatFacts *facts;

  PetscFunctionBegin;
  PetscCall(AinsworthGetFacts(mat, &facts));
  PetscCall(AinsworthUpdate(entries, [=](PetscInt i, PetscScalar &e) {
    const PetscReal d = PetscRealPart(e);

    e = d > 0.0   ? facts->alone[i] ? AINSWORTH_ENTRY_PLAIN : AINSWORTH_ENTRY_POSITIVE
        : d < 0.0 ? AINSWORTH_ENTRY_NEGATIVE
                  : AINSWORTH_ENTRY_ZERO;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindSign - for minus a saddle point, creates a vector with -1 for each given row and 1 for plain rows;
   otherwise NULL. Collective

   rows NULL: mat is A alone; then no row is plain, because C may use its unknown.
*/
PetscErrorCode AinsworthFindSign(Mat mat, IS rows, Vec *sign)
{
  const AinsworthMatFacts *facts;
  Vec                      diagonal, part;
  Mat                      opaque;
  PetscBool                has;
  PetscInt                 size[2];
  PetscReal                least, most;

  PetscFunctionBegin;
  *sign = NULL;
  PetscCall(MatHasOperation(mat, MATOP_GET_DIAGONAL, &has));
  PetscCall(MatGetSize(mat, &size[0], &size[1]));
  if (!has || size[0] != size[1]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthFindOpaque(mat, &opaque));
  if (!rows && !opaque) PetscCall(AinsworthGetFacts(mat, &facts)); /* they are needed of A, and have the diagonal */
  PetscCall(AinsworthCreateDiagonal(mat, &diagonal));
  part = diagonal;
  if (rows) PetscCall(VecGetSubVector(diagonal, rows, &part));
  PetscCall(VecMin(part, NULL, &least)); /* most matrices need no search of their rows */
  if (rows) PetscCall(VecRestoreSubVector(diagonal, rows, &part));
  if (least < 0.0 && !opaque) {
    PetscCall(AinsworthClassifyDiagonal(mat, diagonal));
    if (rows) PetscCall(VecGetSubVector(diagonal, rows, &part));
    PetscCall(VecMax(part, NULL, &most));
    if (most <= (rows ? (PetscReal)AINSWORTH_ENTRY_PLAIN : 0.0)) PetscCall(AinsworthVecClone(part, sign));
    if (rows) PetscCall(VecRestoreSubVector(diagonal, rows, &part));
  }
  PetscCall(VecDestroy(&diagonal));
  if (!*sign) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthUpdate(*sign, [](PetscInt, PetscScalar &s) { s = PetscRealPart(s) > 0.0 ? 1.0 : -1.0; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthChangeSign - changes the sign of a block, except in plain rows of A; avoids MatDiagonalScale() on A, which
   would declare it not symmetric
*/
PetscErrorCode AinsworthChangeSign(Vec sign, int k, Mat block)
{
  Vec                diagonal;
  const PetscScalar *s, *d;
  PetscInt           first, end;

  PetscFunctionBegin;
  if (!sign) PetscFunctionReturn(PETSC_SUCCESS);
  if (k == AINSWORTH_BLOCK_B) PetscCall(MatDiagonalScale(block, sign, NULL));
  else PetscCall(MatScale(block, -1.0));
  if (k != AINSWORTH_BLOCK_A && k != AINSWORTH_BLOCK_P) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateVecs(block, NULL, &diagonal));
  PetscCall(MatGetDiagonal(block, diagonal));
  PetscCall(MatGetOwnershipRange(block, &first, &end));
  PetscCall(VecGetArrayRead(diagonal, &d));
  PetscCall(VecGetArrayRead(sign, &s));
  for (PetscInt i = first; i < end; i++)
    if (PetscRealPart(s[i - first]) > 0.0) PetscCall(MatSetValue(block, i, i, -d[i - first], INSERT_VALUES));
  PetscCall(VecRestoreArrayRead(sign, &s));
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(MatAssemblyBegin(block, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(block, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}
