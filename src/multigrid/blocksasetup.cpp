#include "blocksaimpl.h"
#include "path.h"
#include "../base/events.h"
#include "../base/matrices.h"
#include "../base/objects.h"
#include <cmath>

/*
   Upper end of the damped spectrum of D^{-1} M relative to the estimated largest eigenvalue, as in PETSc, and lower end
   relative to the upper one; where the estimate is too small, the cycle shows that by an indefinite product
*/
static const PetscReal above = 1.1, below = 0.1;
/*
   With a larger complexity of the first two levels of A a second visit of the coarser ones costs more than it saves: on
   ten parts of a mesher it is no slower up to 1.60, slower from 1.71 on
*/
static const PetscReal complexityOfTwice = 1.65;

/* Splits the matrix into A and the surface matrix added to it, NULL unless it is a sum of two */
static PetscErrorCode Split(Mat pmat, Mat *A, Mat *added)
{
  PetscBool        composite;
  PetscInt         n;
  MatCompositeType type;

  PetscFunctionBegin;
  *A     = pmat;
  *added = NULL;
  PetscCall(PetscObjectTypeCompare((PetscObject)pmat, MATCOMPOSITE, &composite));
  if (!composite) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCompositeGetNumberMat(pmat, &n));
  PetscCall(MatCompositeGetType(pmat, &type));
  PetscCheck(n <= 2 && type == MAT_COMPOSITE_ADDITIVE, PetscObjectComm((PetscObject)pmat), PETSC_ERR_SUP,
             "PC type %s accepts a %s of two matrices that are added: A, and a matrix with entries in few rows",
             PCBLOCKSA, MATCOMPOSITE);
  PetscCall(MatCompositeGetMat(pmat, 0, A));
  if (n == 2) PetscCall(MatCompositeGetMat(pmat, 1, added));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Creates the levels of A, or of A plus what is added or corrects coarse functions; D: blocks of what is added to the
   finest level. Collective
