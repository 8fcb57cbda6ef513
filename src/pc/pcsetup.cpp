#include "pcainsworth.h"
#include "../objects.h"
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

/* Data shared by the steps of one set-up */
struct SetUpRun {
  PetscLogDouble start;
  PetscBool      keep; /* the inner preconditioner may be kept */
  Mat_Ainsworth *ctx;  /* of the reduced operator; NULL without constraints */
  PCFailedReason reason;
  PetscErrorCode code;
  char           why[512]; /* why it cannot go on; empty if it can */
};
typedef PetscErrorCode (*SetUpStep)(PC, PC_Ainsworth *, SetUpRun *);

/* Creates data->reduced with its projector; for the same A, B, C and D with other values, keeps what depends on their patterns alone */
static PetscErrorCode CreateOperator(PC pc, PC_Ainsworth *data, Mat_Ainsworth **ctx)
{
  const AinsworthSaddle *sp  = &data->saddle;
  Mat_Ainsworth         *old = NULL;
  const char            *prefix;

  PetscFunctionBegin;
  if (data->reduced) PetscCall(MatAinsworthGetContext_Private(data->reduced, &old));
  if (!old || old->A != sp->A || old->C != sp->C || old->B != sp->B || old->D != sp->D || old->adjoint != data->adjoint) {
    PetscCall(MatDestroy(&data->reduced));
    PetscCall(MatAinsworthCreate_Private(sp->A, sp->C, &data->reduced));
    PetscCall(MatSetBlockSize(data->reduced, sp->bs));
    PetscCall(MatAinsworthSetOtherBlocks_Private(data->reduced, sp->B == sp->C ? NULL : sp->B, sp->D, data->adjoint));
    PetscCall(PCGetOptionsPrefix(pc, &prefix));
    PetscCall(MatSetOptionsPrefix(data->reduced, prefix));
    PetscCall(PetscObjectIncrementTabLevel((PetscObject)data->reduced, (PetscObject)pc, 0));
  }
  PetscCall(MatAinsworthSetRowsPerRank_Private(data->reduced, data->choices.rowsPerRank));
  if (data->choices.weightType == MAT_AINSWORTH_WEIGHT_USER) {
    PetscCheck(data->userWeight, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONGSTATE,
               "-pc_ainsworth_weight user needs a vector: call PCAinsworthSetWeight()");
    PetscCall(MatAinsworthSetWeight(data->reduced, data->userWeight));
  } else PetscCall(MatAinsworthSetWeightType(data->reduced, data->hidden ? MAT_AINSWORTH_WEIGHT_IDENTITY : data->choices.weightType));
  PetscCall(MatAinsworthSetUpProjector_Private(data->reduced, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes rows of C that depend on others, or nearly so, from the constraints, or raises an error */
static PetscErrorCode DropDependentRows(PC pc, PC_Ainsworth *data, AinsworthRowKind kind, PetscInt n, const PetscInt dependent[])
{
  char names[128];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleDropDependent(&data->saddle, n, dependent, kind));
  PetscCall(AinsworthSaddleNameKind(&data->saddle, kind, names, sizeof(names)));
  PetscCheck(data->choices.redundant != AINSWORTH_REDUNDANT_ERROR, PetscObjectComm((PetscObject)pc), PETSC_ERR_MAT_CH_ZRPVT,
             "%" PetscInt_FMT " rows of C are linear combinations of others: rows %s of the multiplier field; remove them or use -pc_ainsworth_redundant drop",
             n, names);
  PetscCall(PetscInfo(pc, "%" PetscInt_FMT " rows of C are linear combinations of others and left out: rows %s of the multiplier field\n", n, names));
  data->constraints -= n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets up the reduced operator without dependent rows of C, which are looked for only if the Gram matrix is suspicious

   If it has too few digits to tell rows apart that do not depend on each other, or cannot be factored, the whole system is. If that cannot be, such rows are left
   out, and have to be met to rounding
*/
static PetscErrorCode SetUpOperator(PC pc, PC_Ainsworth *data, Mat_Ainsworth **ctx, PCFailedReason *reason)
{
  PetscInt  pass = 0, n   = 1;
  PetscBool hidden, whole = PETSC_FALSE;

  PetscFunctionBegin;
  data->hidden = PETSC_FALSE;
  while (n && data->constraints) {
    PetscInt      *dependent;
    PetscErrorCode error = PETSC_SUCCESS; /* checked after PetscFree() */

    PetscCall(CreateOperator(pc, data, ctx));
    PetscCall(MatAinsworthDiagnose_Private(data->reduced, &pass, &n, &dependent, reason, &hidden));
    hidden = (PetscBool)(hidden && data->choices.weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL);
    if (hidden) {
      PetscCall(PetscInfo(pc, "Rows of C that diag(A)^{-1} cannot tell apart are independent without it: the weight is the identity\n"));
      data->hidden = PETSC_TRUE;
    } else if (n ? pass > 1 : *reason != PC_NOERROR)
      PetscCall(PCAinsworthClimb_Private(pc, data, AINSWORTH_END_GRAM, "The Gram matrix C W C' is nearly singular", &whole));
    if (whole) n = 0;
    else if (n && !hidden) error = DropDependentRows(pc, data, pass > 1 ? AINSWORTH_ROW_NEAR : AINSWORTH_ROW_DEPENDENT, n, dependent);
    PetscCall(PetscFree(dependent));
    PetscCall(error);
  }
  if (whole) *reason = PC_NOERROR;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Discards the inner solver, its operator, and their vectors */
static PetscErrorCode ForgetInner(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(VecDestroy(&data->rhs));
  PetscCall(VecDestroy(&data->Ax));
  PetscCall(MatDestroy(&data->reduced));
  PetscCall(PCAinsworthResetKSP_Private(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Discards the inner solver if the local size of A changed on any rank; collective */
static PetscErrorCode ForgetOtherSizes(PC pc, PC_Ainsworth *data)
{
  PetscInt  before, now;
  PetscBool other;

  PetscFunctionBegin;
  if (!data->rhs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(data->rhs, &before));
  PetscCall(MatGetLocalSize(data->saddle.A, &now, NULL));
  other = (PetscBool)(before != now);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &other, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)pc)));
  if (other) PetscCall(ForgetInner(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates vectors for the kept rows, if not all rows are constraints or some unknowns are known */
static PetscErrorCode CreateKeptVectors(PC pc, PC_Ainsworth *data)
{
  char text[256];

  PetscFunctionBegin;
  if (data->saddle.C == data->saddle.rowsC && !data->saddle.known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSaddleDescribeRows(&data->saddle, text, sizeof(text)));
  PetscCall(PetscInfo(pc, "%" PetscInt_FMT " constraints%s\n", data->constraints, text));
  PetscCall(MatCreateVecs(data->saddle.C, NULL, &data->g));
  PetscCall(VecDuplicate(data->g, &data->lambda));
  if (data->saddle.known || data->saddle.B != data->saddle.C) PetscCall(MatCreateVecs(data->saddle.A, NULL, &data->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Copies A, for the inner solver without constraints, if the program's does not store its diagonal or does not know its block size; to AIJ if the block size is
   part of the type
*/
static PetscErrorCode CompleteA(PC_Ainsworth *data)
{
  PetscInt  bs;
  PetscBool aij;
  Mat       A = data->saddle.A, copy;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)A, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  if (aij) PetscCall(AinsworthStoreDiagonal(&data->saddle.A));
  A = data->saddle.A;
  PetscCall(MatGetBlockSize(A, &bs));
  if (bs == data->saddle.bs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(A, &copy));
  if (copy == A) {
    PetscCall(MatDuplicate(A, MAT_COPY_VALUES, &data->saddle.A));
    PetscCall(MatDestroy(&copy));
  } else data->saddle.A = copy;
  PetscCall(MatSetBlockSize(data->saddle.A, data->saddle.bs));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether anything changed since the last set-up */
static PetscErrorCode IsNeeded(PC pc, PC_Ainsworth *data, PetscBool *needed)
{
  PetscFunctionBegin;
  *needed = PETSC_TRUE;
  PetscCall(PCAinsworthUpdateInputs_Private(pc, data));
  if (data->saddle.A && !data->stale) PetscCall(AinsworthSaddleChanged(&data->inputs, &data->saddle, needed));
  if (data->keptForProgram && !pc->reusepreconditioner) *needed = PETSC_TRUE;
  data->unchanged = (PetscBool)(!*needed);
  if (*needed) PetscFunctionReturn(PETSC_SUCCESS);
  if (data->applied) PetscCall(AinsworthPCSetFailedReason(pc, PC_NOERROR)); /* a KSP would take that of the last solve for one of this set-up */
  PetscCall(PetscInfo(pc, "Neither A nor C changed: nothing is rebuilt\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Discards what the last set-up made and this one cannot use */
static PetscErrorCode ForgetLast(PC, PC_Ainsworth *data, SetUpRun *run)
{
  PetscFunctionBegin;
  run->keep = (PetscBool)(!data->stale && !data->unfinished);
  if (data->stale) PetscCall(MatDestroy(&data->reduced)); /* it does not match the choices */
  data->stale = PETSC_TRUE;                               /* until everything is done: an error may end it anywhere */
  if (data->unfinished) PetscCall(ForgetInner(data));     /* after an error in its set-up a PC of PETSc is unusable, and vectors may be locked */
  data->unfinished = PETSC_TRUE;
  data->applied = data->refused = PETSC_FALSE;
  data->failure[0]              = 0;
  PetscCall(AinsworthReportDestroy(&data->report));
  PetscCall(PCAinsworthForgetWhole_Private(data));
  PetscCall(MatDestroy(&data->M));
  for (Vec *v : {&data->g, &data->lambda, &data->f, &data->inverseDiagonal}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds A, B, C and D in the program's matrix, and whether they are symmetric */
static PetscErrorCode FindBlocks(PC pc, PC_Ainsworth *data, SetUpRun *run)
{
  const PetscBool symmetric = data->symmetric, adjoint = data->adjoint;
  char            text[512];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleSetUp(&data->inputs, &data->saddle));
  if (data->saddle.bad[0]) {
    run->reason = PC_FACTOR_OTHER;
    run->code   = PETSC_ERR_FP;
    PetscCall(PetscSNPrintf(run->why, sizeof(run->why), "The system cannot be solved: %s", data->saddle.bad));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleDescribeLayout(&data->saddle, text, sizeof(text)));
  PetscCall(PetscInfo(pc, "%s; block size %" PetscInt_FMT " of A: %s\n", text, data->saddle.bs, data->saddle.bsSource));
  PetscCall(MatGetSize(data->saddle.C, &data->constraints, NULL));
  PetscCall(ForgetOtherSizes(pc, data));
  PetscCall(AinsworthProbeSymmetry(data->saddle.A, &data->symmetric));
  data->adjoint = (PetscBool)(data->saddle.B == data->saddle.C);
  if (data->adjoint && data->saddle.D) PetscCall(AinsworthProbeSymmetry(data->saddle.D, &data->adjoint));
  if (data->indefinite) data->configured = PETSC_FALSE; /* conjugate gradients are tried again */
  data->indefinite = PETSC_FALSE;
  if (symmetric != data->symmetric || adjoint != data->adjoint) {
    PetscCall(MatDestroy(&data->reduced));      /* it depends on the symmetry of the system, and on B */
    data->configured = run->keep = PETSC_FALSE; /* the system may need another method */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses a system that is singular because an unknown is in no equation, or an equation has no unknown */
static PetscErrorCode CheckUnused(PC_Ainsworth *data, SetUpRun *run)
{
  char unknowns[128], equations[128];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleNameUnused(&data->saddle, data->symmetric, unknowns, equations, sizeof(unknowns)));
  run->code = PETSC_ERR_MAT_LU_ZRPVT;
  if (unknowns[0])
    PetscCall(PetscSNPrintf(run->why, sizeof(run->why),
                            "Unknowns %s of the primal field are in no equation: A and C have nothing in their columns; remove them, give them a stiffness, or "
                            "attach their motions to the matrix with MatSetNullSpace()",
                            unknowns));
  if (equations[0])
    PetscCall(PetscSNPrintf(run->why, sizeof(run->why), "Equations %s of the primal field have no unknown: their rows of A and C' are zero", equations));
  if (run->why[0]) run->reason = PC_FACTOR_STRUCT_ZEROPIVOT;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the reduced operator, if there are constraints, and the vectors */
static PetscErrorCode SetUpConstraints(PC pc, PC_Ainsworth *data, SetUpRun *run)
{
  PetscFunctionBegin;
  PetscCall(CheckUnused(data, run));
  if (run->why[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthConfigureKSP_Private(pc, data));
  if (data->constraints) PetscCall(SetUpOperator(pc, data, &run->ctx, &run->reason));
  if (run->reason) {
    run->code = PETSC_ERR_MAT_CH_ZRPVT;
    PetscCall(PetscSNPrintf(run->why, sizeof(run->why),
                            "Solves with the Gram matrix C W C' fail (%s), though no more rows of C are found to be linearly dependent",
                            PCFailedReasons[run->reason]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (run->ctx && run->ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL) PetscCall(AinsworthShare(run->ctx->weight, &data->inverseDiagonal));
  else PetscCall(AinsworthWeightCreate(data->saddle.A, &data->inverseDiagonal));
  if (!data->constraints) {
    PetscCall(PetscInfo(pc, "No constraints: the reduced system is that of A alone\n"));
    PetscCall(MatDestroy(&data->reduced));
    PetscCall(CompleteA(data));
  }
  PetscCall(CreateKeptVectors(pc, data));
  if (!data->rhs) PetscCall(MatCreateVecs(data->saddle.A, &data->Ax, &data->rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up M_* and the inner KSP, and completes the set-up */
static PetscErrorCode SetUpSolver(PC pc, PC_Ainsworth *data, SetUpRun *run)
{
  PC             inner;
  PetscLogDouble end;
  PetscBool      climbed = PETSC_FALSE;

  PetscFunctionBegin;
  if (data->whole) { /* it needs no inner solver, which the next set-up makes */
    data->stale = PETSC_FALSE;
    PetscCall(PCAinsworthAgreeOnFailure_Private(pc, PC_NOERROR));
    PetscCall(PetscTime(&end));
    data->setupSeconds += end - run->start;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (run->keep) PetscCall(PCAinsworthDecideToKeepInner_Private(pc, data, &run->keep));
  PetscCall(PCAinsworthSetUpInner_Private(pc, data, run->ctx, run->keep, run->why, sizeof(run->why)));
  PetscCall(PCAinsworthIsOld_Private(data, &data->keptForProgram));
  data->keptForProgram = (PetscBool)(data->keptForProgram && pc->reusepreconditioner);
  run->reason          = PC_SUBPC_ERROR;
  run->code            = PETSC_ERR_ARG_WRONG;
  if (run->why[0]) PetscCall(PCAinsworthClimb_Private(pc, data, AINSWORTH_END_SETUP, run->why, &climbed));
  if (climbed) run->why[0] = 0;
  if (run->why[0]) PetscFunctionReturn(PETSC_SUCCESS);
  data->stale = data->unfinished = PETSC_FALSE;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCGetFailedReason(inner, &run->reason));
  if (run->reason && !climbed) PetscCall(PCAinsworthClimb_Private(pc, data, AINSWORTH_END_SETUP, PCFailedReasons[run->reason], &climbed));
  if (climbed) run->reason = PC_NOERROR;
  PetscCall(PCAinsworthAgreeOnFailure_Private(pc, run->reason ? PC_SUBPC_ERROR : PC_NOERROR));
  if (pc->failedreason) { /* a solve would fail as well */
    char why[sizeof(run->why)];

    PetscCall(PCAinsworthExplain_Private(pc, data, NULL, KSP_DIVERGED_PC_FAILED, why, sizeof(why)));
    PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_NOT_CONVERGED, why));
  }
  PetscCall(PetscTime(&end));
  data->setupSeconds += end - run->start;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetUp(PC pc)
{
  static const SetUpStep steps[] = {ForgetLast, FindBlocks, SetUpConstraints, SetUpSolver}; /* one for each PCAinsworthStage */
  PC_Ainsworth          *data    = (PC_Ainsworth *)pc->data;
  SetUpRun               run     = {};
  PetscBool              needed;

  PetscFunctionBegin;
  PetscCall(PetscTime(&run.start));
  PetscCall(PetscCitationsRegister(citation, NULL));
  PetscCall(IsNeeded(pc, data, &needed));
  for (int stage = 0; needed && stage <= PC_AINSWORTH_STAGE_REDUCED; stage++) {
    PetscCall(steps[stage](pc, data, &run));
    if (run.why[0]) { /* discard what failed; the next set-up starts over */
      PetscCall(MatDestroy(&data->reduced));
      data->unfinished = PETSC_FALSE;
      PetscCall(PCAinsworthFail_Private(pc, data, run.reason, run.code, run.why));
      data->refused = PETSC_TRUE;
      break;
    }
    PetscCall(PCAinsworthDiagnose_Private(pc, data, (PCAinsworthStage)stage));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCSetUp_Ainsworth(PC pc)
{
  const PetscErrorCode code = SetUp(pc);

  PetscFunctionBegin;
  if (code) PetscCall(PCAinsworthDiagnoseFailure_Private(pc, (PC_Ainsworth *)pc->data, code, NULL));
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}
