/* Nothing but a matrix: multipliers are the rows whose diagonal entry is not positive. An identity row, of a Dirichlet condition for instance, is primal */
#include "saddle.h"
#include <petsc/private/petscimpl.h>

/* Collective: the first row without a diagonal entry that another such row is coupled with; -1 where there is none */
static PetscErrorCode FindCoupled(Mat mat, IS rows, Vec diagonal, PetscInt *row)
{
  Mat                whole, D;
  Vec                d;
  const PetscScalar *a;
  const PetscInt    *index;
  PetscInt           first, end, mine = PETSC_MAX_INT;

  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(mat, &whole));
  PetscCall(MatCreateSubMatrix(whole, rows, rows, MAT_INITIAL_MATRIX, &D));
  PetscCall(MatDestroy(&whole));
  PetscCall(VecGetSubVector(diagonal, rows, &d));
  PetscCall(VecGetArrayRead(d, &a));
  PetscCall(ISGetIndices(rows, &index));
  PetscCall(MatGetOwnershipRange(D, &first, &end));
  for (PetscInt i = end - 1; i >= first; i--) {
    PetscInt           n;
    const PetscInt    *cols;
    const PetscScalar *v;

    if (a[i - first] != 0.0) continue;
    PetscCall(MatGetRow(D, i, &n, &cols, &v));
    for (PetscInt k = 0; k < n; k++)
      if (v[k] != 0.0) mine = index[i - first];
    PetscCall(MatRestoreRow(D, i, &n, &cols, &v));
  }
  PetscCall(ISRestoreIndices(rows, &index));
  PetscCall(VecRestoreArrayRead(d, &a));
  PetscCall(VecRestoreSubVector(diagonal, rows, &d));
  PetscCall(MatDestroy(&D));
  PetscCall(MPIU_Allreduce(&mine, row, 1, MPIU_INT, MPI_MIN, PetscObjectComm((PetscObject)mat)));
  if (*row == PETSC_MAX_INT) *row = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthDetectFields - two fields, the rows with a positive diagonal entry and the others; refused where that is no saddle point */
PetscErrorCode AinsworthDetectFields(Mat mat, AinsworthFields *fields)
{
  MPI_Comm           comm = PetscObjectComm((PetscObject)mat);
  Vec                diagonal;
  const PetscScalar *d;
  PetscInt           first, n, size[2], row;
  IS                 set[2];

  PetscFunctionBegin;
  PetscCall(AinsworthCheckAssembled(mat, "The matrix"));
  PetscCall(MatGetSize(mat, &size[0], &size[1]));
  PetscCheck(size[0] == size[1], comm, PETSC_ERR_ARG_SIZ, "The matrix is not square: %" PetscInt_FMT " x %" PetscInt_FMT, size[0], size[1]);
  PetscCall(MatCreateVecs(mat, NULL, &diagonal));
  PetscCall(MatGetDiagonal(mat, diagonal));
  PetscCall(VecGetOwnershipRange(diagonal, &first, NULL));
  PetscCall(VecGetLocalSize(diagonal, &n));
  PetscCall(VecGetArrayRead(diagonal, &d));
  for (int k = 0; k < 2; k++) {
    PetscInt *index, local = 0;

    PetscCall(PetscMalloc1(n, &index));
    for (PetscInt i = 0; i < n; i++)
      if ((PetscRealPart(d[i]) <= 0.0) == (k == 1)) index[local++] = first + i;
    PetscCall(ISCreateGeneral(comm, local, index, PETSC_OWN_POINTER, &set[k]));
    PetscCall(ISGetSize(set[k], &size[k]));
  }
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  const AinsworthIS owned[] = {AinsworthOwnIS(set[0]), AinsworthOwnIS(set[1])};

  *fields = {
    {"primal",      owned[0], owned[0]},
    {"multipliers", owned[1], owned[1]}
  };
  PetscCheck(size[0] && size[1], comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no saddle point in the matrix of type %s: %s diagonal entry is positive; name the fields by PCFieldSplitSetIS() or pass a "
             "MatNest, [A C'; C 0]",
             ((PetscObject)mat)->type_name, size[0] ? "every" : "no");
  PetscCall(FindCoupled(mat, set[1], diagonal, &row));
  PetscCall(VecDestroy(&diagonal));
  PetscCheck(row < 0, comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH cannot tell the multipliers by the diagonal of the matrix of type %s: row %" PetscInt_FMT
             " has a zero on it and is coupled with another row that has no positive entry there; name the fields by PCFieldSplitSetIS()",
             ((PetscObject)mat)->type_name, row);
  PetscFunctionReturn(PETSC_SUCCESS);
}
