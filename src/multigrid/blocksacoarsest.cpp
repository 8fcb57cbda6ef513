/* The coarsest level of PCBLOCKSA: its operator and its factorization */
#include "blocksaimpl.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/matrices.h"
#include <cstring>
#include <limits>
#include <string>

/*
   Shifts of the coarsest matrix relative to its diagonal, far below what multigrid resolves

   The coarsest solve amplifies the null space that rounding leaves in a residual by the inverse of the shift. That must
   not drown the rest, so the shift is larger for a singular matrix with levels in single precision
*/
static const PetscReal shift = 1e-12, shiftOfSingular = 1e-9;

/* Creates the operator of the coarsest level, and its diagonal */
static PetscErrorCode CreateOperator(const AinsworthGrid &grid, std::unique_ptr<AinsworthLevel> &&level, Mat *op,
                                     Vec *diagonal)
{
  Mat coarsest = NULL;

  PetscFunctionBegin;
  PetscCall(AinsworthLevelMatSet(grid.nodes, grid.bs, std::move(level), &coarsest));
  PetscCall(MatConvert(coarsest, MATAIJ, MAT_INITIAL_MATRIX, op));
  PetscCall(AinsworthCreateVecs(coarsest, diagonal, NULL));
  PetscCall(MatGetDiagonal(coarsest, *diagonal));
  PetscCall(MatDestroy(&coarsest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds to the diagonal of a dense matrix */
static PetscErrorCode AddToDiagonal(Mat dense, Vec shifts)
{
  PetscScalar *a;
  PetscInt     lda, first;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(dense, &first, NULL));
  PetscCall(MatDenseGetLDA(dense, &lda));
  PetscCall(MatDenseGetArray(dense, &a));
  PetscCall(AinsworthForEntries({shifts}, [=](PetscInt i, PetscScalar s) { a[(size_t)(first + i) * lda + i] += s; }));
  PetscCall(MatDenseRestoreArray(dense, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the solver of the coarsest level, on each rank if there is one for each, and its preconditioner */
static PetscErrorCode GetCoarseSolver(PC pc, KSP *ksp, PC *inner)
{
  PetscBool redundant, blocks;
  KSP      *own;

  PetscFunctionBegin;
  PetscCall(PCMGGetCoarseSolve(pc, ksp));
  PetscCall(KSPGetPC(*ksp, inner));
  PetscCall(PetscObjectTypeCompare((PetscObject)*inner, PCREDUNDANT, &redundant));
  PetscCall(PetscObjectTypeCompare((PetscObject)*inner, PCBJACOBI, &blocks));
  if (redundant) PetscCall(PCRedundantGetKSP(*inner, ksp));
  else if (blocks && (*inner)->setupcalled) {
    PetscCall(PCBJacobiGetSubKSP(*inner, NULL, NULL, &own));
    *ksp = own[0];
  } else PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(*ksp, inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes a preconditioner a factorization */
static PetscErrorCode SetFactorization(PC pc)
{
  PetscFunctionBegin;
  PetscCall(PCSetType(pc, PetscDefined(USE_COMPLEX) ? PCLU : PCCHOLESKY));
  /* PETSc compares pivots with an absolute tolerance */
  PetscCall(PCFactorSetZeroPivot(pc, std::numeric_limits<PetscReal>::min()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the options of the coarsest level's solver, and of the one on each rank, if there is one */
static PetscErrorCode SetCoarseFromOptions(PC pc)
{
  KSP ksp;
  PC  inner;

  PetscFunctionBegin;
  if (!pc->setfromoptionscalled) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCMGGetCoarseSolve(pc, &ksp));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(GetCoarseSolver(pc, &ksp, &inner));
  PetscCall(KSPSetFromOptions(ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Configures the solver of the coarsest level: a factorization on the rank that has all of it, which is one of the
   blocks of PCBJACOBI and needs no messages, or on every rank if several have parts of it
*/
PetscErrorCode PCBlockSAConfigureCoarse_Private(PC pc)
{
  const bool  alone = BlockSA(pc)->grids->back().ranks == 1;
  KSP         ksp;
  PC          inner;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)pc), &size));
  PetscCall(PCMGGetCoarseSolve(pc, &ksp));
  PetscCall(KSPGetPC(ksp, &inner));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  if (size > 1) PetscCall(PCSetType(inner, alone ? PCBJACOBI : PCREDUNDANT));
  if (size > 1 && alone) PetscFunctionReturn(PETSC_SUCCESS); /* PCBlockSAConfigureBlock_Private() goes on */
  PetscCall(GetCoarseSolver(pc, &ksp, &inner));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(SetFactorization(inner));
  PetscCall(SetCoarseFromOptions(pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Configures the solver of each block, which PCBJACOBI has once it is set up. Options are read after that: PCBJACOBI
   would read them before, for its own default
*/
PetscErrorCode PCBlockSAConfigureBlock_Private(PC pc)
{
  KSP       ksp;
  PC        inner;
  PetscBool blocks;

  PetscFunctionBegin;
  PetscCall(PCMGGetCoarseSolve(pc, &ksp));
  PetscCall(KSPGetPC(ksp, &inner));
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, PCBJACOBI, &blocks));
  if (!blocks || inner->setupcalled) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPSetOperators(ksp, BlockSA(pc)->op.back(), BlockSA(pc)->op.back()));
  PetscCall(PCSetUp(inner));
  PetscCall(GetCoarseSolver(pc, &ksp, &inner));
  PetscCall(SetFactorization(inner));
  PetscCall(SetCoarseFromOptions(pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the type of the coarsest level's preconditioner and its package, NULL: PETSc, or what its options choose */
static PetscErrorCode GetFactorization(PC pc, std::string *type, std::string *package)
{
  KSP           ksp;
  PC            inner;
  PCType        name;
  MatSolverType given = NULL;
  PetscBool     blocks, set;
  PetscOptions  options;
  const char   *prefix;
  char          text[128];

  PetscFunctionBegin;
  PetscCall(GetCoarseSolver(pc, &ksp, &inner));
  PetscCall(PCGetType(inner, &name));
  *type = name ? name : "";
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, PCBJACOBI, &blocks));
  if (blocks) { /* its blocks will be configured after this */
    *type = PetscDefined(USE_COMPLEX) ? PCLU : PCCHOLESKY;
    PetscCall(PCGetOptionsPrefix(inner, &prefix));
    PetscCall(PetscObjectGetOptions((PetscObject)inner, &options));
    for (const char *name : {"-pc_type", "-sub_pc_type"}) {
      PetscCall(PetscOptionsGetString(options, prefix, name, text, sizeof(text), &set));
      if (set && pc->setfromoptionscalled && strcmp(text, PCBJACOBI)) *type = text;
    }
    PetscCall(PetscOptionsGetString(options, prefix, "-sub_pc_factor_mat_solver_type", text, sizeof(text), &set));
    if (set && pc->setfromoptionscalled) *package = text;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (*type == PCCHOLESKY || *type == PCLU) PetscCall(PCFactorGetMatSolverType(inner, &given));
  *package = given ? given : "";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Makes the operator of the coarsest level dense where PETSc factors it, many of its entries are there, and all are
   finite: LAPACK raises an error otherwise
*/
static PetscErrorCode MakeDense(PC pc, Mat *op, bool *dense)
{
  /* part of all entries: with 600 unknowns the sparse factorization takes 8 ms with a fourth, 80 with all; LAPACK 3 */
  static const PetscReal full = 0.25;
  std::string            type, package;
  PetscReal              norm;
  PetscInt               n;
  MatInfo                info;

  PetscFunctionBegin;
  *dense = false;
  PetscCall(GetFactorization(pc, &type, &package));
  const bool factors = type == PCCHOLESKY || type == PCLU, petsc = package.empty() || package == MATSOLVERPETSC;

  PetscCall(MatGetInfo(*op, MAT_GLOBAL_SUM, &info));
  PetscCall(MatGetSize(*op, &n, NULL));
  if (!factors || !petsc || info.nz_used < full * n * n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNorm(*op, NORM_FROBENIUS, &norm));
  if (PetscIsInfOrNanReal(norm)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatConvert(*op, MATDENSE, MAT_INPLACE_MATRIX, op));
  *dense = true;
  PetscCall(MatSetOption(*op, MAT_SPD, PETSC_FALSE)); /* LAPACK would refuse pivots that rounding makes negative */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Makes the factorization again from its type and options if the last matrix was dense and this one is not: PETSc
   keeps the ordering that the type of the first matrix prefers, and a dense one has none
*/
static PetscErrorCode ResetForOther(PC pc, bool dense)
{
  KSP         ksp;
  PC          coarse, inner;
  PC_BlockSA *sa = BlockSA(pc);
  PetscBool   factors, blocks;
  char        type[64];

  PetscFunctionBegin;
  const bool before = sa->dense;
  sa->dense         = dense;
  if (!before || dense) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCMGGetCoarseSolve(pc, &ksp));
  PetscCall(KSPGetPC(ksp, &coarse));
  PetscCall(PetscObjectTypeCompare((PetscObject)coarse, PCBJACOBI, &blocks));
  if (blocks) { /* PCBlockSAConfigureBlock_Private() goes on; the solver of its block outlives PCReset() */
    PetscCall(PCSetType(coarse, PCNONE));
    PetscCall(PCSetType(coarse, PCBJACOBI));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
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
   PCBlockSACreateCoarsest_Private - creates the operator of the coarsest level, shifted because floating bodies make it
   singular

   singular: A is, and levels in single precision have rounded it; rows: that the level keeps, or NULL
*/
PetscErrorCode PCBlockSACreateCoarsest_Private(PC pc, const AinsworthGrid &grid,
                                               std::unique_ptr<AinsworthLevel> &&level, bool singular,
                                               const AinsworthFewRows *rows, Mat *op)
{
  const PetscReal part = singular ? shiftOfSingular : shift;
  Vec             shifts;
  PetscReal       largest;
  bool            dense;

  PetscFunctionBegin;
  PetscCall(MatDestroy(op));
  PetscCall(CreateOperator(grid, std::move(level), op, &shifts));
  PetscCall(VecNorm(shifts, NORM_INFINITY, &largest));
  /* an unknown without entries is left to itself: LAPACK raises an error for a zero pivot, on its rank alone */
  PetscCall(AinsworthUpdate(shifts, [=](PetscInt, PetscScalar &d) {
    d = d != 0.0 ? part * d : largest > 0.0 ? largest : 1.0;
  }));
  if (rows) PetscCall(rows->addSquare(op));
  PetscCall(MakeDense(pc, op, &dense));
  if (dense) PetscCall(AddToDiagonal(*op, shifts));
  else {
    PetscCall(AinsworthMakePatternSymmetric(op)); /* PETSc's orderings do not terminate otherwise */
    PetscCall(AinsworthStoreDiagonal(op));
    PetscCall(MatDiagonalSet(*op, shifts, ADD_VALUES));
  }
  PetscCall(VecDestroy(&shifts));
  PetscCall(ResetForOther(pc, dense));
  PetscFunctionReturn(PETSC_SUCCESS);
}
