static char help[] = "Whether A = A' is found row by row: what is soft counts, and NaN on one rank is no symmetry.\n\n";

#include "dense.h"
#include "saddle/saddle.h"

/* Two chains of very different stiffness, with another value in one place */
static PetscErrorCode Probe(const char *name, PetscInt i, PetscInt j, PetscReal value, bool expected)
{
  const PetscInt n = 12;
  PetscBool      symmetric;
  Dense          d = Dense::Zero(n, n);
  PetscInt       start, end;
  Mat            A;

  PetscFunctionBeginUser;
  Case("%s", name);
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal stiffness = k < n / 2 ? 1e20 : 1e-20;

    d(k, k) = 2.0 * stiffness;
    if (k % (n / 2)) d(k, k - 1) = d(k - 1, k) = -stiffness;
  }
  d(i, j) = value;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n, n, n, NULL, n, NULL, &A));
  PetscCall(MatGetOwnershipRange(A, &start, &end));
  for (PetscInt k = start; k < end; k++)
    for (PetscInt l = 0; l < n; l++)
      if (d(k, l) != 0.0) PetscCall(MatSetValue(A, k, l, d(k, l), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
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
  PetscCall(Probe("symmetric", 0, 0, 3e20, true));
  PetscCall(Probe("a soft row that is not", 11, 10, -0.9e-20, false));
  PetscCall(Probe("a stiff row that is not", 0, 1, -0.9e20, false));
  for (PetscInt row : {0, 5, 11}) PetscCall(Probe("not a number", row, row, NAN, false));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
