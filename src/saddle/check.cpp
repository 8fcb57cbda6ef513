#include "saddle.h"
#include "../loops.h"
#include <petsc/private/petscimpl.h>
#include <limits>

/* Blocks are taken for adjoint that differ by this part of their entries, the rounding of a program's own */
static const PetscReal adjoint = 1e-10;

/* Collective: the smallest of the numbers that the ranks found, -1 where none did */
PetscErrorCode AinsworthAgreeOnFirst(MPI_Comm comm, PetscInt *number)
{
  PetscFunctionBegin;
  if (*number < 0) *number = PETSC_MAX_INT;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, number, 1, MPIU_INT, MPI_MIN, comm));
  if (*number == PETSC_MAX_INT) *number = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The entry with the smallest row, then the smallest column of its rank, for which wanted(row, column, value); row = -1 where there is none or the type of M
   has no rows to look at
*/
template <typename Predicate>
static PetscErrorCode FindEntry(Mat M, PetscInt *row, PetscInt *col, Predicate wanted)
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
  if (mine != *row) *col = -1; /* a row belongs to one rank */
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, col, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)M)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: the first entry that is not zero, row = -1 where there is none */
PetscErrorCode AinsworthMatFindNonzero(Mat M, PetscInt *row, PetscInt *col)
{
  PetscFunctionBegin;
  PetscCall(FindEntry(M, row, col, [](PetscInt, PetscInt, PetscScalar v) { return v != 0.0; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: the first entry that is NaN or Inf, row = -1 where there is none */
PetscErrorCode AinsworthMatFindNotFinite(Mat M, PetscInt *row, PetscInt *col)
{
  PetscFunctionBegin;
  PetscCall(FindEntry(M, row, col, [](PetscInt, PetscInt, PetscScalar v) { return (bool)PetscIsInfOrNanScalar(v); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: the first entry off the diagonal that is not zero, row = -1 where there is none */
PetscErrorCode AinsworthMatFindOffDiagonal(Mat M, PetscInt *row, PetscInt *col)
{
  PetscFunctionBegin;
  PetscCall(FindEntry(M, row, col, [](PetscInt i, PetscInt j, PetscScalar v) { return i != j && v != 0.0; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: are two AIJ matrices the same, row by row up to rounding? */
PetscErrorCode AinsworthMatEqual(Mat C, Mat other, PetscBool *same)
{
  Mat difference;
  Vec most, largest;

  PetscFunctionBegin;
  *same = PETSC_TRUE;
  PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &difference));
  PetscCall(AinsworthAddAIJ(-1.0, {other}, &difference));
  PetscCall(MatCreateVecs(C, NULL, &most));
  PetscCall(VecDuplicate(most, &largest));
  PetscCall(MatGetRowMaxAbs(difference, most, NULL));
  PetscCall(MatGetRowMaxAbs(C, largest, NULL));
  PetscCall(MatDestroy(&difference));
  PetscCall(AinsworthForEntries({most, largest}, [&](PetscInt, PetscScalar d, PetscScalar c) {
    if (!(PetscAbsScalar(d) <= adjoint * PetscAbsScalar(c))) *same = PETSC_FALSE;
  }));
  PetscCall(VecDestroy(&largest));
  PetscCall(VecDestroy(&most));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, same, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)C)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Collective: do C' u and Ct u agree for a random u, or are they opposite? Each row of C has the same share in it, whatever its scale

   A row of zeros has no scale: what Ct has there is asked for by a product of its own, and is nothing where they agree.
*/
PetscErrorCode AinsworthProbeAdjoint(Mat C, Mat Ct, PetscBool *same, PetscBool *opposite)
{
  Vec       u, zero, x, y, largest;
  PetscReal norm, difference, empty, beside = 0.0;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(C, &x, &u));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecSetRandom(u, NULL));
  PetscCall(VecDuplicate(u, &largest));
  PetscCall(VecDuplicate(u, &zero));
  PetscCall(MatGetRowMaxAbs(C, largest, NULL));
  PetscCall(AinsworthUpdate(zero, {u, largest}, [](PetscInt, PetscScalar &z, PetscScalar a, PetscScalar size) { z = size == 0.0 ? 1.0 + a : 0.0; }));
  PetscCall(AinsworthUpdate(u, {largest}, [](PetscInt, PetscScalar &a, PetscScalar size) { a = size == 0.0 ? 0.0 : (1.0 + a) / PetscAbsScalar(size); }));
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

/* Collective: refuses a block that waits for its assembly on any rank; each rank knows only of the values that it set itself */
PetscErrorCode AinsworthCheckAssembled(Mat M, const char name[])
{
  PetscBool assembled;

  PetscFunctionBegin;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAssembled(M, &assembled));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &assembled, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)M)));
  PetscCheck(assembled, PetscObjectComm((PetscObject)M), PETSC_ERR_ARG_WRONGSTATE, "%s is not assembled: call MatAssemblyBegin() and MatAssemblyEnd() on it",
             name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBlockNorm - the Frobenius norm of a block, 0 where it is absent or zero and only there, Inf where its type has none

   Collective. A is looked at once while it does not change, however often C does.
*/
PetscErrorCode AinsworthBlockNorm(Mat M, PetscReal *norm)
{
  static PetscInt normId = -1;
  PetscBool       has, known;
  PetscInt        row, col;
  uint64_t        state;

  PetscFunctionBegin;
  *norm = 0.0;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthMatGetState(M, &state)); /* changes of its parts come to its own state */
  PetscCall(MatHasOperation(M, MATOP_NORM, &has));
  if (!has) {
    *norm = PETSC_INFINITY;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (normId < 0) PetscCall(PetscObjectComposedDataRegister(&normId));
  PetscCall(PetscObjectComposedDataGetReal((PetscObject)M, normId, *norm, known));
  if (known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNorm(M, NORM_FROBENIUS, norm));
  if (*norm == 0.0) { /* or the squares of its entries underflow */
    PetscCall(AinsworthMatFindNonzero(M, &row, &col));
    if (row >= 0) *norm = std::numeric_limits<PetscReal>::min();
  }
  PetscCall(PetscObjectComposedDataSetReal((PetscObject)M, normId, *norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
