/* Price of a factorization of M_* in iterations with multigrid (docs/extremes.md) */
#include "solver.h"
#include "../multigrid/blocksa.h"
#include "../projection/matainsworth.h"
#include <cstring>
#include <limits>

/* Predicts the cost of a factorization of M_*; collective, the same on all ranks */
static PetscErrorCode Predict(AinsworthSolver *solver, AinsworthCost *cost)
{
  std::vector<Mat>  parts(1);
  PetscBool         general;
  MatSolverType     package;
  AinsworthPmatFill fill;
  Mat               C, square;

  PetscFunctionBegin;
  /* M_* has the pattern of A + C' C, without long rows */
  if (solver->inner.format == AINSWORTH_PMAT_SUM && solver->saddle->constraints()) {
    PetscCall(AinsworthGetAIJ(solver->saddle->P, &parts[0]));
    PetscCall(AinsworthPmatGetFill(parts[0], solver->saddle->kept.C, &fill));
    PetscCall(AinsworthPmatCreateShort(solver->saddle->kept.C, &fill, &C));
    PetscCall(AinsworthMultiplyAdjoint(C, C, &square));
    PetscCall(MatDestroy(&C));
    parts.push_back(square);
  } else PetscCall(AinsworthGetAIJ(solver->inner.M ? solver->inner.M : solver->saddle->P, &parts[0]));
  PetscCall(AinsworthSolverOrderPmat(solver, parts, cost));
  for (Mat &mat : parts) PetscCall(MatDestroy(&mat));
  PetscCall(PetscStrcmp(AinsworthSolverFactorType(solver, &package), PCLU, &general));
  if (general) {
    cost->entries *= 2.0;
    cost->operations *= 2.0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static AinsworthPackage PackageOf(MatSolverType type)
{
  if (type && !strcmp(type, MATSOLVERCHOLMOD)) return AINSWORTH_PACKAGE_CHOLMOD;
  return type && !strcmp(type, MATSOLVERMUMPS) ? AINSWORTH_PACKAGE_MUMPS : AINSWORTH_PACKAGE_OTHER;
}

/*
   AinsworthSolverEscapePrice - returns the price of a factorization in iterations, a lower bound as long as its
   operations are not known
*/
PetscReal AinsworthSolverEscapePrice(const AinsworthSolver *solver)
{
  const AinsworthPriceFacts &f = solver->escape.facts;
  MatSolverType              type;

  (void)AinsworthSolverFactorType(solver, &type);
  return (PetscReal)(AinsworthPriceFactorization(f, PackageOf(type)) / AinsworthPriceIteration(f));
}

/*
   AinsworthSolverEscapeFacts - gathers what the price of an iteration depends on, with the size and the entries of A;
   collective, the same on all ranks
*/
PetscErrorCode AinsworthSolverEscapeFacts(AinsworthSolver *solver, PetscInt n, PetscReal entries)
{
  AinsworthPriceFacts *f    = &solver->escape.facts;
  MPI_Comm             comm = PetscObjectComm((PetscObject)solver->inner.ksp);
  const AinsworthGram *gram = NULL;
  PetscReal            most = 0.0;
  PetscMPIInt          size;
  PC_BlockSA          *sa;
  PC                   inner;
  PetscBool            factor = PETSC_FALSE;

  PetscFunctionBegin;
  *f          = AinsworthPriceFacts();
  f->entries  = (double)entries;
  f->unknowns = (double)n;
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  f->own = sa && sa->levels.hierarchy;
  if (f->own) f->single = sa->levels.hierarchy->single();
  if (f->own) PetscCall(PCBlockSAHasFactor_Private(sa, &factor));
  f->factor = factor;
  if (f->own && sa->grids && sa->grids->size() > 1) f->coarse = (double)(*sa->grids)[1].entries();
  if (solver->saddle->constraints()) PetscCall(MatAinsworthGetGram_Private(solver->reduced->mat, &gram));
  if (gram) most = gram->factor.cost.entries;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPIU_MAX, comm));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  f->gram = (double)most * size;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverEscapeCost - predicts a factorization of M_*; its price is infinite if the factor does not fit in
   memory. Collective, the same on all ranks
*/
PetscErrorCode AinsworthSolverEscapeCost(AinsworthSolver *solver)
{
  AinsworthPriceFacts *f = &solver->escape.facts;
  PetscReal            memory;
  AinsworthCost        cost;

  PetscFunctionBegin;
  PetscCall(Predict(solver, &cost));
  PetscCall(AinsworthSolverLeastMemory(PetscObjectComm((PetscObject)solver->inner.ksp), &memory));
  const bool fits = AinsworthLadderFits(AinsworthFactorBytes(&cost), memory);
  f->fill         = fits ? (double)cost.entries : std::numeric_limits<double>::infinity();
  f->operations   = (double)cost.operations;
  PetscCall(
    PetscInfo(solver->inner.ksp,
              "A factorization would take %g operations and hold %g entries%s: its price is that of %g iterations\n",
              (double)cost.operations, (double)cost.entries, fits ? "" : ", more than memory has room for",
              (double)AinsworthSolverEscapePrice(solver)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
