static char help[] = "Two lattices of springs tied by Lagrange multipliers, pulled apart: [A C'; C 0] as a MatNest, "
                     "solved as the options say.\n"
                     "  -n <40>: nodes along each side of both lattices\n\n";

/*
   The left edge of the left lattice is held, the right edge of the right one pulled by a force of 1. The multipliers
   are the forces in the ties.

   $ mpiexec -n 2 ./ex1 -dll_append libainsworth.so -ksp_type preonly -pc_type ainsworth -ainsworth_ksp_converged_reason
     Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 10
   6400 unknowns, 80 multipliers; the ties carry 1.000000
*/
#include <petscksp.h>

int main(int argc, char **argv)
{
  const PetscInt side[4][2] = {
    {1,  0},
    {0,  1},
    {1,  1},
    {-1, 1}
  }; /* the other end of the springs of a node */
  Mat               A, C, K, blocks[4] = {NULL, NULL, NULL, NULL};
  Vec               b, y, X, part;
  IS                is[2];
  KSP               ksp;
  MatNullSpace      modes;
  PetscInt          n = 40, first, last, N, M, node;
  PetscScalar       force;
  const PetscScalar pair[2] = {1.0, -1.0};

  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-n", &n, NULL));
  N = 2 * 2 * n * n; /* lattices, unknowns of a node, nodes of a lattice; node (i, j) of lattice l is l n^2 + i n + j */
  M = 2 * n;

  PetscCall(MatCreate(PETSC_COMM_WORLD, &A));
  PetscCall(MatSetSizes(A, PETSC_DECIDE, PETSC_DECIDE, N, N));
  PetscCall(MatSetBlockSize(A, 2)); /* displacements of a node: multigrid needs to know */
  PetscCall(MatSetType(A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(A, 18, NULL));
  PetscCall(MatMPIAIJSetPreallocation(A, 18, NULL, 18, NULL));
  PetscCall(MatCreateVecs(A, &X, NULL)); /* coordinates */
  PetscCall(MatGetOwnershipRange(A, &first, &last));
  for (node = first / 2; node < last / 2; node++) {
    const PetscInt    i = node / n % n, j = node % n;
    const PetscInt    own[2] = {2 * node, 2 * node + 1};
    const PetscScalar at[2] = {(PetscReal)(node / n), (PetscReal)j}, hold[4] = {1.0, 0.0, 0.0, 1.0};
    PetscInt          s, k;

    PetscCall(VecSetValues(X, 2, own, at, INSERT_VALUES));
    if (node < n) PetscCall(MatSetValues(A, 2, own, 2, own, hold, ADD_VALUES));
    for (s = 0; s < 4; s++) {
      const PetscInt di = side[s][0], dj = side[s][1], other = node + di * n + dj,
                     ends[4] = {own[0], own[1], 2 * other, 2 * other + 1};
      const PetscScalar d[4] = {(PetscReal)di, (PetscReal)dj, -(PetscReal)di, -(PetscReal)dj};
      PetscScalar       stiff[16];

      if (i + di < 0 || i + di >= n || j + dj >= n) continue;
      for (k = 0; k < 16; k++) stiff[k] = d[k / 4] * d[k % 4] / (PetscReal)(di * di + dj * dj);
      PetscCall(MatSetValues(A, 4, ends, 4, ends, stiff, ADD_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(A, MAT_SPD, PETSC_TRUE));
  PetscCall(VecAssemblyBegin(X));
  PetscCall(VecAssemblyEnd(X));
  /* the motions that deform nothing: multigrid is two to five times faster with them */
  PetscCall(MatNullSpaceCreateRigidBody(X, &modes));
  PetscCall(MatSetNearNullSpace(A, modes));

  /* row r: unknown r of the right edge of the left lattice less that of the left edge of the right one */
  PetscCall(MatCreate(PETSC_COMM_WORLD, &C));
  PetscCall(MatSetSizes(C, PETSC_DECIDE, last - first, M, N));
  PetscCall(MatSetType(C, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(C, 2, NULL));
  PetscCall(MatMPIAIJSetPreallocation(C, 2, NULL, 2, NULL));
  PetscCall(MatGetOwnershipRange(C, &first, &last));
  for (node = first; node < last; node++) {
    const PetscInt ends[2] = {2 * n * (n - 1) + node, 2 * n * n + node};

    PetscCall(MatSetValues(C, 1, &node, 2, ends, pair, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(C, MAT_FINAL_ASSEMBLY));

  blocks[0] = A;
  blocks[2] = C;
  PetscCall(MatCreateTranspose(C, &blocks[1]));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &K));
  PetscCall(MatNestGetISs(K, is, NULL));
  PetscCall(MatCreateVecs(K, &y, &b));
  PetscCall(VecGetSubVector(b, is[0], &part));
  PetscCall(VecGetOwnershipRange(part, &first, &last));
  for (node = 2 * n * n - n; node < 2 * n * n; node++) /* the right edge of the right lattice */
    if (first <= 2 * node && 2 * node < last) PetscCall(VecSetValue(part, 2 * node, 1.0 / (PetscReal)n, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(part));
  PetscCall(VecAssemblyEnd(part));
  PetscCall(VecRestoreSubVector(b, is[0], &part));

  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, K, K));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSolve(ksp, b, y));

  PetscCall(VecGetSubVector(y, is[1], &part)); /* the multipliers: the forces across add up to nothing */
  PetscCall(VecSum(part, &force));
  PetscCall(VecRestoreSubVector(y, is[1], &part));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "%" PetscInt_FMT " unknowns, %" PetscInt_FMT " multipliers; the ties carry %f\n", N, M,
                        (double)-PetscRealPart(force)));

  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&blocks[1]));
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&C));
  PetscCall(PetscFinalize());
  return 0;
}
