static char help
  [] = "Vibration modes of two plates, lattices of springs, that Lagrange multipliers tie together and nothing holds.\n\
  -n <40>: nodes along each side of both plates\n\n";

/*
   K = [A C'; C 0] and M = [mass 0; 0 0], both as MatNest. The first three modes are rigid, which multigrid finds like
   others.

   $ mpiexec -n 2 ./modes -dll_append libainsworthslepc.so -eps_type ainsworth
   6400 unknowns, 80 multipliers: 10 modes in 12 iterations
   ...
*/
#include <slepceps.h>

int main(int argc, char **argv)
{
  const PetscInt side[4][2] = {
    {1,  0},
    {0,  1},
    {1,  1},
    {-1, 1}
  }; /* the other end of the springs of a node */
  Mat               A, C, mass, none, K, M, blocks[4] = {NULL, NULL, NULL, NULL}, masses[4] = {NULL, NULL, NULL, NULL};
  Vec               X, diagonal, v, part;
  IS                is[2];
  EPS               eps;
  MatNullSpace      modes;
  PetscInt          n       = 40, first, last, rows, N, m, node, i, its, found;
  const PetscScalar pair[2] = {1.0, -1.0};

  PetscCall(SlepcInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-n", &n, NULL));
  N = 2 * 2 * n * n; /* plates, unknowns of a node, nodes of a plate; node (i, j) of plate l is l n^2 + i n + j */
  m = 2 * n;

  PetscCall(MatCreate(PETSC_COMM_WORLD, &A)); /* as in ex1.c, but no node is held */
  PetscCall(MatSetSizes(A, PETSC_DECIDE, PETSC_DECIDE, N, N));
  PetscCall(MatSetBlockSize(A, 2));
  PetscCall(MatSetType(A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(A, 18, NULL));
  PetscCall(MatMPIAIJSetPreallocation(A, 18, NULL, 18, NULL));
  PetscCall(MatCreateVecs(A, &X, &diagonal));
  PetscCall(MatGetOwnershipRange(A, &first, &last));
  for (node = first / 2; node < last / 2; node++) {
    const PetscInt    x = node / n % n, y = node % n;
    const PetscInt    own[2] = {2 * node, 2 * node + 1};
    const PetscScalar at[2]  = {(PetscReal)(node / n), (PetscReal)y};
    PetscInt          s, k;

    PetscCall(VecSetValues(X, 2, own, at, INSERT_VALUES));
    for (s = 0; s < 4; s++) {
      const PetscInt dx = side[s][0], dy = side[s][1], other = node + dx * n + dy,
                     ends[4] = {own[0], own[1], 2 * other, 2 * other + 1};
      const PetscScalar d[4] = {(PetscReal)dx, (PetscReal)dy, -(PetscReal)dx, -(PetscReal)dy};
      PetscScalar       stiff[16];

      if (x + dx < 0 || x + dx >= n || y + dy >= n) continue;
      for (k = 0; k < 16; k++) stiff[k] = d[k / 4] * d[k % 4] / (PetscReal)(dx * dx + dy * dy);
      PetscCall(MatSetValues(A, 4, ends, 4, ends, stiff, ADD_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(VecAssemblyBegin(X));
  PetscCall(VecAssemblyEnd(X));
  PetscCall(MatNullSpaceCreateRigidBody(X, &modes)); /* for the interpolation of multigrid, as always */
  PetscCall(MatSetNearNullSpace(A, modes));

  PetscCall(MatDuplicate(A, MAT_SHARE_NONZERO_PATTERN, &mass)); /* 1 for each node */
  PetscCall(MatZeroEntries(mass));
  PetscCall(VecSet(diagonal, 1.0));
  PetscCall(MatDiagonalSet(mass, diagonal, INSERT_VALUES));

  /* row r: unknown r of the right edge of the left plate less that of the left edge of the right one */
  PetscCall(MatCreate(PETSC_COMM_WORLD, &C));
  PetscCall(MatSetSizes(C, PETSC_DECIDE, last - first, m, N));
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
  PetscCall(MatGetLocalSize(C, &rows, NULL)); /* an empty block tells how many multipliers M has */
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, rows, rows, m, m, 0, NULL, 0, NULL, &none));
  PetscCall(MatAssemblyBegin(none, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(none, MAT_FINAL_ASSEMBLY));
  masses[0] = mass;
  masses[3] = none;
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, masses, &M));

  PetscCall(EPSCreate(PETSC_COMM_WORLD, &eps));
  PetscCall(EPSSetOperators(eps, K, M));
  PetscCall(EPSSetProblemType(eps, EPS_GHEP)); /* symmetric, with a mass that is not negative */
  PetscCall(EPSSetWhichEigenpairs(eps, EPS_SMALLEST_REAL));
  PetscCall(EPSSetDimensions(eps, 10, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(EPSSetFromOptions(eps));
  PetscCall(EPSSolve(eps));
  PetscCall(EPSGetConverged(eps, &found));
  PetscCall(EPSGetIterationNumber(eps, &its));
  found = PetscMin(found, 10);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "%" PetscInt_FMT " unknowns, %" PetscInt_FMT " multipliers: %" PetscInt_FMT
                        " modes in %" PetscInt_FMT " iterations\n",
                        N, m, found, its));
  PetscCall(MatCreateVecs(K, &v, NULL));
  for (i = 0; i < found; i++) {
    PetscScalar lambda;
    PetscReal   forces;

    PetscCall(EPSGetEigenpair(eps, i, &lambda, NULL, v, NULL)); /* v = [x; multipliers], x' M x = 1 */
    PetscCall(VecGetSubVector(v, is[1], &part));
    PetscCall(VecNorm(part, NORM_INFINITY, &forces));
    PetscCall(VecRestoreSubVector(v, is[1], &part));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  frequency %8.6f, largest force of a tie %8.6f\n",
                          (double)(PetscSqrtReal(PetscAbsScalar(lambda)) / (2.0 * PETSC_PI)), (double)forces));
  }

  PetscCall(EPSDestroy(&eps));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&v));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&M));
  PetscCall(MatDestroy(&blocks[1]));
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&C));
  PetscCall(MatDestroy(&mass));
  PetscCall(MatDestroy(&none));
  PetscCall(SlepcFinalize());
  return 0;
}
