#include "pmat.h"
#include "../base/loops.h"

/* Tells whether the entries of a row at each node are in one component, up to 0.005 of the squared largest entry */
static bool RowKeepsApart(PetscInt bs, PetscInt n, const PetscInt columns[], const PetscScalar values[])
{
  PetscReal largest = 0.0;

  for (PetscInt k = 0; k < n; k++) largest = PetscMax(largest, PetscAbsScalar(values[k]));
  for (PetscInt k = 0, next; k < n; k = next) {
    PetscReal sum = 0.0, most = 0.0;

    for (next = k; next < n && columns[next] / bs == columns[k] / bs; next++) {
      const PetscReal square = PetscSqr(PetscAbsScalar(values[next]) / largest);

      sum += square;
      most = PetscMax(most, square);
    }
    if (sum - most > 0.005) return false;
  }
  return true;
}

/*
   Tells whether the constraints keep the components of each node apart; ignores rows with more than `longest` entries.
   Collective

   If they do, multigrid that interpolates component by component can satisfy the constraints on its coarse levels;
   otherwise it cannot, and a large penalty locks.
*/
PetscErrorCode AinsworthPmatComponentsApart(Mat C, PetscInt bs, PetscInt longest, PetscBool *apart)
{
  PetscFunctionBegin;
  *apart = PETSC_TRUE;
  if (bs < 2) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthForRows(C, [=](const AinsworthMatRow &row) {
    if (*apart && row.n <= longest) *apart = (PetscBool)RowKeepsApart(bs, row.n, row.j, row.a);
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, apart, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)C)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
