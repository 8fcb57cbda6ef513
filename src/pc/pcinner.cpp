/* Set-up of M_* and the inner solver, made anew or kept */
#include "pcainsworth.h"
#include "../ksp/projectedcg.h"
#include "../multigrid/blocksa.h"
#include "../objects.h"
#include "../operator/matainsworth.h"
#include "../projector/surface.h"
#include <petsc/private/pcimpl.h>

/*
   Chooses the type of auto (docs/method.md): id where its few entries are enough or jcb would have too many, otherwise jcb

   With id the penalties of many rows that share an unknown add up, and lock interpolation from A alone; jcb avoids that
*/
static PetscErrorCode ChoosePmatType(PC_Ainsworth *data, const AinsworthPmatInputs *in, PetscBool shares)
{
  static const PetscReal many = 1.5; /* times the entries of A */
  PetscReal              predicted;
  PetscBool              apart;

  PetscFunctionBegin;
  data->autoType   = PC_AINSWORTH_PMAT_JCB;
  data->autoReason = "";
  if (data->choices.pmat.penalty != AINSWORTH_PENALTY_ROW) PetscFunctionReturn(PETSC_SUCCESS);
  data->autoType = PC_AINSWORTH_PMAT_ID;
  if (in->inKernel) {
    data->autoType   = PC_AINSWORTH_PMAT_JCB;
    data->autoReason = ", for coarse functions in Ker C";
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  data->autoReason = ", as it is factored";
  if (in->format == AINSWORTH_PMAT_FACTOR) PetscFunctionReturn(PETSC_SUCCESS);
  data->autoReason = ", as interpolation is made from A alone";
  if (in->format == AINSWORTH_PMAT_SUM) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthPmatComponentsApart(in->C, data->saddle.bs, in->fill.most, &apart));
  data->autoReason = ", as the constraints keep components apart";
  if (apart && !shares) PetscFunctionReturn(PETSC_SUCCESS);
  data->autoReason = ", as jcb would have too many entries";
  PetscCall(AinsworthPmatPredict(in->aij, in->C, NULL, &in->fill, &predicted));
  if (predicted > many * in->fill.entries) PetscFunctionReturn(PETSC_SUCCESS);
  data->autoType   = PC_AINSWORTH_PMAT_JCB;
  data->autoReason = shares ? ", as many constraints share an unknown" : ", as the constraints mix components";
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* What a subspace uses, for as long as it exists */
struct Surface {
  AinsworthSurface      surface;
  AinsworthPmatInKernel made = {};
  AinsworthPmatSlack    slack;

  ~Surface()
  {
    for (Vec &row : made.rows) (void)VecDestroy(&row);
    (void)MatDestroy(&made.correction);
  }
};
} // namespace

