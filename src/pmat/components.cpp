#include "pmat.h"
#include "../loops.h"

/* Do the entries that a row has at each node sit on one component, up to a two-hundredth of the largest in squares? */
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
   Are the components of every node constrained apart from each other? Multigrid that interpolates component by component can then satisfy the
   constraints on its coarse levels; where components are mixed it cannot, and a large penalty locks. Rows of more than `longest` entries are
   not looked at.
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
