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
  const AinsworthSaddle *sp = &data->saddle;
  Mat                    A = NULL, C = NULL;

  PetscFunctionBegin;
  if (data->reduced) PetscCall(MatAinsworthGetMats(data->reduced, &A, &C));
  *keeps = (PetscBool)(A && A == sp->A && C == sp->C && sp->B == sp->C && !sp->D && data->adjoint);
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
    PetscCall(MatAinsworthSetRowsPerRank(data->reduced, data->choices.rowsPerRank));
  }
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
  PetscBool *marked;
  char       names[128];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleDropDependent(&data->saddle, n, dependent));
  PetscCall(PetscMalloc1(data->saddle.local, &marked));
  for (PetscInt i = 0; i < data->saddle.local; i++) marked[i] = (PetscBool)(data->saddle.kind[i] == AINSWORTH_ROW_DEPENDENT);
  PetscCall(AinsworthSaddleNameRows(&data->saddle, marked, names, sizeof(names)));
  PetscCall(PetscFree(marked));
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
    PetscInt *dependent;

    PetscCall(CreateOperator(pc, data, ctx));
    PetscCall(MatAinsworthDiagnose_Private(data->reduced, &pass, &n, &dependent, reason, &hidden));
    if (hidden && data->choices.weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL) {
      PetscCall(PetscInfo(pc, "Rows of C that diag(A)^{-1} cannot tell apart are independent without it: the weight is the identity\n"));
      data->hidden = PETSC_TRUE;
    } else if (n) {
      data->saddle.nearly = (PetscBool)(pass > 1);
      PetscCall(DropDependentRows(pc, data, n, dependent));
    }
    PetscCall(PetscFree(dependent));
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

/* What auto comes to (docs/method.md): id where its few entries are enough, and where jcb would have too many */
static PetscErrorCode ChoosePmatType(PC_Ainsworth *data, const AinsworthPmatInputs *in)
{
  static const PetscReal many = 1.5; /* of the entries of A */
  PetscReal              predicted;
  PetscBool              apart;

  PetscFunctionBegin;
  data->autoType   = PC_AINSWORTH_PMAT_JCB;
  data->autoReason = "";
  if (data->choices.pmat.penalty != AINSWORTH_PENALTY_ROW) PetscFunctionReturn(PETSC_SUCCESS);
  data->autoType   = PC_AINSWORTH_PMAT_ID;
  data->autoReason = ", as interpolation is made from A alone";
  if (in->format == AINSWORTH_PMAT_SUM) PetscFunctionReturn(PETSC_SUCCESS);
  data->autoReason = ", as it is factored";
  if (in->format == AINSWORTH_PMAT_FACTOR) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthPmatComponentsApart(in->C, data->saddle.bs, in->fill.most, &apart));
  data->autoReason = ", as the constraints keep components apart";
  if (apart) PetscFunctionReturn(PETSC_SUCCESS);
  data->autoReason = ", as jcb would have too many entries";
  PetscCall(AinsworthPmatPredict(in->aij, in->C, NULL, &in->fill, &predicted));
  if (predicted > many * in->fill.entries) PetscFunctionReturn(PETSC_SUCCESS);
  data->autoType   = PC_AINSWORTH_PMAT_JCB;
  data->autoReason = ", as the constraints mix components";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The preconditioning matrix, and the penalty that it has in common with the operator */
