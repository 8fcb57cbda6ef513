#include "blocksaimpl.h"
#include "../base/guard.h"
#include "../base/layouts.h"
#include "../base/objects.h"

static const char *const smoothers[]  = {"decide", "jacobi", "incomplete", "Smoother", "", NULL};
static const char *const precisions[] = {"double", "single", "Precision", "", NULL};

PetscErrorCode PCBlockSAGet_Private(PC pc, PC_BlockSA **sa)
{
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCBLOCKSA, &same));
  *sa = same ? BlockSA(pc) : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCBlockSAHasFactor_Private - checks whether an incomplete factor smooths the finest level, as it was set up last */
PetscErrorCode PCBlockSAHasFactor_Private(const PC_BlockSA *sa, PetscBool *has)
{
  AinsworthLevel *level = NULL;

  PetscFunctionBegin;
  *has = PETSC_FALSE;
  if (sa->op.size() > 1) PetscCall(AinsworthLevelMatGet(sa->op[0], &level));
  *has = (PetscBool)(level && level->factored());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCBlockSACountOthers_Private - gets the number of local unknowns that the levels have beside the n of A; 0 without
   levels
*/
PetscErrorCode PCBlockSACountOthers_Private(PC pc, PetscInt n, PetscInt *others)
{
  PC_BlockSA *sa = NULL;

  PetscFunctionBegin;
  *others = 0;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  if (sa && sa->levels.hierarchy) *others = sa->levels.hierarchy->finest.nodes->n * sa->levels.hierarchy->finest.bs - n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Destroys the vectors that the cycle is applied to, which are for one number of unknowns */
static PetscErrorCode DestroyWork(PC_BlockSA *sa)
{
  PetscFunctionBegin;
  for (Vec *v : {&sa->mapped[0], &sa->mapped[1], &sa->sorted[0], &sa->sorted[1]}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Makes the cycle of a PCBLOCKSA stay in a subspace from the next set-up on, or (NULL) no longer: the matrix added to A
   then acts on the coarser levels alone

   extended: AIJ, A for the unknowns of the levels, first those of A and then others on each rank, which A couples to
   nothing; NULL: A itself
*/
PetscErrorCode PCBlockSASetSubspace_Private(PC pc, const std::shared_ptr<const AinsworthSubspace> &subspace,
                                            Mat extended)
{
  PC_BlockSA *sa = NULL;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  if (!sa) PetscFunctionReturn(PETSC_SUCCESS);
  /* a map may have another number of unknowns */
  if ((sa->subspace ? sa->subspace->map : NULL) != (subspace ? subspace->map : NULL)) PetscCall(DestroyWork(sa));
  sa->subspace = subspace;
  PetscCall(AinsworthReplace(extended, &sa->extended));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets the precision before set-up, for a caller that knows the method and whether the matrix may be nearly singular

   *single: the levels will be in single precision; never for a PC of another type
*/
PetscErrorCode PCBlockSAExpect_Private(PC pc, KSP ksp, PetscBool singular, PetscBool *single)
{
  PC_BlockSA *sa = NULL;
  PetscBool   tolerates;

  PetscFunctionBegin;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  *single = (PetscBool)(sa && sa->options.single);
  if (!sa || sa->given) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCBlockSATolerates_Private(ksp, &tolerates));
  /* levels in double precision are kept until A changes */
  *single = sa->options.single = (PetscBool)(tolerates && !singular);
  if (!*single) PetscCall(PCBlockSAUseDouble_Private(pc, !tolerates));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetCoordinates_BlockSA(PC pc, PetscInt dim, PetscInt n, PetscReal *coordinates)
{
  PC_BlockSA *sa = BlockSA(pc);

  PetscFunctionBegin;
  sa->dim = dim;
  sa->coordinates.assign(coordinates, coordinates + (size_t)n * dim);
  sa->stale = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetFromOptions_BlockSA(PC pc, AinsworthOptionItems PetscOptionsObject)
{
  PC_BlockSA               *sa = BlockSA(pc);
  AinsworthHierarchyOptions o;
  PetscInt                  precision;
  PetscBool                 given;
  MPI_Comm                  comm = PetscObjectComm((PetscObject)pc);

  PetscFunctionBegin;
  o         = sa->options;
  precision = o.single;
  PetscOptionsHeadBegin(PetscOptionsObject, "Block smoothed aggregation options");
  PetscCall(PetscOptionsReal("-pc_blocksa_threshold",
                             "Nodes with |A_ij|_F^2 > threshold^2 |A_ii|_F |A_jj|_F share aggregates", "PCBLOCKSA",
                             o.threshold, &o.threshold, NULL));
  PetscCheck(o.threshold >= 0.0 && o.threshold < 1.0, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_blocksa_threshold must be at least 0 and less than 1, not %g", (double)o.threshold);
  PetscCall(PetscOptionsInt("-pc_blocksa_coarse_eq_limit", "A level with at most so many unknowns is factored",
                            "PCBLOCKSA", o.coarseSize, &o.coarseSize, NULL));
  PetscCheck(o.coarseSize > 0, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_blocksa_coarse_eq_limit must be positive, not %" PetscInt_FMT, o.coarseSize);
  PetscCall(PetscOptionsInt("-pc_blocksa_process_eq_limit",
                            "Levels with fewer unknowns a process go to fewer processes", "PCBLOCKSA", o.rankSize,
                            &o.rankSize, NULL));
  PetscCheck(o.rankSize >= PETSC_DECIDE, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_blocksa_process_eq_limit must not be negative, not %" PetscInt_FMT, o.rankSize);
  PetscCall(AinsworthMachineSetFromOptions((PetscObject)pc, PetscOptionsObject, "-pc_blocksa_rate",
                                           "-pc_blocksa_message", &o.machine));
  PetscCall(PetscOptionsEList("-pc_blocksa_precision", "Of the levels in the cycle", "PCBLOCKSA", precisions, 2,
                              precisions[precision], &precision, &given));
  PetscCall(PetscOptionsEList("-pc_blocksa_smoother", "What smooths the finest level in single precision", "PCBLOCKSA",
                              smoothers, 3, smoothers[o.smoother], &o.smoother, NULL));
  PetscOptionsHeadEnd();
  o.single = (PetscBool)(precision == 1);
  if (given) sa->given = PETSC_TRUE;
  if (o.threshold != sa->options.threshold || o.coarseSize != sa->options.coarseSize ||
      o.rankSize != sa->options.rankSize || !(o.machine == sa->options.machine) || o.single != sa->options.single ||
      o.smoother != sa->options.smoother)
    sa->stale = PETSC_TRUE;
  sa->options = o;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCView_BlockSA(PC pc, PetscViewer viewer)
{
  PC_BlockSA *sa = BlockSA(pc);
  VecType     type;
  PetscBool   ascii, host, factor;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(
    PetscViewerASCIIPrintf(viewer, "    block smoothed aggregation, threshold %g\n", (double)sa->options.threshold));
  if (!sa->grids) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "    not set up yet\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  const AinsworthHierarchy &h = *sa->levels.hierarchy;
  PetscCall(AinsworthVecsOnHost(pc->pmat, &host));
  PetscCall(MatGetVecType(pc->pmat, &type));
  if (!host)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "    on the host: a cycle copies one vector of type %s from the device, and one to it\n", type));
  if (sa->old)
    PetscCall(PetscViewerASCIIPrintf(viewer, "    coarser levels of an earlier matrix, but for what is added to it\n"));
  PetscCall(PetscViewerASCIIPrintf(viewer, "    modes: %s%s\n", h.modes.origin,
                                   h.modes.rotations ? ""
                                                     : "; rigid-body modes (MatSetNearNullSpace(), PCSetCoordinates()) "
                                                       "would be 2 to 5 times faster on slender bodies"));
  if (h.modes.unfit)
    PetscCall(
      PetscViewerASCIIPrintf(viewer,
                             "    left out: %" PetscInt_FMT
                             " modes that the matrix does not take to zero: are these the coordinates of its nodes?\n",
                             h.modes.unfit));
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "    levels in %s precision%s; operator complexity %.3g\n", h.single() ? "single" : "double",
    sa->options.single && !h.single() ? ", as values jump too far or there is only one, or for an earlier solve" : "",
    (double)AinsworthComplexity(*sa->grids)));
  PetscCall(PCBlockSAHasFactor_Private(sa, &factor));
  if (h.finest.incomplete && h.single())
    PetscCall(PetscViewerASCIIPrintf(viewer, "    an incomplete Cholesky factor %s\n",
                                     factor ? "smooths the finest level"
                                            : "is given up: there is none, or its largest eigenvalue is too large"));
  if (h.condition > 0.0)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "    condition number of Jacobi that coarse functions leave: at least %.3g\n", (double)h.condition));
  if (sa->subspace)
    PetscCall(PetscViewerASCIIPrintf(
      viewer,
      "    in the kernel of constraints, with %d unknowns carried, those of %d nodes to all levels, and %d rows kept "
      "there\n",
      (int)sa->subspace->carried.unknowns.size(), (int)h.carriedToAll, (int)sa->subspace->rows.size()));
  if (h.sorted)
    PetscCall(PetscViewerASCIIPrintf(viewer, "    unknowns sorted by nodes, which the pattern of the matrix shows\n"));
  for (const AinsworthGrid &grid : *sa->grids) PetscCall(AinsworthGridView(grid, viewer));
  if (h.doubts[0]) PetscCall(PetscViewerASCIIPrintf(viewer, "    in doubt: %s\n", h.doubts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCReset_BlockSA(PC pc)
{
  PC_BlockSA *sa = BlockSA(pc);

  PetscFunctionBegin;
  PetscCall((*sa->mg->reset)(pc));
  for (Mat &op : sa->op) PetscCall(MatDestroy(&op));
  sa->op.clear();
  PetscCall(MatDestroy(&sa->product));
  PetscCall(DestroyWork(sa));
  sa->cycle = AinsworthCycle();
  PetscCall(MatDestroy(&sa->extended));
  sa->levels = AinsworthLevels();
  sa->grids.reset();
  sa->subspace.reset();
  sa->old = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_BlockSA(PC pc)
{
  PC_BlockSA *sa = BlockSA(pc);
  PetscErrorCode (*destroy)(PC);

  PetscFunctionBegin;
  PetscCall(PCReset_BlockSA(pc));
  destroy = sa->mg->destroy;
  delete sa->mg;
  delete sa;
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, "PCSetCoordinates_C", NULL));
  PetscCall((*destroy)(pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   PCBLOCKSA - multigrid by block smoothed aggregation, for symmetric (Hermitian) positive definite matrices with
   several unknowns per node

   Options Database Keys:
+  -pc_blocksa_threshold <0.03>          - aggregates consist of nodes with |A_ij|_F^2 > threshold^2 |A_ii|_F |A_jj|_F
.  -pc_blocksa_coarse_eq_limit <600>     - a level with at most this many unknowns is factored
.  -pc_blocksa_process_eq_limit <decide> - a level with fewer unknowns per process moves to fewer processes; by
                                           default to as many as a cycle is predicted to be quickest with
.  -pc_blocksa_rate <8e8>                - entries of a matrix that a process multiplies in a second, for that
.  -pc_blocksa_message <2e-6>            - seconds that a message takes, for that
.  -pc_blocksa_precision <single,double> - precision of the levels; by default single if the `KSP` tolerates it
.  -pc_blocksa_smoother <decide>         - what smooths the finest level in single precision: jacobi, incomplete (an
                                           incomplete Cholesky factor by blocks, Jacobi where that does not exist),
                                           or decide by the condition number of Jacobi
.  -pc_mg_cycle_type <w,v>               - cycle; by default V if the first coarser level has more than 0.65 times
                                           the entries of A, W if that is predicted to take at most a tenth longer
                                           than two visits of all coarser levels, and otherwise these
.  -mg_levels_*                          - the smoothers; by default two steps of Chebyshev with Jacobi
-  -mg_coarse_*                          - the solver of the coarsest level; by default direct

   Level: intermediate

   Notes:
   This is a `PCMG`, with its functions and options. The matrix may have any type that `MatConvert()` can convert to
   `MATAIJ`. Its block size is the number of unknowns per node. If the block size is 1, but the pattern shows nodes
   whose unknowns are not next to each other (numbered component by component, or in any other order on the same
   process), the cycle works on a sorted copy.

   Attach the near null space to the matrix with `MatSetNearNullSpace()`; for elasticity use
   `MatNullSpaceCreateRigidBody()`. If there is none, it is made from `PCSetCoordinates()`. Without coordinates it is
   one constant per component. Slender bodies then take 2 to 5 times as long.

   If the matrix is a `MATCOMPOSITE` that adds two matrices A and D, aggregates and interpolation to the finest level
   are made from A alone, and are kept until A changes. The operators of the levels, and interpolation between the
   coarser ones, are those of the sum. `PCAINSWORTH` passes A and the surface part of its preconditioning matrix this
   way, because aggregates must not cross a surface on which bodies slip.

   All levels but the coarsest are in single precision. They are scaled, so the units of the matrix and of the
   right-hand side do not matter. Residuals after a coarse correction are computed in double precision, because coarser
   levels amplify their rounding by the condition number of the matrix. All is in double precision if the diagonal of
   the matrix jumps by more than 1e8 between neighbors, or if the `KSP` is not known to tolerate single precision.
   `KSPCG`, `KSPPROJECTEDCG`, `KSPFCG`, `KSPPIPEFCG`, `KSPFGMRES`, `KSPGCR`, and `KSPRICHARDSON` tolerate it. In
   others, such as `KSPGMRES` and `KSPPIPECG`, the recursive residual and the true one would agree to seven digits only.
   For these, and inside other preconditioners, the first application rebuilds the levels in double precision. The
   option `-pc_blocksa_precision` overrides this rule.

   Two visits of a level, as in a W-cycle, are two steps of Chebyshev's iteration with the cycle from that level on as
   the preconditioner, for eigenvalues between 0.5 and 1.

   With some systems Jacobi needs many iterations: stretched elements, frames. It is judged by the condition number of
   D^{-1} A in the complement of the modes of the aggregates, which a few Lanczos steps estimate (compatible
   relaxation). Above 25 an incomplete Cholesky factor of the blocks of each process takes its place on the finest
   level, if all its pivots are positive definite. In double precision there is none.

   Errors:
   `PETSC_ERR_ARG_OUTOFRANGE` for an option value out of range. docs/troubleshooting.md explains the other messages.

   References:
   P. Vanek, J. Mandel, M. Brezina, Algebraic multigrid by smoothed aggregation for second and fourth order elliptic
   problems, Computing 56 (1996), 179-196.
   A. Brandt, General highly accurate algebraic coarsening, Electron. Trans. Numer. Anal. 10 (2000), 1-20.
   O. Axelsson, P. S. Vassilevski, Algebraic multilevel preconditioning methods II, SIAM J. Numer. Anal. 27 (1990),
   1569-1590.

.seealso: `PCMG`, `PCGAMG`, `PCAINSWORTH`, `KSPCHEBYSHEVSINGLE`, `MatSetNearNullSpace()`, `PCSetCoordinates()`
M*/
PetscErrorCode PCCreate_BlockSA(PC pc)
{
  PC_BlockSA *sa;

  PetscFunctionBegin;
  /* like PCGAMG, this is a PCMG with some operations replaced */
  PetscCall(PCSetType(pc, PCMG));
  PetscCall(PetscObjectChangeTypeName((PetscObject)pc, PCBLOCKSA));
  sa                            = new PC_BlockSA();
  ((PC_MG *)pc->data)->innerctx = sa;
  ((PC_MG *)pc->data)->view     = PCView_BlockSA;
  sa->options.threshold         = 0.03;
  sa->options.coarseSize        = 600;
  sa->options.single            = PETSC_TRUE;
  sa->mg                        = new _PCOps(*pc->ops);
  pc->ops->setup                = AinsworthGuarded<PCSetUp_BlockSA>;
  pc->ops->apply                = AinsworthGuarded<PCApply_BlockSA>;
  pc->ops->applytranspose       = AinsworthGuarded<PCApplyTranspose_BlockSA>;
  pc->ops->matapply             = NULL;
  pc->ops->applyrichardson      = NULL;
  pc->ops->presolve             = PCPreSolve_BlockSA;
  pc->ops->postsolve            = PCPostSolve_BlockSA;
  pc->ops->reset                = PCReset_BlockSA;
  pc->ops->destroy              = PCDestroy_BlockSA;
  pc->ops->setfromoptions       = PCSetFromOptions_BlockSA;
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, "PCSetCoordinates_C", PCSetCoordinates_BlockSA));
  PetscFunctionReturn(PETSC_SUCCESS);
}
