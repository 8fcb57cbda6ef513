/* A x = f, without a saddle point around it */
#include "alone.h"
#include "report.h"
#include <petsctime.h>
#include <vector>

PetscErrorCode AloneNow(MPI_Comm comm, PetscReal *seconds)
{
  PetscLogDouble now;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Barrier(comm));
  PetscCall(PetscTime(&now));
  *seconds = (PetscReal)now;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* To those preconditioners that take them; the others ignore them */
static PetscErrorCode SetCoordinates(PC pc, Vec X)
{
  std::vector<PetscReal> x;
  const PetscScalar     *a;
  PetscInt               n, dim;

  PetscFunctionBeginUser;
  PetscCall(VecGetLocalSize(X, &n));
  PetscCall(VecGetBlockSize(X, &dim));
  PetscCall(VecGetArrayRead(X, &a));
  for (PetscInt i = 0; i < n; i++) x.push_back(PetscRealPart(a[i]));
  PetscCall(VecRestoreArrayRead(X, &a));
  PetscCall(PCSetCoordinates(pc, dim, n / dim, x.data()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AloneSolve(Mat A, Mat C, Vec f, Vec X, SaddleSolution *solution)
{
  MPI_Comm       comm = PetscObjectComm((PetscObject)A);
  PetscReal      start, ready, end;
  ReportUsage    usage[3];
  PetscLogDouble before;
  KSP            ksp;
  PC             pc;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(f, &solution->x));
  PetscCall(MatCreateVecs(C, NULL, &solution->lambda));
  PetscCall(KSPCreate(comm, &ksp));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(KSPSetType(ksp, KSPCG));
  PetscCall(KSPSetNormType(ksp, KSP_NORM_NATURAL));
  PetscCall(KSPSetTolerances(ksp, 1e-8, 1e-300, PETSC_DEFAULT, 2000));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  if (X) PetscCall(SetCoordinates(pc, X));
  PetscCall(PetscMemoryGetCurrentUsage(&before));
  PetscCall(AloneNow(comm, &start));
  usage[0] = ReportGetUsage();
  PetscCall(KSPSetUp(ksp));
  PetscCall(PCSetUpOnBlocks(pc));
  PetscCall(AloneNow(comm, &ready));
  usage[1] = ReportGetUsage();
  PetscCall(KSPSolve(ksp, f, solution->x));
  PetscCall(AloneNow(comm, &end));
  usage[2]               = ReportGetUsage();
  solution->setupPages   = usage[1].pages - usage[0].pages;
  solution->solvePages   = usage[2].pages - usage[1].pages;
  solution->peak         = usage[2].peak - before;
  solution->setupSeconds = ready - start;
  solution->solveSeconds = end - ready;
  PetscCall(KSPGetConvergedReason(ksp, &solution->reason));
  PetscCall(KSPGetIterationNumber(ksp, &solution->iterations));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}
