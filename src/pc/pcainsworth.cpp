#include "pcainsworth.h"
#include "../guard.h"
#include "../multigrid/blocksa.h"
#include <petsc/private/pcimpl.h>

static PetscErrorCode PCReset_Ainsworth(PC pc)
{
  PC_Ainsworth   *data = (PC_Ainsworth *)pc->data;
  PC              inner;
  PC_BlockSA     *sa = NULL;
  AinsworthLevels levels;

  PetscFunctionBegin;
  /* keep the levels of A: a program that changes the number of its constraints has to reset its KSP */
  PetscCall(AinsworthReportDestroy(&data->report));
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  if (sa) levels = sa->levels;
  PetscCall(PCAinsworthResetKSP_Private(data));
  if (sa) sa->levels = levels;
  PetscCall(AinsworthSaddleReset(&data->saddle));
  PetscCall(VecDestroy(&data->terms));
  PetscCall(MatDestroy(&data->reduced));
  PetscCall(MatDestroy(&data->M));
  for (Vec *v : {&data->rhs, &data->Ax, &data->g, &data->lambda, &data->f, &data->inverseDiagonal}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_Ainsworth(PC pc)
{
  PC_Ainsworth *data = (PC_Ainsworth *)pc->data;

  PetscFunctionBegin;
  PetscCall(PCReset_Ainsworth(pc));
  PetscCall(PCAinsworthComposeFields_Private(pc, PETSC_FALSE));
  PetscCall(VecDestroy(&data->userWeight));
  PetscCall(VecDestroy(&data->reporting.reference));
  PetscCall(PetscViewerDestroy(&data->reporting.viewer));
  PetscCall(PetscFree(data->reporting.monitor));
  PetscCall(PetscFree(data->reporting.file));
  PetscCall(KSPDestroy(&data->ksp));
  delete data;
  pc->data = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   PCAINSWORTH - solves a saddle-point system [A C'; C 0], or [A B'; C -D], as a reduced one, symmetric positive definite where the system allows it

   Options Database Keys:
+  -pc_ainsworth_variant <weighted,paper>                - sets weight, penalty, factor, row scaling and the inner `KSPType` at once
.  -pc_ainsworth_weight <diagonal,identity>              - W
.  -pc_ainsworth_penalty <row,norm>                      - B: per row, or the paper's beta
.  -pc_ainsworth_penalty_factor <0.5>                    - gamma, by default 2 with id (10 with BoomerAMG) and 5 with norm
.  -pc_ainsworth_pmat <auto,jcb,id,cc,cg,bj_cc,bj_cg>    - Inv(S) in the preconditioning matrix
.  -pc_ainsworth_pmat_rtol <0.1>                         - tolerance of cg and bj_cg
.  -pc_ainsworth_blocks <decide>                         - number of blocks of bj_cc and bj_cg; by default one per 32 constraints
.  -pc_ainsworth_rows_per_rank <25000>                   - the Gram matrix is gathered on ceil(m / this) ranks
.  -pc_ainsworth_multiplier_fields <names or numbers>    - the fields of the multipliers
.  -pc_fieldsplit_<i>_fields <components>                - components of each node that are field i, as for `PCFIELDSPLIT`
.  -pc_fieldsplit_block_size <bs>                        - components of a node, where the matrix does not say
.  -pc_ainsworth_detect_saddle_point <bool>              - multipliers are found by the diagonal or by signs; by default where no fields are known
.  -pc_ainsworth_block_size <bs>                         - unknowns of a node, where it is not found
.  -pc_ainsworth_redundant <drop,error>                  - rows of C that are combinations of other rows
.  -pc_ainsworth_rebuild <auto,always,never>             - when the inner preconditioner is made anew for other values of A or C
.  -pc_ainsworth_diagnose [file.json]                    - prints what set-up finds and what is wrong with it, before anything is solved
.  -pc_ainsworth_monitor_error [ascii,csv:file,draw]     - error against run time, one row per iteration
.  -pc_ainsworth_reference <file>                        - exact solution, for the monitor
.  -pc_ainsworth_stop <residual,energy_error>            - what ends the reduced solve
.  -pc_ainsworth_error_rtol <1e-6>                       - tolerance of energy_error
-  -pc_ainsworth_error_eigenvalue <estimated>            - lower bound of the spectrum, for the upper bound of the error

   Level: beginner

   Notes:
   The fields are those of a `MATNEST`, of any number, those given by `PCFieldSplitSetIS()` or `PCFieldSplitSetFields()`, as for `PCFIELDSPLIT`, or those of
   the DM; without any, rows without a positive diagonal entry are those of the multipliers, or, of [A -B'; B D], signs tell. The multipliers are the fields whose diagonal blocks are absent,
   zero or negative. Of blocks C and C' one may be absent or a transpose view. Blocks come from Amat, M_* is made of the primal block of Pmat. The block
   size of A is found where it was forgotten. docs/layouts.md says how. The program's matrices are never changed. Use it with `-ksp_type preonly`.

   The block of the multipliers, -D, may be any sparse matrix, D positive semidefinite as a rule: the springs of compliant contact, of a perturbed Lagrangian
   or a stabilization. The reduced operator, its Gram matrix and M_* have D in series with the constraints, whether it is 1e-300 or 1e300 (docs/method.md, the
   normal form). The block beside A need not be the adjoint of C: for [A B'; C -D], as for a non-symmetric A, GMRES takes the place of conjugate gradients
   where the options do not choose. Rows and columns that determine one unknown alone, inactive constraints and Dirichlet rows with columns left in place,
   move to the right-hand side.

   Rows of C that are linear combinations of others are looked for only if the Gram matrix S = C W C' cannot be factored, or if its solves have a relative
   error of more than 1.5e-8, which is found out with one solve. A row counts as dependent if an elimination leaves at most 1e-12 of it, in the norm of W,
   or 1e-5 where that is not enough to solve with S; then W = I is tried first, which may tell apart what diag(A)^{-1} cannot. Of a set of dependent rows it is not
   defined which are left out. Their multipliers are zero: of all lambda that solve the system this is a basic one, not that of smallest norm. x and
   C' lambda do not depend on the choice. Each right-hand side is checked against these rows, C_i x = g_i to 1e-8 of |C_i| |x| + |g_i|; if it contradicts
   them the failure is `PC_INCONSISTENT_RHS`. With `-pc_ainsworth_redundant error` the set-up stops with `PETSC_ERR_MAT_CH_ZRPVT` and names the rows.

   A row of the error monitor has seconds of the set-up that the solve needed and of the solve so far, without those of the monitor; the natural norm of the
   residual; relative residuals of the two blocks of the original system; lower and upper bound of the error in the energy norm of the reduced operator,
   from the coefficients of conjugate gradients; the true error where a reference is known; the upper bound over the energy norm of x.
   docs/report.md has the formulas. Tolerances refer to x, not to x - R g: PETSc's convergence test in the natural norm is told so by this `PC`. With
   `-pc_ainsworth_stop energy_error` the relative tolerance of the inner `KSP` is not heeded; the estimate is a few iterations late, so that the error is
   smaller than asked for. It rests on the smallest Ritz value: an eigenvalue that is far below the others, as inclusions of high contrast may leave, is known
   only when the rest has converged, and before that the error may be several times larger than estimated. `-pc_ainsworth_error_eigenvalue` makes a bound of it.

   Options of the inner solvers have the prefixes `-ainsworth_` (reduced system, operator `MATAINSWORTH`, preconditioning matrix M_*:
   `-ainsworth_ksp_rtol`, `-ainsworth_pc_type`, ...) and `-ainsworth_gram_` (Gram matrix C W C'), after the prefix of this `PC`.
   Where the options do not say otherwise, the inner preconditioner is `PCBLOCKSA` where nodes have 2 to 5 unknowns, A is symmetric and the method one of
   conjugate gradients. Its levels are made from A alone and kept while A has the same values, also over `PCReset()`; what happens when it has
   others says `-pc_ainsworth_rebuild` (docs/sequence.md). Otherwise, and where it does not fit
   the matrix, it is BoomerAMG with PMIS coarsening, aggressive on the finest level, ext+i interpolation of at most 4 entries per row, and Chebyshev
   smoothing; with the penalty of the paper Falgout coarsening, and with it or another method than conjugate gradients PETSc's default smoother and
   no aggressive coarsening. Where the rest of a solve would take longer than a factorization that fits in memory, this takes its place, and keeps it for the
   solves that follow; tiny systems are factored at once. The choice is made by predicted iterations and operations (docs/models.md).

   Whatever the inner tolerance, C x = g holds to rounding. An inner solve that says to have converged is verified on the rows of the program's own matrix,
   and refined once where they are not met. What is not met then, an inner solve that fails, a Gram matrix that cannot be factored, a right-hand side that
   contradicts a zero or a dependent row of C and values that are not finite give a `PCFailedReason`, known to all ranks, or an error with
   `-ksp_error_if_not_converged`. `PCAinsworthGetFailure()` and `-ksp_view` say why, naming rows.

   Set-up is repeated for what changed only: a `KSPSolve()` with the same A and C builds nothing, even after `KSPSetOperators()`. With
   `-ksp_reuse_preconditioner` the inner preconditioner is kept where A has the sizes that it had, but never the constraints. Where values changed but
   not the nonzero pattern of C, the symbolic product and factorisation of the Gram matrix and the places of its rows are kept.

   The program may lay its rows out over the ranks as it likes, but set-up is fastest where its partition knows of the constraints: that of the graph
   of A + C'C rather than of A, so that unknowns that a row of C ties together tend to share a rank.

   A near null space is taken from A (`MatSetNearNullSpace()`) or from the index set of its field (key "nearnullspace"), or is that of the rigid-body modes
   of the coordinates of its nodes (`PCSetCoordinates()`, a DM); a null space likewise (`MatSetNullSpace()`, key "nullspace") or, its primal part, from the
   whole matrix.

   The entries of A and C are needed: a block that does not give them, `MATSHELL` for instance, is found by products where it has at most 1000 columns, and
   refused otherwise.

   References:
   V. Robert, P. Jolivet, O. Jamond, M. A. Badri, Calcul haute performance pour les problemes de point-selle en mecanique du contact, CSMA;
   M. Ainsworth, Comput. Methods Appl. Mech. Engrg. 190 (2001), 6323-6339.

.seealso: `PCAinsworthGetErrorEstimate()`, `PCAinsworthGetKSP()`, `MATAINSWORTH`, `KSPPROJECTEDCG`, `PCBLOCKSA`, `PCFIELDSPLIT`
M*/
PetscErrorCode PCCreate_Ainsworth(PC pc)
{
  PC_Ainsworth *data;
  const char   *prefix;
  PetscInt      level;

  PetscFunctionBegin;
  data                       = new PC_Ainsworth();
  pc->data                   = (void *)data;
  data->choices.rowsPerRank  = 25000; /* docs/gram.md */
  data->choices.pmat.type    = PC_AINSWORTH_PMAT_AUTO;
  data->choices.pmat.rtol    = 0.1; /* paper, Table 1 */
  data->choices.pmat.blocks  = PETSC_DECIDE;
  data->reporting.rtol       = 1e-6;
  data->reporting.eigenvalue = PETSC_DEFAULT;
  PCAinsworthChoicesApplyVariant_Private(&data->choices, PC_AINSWORTH_WEIGHTED);
  PetscCall(PCAinsworthForgetCounts_Private(data));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)pc), &data->ksp));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(KSPSetOptionsPrefix(data->ksp, prefix));
  PetscCall(KSPAppendOptionsPrefix(data->ksp, "ainsworth_"));
  PetscCall(PetscObjectIncrementTabLevel((PetscObject)data->ksp, (PetscObject)pc, 1));
  PetscCall(PCGetKSPNestLevel(pc, &level));
  PetscCall(KSPSetNestLevel(data->ksp, level));
  PetscCall(KSPSetTolerances(data->ksp, 1e-8, 0.0, PETSC_DEFAULT, PETSC_DEFAULT)); /* paper, section 4.1; no atol: small right-hand sides are solved, too */
  PetscCall(KSPSetType(data->ksp, KSPPROJECTEDCG));

  PetscCall(PCAinsworthComposeFields_Private(pc, PETSC_TRUE));

  pc->ops->setup          = AinsworthGuarded<PCSetUp_Ainsworth>;
  pc->ops->apply          = AinsworthGuarded<PCApply_Ainsworth>;
  pc->ops->applytranspose = AinsworthGuarded<PCApplyTranspose_Ainsworth>;
  pc->ops->matapply       = AinsworthGuarded<PCMatApply_Ainsworth>;
  pc->ops->setuponblocks  = AinsworthGuarded<PCSetUpOnBlocks_Ainsworth>;
  pc->ops->presolve       = PCPreSolve_Ainsworth;
  pc->ops->postsolve      = PCPostSolve_Ainsworth;
  pc->ops->reset          = PCReset_Ainsworth;
  pc->ops->destroy        = PCDestroy_Ainsworth;
  pc->ops->setfromoptions = AinsworthGuarded<PCSetFromOptions_Ainsworth>;
  pc->ops->view           = AinsworthGuarded<PCView_Ainsworth>;
  PetscFunctionReturn(PETSC_SUCCESS);
}
