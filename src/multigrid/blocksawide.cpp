/* The cycle of PCBLOCKSA for multivectors, by a PCMG of its own that shares the matrices of the levels */
#include "blocksaimpl.h"
#include "../base/layouts.h"
#include "../base/objects.h"

namespace
{
/* The solver of the coarsest level, for the columns of dense matrices */
struct CoarseWide {
  KSP               solver = NULL; /* of one vector; borrowed */
  AinsworthRef<Mat> B, X;
};
} // namespace

static PetscErrorCode CoarseApply(PC pc, Vec b, Vec x)
{
  CoarseWide *data;
  PetscInt    width;
  Vec         column;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &data));
  PetscCall(MatGetSize(data->B, NULL, &width));
  for (PetscInt k = 0; k < width; k++) {
    PetscCall(MatDenseGetColumnVecWrite(data->B, k, &column));
    PetscCall(VecStrideGather(b, k, column, INSERT_VALUES));
    PetscCall(MatDenseRestoreColumnVecWrite(data->B, k, &column));
  }
  PetscCall(KSPMatSolve(data->solver, data->B, data->X));
  for (PetscInt k = 0; k < width; k++) {
    PetscCall(MatDenseGetColumnVecRead(data->X, k, &column));
    PetscCall(VecStrideScatter(column, k, x, INSERT_VALUES));
    PetscCall(MatDenseRestoreColumnVecRead(data->X, k, &column));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CoarseDestroy(PC pc)
{
  CoarseWide *data;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &data));
  delete data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the smoother of a level is one of the two by default, with the Jacobi preconditioner */
static PetscErrorCode IsUsual(PC pc, PetscInt l, PetscBool *usual)
{
  const PC_MG_Levels *level = ((PC_MG *)pc->data)->levels[l];
  PCJacobiType        type  = PC_JACOBI_DIAGONAL;
  PetscBool           jacobi, absolute = PETSC_FALSE;
  PC                  own, inner;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(level->smoothd, &own));
  PetscCall(AinsworthSubspacePCGetInner(own, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)level->smoothd, usual, KSPCHEBYSHEV, KSPCHEBYSHEVSINGLE, ""));
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, PCJACOBI, &jacobi));
  if (jacobi) {
    PetscCall(PCJacobiGetType(inner, &type));
    PetscCall(PCJacobiGetUseAbs(inner, &absolute));
  }
  *usual = (PetscBool)(*usual && jacobi && type == PC_JACOBI_DIAGONAL && !absolute && level->smoothu == level->smoothd);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCBlockSAIsUsual_Private - checks whether the cycle of a preconditioner is that of PCBLOCKSA, set up with smoothers
   as by default, so that PCBlockSAWiden_Private() can make one for multivectors. Not collective
*/
PetscErrorCode PCBlockSAIsUsual_Private(PC pc, PetscBool *usual)
{
  PC_BlockSA *sa = NULL;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  *usual = (PetscBool)(sa && sa->op.size() > 1 && pc->setupcalled && !(sa->subspace && sa->subspace->map) &&
                       ((PC_MG *)pc->data)->am == PC_MG_MULTIPLICATIVE);
  for (PetscInt l = 1; *usual && l < (PetscInt)sa->op.size(); l++) {
    PetscBool chosen;

    PetscCall(PCBlockSABoundsAreChosen_Private(pc, l, &chosen));
    PetscCall(IsUsual(pc, l, usual));
    if (chosen) *usual = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives the wide PCMG the solver of the coarsest level, which has an operator for its layout only */
static PetscErrorCode SetCoarse(PC pc, PetscInt width, PC mg)
{
  PC_BlockSA *sa   = BlockSA(pc);
  auto        data = std::make_unique<CoarseWide>();
  KSP         ksp;
  PC          inner;
  Mat         op;
  PetscInt    n, N;
  PetscLayout rows, layout;

  PetscFunctionBegin;
  PetscCall(PCMGGetCoarseSolve(pc, &data->solver));
  PetscCall(MatGetLocalSize(sa->op.back(), &n, NULL));
  PetscCall(MatGetSize(sa->op.back(), &N, NULL));
  PetscCall(MatCreateDense(PetscObjectComm((PetscObject)pc), n, PETSC_DECIDE, N, width, NULL, data->B.out()));
  PetscCall(MatDuplicate(data->B, MAT_DO_NOT_COPY_VALUES, data->X.out()));
  PetscCall(MatGetLayouts(sa->op.back(), &rows, NULL));
  PetscCall(
    AinsworthLayoutOfBlocks(PetscObjectComm((PetscObject)pc), rows, width, width, &layout)); /* that of its vectors */
  PetscCall(AinsworthCreateShellOn(PetscObjectComm((PetscObject)pc), layout, layout, NULL, &op));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscCall(PCMGGetCoarseSolve(mg, &ksp));
  PetscCall(KSPSetOperators(ksp, op, op));
  PetscCall(MatDestroy(&op));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &inner));
  PetscCall(PCSetType(inner, PCSHELL));
  PetscCall(PCShellSetContext(inner, data.release()));
  PetscCall(PCShellSetApply(inner, CoarseApply));
  PetscCall(PCShellSetDestroy(inner, CoarseDestroy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives a level other than the coarsest its operator, its smoother and interpolation to it; l: from the finest, 0 */
static PetscErrorCode SetLevel(PC pc, PetscInt l, PetscInt width, PC mg)
{
  PC_BlockSA          *sa   = BlockSA(pc);
  const AinsworthGrid &grid = (*sa->grids)[l];
  const PetscInt       at   = (PetscInt)sa->op.size() - 1 - l;
  AinsworthLevel      *level;
  KSP                  from, ksp;
  PC                   inner, projected;
  KSPType              type;
  PetscInt             steps;
  PetscBool            single;
  Mat                  op = NULL, P, R;

  PetscFunctionBegin;
  PetscCall(AinsworthLevelMatGet(sa->op[l], &level));
  PetscCall(AinsworthLevelMatSet(grid.nodes, grid.bs, level->widen(width), &op));
  PetscCall(PCMGGetSmoother(pc, at, &from));
  PetscCall(PCMGGetSmoother(mg, at, &ksp));
  PetscCall(KSPGetType(from, &type));
  PetscCall(KSPGetTolerances(from, NULL, NULL, NULL, &steps));
  PetscCall(KSPSetType(ksp, type));
  PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, steps));
  PetscCall(KSPSetOperators(ksp, op, op));
  PetscCall(KSPGetPC(ksp, &inner));
  PetscCall(PCSetType(inner, PCJACOBI));
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPCHEBYSHEVSINGLE, &single));
  if (level->subspace && !single) { /* the other knows of it */
    PetscCall(AinsworthSubspacePCCreate(level->subspace, width, inner, &projected));
    PetscCall(KSPSetPC(ksp, projected));
    PetscCall(PCDestroy(&projected));
  }
  PetscCall(PCBlockSASetLevelBounds_Private(level, sa->raised ? AinsworthRaised : 1.0, ksp));
  PetscCall(PCMGSetResidual(mg, at, PCMGResidualDefault, op));
  PetscCall(AinsworthInterpolationMatCreate(grid.P, grid.nodes, width, &P));
  if (l == 0) PetscCall(AinsworthInterpolationMatSetSubspace(P, level->subspace, sa->corrected));
  PetscCall(PCMGSetInterpolation(mg, at, P));
  if (PetscDefined(USE_COMPLEX)) {
    PetscCall(MatCreateHermitianTranspose(P, &R));
    PetscCall(PCMGSetRestriction(mg, at, R));
    PetscCall(MatDestroy(&R));
  }
  ((PC_MG *)mg->data)->levels[at]->cycles = ((PC_MG *)pc->data)->levels[at]->cycles;
  PetscCall(MatDestroy(&P));
  PetscCall(MatDestroy(&op));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* The cycle, with vectors for unknowns that are not stored node by node */
