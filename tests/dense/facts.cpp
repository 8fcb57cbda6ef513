static char help[] = "The facts of a matrix are those of its rows on any rank. Whether A = A' is found row by row: "
                     "what is soft counts, and NaN on one rank is no symmetry.\n\n";

#include "dense.h"
#include "saddle/saddle.h"

static PetscErrorCode Store(const Dense &d, Mat *A)
{
  const PetscInt n = (PetscInt)d.rows();
  PetscInt       start, end;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n, n, n, NULL, n, NULL, A));
  PetscCall(MatGetOwnershipRange(*A, &start, &end));
  for (PetscInt k = start; k < end; k++)
    for (PetscInt l = 0; l < n; l++) /* zeros are stored, too */
      if (d(k, l) != 0.0 || l == 5) PetscCall(MatSetValue(*A, k, l, d(k, l), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A matrix without order, with rows that have their diagonal entry alone, and one without any */
static PetscErrorCode Rows(const char *name, PetscScalar value, bool finite)
{
  const PetscInt           n = 12;
  const AinsworthMatFacts *facts;
  Dense                    d = Dense::Random(n, n);
  PetscInt                 start, end;
  bool                     alone = true, diagonal = true;
  const PetscScalar       *a;
  Mat                      A;

  PetscFunctionBeginUser;
  Case("%s", name);
  for (PetscInt k : {0, 6, 9, 11}) d.row(k).setZero();
  for (PetscInt k : {0, 6, 11}) d(k, k) = -2.0;
  d(7, 1) = value;
  PetscCall(Store(d, &A));
  PetscCall(AinsworthGetFacts(A, &facts));
  PetscCall(MatGetOwnershipRange(A, &start, &end));
  PetscCall(VecGetArrayRead(facts->diagonal, &a));
  for (PetscInt k = start; k < end; k++) {
    alone    = alone && facts->alone[k - start] == (k == 0 || k == 6 || k == 11);
    diagonal = diagonal && a[k - start] == d(k, k);
  }
  PetscCall(VecRestoreArrayRead(facts->diagonal, &a));
  PetscCall(CheckTrue("rows with their diagonal entry alone", alone && facts->some));
  PetscCall(CheckTrue("diagonal", diagonal && facts->rows));
  PetscCall(CheckTrue("positive", !facts->positive));
  PetscCall(CheckInt("finite", facts->finite, finite));
  PetscCall(CheckTrue("symmetric", !facts->symmetric));
  PetscCall(MatDestroy(&A));
  for (PetscInt k = 0; k < n; k++) d(k, k) = 3.0;
  d(7, 1) = 1.0;
  d(0, 3) = d(6, 3) = d(11, 3) = 1.0;
  PetscCall(Store(d, &A));
  PetscCall(AinsworthGetFacts(A, &facts));
  PetscCall(CheckInt("positive after all", facts->positive, true));
  PetscCall(CheckTrue("a row alone after all", facts->some));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two chains of very different stiffness, with another value in one place */
static PetscErrorCode Probe(const char *name, PetscInt i, PetscInt j, PetscReal value, bool expected)
{
  const PetscInt n = 12;
  PetscBool      symmetric;
  Dense          d = Dense::Zero(n, n);
  Mat            A;

  PetscFunctionBeginUser;
  Case("%s", name);
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal stiffness = k < n / 2 ? 1e20 : 1e-20;

    d(k, k) = 2.0 * stiffness;
    if (k % (n / 2)) d(k, k - 1) = d(k - 1, k) = -stiffness;
  }
  d(i, j) = value;
  PetscCall(Store(d, &A));
  PetscCall(AinsworthProbeSymmetry(A, &symmetric));
  PetscCall(CheckInt("symmetric", symmetric, expected));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(Rows("plain rows", 0.5, true));
  PetscCall(Rows("rows with an infinite entry", INFINITY, false));
  PetscCall(Rows("rows with NaN", NAN, false));
  PetscCall(Probe("symmetric", 0, 0, 3e20, true));
  PetscCall(Probe("a soft row that is not", 11, 10, -0.9e-20, false));
  PetscCall(Probe("a stiff row that is not", 0, 1, -0.9e20, false));
  for (PetscInt row : {0, 5, 11}) PetscCall(Probe("not a number", row, row, NAN, false));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
