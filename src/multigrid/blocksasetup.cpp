#include "blocksaimpl.h"
#include "../base/events.h"
#include "../base/lists.h"
#include "../base/objects.h"
#include "../base/matrices.h"
#include <algorithm>
#include <limits>

/*
   Upper end of the damped spectrum of D^{-1} M relative to the estimated largest eigenvalue, and lower end relative to
   the upper one
*/
static const PetscReal above = 1.1, below = 0.1;
/*
   With a larger complexity of the first two levels of A a W-cycle costs more than it saves: on ten parts of a mesher it
   is no slower up to 1.60, slower from 1.71 on
*/
static const PetscReal complexityOfW = 1.65;
/*
   Shifts of the coarsest matrix relative to its diagonal, far below what multigrid resolves

   The coarsest solve amplifies the null space that rounding leaves in a residual by the inverse of the shift. That must
   not drown the rest, so the shift is larger for a singular matrix with a finest level in single precision
*/
static const PetscReal shift = 1e-12, shiftOfSingular = 1e-9;

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

/* Gets the number of unknowns per node from the sum or from its A, either of which may not know it */
static PetscErrorCode GetBlockSize(PC pc, Mat A, PetscInt *bs)
{
  PetscFunctionBegin;
  PetscCall(MatGetBlockSize(pc->pmat, bs));
  if (*bs == 1) PetscCall(MatGetBlockSize(A, bs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the diagonal of the finest level in the program's order */
static std::vector<PetscReal> Unsorted(const AinsworthHierarchy &h)
{
  std::vector<PetscReal> diagonal(h.finest.diagonal);

  for (size_t l = 0; l < h.order.size(); l++) diagonal[h.order[l]] = h.finest.diagonal[l];
  return diagonal;
}

/*
   Checks whether there are levels with the same block size whose coarse functions reach all that they have to;
   collective
*/
static PetscErrorCode HasLevels(PC pc, const PC_BlockSA *sa, Mat A, PetscInt bs, PetscBool *has)
{
  const AinsworthHierarchy   *h     = sa->levels.hierarchy.get();
  const std::vector<PetscInt> carry = AinsworthSubspaceCarried(sa);
  PetscInt                    n;

  PetscFunctionBegin;
  if (sa->subspace && sa->subspace->map) PetscCall(MatGetLocalSize(sa->subspace->map, NULL, &n));
  else PetscCall(MatGetLocalSize(A, NULL, &n));
  *has = (PetscBool)(!sa->stale && h && (h->sorted ? bs == 1 : h->finest.bs == bs) &&
                     h->finest.nodes->n * h->finest.bs == n &&
                     std::includes(h->carried.begin(), h->carried.end(), carry.begin(), carry.end()));
  if (*has && !h->left.empty()) {
    const std::vector<char> left = AinsworthSubspaceLeft(sa, h->finest.bs, h->order);

    for (size_t i = 0; i < h->left.size(); i++)
      if (h->left[i] && (left.empty() || !left[i])) *has = PETSC_FALSE;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, has, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)pc)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the coordinates of the nodes in their order; if the program stores its unknowns in another order it may have
   given coordinates of all unknowns
*/
static PetscErrorCode GetCoordinates(PC pc, const PC_BlockSA *sa, Mat A, PetscInt bs,
                                     const std::vector<PetscInt> &order, std::vector<PetscReal> *x)
{
  const PetscInt dim = sa->dim;
  PetscInt       n, given = (PetscInt)sa->coordinates.size(), wanted;

  PetscFunctionBegin;
  *x = sa->coordinates;
  if (!dim) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLocalSize(A, &n, NULL));
  wanted = n / bs * dim;
  if (!order.empty() && given == n * dim) {
    for (PetscInt l = 0; l < wanted; l++) (*x)[l] = sa->coordinates[order[l / dim * bs] * dim + l % dim];
    given = wanted;
  }
  PetscCall(AinsworthFirstMismatch(PetscObjectComm((PetscObject)pc), &given, &wanted));
  PetscCheck(given == wanted, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_SIZ,
             "PCSetCoordinates() was called with %" PetscInt_FMT
             " coordinates on a rank, but the matrix needs %" PetscInt_FMT " there, with its blocks of %" PetscInt_FMT,
             given, wanted, bs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Replaces the finest level and keeps the coarser levels of an earlier A; *anew: impossible, because the precision of
   the finest level would change
*/
static PetscErrorCode KeepCoarse(PC pc, PC_BlockSA *sa, Mat A, MatNullSpace near, PetscBool *anew)
{
  auto       hierarchy = std::make_shared<AinsworthHierarchy>(*sa->levels.hierarchy);
  const bool single    = hierarchy->single();
  Mat        aij;

  PetscFunctionBegin;
  sa->levels.hierarchy.reset();
  PetscCall(PCBlockSAGetAIJ_Private(sa, A, &aij));
  PetscCall(hierarchy->replaceFinest(aij, sa->options));
  PetscCall(MatDestroy(&aij));
  *anew = (PetscBool)(hierarchy->single() != single);
  if (*anew) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(pc, "A has other values: the coarser levels are kept nevertheless\n"));
  PetscCall(MatDestroy(&sa->product));
  sa->levels.hierarchy = hierarchy;
  if (sa->levels.alone) {
    auto grids       = std::make_shared<std::vector<AinsworthGrid>>(*sa->levels.alone);
    (*grids)[0]      = hierarchy->finest;
    sa->levels.alone = grids;
  }
  sa->old = PETSC_TRUE;
  PetscCall(sa->levels.source.take(A, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the levels of A, anew if A, its near null space, or an option changed */
static PetscErrorCode SetUpLevels(PC pc, PC_BlockSA *sa, Mat A, PetscBool *anew)
{
  Mat                    aij;
  MatNullSpace           near;
  PetscInt               bs, n, all;
  PetscBool              same = PETSC_FALSE, fits = PETSC_FALSE, has;
  AinsworthModes         modes;
  std::vector<PetscInt>  order;
  std::vector<PetscReal> coordinates;

  PetscFunctionBegin;
  PetscCall(MatGetNearNullSpace(pc->pmat, &near));
  if (!near) PetscCall(MatGetNearNullSpace(A, &near));
  if (!near) PetscCall(MatGetNearNullSpace(pc->mat, &near));
  PetscCall(GetBlockSize(pc, A, &bs));
  PetscCall(HasLevels(pc, sa, A, bs, &has));
  if (has) PetscCall(sa->levels.source.holds(A, near, Unsorted(*sa->levels.hierarchy), &same, &fits));
  *anew = (PetscBool)(!fits || (!sa->keep && (!same || sa->old)));
  if (!*anew && same) {
    PetscCall(PetscInfo(pc, "A has the values that it had: its levels are kept\n"));
    PetscCall(sa->levels.source.identify(A, near));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!*anew) PetscCall(KeepCoarse(pc, sa, A, near, anew));
  if (!*anew) PetscFunctionReturn(PETSC_SUCCESS);
  sa->old = PETSC_FALSE;
  PetscCall(AinsworthGetAIJ(A, &aij));
  if (bs == 1) PetscCall(AinsworthFindNodes(aij, &bs, &order));
  if (bs > 1 && !order.empty())
    PetscCall(
      PetscInfo(pc, "Nodes have %" PetscInt_FMT " unknowns, by the pattern of A, not next to each other\n", bs));
  PetscCall(GetCoordinates(pc, sa, A, bs, order, &coordinates));
  sa->levels = AinsworthLevels();
  PetscCall(MatDestroy(&sa->product));
  PetscCall(AinsworthModesCreate(A, bs, order, near, sa->dim, coordinates.data(), &modes));
  PetscCall(MatDestroy(&aij));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(PCBlockSAGetAIJ_Private(sa, A, &aij));
  PetscCall(MatGetLocalSize(aij, &all, NULL));
  for (PetscInt l = n; l < all && !order.empty(); l++) order.push_back(l);
  modes.values.resize((size_t)all * modes.k, 0.0); /* no mode moves what is not in A */
  if (!modes.rotations)
    PetscCall(PetscInfo(pc, "Neither a near null space nor coordinates: with rigid-body modes (MatSetNearNullSpace(), "
                            "PCSetCoordinates()) slender bodies "
                            "take 2 to 5 times less\n"));
  auto                    hierarchy = std::make_shared<AinsworthHierarchy>();
  const std::vector<char> left      = AinsworthSubspaceLeft(sa, bs, order);
  PetscCall(
    hierarchy->create(aij, bs, std::move(order), std::move(modes), AinsworthSubspaceCarried(sa), left, sa->options));
  PetscCall(MatDestroy(&aij));
  sa->levels.hierarchy = hierarchy;
  sa->stale            = PETSC_FALSE;
  PetscCall(sa->levels.source.take(A, near));
  if (hierarchy->doubts[0])
    PetscCall(PetscInfo(pc, "%s: PC type hypre may be faster on this matrix\n", hierarchy->doubts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the operator of the coarsest level, shifted because floating bodies make it singular */
static PetscErrorCode CreateCoarsest(const AinsworthGrid &grid, std::unique_ptr<AinsworthLevel> &&level,
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

/*
   Creates the levels of A, or of A plus what is added or corrects coarse functions; D: blocks of what is added to the
   finest level. Collective
*/
static PetscErrorCode CreateGrids(PC_BlockSA *sa, Mat A, Mat added, AinsworthBlockMat *D)
{
  const AinsworthHierarchy &h       = *sa->levels.hierarchy;
  const bool                coarser = h.levels() > 1, corrected = coarser && sa->subspace && sa->subspace->correction;
  AinsworthBlockMat         coarse;
  Mat                       aij;

  PetscFunctionBegin;
  sa->corrected.reset();
  if (added) {
    PetscCall(AinsworthGetAIJ(added, &aij));
    PetscCall(AinsworthBlockMatCreate(aij, h.finest.bs, h.order, NULL, D));
    PetscCall(MatDestroy(&aij));
    if (coarser) PetscCall(AinsworthGalerkin(*D, *h.finest.P, &coarse));
  } else if (corrected) PetscCall(PCBlockSACorrectCoarse_Private(A, sa, &coarse));
  if (coarser && (added || corrected)) {
    auto grids = std::make_shared<std::vector<AinsworthGrid>>();

    PetscCall(h.createGrids(&coarse, grids.get()));
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
static PetscErrorCode ConfigureCoarse(PC pc)
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
  static const PetscReal full = 0.25;
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
  PetscCall(PCBlockSASortRows_Private(sa, &rows));
  for (size_t l = 0; l < n; l++) {
    const AinsworthBlockMat *plus = l || sa->subspace ? NULL : added;

    PetscCall(grids[l].createLevel(plus, true, &level));
    if (l) PetscCall(PCBlockSAKeepRows_Private(rows, level.get(), &sa->coarseRows));
    if (l + 1 == n) {
      PetscCall(MatDestroy(&sa->op[l]));
      PetscCall(
        CreateCoarsest(grids[l], std::move(level), singular && grids[0].single ? shiftOfSingular : shift, &sa->op[l]));
      if (l && sa->coarseRows) PetscCall(sa->coarseRows->addSquare(sa->op[l]));
      PetscCall(MakeDense(pc, &sa->op[l]));
      break;
    }
    PetscCall(AinsworthCoarsenRows(grids[l], &rows));
    if (!l && sa->subspace)
      level->stay(std::make_shared<AinsworthLevelSubspace>(sa->subspace, sa->levels.hierarchy->order));
    PetscCall(AinsworthLevelMatSet(grids[l].nodes, grids[l].bs, std::move(level), &sa->op[l]));
    /* what is left may be bars, whose eigenvalue does not matter as they move with what they are in */
    if (plus || (!l && sa->subspace && !sa->subspace->left.empty()))
      PetscCall(AinsworthLevelMatEstimate(sa->op[l], plus ? &plus->rows : NULL, {}));
    PetscCall(PCMGGetInterpolation(pc, (PetscInt)(n - 1 - l), &P));
    PetscCall(AinsworthInterpolationMatSet(P, grids[l].P));
  }
  for (Vec &row : rows) PetscCall(VecDestroy(&row));
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
  if (mg->levels) PetscCall((*sa->mg->reset)(pc));
  pc->setupcalled = PETSC_FALSE;
  PetscCall(PCMGSetLevels(pc, n, NULL));
  PetscCall(PCMGSetGalerkin(pc, PC_MG_GALERKIN_EXTERNAL));
  PetscCall(PCMGSetCycleType(pc, sa->levels.hierarchy->complexity() <= complexityOfW ? PC_MG_CYCLE_W : PC_MG_CYCLE_V));
  for (PetscInt l = 0; l + 1 < n; l++) {
    KSP ksp;
    PC  inner;
    Mat P;

    PetscCall(AinsworthInterpolationMatCreate(grids[l].P, grids[l].nodes, &P));
    PetscCall(PCMGSetInterpolation(pc, n - 1 - l, P));
    if (PetscDefined(USE_COMPLEX)) {
      Mat R;

      PetscCall(MatCreateHermitianTranspose(P, &R));
      PetscCall(PCMGSetRestriction(pc, n - 1 - l, R));
      PetscCall(MatDestroy(&R));
    }
    PetscCall(MatDestroy(&P));
    PetscCall(PCMGGetSmoother(pc, n - 1 - l, &ksp)); /* PCMG sets two steps and no norm */
    PetscCall(KSPSetType(ksp, l == 0 && grids[0].single ? KSPCHEBYSHEVSINGLE : KSPCHEBYSHEV));
    PetscCall(KSPGetPC(ksp, &inner));
    PetscCall(PCSetType(inner, PCJACOBI));
  }
  PetscCall(ConfigureCoarse(pc));
  if (pc->setfromoptionscalled) {
    PetscObjectOptionsBegin((PetscObject)pc);
    PetscCall((*sa->mg->setfromoptions)(pc, PetscOptionsObject));
    PetscOptionsEnd();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the bounds of the smoothers, times a factor, unless options choose how to find them */
PetscErrorCode PCBlockSASetBounds_Private(PC pc, PetscReal factor)
{
  PC_BlockSA *sa = BlockSA(pc);

  PetscFunctionBegin;
  for (size_t l = 0; l + 1 < sa->op.size(); l++) {
    KSP             ksp;
    AinsworthLevel *level;
    PetscOptions    options;
    PetscBool       esteig, eigenvalues, chebyshev;
    const char     *prefix;

    PetscCall(PCMGGetSmoother(pc, (PetscInt)(sa->op.size() - 1 - l), &ksp));
    PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
    PetscCall(PetscObjectGetOptions((PetscObject)ksp, &options));
    PetscCall(PetscOptionsHasName(options, prefix, "-ksp_chebyshev_esteig", &esteig));
    PetscCall(PetscOptionsHasName(options, prefix, "-ksp_chebyshev_eigenvalues", &eigenvalues));
    /* other types do not read these options */
    PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPCHEBYSHEV, &chebyshev));
    if (chebyshev && (esteig || eigenvalues)) continue;
    PetscCall(AinsworthLevelMatGet(sa->op[l], &level));
    const PetscReal largest = factor * above * level->largest;
    if (chebyshev) PetscCall(KSPChebyshevSetEigenvalues(ksp, largest, below * largest));
    else PetscCall(KSPChebyshevSingleSetEigenvalues_Private(ksp, largest, below * largest));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCSetUp_BlockSA(PC pc)
{
  PC_BlockSA       *sa = BlockSA(pc);
  Mat               A, added;
  AinsworthBlockMat D;
  PetscBool         anew = PETSC_TRUE;
  KSP               ksp;
  MatNullSpace      null;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Levels, pc, 0, 0, 0));
  /* first, as levels of other sizes reset the solvers' own preconditioners */
  PetscCall(PCBlockSALeaveSubspace_Private(pc, sa));
  PetscCall(Split(pc->pmat, &A, &added));
  PetscCall(SetUpLevels(pc, sa, A, &anew));
  PetscCall(CreateGrids(sa, A, added, &D));
  if (anew || sa->op.empty()) PetscCall(ConfigureMG(pc, sa));
  /* PCMG's own ignores the order */
  if (sa->levels.hierarchy->sorted || (sa->subspace && sa->subspace->map)) pc->ops->applyrichardson = NULL;
  PetscCall(MatGetNullSpace(pc->pmat, &null));
  if (!null) PetscCall(MatGetNullSpace(pc->mat, &null));
  PetscCall(SetUpOperators(pc, sa, added ? &D : NULL, null != NULL));
  for (PetscInt l = 0, n = (PetscInt)sa->op.size(); l < n; l++) {
    PetscCall(PCMGGetSmoother(pc, n - 1 - l, &ksp));
    PetscCall(KSPSetOperators(ksp, sa->op[l], sa->op[l]));
    if (l + 1 < n) PetscCall(PCMGSetResidual(pc, n - 1 - l, PCMGResidualDefault, sa->op[l]));
  }
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
