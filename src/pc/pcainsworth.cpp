#include "pcainsworth.h"
#include "../operator/matainsworth.h"
#include <petsc/private/pcimpl.h>
#include <petsctime.h>

static const char citation[] = "@inproceedings{robert_pointselle,\n"
                               "  author    = {V. Robert and P. Jolivet and O. Jamond and M. A. Badri},\n"
                               "  title     = {Calcul haute performance pour les probl{\\`e}mes de point-selle en m{\\'e}canique du contact},\n"
                               "  booktitle = {Colloque National en Calcul de Structures (CSMA)}\n"
                               "}\n"
                               "@article{ainsworth2001essential,\n"
                               "  author  = {M. Ainsworth},\n"
                               "  title   = {Essential boundary conditions and multi-point constraints in finite element analysis},\n"
                               "  journal = {Computer Methods in Applied Mechanics and Engineering},\n"
                               "  volume  = {190},\n"
                               "  pages   = {6323--6339},\n"
                               "  year    = {2001}\n"
                               "}\n";

/* All ranks hear of the worst failure on any of them */
static PetscErrorCode AgreeOnFailure(PC pc, PCFailedReason reason)
{
  PetscMPIInt worst = (PetscMPIInt)reason;

  PetscFunctionBegin;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)pc)));
  PetscCall(PCSetFailedReason(pc, (PCFailedReason)worst));