/* Sets up the projectors of the surface, with slack unknowns if there are any */
static PetscErrorCode SetUpSurface(Mat_Ainsworth *ctx, Surface *used)
{
  AinsworthProjector *proj = &ctx->proj;
  Mat                 C, CW;

  PetscFunctionBegin;
  if (!used->slack.C) {
    PetscCall(AinsworthSurfaceSetUp(&used->surface, proj, proj->C, proj->CW, ctx->mobility));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthShare(used->slack.C, &C));
  PetscCall(AinsworthScaleColumns(C, used->slack.weight, &CW));
  for (Mat *M : {&C, &CW}) PetscCall(AinsworthProjectorMoveRows(proj, M));
  PetscCall(AinsworthSurfaceSetUp(&used->surface, proj, C, CW, used->slack.weight));
  for (Mat *M : {&C, &CW}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lets multigrid stay in Ker C: it projects what it smooths, and what it interpolates to the finest level */
static PetscErrorCode SetSubspace(Mat_Ainsworth *ctx, const std::shared_ptr<Surface> &used, PC inner)
{
  auto subspace = std::make_shared<AinsworthSubspace>();

  PetscFunctionBegin;
  PetscCall(SetUpSurface(ctx, used.get()));
  subspace->map = used->slack.map;
  if (used->slack.map) subspace->extend = [used](Mat A, Mat *extended) { return AinsworthPmatSlackExtend(&used->slack, A, extended); };
  subspace->places     = used->surface.places;
  subspace->carried    = used->made.carried;
  subspace->correction = used->made.correction;
  subspace->left       = used->made.left;
  subspace->rows       = used->made.rows;
  subspace->weight     = used->surface.weight;
  subspace->values     = used->surface.values;
  subspace->project    = [used](bool adjoint, Vec x) { return AinsworthSurfaceProject(&used->surface, adjoint, x); };
  PetscCall(PCBlockSASetSubspace_Private(inner, subspace, used->slack.A));
  for (Mat *M : {&used->slack.A, &used->slack.C}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether multigrid works in Ker C, and needs no M_*: for a symmetric A with the diagonal weight, if the method iterates in Ker C, or if its operator has
   no penalty, or is not used, or with springs of their own. Collective
*/
static PetscErrorCode WorksInKernel(PC_Ainsworth *data, const Mat_Ainsworth *ctx, const AinsworthPmatInputs *in, const AinsworthCompliance *compliance,
                                    PetscBool *works)
{
  PC          inner;
  PC_BlockSA *sa = NULL;
  PetscInt    n;
  PCSide      side;
  PetscBool   once;

  PetscFunctionBegin;
  *works = PETSC_FALSE;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  PetscCall(MatGetSize(in->A, &n, NULL));
  if (!sa || n <= sa->options.coarseSize || !data->symmetric || ctx->weightType != MAT_AINSWORTH_WEIGHT_DIAGONAL) PetscFunctionReturn(PETSC_SUCCESS);
  if (compliance && data->adjoint) PetscCall(AinsworthPmatHasSlack(in, compliance, works));
  if (compliance) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthIteratesInKernel_Private(data, works));
  PetscCall(KSPGetPCSide(data->ksp, &side));
  PetscCall(PetscObjectTypeCompare((PetscObject)data->ksp, KSPPREONLY, &once));
  if ((side == PC_RIGHT || once) && data->choices.variant == PC_AINSWORTH_WEIGHTED) *works = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates slack unknowns for the springs of D, and the inputs that have them */
static PetscErrorCode AddSlack(const PC_Ainsworth *data, PC inner, const AinsworthCompliance *compliance, const AinsworthPmatInputs *in,
                               AinsworthPmatSlack *slack, AinsworthPmatInputs *extended)
{
  PetscInt n, others;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(in->A, NULL, &n));
  PetscCall(PCBlockSACountOthers_Private(inner, n, &others));
  PetscCall(AinsworthPmatCreateSlack(in, compliance, PetscMax(data->saddle.bs, data->saddle.scattered), others, slack));
  *extended   = *in;
  extended->A = extended->aij = slack->A;
  extended->C                 = slack->C;
  extended->weight            = slack->weight;
  extended->springs           = slack->numbers.data();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Conjugate gradients move at most this many shared unknowns; each costs an application of the preconditioner and a vector */
static const size_t mostShared = 16;

/* Creates the preconditioning matrix, and sets its penalty in the operator; bad: a row with NaN or Inf, negative if there is none */
static PetscErrorCode SetUpPmat(PC_Ainsworth *data, Mat_Ainsworth *ctx, PC inner, PetscInt *bad)
{
  AinsworthPmatInputs        in, extended;
  AinsworthPmatOptions       options = data->choices.pmat;
  const AinsworthGram       *gram;
  Vec                        penalty;
  std::vector<PetscInt>      alone;
  PetscBool                  inKernel, works, shares;
  auto                       used = std::make_shared<Surface>();
  const AinsworthCompliance *compliance;

  PetscFunctionBegin;
  in.A  = data->saddle.P;
  in.bs = data->saddle.bs;
  in.C  = data->saddle.C;
  PetscCall(MatAinsworthGetGram_Private(data->reduced, &gram));
  PetscCall(MatAinsworthGetCompliance_Private(data->reduced, &compliance));
  in.compliance      = compliance ? compliance->sums : NULL;
  in.N               = compliance ? compliance->N : NULL;
  in.S               = gram->S;
  in.weight          = ctx->mobility;
  in.inverseDiagonal = data->inverseDiagonal;
  in.format          = data->format;
  PetscCall(AinsworthGetAIJ(in.A, &in.aij));
  PetscCall(AinsworthPmatGetFill(in.aij, in.C, &in.fill));
  data->longRows = in.fill.leftOut;
  PetscCall(AinsworthPmatFindShared(in.aij, in.C, &in.fill, &shares, &alone));
  PetscCall(PCAinsworthIteratesInKernel_Private(data, &inKernel));
  PetscCall(WorksInKernel(data, ctx, &in, compliance, &works));
  in.inKernel = works ? &used->made : NULL;
  in.slack    = NULL;
  in.springs  = NULL;
  if (works && compliance) {
    PetscCall(AddSlack(data, inner, compliance, &in, &used->slack, &extended));
    in.slack = &extended;
  }
  ctx->springs = (PetscBool)(in.slack != NULL);
  PetscCall(PCBlockSAExpect_Private(inner, data->ksp, (PetscBool)(data->longRows > 0 && !in.inKernel), &in.single));
  if (!in.inKernel && inKernel && in.format != AINSWORTH_PMAT_FACTOR && alone.size() <= mostShared) in.shared.swap(alone);
  ctx->longest = data->longRows && !in.inKernel ? in.fill.most : PETSC_MAX_INT;
  ctx->shared  = in.shared;
  PetscCall(KSPProjectedCGForget_Private(ctx));
  if (data->choices.pmat.type == PC_AINSWORTH_PMAT_AUTO) PetscCall(ChoosePmatType(data, &in, shares));
  options.type      = PCAinsworthPmatTypeInUse_Private(data);
  options.symmetric = data->symmetric;
  options.factor    = PCAinsworthPenaltyFactor_Private(data);
  PetscCall(AinsworthPmatCreate(&in, &options, &penalty, &data->M, bad));
  if (in.inKernel) PetscCall(SetSubspace(ctx, used, inner));
  else PetscCall(PCBlockSASetSubspace_Private(inner, NULL, NULL));
  if (*bad < 0 && !data->symmetric && data->format == AINSWORTH_PMAT_AIJ)
    PetscCall(AinsworthMakePatternSymmetric(&data->M)); /* PETSc's orderings do not terminate otherwise */
  PetscCall(MatDestroy(&in.aij));
  if (*bad < 0) PetscCall(MatAinsworthSetPenalty(data->reduced, penalty));
  PetscCall(VecDestroy(&penalty));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Attaches null space and near null space to the operator, for hypre, and to the preconditioning matrix, for GAMG, unless that is an earlier one */
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

/* Sets up the preconditioning matrix and the inner solver, again if the first choice of its preconditioner does not fit; why: the failure, else empty */
static PetscErrorCode SetUpAnew(PC pc, PC_Ainsworth *data, Mat_Ainsworth *ctx, char why[], size_t len)
{
  PetscInt  bad = -1;
  PetscBool definite, single;
  PetscBool again = PETSC_TRUE;
  PC        inner;
  Mat       operation, M;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCAinsworthEscapeReview_Private(pc, data));
  while (again) {
    PetscCall(MatDestroy(&data->M));
    PetscCall(PCAinsworthGetPmatFormat_Private(data, &data->format));
    if (data->constraints) PetscCall(SetUpPmat(data, ctx, inner, &bad));
    else PetscCall(PCBlockSAExpect_Private(inner, data->ksp, PETSC_FALSE, &single));
    if (bad >= 0) {
      PetscCall(PetscSNPrintf(why, len,
                              "Row %" PetscInt_FMT
                              " of the preconditioning matrix holds NaN or Inf: the penalty factor, or the values of A, C or D, are too large "
                              "or too small",
                              bad));
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    PetscCall(PCAinsworthConvertPmat_Private(data));
    PetscCall(PCAinsworthSetKSPOperators_Private(data));
    PetscCall(ForwardNullSpaces(data));
    /* the preconditioner gets M_* for both operators, because GAMG and ML smooth with the first one */
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
    PetscCall(AinsworthPCSetFailedReason(inner, PC_NOERROR)); /* the reason for an earlier matrix, or type, would stay */
    PetscCall(PCAinsworthSetUpPreconditioner_Private(data, inner, &definite));
    PetscCall(PCAinsworthSetTranspose_Private(data));
    if (operation != M) inner->ops->applyrichardson = NULL; /* it would iterate with M_* */
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
    PetscCall(PCAinsworthKeepCoefficients_Private(data));
    PetscCall(KSPSetUp(data->ksp));
    PetscCall(PCAinsworthFallBack_Private(pc, data, &again));
  }
  PetscCall(PCAinsworthUseProduct_Private(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the preconditioning matrix and its preconditioner, with the operator and the constraints of the current matrix */
static PetscErrorCode KeepWhole(PC pc, PC_Ainsworth *data)
{
  PC  inner;
  Mat operation, M;

  PetscFunctionBegin;
  PetscCall(PetscInfo(pc, "The inner preconditioner is kept, the constraints are set up anew\n"));
  PetscCall(PCAinsworthReuseInner_Private(data, PETSC_TRUE));
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCGetOperators(inner, NULL, &data->M));
  PetscCall(PetscObjectReference((PetscObject)data->M));
  if (data->constraints) { /* these may belong to an earlier A or C */
    Mat_Ainsworth *ctx;

    PetscCall(MatAinsworthGetContext_Private(data->reduced, &ctx));
    PetscCall(KSPProjectedCGForget_Private(ctx));
    PetscCall(MatAinsworthSetPenalty(data->reduced, NULL));
    PetscCall(MatAinsworthSetProduct_Private(data->reduced, NULL));
  }
  PetscCall(PCAinsworthSetKSPOperators_Private(data));
  PetscCall(ForwardNullSpaces(data));
  PetscCall(KSPGetOperators(data->ksp, &operation, &M));
  if (operation != M) inner->ops->applyrichardson = NULL;
  PetscCall(PCAinsworthKeepCoefficients_Private(data));
  PetscCall(KSPSetUp(data->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether C is what it was when the inner preconditioner was made; otherwise keeping that as a whole costs more iterations than it saves */
static PetscErrorCode SameConstraints(const PC_Ainsworth *data, PetscBool *same)
{
  PetscInt  m;
  PetscBool fits;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(data->saddle.C, &m, NULL));
  PetscCall(data->source.holds(data->saddle.C, NULL, std::vector<PetscReal>(m, 0.0), same, &fits));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthSetUpInner_Private - sets up the inner preconditioner, or keeps it

   keep: it is kept if that was requested or C is the same; PCBLOCKSA keeps its levels of A then, and gets the surface of the current matrix, which costs little
*/
PetscErrorCode PCAinsworthSetUpInner_Private(PC pc, PC_Ainsworth *data, Mat_Ainsworth *ctx, PetscBool keep, char why[], size_t len)
{
  PC          inner;
  PC_BlockSA *sa;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  if (!sa) keep = (PetscBool)(keep && inner->setupcalled);
  if (!sa && keep && !PCAinsworthMustKeepInner_Private(pc, data)) PetscCall(SameConstraints(data, &keep));
  if (!sa && keep) {
    PetscCall(KeepWhole(pc, data));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PCAinsworthReuseInner_Private(data, PETSC_FALSE));
  if (sa) sa->keep = keep;
  else PetscCall(data->source.take(data->saddle.C, NULL));
  if (!keep) PetscCall(PCAinsworthForgetCounts_Private(data));
  PetscCall(SetUpAnew(pc, data, ctx, why, len));
  PetscFunctionReturn(PETSC_SUCCESS);
}
