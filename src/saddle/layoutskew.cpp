/*
   Detection of the fields of a plain matrix [A -B'; B D] with a positive diagonal, from the signs of its off-diagonal
   entries
*/
#include "saddle.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include <algorithm>

/*
   Creates a matrix with -1 where an entry is the opposite of its conjugate mirror image, 1 where it is not, and nothing
   where either is zero. Collective
*/
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
  PetscCall(AinsworthCreateAIJLike(mat, rows, signs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindSides - finds 1 for rows of primal unknowns, the majority, and -1 for rows of multipliers. Collective

   *side is NULL if no entry has an opposite mirror image, if signs contradict each other, or if some coupled
   rows are not connected with the others.
*/
PetscErrorCode AinsworthFindSides(Mat mat, Vec *side)
{
  Mat         signs;
  Vec         degree, y;
  PetscInt    seed, grown;
  PetscReal   most, norm;
  PetscScalar sum;
  PetscBool   opposites;

  PetscFunctionBegin;
  *side = NULL;
  PetscCall(CreateSigns(mat, &signs, &opposites));
  if (opposites) {
    PetscCall(AinsworthCreateVecs(signs, side, &y));
    PetscCall(VecDuplicate(y, &degree));
    PetscCall(AinsworthRowSums(signs, 1, degree));
    PetscCall(VecMax(degree, &seed, &most));
    PetscCall(VecSetValue(y, seed, 1.0, INSERT_VALUES));
    PetscCall(VecAssemblyBegin(y));
    PetscCall(VecAssemblyEnd(y));
    do { /* give a side to the rows that are coupled with those that have one */
      grown = 0;
      PetscCall(AinsworthUpdate(*side, {y}, [&](PetscInt, PetscScalar &s, PetscScalar neighbors) {
        if (s != 0.0 || neighbors == 0.0) return;
        s = PetscRealPart(neighbors) > 0.0 ? 1.0 : -1.0;
        grown++;
      }));
      PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &grown, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)mat)));
      PetscCall(MatMult(signs, *side, y));
    } while (grown);
    PetscCall(VecPointwiseMult(y, y, *side)); /* check that the sign of every entry matches the sides of its two rows */
    PetscCall(VecAXPY(y, -1.0, degree));
    PetscCall(VecNorm(y, NORM_INFINITY, &norm));
    PetscCall(VecSum(*side, &sum));
    if (PetscRealPart(sum) < 0.0) PetscCall(VecScale(*side, -1.0));
    if (!(norm == 0.0)) PetscCall(VecDestroy(side));
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