#if PETSC_VERSION_LT(3, 20, 0)
  pc->failedreasonrank = (PCFailedReason)worst;
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A = A'? What the program declared, otherwise a comparison of A v with A' v for one random v */
static PetscErrorCode ProbeSymmetry(Mat A, PetscBool *symmetric)
{
  PetscBool   known, has;
  Vec         v, Av, Atv;
  PetscRandom rand;
  PetscReal   norm, difference;

  PetscFunctionBegin;
  PetscCall(PetscDefined(USE_COMPLEX) ? MatIsHermitianKnown(A, &known, symmetric) : MatIsSymmetricKnown(A, &known, symmetric));
  if (known) PetscFunctionReturn(PETSC_SUCCESS);
  *symmetric = PETSC_FALSE;
  PetscCall(MatHasOperation(A, MATOP_MULT_TRANSPOSE, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateVecs(A, &v, &Av));
  PetscCall(VecDuplicate(Av, &Atv));
  PetscCall(PetscRandomCreate(PetscObjectComm((PetscObject)A), &rand));
  PetscCall(PetscRandomSetFromOptions(rand));
  PetscCall(VecSetRandom(v, rand));
  PetscCall(PetscRandomDestroy(&rand));
  PetscCall(MatMult(A, v, Av));
  PetscCall(MatMultHermitianTranspose(A, v, Atv));
  PetscCall(VecNorm(Av, NORM_2, &norm));
  PetscCall(VecAXPY(Atv, -1.0, Av));
  PetscCall(VecNorm(Atv, NORM_2, &difference));
  *symmetric = (PetscBool)(difference <= 1e-10 * norm);
  PetscCall(PetscInfo(A, "A is %s: ||A v - A' v|| / ||A v|| = %g for a random v\n", *symmetric ? "symmetric" : "not symmetric", (double)(difference / norm)));
  PetscCall(VecDestroy(&v));
  PetscCall(VecDestroy(&Av));
  PetscCall(VecDestroy(&Atv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reduced operator and its preconditioning matrix; *reason tells whether the Gram matrix could be factored */
static PetscErrorCode SetUpConstrained(PC pc, PC_Ainsworth *data, PCFailedReason *reason)
{
  AinsworthPmatInputs  in;
  AinsworthPmatOptions options = data->pmat;
  Mat_Ainsworth       *ctx;
  Mat                  A = data->saddle.A;
  Vec                  penalty;
  PetscInt             bs;
  const char          *prefix;

  PetscFunctionBegin;
  PetscCall(MatCreateAinsworth(A, data->saddle.C, &data->S));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(MatSetOptionsPrefix(data->S, prefix));
  PetscCall(PetscObjectIncrementTabLevel((PetscObject)data->S, (PetscObject)pc, 0));
  PetscCall(MatAinsworthSetRowsPerRank(data->S, data->rowsPerRank));
  PetscCall(MatGetBlockSize(A, &bs));
  if (data->frameType == PC_AINSWORTH_FRAME_AUTO) PetscCall(AinsworthFrameChoose(data->saddle.C, bs, &data->frame));
  else data->frame.bs = 0;
  PetscCall(MatAinsworthSetFrame_Private(data->S, &data->frame));
  if (data->weightType == MAT_AINSWORTH_WEIGHT_USER) {
    PetscCheck(data->weight, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONGSTATE,
               "-pc_ainsworth_weight user needs a vector: call PCAinsworthSetWeight()");
    PetscCall(MatAinsworthSetWeight(data->S, data->weight));
  } else PetscCall(MatAinsworthSetWeightType(data->S, data->weightType));
  PetscCall(MatAinsworthSetUp(data->S, &ctx));
  PetscCall(AinsworthGramGetFailedReason(&ctx->proj.gram, reason));
  if (*reason) PetscFunctionReturn(PETSC_SUCCESS);

  PetscCall(AinsworthGetAIJ(data->saddle.A, &A));
  in.A              = A;
  in.C              = data->saddle.C;
  in.S              = ctx->proj.gram.S;
  in.weight         = ctx->weight;
  in.frame          = &data->frame;
  options.symmetric = data->symmetric;
  options.factor    = PCAinsworthPenaltyFactor(data);
  PetscCall(AinsworthPmatCreate(&in, &options, &penalty, &data->M));
  PetscCall(MatDestroy(&A));
  PetscCall(MatAinsworthSetPenalty(data->S, penalty));
  PetscCall(VecDestroy(&penalty));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Null space, near null space: hypre reads them from the operator, GAMG from the preconditioning matrix */
static PetscErrorCode ForwardNullSpaces(PC_Ainsworth *data)
{
  MatNullSpace near, common, rotated;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleGetNearNullSpace(&data->saddle, &near));
  if (near) {
    PetscCall(AinsworthFrameRotateNullSpace(&data->frame, data->saddle.A, near, &rotated));
    PetscCall(MatSetNearNullSpace(data->S, rotated));
    PetscCall(MatSetNearNullSpace(data->M, rotated));
    PetscCall(MatNullSpaceDestroy(&rotated));
  }
  PetscCall(AinsworthSaddleCreateNullSpace(&data->saddle, &common));
  if (common) {
    PetscCall(AinsworthFrameRotateNullSpace(&data->frame, data->saddle.A, common, &rotated));
    PetscCall(MatSetNullSpace(data->S, rotated));
    PetscCall(MatSetNullSpace(data->M, rotated));
    if (data->symmetric) PetscCall(MatSetTransposeNullSpace(data->S, rotated));
    PetscCall(MatNullSpaceDestroy(&rotated));
    PetscCall(MatNullSpaceDestroy(&common));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCReset_Ainsworth(PC pc)
{
  PC_Ainsworth *data = (PC_Ainsworth *)pc->data;

  PetscFunctionBegin;
  PetscCall(PCAinsworthReportReset(data));
  PetscCall(KSPReset(data->ksp));
  PetscCall(AinsworthSaddleReset(&data->saddle));
  PetscCall(MatDestroy(&data->S));
  PetscCall(MatDestroy(&data->M));
  PetscCall(VecDestroy(&data->rhs));
  PetscCall(VecDestroy(&data->residual));
  PetscCall(VecDestroy(&data->g));
  PetscCall(VecDestroy(&data->lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetUp_Ainsworth(PC pc)
{
  PC_Ainsworth  *data     = (PC_Ainsworth *)pc->data;
  PetscBool      changedA = PETSC_TRUE, changedC = PETSC_TRUE;
  PCFailedReason reason = PC_NOERROR;
  PC             inner;
  PetscLogDouble start, end;

  PetscFunctionBegin;
  PetscCall(PetscTime(&start));
  PetscCall(PetscCitationsRegister(citation, NULL));
  if (data->saddle.A && !data->stale) PetscCall(AinsworthSaddleChanged(pc->pmat, &data->saddle, &changedA, &changedC));
  if (!changedA && !changedC) {
    PetscCall(PetscInfo(pc, "Neither A nor C changed: nothing is rebuilt\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PCAinsworthReportReset(data));
  PetscCall(MatDestroy(&data->S));
  PetscCall(MatDestroy(&data->M));
  PetscCall(VecDestroy(&data->residual));
  PetscCall(VecDestroy(&data->g));
  PetscCall(VecDestroy(&data->lambda));
  PetscCall(AinsworthSaddleSetUp(pc->pmat, &data->saddle));
  PetscCall(MatGetSize(data->saddle.C, &data->constraints, NULL));
  PetscCall(ProbeSymmetry(data->saddle.A, &data->symmetric));
  if (data->constraints) {
    PetscCall(SetUpConstrained(pc, data, &reason));
    if (reason) {
      PetscCheck(!pc->erroriffailure, PetscObjectComm((PetscObject)pc), PETSC_ERR_MAT_CH_ZRPVT,
                 "The Gram matrix C W C' could not be factored (%s): are rows of C linearly dependent?", PCFailedReasons[reason]);
      PetscCall(PetscInfo(pc, "The Gram matrix C W C' could not be factored (%s): are rows of C linearly dependent?\n", PCFailedReasons[reason]));
      PetscCall(AgreeOnFailure(pc, reason));
      data->stale = PETSC_TRUE;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    PetscCall(ForwardNullSpaces(data));
    PetscCall(MatCreateVecs(data->saddle.C, NULL, &data->residual));
    if (data->saddle.kept) {
      PetscCall(PetscInfo(pc, "%" PetscInt_FMT " rows of C are zero and left out\n", data->saddle.zeroRows));
      PetscCall(VecDuplicate(data->residual, &data->g));
      PetscCall(VecDuplicate(data->residual, &data->lambda));
    }
    PetscCall(KSPSetOperators(data->ksp, data->S, data->M));
  } else {
    PetscCall(PetscInfo(pc, "No constraints: the reduced system is that of A alone\n"));
    PetscCall(KSPSetOperators(data->ksp, data->saddle.A, data->saddle.A));
  }
  if (!data->rhs) PetscCall(MatCreateVecs(data->saddle.A, NULL, &data->rhs));
  PetscCall(PCAinsworthConfigureKSP(pc, data));
  PetscCall(KSPSetUp(data->ksp));
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCGetFailedReason(inner, &reason));
  PetscCall(AgreeOnFailure(pc, reason ? PC_SUBPC_ERROR : PC_NOERROR));
  data->stale = PETSC_FALSE;
  PetscCall(PetscTime(&end));
  data->setupSeconds += end - start;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x += R (g - C x): C x = g to rounding, whatever the inner tolerance */
static PetscErrorCode ProjectOntoConstraints(PC_Ainsworth *data, Vec g, Vec x)
{
  PetscFunctionBegin;
  PetscCall(MatMult(data->saddle.C, x, data->residual));
  PetscCall(VecAYPX(data->residual, -1.0, g));
  PetscCall(MatAinsworthMultRightInverse(data->S, data->residual, data->rhs));
  PetscCall(AinsworthFrameRotate(&data->frame, PETSC_TRUE, data->rhs));
  PetscCall(VecAXPY(x, 1.0, data->rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* g on the kept rows; a nonzero g on a dropped row has no solution */
static PetscErrorCode RestrictToKeptRows(PC pc, PC_Ainsworth *data, Vec all, PetscBool *consistent)
{
  Vec       sub;
  PetscReal normAll, normKept;

  PetscFunctionBegin;
  PetscCall(VecGetSubVector(all, data->saddle.kept, &sub));
  PetscCall(VecCopy(sub, data->g));
  PetscCall(VecRestoreSubVector(all, data->saddle.kept, &sub));
  PetscCall(VecNorm(all, NORM_1, &normAll));
  PetscCall(VecNorm(data->g, NORM_1, &normKept));
  *consistent = (PetscBool)(normAll - normKept <= 100 * PETSC_MACHINE_EPSILON * normAll);
  if (!*consistent)
    PetscCall(PetscInfo(pc, "The right-hand side is %g (1-norm) on rows of C that are zero: no solution exists\n", (double)(normAll - normKept)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reduced solve between f, g and x, lambda, all on kept rows; transpose: with the transpose of A */
static PetscErrorCode SolveReduced(PC pc, PC_Ainsworth *data, PetscBool transpose, Vec f, Vec g, Vec x, Vec lambda, PetscBool *failed)
{
  KSPConvergedReason reason;

  PetscFunctionBegin;
  if (!transpose) PetscCall(PCAinsworthReportBegin(pc, data, f, g));
  if (data->constraints) PetscCall(MatAinsworthComputeRHS_Private(data->S, transpose, f, g, data->rhs));
  else PetscCall(VecCopy(f, data->rhs));
  if (transpose) PetscCall(KSPSolveTranspose(data->ksp, data->rhs, x));
  else PetscCall(KSPSolve(data->ksp, data->rhs, x));
  if (!transpose) PetscCall(PCAinsworthReportEnd(data));
  PetscCall(KSPCheckSolve(data->ksp, pc, x));
  PetscCall(KSPGetConvergedReason(data->ksp, &reason));
  *failed = (PetscBool)(reason < 0); /* at the limit of iterations too, when an outer Krylov method may still use what there is */
  if (data->constraints) {
    PetscCall(AinsworthFrameRotate(&data->frame, PETSC_TRUE, x));
    PetscCall(ProjectOntoConstraints(data, g, x));
    PetscCall(MatAinsworthComputeMultiplier_Private(data->S, transpose, f, x, lambda));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ApplyOrTranspose(PC pc, PetscBool transpose, Vec b, Vec y)
{
  PC_Ainsworth *data     = (PC_Ainsworth *)pc->data;
  const IS     *in       = transpose ? data->saddle.cols : data->saddle.rows;
  const IS     *out      = transpose ? data->saddle.rows : data->saddle.cols;
  PetscBool     changedA = PETSC_FALSE, changedC = PETSC_FALSE, consistent = PETSC_TRUE, failed;
  Vec           f, g, x, lambda;

  PetscFunctionBegin;
  /* PCSetUp() looks at the state of the MatNest, which does not tell of a block changed in place */
  if (!pc->reusepreconditioner) PetscCall(AinsworthSaddleChanged(pc->pmat, &data->saddle, &changedA, &changedC));
  if (changedA || changedC) PetscCall(PCSetUp_Ainsworth(pc));
  if (data->stale) { /* the set-up failed */
    PetscCall(VecFlag(y, 1));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetSubVector(b, in[0], &f));
  PetscCall(VecGetSubVector(b, in[1], &g));
  PetscCall(VecGetSubVector(y, out[0], &x));
  PetscCall(VecGetSubVector(y, out[1], &lambda));
  if (data->saddle.kept) {
    Vec sub;

    PetscCall(RestrictToKeptRows(pc, data, g, &consistent));
    PetscCheck(consistent || !pc->erroriffailure, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_INCOMP,
               "The right-hand side of the constraints is nonzero on a row of C that is zero: no solution exists; remove the row or its right-hand side");
    PetscCall(SolveReduced(pc, data, transpose, f, data->g, x, data->lambda, &failed));
    PetscCall(VecZeroEntries(lambda));
    PetscCall(VecGetSubVector(lambda, data->saddle.kept, &sub));
    PetscCall(VecCopy(data->lambda, sub));
    PetscCall(VecRestoreSubVector(lambda, data->saddle.kept, &sub));
  } else PetscCall(SolveReduced(pc, data, transpose, f, g, x, lambda, &failed));
  PetscCall(VecRestoreSubVector(b, in[0], &f));
  PetscCall(VecRestoreSubVector(b, in[1], &g));
  PetscCall(VecRestoreSubVector(y, out[0], &x));
  PetscCall(VecRestoreSubVector(y, out[1], &lambda));
  PetscCall(AgreeOnFailure(pc, !consistent ? PC_INCONSISTENT_RHS : (failed ? PC_SUBPC_ERROR : PC_NOERROR)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCApply_Ainsworth(PC pc, Vec b, Vec y)
{
  PetscFunctionBegin;
  PetscCall(ApplyOrTranspose(pc, PETSC_FALSE, b, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCApplyTranspose_Ainsworth(PC pc, Vec b, Vec y)
{
  PC_Ainsworth *data = (PC_Ainsworth *)pc->data;

  PetscFunctionBegin;
#if defined(PETSC_USE_COMPLEX)
  Vec conjugate;

  PetscCheck(data->symmetric, PetscObjectComm((PetscObject)pc), PETSC_ERR_SUP, "The transpose of PCAINSWORTH needs a Hermitian A in complex arithmetic");
  PetscCall(VecDuplicate(b, &conjugate));
  PetscCall(VecCopy(b, conjugate));
  PetscCall(VecConjugate(conjugate));
  PetscCall(ApplyOrTranspose(pc, PETSC_FALSE, conjugate, y));
  PetscCall(VecConjugate(y));
  PetscCall(VecDestroy(&conjugate));
#else
  PetscCall(ApplyOrTranspose(pc, (PetscBool)!data->symmetric, b, y)); /* [A C'; C 0] is symmetric when A is */
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_Ainsworth(PC pc)
{
  PC_Ainsworth *data = (PC_Ainsworth *)pc->data;

  PetscFunctionBegin;
  PetscCall(PCReset_Ainsworth(pc));
  PetscCall(VecDestroy(&data->weight));
  PetscCall(VecDestroy(&data->reporting.reference));
  PetscCall(PetscViewerDestroy(&data->reporting.viewer));
  PetscCall(KSPDestroy(&data->ksp));
  PetscCall(PetscFree(pc->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   PCAINSWORTH - solves a saddle-point system [A C'; C 0] with few constraints as a reduced symmetric positive definite one

   Options Database Keys:
+  -pc_ainsworth_variant <weighted,paper>                - sets weight, penalty, factor, row scaling and the inner `KSPType` at once
.  -pc_ainsworth_weight <diagonal,identity>              - W
.  -pc_ainsworth_penalty <row,norm>                      - B: per row, or the paper's beta
.  -pc_ainsworth_penalty_factor <0.5 (row), 5 (norm)>      - gamma
.  -pc_ainsworth_pmat <jcb,id,cc,cg,bj_cc,bj_cg>         - Inv(S) in the preconditioning matrix
.  -pc_ainsworth_pmat_rtol <0.1>                         - tolerance of cg and bj_cg
.  -pc_ainsworth_pmat_max_rows <4000>                    - refuse cc and cg, which may be dense, above this number of constraints
.  -pc_ainsworth_blocks <decide>                         - number of blocks of bj_cc and bj_cg; by default one per 32 constraints
.  -pc_ainsworth_row_scaling <true,false>                - jcb does not depend on the scale of the rows of C
.  -pc_ainsworth_frame <auto,none>                       - turn the components into the frame of the dominant contact normal
.  -pc_ainsworth_rows_per_rank <100000>                  - the Gram matrix is gathered on ceil(m / this) ranks
.  -pc_ainsworth_monitor_error [ascii,csv:file,draw]     - error against run time, one row per iteration
.  -pc_ainsworth_monitor_error_residuals <true,false>    - with the residuals of the original system
.  -pc_ainsworth_reference <file>                        - exact solution, for the monitor
.  -pc_ainsworth_stop <residual,energy_error>            - what ends the reduced solve
.  -pc_ainsworth_error_rtol <1e-6>                       - tolerance of energy_error
-  -pc_ainsworth_error_eigenvalue <estimated>            - lower bound of the spectrum, for the upper bound of the error

   Level: beginner

   Notes:
   The matrix is a `MATNEST` of 2 x 2 blocks. The multipliers are the field whose diagonal block is absent or zero, first or last; of
   C and C' one may be absent or a transpose view. The program's matrices are never changed. Use it with `-ksp_type preonly`.

   Options of the inner solvers have the prefixes `-ainsworth_` (reduced system, operator `MATAINSWORTH`, preconditioning matrix M_*:
   `-ainsworth_ksp_rtol`, `-ainsworth_pc_type`, ...) and `-ainsworth_gram_` (Gram matrix C W C'), after the prefix of this `PC`.
   The inner preconditioner is BoomerAMG with HMIS coarsening (Falgout with the penalty of the paper), ext+i interpolation and at most 4 entries per row of the
   interpolation where the options do not say otherwise.

   Whatever the inner tolerance, C x = g holds to rounding. An inner solve that fails, a Gram matrix that cannot be factored and a
   right-hand side that contradicts a zero row of C give a `PCFailedReason`, known to all ranks, or an error with
   `-ksp_error_if_not_converged`.

   Set-up is repeated for what changed only: a `KSPSolve()` with the same A and C builds nothing, even after `KSPSetOperators()`.

   A near null space is taken from A (`MatSetNearNullSpace()`) or from the index set of its field (key "nearnullspace").

   References:
   V. Robert, P. Jolivet, O. Jamond, M. A. Badri, Calcul haute performance pour les problemes de point-selle en mecanique du contact, CSMA;
   M. Ainsworth, Comput. Methods Appl. Mech. Engrg. 190 (2001), 6323-6339.

.seealso: `PCAinsworthSetVariant()`, `PCAinsworthSetPmatType()`, `PCAinsworthGetKSP()`, `MATAINSWORTH`, `KSPPROJECTEDCG`, `PCFIELDSPLIT`
M*/
PetscErrorCode PCCreate_Ainsworth(PC pc)
{
  PC_Ainsworth *data;
  const char   *prefix;
  PetscInt      level;

  PetscFunctionBegin;
  PetscCall(PetscNew(&data));
  pc->data                   = (void *)data;
  data->rowsPerRank          = 100000; /* paper, section 5.2 */
  data->pmat.type            = PC_AINSWORTH_PMAT_JCB;
  data->pmat.rtol            = 0.1; /* paper, Table 1 */
  data->pmat.blocks          = PETSC_DECIDE;
  data->pmat.maxRows         = 4000;
  data->reporting.residuals  = PETSC_TRUE;
  data->reporting.rtol       = 1e-6;
  data->reporting.eigenvalue = PETSC_DEFAULT;
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)pc), &data->ksp));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(KSPSetOptionsPrefix(data->ksp, prefix));
  PetscCall(KSPAppendOptionsPrefix(data->ksp, "ainsworth_"));
  PetscCall(KSPSetErrorIfNotConverged(data->ksp, pc->erroriffailure));
  PetscCall(PetscObjectIncrementTabLevel((PetscObject)data->ksp, (PetscObject)pc, 1));
  PetscCall(PCGetKSPNestLevel(pc, &level));
  PetscCall(KSPSetNestLevel(data->ksp, level));
  PetscCall(KSPSetTolerances(data->ksp, 1e-8, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT)); /* paper, section 4.1 */
  PetscCall(PCAinsworthApplyVariant(data, PC_AINSWORTH_WEIGHTED));

  pc->ops->setup          = PCSetUp_Ainsworth;
  pc->ops->apply          = PCApply_Ainsworth;
  pc->ops->applytranspose = PCApplyTranspose_Ainsworth;
  pc->ops->reset          = PCReset_Ainsworth;
  pc->ops->destroy        = PCDestroy_Ainsworth;
  pc->ops->setfromoptions = PCSetFromOptions_Ainsworth;
  pc->ops->view           = PCView_Ainsworth;
  PetscFunctionReturn(PETSC_SUCCESS);
}
