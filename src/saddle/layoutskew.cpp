/* Detection of the fields of a plain matrix [A -B'; B D] with a positive diagonal, from the signs of its off-diagonal entries */
#include "saddle.h"
#include "../base/loops.h"
#include <algorithm>

/* Creates a matrix with -1 where an entry is the opposite of its conjugate mirror image, 1 where it is not, and nothing where either is zero. Collective */
static PetscErrorCode CreateSigns(Mat mat, Mat *signs, PetscBool *opposites)
{
  Mat              aij, adjoint;
  PetscInt         first, end;
  AinsworthEntries rows;

  PetscFunctionBegin;
  *opposites = PETSC_FALSE;
  PetscCall(AinsworthGetAIJ(mat, &aij));
  PetscCall(MatHermitianTranspose(aij, MAT_INITIAL_MATRIX, &adjoint));
  PetscCall(MatGetOwnershipRange(aij, &first, &end));
  for (PetscInt i = first; i < end; i++) {
    PetscInt           n, m;
    const PetscInt    *j, *l;
    const PetscScalar *a, *b;

    PetscCall(MatGetRow(aij, i, &n, &j, &a));
    PetscCall(MatGetRow(adjoint, i, &m, &l, &b));
    for (PetscInt k = 0; k < n; k++) {
      const PetscInt mirror = (PetscInt)(std::lower_bound(l, l + m, j[k]) - l);

      if (j[k] == i || mirror == m || l[mirror] != j[k] || a[k] == 0.0 || b[mirror] == 0.0) continue;
      rows.add(j[k], PetscAbsScalar(a[k] + b[mirror]) <= 1e-10 * PetscAbsScalar(a[k]) ? -1.0 : 1.0);
      if (PetscRealPart(rows.values.back()) < 0.0) *opposites = PETSC_TRUE;
    }
    PetscCall(MatRestoreRow(adjoint, i, &m, &l, &b));
    PetscCall(MatRestoreRow(aij, i, &n, &j, &a));
    rows.endRow();
  }
  PetscCall(MatDestroy(&adjoint));
  PetscCall(MatDestroy(&aij));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, opposites, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)mat)));
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)mat), end - first, rows, signs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assigns sides to all rows connected to the first row without one: 1 for the larger side, -1 for the other. done: every coupled row has a side. Collective */
static PetscErrorCode FindSidesOfPart(Mat signs, Vec degree, Vec side, Vec y, PetscBool *done)
{
  MPI_Comm              comm = PetscObjectComm((PetscObject)side);
  PetscInt              first, seed = -1, grown, count[2] = {0, 0};
  PetscScalar          *s;
  std::vector<PetscInt> rows;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(side, &first, NULL));
  PetscCall(AinsworthForEntries({degree, side}, [&](PetscInt i, PetscScalar d, PetscScalar s) {
    if (seed < 0 && d != 0.0 && s == 0.0) seed = first + i;
  }));
  PetscCall(AinsworthAgreeOnFirst(comm, &seed));
  *done = (PetscBool)(seed < 0);
  if (*done) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecZeroEntries(y));
  PetscCall(VecSetValue(y, seed, 1.0, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(y));
  PetscCall(VecAssemblyEnd(y));
  do {
    grown = 0;
    PetscCall(AinsworthUpdate(side, {y}, [&](PetscInt i, PetscScalar &s, PetscScalar sum) {
      if (s != 0.0 || sum == 0.0) return;
      s = PetscRealPart(sum) > 0.0 ? 1.0 : -1.0;
      rows.push_back(i);
      grown++;
    }));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &grown, 1, MPIU_INT, MPI_SUM, comm));
    PetscCall(MatMult(signs, side, y));
  } while (grown);
  PetscCall(VecGetArray(side, &s));
  for (PetscInt i : rows) count[PetscRealPart(s[i]) < 0.0]++;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, comm));
  if (count[1] > count[0])
    for (PetscInt i : rows) s[i] = -s[i];
  PetscCall(VecRestoreArray(side, &s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindSides - finds 1 for rows of primal unknowns, the majority in each connected part of the matrix, and -1 for rows of multipliers. Collective

   *side is NULL if no entry has an opposite mirror image, or if signs contradict each other.
*/
PetscErrorCode AinsworthFindSides(Mat mat, Vec *side)
{
  Mat       signs;
  Vec       degree, y;
  PetscReal norm;
  PetscBool opposites, done = PETSC_FALSE;

  PetscFunctionBegin;
  *side = NULL;
  PetscCall(CreateSigns(mat, &signs, &opposites));
  if (opposites) {
    PetscCall(MatCreateVecs(signs, side, &y));
    PetscCall(VecDuplicate(y, &degree));
    PetscCall(AinsworthRowSums(signs, 1, degree));
    PetscCall(VecSet(*side, 0.0));
    for (int parts = 0; parts < 64 && !done; parts++) PetscCall(FindSidesOfPart(signs, degree, *side, y, &done));
    PetscCall(MatMult(signs, *side, y)); /* check that the sign of every entry matches the sides of its two rows */
    PetscCall(VecPointwiseMult(y, y, *side));
    PetscCall(VecAXPY(y, -1.0, degree));
    PetscCall(VecNorm(y, NORM_INFINITY, &norm));
    if (!done) PetscCall(PetscInfo(mat, "The matrix has more than 64 connected parts: the fields are not found from signs of its entries\n"));
    if (!done || !(norm == 0.0)) PetscCall(VecDestroy(side));
    PetscCall(VecDestroy(&degree));
    PetscCall(VecDestroy(&y));
  }
  PetscCall(MatDestroy(&signs));
  if (!*side) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthUpdate(*side, [](PetscInt, PetscScalar &s) {
    if (s == 0.0) s = 1.0; /* rows without off-diagonal entries */
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}
