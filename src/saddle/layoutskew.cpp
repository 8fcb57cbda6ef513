/* Nothing but a matrix whose diagonal is positive: [A -B'; B D], whose fields are told by the signs of what couples them */
#include "saddle.h"
#include <algorithm>

/* The signs of a matrix: 1 where entry and conjugate mirror image are unlike opposites, -1 where they are opposites, nothing where one of both is zero */
static PetscErrorCode CreateSigns(Mat mat, Mat *signs, PetscBool *opposites)
{
  Mat                      aij, adjoint;
  PetscInt                 first, end;
  std::vector<PetscInt>    start(1, 0), columns;
  std::vector<PetscScalar> values;

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
      columns.push_back(j[k]);
      values.push_back(PetscAbsScalar(a[k] + b[mirror]) <= 1e-10 * PetscAbsScalar(a[k]) ? -1.0 : 1.0);
      if (PetscRealPart(values.back()) < 0.0) *opposites = PETSC_TRUE;
    }
    PetscCall(MatRestoreRow(adjoint, i, &m, &l, &b));
    PetscCall(MatRestoreRow(aij, i, &n, &j, &a));
    start.push_back((PetscInt)columns.size());
  }
  PetscCall(MatDestroy(&adjoint));
  PetscCall(MatDestroy(&aij));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, opposites, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)mat)));
  columns.push_back(0); /* no null pointer where there are none */
  values.push_back(0.0);
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)mat), end - first, end - first, start, columns, values, signs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds to n what it is on all ranks */
static PetscErrorCode Sum(Vec v, PetscInt n[2])
{
  PetscFunctionBegin;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, n, 2, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)v)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives a side to all rows that hang together with the first one without: to the more numerous ones 1, to the others -1. done: there is no such row */
static PetscErrorCode FindSidesOfPart(Mat signs, Vec degree, Vec side, Vec y, PetscBool *done)
{
  PetscInt              first, n, seed = PETSC_MAX_INT, count[2] = {0, 0}, grown[2] = {1, 0};
  PetscScalar          *s;
  const PetscScalar    *d, *sum;
  std::vector<PetscInt> rows;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(side, &first, NULL));
  PetscCall(VecGetLocalSize(side, &n));
  PetscCall(VecGetArray(side, &s));
  PetscCall(VecGetArrayRead(degree, &d));
  for (PetscInt i = n - 1; i >= 0; i--)
    if (d[i] != 0.0 && s[i] == 0.0) seed = first + i;
  PetscCall(VecRestoreArrayRead(degree, &d));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &seed, 1, MPIU_INT, MPI_MIN, PetscObjectComm((PetscObject)side)));
  if (seed >= first && seed < first + n) {
    s[seed - first] = 1.0;
    rows.push_back(seed - first);
  }
  PetscCall(VecRestoreArray(side, &s));
  *done = (PetscBool)(seed == PETSC_MAX_INT);
  while (grown[0] && !*done) {
    grown[0] = 0;
    PetscCall(MatMult(signs, side, y));
    PetscCall(VecGetArray(side, &s));
    PetscCall(VecGetArrayRead(y, &sum));
    for (PetscInt i = 0; i < n; i++) {
      if (s[i] != 0.0 || sum[i] == 0.0) continue;
      s[i] = PetscRealPart(sum[i]) > 0.0 ? 1.0 : -1.0;
      rows.push_back(i);
      grown[0]++;
    }
    PetscCall(VecRestoreArrayRead(y, &sum));
    PetscCall(VecRestoreArray(side, &s));
    PetscCall(Sum(side, grown));
  }
  PetscCall(VecGetArray(side, &s));
  for (PetscInt i : rows) count[PetscRealPart(s[i]) < 0.0]++;
  PetscCall(Sum(side, count));
  if (count[1] > count[0])
    for (PetscInt i : rows) s[i] = -s[i];
  PetscCall(VecRestoreArray(side, &s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: is each entry between two rows of the sign that their sides have? */
static PetscErrorCode Consistent(Mat signs, Vec degree, Vec side, Vec y, PetscBool *consistent)
{
  PetscReal norm;

  PetscFunctionBegin;
  PetscCall(MatMult(signs, side, y));
  PetscCall(VecPointwiseMult(y, y, side));
  PetscCall(VecAXPY(y, -1.0, degree));
  PetscCall(VecNorm(y, NORM_INFINITY, &norm));
  *consistent = (PetscBool)(norm == 0.0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindSides - 1 for rows of primal unknowns, which are more in each part of the matrix that hangs together, -1 for those of multipliers

   NULL where no entry has an opposite mirror image, or where signs contradict each other. Collective
*/
PetscErrorCode AinsworthFindSides(Mat mat, Vec *side)
{
  Mat          signs;
  Vec          degree, y;
  PetscBool    opposites, consistent = PETSC_FALSE, done = PETSC_FALSE;
  PetscScalar *s;
  PetscInt     n;

  PetscFunctionBegin;
  *side = NULL;
  PetscCall(CreateSigns(mat, &signs, &opposites));
  if (opposites) {
    PetscCall(MatCreateVecs(signs, side, &y));
    PetscCall(VecDuplicate(y, &degree));
    PetscCall(AinsworthRowSums(signs, 1, degree));
    PetscCall(VecSet(*side, 0.0));
    for (int parts = 0; parts < 64 && !done; parts++) PetscCall(FindSidesOfPart(signs, degree, *side, y, &done));
    PetscCall(Consistent(signs, degree, *side, y, &consistent));
    if (!done || !consistent) PetscCall(VecDestroy(side));
    PetscCall(VecDestroy(&degree));
    PetscCall(VecDestroy(&y));
  }
  PetscCall(MatDestroy(&signs));
  if (!*side) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(*side, &n));
  PetscCall(VecGetArray(*side, &s));
  for (PetscInt i = 0; i < n; i++)
    if (s[i] == 0.0) s[i] = 1.0; /* rows that are coupled with none */
  PetscCall(VecRestoreArray(*side, &s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