static PetscErrorCode SetUpPmat(PC_Ainsworth *data, const Mat_Ainsworth *ctx, PetscInt *bad)
{
  AinsworthPmatInputs  in;
  AinsworthPmatOptions options = data->choices.pmat;
  Vec                  penalty;

  PetscFunctionBegin;
  /* where columns of known unknowns were moved Pmat still has them */
  in.A  = data->saddle.A == data->saddle.block[AINSWORTH_BLOCK_A] ? data->saddle.block[AINSWORTH_BLOCK_P] : data->saddle.A;
  in.bs = data->saddle.bs;
  in.C  = data->saddle.C;
  in.S  = NULL;
  if (data->saddle.B == data->saddle.C) PetscCall(MatAinsworthGetGramMat_Private(data->reduced, &in.S));
  PetscCall(MatAinsworthGetCompliance_Private(data->reduced, &in.compliance));
  in.weight          = ctx->mobility;
  in.inverseDiagonal = data->inverseDiagonal;
  in.format          = data->format;
  PetscCall(AinsworthGetAIJ(in.A, &in.aij));
  PetscCall(AinsworthPmatGetFill(in.aij, in.C, &in.fill));
  data->longRows = in.fill.leftOut;
  if (data->choices.pmat.type == PC_AINSWORTH_PMAT_AUTO) PetscCall(ChoosePmatType(data, &in));
  options.type      = PCAinsworthPmatTypeInUse_Private(data);
  options.symmetric = data->symmetric;
  options.factor    = PCAinsworthPenaltyFactor_Private(data);
  PetscCall(AinsworthPmatCreate(&in, &options, &penalty, &data->M, bad));
  PetscCall(MatDestroy(&in.aij));
  if (*bad < 0) PetscCall(MatAinsworthSetPenalty(data->reduced, penalty));
  PetscCall(VecDestroy(&penalty));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Null space, near null space: hypre reads them from the operator, GAMG from the preconditioning matrix, unless that is an earlier one */
static PetscErrorCode ForwardNullSpaces(PC_Ainsworth *data)
{
  MatNullSpace near, common;
  Mat          S = data->constraints ? data->reduced : data->saddle.A, M = data->kept ? S : data->constraints ? data->M : data->saddle.A;

  PetscFunctionBegin;
  if (S == data->saddle.block[AINSWORTH_BLOCK_A]) PetscFunctionReturn(PETSC_SUCCESS); /* the program's A has its own */
  PetscCall(AinsworthSaddleGetNearNullSpace(&data->saddle, &near));
  PetscCall(MatSetNearNullSpace(S, near));
  PetscCall(MatSetNearNullSpace(M, near));
  PetscCall(AinsworthSaddleCreateNullSpace(&data->saddle, &common));
  PetscCall(MatSetNullSpace(S, common));
  PetscCall(MatSetNullSpace(M, common));
  PetscCall(MatSetTransposeNullSpace(S, data->symmetric ? common : NULL));
  PetscCall(MatNullSpaceDestroy(&common));
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
  if (!other) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDestroy(&data->rhs));
  PetscCall(VecDestroy(&data->Ax));
  PetscCall(MatDestroy(&data->reduced));
  PetscCall(PCAinsworthResetKSP_Private(data));
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

/* A alone, for the inner solver: in a copy that knows its block size where the program's does not */
static PetscErrorCode TellBlockSize(PC_Ainsworth *data)
{
  PetscInt bs;
  Mat      A = data->saddle.A;

  PetscFunctionBegin;
  PetscCall(MatGetBlockSize(A, &bs));
  if (bs == data->saddle.bs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatDuplicate(A, MAT_COPY_VALUES, &data->saddle.A));
  PetscCall(MatSetBlockSize(data->saddle.A, data->saddle.bs));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthSetUpInner_Private - the preconditioning matrix and the inner solver, a second time where the first choice of its preconditioner does not fit;
   why it cannot be
*/
PetscErrorCode PCAinsworthSetUpInner_Private(PC pc, PC_Ainsworth *data, char why[], size_t len)
{
  PetscInt       bad = -1;
  PetscBool      definite;
  PetscBool      again = PETSC_TRUE;
  PC             inner;
  Mat            operation, M;
  Mat_Ainsworth *ctx = NULL;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  if (data->reduced) PetscCall(MatAinsworthGetContext_Private(data->reduced, &ctx));
  PetscCall(PCAinsworthEscapeReview_Private(pc, data));
  while (again) {
    PetscCall(MatDestroy(&data->M));
    PetscCall(PCAinsworthGetPmatFormat_Private(data, &data->format));
    if (data->constraints) PetscCall(SetUpPmat(data, ctx, &bad));
    if (bad >= 0) {
      PetscCall(PetscSNPrintf(why, len,
                              "Row %" PetscInt_FMT
                              " of the preconditioning matrix holds NaN or Inf: the penalty factor, or the values of A or C, are too large "
                              "or too small",
                              bad));
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    PetscCall(PCAinsworthConvertPmat_Private(data));
    PetscCall(PCAinsworthSetKSPOperators_Private(data));
    PetscCall(ForwardNullSpaces(data));
    /* the preconditioner sees M_* alone: GAMG and ML smooth with the first of their operators */
    PetscCall(KSPGetOperators(data->ksp, &operation, &M));
    PetscCall(PCAinsworthLooksDefinite_Private(data, M, &definite));
    if (!definite) {
      PetscCall(PetscSNPrintf(why, len, "The preconditioning matrix is not positive definite, as BoomerAMG needs it: is A indefinite? %s-%spc_type",
                              data->constraints ? "A larger -pc_ainsworth_penalty_factor may help, or another " : "Choose another ",
                              ((PetscObject)inner)->prefix));
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    PetscCall(PetscObjectReference((PetscObject)operation));
    PetscCall(PCSetOperators(inner, M, M));
    PetscCall(AinsworthPCSetFailedReason(inner, PC_NOERROR)); /* that of an earlier matrix, or type, would stay */
    PetscCall(PCAinsworthSetUpPreconditioner_Private(inner, &definite));
    PetscCall(PCAinsworthSetTranspose_Private(data));
    if (operation != M) inner->ops->applyrichardson = NULL; /* its iterations would be with M_* */
    PetscCall(KSPSetOperators(data->ksp, operation, M));
    PetscCall(MatDestroy(&operation));
    PetscCall(PCAinsworthEscapeCheck_Private(pc, data, definite, &again));
    if (again) continue;
    if (!definite) {
      PetscCall(PetscSNPrintf(why, len,
                              "The preconditioning matrix is not positive definite, as a Cholesky factorization needs it: is A indefinite? "
                              "Choose another -%spc_type",
                              ((PetscObject)inner)->prefix));
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    PetscCall(KSPSetUp(data->ksp));
    PetscCall(PCAinsworthFallBack_Private(pc, data, &again));
  }
  PetscCall(PCAinsworthUseProduct_Private(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The operator and the constraints are those of the matrix at hand, the preconditioning matrix and its preconditioner what they were */
static PetscErrorCode KeepInner(PC pc, PC_Ainsworth *data)
{
  PC  inner;
  Mat operation, M;

  PetscFunctionBegin;
  PetscCall(PetscInfo(pc, "The inner preconditioner is kept, the constraints are set up anew\n"));
  PetscCall(PCAinsworthKeepInner_Private(data, PETSC_TRUE));
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCGetOperators(inner, NULL, &data->M));
  PetscCall(PetscObjectReference((PetscObject)data->M));
  if (data->constraints) { /* both may have been made for an earlier A */
    PetscCall(MatAinsworthSetPenalty(data->reduced, NULL));
    PetscCall(MatAinsworthSetProduct_Private(data->reduced, NULL));
  }
  PetscCall(PCAinsworthSetKSPOperators_Private(data));
  PetscCall(ForwardNullSpaces(data));
  PetscCall(KSPGetOperators(data->ksp, &operation, &M));
  if (operation != M) inner->ops->applyrichardson = NULL;
  PetscCall(KSPSetUp(data->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCSetUp_Ainsworth(PC pc)
{
  PC_Ainsworth  *data    = (PC_Ainsworth *)pc->data;
  PetscBool      changed = PETSC_TRUE, symmetric, adjoint, keep = (PetscBool)(pc->reusepreconditioner && !data->stale && !data->unfinished);
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
  if (data->kept && !pc->reusepreconditioner) changed = PETSC_TRUE;
  data->unchanged = (PetscBool)!changed;
  if (!changed) {
    PetscCall(PetscInfo(pc, "Neither A nor C changed: nothing is rebuilt\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (data->stale) PetscCall(MatDestroy(&data->reduced));             /* it is not what the choices say */
  data->stale = PETSC_TRUE;                                           /* until all is done: an error may end it anywhere */
  if (data->unfinished) PetscCall(PCAinsworthResetKSP_Private(data)); /* PCs of PETSc's are not to be used again after an error in their set-up */
  data->unfinished = PETSC_TRUE;
  data->applied = data->refused = PETSC_FALSE;
  data->failure[0]              = 0;
  PetscCall(PCAinsworthReportReset_Private(data));
  PetscCall(MatDestroy(&data->M));
  PetscCall(VecDestroy(&data->g));
  PetscCall(VecDestroy(&data->lambda));
  PetscCall(VecDestroy(&data->f));
  PetscCall(VecDestroy(&data->inverseDiagonal));
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
  if (symmetric != data->symmetric || adjoint != data->adjoint) {
    PetscCall(MatDestroy(&data->reduced)); /* which has the symmetry of the system, and its B */
    data->configured = PETSC_FALSE;        /* it may need another method */
  }
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
  if (keep && inner->setupcalled && symmetric == data->symmetric && adjoint == data->adjoint) PetscCall(KeepInner(pc, data));
  else {
    PetscCall(PCAinsworthKeepInner_Private(data, PETSC_FALSE));
    PetscCall(PCAinsworthSetUpInner_Private(pc, data, why, sizeof(why)));
  }
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
  PetscFunctionReturn(PETSC_SUCCESS);
}