*/
static PetscErrorCode CreateGrids(PC_BlockSA *sa, Mat A, Mat added, AinsworthBlockMat *D)
{
  const AinsworthHierarchy &h       = *sa->levels.hierarchy;
  const bool                coarser = h.levels() > 1, corrected = coarser && sa->subspace && sa->subspace->correction;
  AinsworthHalf             half;
  Mat                       aij;

  PetscFunctionBegin;
  sa->corrected.reset();
  if (added) {
    PetscCall(AinsworthGetAIJ(added, &aij));
    PetscCall(AinsworthBlockMatOpen(aij, h.finest.bs, h.order, NULL, D));
    PetscCall(MatDestroy(&aij));
    D->store();
    if (coarser) PetscCall(AinsworthGalerkin(*D, *h.finest.P, &half));
  } else if (corrected) PetscCall(PCBlockSACorrectCoarse_Private(A, sa, &half));
  if (coarser && (added || corrected)) {
    auto grids = std::make_shared<std::vector<AinsworthGrid>>();

    PetscCall(h.createGrids(&half, grids.get()));
    sa->grids = grids;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!sa->levels.alone) {
    auto grids = std::make_shared<std::vector<AinsworthGrid>>();

    PetscCall(h.createGrids(NULL, grids.get()));
    sa->levels.alone = grids;
  }
  sa->grids = sa->levels.alone;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets up the operators of all levels; added: to the finest one, NULL: nothing

   In a subspace the finest level is A itself: Q W A has no larger eigenvalue than W A, as Q W <= W (docs/method.md)
*/
static PetscErrorCode SetUpOperators(PC pc, PC_BlockSA *sa, const AinsworthBlockMat *added, bool singular)
{
  const std::vector<AinsworthGrid> &grids = *sa->grids;
  const size_t                      n     = grids.size();
  Mat                               P;
  std::unique_ptr<AinsworthLevel>   level;
  std::vector<Vec>                  rows;

  PetscFunctionBegin;
  if (grids[0].single) {
    sa->largest = 0.0;
    for (PetscReal w : *grids[0].w) sa->largest = PetscMax(sa->largest, w);
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &sa->largest, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)pc)));
  }
  PetscCall(PCBlockSASortRows_Private(sa, &rows));
  for (size_t l = 0; l < n; l++) {
    const AinsworthBlockMat *plus = l || sa->subspace ? NULL : added;

    PetscCall(grids[l].createLevel(plus, l + 1 < n, l > 0, &level));
    if (level->single) level->single->s = sa->scale;
    if (l) PetscCall(PCBlockSAKeepRows_Private(rows, level.get(), &sa->coarseRows));
    if (l + 1 == n) {
      PetscCall(PCBlockSACreateCoarsest_Private(pc, grids[l], std::move(level), singular && grids[0].single,
                                                l ? sa->coarseRows.get() : NULL, &sa->op[l]));
      break;
    }
    PetscCall(AinsworthCoarsenRows(grids[l], &rows));
    if (!l && sa->subspace)
      level->stay(std::make_shared<AinsworthLevelSubspace>(sa->subspace, sa->levels.hierarchy->order));
    if (grids[l].incomplete && level->single) PetscCall(level->giveFactor(plus ? &plus->rows : NULL));
    /* the eigenvalue of embedded bars does not matter: they move with what they are in */
    if (!level->factored() && (plus || (!l && sa->subspace && sa->subspace->embedded)))
      PetscCall(level->estimate(plus ? &plus->rows : NULL, {}));
    PetscCall(AinsworthLevelMatSet(grids[l].nodes, grids[l].bs, std::move(level), &sa->op[l]));
    PetscCall(PCMGGetInterpolation(pc, (PetscInt)(n - 1 - l), &P));
    PetscCall(AinsworthInterpolationMatSet(P, grids[l].P));
  }
  for (Vec &row : rows) PetscCall(VecDestroy(&row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Chooses the cycle: a V-cycle, one that visits all coarser levels twice, or a W-cycle, which visits each level twice
   as often as the one above it (blocksacycle.cpp)

   Two cubes of 335 000 and 1 014 000 unknowns take 8 iterations with the last two and 10 with a V-cycle, with Poisson's
   ratio .45 16 and 19
*/
static PetscErrorCode ChooseCycle(PC pc, const PC_BlockSA *sa)
{
  const std::vector<AinsworthGrid> &grids = *sa->grids;
  const bool                        twice = sa->levels.hierarchy->complexity() <= complexityOfTwice;
  std::vector<AinsworthPathLevel>   levels;

  PetscFunctionBegin;
  for (const AinsworthGrid &grid : grids) levels.push_back({(double)grid.entries(), (double)PetscMax(grid.ranks, 1)});
  levels.back() = {std::pow((double)grids.back().nodes->N * grids.back().bs, 2.0), 1.0};
  PetscCall(PCMGSetCycleType(pc, twice ? PC_MG_CYCLE_W : PC_MG_CYCLE_V));
  if (twice && AinsworthPathPrefersW(sa->options.machine, levels)) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt l = 1; l + 1 < (PetscInt)grids.size(); l++) /* 0, the coarsest, is what is viewed */
    ((PC_MG *)pc->data)->levels[l]->cycles = PC_MG_CYCLE_V;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Configures PCMG for these levels; options take precedence */
static PetscErrorCode ConfigureMG(PC pc, PC_BlockSA *sa)
{
  const std::vector<AinsworthGrid> &grids = *sa->grids;
  const PetscInt                    n     = (PetscInt)grids.size();
  PC_MG                            *mg    = (PC_MG *)pc->data;

  PetscFunctionBegin;
  for (Mat &op : sa->op) PetscCall(MatDestroy(&op));
  sa->op.assign(n, NULL);
  sa->cycle = AinsworthCycle();
  if (mg->levels) PetscCall((*sa->mg->reset)(pc));
  pc->setupcalled = PETSC_FALSE;
  PetscCall(PCMGSetLevels(pc, n, NULL));
  PetscCall(PCMGSetGalerkin(pc, PC_MG_GALERKIN_EXTERNAL));
  PetscCall(ChooseCycle(pc, sa));
  for (PetscInt l = 0; l + 1 < n; l++) {
    KSP ksp;
    PC  inner;
    Mat P;

    PetscCall(AinsworthInterpolationMatCreate(grids[l].P, grids[l].nodes, 1, &P));
    PetscCall(PCMGSetInterpolation(pc, n - 1 - l, P));
    if (PetscDefined(USE_COMPLEX)) { /* PCMG would take the transpose of P */
      Mat R;

      PetscCall(MatCreateHermitianTranspose(P, &R));
      PetscCall(PCMGSetRestriction(pc, n - 1 - l, R));
      PetscCall(MatDestroy(&R));
    }
    PetscCall(MatDestroy(&P));
    PetscCall(PCMGGetSmoother(pc, n - 1 - l, &ksp)); /* PCMG sets two steps and no norm */
    PetscCall(KSPSetType(ksp, grids[l].single ? KSPCHEBYSHEVSINGLE : KSPCHEBYSHEV));
    PetscCall(KSPGetPC(ksp, &inner));
    PetscCall(PCSetType(inner, PCJACOBI));
  }
  PetscCall(PCBlockSAConfigureCoarse_Private(pc));
  if (pc->setfromoptionscalled) {
    PetscObjectOptionsBegin((PetscObject)pc);
    PetscCall((*sa->mg->setfromoptions)(pc, PetscOptionsObject));
    PetscOptionsEnd();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether options choose the bounds of a smoother; l: the number of its level in PCMG */
PetscErrorCode PCBlockSABoundsAreChosen_Private(PC pc, PetscInt l, PetscBool *chosen)
{
  KSP          ksp;
  PetscOptions options;
  PetscBool    esteig, eigenvalues, chebyshev;
  const char  *prefix;

  PetscFunctionBegin;
  PetscCall(PCMGGetSmoother(pc, l, &ksp));
  PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
  PetscCall(PetscObjectGetOptions((PetscObject)ksp, &options));
  PetscCall(PetscOptionsHasName(options, prefix, "-ksp_chebyshev_esteig", &esteig));
  PetscCall(PetscOptionsHasName(options, prefix, "-ksp_chebyshev_eigenvalues", &eigenvalues));
  /* other types do not read these options */
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPCHEBYSHEV, &chebyshev));
  *chosen = (PetscBool)(chebyshev && (esteig || eigenvalues));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the bounds of a smoother, times a factor */
PetscErrorCode PCBlockSASetLevelBounds_Private(const AinsworthLevel *level, PetscReal factor, KSP ksp)
{
  const PetscReal excess  = level->subspace ? level->subspace->space->excess : 0.0;
  const PetscReal largest = factor * above * (1.0 + excess) * level->largest;
  PetscBool       chebyshev;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPCHEBYSHEV, &chebyshev));
  if (chebyshev) PetscCall(KSPChebyshevSetEigenvalues(ksp, largest, below * largest));
  else PetscCall(KSPChebyshevSingleSetEigenvalues_Private(ksp, largest, below * largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the bounds of the smoothers, times a factor, unless options choose how to find them */
PetscErrorCode PCBlockSASetBounds_Private(PC pc, PetscReal factor)
{
  PC_BlockSA *sa = BlockSA(pc);

  PetscFunctionBegin;
  for (size_t l = 0; l + 1 < sa->op.size(); l++) {
    const PetscInt  at = (PetscInt)(sa->op.size() - 1 - l);
    KSP             ksp;
    AinsworthLevel *level;
    PetscBool       chosen;

    PetscCall(PCBlockSABoundsAreChosen_Private(pc, at, &chosen));
    if (chosen) continue;
    PetscCall(PCMGGetSmoother(pc, at, &ksp));
    PetscCall(AinsworthLevelMatGet(sa->op[l], &level));
    PetscCall(PCBlockSASetLevelBounds_Private(level, factor, ksp));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCSetUp_BlockSA(PC pc)
{
  PC_BlockSA       *sa = BlockSA(pc);
  Mat               A, added;
  AinsworthBlockMat D;
  PetscBool         rebuild = PETSC_TRUE;
  KSP               ksp;
  MatNullSpace      null;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Levels, pc, 0, 0, 0));
  /* first, as levels of other sizes reset the solvers' own preconditioners */
  PetscCall(PCBlockSALeaveSubspace_Private(pc, sa));
  PetscCall(Split(pc->pmat, &A, &added));
  PetscCall(PCBlockSASetUpLevels_Private(pc, sa, A, &rebuild));
  PetscCall(CreateGrids(sa, A, added, &D));
  if (rebuild || sa->op.empty()) PetscCall(ConfigureMG(pc, sa));
  PetscCall(MatGetNullSpace(pc->pmat, &null));
  if (!null) PetscCall(MatGetNullSpace(pc->mat, &null));
  PetscCall(SetUpOperators(pc, sa, added ? &D : NULL, null != NULL));
  for (PetscInt l = 0, n = (PetscInt)sa->op.size(); l < n; l++) {
    PetscCall(PCMGGetSmoother(pc, n - 1 - l, &ksp));
    PetscCall(KSPSetOperators(ksp, sa->op[l], sa->op[l]));
    if (l + 1 < n) PetscCall(PCMGSetResidual(pc, n - 1 - l, PCMGResidualDefault, sa->op[l]));
  }
  PetscCall(PCBlockSAConfigureBlock_Private(pc));
  PetscCall(PCBlockSASetBounds_Private(pc, 1.0));
  sa->raised = PETSC_FALSE;
  PetscCall((*sa->mg->setup)(pc));
  PetscCall(PCBlockSAStayInSubspace_Private(pc, sa));
  /* PCMG reads the options of the smoothers only now, and they may change their types */
  PetscCall(PCBlockSASetBounds_Private(pc, 1.0));
  PetscCall(MatDestroy(&sa->extended));
  PetscCall(PetscLogEventEnd(AINSWORTH_Levels, pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
