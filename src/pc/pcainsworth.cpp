#include "pcainsworth.h"
#include "../base/guard.h"
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
  PetscCall(AinsworthReportDestroy(&data->reporting.report));
  PetscCall(AinsworthSolverGetInnerPC(data, &inner));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  if (sa) levels = sa->levels;
  PetscCall(AinsworthSolverForgetOperators(&data->inner));
  PetscCall(AinsworthSolverResetKSP(data));
  if (sa) sa->levels = levels;
  data->saddle.reset();
  PetscCall(VecDestroy(&data->outcome.terms));
  data->reduced.reset();
  data->inner.M.reset();
  data->inner.order.reset();
  PetscCall(PCAinsworthForgetWhole_Private(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_Ainsworth(PC pc)
{
  PC_Ainsworth *data = (PC_Ainsworth *)pc->data;

  PetscFunctionBegin;
  PetscCall(PCReset_Ainsworth(pc));
  PetscCall(PCAinsworthComposeFields_Private(pc, PETSC_FALSE));
  PetscCall(VecDestroy(&data->choices.weight));
  PetscCall(VecDestroy(&data->settings.reference));
  PetscCall(PetscViewerDestroy(&data->settings.viewer));
  PetscCall(PetscFree(data->settings.monitor));
  PetscCall(PetscFree(data->settings.file));
  PetscCall(KSPDestroy(&data->inner.ksp));
  delete data;
  pc->data = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   PCAINSWORTH - solves a saddle-point system [A C'; C 0], or [A B'; C -D], as a reduced system, which is symmetric
   positive definite if the blocks allow it

   Options Database Keys:
+  -pc_ainsworth_variant <weighted,paper>                - sets weight, penalty, penalty factor, row scaling and inner
                                                           `KSPType` together
.  -pc_ainsworth_weight <diagonal,identity>              - W, the diagonal weight of the projector
.  -pc_ainsworth_penalty <row,norm>                      - B, the diagonal penalty: per row, or the paper's beta
.  -pc_ainsworth_penalty_factor <chosen>                 - gamma, the factor of the penalty; by default 5 with norm;
                                                           otherwise 2 with id (10 with BoomerAMG, 1e4 with a
                                                           factorization), 0.5 with others
.  -pc_ainsworth_pmat <auto,jcb,id,cc,cg,bj_cc,bj_cg>    - Inv(S), the approximate inverse of the Gram matrix in the
                                                           preconditioning matrix
.  -pc_ainsworth_pmat_rtol <0.1>                         - tolerance of cg and bj_cg
.  -pc_ainsworth_blocks <decide>                         - number of blocks of bj_cc and bj_cg; by default one per 32
                                                           constraints
.  -pc_ainsworth_gram <auto,factor,polynomial>           - solves with the Gram matrix by a factor, or without one
.  -pc_ainsworth_rate <8e8>                              - entries of a matrix that a process multiplies in a second
.  -pc_ainsworth_message <2e-6>                          - seconds that a message takes; both for auto
.  -pc_ainsworth_rows_per_rank <25000>                   - the Gram matrix is gathered on ceil(m / this) ranks
.  -pc_ainsworth_multiplier_fields <names or numbers>    - the fields of the multipliers
.  -pc_ainsworth_multiplier_rows <rows or file>          - the rows of the multipliers in one matrix, from 0 on: 5,8-12
                                                           are 5 and 8 to 11; or a file with an `IS`
.  -pc_fieldsplit_<i>_fields <components>                - components of each node that form field i, as for
                                                           `PCFIELDSPLIT`
.  -pc_fieldsplit_block_size <bs>                        - components per node, if the matrix does not say
.  -pc_ainsworth_detect_saddle_point <bool>              - finds the multipliers by the diagonal or by signs; the
                                                           default if no fields are known
.  -pc_ainsworth_block_size <bs>                         - unknowns per node, if the number is not found
.  -pc_ainsworth_redundant <drop,error>                  - treatment of rows of C that are combinations of other rows
.  -pc_ainsworth_ladder <multigrid,factor,gmres,whole>   - the highest rung that may be climbed where the reduced solve
                                                           gives no answer; by default whole
.  -pc_ainsworth_rebuild <auto,always,never>             - when the inner preconditioner is rebuilt for new values of A
                                                           or C
.  -pc_ainsworth_diagnose [file.json]                    - prints the findings of the set-up, and advice, before
                                                           anything is solved
.  -pc_ainsworth_monitor_error [ascii,csv:file,draw]     - prints error against run time, one row per iteration
.  -pc_ainsworth_reference <file>                        - exact solution for the monitor, a `Vec` in PETSc's binary
                                                           format
.  -pc_ainsworth_stop <residual,energy_error>            - criterion that ends the reduced solve
.  -pc_ainsworth_error_rtol <1e-6>                       - tolerance of energy_error, relative to the energy norm of x
-  -pc_ainsworth_error_eigenvalue <estimated>            - lower bound of the spectrum, for the upper bound of the error

   Level: beginner

   Notes:
   Use it with `-ksp_type preonly`: it is a complete solver. The program's matrices are never changed.

   Layout. The fields are those of a `MATNEST`, of any number, those given by `PCFieldSplitSetIS()` or
   `PCFieldSplitSetFields()`, as for `PCFIELDSPLIT`, or those of the DM. Without fields, the multipliers are the rows
   without a positive diagonal entry, or, in [A -B'; B D], are found by signs. Multiplier fields have a diagonal block
   that is absent, zero or negative. One of the blocks C and C' may be absent or a transpose view. The blocks come from
   Amat, and M_* is made from the primal block of Pmat. The block size of A is found if it is not set. docs/layouts.md
   has the rules.

   Blocks. The block of the multipliers is -D, where D may be any sparse matrix, usually positive semidefinite: the
   springs of compliant contact, of a perturbed Lagrangian or of a stabilization. D may be between 1e-300 and 1e300; the
   reduced operator, its Gram matrix and M_* have D in series with the constraints (docs/method.md, the normal form).
   The block beside A need not be the adjoint of C. For [A B'; C -D], and for a nonsymmetric A, GMRES replaces conjugate
   gradients unless options choose the method. Rows and columns that determine a single unknown move to the right-hand
   side: inactive constraints, and Dirichlet rows with columns left in place.

   Dependent rows. The set-up searches for rows of C that are combinations of others only if the Gram matrix S = C W C'
   cannot be factored, or if one test solve shows a relative error of more than 1e-3 m^{-1/2}, with m rows. A row counts
   as dependent if elimination leaves at most 1e-12 of it, in the norm of W, or 1e-5 if that is not enough to solve with
   S. In the second case W = I is tried first, which may tell rows apart that diag(A)^{-1} cannot. It is not defined
   which rows of a dependent set are left out. Their multipliers are zero: lambda is a basic solution, not that of
   smallest norm. x and C' lambda do not depend on the choice. Each right-hand side is checked on these rows, as on all
   others of C: C_i x = g_i to 1e-8 of |C_i| |x| + |g_i|, and rounding of larger terms of the system. With D it is ten
   times the tolerance. If it contradicts them, the failure is `PC_INCONSISTENT_RHS`. With `-pc_ainsworth_redundant
   error` the set-up stops with `PETSC_ERR_MAT_CH_ZRPVT` and names the rows.

   Tolerances refer to x, not to x - R g; PETSc's convergence test in the natural norm is adjusted accordingly. Whatever
   the inner tolerance, C x = g holds to rounding.

   Error monitor. A row has the seconds of the set-up that the solve needed and of the solve so far, without those of
   the monitor; the natural norm of the residual; the relative residuals of both blocks of the original system; a lower
   and an upper bound of the error in the energy norm of the reduced operator, from the coefficients of conjugate
   gradients; the true error if a reference is known; and the upper bound relative to the energy norm of x.
   docs/options.md has the formulas. With `-pc_ainsworth_stop energy_error` the relative tolerance of the inner `KSP` is
   ignored. The estimate lags a few iterations behind, so the final error is smaller than requested. It uses the
   smallest Ritz value. An eigenvalue far below the others, as inclusions of high contrast may leave, is known only when
   the rest has converged; before that, the error may be several times larger than estimated.
   `-pc_ainsworth_error_eigenvalue` makes the estimate a bound.

   Inner solvers. Their options have the prefixes `-ainsworth_` (reduced system, operator `MATAINSWORTH`,
   preconditioning matrix M_*: `-ainsworth_ksp_rtol`, `-ainsworth_pc_type`, ...), `-ainsworth_gram_` (Gram matrix C W
   C') and `-ainsworth_whole_` (the whole system, if it is factored), after the prefix of this `PC`. The default inner
   preconditioner is `PCBLOCKSA` if nodes have 2 to 5 unknowns, A is symmetric and the method is one of conjugate
   gradients, or KSPPREONLY. Its levels are made from A alone and kept while A has the same values, also after
   `PCReset()`. If A changes, `-pc_ainsworth_rebuild` decides (docs/contact.md). Otherwise, and if `PCBLOCKSA` does not
   fit the matrix, the default is BoomerAMG with PMIS coarsening, aggressive on the finest level, ext+i interpolation
   with at most 4 entries per row, and Chebyshev smoothing. With the penalty of the paper it has Falgout coarsening.
   With that penalty, or with a method other than conjugate gradients, it has PETSc's default smoother and no aggressive
   coarsening. If the rest of a solve would take longer than a factorization that fits in memory, the factorization
   takes over, also for later solves. Tiny systems are factored at once. The choice is made from predicted iterations
   and operations (docs/extremes.md).

   Outer methods. With `-ksp_type preonly` an application is the solution. With `-ainsworth_ksp_type preonly` it is one
   multigrid cycle between two projections, a linear preconditioner for any outer method; it is not judged then, as the
   outer method measures the residual.

   Several right-hand sides. `KSPMatSolve()` with `-ksp_type preonly`, and `PCMatApply()`, make up to eight inner solves
   side by side where these are conjugate gradients with `PCBLOCKSA`, and other columns one after the other. Each column
   is judged by itself (docs/modes.md).

   Failures. The solution of an inner solve is judged by the rows of the program's own matrix, and refined, by at most
   ten further solves, until all are met and x has settled; usually none is needed (docs/method.md, verification). If it
   is not met, or the inner solve fails, the whole system [A B'; C -D] is factored, and its solutions are judged in the
   same way. `-pc_ainsworth_ladder` limits this: multigrid takes no factorization of M_* in place of multigrid, factor
   no GMRES in place of conjugate gradients, gmres no factorization of the whole system. Rows that are still not met, a
   motion that nothing resists, a Gram matrix that cannot be factored, a right-hand side that contradicts a zero or a
   dependent row of C, and values that are not finite give a `PCFailedReason` on all ranks, or an error with
   `-ksp_error_if_not_converged`. `PCAinsworthGetFailure()` and `-ksp_view` name the cause and the rows.

   Repeated set-up. Only what has changed is set up again: a `KSPSolve()` with the same A and C builds nothing, even
   after `KSPSetOperators()`. With `-ksp_reuse_preconditioner` the inner preconditioner is kept as long as A has the
   same sizes, but never the constraints. If values change but not the nonzero pattern of C, the symbolic factorization
   of the Gram matrix and the places of its rows are kept.

   Distribution. The rows may be distributed over the ranks in any way. Set-up is fastest if the partition is that of
   the graph of A + C'C rather than of A, so that unknowns in the same row of C tend to be on the same rank.

   Null spaces. The near null space comes from A (`MatSetNearNullSpace()`) or from the index set of its field (key
   "nearnullspace"), or consists of the rigid-body modes of the coordinates of the nodes (`PCSetCoordinates()`, the DM
   of a field or of A). The null space comes from A (`MatSetNullSpace()`), from the index set (key "nullspace"), or, its
   primal part, from the whole matrix.

   Matrix-free blocks. The entries of A and C are needed. A block that does not give them, such as a `MATSHELL`, is
   found by products if it has at most 1000 columns, and refused otherwise.

   References:
   V. Robert, P. Jolivet, O. Jamond, M. A. Badri, Calcul haute performance pour les problemes de point-selle en
   mecanique du contact, CSMA; M. Ainsworth, Comput. Methods Appl. Mech. Engrg. 190 (2001), 6323-6339.

.seealso: `PCAinsworthGetErrorEstimate()`, `PCAinsworthGetKSP()`, `MATAINSWORTH`, `KSPPROJECTEDCG`, `PCBLOCKSA`,
`PCFIELDSPLIT`
M*/
PetscErrorCode PCCreate_Ainsworth(PC pc)
{
  PC_Ainsworth *data;
  const char   *prefix;
  PetscInt      level;

  PetscFunctionBegin;
  data                      = new PC_Ainsworth();
  pc->data                  = (void *)data;
  data->choices.pmat.type   = PC_AINSWORTH_PMAT_AUTO;
  data->choices.pmat.rtol   = 0.1; /* paper, Table 1 */
  data->choices.pmat.blocks = PETSC_DECIDE;
  data->settings.rtol       = 1e-6;
  data->settings.eigenvalue = PETSC_DEFAULT;
  PCAinsworthChoicesApplyVariant_Private(&data->choices, PC_AINSWORTH_WEIGHTED);
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)pc), &data->inner.ksp));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(KSPSetOptionsPrefix(data->inner.ksp, prefix));
  PetscCall(KSPAppendOptionsPrefix(data->inner.ksp, "ainsworth_"));
  PetscCall(PetscObjectIncrementTabLevel((PetscObject)data->inner.ksp, (PetscObject)pc, 1));
  PetscCall(PCGetKSPNestLevel(pc, &level));
  PetscCall(KSPSetNestLevel(data->inner.ksp, level));
  PetscCall(
    /* paper, section 4.1; no atol: small right-hand sides are solved, too */
    KSPSetTolerances(data->inner.ksp, 1e-8, 0.0, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(KSPSetType(data->inner.ksp, KSPPROJECTEDCG));

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
