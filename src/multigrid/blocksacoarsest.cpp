/* The coarsest level of PCBLOCKSA: its operator and its factorization */
#include "blocksaimpl.h"
#include "../base/matrices.h"
#include <limits>

/*
   Shifts of the coarsest matrix relative to its diagonal, far below what multigrid resolves

   The coarsest solve amplifies the null space that rounding leaves in a residual by the inverse of the shift. That must
   not drown the rest, so the shift is larger for a singular matrix with a finest level in single precision
*/
static const PetscReal shift = 1e-12, shiftOfSingular = 1e-9;

/* Creates the operator of the coarsest level, shifted because floating bodies make it singular */
static PetscErrorCode CreateShifted(const AinsworthGrid &grid, std::unique_ptr<AinsworthLevel> &&level,
                                    PetscReal factor, Mat *op)
{
  Mat coarsest = NULL;
  Vec shifts;

  PetscFunctionBegin;
  PetscCall(AinsworthLevelMatSet(grid.nodes, grid.bs, std::move(level), &coarsest));
  PetscCall(MatConvert(coarsest, MATAIJ, MAT_INITIAL_MATRIX, op));
  PetscCall(AinsworthMakePatternSymmetric(op)); /* PETSc's orderings do not terminate otherwise */
  PetscCall(AinsworthStoreDiagonal(op));
  PetscCall(MatCreateVecs(coarsest, &shifts, NULL));
  PetscCall(MatGetDiagonal(coarsest, shifts));
  PetscCall(VecScale(shifts, factor));
  PetscCall(MatDiagonalSet(*op, shifts, ADD_VALUES));
  PetscCall(VecDestroy(&shifts));
  PetscCall(MatDestroy(&coarsest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the solver of the coarsest level, on each rank if it is redundant, and its preconditioner */
static PetscErrorCode GetCoarseSolver(PC pc, KSP *ksp, PC *inner)
{
  PetscBool redundant;

  PetscFunctionBegin;
  PetscCall(PCMGGetCoarseSolve(pc, ksp));
  PetscCall(KSPGetPC(*ksp, inner));
  PetscCall(PetscObjectTypeCompare((PetscObject)*inner, PCREDUNDANT, &redundant));
  if (!redundant) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCRedundantGetKSP(*inner, ksp));
  PetscCall(KSPGetPC(*ksp, inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Configures the solver of the coarsest level: a factorization, on every rank if there are several */
PetscErrorCode PCBlockSAConfigureCoarse_Private(PC pc)
{
  KSP         ksp;
  PC          inner;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)pc), &size));
  PetscCall(GetCoarseSolver(pc, &ksp, &inner));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  if (size > 1) {
    PetscCall(PCSetType(inner, PCREDUNDANT));
    PetscCall(GetCoarseSolver(pc, &ksp, &inner));
  }
  PetscCall(PCSetType(inner, PetscDefined(USE_COMPLEX) ? PCLU : PCCHOLESKY));
  /* PETSc compares pivots with an absolute tolerance */
  PetscCall(PCFactorSetZeroPivot(inner, std::numeric_limits<PetscReal>::min()));
  if (!pc->setfromoptionscalled) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCMGGetCoarseSolve(pc, &ksp));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(GetCoarseSolver(pc, &ksp, &inner));
  PetscCall(KSPSetFromOptions(ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Makes the operator of the coarsest level dense where PETSc factors it, many of its entries are there, and all are
   finite: LAPACK raises an error otherwise
*/
static PetscErrorCode MakeDense(PC pc, Mat *op)
{
  /* part of all entries: with 600 unknowns the sparse factorization takes 8 ms with a fourth, 80 with all; LAPACK 3 */
  static const PetscReal full    = 0.25;
  MatSolverType          package = NULL;
  PetscBool              factors, petsc = PETSC_TRUE;
  PetscReal              norm;
  PetscInt               n;
  MatInfo                info;
  KSP                    ksp;
  PC                     inner;

  PetscFunctionBegin;
  PetscCall(GetCoarseSolver(pc, &ksp, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &factors, PCCHOLESKY, PCLU, ""));
  if (factors) PetscCall(PCFactorGetMatSolverType(inner, &package));
  if (package) PetscCall(PetscStrcmp(package, MATSOLVERPETSC, &petsc));
  PetscCall(MatGetInfo(*op, MAT_GLOBAL_SUM, &info));
  PetscCall(MatGetSize(*op, &n, NULL));
  if (!factors || !petsc || info.nz_used < full * n * n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNorm(*op, NORM_FROBENIUS, &norm));
  if (PetscIsInfOrNanReal(norm)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatConvert(*op, MATDENSE, MAT_INPLACE_MATRIX, op));
  PetscCall(MatSetOption(*op, MAT_SPD, PETSC_FALSE)); /* LAPACK would refuse pivots that rounding makes negative */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Makes the factorization again from its type and options if the last matrix was dense and this one is not: PETSc
   keeps the ordering that the type of the first matrix prefers, and a dense one has none
*/
static PetscErrorCode ResetForOther(PC pc, Mat op)
{
  KSP         ksp;
  PC          coarse, inner;
  PC_BlockSA *sa = BlockSA(pc);
  PetscBool   factors, dense, before;
  char        type[64];

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)op, &dense, MATSEQDENSE, MATMPIDENSE, ""));
  before    = sa->dense;
  sa->dense = dense;
  if (!before || dense) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCMGGetCoarseSolve(pc, &ksp));
  PetscCall(KSPGetPC(ksp, &coarse));
  PetscCall(GetCoarseSolver(pc, &ksp, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &factors, PCCHOLESKY, PCLU, ""));
  if (!factors) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCReset(coarse));
  PetscCall(PetscStrncpy(type, ((PetscObject)inner)->type_name, sizeof(type)));
  PetscCall(PCSetType(inner, PCNONE));
  PetscCall(PCSetType(inner, type));
  PetscCall(PCFactorSetZeroPivot(inner, std::numeric_limits<PetscReal>::min()));
  if (pc->setfromoptionscalled) PetscCall(PCSetFromOptions(inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCBlockSACreateCoarsest_Private - creates the operator of the coarsest level

   singular: A is, and a finest level in single precision has rounded it; rows: that the level keeps, or NULL
*/
PetscErrorCode PCBlockSACreateCoarsest_Private(PC pc, const AinsworthGrid &grid,
                                               std::unique_ptr<AinsworthLevel> &&level, bool singular,
                                               const AinsworthFewRows *rows, Mat *op)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(op));
  PetscCall(CreateShifted(grid, std::move(level), singular ? shiftOfSingular : shift, op));
  if (rows) PetscCall(rows->addSquare(*op));
  PetscCall(MakeDense(pc, op));
  PetscCall(ResetForOther(pc, *op));
  PetscFunctionReturn(PETSC_SUCCESS);
}
