/* Nothing but a matrix: the diagonal tells which rows are those of multipliers */
#include "saddle.h"
#include <petsc/private/petscimpl.h>

/* Collective: is every row with a positive diagonal entry plain, without another entry? */
static PetscErrorCode PositiveArePlain(Mat mat, Vec diagonal, PetscBool *plain)
{
  Mat                aij;
  const PetscScalar *d;
  PetscInt           first, end;

  PetscFunctionBegin;
  *plain = PETSC_TRUE;
  PetscCall(AinsworthGetAIJ(mat, &aij));
  PetscCall(MatGetOwnershipRange(aij, &first, &end));
  PetscCall(VecGetArrayRead(diagonal, &d));
  for (PetscInt i = first; i < end && *plain; i++) {
    PetscInt           n, entries = 0;
    const PetscScalar *v;

    if (!(PetscRealPart(d[i - first]) > 0.0)) continue;
    PetscCall(MatGetRow(aij, i, &n, NULL, &v));
    for (PetscInt k = 0; k < n; k++) entries += v[k] != 0.0;
    PetscCall(MatRestoreRow(aij, i, &n, NULL, &v));
    *plain = (PetscBool)(entries == 1);
  }
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  PetscCall(MatDestroy(&aij));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, plain, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)mat)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthDetectFields - two fields, the multipliers' and the others; refused where that is no saddle point

   Multipliers have no positive diagonal entry. Where no row has, but for Dirichlet conditions, the matrix is minus a saddle point, and they have a zero.
   Where all rows have, the signs of what couples them tell.
*/
PetscErrorCode AinsworthDetectFields(Mat mat, AinsworthSaddleBlocks *found)
{
  MPI_Comm           comm = PetscObjectComm((PetscObject)mat);
  Vec                diagonal, side = NULL;
  const PetscScalar *d;
  PetscInt           first, n, size[2];
  PetscBool          opposite;
  PetscReal          least;
  AinsworthIS        set[2];

  PetscFunctionBegin;
  PetscCall(AinsworthCheckAssembled(mat, "The matrix"));
  PetscCall(MatGetSize(mat, &size[0], &size[1]));
  PetscCheck(size[0] == size[1], comm, PETSC_ERR_ARG_SIZ, "The matrix is not square: %" PetscInt_FMT " x %" PetscInt_FMT, size[0], size[1]);
  PetscCall(AinsworthCreateDiagonal(mat, &diagonal));
  PetscCall(PositiveArePlain(mat, diagonal, &opposite));
  found->told   = "by the diagonal";
  found->chosen = "their diagonal entries are not positive";
  PetscCall(VecMin(diagonal, NULL, &least));
  if (least > 0.0 && !opposite) PetscCall(AinsworthFindSides(mat, &side));
  if (side) {
    PetscCall(VecDestroy(&diagonal));
    diagonal      = side;
    found->told   = "by signs";
    found->chosen = "what couples them with the others has opposite signs on both sides";
  }
  PetscCall(VecGetOwnershipRange(diagonal, &first, NULL));
  PetscCall(VecGetLocalSize(diagonal, &n));
  PetscCall(VecGetArrayRead(diagonal, &d));
  for (int k = 0; k < 2; k++) {
    PetscInt *index, local = 0;
    IS        is;

    PetscCall(PetscMalloc1(n, &index));
    for (PetscInt i = 0; i < n; i++)
      if ((opposite ? d[i] == 0.0 : PetscRealPart(d[i]) <= 0.0) == (k == 1)) index[local++] = first + i;
    PetscCall(ISCreateGeneral(comm, local, index, PETSC_OWN_POINTER, &is));
    PetscCall(ISGetSize(is, &size[k]));
    set[k] = AinsworthOwnIS(is);
  }
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  found->fields = {
    {"primal",      set[0], set[0]},
    {"multipliers", set[1], set[1]}
  };
  found->multiplier = {false, true};
  PetscCheck(size[0] && size[1], comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no saddle point in the matrix of type %s: %s; name the fields by PCFieldSplitSetIS() or pass a MatNest, [A C'; C 0]",
             ((PetscObject)mat)->type_name,
             !size[0]   ? "its diagonal is zero"
             : opposite ? "every diagonal entry is negative"
                        : "every diagonal entry is positive");
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCheckDetected - refuses a row without a diagonal entry that is coupled with another that is not positive: it need not be that of a multiplier. Collective */
PetscErrorCode AinsworthCheckDetected(const AinsworthSaddleBlocks *found)
{
  Mat                D    = found->block[AINSWORTH_BLOCK_D];
  MPI_Comm           comm = PetscObjectComm((PetscObject)D);
  Vec                diagonal;
  const PetscScalar *d;
  const PetscInt    *index;
  PetscInt           first, end, row = PETSC_MAX_INT;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateDiagonal(D, &diagonal));
  PetscCall(VecGetArrayRead(diagonal, &d));
  PetscCall(ISGetIndices(found->rows[1], &index));
  PetscCall(MatGetOwnershipRange(D, &first, &end));
  for (PetscInt i = end - 1; i >= first; i--) {
    PetscInt           n;
    const PetscScalar *v;

    if (d[i - first] != 0.0) continue;
    PetscCall(MatGetRow(D, i, &n, NULL, &v));
    for (PetscInt k = 0; k < n; k++)
      if (v[k] != 0.0) row = index[i - first];
    PetscCall(MatRestoreRow(D, i, &n, NULL, &v));
  }
  PetscCall(ISRestoreIndices(found->rows[1], &index));
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &row, 1, MPIU_INT, MPI_MIN, comm));
  PetscCheck(row == PETSC_MAX_INT, comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH cannot tell the multipliers by the diagonal of the matrix of type %s: row %" PetscInt_FMT
             " has a zero on it and is coupled with another row that has no positive entry there; name the fields by PCFieldSplitSetIS()",
             found->layout, row);
  PetscFunctionReturn(PETSC_SUCCESS);
}
