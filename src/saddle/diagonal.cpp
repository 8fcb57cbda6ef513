/* Diagonals of matrices */
#include "saddle.h"
#include "../base/layouts.h"
#include "../base/objects.h"

static const char name[] = "AinsworthDiagonal";

/* AinsworthRememberDiagonal - keeps the diagonal of an AIJ matrix with it, until its state changes */
PetscErrorCode AinsworthRememberDiagonal(Mat M, AinsworthRef<Vec> diagonal)
{
  PetscFunctionBegin;
  PetscCall(AinsworthRemember((PetscObject)M, name, diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGetDiagonal - gets the diagonal of any matrix

   Caches the diagonal of an AIJ matrix with the matrix, until its state changes: every row is a memory access, and a
   set-up after a change of C alone would spend a quarter of its time here.
*/
PetscErrorCode AinsworthGetDiagonal(Mat M, Vec diagonal)
{
  AinsworthRef<Vec> kept;
  PetscBool         aij, current;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)M, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  if (!aij) {
    PetscCall(MatGetDiagonal(M, diagonal));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthRecall((PetscObject)M, name, &kept, &current));
  if (!current) {
    PetscCall(VecDuplicate(diagonal, kept.out()));
    PetscCall(MatGetDiagonal(M, kept));
    PetscCall(AinsworthRememberDiagonal(M, kept));
  }
  PetscCall(VecCopy(kept, diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthCreateDiagonal - creates the diagonal of any matrix as a plain vector, also of a MatNest whose vectors are
   nests. Collective
*/
PetscErrorCode AinsworthCreateDiagonal(Mat mat, Vec *diagonal)
{
  Vec       given;
  PetscBool nest;
  PetscInt  n;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(mat, NULL, &given));
  PetscCall(AinsworthGetDiagonal(mat, given));
  *diagonal = given;
  PetscCall(PetscObjectTypeCompare((PetscObject)given, VECNEST, &nest));
  if (!nest) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(given, &n));
  PetscCall(VecCreate(PetscObjectComm((PetscObject)mat), diagonal));
  PetscCall(VecSetSizes(*diagonal, n, PETSC_DETERMINE));
  PetscCall(VecSetType(*diagonal, VECSTANDARD));
  PetscCall(AinsworthVecCopyEntries(given, *diagonal));
  PetscCall(VecDestroy(&given));
  PetscFunctionReturn(PETSC_SUCCESS);
}
