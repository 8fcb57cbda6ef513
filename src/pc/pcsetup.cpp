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

/* A set-up that failed is not used, and begun anew */
static PetscErrorCode FailSetUp(PC pc, PC_Ainsworth *data, PCFailedReason reason, PetscErrorCode code, const char why[])
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&data->reduced));
  data->stale      = PETSC_TRUE;
  data->unfinished = PETSC_FALSE;
  PetscCall(PCAinsworthFail_Private(pc, data, reason, code, why));
  data->refused = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Is data->reduced on the A, B, C and D that the saddle holds now? Their values may have changed since: it will notice, and keep what depends on the pattern alone */
static PetscErrorCode KeepsOperator(const PC_Ainsworth *data, PetscBool *keeps)
{
  const AinsworthSaddle *sp  = &data->saddle;
  Mat_Ainsworth         *ctx = NULL;

  PetscFunctionBegin;
  if (data->reduced) PetscCall(MatAinsworthGetContext_Private(data->reduced, &ctx));
  *keeps = (PetscBool)(ctx && ctx->A == sp->A && ctx->C == sp->C && ctx->B == sp->B && ctx->D == sp->D && ctx->adjoint == data->adjoint);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* data->reduced with its projector */
static PetscErrorCode CreateOperator(PC pc, PC_Ainsworth *data, Mat_Ainsworth **ctx)
{
  PetscBool   keeps = PETSC_FALSE;
  const char *prefix;

  PetscFunctionBegin;
  PetscCall(KeepsOperator(data, &keeps));
  if (!keeps) {
    PetscCall(MatDestroy(&data->reduced));
    PetscCall(MatCreateAinsworth(data->saddle.A, data->saddle.C, &data->reduced));
    PetscCall(MatSetBlockSize(data->reduced, data->saddle.bs));
    PetscCall(MatAinsworthSetOtherBlocks_Private(data->reduced, data->saddle.B == data->saddle.C ? NULL : data->saddle.B, data->saddle.D, data->adjoint));
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

/* Takes rows of C that depend on others out of the constraints, or refuses them */
static PetscErrorCode DropDependentRows(PC pc, PC_Ainsworth *data, PetscInt n, const PetscInt dependent[])
{
  char names[128];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleDropDependent(&data->saddle, n, dependent));
  PetscCall(AinsworthSaddleNameKind(&data->saddle, AINSWORTH_ROW_DEPENDENT, names, sizeof(names)));
  PetscCheck(data->choices.redundant != AINSWORTH_REDUNDANT_ERROR, PetscObjectComm((PetscObject)pc), PETSC_ERR_MAT_CH_ZRPVT,
             "%" PetscInt_FMT " rows of C are linear combinations of others: rows %s of the multiplier field; remove them or use -pc_ainsworth_redundant drop",
             n, names);
  PetscCall(PetscInfo(pc, "%" PetscInt_FMT " rows of C are linear combinations of others and left out: rows %s of the multiplier field\n", n, names));
  data->constraints -= n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reduced operator, without dependent rows of C: they are looked for only if the Gram matrix is suspicious */
static PetscErrorCode SetUpOperator(PC pc, PC_Ainsworth *data, Mat_Ainsworth **ctx, PCFailedReason *reason)
{
  PetscInt  pass = 0, n = 1;
  PetscBool hidden;

  PetscFunctionBegin;
  data->hidden = data->saddle.nearly = PETSC_FALSE;
  while (n) {
    PetscInt      *dependent;
    PetscErrorCode error = PETSC_SUCCESS; /* to be passed on when nothing is left behind */

    PetscCall(CreateOperator(pc, data, ctx));
    PetscCall(MatAinsworthDiagnose_Private(data->reduced, &pass, &n, &dependent, reason, &hidden));
    if (hidden && data->choices.weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL) {
      PetscCall(PetscInfo(pc, "Rows of C that diag(A)^{-1} cannot tell apart are independent without it: the weight is the identity\n"));
      data->hidden = PETSC_TRUE;
    } else if (n) {
      data->saddle.nearly = (PetscBool)(pass > 1 || data->saddle.D); /* a small D may tell rows apart */
      error               = DropDependentRows(pc, data, n, dependent);
    }
    PetscCall(PetscFree(dependent));
    PetscCall(error);
    if (data->constraints) continue;
    PetscCall(MatDestroy(&data->reduced));
    *reason = PC_NOERROR;
    break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* diag(A)^{-1}: that of the operator, where this is its weight */
static PetscErrorCode SetUpWeights(PC_Ainsworth *data, const Mat_Ainsworth *ctx)
{
  PetscFunctionBegin;
  if (data->constraints && ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL) {
    PetscCall(PetscObjectReference((PetscObject)ctx->weight));
    data->inverseDiagonal = ctx->weight;
  } else PetscCall(AinsworthWeightCreate(data->saddle.A, &data->inverseDiagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The inner solver, its operator and their vectors are made anew */
static PetscErrorCode ForgetInner(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(VecDestroy(&data->rhs));
  PetscCall(VecDestroy(&data->Ax));
  PetscCall(MatDestroy(&data->reduced));
  PetscCall(PCAinsworthResetKSP_Private(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: where A has another size on any rank than at the last set-up, the inner solver and its right-hand side cannot be used again */
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

/* Vectors of what is kept, where not all rows are constraints or unknowns are known */
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

/* A alone, for the inner solver: in a copy that knows its block size where the program's does not, an AIJ where that is part of the type */
static PetscErrorCode TellBlockSize(PC_Ainsworth *data)
{
  PetscInt bs;
  Mat      A = data->saddle.A, copy;

  PetscFunctionBegin;
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

static PetscErrorCode SetUp(PC pc)
{
  PC_Ainsworth  *data    = (PC_Ainsworth *)pc->data;
  PetscBool      changed = PETSC_TRUE, symmetric, adjoint, keep = (PetscBool)(!data->stale && !data->unfinished);
  PCFailedReason reason = PC_NOERROR;
  Mat_Ainsworth *ctx    = NULL;
  PC             inner;
  char           why[512];
  PetscLogDouble start, end;

  PetscFunctionBegin;
  PetscCall(PetscTime(&start));
  PetscCall(PetscCitationsRegister(citation, NULL));
  PetscCall(PCAinsworthUpdateInputs_Private(pc, data));
  if (data->saddle.A && !data->stale) PetscCall(AinsworthSaddleChanged(&data->inputs, &data->saddle, &changed));
  if (data->ordered && !pc->reusepreconditioner) changed = PETSC_TRUE;
  data->unchanged = (PetscBool)!changed;
  if (!changed) {
    if (data->applied) PetscCall(AinsworthPCSetFailedReason(pc, PC_NOERROR)); /* that of the last solve, which a KSP would take for one of this set-up */
    PetscCall(PetscInfo(pc, "Neither A nor C changed: nothing is rebuilt\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (data->stale) PetscCall(MatDestroy(&data->reduced)); /* it is not what the choices say */
  data->stale = PETSC_TRUE;                               /* until all is done: an error may end it anywhere */
  if (data->unfinished) PetscCall(ForgetInner(data)); /* PCs of PETSc's are not to be used again after an error in their set-up, and vectors may be locked */
  data->unfinished = PETSC_TRUE;
  data->applied = data->refused = PETSC_FALSE;
  data->failure[0]              = 0;
  PetscCall(PCAinsworthReportReset_Private(data));
  PetscCall(MatDestroy(&data->M));
  PetscCall(VecDestroy(&data->g));
  PetscCall(VecDestroy(&data->lambda));
  PetscCall(VecDestroy(&data->f));
  PetscCall(VecDestroy(&data->inverseDiagonal));
  PetscCall(PCAinsworthDiagnose_Private(pc, data, PC_AINSWORTH_STAGE_PASSED));
  PetscCall(AinsworthSaddleSetUp(&data->inputs, &data->saddle));
  if (data->saddle.bad[0]) {
    PetscCall(PetscSNPrintf(why, sizeof(why), "The system cannot be solved: %s", data->saddle.bad));
    PetscCall(FailSetUp(pc, data, PC_FACTOR_OTHER, PETSC_ERR_FP, why));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleDescribeLayout(&data->saddle, why, sizeof(why)));
  PetscCall(PetscInfo(pc, "%s; block size %" PetscInt_FMT " of A: %s\n", why, data->saddle.bs, data->saddle.bsSource));
  PetscCall(MatGetSize(data->saddle.C, &data->constraints, NULL));
  PetscCall(ForgetOtherSizes(pc, data));
  symmetric = data->symmetric;
  adjoint   = data->adjoint;
  PetscCall(AinsworthProbeSymmetry(data->saddle.A, &data->symmetric));
  data->adjoint = (PetscBool)(data->saddle.B == data->saddle.C);
  if (data->adjoint && data->saddle.D) PetscCall(AinsworthProbeSymmetry(data->saddle.D, &data->adjoint));
  if (data->indefinite) data->configured = PETSC_FALSE; /* conjugate gradients are tried again */
  data->indefinite = PETSC_FALSE;
  if (symmetric != data->symmetric || adjoint != data->adjoint) {
    PetscCall(MatDestroy(&data->reduced)); /* which has the symmetry of the system, and its B */
    data->configured = PETSC_FALSE;        /* it may need another method */
  }
  PetscCall(PCAinsworthDiagnose_Private(pc, data, PC_AINSWORTH_STAGE_BLOCKS));
  PetscCall(PCAinsworthConfigureKSP_Private(pc, data));
  if (data->constraints) {
    PetscCall(SetUpOperator(pc, data, &ctx, &reason));
    if (reason) {
      PetscCall(PetscSNPrintf(why, sizeof(why), "Solves with the Gram matrix C W C' fail (%s), though no more rows of C are found to be linearly dependent",
                              PCFailedReasons[reason]));
      PetscCall(FailSetUp(pc, data, reason, PETSC_ERR_MAT_CH_ZRPVT, why));
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  PetscCall(PCAinsworthDiagnose_Private(pc, data, PC_AINSWORTH_STAGE_CONSTRAINTS));
  PetscCall(SetUpWeights(data, ctx));
  if (!data->constraints) {
    PetscCall(PetscInfo(pc, "No constraints: the reduced system is that of A alone\n"));
    PetscCall(MatDestroy(&data->reduced));
    PetscCall(TellBlockSize(data));
  }
  PetscCall(CreateKeptVectors(pc, data));
  if (!data->rhs) PetscCall(MatCreateVecs(data->saddle.A, &data->Ax, &data->rhs));
  why[0] = 0;
  PetscCall(KSPGetPC(data->ksp, &inner));
  if (keep) PetscCall(PCAinsworthKeeps_Private(pc, data, &keep));
  keep = (PetscBool)(keep && symmetric == data->symmetric && adjoint == data->adjoint);
  PetscCall(PCAinsworthKeepOrSetUpInner_Private(pc, data, ctx, keep, why, sizeof(why)));
  PetscCall(PCAinsworthIsOld_Private(data, &data->ordered));
  data->ordered = (PetscBool)(data->ordered && pc->reusepreconditioner);
  if (why[0]) {
    PetscCall(FailSetUp(pc, data, PC_SUBPC_ERROR, PETSC_ERR_ARG_WRONG, why));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  data->stale = data->unfinished = PETSC_FALSE;
  PetscCall(PCGetFailedReason(inner, &reason));
  PetscCall(PCAinsworthAgreeOnFailure_Private(pc, reason ? PC_SUBPC_ERROR : PC_NOERROR));
  if (pc->failedreason) {
    PetscCall(PCAinsworthExplain_Private(pc, data, NULL, KSP_DIVERGED_PC_FAILED, why, sizeof(why)));
    PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_NOT_CONVERGED, why));
  }
  PetscCall(PetscTime(&end));
  data->setupSeconds += end - start;
  if (!pc->failedreason) PetscCall(PCAinsworthDiagnose_Private(pc, data, PC_AINSWORTH_STAGE_REDUCED));
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
