static char help[] = "PCBLOCKSA on a few unknowns: on some ranks only, without entries, after other matrices.\n\n";

#include "lattice.h"

/* A chain, its last `loose` rows without entries, or a full matrix */
static PetscErrorCode Create(PetscInt local, PetscInt N, PetscInt loose, bool full, Mat *A)
{
  PetscInt first, end;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, local, local, N, N, N, NULL, N, NULL, A));
  PetscCall(MatGetOwnershipRange(*A, &first, &end));
  for (PetscInt i = first; i < end; i++)
    for (PetscInt j = 0; j < N; j++) {
      const PetscScalar v = PetscMax(i, j) >= N - loose    ? 0.0
                            : i == j                       ? 2.5
                            : full || PetscAbs(i - j) == 1 ? -0.3
                                                           : 0.0;

      if (i == j || v != 0.0) PetscCall(MatSetValue(*A, i, j, v, INSERT_VALUES));
    }
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cycle is Hermitian, as conjugate gradients need it, and they find a solution */
static PetscErrorCode Solve(KSP ksp)
{
  Mat                A;
  PC                 pc;
  Vec                x, b, r;
  Dense              M;
  PetscReal          size, left;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(KSPGetOperators(ksp, &A, NULL));
  PetscCall(MatCreateVecs(A, &x, &b));
  PetscCall(VecDuplicate(b, &r));
  PetscCall(SetRandom(x, 5));
  PetscCall(MatMult(A, x, b));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue("converged", reason > 0));
  PetscCall(MatResidual(A, b, x, r));
  PetscCall(VecNorm(b, NORM_2, &size));
  PetscCall(VecNorm(r, NORM_2, &left));
  PetscCall(Check("residual", left / size, 1e-7));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(GatherOperator(
    b, x, [pc](Vec v, Vec w) { return PCApply(pc, v, w); }, M));
  PetscCall(CheckEqual("the cycle is Hermitian", M, M.adjoint(), 1e-6));
  for (Vec *v : {&x, &b, &r}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Alone(const char *what, const std::string &line, PetscInt local, PetscInt N, PetscInt loose)
{
  const Options options(line);
  Mat           A;
  KSP           ksp;

  PetscFunctionBeginUser;
  Case("%s", what);
  PetscCall(Create(local, N, loose, false, &A));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(Solve(ksp));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The coarsest matrix is dense, then one that PETSc orders, with and without KSPReset() between them */
static PetscErrorCode After(bool reset)
{
  const Options options("-pc_blocksa_coarse_eq_limit 30");
  Mat           A, B;
  KSP           ksp;

  PetscFunctionBeginUser;
  Case("sparse after dense%s", reset ? ", KSPReset()" : "");
  PetscCall(Create(PETSC_DECIDE, 28, 0, true, &A));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(Solve(ksp));
  PetscCall(Create(PETSC_DECIDE, 28, 0, false, &B));
  if (reset) PetscCall(KSPReset(ksp));
  PetscCall(KSPSetOperators(ksp, B, B));
  PetscCall(Solve(ksp));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&B));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt rank, size;
  int         exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(Alone("a coarser level as large as the finer one, on one rank", "-pc_blocksa_coarse_eq_limit 1",
                  (rank == 0) + (rank == size - 1), 2, 0));
  PetscCall(Alone("unknowns without entries, one level", "-pc_blocksa_coarse_eq_limit 30", PETSC_DECIDE, 6, 2));
  PetscCall(Alone("unknowns without entries, several levels", "-pc_blocksa_coarse_eq_limit 2", PETSC_DECIDE, 20, 2));
  PetscCall(After(true));
  PetscCall(After(false));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
