#include "blocksa.h"
#include "../events.h"
#include "../saddle/saddle.h"
#include <limits>

/* Part of the spectrum of D^{-1} M that is damped, of the largest eigenvalue estimated */
static const PetscReal above = 1.1, below = 0.1;
/* With more entries on all levels than this times those of A a W-cycle costs more than it saves */
static const PetscReal complexityOfW = 1.5;
/*
   Shift of the coarsest matrix, of its diagonal, far below what multigrid resolves. What rounding leaves of a null space in a residual grows by its inverse:
   from a finest level in single precision it must not drown the rest
*/
static const PetscReal shift = 1e-12, shiftOfSingular = 1e-9;

/* A, and what is added to it on a surface where the matrix is a sum of two */
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
             "PC type %s accepts a %s of two matrices that are added: A, and a matrix with entries in few rows", PCBLOCKSA, MATCOMPOSITE);
  PetscCall(MatCompositeGetMat(pmat, 0, A));
  if (n == 2) PetscCall(MatCompositeGetMat(pmat, 1, added));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the matrices say of the unknowns of a node. A sum may know what its A does not, or the other way round */
static PetscErrorCode GetBlockSize(PC pc, Mat A, PetscInt *bs)
{
  PetscFunctionBegin;
  PetscCall(MatGetBlockSize(pc->pmat, bs));
  if (*bs == 1) PetscCall(MatGetBlockSize(A, bs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The diagonal of the finest level in the order of the program */
static std::vector<PetscReal> Unsorted(const AinsworthHierarchy &h)
{
  std::vector<PetscReal> diagonal(h.grids[0].diagonal);

  for (size_t l = 0; l < h.order.size(); l++) diagonal[h.order[l]] = h.grids[0].diagonal[l];
  return diagonal;
}

/* Are there levels, of nodes that these matrices have, too? */
static bool HasLevels(const PC_BlockSA *sa, PetscInt bs)
{
  const AinsworthHierarchy *h = sa->levels.hierarchy.get();

  return !sa->stale && h && (h->sorted ? bs == 1 : h->grids[0].bs == bs);
}

/* The coordinates of nodes, in their order; where the program has unknowns sorted otherwise they may also be those of all unknowns */
static PetscErrorCode GetCoordinates(PC pc, const PC_BlockSA *sa, Mat A, PetscInt bs, const std::vector<PetscInt> &order, std::vector<PetscReal> *x)
{
  const PetscInt given = (PetscInt)sa->coordinates.size(), dim = sa->dim;
  PetscInt       n;

  PetscFunctionBegin;
  *x = sa->coordinates;
  if (!dim) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLocalSize(A, &n, NULL));
  if (!order.empty() && given == n * dim)
    for (PetscInt l = 0; l < n / bs * dim; l++) (*x)[l] = sa->coordinates[order[l / dim * bs] * dim + l % dim];
  else
    PetscCheck(given == n / bs * dim, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_SIZ,
               "PCSetCoordinates() was called with %" PetscInt_FMT " coordinates on this rank, but the matrix has %" PetscInt_FMT
               " rows in blocks of %" PetscInt_FMT,
               given, n, bs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The coarser levels of an earlier A stay, under the finest one of A; *anew: they do not, as the precision of this would be another */
static PetscErrorCode KeepCoarse(PC pc, PC_BlockSA *sa, Mat A, MatNullSpace near, PetscBool *anew)
{
  auto       hierarchy = std::make_shared<AinsworthHierarchy>(*sa->levels.hierarchy);
  const bool single    = hierarchy->single();
  Mat        aij;

  PetscFunctionBegin;
  sa->levels.hierarchy.reset();
  PetscCall(AinsworthGetAIJ(A, &aij));
  PetscCall(hierarchy->replaceFinest(aij, sa->options));
  PetscCall(MatDestroy(&aij));
  *anew = (PetscBool)(hierarchy->single() != single);
  if (*anew) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(pc, "A has other values: the coarser levels are kept nevertheless\n"));
  PetscCall(MatDestroy(&sa->product));
  sa->levels.hierarchy = hierarchy;
  sa->old              = PETSC_TRUE;
  PetscCall(sa->levels.source.take(A, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The levels of A, made anew where A, its near null space or a choice is another than last time */
static PetscErrorCode SetUpLevels(PC pc, PC_BlockSA *sa, Mat A, PetscBool *anew)
{
  Mat                    aij;
  MatNullSpace           near;
  PetscInt               bs;
  PetscBool              same = PETSC_FALSE, fits = PETSC_FALSE;
  AinsworthModes         modes;
  std::vector<PetscInt>  order;
  std::vector<PetscReal> coordinates;

  PetscFunctionBegin;
  PetscCall(MatGetNearNullSpace(pc->pmat, &near));
  if (!near) PetscCall(MatGetNearNullSpace(A, &near));
  if (!near) PetscCall(MatGetNearNullSpace(pc->mat, &near));
  PetscCall(GetBlockSize(pc, A, &bs));
  if (HasLevels(sa, bs)) PetscCall(sa->levels.source.holds(A, near, Unsorted(*sa->levels.hierarchy), &same, &fits));
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
  if (bs > 1 && !order.empty()) PetscCall(PetscInfo(pc, "Nodes have %" PetscInt_FMT " unknowns, by the pattern of A, not next to each other\n", bs));
  PetscCall(GetCoordinates(pc, sa, A, bs, order, &coordinates));
  sa->levels = AinsworthLevels();
  PetscCall(MatDestroy(&sa->product));
  PetscCall(AinsworthModesCreate(A, bs, order, near, sa->dim, coordinates.data(), &modes));
  if (!modes.rotations)
    PetscCall(PetscInfo(pc, "Neither a near null space nor coordinates: with rigid-body modes (MatSetNearNullSpace(), PCSetCoordinates()) slender bodies "
                            "take 2 to 5 times less\n"));
  auto hierarchy = std::make_shared<AinsworthHierarchy>();
  PetscCall(hierarchy->create(aij, bs, std::move(order), std::move(modes), sa->options));
  PetscCall(MatDestroy(&aij));
  sa->levels.hierarchy = hierarchy;
  sa->stale            = PETSC_FALSE;
  PetscCall(sa->levels.source.take(A, near));
  if (hierarchy->doubts[0]) PetscCall(PetscInfo(pc, "%s: PC type hypre may be faster on this matrix\n", hierarchy->doubts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The operator of the coarsest level, shifted: bodies that nothing holds leave their modes in it */
static PetscErrorCode CreateCoarsest(const AinsworthGrid &grid, std::unique_ptr<AinsworthLevel> &&level, PetscReal factor, Mat *op)
{
  Mat coarsest = NULL;
  Vec shifts;

  PetscFunctionBegin;
  PetscCall(AinsworthLevelMatSet(grid.nodes, grid.bs, std::move(level), &coarsest));
  PetscCall(MatConvert(coarsest, MATAIJ, MAT_INITIAL_MATRIX, op));
  PetscCall(AinsworthMakePatternSymmetric(op)); /* PETSc's orderings do not end where it is not */
  PetscCall(MatCreateVecs(coarsest, &shifts, NULL));
  PetscCall(MatGetDiagonal(coarsest, shifts));
  PetscCall(VecScale(shifts, factor));
  PetscCall(MatDiagonalSet(*op, shifts, ADD_VALUES));
  PetscCall(VecDestroy(&shifts));
  PetscCall(MatDestroy(&coarsest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Operators of all levels: A_l, or A_l plus the Galerkin products of what is added to A */
static PetscErrorCode SetUpOperators(PC_BlockSA *sa, Mat added, bool singular)
{
  const AinsworthHierarchy       &h = *sa->levels.hierarchy;
  const size_t                    n = h.grids.size();
  AinsworthBlockMat               D;
  Mat                             aij;
  std::unique_ptr<AinsworthLevel> level;

  PetscFunctionBegin;
  if (added) {
    PetscCall(AinsworthGetAIJ(added, &aij));
    PetscCall(AinsworthBlockMatCreate(aij, h.grids[0].bs, h.order, &D));
    PetscCall(MatDestroy(&aij));
  }
  for (size_t l = 0; l < n; l++) {
    PetscCall(h.createLevel((PetscInt)l, added ? &D : NULL, true, &level));
    if (l + 1 == n) {
      PetscCall(MatDestroy(&sa->op[l]));
      PetscCall(CreateCoarsest(h.grids[l], std::move(level), singular && h.single() ? shiftOfSingular : shift, &sa->op[l]));
      break;
    }
    if (added) PetscCall(level->estimate(l ? NULL : &D.rows)); /* on coarser levels all is near the surface, and ten steps cost little */
    PetscCall(AinsworthLevelMatSet(h.grids[l].nodes, h.grids[l].bs, std::move(level), &sa->op[l]));
    if (added) {
      AinsworthBlockMat next;

      PetscCall(AinsworthGalerkin(D, *h.grids[l].P, &next));
      D = std::move(next);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solver of the coarsest level: a factorization, on every rank where there are several */
static PetscErrorCode ConfigureCoarse(PC pc)
{
  KSP         ksp;
  PC          inner;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)pc), &size));
  PetscCall(PCMGGetCoarseSolve(pc, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &inner));
  if (size > 1) {
    PetscCall(PCSetType(inner, PCREDUNDANT));
    PetscCall(PCRedundantGetKSP(inner, &ksp));
    PetscCall(KSPGetPC(ksp, &inner));
  }
  PetscCall(PCSetType(inner, PetscDefined(USE_COMPLEX) ? PCLU : PCCHOLESKY));
  PetscCall(PCFactorSetZeroPivot(inner, std::numeric_limits<PetscReal>::min())); /* pivots are relative to nothing in PETSc */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCMG with these levels, where its options do not say otherwise */
static PetscErrorCode ConfigureMG(PC pc, PC_BlockSA *sa)
{
  const AinsworthHierarchy &h  = *sa->levels.hierarchy;
  const PetscInt            n  = (PetscInt)h.grids.size();
  PC_MG                    *mg = (PC_MG *)pc->data;

  PetscFunctionBegin;
  for (Mat &op : sa->op) PetscCall(MatDestroy(&op));
  sa->op.assign(n, NULL);
  if (mg->levels) PetscCall((*sa->mg.reset)(pc));
  pc->setupcalled = PETSC_FALSE;
  PetscCall(PCMGSetLevels(pc, n, NULL));
  PetscCall(PCMGSetGalerkin(pc, PC_MG_GALERKIN_EXTERNAL));
  PetscCall(PCMGSetCycleType(pc, h.complexity() <= complexityOfW ? PC_MG_CYCLE_W : PC_MG_CYCLE_V));
  for (PetscInt l = 0; l + 1 < n; l++) {
    KSP ksp;
    PC  inner;
    Mat P;

    PetscCall(AinsworthInterpolationMatCreate(h.grids[l].P, h.grids[l].nodes, &P));
    PetscCall(PCMGSetInterpolation(pc, n - 1 - l, P));
    if (PetscDefined(USE_COMPLEX)) {
      Mat R;

      PetscCall(MatCreateHermitianTranspose(P, &R));
      PetscCall(PCMGSetRestriction(pc, n - 1 - l, R));
      PetscCall(MatDestroy(&R));
    }
    PetscCall(MatDestroy(&P));
    PetscCall(PCMGGetSmoother(pc, n - 1 - l, &ksp)); /* two steps without a norm are what PCMG does */
    PetscCall(KSPSetType(ksp, l == 0 && h.single() ? KSPCHEBYSHEVSINGLE : KSPCHEBYSHEV));
    PetscCall(KSPGetPC(ksp, &inner));
    PetscCall(PCSetType(inner, PCJACOBI));
  }
  PetscCall(ConfigureCoarse(pc));
  if (pc->setfromoptionscalled) {
    PetscObjectOptionsBegin((PetscObject)pc);
    PetscCall((*sa->mg.setfromoptions)(pc, PetscOptionsObject));
    PetscOptionsEnd();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bounds of the smoothers, times a factor, unless the user chose how they are found */
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
    PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPCHEBYSHEV, &chebyshev)); /* no other reads these options */
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
  PC_BlockSA  *sa = BlockSA(pc);
  Mat          A, added;
  PetscBool    anew = PETSC_TRUE;
  KSP          ksp;
  MatNullSpace null;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Levels, pc, 0, 0, 0));
  PetscCall(Split(pc->pmat, &A, &added));
  PetscCall(SetUpLevels(pc, sa, A, &anew));
  if (anew || sa->op.empty()) PetscCall(ConfigureMG(pc, sa));
  if (sa->levels.hierarchy->sorted) pc->ops->applyrichardson = NULL; /* that of PCMG would know nothing of the order */
  PetscCall(MatGetNullSpace(pc->pmat, &null));
  if (!null) PetscCall(MatGetNullSpace(pc->mat, &null));
  PetscCall(SetUpOperators(sa, added, null != NULL));
  for (PetscInt l = 0, n = (PetscInt)sa->op.size(); l < n; l++) {
    PetscCall(PCMGGetSmoother(pc, n - 1 - l, &ksp));
    PetscCall(KSPSetOperators(ksp, sa->op[l], sa->op[l]));
    if (l + 1 < n) PetscCall(PCMGSetResidual(pc, n - 1 - l, PCMGResidualDefault, sa->op[l]));
  }
  PetscCall(PCBlockSASetBounds_Private(pc, 1.0));
  sa->raised = PETSC_FALSE;
  PetscCall((*sa->mg.setup)(pc));
  PetscCall(PCBlockSASetBounds_Private(pc, 1.0)); /* PCMG has read the options of the smoothers only now, which may have changed their type */
  PetscCall(PetscLogEventEnd(AINSWORTH_Levels, pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
