/* Diagonals of matrices */
#include "saddle.h"
#include "../base/objects.h"
#include <algorithm>

/* Reads the diagonal of an AIJ matrix by bisection of each row; MatGetDiagonal() searches linearly */
static PetscErrorCode ReadDiagonal(Mat aij, Vec diagonal)
{
  Mat             mat[2];
  const PetscInt *ghosts;
  PetscInt        nghosts;
  PetscScalar    *d;
  AinsworthCSR    part;

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(aij, mat, &ghosts, &nghosts));
  PetscCall(part.open(mat[0]));
  PetscCall(VecGetArrayWrite(diagonal, &d));
  for (PetscInt r = 0; r < part.n; r++) {
    const PetscInt *end = part.ja + part.ia[r + 1], *at = std::lower_bound(part.ja + part.ia[r], end, r);

    d[r] = at < end && *at == r ? part.a[at - part.ja] : 0.0;
  }
  PetscCall(VecRestoreArrayWrite(diagonal, &d));
  PetscCall(part.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGetDiagonal - gets the diagonal of any matrix

   Caches the diagonal of an AIJ matrix with the matrix, until its state changes: every row is a memory access, and a set-up after a change of C alone would
   spend a quarter of its time here.
*/
PetscErrorCode AinsworthGetDiagonal(Mat M, Vec diagonal)
{
  static const char name[] = "AinsworthDiagonal", mark[] = "AinsworthDiagonalKept";
  PetscBool         aij, kept, current;
  Vec               copy;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)M, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  if (!aij) {
    PetscCall(MatGetDiagonal(M, diagonal));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthRecall((PetscObject)M, mark, &kept, &current));
  PetscCall(PetscObjectQuery((PetscObject)M, name, (PetscObject *)&copy));
  if (copy && current) {
    PetscCall(VecCopy(copy, diagonal));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(ReadDiagonal(M, diagonal));
  if (!copy) {
    PetscCall(VecDuplicate(diagonal, &copy));
    PetscCall(PetscObjectCompose((PetscObject)M, name, (PetscObject)copy));
    PetscCall(PetscObjectDereference((PetscObject)copy)); /* M holds the reference */
  }
  PetscCall(VecCopy(diagonal, copy));
  PetscCall(AinsworthRemember((PetscObject)M, mark, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCreateDiagonal - creates the diagonal of any matrix as a plain vector, also of a MatNest whose vectors are nests. Collective */
PetscErrorCode AinsworthCreateDiagonal(Mat mat, Vec *diagonal)
{
  Vec                given;
  PetscBool          nest;
  AinsworthTransfer  transfer;
  AinsworthSaddleVec all;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(mat, NULL, diagonal));
  PetscCall(AinsworthGetDiagonal(mat, *diagonal));
  PetscCall(PetscObjectTypeCompare((PetscObject)*diagonal, VECNEST, &nest));
  if (!nest) PetscFunctionReturn(PETSC_SUCCESS);
  given = *diagonal;
  PetscCall(AinsworthTransferIn(&transfer, mat, PETSC_TRUE, NULL, PETSC_FALSE, given, &all));
  PetscCall(AinsworthVecClone(all.primal, diagonal));
  PetscCall(AinsworthTransferOut(&transfer, &all));
  PetscCall(AinsworthTransferDestroy(&transfer));
  PetscCall(VecDestroy(&given));
  PetscFunctionReturn(PETSC_SUCCESS);
}
