#include "pcainsworth.h"
#include "../base/objects.h"
#include "../projection/matainsworth.h"
#include <petsctime.h>

/* Data shared by the steps of one set-up */
struct SetUpRun {
  PetscLogDouble   start = 0.0;
  AinsworthReduced last;                   /* what the last set-up made of the reduced system, as far as it fits */
  PetscBool        keep     = PETSC_FALSE; /* the inner preconditioner may be kept */
  PCFailedReason   reason   = {};          /* PC_NOERROR if it can go on */
  PetscErrorCode   code     = PETSC_SUCCESS;
  char             why[512] = {}; /* why it cannot go on */
};
typedef PetscErrorCode (*SetUpStep)(PC, PC_Ainsworth *, SetUpRun *);

/* Discards the operators of the inner solver if the local size of A changed on any rank; collective */
static PetscErrorCode ForgetOtherSizes(PC pc, PC_Ainsworth *data)
{
  PetscInt  before, now;
  PetscBool set, other;
  Mat       M;

  PetscFunctionBegin;
  PetscCall(KSPGetOperatorsSet(data->inner.ksp, NULL, &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetOperators(data->inner.ksp, NULL, &M));
  PetscCall(MatGetLocalSize(M, &before, NULL));
  PetscCall(MatGetLocalSize(data->saddle->A, &now, NULL));
  other = (PetscBool)(before != now);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &other, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)pc)));
  if (!other) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSolverResetKSP(data));
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
  /* after an error in its set-up a PC of PETSc is unusable, and vectors may be locked */
  if (data->state == PC_AINSWORTH_NONE) PetscCall(AinsworthSolverResetKSP(data));
  else if (data->reduced) run->last = *data->reduced;
  if (!run->keep) run->last.mat.reset(); /* it does not match the choices */
  data->reduced.reset();
  /* until everything is done: an error may end it anywhere */
  data->state              = PC_AINSWORTH_NONE;
  data->outer.applications = 0;
  data->outcome.why[0]     = 0;
  PetscCall(AinsworthReportDestroy(&data->reporting.report));
  PetscCall(PCAinsworthForgetWhole_Private(data));
  data->inner.M.reset();
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
    run->last.mat.reset();                            /* it depends on the symmetry of the system, and on B */
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

/* Builds the reduced system */
static PetscErrorCode SetUpReduced(PC pc, PC_Ainsworth *data, SetUpRun *run)
{
  const AinsworthReplaceFn replace = [=](PetscBool *whole) {
    return PCAinsworthReplan_Private(pc, data, AINSWORTH_END_GRAM, "The Gram matrix C W C' is nearly singular", whole);
  };
  AinsworthReducedChoices choices;

  PetscFunctionBegin;
  PetscCall(CheckUnused(data, run));
  if (run->reason) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSolverConfigureKSP(pc, data)); /* options count as read also where the constraints are refused */
  choices.parent     = (PetscObject)pc;
  choices.weightType = data->choices.weightType;
  choices.weight     = data->choices.weight;
  choices.gram       = data->choices.gram;
  choices.redundant  = data->choices.redundant;
  PetscCall(AinsworthReducedBuild(choices, replace, &run->last, &data->saddle, &data->reduced, &run->reason));
  if (!run->reason) PetscFunctionReturn(PETSC_SUCCESS);
  run->code = PETSC_ERR_MAT_CH_ZRPVT;
  PetscCall(PetscSNPrintf(
    run->why, sizeof(run->why),
    "Solves with the Gram matrix C W C' fail (%s), though no more rows of C are found to be linearly dependent",
    PCFailedReasons[run->reason]));
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
  PetscBool      other = PETSC_FALSE, reuse;
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
    PetscCall(AinsworthExplain(pc, data, data->inner.ksp, NULL, KSP_DIVERGED_PC_FAILED, run->why, sizeof(run->why)));
    PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_NOT_CONVERGED, run->why));
  }
  PetscCall(AddSeconds(data, run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetUp(PC pc)
{
  /* one for each AinsworthStage */
  static const SetUpStep steps[] = {ForgetLast, FindBlocks, SetUpReduced, SetUpSolver};
  PC_Ainsworth          *data    = PCAinsworthData_Private(pc);
  SetUpRun               run     = {};
  PetscBool              needed;

  PetscFunctionBegin;
  PetscCall(PetscTime(&run.start));
  PetscCall(PCAinsworthCite_Private());
  PetscCall(IsNeeded(pc, data, &needed));
  for (int stage = 0; needed && stage <= AINSWORTH_STAGE_REDUCED; stage++) {
    PetscCall(steps[stage](pc, data, &run));
    if (run.reason) { /* the next set-up starts over */
      data->reduced.reset();
      data->state = PC_AINSWORTH_REFUSED;
      PetscCall(PCAinsworthFail_Private(pc, data, run.reason, run.code, run.why));
      break;
    }
    PetscCall(AinsworthDiagnose(pc, data, data->given.inputs, (AinsworthStage)stage,
                                (PetscBool)(data->state == PC_AINSWORTH_UNCHANGED), data->diagnosis.get()));
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
