/* Price of a factorization of M_* in iterations with multigrid (docs/models.md) */
#include "pcainsworth.h"
#include "../multigrid/blocksa.h"
#include <unistd.h>

/* Returns the price of an iteration in products with A */
static PetscReal Iteration(const PC_Ainsworth *data)
{
  static const PetscReal usual = 1.14; /* usual operator complexity */
  PC                     inner;
  PC_BlockSA            *sa;

  (void)KSPGetPC(data->ksp, &inner);
  (void)PCBlockSAGet_Private(inner, &sa);
  return (PetscReal)AinsworthPriceIteration(sa && sa->levels.hierarchy ? sa->levels.hierarchy->complexity() : usual);
}

/* PCAinsworthEscapeLeast_Private - returns the least price of any factorization in iterations */
PetscReal PCAinsworthEscapeLeast_Private(const PC_Ainsworth *data)
{
  return (PetscReal)AinsworthPriceFactorization(0.0, 1.0, AINSWORTH_PACKAGE_OTHER) / Iteration(data);
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

static PetscErrorCode PackageOf(MatSolverType type, AinsworthPackage *package)
{
  PetscBool is;

  PetscFunctionBegin;
  *package = AINSWORTH_PACKAGE_OTHER;
  PetscCall(PetscStrcmp(type, MATSOLVERCHOLMOD, &is));
  if (is) *package = AINSWORTH_PACKAGE_CHOLMOD;
  PetscCall(PetscStrcmp(type, MATSOLVERMUMPS, &is));
  if (is) *package = AINSWORTH_PACKAGE_MUMPS;
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
   PCAinsworthEscapeCost_Private - predicts the operations of a factorization of M_* and its price in iterations; collective, the same on all ranks

   iterations: infinity if the factor does not fit in memory
*/
PetscErrorCode PCAinsworthEscapeCost_Private(PC pc, PC_Ainsworth *data, PetscReal *operations, PetscReal *iterations)
{
  MatSolverType    type;
  AinsworthPackage package;
  PetscReal        memory;
  AinsworthCost    cost;

  PetscFunctionBegin;
  (void)PCAinsworthFactorType_Private(data, &type);
  PetscCall(Predict(data, &cost));
  PetscCall(PackageOf(type, &package));
  PetscCall(PCAinsworthLeastMemory_Private(PetscObjectComm((PetscObject)pc), &memory));
  *operations = cost.operations;
  *iterations = (PetscReal)AinsworthPriceFactorization(cost.operations, data->escape.entries, package) / Iteration(data);
  if (!AinsworthLadderFits(PCAinsworthFactorBytes_Private(&cost), memory)) *iterations = PETSC_INFINITY;
  PetscCall(PetscInfo(pc, "A factorization would take %g operations and hold %g entries%s: its price is that of %g iterations\n", (double)cost.operations,
                      (double)cost.entries, *iterations < PETSC_INFINITY ? "" : ", more than memory has room for", (double)*iterations));
  PetscFunctionReturn(PETSC_SUCCESS);
}
