/* Minus a saddle point: no entry of the diagonal of A is positive, but in rows of Dirichlet conditions, which have no other entry */
#include "saddle.h"
#include "../loops.h"
#include "../objects.h"

/* What the diagonal entry of a row is */
enum Entry {
  ZERO     = -2,
  NEGATIVE = -1,
  PLAIN    = 1, /* positive, and alone */
  POSITIVE = 2
};

/* Collective: is there an entry below, or one above some bound? */
static PetscErrorCode Any(Vec v, bool below, PetscReal bound, PetscBool *any)
{
  PetscFunctionBegin;
  *any = PETSC_FALSE;
  PetscCall(AinsworthForEntries({v}, [=](PetscInt, PetscScalar a) {
    if (below ? PetscRealPart(a) < bound : PetscRealPart(a) > bound) *any = PETSC_TRUE;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, any, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)v)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* entries, the diagonal of an AIJ, becomes what these are */
static PetscErrorCode LookAtRows(Mat aij, Vec entries)
{
  PetscScalar *e;
  PetscInt     first, end;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(aij, &first, &end));
  PetscCall(VecGetArray(entries, &e));
  for (PetscInt i = first; i < end; i++) {
    const PetscReal d = PetscRealPart(e[i - first]);
    bool            coupled;

    e[i - first] = d < 0.0 ? NEGATIVE : ZERO;
    if (!(d > 0.0)) continue;
    PetscCall(AinsworthIsCoupled(aij, i, &coupled));
    e[i - first] = coupled ? POSITIVE : PLAIN;
  }
  PetscCall(VecRestoreArray(entries, &e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindSign - -1 for each of some rows of a matrix, 1 for plain ones, where it is minus a saddle point, otherwise NULL

   rows NULL: all rows of A alone, none of which is plain, as C may use its unknown
*/
PetscErrorCode AinsworthFindSign(Mat mat, IS rows, Vec *sign)
{
  Vec       diagonal, part;
  Mat       aij;
  PetscBool has, negative, positive = PETSC_FALSE;
  PetscInt  size[2];

  PetscFunctionBegin;
  *sign = NULL;
  PetscCall(MatHasOperation(mat, MATOP_GET_DIAGONAL, &has));
  PetscCall(MatGetSize(mat, &size[0], &size[1]));
  if (!has || size[0] != size[1]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateDiagonal(mat, &diagonal));
  part = diagonal;
  if (rows) PetscCall(VecGetSubVector(diagonal, rows, &part));
  PetscCall(Any(part, true, 0.0, &negative)); /* of most matrices no row is looked at */
  if (rows) PetscCall(VecRestoreSubVector(diagonal, rows, &part));
  if (negative) {
    PetscCall(AinsworthFindOpaque(mat, &aij));
    negative = (PetscBool)!aij;
  }
  if (negative) {
    PetscCall(AinsworthGetAIJ(mat, &aij));
    PetscCall(LookAtRows(aij, diagonal));
    PetscCall(MatDestroy(&aij));
    if (rows) PetscCall(VecGetSubVector(diagonal, rows, &part));
    PetscCall(Any(part, false, rows ? (PetscReal)PLAIN : 0.0, &positive));
    if (!positive) PetscCall(AinsworthVecClone(part, sign));
    if (rows) PetscCall(VecRestoreSubVector(diagonal, rows, &part));
  }
  PetscCall(VecDestroy(&diagonal));
  if (!*sign) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthUpdate(*sign, [](PetscInt, PetscScalar &s) { s = PetscRealPart(s) > 0.0 ? 1.0 : -1.0; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthChangeSign - of a block; plain rows of A keep theirs. MatDiagonalScale() would make it a matrix that is known not to be symmetric */
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
  PetscCall(MatCreateVecs(block, NULL, &diagonal));
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
