static char help[] = "A small saddle-point system, solved with whatever the options say.\n\
  -n <16>      : unknowns of each rank\n\
  -cycles <1>  : times that PETSc is initialised, used and finalised\n";

/*
   A: a chain of springs, each held to the ground. C: every rank ties its first unknown to the last one, and its third
   to the fifth.
*/
#include <petscksp.h>

#if !defined(PROGRAM_REGISTER)
  #define PROGRAM_REGISTER 0
#endif

static PetscErrorCode Solve(void)
{
  Mat         A, C, Ct, K, blocks[4];
  Vec         x, b, r;
  KSP         ksp;
  PetscInt    n = 16, N, start, end, i;
  PetscMPIInt rank, size;
  PetscReal   residual, norm;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-n", &n, NULL));
  N = n * size;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, n, n, N, N, 3, NULL, 2, NULL, &A));
  PetscCall(MatGetOwnershipRange(A, &start, &end));
  for (i = start; i < end; i++) {
    if (i > 0) PetscCall(MatSetValue(A, i, i - 1, -1.0, INSERT_VALUES));
    if (i < N - 1) PetscCall(MatSetValue(A, i, i + 1, -1.0, INSERT_VALUES));
    PetscCall(MatSetValue(A, i, i, 2.1 + (PetscReal)i / (PetscReal)N, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));

  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, 2, n, 2 * size, N, 2, NULL, 2, NULL, &C));
  PetscCall(MatSetValue(C, 2 * rank, start, 1.0, INSERT_VALUES));
  PetscCall(MatSetValue(C, 2 * rank, end - 1, -1.0, INSERT_VALUES));
  PetscCall(MatSetValue(C, 2 * rank + 1, start + 2, 1.0, INSERT_VALUES));
  PetscCall(MatSetValue(C, 2 * rank + 1, start + 4, -1.0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatTranspose(C, MAT_INITIAL_MATRIX, &Ct));

  blocks[0] = A;
  blocks[1] = Ct;
  blocks[2] = C;
  blocks[3] = NULL;
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &K));
  PetscCall(MatCreateVecs(K, &x, &b));
  PetscCall(VecSet(b, 1.0));

  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, K, K));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSolve(ksp, b, x));

  PetscCall(VecDuplicate(b, &r));
  PetscCall(MatMult(K, x, r));
  PetscCall(VecAYPX(r, -1.0, b));
  PetscCall(VecNorm(r, NORM_2, &residual));
  PetscCall(VecNorm(b, NORM_2, &norm));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "relative residual: %g\n", (double)(residual / norm)));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "solved: %s\n", residual <= 1e-8 * norm ? "yes" : "no"));

  PetscCall(KSPDestroy(&ksp));
  PetscCall(VecDestroy(&r));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&x));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatDestroy(&C));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn((PetscErrorCode)0);
}

int main(int argc, char **argv)
{
  PetscInt cycles = 1, i;

  /* MPI outlives PETSc here, as MPI cannot be initialised twice */
  MPI_Init(&argc, &argv);
  for (i = 0; i < cycles; i++) {
    PetscCall(PetscInitialize(&argc, &argv, NULL, help));
    PetscCall(PROGRAM_REGISTER);
    PetscCall(PetscOptionsGetInt(NULL, NULL, "-cycles", &cycles, NULL));
    PetscCall(Solve());
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "cycles: %d\n", (int)(i + 1)));
    PetscCall(PetscFinalize());
  }
  MPI_Finalize();
  return 0;
}
