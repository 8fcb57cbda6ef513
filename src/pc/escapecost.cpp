/* Cost of a factorization of M_* in iterations of the current solve, both as fast as they are in this process (docs/models.md) */
#include "pcainsworth.h"
#include "../multigrid/blocksa.h"
#include <petscblaslapack.h>
#include <petsctime.h>
#include <unistd.h>

/* Its orderings, copies and solves take as long as `overhead` products with A; its operations run at a share of the dense rate (measured, docs/models.md) */
static const PetscReal overhead = 320.0, shareMumps = 0.5, shareOther = 0.05;

/* PCAinsworthEscapeLeast_Private - returns the least cost of any factorization in iterations, each of which has a product with A and visits all levels */
PetscReal PCAinsworthEscapeLeast_Private(const PC_Ainsworth *data)
{
  static const PetscReal usual = 1.14; /* usual operator complexity */
  PC                     inner;
  PC_BlockSA            *sa;

  (void)KSPGetPC(data->ksp, &inner);
  (void)PCBlockSAGet_Private(inner, &sa);
  return overhead / (1.0 + (sa && sa->levels.hierarchy ? sa->levels.hierarchy->complexity() : usual));
}

/* Predicts the cost of a factorization of M_*; collective, the same on all ranks */
static PetscErrorCode Predict(PC_Ainsworth *data, AinsworthCost *cost)
{
  std::vector<Mat>  parts(1);
  PetscBool         general;
  MatSolverType     package;
  AinsworthPmatFill fill;
  Mat               C, square;

  PetscFunctionBegin;
  if (data->format == AINSWORTH_PMAT_SUM && data->constraints) { /* M_* has the pattern of A + C' C, without long rows */
    PetscCall(AinsworthGetAIJ(data->saddle.P, &parts[0]));
    PetscCall(AinsworthPmatGetFill(parts[0], data->saddle.C, &fill));
    PetscCall(AinsworthPmatCreateShort(data->saddle.C, &fill, &C));
    PetscCall(AinsworthMultiplyAdjoint(C, C, &square));
    PetscCall(MatDestroy(&C));
    parts.push_back(square);
  } else PetscCall(AinsworthGetAIJ(data->constraints ? data->M : data->saddle.A, &parts[0]));
  PetscCall(PCAinsworthOrderPmat_Private(data, parts, cost));
  for (Mat &mat : parts) PetscCall(MatDestroy(&mat));
  PetscCall(PetscStrcmp(PCAinsworthFactorType_Private(data, &package), PCLU, &general));
  if (general) {
    cost->entries *= 2.0;
    cost->operations *= 2.0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Measures the operations per second of a dense factorization by LAPACK in this process, the better of two runs */
static PetscErrorCode DenseRate(PetscReal *rate)
{
  enum {
    n = 256
  };
  PetscBLASInt             size = n, info;
  PetscLogDouble           start, end;
  std::vector<PetscScalar> M;

  PetscFunctionBegin;
  *rate = 0.0;
  for (int run = 0; run < 2; run++) {
    M.assign(n * n, 1.0);
    for (size_t i = 0; i < n; i++) M[i * (n + 1)] = 2.0 * n;
    PetscCall(PetscTime(&start));
    PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &size, M.data(), &size, &info));
    PetscCall(PetscTime(&end));
    *rate = PetscMax(*rate, n * n * (n / 3.0) / PetscMax(end - start, 1e-9));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the share of the dense rate that a package reaches on each rank */
static PetscErrorCode ShareOf(MatSolverType package, PetscReal *share)
{
  PetscBool is;

  PetscFunctionBegin;
  *share = shareOther;
  PetscCall(PetscStrcmp(package, MATSOLVERCHOLMOD, &is));
  if (is) *share = 1.0;
  PetscCall(PetscStrcmp(package, MATSOLVERMUMPS, &is));
  if (is) *share = shareMumps;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthLeastMemory_Private - gets the memory of the smallest machine of all ranks in bytes, as if all ranks were on that one; collective */
PetscErrorCode PCAinsworthLeastMemory_Private(MPI_Comm comm, PetscReal *memory)
{
  PetscFunctionBegin;
  *memory = (PetscReal)sysconf(_SC_PHYS_PAGES) * (PetscReal)sysconf(_SC_PAGESIZE);
  if (!(*memory > 0.0)) *memory = PETSC_MAX_REAL;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, memory, 1, MPIU_REAL, MPIU_MIN, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthEscapeCost_Private - predicts the operations of a factorization of M_* and the iterations that take as long; collective, the same on all ranks

   seconds: of an iteration on this rank; iterations: infinity if the factor does not fit in memory
*/
PetscErrorCode PCAinsworthEscapeCost_Private(PC pc, PC_Ainsworth *data, PetscReal seconds, PetscReal *operations, PetscReal *iterations)
{
  MPI_Comm      comm = PetscObjectComm((PetscObject)pc);
  MatSolverType package;
  PetscReal     rate, share, memory;
  AinsworthCost cost;

  PetscFunctionBegin;
  (void)PCAinsworthFactorType_Private(data, &package);
  PetscCall(Predict(data, &cost));
  PetscCall(DenseRate(&rate));
  PetscCall(ShareOf(package, &share));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &rate, 1, MPIU_REAL, MPIU_SUM, comm));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &seconds, 1, MPIU_REAL, MPIU_MAX, comm));
  PetscCall(PCAinsworthLeastMemory_Private(comm, &memory));
  *operations = cost.operations;
  *iterations = PCAinsworthEscapeLeast_Private(data) + cost.operations / (share * rate * PetscMax(seconds, 1e-9));
  if (!AinsworthLadderFits(PCAinsworthFactorBytes_Private(&cost), memory)) *iterations = PETSC_INFINITY;
  PetscCall(PetscInfo(pc,
                      "A factorization would take %g operations and hold %g entries%s: as long as %g iterations of %g s, with %g dense operations a second\n",
                      (double)cost.operations, (double)cost.entries, *iterations < PETSC_INFINITY ? "" : ", more than memory has room for", (double)*iterations,
                      (double)seconds, (double)rate));
  PetscFunctionReturn(PETSC_SUCCESS);
}
