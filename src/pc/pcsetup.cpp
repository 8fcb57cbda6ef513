#include "pcainsworth.h"
#include "../base/objects.h"
#include "../projection/matainsworth.h"
#include <petsctime.h>

static const char citation
  [] = "@inproceedings{robert_pointselle,\n"
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
  PetscLogDouble start    = 0.0;
  PetscBool      keep     = PETSC_FALSE; /* the inner preconditioner may be kept */
  PCFailedReason reason   = {};          /* PC_NOERROR if it can go on */
  PetscErrorCode code     = PETSC_SUCCESS;
  char           why[512] = {}; /* why it cannot go on */
};
typedef PetscErrorCode (*SetUpStep)(PC, PC_Ainsworth *, SetUpRun *);

/*
   Creates data->reduced.mat with its projector; for the same A, B, C and D with other values, keeps what depends on
   their patterns alone
*/
static PetscErrorCode CreateOperator(PC pc, PC_Ainsworth *data, MatAinsworthWeightType weight)
{
  const AinsworthSaddle *sp  = data->saddle.get();
  Mat_Ainsworth         *old = NULL, *ctx;
  const char            *prefix;

  PetscFunctionBegin;
  if (data->reduced.mat) PetscCall(MatAinsworthGetContext_Private(data->reduced.mat, &old));
  if (!old || old->A != sp->A || old->C != sp->kept.C || old->B != sp->kept.B || old->D != sp->kept.D ||
      old->adjoint != data->saddle->adjoint) {
    PetscCall(MatDestroy(&data->reduced.mat));
    PetscCall(MatAinsworthCreate_Private(sp->A, sp->kept.C, &data->reduced.mat));
    PetscCall(MatSetBlockSize(data->reduced.mat, sp->bs));
    PetscCall(MatAinsworthSetOtherBlocks_Private(data->reduced.mat, sp->oneSided() ? (Mat)NULL : sp->kept.B, sp->kept.D,
                                                 data->saddle->adjoint));
    PetscCall(PCGetOptionsPrefix(pc, &prefix));
    PetscCall(MatSetOptionsPrefix(data->reduced.mat, prefix));
    PetscCall(PetscObjectIncrementTabLevel((PetscObject)data->reduced.mat, (PetscObject)pc, 0));
  }
  PetscCall(MatAinsworthSetRowsPerRank_Private(data->reduced.mat, data->choices.rowsPerRank));
  if (weight == MAT_AINSWORTH_WEIGHT_USER) {
    PetscCheck(data->choices.weight, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONGSTATE,
               "-pc_ainsworth_weight user needs a vector: call PCAinsworthSetWeight()");
    PetscCall(MatAinsworthSetWeight(data->reduced.mat, data->choices.weight));
  } else PetscCall(MatAinsworthSetWeightType(data->reduced.mat, weight));
  PetscCall(MatAinsworthSetUpProjector_Private(data->reduced.mat, &ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes rows of C that depend on others, or nearly so, from the constraints, or raises an error */
static PetscErrorCode DropDependentRows(PC pc, PC_Ainsworth *data, AinsworthRowKind kind, PetscInt n,
                                        const PetscInt dependent[])
{
  char names[128];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleDropDependent(&data->saddle, n, dependent, kind));
  PetscCall(AinsworthSaddleNameKind(data->saddle.get(), kind, names, sizeof(names)));
  PetscCheck(data->choices.redundant != AINSWORTH_REDUNDANT_ERROR, PetscObjectComm((PetscObject)pc),
             PETSC_ERR_MAT_CH_ZRPVT,
             "%" PetscInt_FMT " rows of C are linear combinations of others: rows %s of the multiplier field; remove "
             "them or use -pc_ainsworth_redundant drop",
             n, names);
  PetscCall(PetscInfo(
    pc, "%" PetscInt_FMT " rows of C are linear combinations of others and left out: rows %s of the multiplier field\n",
    n, names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets up the reduced operator without dependent rows of C, which are looked for only if the Gram matrix is suspicious

   If it has too few digits to tell rows apart that do not depend on each other, or cannot be factored, the whole system
   is. If that cannot be, such rows are left out, and have to be met to rounding
*/
static PetscErrorCode SetUpOperator(PC pc, PC_Ainsworth *data, PCFailedReason *reason)
{
  MatAinsworthWeightType weight = data->choices.weightType;
  PetscInt               pass = 0, n   = 1;
  PetscBool              hidden, whole = PETSC_FALSE;

  PetscFunctionBegin;
  while (n && data->saddle->constraints()) {
    PetscInt      *dependent;
    PetscErrorCode error = PETSC_SUCCESS; /* checked after PetscFree() */

    PetscCall(CreateOperator(pc, data, weight));
    PetscCall(MatAinsworthDiagnose_Private(data->reduced.mat, &pass, &n, &dependent, reason, &hidden));
    hidden = (PetscBool)(hidden && weight == MAT_AINSWORTH_WEIGHT_DIAGONAL);
    if (hidden) {
      PetscCall(PetscInfo(
        pc, "Rows of C that diag(A)^{-1} cannot tell apart are independent without it: the weight is the identity\n"));
      weight = MAT_AINSWORTH_WEIGHT_IDENTITY;
    } else if (n ? pass > 1 : *reason != PC_NOERROR)
      PetscCall(
        PCAinsworthReplan_Private(pc, data, AINSWORTH_END_GRAM, "The Gram matrix C W C' is nearly singular", &whole));
    if (whole) n = 0;
    else if (n && !hidden)
      error = DropDependentRows(pc, data, pass > 1 ? AINSWORTH_ROW_NEAR : AINSWORTH_ROW_DEPENDENT, n, dependent);
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
  PetscCall(VecDestroy(&data->reduced.rhs));
  PetscCall(VecDestroy(&data->reduced.Ax));
  PetscCall(MatDestroy(&data->reduced.mat));
  PetscCall(AinsworthSolverResetKSP(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Discards the inner solver if the local size of A changed on any rank; collective */
static PetscErrorCode ForgetOtherSizes(PC pc, PC_Ainsworth *data)
{
  PetscInt  before, now;
  PetscBool other;

  PetscFunctionBegin;
  if (!data->reduced.rhs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(data->reduced.rhs, &before));
  PetscCall(MatGetLocalSize(data->saddle->A, &now, NULL));
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
  if (data->saddle->kept.C == data->saddle->all.C && !data->saddle->known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSaddleDescribeRows(data->saddle.get(), text, sizeof(text)));
  PetscCall(PetscInfo(pc, "%" PetscInt_FMT " constraints%s\n", data->saddle->constraints(), text));
  PetscCall(MatCreateVecs(data->saddle->kept.C, NULL, &data->reduced.g));
  PetscCall(VecDuplicate(data->reduced.g, &data->reduced.lambda));
  if (data->saddle->known || !data->saddle->oneSided())
    PetscCall(MatCreateVecs(data->saddle->A, NULL, &data->reduced.f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether anything changed since the last set-up */
static PetscErrorCode IsNeeded(PC pc, PC_Ainsworth *data, PetscBool *needed)
{
  PetscBool reuse;

  PetscFunctionBegin;
  *needed = PETSC_TRUE;
  PetscCall(PCAinsworthUpdateInputs_Private(pc, data));
  if (data->saddle && data->state >= PC_AINSWORTH_READY)
    PetscCall(AinsworthSaddleChanged(&data->given.inputs, data->saddle.get(), needed));
  PetscCall(PCGetReusePreconditioner(pc, &reuse));
  if (data->age.forProgram && !reuse) *needed = PETSC_TRUE;
  if (*needed) PetscFunctionReturn(PETSC_SUCCESS);
  data->state = PC_AINSWORTH_UNCHANGED;
  /* a KSP would take that of the last solve for one of this set-up */
  if (data->outer.applications) PetscCall(AinsworthSolverForgetFailure(pc));
  PetscCall(PetscInfo(pc, "Neither A nor C changed: nothing is rebuilt\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Discards what the last set-up made and this one cannot use */
static PetscErrorCode ForgetLast(PC, PC_Ainsworth *data, SetUpRun *run)
{
  PetscFunctionBegin;
  run->keep = (PetscBool)(data->state >= PC_AINSWORTH_READY);
  if (!run->keep) PetscCall(MatDestroy(&data->reduced.mat)); /* it does not match the choices */
  /* after an error in its set-up a PC of PETSc is unusable, and vectors may be locked */
  if (data->state == PC_AINSWORTH_NONE) PetscCall(ForgetInner(data));
  /* until everything is done: an error may end it anywhere */
  data->state              = PC_AINSWORTH_NONE;
  data->outer.applications = 0;
  data->outcome.why[0]     = 0;
  PetscCall(AinsworthReportDestroy(&data->reporting.report));
  PetscCall(PCAinsworthForgetWhole_Private(data));
  PetscCall(MatDestroy(&data->inner.M));
  for (Vec *v : {&data->reduced.g, &data->reduced.lambda, &data->reduced.f, &data->reduced.inverseDiagonal})
    PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds A, B, C and D in the program's matrix, and whether they are symmetric */
static PetscErrorCode FindBlocks(PC pc, PC_Ainsworth *data, SetUpRun *run)
{
  const bool known = data->saddle && !data->saddle->bad[0], symmetric = known && data->saddle->symmetric,
             adjoint = known && data->saddle->adjoint;
  char text[512];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleBuild(&data->given.inputs, std::move(data->saddle), &data->saddle));
  if (data->saddle->bad[0]) {
    run->reason = PC_FACTOR_OTHER;
    run->code   = PETSC_ERR_FP;
    PetscCall(PetscSNPrintf(run->why, sizeof(run->why), "The system cannot be solved: %s", data->saddle->bad));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleDescribeLayout(data->saddle.get(), text, sizeof(text)));
  PetscCall(
    PetscInfo(pc, "%s; block size %" PetscInt_FMT " of A: %s\n", text, data->saddle->bs, data->saddle->bsSource));
  PetscCall(ForgetOtherSizes(pc, data));
  data->history.gmres = AINSWORTH_UNTRIED; /* conjugate gradients are tried again */
  if (symmetric != data->saddle->symmetric || adjoint != data->saddle->adjoint) {
    PetscCall(MatDestroy(&data->reduced.mat));        /* it depends on the symmetry of the system, and on B */
    data->inner.configured = run->keep = PETSC_FALSE; /* the system may need another method */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses a system that is singular because an unknown is in no equation, or an equation has no unknown */
static PetscErrorCode CheckUnused(PC_Ainsworth *data, SetUpRun *run)
{
  char unknowns[128], equations[128];

  PetscFunctionBegin;
  PetscCall(
    AinsworthSaddleNameUnused(data->saddle.get(), data->saddle->symmetric, unknowns, equations, sizeof(unknowns)));
  run->code = PETSC_ERR_MAT_LU_ZRPVT;
  if (unknowns[0])
    PetscCall(PetscSNPrintf(run->why, sizeof(run->why),
                            "Unknowns %s of the primal field are in no equation: A and C have nothing in their "
                            "columns; remove them, give them a stiffness, or "
                            "attach their motions to the matrix with MatSetNullSpace()",
                            unknowns));
  if (equations[0])
    PetscCall(PetscSNPrintf(run->why, sizeof(run->why),
                            "Equations %s of the primal field have no unknown: their rows of A and C' are zero",
                            equations));
  if (unknowns[0] || equations[0]) run->reason = PC_FACTOR_STRUCT_ZEROPIVOT;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the reduced operator, if there are constraints, and the vectors */
static PetscErrorCode SetUpConstraints(PC pc, PC_Ainsworth *data, SetUpRun *run)
{
  Mat_Ainsworth *ctx = NULL;

  PetscFunctionBegin;
  PetscCall(CheckUnused(data, run));
  if (run->reason) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSolverConfigureKSP(pc, data)); /* options count as read also where the constraints are refused */
  if (data->saddle->constraints()) PetscCall(SetUpOperator(pc, data, &run->reason));
  if (run->reason) {
    run->code = PETSC_ERR_MAT_CH_ZRPVT;
    PetscCall(PetscSNPrintf(
      run->why, sizeof(run->why),
      "Solves with the Gram matrix C W C' fail (%s), though no more rows of C are found to be linearly dependent",
      PCFailedReasons[run->reason]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (data->saddle->constraints()) PetscCall(MatAinsworthGetContext_Private(data->reduced.mat, &ctx));
  if (ctx && ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL)
    PetscCall(AinsworthShare(ctx->weight, &data->reduced.inverseDiagonal));
  else PetscCall(AinsworthWeightCreate(data->saddle->A, &data->reduced.inverseDiagonal));
  if (!data->saddle->constraints()) {
    PetscCall(PetscInfo(pc, "No constraints: the reduced system is that of A alone\n"));
    PetscCall(MatDestroy(&data->reduced.mat));
  }
  PetscCall(CreateKeptVectors(pc, data));
  if (!data->reduced.rhs) PetscCall(MatCreateVecs(data->saddle->A, &data->reduced.Ax, &data->reduced.rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts the seconds of this set-up as those of the next solve */
static PetscErrorCode AddSeconds(PC_Ainsworth *data, const SetUpRun *run)
{
  PetscLogDouble end;

  PetscFunctionBegin;
  PetscCall(PetscTime(&end));
  data->reporting.setupSeconds += end - run->start;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up M_* and the inner KSP, or what takes their place, and completes the set-up */
static PetscErrorCode SetUpSolver(PC pc, PC_Ainsworth *data, SetUpRun *run)
{
  PC             inner;
  PetscBool      other = PETSC_FALSE, lost = PETSC_FALSE, reuse;
  AinsworthEnd   end;
  PCFailedReason failed = PC_NOERROR;

  PetscFunctionBegin;
  if (data->whole.factor) { /* it needs no inner solver, which the next set-up makes */
    PetscCall(AinsworthSolverResetKSP(data));
    data->state = PC_AINSWORTH_READY;
    PetscCall(PCAinsworthAgreeOnFailure_Private(pc, PC_NOERROR));
    PetscCall(AddSeconds(data, run));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (run->keep) PetscCall(AinsworthSolverDecideToKeepInner(pc, data, &run->keep));
  PetscCall(AinsworthSolverSetUpInner(pc, data, run->keep, &end, run->why, sizeof(run->why)));
  PetscCall(PCGetReusePreconditioner(pc, &reuse));
  data->age.forProgram = (PetscBool)(data->age.type != PC_AINSWORTH_AGE_FRESH && reuse);
  if (end != AINSWORTH_END_ANSWER) PetscCall(PCAinsworthReplan_Private(pc, data, end, run->why, &other));
  if (end != AINSWORTH_END_ANSWER && !other) {
    run->reason = PC_SUBPC_ERROR;
    run->code   = PETSC_ERR_ARG_WRONG;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  data->state = PC_AINSWORTH_READY;
  PetscCall(AinsworthSolverGetInnerPC(data, &inner));
  if (!data->whole.factor) PetscCall(PCGetFailedReason(inner, &failed));
  PetscCall(PCAinsworthAgreeOnFailure_Private(pc, failed));
  PetscCall(PCGetFailedReason(pc, &failed));
  other = PETSC_TRUE;
  if (failed) PetscCall(PCAinsworthReplan_Private(pc, data, AINSWORTH_END_SETUP, PCFailedReasons[failed], &other));
  if (other) PetscCall(AinsworthSolverForgetFailure(pc));
  else { /* a solve would fail as well */
    PetscCall(
      AinsworthExplain(pc, data, data->inner.ksp, NULL, KSP_DIVERGED_PC_FAILED, &lost, run->why, sizeof(run->why)));
    PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_NOT_CONVERGED, run->why));
  }
  PetscCall(AddSeconds(data, run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetUp(PC pc)
{
  /* one for each AinsworthStage */
  static const SetUpStep steps[] = {ForgetLast, FindBlocks, SetUpConstraints, SetUpSolver};
  PC_Ainsworth          *data    = PCAinsworthData_Private(pc);
  SetUpRun               run     = {};
  PetscBool              needed, lost = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscTime(&run.start));
  PetscCall(PetscCitationsRegister(citation, NULL));
  PetscCall(IsNeeded(pc, data, &needed));
  for (int stage = 0; needed && stage <= AINSWORTH_STAGE_REDUCED; stage++) {
    PetscCall(steps[stage](pc, data, &run));
    if (run.reason) { /* discard what failed; the next set-up starts over */
      PetscCall(MatDestroy(&data->reduced.mat));
      data->state = PC_AINSWORTH_REFUSED;
      PetscCall(PCAinsworthFail_Private(pc, data, run.reason, run.code, run.why));
      break;
    }
    PetscCall(AinsworthDiagnose(pc, data, data->given.inputs, (AinsworthStage)stage,
                                (PetscBool)(data->state == PC_AINSWORTH_UNCHANGED), data->diagnosis.get(), &lost));
    if (lost) data->state = PC_AINSWORTH_NONE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCSetUp_Ainsworth(PC pc)
{
  const PetscErrorCode code = SetUp(pc);

  PetscFunctionBegin;
  if (code)
    PetscCall(AinsworthDiagnoseFailure(PetscObjectComm((PetscObject)pc), PCAinsworthData_Private(pc)->diagnosis.get(),
                                       code, NULL));
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}
