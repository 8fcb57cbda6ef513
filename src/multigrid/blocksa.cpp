#include "blocksa.h"
#include "../guard.h"
#include <petsc/private/pcmgimpl.h>

static const char *const precisions[] = {"double", "single", "Precision", "", NULL};

PetscErrorCode PCBlockSAGet_Private(PC pc, PC_BlockSA **sa)
{
  PetscFunctionBegin;
  *sa = (PC_BlockSA *)((PC_MG *)pc->data)->innerctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetOrNone(PC pc, PC_BlockSA **sa)
{
  PetscBool same;

  PetscFunctionBegin;
  *sa = NULL;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCBLOCKSA, &same));
  if (same) PetscCall(PCBlockSAGet_Private(pc, sa));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The levels of A, to be given back after PCReset() */
PetscErrorCode PCBlockSAGetLevels_Private(PC pc, AinsworthLevels *levels)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  PetscCall(GetOrNone(pc, &sa));
  if (sa) *levels = sa->levels;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCBlockSASetLevels_Private(PC pc, const AinsworthLevels &levels)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  PetscCall(GetOrNone(pc, &sa));
  if (sa) sa->levels = levels;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the next set-up on A can be had for products */
PetscErrorCode PCBlockSAKeepProduct_Private(PC pc)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  PetscCall(GetOrNone(pc, &sa));
  if (sa) sa->options.product = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A with half of its entries stored, for products; NULL where there is no such matrix. Not to be destroyed, valid until A changes */
PetscErrorCode PCBlockSAGetProduct_Private(PC pc, Mat *product)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  *product = NULL;
  PetscCall(GetOrNone(pc, &sa));
  if (!sa || !sa->levels.hierarchy || !sa->levels.hierarchy->grids[0].upper) PetscFunctionReturn(PETSC_SUCCESS);
  if (!sa->product) PetscCall(AinsworthHierarchyCreateProduct(*sa->levels.hierarchy, &sa->product));
  *product = sa->product;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Why the levels of A are no good multigrid, an empty string where nothing speaks against them, NULL for another type of PC */
PetscErrorCode PCBlockSAGetDoubts_Private(PC pc, const char **doubts)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  PetscCall(GetOrNone(pc, &sa));
  *doubts = sa && sa->levels.hierarchy ? sa->levels.hierarchy->doubts : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Single precision makes the cycle linear to seven digits only. Methods that take x from the very M^{-1} r whose product with A goes to the residual do not
   mind; others, as GMRES, believe in residuals that x does not have