struct Wide {
  AinsworthRef<PC>  mg;
  const PC_BlockSA *sa    = NULL; /* borrowed */
  PetscInt          width = 1;
  AinsworthRef<Vec> b, x;
  AinsworthCycle    cycle;
};
} // namespace

static PetscErrorCode WideApply(PC pc, Vec b, Vec x)
{
  Wide *data;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &data));
  PetscCall(PCBlockSASetScale_Private(data->sa, b));
  if (!data->sa->levels.hierarchy->sorted) {
    PetscCall(PCBlockSACycle_Private(data->mg, &data->cycle, b, x));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!data->b) PetscCall(VecDuplicate(b, data->b.out()));
  if (!data->x) PetscCall(VecDuplicate(b, data->x.out()));
  PetscCall(PCBlockSASort_Private(data->sa, false, data->width, b, data->b));
  PetscCall(PCBlockSACycle_Private(data->mg, &data->cycle, data->b, data->x));
  PetscCall(PCBlockSASort_Private(data->sa, true, data->width, data->x, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WideDestroy(PC pc)
{
  Wide *data;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &data));
  delete data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCBlockSAWiden_Private - creates the cycle of a usual PCBLOCKSA (PCBlockSAIsUsual_Private()) for multivectors; valid
   until the PCBLOCKSA is set up again. Collective
*/
PetscErrorCode PCBlockSAWiden_Private(PC pc, PetscInt width, PC *wide)
{
  PC_BlockSA    *sa   = BlockSA(pc);
  const PetscInt top  = (PetscInt)sa->op.size() - 1;
  auto           data = std::make_unique<Wide>();
  KSP            finest;
  Mat            op;

  PetscFunctionBegin;
  data->sa    = sa;
  data->width = width;
  PetscCall(PCCreate(PetscObjectComm((PetscObject)pc), data->mg.out()));
  PetscCall(PCSetOptionsPrefix(data->mg, "blocksa_wide_"));
  PetscCall(PCSetType(data->mg, PCMG));
  PetscCall(PCMGSetLevels(data->mg, top + 1, NULL));
  PetscCall(PCMGSetGalerkin(data->mg, PC_MG_GALERKIN_EXTERNAL));
  for (PetscInt l = 0; l < top; l++) PetscCall(SetLevel(pc, l, width, data->mg));
  PetscCall(SetCoarse(pc, width, data->mg));
  PetscCall(PCMGGetSmoother(data->mg, top, &finest));
  PetscCall(KSPGetOperators(finest, &op, NULL));
  PetscCall(PCSetOperators(data->mg, op, op));
  PetscCall(PCSetUp(data->mg));
  PetscCall(PCCreate(PetscObjectComm((PetscObject)pc), wide));
  PetscCall(PCSetType(*wide, PCSHELL));
  PetscCall(PCSetOperators(*wide, op, op));
  PetscCall(PCShellSetContext(*wide, data.release()));
  PetscCall(PCShellSetApply(*wide, WideApply));
  PetscCall(PCShellSetDestroy(*wide, WideDestroy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
