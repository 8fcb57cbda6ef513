#include "blocksa.h"
#include "chebyshev.h"
#include "../events.h"
#include "../saddle/saddle.h"
#include <petsc/private/pcmgimpl.h>
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
             "PC type %s takes a %s of two matrices that are added, A and what is added to it on few rows", PCBLOCKSA, MATCOMPOSITE);
  PetscCall(MatCompositeGetMat(pmat, 0, A));
  if (n == 2) PetscCall(MatCompositeGetMat(pmat, 1, added));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The levels of A, made anew where A, its near null space or a choice is another than last time */
static PetscErrorCode SetUpLevels(PC pc, PC_BlockSA *sa, Mat A, PetscBool *anew)
{
  Mat              aij;
  MatNullSpace     near;
  PetscObjectId    id, modesId = 0;
  PetscObjectState state;
  PetscInt         bs, n;
  AinsworthModes   modes;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)A, &id));
  PetscCall(PetscObjectStateGet((PetscObject)A, &state));
  PetscCall(MatGetNearNullSpace(pc->pmat, &near));
  if (!near) PetscCall(MatGetNearNullSpace(A, &near));
  if (!near) PetscCall(MatGetNearNullSpace(pc->mat, &near));
  if (near) PetscCall(PetscObjectGetId((PetscObject)near, &modesId));
  *anew = (PetscBool)(sa->stale || !sa->levels.hierarchy || sa->levels.id != id || sa->levels.state != state || sa->levels.modes != modesId);
  if (!*anew) {
    PetscCall(PetscInfo(pc, "A did not change: its levels are kept\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetBlockSize(A, &bs));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCheck(!sa->dim || (PetscInt)sa->coordinates.size() == n / bs * sa->dim, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_SIZ,
             "PCSetCoordinates() was called with %" PetscInt_FMT " coordinates on this rank, the matrix has %" PetscInt_FMT " rows in blocks of %" PetscInt_FMT,
             (PetscInt)sa->coordinates.size(), n, bs);
  sa->levels = AinsworthLevels();
  PetscCall(MatDestroy(&sa->product));
  PetscCall(AinsworthModesCreate(A, near, n, bs, sa->dim, sa->coordinates.data(), &modes));
  if (!modes.rotations)
    PetscCall(PetscInfo(pc, "Neither a near null space nor coordinates: with rigid-body modes (MatSetNearNullSpace(), PCSetCoordinates()) slender bodies "
                            "take 2 to 5 times less\n"));
  PetscCall(AinsworthGetAIJ(A, &aij));
  auto hierarchy = std::make_shared<AinsworthHierarchy>();
  PetscCall(hierarchy->create(aij, bs, std::move(modes), sa->options));
  PetscCall(MatDestroy(&aij));
  sa->levels.hierarchy = hierarchy;
  sa->levels.id        = id;
  sa->levels.state     = state;
  sa->levels.modes     = modesId;
  sa->stale            = PETSC_FALSE;
  if (hierarchy->doubts[0]) PetscCall(PetscInfo(pc, "%s: PC type hypre may be faster on this matrix\n", hierarchy->doubts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Operators of all levels: A_l, or A_l plus the Galerkin products of what is added to A */
static PetscErrorCode SetUpOperators(PC_BlockSA *sa, Mat added, bool singular)
{
  const AinsworthHierarchy       &h = *sa->levels.hierarchy;
  const PetscInt                  n = (PetscInt)h.grids.size();
  AinsworthBlockMat               D;
  Mat                             aij, coarsest;
  std::unique_ptr<AinsworthLevel> level;

  PetscFunctionBegin;
  if (added) {
    PetscCall(AinsworthGetAIJ(added, &aij));
    PetscCall(AinsworthBlockMatCreate(aij, h.grids[0].bs, &D));
    PetscCall(MatDestroy(&aij));
  }
  for (PetscInt l = 0; l < n; l++) {
    PetscCall(h.createLevel(l, added ? &D : NULL, true, &level));
    if (added && l + 1 < n) PetscCall(AinsworthLevelEstimate(level.get()));
    if (l + 1 < n) {
      if (!sa->op[l]) PetscCall(AinsworthLevelMatCreate(h.grids[l].nodes, h.grids[l].bs, &sa->op[l]));
      PetscCall(AinsworthLevelMatSet(sa->op[l], std::move(level)));
    } else {
      for (PetscReal &d : level->diagonal) d *= singular && h.single() ? shiftOfSingular : shift;
      const std::vector<PetscReal> shifts(level->diagonal);
      Vec                          d;
      PetscScalar                 *a;

      PetscCall(AinsworthLevelMatCreate(h.grids[l].nodes, h.grids[l].bs, &coarsest));
      PetscCall(AinsworthLevelMatSet(coarsest, std::move(level)));
      PetscCall(MatDestroy(&sa->op[l]));
      PetscCall(MatConvert(coarsest, MATAIJ, MAT_INITIAL_MATRIX, &sa->op[l]));
      PetscCall(MatDestroy(&coarsest));
      /* bodies that nothing holds leave their modes in the coarsest matrix */
      PetscCall(MatCreateVecs(sa->op[l], &d, NULL));
      PetscCall(VecGetArrayWrite(d, &a));
      for (size_t k = 0; k < shifts.size(); k++) a[k] = shifts[k];
      PetscCall(VecRestoreArrayWrite(d, &a));
      PetscCall(MatDiagonalSet(sa->op[l], d, ADD_VALUES));
      PetscCall(VecDestroy(&d));
    }
    if (added) {
      AinsworthBlockMat next;

      if (l + 1 < n) PetscCall(AinsworthGalerkin(D, *h.grids[l].P, &next));
      PetscCall(D.cols.destroy());
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
    PetscCall(KSPSetType(ksp, KSPPREONLY));
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
  for (Mat &P : sa->P) PetscCall(MatDestroy(&P));
  sa->op.assign(n, NULL);
  sa->P.assign(n - 1, NULL);
  sa->smoother.assign(n - 1, NULL);
  if (mg->levels) PetscCall((*sa->reset)(pc));
  pc->setupcalled = PETSC_FALSE;
  PetscCall(PCMGSetLevels(pc, n, NULL));
  PetscCall(PCMGSetGalerkin(pc, PC_MG_GALERKIN_EXTERNAL));
  PetscCall(PCMGSetCycleType(pc, h.complexity() <= complexityOfW ? PC_MG_CYCLE_W : PC_MG_CYCLE_V));
  for (PetscInt l = 0; l + 1 < n; l++) {
    const bool single = l == 0 && h.single();
    KSP        ksp;
    PC         inner;

    PetscCall(AinsworthInterpolationMatCreate(h.grids[l].P, h.grids[l].nodes, &sa->P[l]));
    PetscCall(PCMGSetInterpolation(pc, n - 1 - l, sa->P[l]));
#if defined(PETSC_USE_COMPLEX)
    Mat R;

    PetscCall(MatCreateHermitianTranspose(sa->P[l], &R));
    PetscCall(PCMGSetRestriction(pc, n - 1 - l, R));
    PetscCall(MatDestroy(&R));
#endif
    PetscCall(PCMGGetSmoother(pc, n - 1 - l, &ksp));
    sa->smoother[l] = ksp;
    PetscCall(KSPSetType(ksp, single ? KSPCHEBYSHEVSINGLE : KSPCHEBYSHEV));
    PetscCall(KSPSetNormType(ksp, KSP_NORM_NONE));
    PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, 2));
    PetscCall(KSPGetPC(ksp, &inner));
    PetscCall(PCSetType(inner, PCJACOBI));
  }
  PetscCall(ConfigureCoarse(pc));
  if (pc->setfromoptionscalled) {
    PetscObjectOptionsBegin((PetscObject)pc);
    PetscCall((*sa->setfromoptions)(pc, PetscOptionsObject));
    PetscOptionsEnd();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bounds of the smoothers, unless the user chose how they are found */
static PetscErrorCode SetBounds(PC_BlockSA *sa, PetscReal factor)
{
  PetscFunctionBegin;
  for (size_t l = 0; l < sa->smoother.size(); l++) {
    AinsworthLevel *level;
    PetscOptions    options;
    PetscBool       given = PETSC_FALSE, chebyshev;
    const char     *prefix;

    PetscCall(KSPGetOptionsPrefix(sa->smoother[l], &prefix));
    PetscCall(PetscObjectGetOptions((PetscObject)sa->smoother[l], &options));
    for (const char *name : {"-ksp_chebyshev_esteig", "-ksp_chebyshev_eigenvalues"}) {
      PetscBool has;

      PetscCall(PetscOptionsHasName(options, prefix, name, &has));
      given = (PetscBool)(given || has);
    }
    PetscCall(PetscObjectTypeCompare((PetscObject)sa->smoother[l], KSPCHEBYSHEV, &chebyshev)); /* no other reads these options */
    if (given && chebyshev) continue;
    PetscCall(AinsworthLevelMatGet(sa->op[l], &level));
    PetscCall(AinsworthChebyshevSetEigenvalues(sa->smoother[l], factor * above * level->largest, factor * above * below * level->largest));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A spectrum estimated too small makes the cycle indefinite: once it shows, the bounds are raised */
PetscErrorCode PCBlockSARaiseBounds_Private(PC_BlockSA *sa)
{
  PetscFunctionBegin;
  PetscCall(SetBounds(sa, 1.5));
  sa->raised = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCSetUp_BlockSA(PC pc)
{
  PC_BlockSA  *sa;
  Mat          A, added;
  PetscBool    anew = PETSC_TRUE;
  KSP          coarse;
  MatNullSpace null;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  PetscCall(PetscLogEventBegin(AINSWORTH_Levels, pc, 0, 0, 0));
  PetscCall(Split(pc->pmat, &A, &added));
  PetscCall(SetUpLevels(pc, sa, A, &anew));
  if (anew || sa->op.empty()) PetscCall(ConfigureMG(pc, sa));
  PetscCall(MatGetNullSpace(pc->pmat, &null));
  if (!null) PetscCall(MatGetNullSpace(pc->mat, &null));
  PetscCall(SetUpOperators(sa, added, null != NULL));
  const PetscInt n = (PetscInt)sa->op.size();
  for (PetscInt l = 0; l + 1 < n; l++) {
    PetscCall(KSPSetOperators(sa->smoother[l], sa->op[l], sa->op[l]));
    PetscCall(PCMGSetResidual(pc, n - 1 - l, AinsworthChebyshevResidual, sa->op[l]));
  }
  PetscCall(PCMGGetCoarseSolve(pc, &coarse));
  PetscCall(KSPSetOperators(coarse, sa->op[n - 1], sa->op[n - 1]));
  PetscCall(SetBounds(sa, 1.0));
  sa->raised = PETSC_FALSE;
  PetscCall((*sa->setup)(pc));
  PetscCall(SetBounds(sa, 1.0)); /* PCMG has read the options of the smoothers only now, which may have changed their type */
  PetscCall(PetscLogEventEnd(AINSWORTH_Levels, pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
