#include "saddle.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"

/* Relative difference up to which blocks count as adjoint, for the rounding of the program */
static const PetscReal adjoint = 1e-10;

/* Finds the smallest nonnegative number of all ranks, -1 if there is none. Collective */
PetscErrorCode AinsworthAgreeOnFirst(MPI_Comm comm, PetscInt *number)
{
  PetscFunctionBegin;
  if (*number < 0) *number = PETSC_MAX_INT;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, number, 1, MPIU_INT, MPI_MIN, comm));
  if (*number == PETSC_MAX_INT) *number = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthMatFindEntry - finds the first entry, by row and then by storage order, that is wanted. Collective

   row is -1 if there is none or if the type of M gives no rows.
*/
PetscErrorCode AinsworthMatFindEntry(Mat M, AinsworthIsWanted *wanted, PetscInt *row, PetscInt *col)
{
  PetscBool has;
  PetscInt  rstart, rend, mine;

  PetscFunctionBegin;
  *row = *col = -1;
  PetscCall(MatHasOperation(M, MATOP_GET_ROW, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRange(M, &rstart, &rend));
  PetscCall(MatGetRowUpperTriangular(M));
  for (PetscInt i = rstart; i < rend && *row < 0; i++) {
    PetscInt           ncols;
    const PetscInt    *cols;
    const PetscScalar *v;

    PetscCall(MatGetRow(M, i, &ncols, &cols, &v));
    for (PetscInt k = 0; k < ncols && *row < 0; k++) {
      if (!wanted(i, cols[k], v[k])) continue;
      *row = i;
      *col = cols[k];
    }
    PetscCall(MatRestoreRow(M, i, &ncols, &cols, &v));
  }
  PetscCall(MatRestoreRowUpperTriangular(M));
  mine = *row;
  PetscCall(AinsworthAgreeOnFirst(PetscObjectComm((PetscObject)M), row));
  if (mine != *row) *col = -1; /* another rank owns the row */
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, col, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)M)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Tells whether C' u and Ct u are equal, or opposite, for a random u in which each row of C has the same share whatever
   its scale. Collective

   Zero rows of C have no scale: Ct must have nothing there, which a separate product checks.
*/
PetscErrorCode AinsworthProbeAdjoint(Mat C, Mat Ct, PetscBool *same, PetscBool *opposite)
{
  Vec       u, zero, x, y, largest;
  PetscReal norm, difference, empty, beside = 0.0;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(C, &x, &u));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecSetRandom(u, NULL));
  PetscCall(VecDuplicate(u, &largest));
  PetscCall(VecDuplicate(u, &zero));
  PetscCall(MatGetRowMaxAbs(C, largest, NULL));
  PetscCall(AinsworthUpdate(zero, {u, largest}, [](PetscInt, PetscScalar &z, PetscScalar a, PetscScalar size) {
    z = size == 0.0 ? 1.0 + a : 0.0;
  }));
  PetscCall(AinsworthUpdate(u, {largest}, [](PetscInt, PetscScalar &a, PetscScalar size) {
    a = size == 0.0 ? 0.0 : (1.0 + a) / PetscAbsScalar(size);
  }));
  PetscCall(VecNorm(zero, NORM_INFINITY, &empty));
  if (empty > 0.0) {
    PetscCall(MatMult(Ct, zero, y));
    PetscCall(VecNorm(y, NORM_INFINITY, &beside));
  }
  PetscCall(MatMultHermitianTranspose(C, u, x));
  PetscCall(MatMult(Ct, u, y));
  PetscCall(VecNorm(x, NORM_2, &norm));
  PetscCall(VecAXPY(y, -1.0, x));
  PetscCall(VecNorm(y, NORM_2, &difference));
  *same = (PetscBool)(beside == 0.0 && difference <= adjoint * norm);
  PetscCall(VecAXPY(y, 2.0, x));
  PetscCall(VecNorm(y, NORM_2, &difference));
  *opposite = (PetscBool)(!*same && beside == 0.0 && difference <= adjoint * norm);
  for (Vec *v : {&largest, &zero, &u, &x, &y}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tells whether two matrices are equal up to rounding: whether the adjoint of one is that of the other. Collective */
PetscErrorCode AinsworthMatEqual(Mat C, Mat other, PetscBool *same)
{
  Mat       adjoint;
  PetscBool opposite;

  PetscFunctionBegin;
  PetscCall(MatCreateHermitianTranspose(other, &adjoint));
  PetscCall(AinsworthProbeAdjoint(C, adjoint, same, &opposite));
  PetscCall(MatDestroy(&adjoint));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Raises an error if a block is not assembled on some rank, since each rank knows only about the values that it has
   set. Collective
*/
PetscErrorCode AinsworthCheckAssembled(Mat M, const char name[])
{
  PetscBool assembled;

  PetscFunctionBegin;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAssembled(M, &assembled));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &assembled, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)M)));
  PetscCheck(assembled, PetscObjectComm((PetscObject)M), PETSC_ERR_ARG_WRONGSTATE,
             "%s is not assembled: call MatAssemblyBegin() and MatAssemblyEnd() on it", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds whether a block is absent or has no nonzero entry; one that does not give its entries has some. Collective */
PetscErrorCode AinsworthIsZero(Mat M, PetscBool *zero)
{
  Mat      opaque, aij;
  PetscInt row, col;

  PetscFunctionBegin;
  *zero = PETSC_TRUE;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  *zero = PETSC_FALSE;
  PetscCall(AinsworthFindOpaque(M, &opaque));
  if (opaque) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(M, &aij));
  PetscCall(AinsworthMatFindEntry(aij, AinsworthIsNonzero, &row, &col));
  PetscCall(MatDestroy(&aij));
  *zero = (PetscBool)(row < 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