*/
static PetscErrorCode PCPreSolve_BlockSA(PC pc, KSP ksp, Vec, Vec)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &sa->tolerant, KSPCG, KSPPROJECTEDCG, KSPFCG, KSPPIPEFCG, KSPFGMRES, KSPGCR, KSPRICHARDSON, ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCPostSolve_BlockSA(PC pc, KSP, Vec, Vec)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  sa->tolerant = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCApply_BlockSA(PC pc, Vec b, Vec x)
{
  PC_BlockSA *sa;
  PetscScalar energy;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  if (sa->levels.hierarchy->single() && !sa->given && !sa->tolerant) {
    PetscCall(PetscInfo(pc, "Who applies this is not known to bear with single precision: the levels are made anew in double\n"));
    sa->options.single = PETSC_FALSE;
    sa->stale          = PETSC_TRUE;
    PetscCall(PCSetUp_BlockSA(pc));
    pc->setupcalled = PETSC_TRUE;
  }
  PetscCall((*sa->apply)(pc, b, x));
  if (sa->raised) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDot(x, b, &energy));
  if (PetscRealPart(energy) >= 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(pc, "The cycle is indefinite, r'z = %g: the bounds of the smoothers are raised\n", (double)PetscRealPart(energy)));
  PetscCall(PCBlockSARaiseBounds_Private(sa));
  PetscCall((*sa->apply)(pc, b, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cycle is Hermitian */
static PetscErrorCode PCApplyTranspose_BlockSA(PC pc, Vec b, Vec x)
{
  PetscFunctionBegin;
#if defined(PETSC_USE_COMPLEX)
  Vec conjugate;

  PetscCall(VecDuplicate(b, &conjugate));
  PetscCall(VecCopy(b, conjugate));
  PetscCall(VecConjugate(conjugate));
  PetscCall(PCApply_BlockSA(pc, conjugate, x));
  PetscCall(VecConjugate(x));
  PetscCall(VecDestroy(&conjugate));
#else
  PetscCall(PCApply_BlockSA(pc, b, x));
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetCoordinates_BlockSA(PC pc, PetscInt dim, PetscInt n, PetscReal *coordinates)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  sa->dim = dim;
  sa->coordinates.assign(coordinates, coordinates + (size_t)n * dim);
  sa->stale = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetFromOptions_BlockSA(PC pc, AinsworthOptionItems PetscOptionsObject)
{
  PC_BlockSA               *sa;
  AinsworthHierarchyOptions o;
  PetscInt                  precision, unknowns;
  PetscBool                 given;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  o         = sa->options;
  precision = o.single;
  unknowns  = o.nodesOfRank * 6;
  PetscOptionsHeadBegin(PetscOptionsObject, "Block smoothed aggregation options");
  PetscCall(PetscOptionsReal("-pc_blocksa_threshold", "Nodes with |A_ij|_F^2 > threshold^2 |A_ii|_F |A_jj|_F share aggregates", "PCBLOCKSA", o.threshold,
                             &o.threshold, NULL));
  PetscCheck(o.threshold >= 0.0 && o.threshold < 1.0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_blocksa_threshold must be at least 0 and less than 1, not %g", (double)o.threshold);
  PetscCall(
    PetscOptionsInt("-pc_blocksa_coarse_eq_limit", "A level with at most so many unknowns is factored", "PCBLOCKSA", o.coarseSize, &o.coarseSize, NULL));
  PetscCheck(o.coarseSize > 0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "-pc_blocksa_coarse_eq_limit must be positive, not %" PetscInt_FMT,
             o.coarseSize);
  PetscCall(
    PetscOptionsInt("-pc_blocksa_process_eq_limit", "Levels with fewer unknowns a process go to fewer processes", "PCBLOCKSA", unknowns, &unknowns, NULL));
  PetscCheck(unknowns >= 0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "-pc_blocksa_process_eq_limit must not be negative, not %" PetscInt_FMT,
             unknowns);
  o.nodesOfRank = unknowns / 6;
  PetscCall(
    PetscOptionsEList("-pc_blocksa_precision", "Of the finest level in the cycle", "PCBLOCKSA", precisions, 2, precisions[precision], &precision, &given));
  o.single = (PetscBool)(precision == 1);
  if (given) sa->given = PETSC_TRUE;
  PetscOptionsHeadEnd();
  if (o.threshold != sa->options.threshold || o.coarseSize != sa->options.coarseSize || o.nodesOfRank != sa->options.nodesOfRank ||
      o.single != sa->options.single)
    sa->stale = PETSC_TRUE;
  sa->options = o;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCView_BlockSA(PC pc, PetscViewer viewer)
{
  PC_BlockSA *sa;
  PetscBool   ascii;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerASCIIPrintf(viewer, "    block smoothed aggregation, threshold %g\n", (double)sa->options.threshold));
  if (!sa->levels.hierarchy) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "    not set up yet\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  const AinsworthHierarchy &h = *sa->levels.hierarchy;
  PetscCall(
    PetscViewerASCIIPrintf(viewer, "    modes: %s%s\n", h.modes,
                           h.rotations ? "" : "; rigid-body modes (MatSetNearNullSpace(), PCSetCoordinates()) would be 2 to 5 times faster on slender bodies"));
  if (h.unfit)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "    left out: %" PetscInt_FMT " modes that the matrix does not take to zero: are these the coordinates of its nodes?\n", h.unfit));
  PetscCall(PetscViewerASCIIPrintf(viewer, "    finest level in %s precision%s; operator complexity %.3g\n", h.single() ? "single" : "double",
                                   sa->options.single && !h.single() ? ", as its values jump too far or it is the only one" : "", (double)h.complexity()));
  for (const AinsworthGrid &grid : h.grids)
    PetscCall(PetscViewerASCIIPrintf(viewer, "    level: %" PetscInt_FMT " unknowns, blocks of %" PetscInt_FMT ", %.1f of them a row, on %d ranks\n",
                                     grid.nodes->N * grid.bs, grid.bs, grid.nodes->N ? (double)grid.blocks / (double)grid.nodes->N : 0.0, (int)grid.ranks));
  if (h.doubts[0]) PetscCall(PetscViewerASCIIPrintf(viewer, "    in doubt: %s\n", h.doubts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCReset_BlockSA(PC pc)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  PetscCall((*sa->reset)(pc));
  for (Mat &op : sa->op) PetscCall(MatDestroy(&op));
  for (Mat &P : sa->P) PetscCall(MatDestroy(&P));
  sa->op.clear();
  sa->P.clear();
  PetscCall(MatDestroy(&sa->product));
  sa->smoother.clear();
  sa->levels = AinsworthLevels();
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_BlockSA(PC pc)
{
  PC_BlockSA *sa;
  PetscErrorCode (*destroy)(PC);

  PetscFunctionBegin;
  PetscCall(PCReset_BlockSA(pc));
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  destroy = sa->destroy;
  delete sa;
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, "PCSetCoordinates_C", NULL));
  PetscCall((*destroy)(pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   PCBLOCKSA - multigrid by block smoothed aggregation, for symmetric (Hermitian) positive definite matrices with several unknowns a node

   Options Database Keys:
+  -pc_blocksa_threshold <0.03>          - nodes with |A_ij|_F^2 > threshold^2 |A_ii|_F |A_jj|_F share aggregates
.  -pc_blocksa_coarse_eq_limit <600>     - a level with at most so many unknowns is factored
.  -pc_blocksa_process_eq_limit <900>    - levels with fewer unknowns a process go to fewer processes
.  -pc_blocksa_precision <single,double> - of the finest level in the cycle; by default single where the `KSP` bears with it
.  -pc_mg_cycle_type <w,v>               - by default W where the operator complexity is at most 1.5
.  -mg_levels_*                          - the smoothers: two steps of Chebyshev's iteration with Jacobi
-  -mg_coarse_*                          - the coarsest level, by default factored

   Level: intermediate

   Notes:
   It is a `PCMG`, whose functions and options work on it. The matrix is of any type that `MatConvert()` brings to `MATAIJ`; its block size is the number
   of unknowns a node.

   The near null space is taken from the matrix (`MatSetNearNullSpace()`, for elasticity `MatNullSpaceCreateRigidBody()`), else made from
   `PCSetCoordinates()`, else it is one constant per component, which takes 2 to 5 times as long on slender bodies.

   Where the matrix is a `MATCOMPOSITE` of two that are added, interpolation is made from the first alone, and the operators are those of the sum:
   M_l = A_l + P' (M - A) P. As long as A does not change its levels are kept. `PCAINSWORTH` passes A and the surface part of its
   preconditioning matrix in this way, as aggregates must not grow across a surface that bodies slip along.

   The finest level works in single precision, scaled so that neither the units of the matrix nor those of the right-hand side matter, unless
   the diagonal jumps by more than 1e8 between neighbors, and where the `KSP` is known to bear with it: `KSPCG`, `KSPPROJECTEDCG`, `KSPFCG`, `KSPPIPEFCG`,
   `KSPFGMRES`, `KSPGCR`, `KSPRICHARDSON`. For any other, as `KSPGMRES` and `KSPPIPECG`, whose residuals would differ from those of x from seven digits on,
   and inside other preconditioners, the levels are made anew in double at the first application. `-pc_blocksa_precision` has the last word.

   References:
   P. Vanek, J. Mandel, M. Brezina, Algebraic multigrid by smoothed aggregation for second and fourth order elliptic problems, Computing 56 (1996), 179-196.

.seealso: `PCMG`, `PCGAMG`, `PCAINSWORTH`, `KSPCHEBYSHEVSINGLE`, `MatSetNearNullSpace()`, `PCSetCoordinates()`
M*/
PetscErrorCode PCCreate_BlockSA(PC pc)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  /* as PCGAMG does, this is a PCMG with some functions of its own */
  PetscCall(PCSetType(pc, PCMG));
  PetscCall(PetscObjectChangeTypeName((PetscObject)pc, PCBLOCKSA));
  sa                            = new PC_BlockSA();
  ((PC_MG *)pc->data)->innerctx = sa;
  ((PC_MG *)pc->data)->view     = PCView_BlockSA;
  sa->options.threshold         = 0.03;
  sa->options.coarseSize        = 600;
  sa->options.levels            = PETSC_MG_MAXLEVELS;
  sa->options.nodesOfRank       = 150;
  sa->options.single            = PETSC_TRUE;
  sa->setup                     = pc->ops->setup;
  sa->apply                     = pc->ops->apply;
  sa->reset                     = pc->ops->reset;
  sa->destroy                   = pc->ops->destroy;
  sa->setfromoptions            = pc->ops->setfromoptions;
  pc->ops->setup                = AinsworthGuarded<PCSetUp_BlockSA>;
  pc->ops->apply                = AinsworthGuarded<PCApply_BlockSA>;
  pc->ops->applytranspose       = AinsworthGuarded<PCApplyTranspose_BlockSA>;
  pc->ops->matapply             = NULL;
  pc->ops->presolve             = PCPreSolve_BlockSA;
  pc->ops->postsolve            = PCPostSolve_BlockSA;
  pc->ops->reset                = PCReset_BlockSA;
  pc->ops->destroy              = PCDestroy_BlockSA;
  pc->ops->setfromoptions       = PCSetFromOptions_BlockSA;
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, "PCSetCoordinates_C", PCSetCoordinates_BlockSA));
  PetscFunctionReturn(PETSC_SUCCESS);
}
