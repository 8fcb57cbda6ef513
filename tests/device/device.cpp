static char help[] = "Vectors of a device: an iteration of the reduced system moves what is in the constraints to the "
                     "host, and no vector as a whole; iterations and answers are those of vectors of the host.\n\n";

#include "lattice.h"
#include "watchedvec.h"
#include <petscainsworth.h>

enum Where {
  HOST,
  WATCHED,
  KOKKOS
};

/* Iterations of all reduced solves, and the most copies of vectors of their length in one of them */
struct Counts {
  PetscInt iterations = 0, last = 0, most = 0;
};

/* The lower half of a lattice tied to the upper one: each node of the last layer to two nodes of the next */
static PetscErrorCode CreateTie(const Lattice &l, Mat A, Mat *C)
{
  const PetscInt layer = l.nodes() / l.layers, slaves = l.layers / 2 * layer;
  PetscInt       start, end, m = 0;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(A, &start, &end));
  for (PetscInt i = slaves - layer; i < slaves; i++)
    if (i * l.bs >= start && i * l.bs < end) m += l.bs;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, end - start, PETSC_DETERMINE, PETSC_DETERMINE, 3, NULL, 3, NULL, C));
  PetscCall(MatGetOwnershipRange(*C, &m, NULL));
  for (PetscInt i = slaves - layer; i < slaves; i++) {
    if (i * l.bs < start || i * l.bs >= end) continue;
    for (PetscInt c = 0; c < l.bs; c++, m++) {
      const PetscInt other = slaves + (i + 1) % layer;

      PetscCall(MatSetValue(*C, m, i * l.bs + c, 1.0, INSERT_VALUES));
      PetscCall(MatSetValue(*C, m, (i + layer) * l.bs + c, -0.75, INSERT_VALUES));
      PetscCall(MatSetValue(*C, m, other * l.bs + c, -0.25, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Note(KSP ksp, PetscInt iteration, PetscReal, void *ctx)
{
  Counts  *counts = (Counts *)ctx;
  Mat      mat;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(KSPGetOperators(ksp, &mat, NULL));
  PetscCall(MatGetSize(mat, &n, NULL));
  if (iteration) {
    counts->iterations++;
    counts->most = PetscMax(counts->most, WatchedCopies(n) - counts->last);
  }
  counts->last = WatchedCopies(n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves [A C'; C 0] with a right-hand side of numbers that depend on the row alone */
static PetscErrorCode Solve(Where where, const char inner[], PetscInt layers, Counts *counts, Column *x)
{
  Lattice  l;
  Mat      A, C, Ct, K;
  Vec      b, u, parts[2];
  KSP      ksp, reduced;
  PC       pc;
  PetscInt n, start;

  PetscFunctionBeginUser;
  l.n      = 5;
  l.layers = layers;
  l.apart  = true;
  PetscCall(PetscOptionsSetValue(NULL, "-ainsworth_pc_type", inner));
  PetscCall(LatticeCreate(l, &A));
  PetscCall(CreateTie(l, A, &C));
  if (where == WATCHED) PetscCall(WatchedSetMat(A));
#if defined(PETSC_HAVE_KOKKOS_KERNELS)
  if (where == KOKKOS)
    for (Mat *M : {&A, &C}) PetscCall(MatConvert(*M, MATAIJKOKKOS, MAT_INPLACE_MATRIX, M));
#endif
  PetscCall(LatticeSetNearNullSpace(l, A));
  PetscCall(MatHermitianTranspose(C, MAT_INITIAL_MATRIX, &Ct));
  const Mat blocks[] = {A, Ct, C, NULL};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &K));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatCreateVecs(A, &parts[0], NULL));
  PetscCall(MatCreateVecs(C, NULL, &parts[1]));
  PetscCall(VecGetOwnershipRange(parts[0], &start, &n));
  for (PetscInt i = start; i < n; i++) PetscCall(VecSetValue(parts[0], i, 1.0 + 0.5 * Uniform(7, i, 0), INSERT_VALUES));
  PetscCall(VecAssemblyBegin(parts[0]));
  PetscCall(VecAssemblyEnd(parts[0]));
  PetscCall(VecSet(parts[1], 0.0));
  PetscCall(VecCreateNest(PETSC_COMM_WORLD, 2, NULL, parts, &b));
  for (Vec &part : parts) PetscCall(VecDestroy(&part));
  PetscCall(VecDuplicate(b, &u));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, K, K));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSetUp(ksp));
  PetscCall(PCAinsworthGetKSP(pc, &reduced));
  PetscCall(KSPMonitorSet(reduced, Note, counts, NULL));
  PetscCall(KSPSolve(ksp, b, u));
  PetscCall(VecNestGetSubVec(u, 0, &parts[0]));
  PetscCall(Gather(parts[0], *x));
  PetscCall(KSPDestroy(&ksp));
  for (Vec *v : {&b, &u}) PetscCall(VecDestroy(v));
  for (Mat *M : {&A, &C, &K}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* copies: of whole vectors in an iteration, expected; negative: not counted */
static PetscErrorCode Compare(const char inner[], PetscInt layers, Where where, PetscInt copies)
{
  Counts counts[2];
  Column x[2];

  PetscFunctionBeginUser;
  Case("%s, %s", inner, where == KOKKOS ? "Kokkos" : "watched");
  PetscCall(Solve(HOST, inner, layers, &counts[0], &x[0]));
  PetscCall(Solve(where, inner, layers, &counts[1], &x[1]));
  PetscCall(CheckTrue("some iterations", counts[0].iterations > 3));
  PetscCall(Check("more or fewer", (PetscReal)PetscAbs(counts[0].iterations - counts[1].iterations), 0.0));
  PetscCall(Check("the same answer", (x[0] - x[1]).norm() / x[0].norm(), 1e-12));
  if (copies < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckTrue("copies are counted", counts[0].last < counts[1].last));
  PetscCall(Check("copies in an iteration", (PetscReal)counts[1].most, (PetscReal)copies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(WatchedRegister());
  PetscCall(PetscOptionsSetValue(NULL, "-ainsworth_ksp_rtol", "1e-10"));
  PetscCall(Compare("jacobi", 6, WATCHED, 0));
  PetscCall(Compare("blocksa", 60, WATCHED, 2));
  if (PetscDefined(HAVE_KOKKOS_KERNELS))
    for (const char *inner : {"jacobi", "gamg", "blocksa"}) PetscCall(Compare(inner, 60, KOKKOS, -1));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
