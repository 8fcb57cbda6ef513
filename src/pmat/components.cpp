#include "pmat.h"
#include "../saddle/saddle.h"
#include <vector>

/* C' with the rows of C scaled to length 1 */
static PetscErrorCode CreateUnitTranspose(Mat C, Mat *Ct)
{
  Mat unit;
  Vec length;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(C, NULL, &length));
  PetscCall(AinsworthRowSums(C, 2, length));
  PetscCall(VecSqrtAbs(length));
  PetscCall(VecReciprocal(length));
  PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &unit));
  PetscCall(MatDiagonalScale(unit, length, NULL));
  PetscCall(VecDestroy(&length));
  PetscCall(MatHermitianTranspose(unit, MAT_INITIAL_MATRIX, Ct));
  PetscCall(MatDestroy(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Are the components of every node constrained apart from each other: is the block of the node in C' C, with rows of length 1, diagonal up to a
   hundredth of its square? Multigrid that interpolates component by component can then satisfy the constraints on its coarse levels; where
   components are mixed it cannot, and a large penalty locks.
*/
PetscErrorCode AinsworthPmatComponentsApart(Mat C, PetscInt bs, PetscBool *apart)
{
  Mat                                   Ct;
  PetscInt                              rstart, rend;
  PetscBool                             here = PETSC_TRUE;
  std::vector<std::vector<PetscInt>>    columns(bs);
  std::vector<std::vector<PetscScalar>> values(bs);

  PetscFunctionBegin;
  *apart = PETSC_TRUE;
  if (bs == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CreateUnitTranspose(C, &Ct));
  PetscCall(MatGetOwnershipRange(Ct, &rstart, &rend));
  for (PetscInt first = rstart; first + bs <= rend && here; first += bs) {
    PetscReal trace = 0.0, mixed = 0.0;

    for (PetscInt k = 0; k < bs; k++) {
      PetscInt           n;
      const PetscInt    *c;
      const PetscScalar *v;

      PetscCall(MatGetRow(Ct, first + k, &n, &c, &v));
      columns[k].assign(c, c + n);
      values[k].assign(v, v + n);
      PetscCall(MatRestoreRow(Ct, first + k, &n, &c, &v));
      for (const PetscScalar &value : values[k]) trace += PetscSqr(PetscAbsScalar(value));
    }
    for (PetscInt k = 0; k < bs; k++) {
      for (PetscInt l = 0; l < k; l++) {
        PetscScalar dot = 0.0;
        for (size_t a = 0, b = 0; a < columns[k].size() && b < columns[l].size();) {
          if (columns[k][a] == columns[l][b]) dot += values[k][a++] * PetscConj(values[l][b++]);
          else if (columns[k][a] < columns[l][b]) a++;
          else b++;
        }
        mixed += 2.0 * PetscSqr(PetscAbsScalar(dot));
      }
    }
    here = (PetscBool)(mixed <= 0.01 * PetscSqr(trace));
  }
  PetscCall(MatDestroy(&Ct));
  PetscCall(MPIU_Allreduce(&here, apart, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)C)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
