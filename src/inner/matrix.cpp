/* Creates M_*, or what multigrid in Ker C has in its place */
#include "solver.h"
#include "../multigrid/blocksa.h"
#include "../base/objects.h"
#include "../projection/matainsworth.h"
#include "../projection/surface.h"

/* Returns the chosen type or, for auto, that of the last set-up; jcb before */
PCAinsworthPmatType AinsworthSolverPmatTypeInUse(const AinsworthSolver *solver)
{
  return solver->choices.pmat.type == PC_AINSWORTH_PMAT_AUTO ? solver->inner.autoType : solver->choices.pmat.type;
}

PetscReal AinsworthSolverPenaltyFactor(const AinsworthSolver *solver)
{
  const AinsworthPmatOptions &pmat = solver->choices.pmat;

  if (pmat.factor != (PetscReal)PETSC_DEFAULT) return pmat.factor;
  /* paper, section 3.3; measured, docs/method.md: without Q_* only the penalty tells AMG about the constraints */
  if (pmat.penalty == AINSWORTH_PENALTY_NORM) return 5.0;
  if (AinsworthSolverPmatTypeInUse(solver) != PC_AINSWORTH_PMAT_ID) return 0.5;
  if (solver->inner.format == AINSWORTH_PMAT_FACTOR) return 1e4; /* one iteration reduces the error to 1 / gamma */
  return solver->inner.format == AINSWORTH_PMAT_SUM ? 2.0 : 10.0;
}

/*
   Chooses the type of auto (docs/method.md): id where its few entries are enough or jcb would have too many, otherwise
   jcb

   With id the penalties of many rows that share an unknown add up, and lock interpolation from A alone; jcb avoids that
*/
static PetscErrorCode ChoosePmatType(AinsworthSolver *solver, const AinsworthPmatInputs *in, PetscBool shares)
{
  static const PetscReal most = 1.5; /* times the entries of A */
  PetscReal              predicted;
  PetscBool              apart;

  PetscFunctionBegin;
  solver->inner.autoType   = PC_AINSWORTH_PMAT_JCB;
  solver->inner.autoReason = "";
  if (solver->choices.pmat.penalty != AINSWORTH_PENALTY_ROW) PetscFunctionReturn(PETSC_SUCCESS);
  solver->inner.autoType = PC_AINSWORTH_PMAT_ID;
  if (in->inKernel) {
    solver->inner.autoType   = PC_AINSWORTH_PMAT_JCB;
    solver->inner.autoReason = ", for coarse functions in Ker C";
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  solver->inner.autoReason = ", as it is factored";
  if (in->format == AINSWORTH_PMAT_FACTOR) PetscFunctionReturn(PETSC_SUCCESS);
  solver->inner.autoReason = ", as interpolation is made from A alone";
  if (in->format == AINSWORTH_PMAT_SUM) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthPmatComponentsApart(in->C, solver->saddle->bs, in->fill.most, &apart));
  solver->inner.autoReason = ", as the constraints keep components apart";
  if (apart && !shares) PetscFunctionReturn(PETSC_SUCCESS);
  solver->inner.autoReason = ", as jcb would have too many entries";
  PetscCall(AinsworthPmatPredict(in->aij, in->C, NULL, &in->fill, &predicted));
  if (predicted > most * in->fill.entries) PetscFunctionReturn(PETSC_SUCCESS);
  solver->inner.autoType   = PC_AINSWORTH_PMAT_JCB;
  solver->inner.autoReason = shares ? ", as many constraints share an unknown" : ", as the constraints mix components";
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* What a subspace uses, for as long as it exists */
struct Used {
  std::shared_ptr<const AinsworthSurface> surface;
  AinsworthPmatInKernel                   made = {};
  AinsworthPmatSlack                      slack;
  AinsworthRef<Vec>                       values;

  ~Used()
  {
    for (Vec &row : made.rows) (void)VecDestroy(&row);
    (void)MatDestroy(&made.correction);
  }
};
} // namespace

/* Gets the surface of the projector or, with slack unknowns, creates that of the rows that have these. Collective */
static PetscErrorCode SetUpSurface(const Mat_Ainsworth *ctx, Used *used)
{
  auto              surface = std::make_shared<AinsworthSurface>();
  AinsworthRef<Mat> C;

  PetscFunctionBegin;
  used->surface = ctx->proj.surface;
  if (!used->slack.C) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthProjectorMoveRows(&ctx->proj, used->slack.C, C.out()));
  PetscCall(surface->create(C, used->slack.weight, NULL));
  used->surface = surface;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lets multigrid stay in Ker C: it projects what it smooths, and what it interpolates to the finest level */
static PetscErrorCode SetSubspace(Mat_Ainsworth *ctx, const std::shared_ptr<Used> &used, PC inner)
{
  AinsworthProjector *proj     = &ctx->proj;
  auto                subspace = std::make_shared<AinsworthSubspace>();

  PetscFunctionBegin;
  PetscCall(SetUpSurface(ctx, used.get()));
  const AinsworthSurface &surface = *used->surface;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, (PetscInt)surface.places().size(), used->values.out()));
  subspace->map = used->slack.map;
  if (used->slack.map)
    subspace->extend = [used](Mat A, Mat *extended) { return AinsworthPmatSlackExtend(&used->slack, A, extended); };
  subspace->places      = surface.places();
  subspace->carried     = used->made.carried;
  subspace->correction  = used->made.correction;
  subspace->embedded    = used->made.left;
  subspace->rows        = used->made.rows;
  subspace->weight.assign(surface.weights().begin(), surface.weights().begin() + surface.places().size());
  subspace->excess  = proj->polynomial ? proj->polynomial->excess : 0.0;
  subspace->values  = used->values;
  subspace->project = [used, proj](bool adjoint, Vec x) {
    PetscScalar *v;

    PetscFunctionBegin;
    PetscCall(VecGetArray(x, &v));
    PetscCall(AinsworthProjectorSubtract(proj, *used->surface, adjoint, v));
    PetscCall(VecRestoreArray(x, &v));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  PetscCall(PCBlockSASetSubspace_Private(inner, subspace, used->slack.A));
  for (Mat *M : {&used->slack.A, &used->slack.C}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether multigrid works in Ker C, and needs no M_*: for a symmetric A with the diagonal weight, if the method
   iterates in Ker C, or if its operator has no penalty, or is not used, or with springs of their own. Collective
*/
static PetscErrorCode WorksInKernel(AinsworthSolver *solver, const Mat_Ainsworth *ctx, const AinsworthPmatInputs *in,
                                    const AinsworthCompliance *compliance, PetscBool *works)
{
  PC          inner;
  PC_BlockSA *sa = NULL;
  PetscInt    n;
  PCSide      side;
  PetscBool   once;

  PetscFunctionBegin;
  *works = PETSC_FALSE;
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  PetscCall(MatGetSize(in->A, &n, NULL));
  if (!sa || n <= sa->options.coarseSize || !solver->saddle->symmetric ||
      ctx->weightType != MAT_AINSWORTH_WEIGHT_DIAGONAL)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (compliance && solver->saddle->adjoint) PetscCall(AinsworthPmatHasSlack(in, compliance, works));
  if (compliance) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSolverIteratesInKernel(solver, works));
  PetscCall(KSPGetPCSide(solver->inner.ksp, &side));
  PetscCall(PetscObjectTypeCompare((PetscObject)solver->inner.ksp, KSPPREONLY, &once));
  if ((side == PC_RIGHT || once) && solver->choices.variant == PC_AINSWORTH_WEIGHTED) *works = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates slack unknowns for the springs of D, and the inputs that have them */
static PetscErrorCode AddSlack(PC inner, const AinsworthCompliance *compliance, const AinsworthPmatInputs *in,
                               AinsworthPmatSlack *slack, AinsworthPmatInputs *extended)
{
  PetscInt              n, others, bs;
  std::vector<PetscInt> order;

  PetscFunctionBegin;
  PetscCall(PCBlockSAFindNodes_Private(in->bs, in->A, &bs, &order));
  PetscCall(MatGetLocalSize(in->A, NULL, &n));
  PetscCall(PCBlockSACountOthers_Private(inner, n, &others));
  PetscCall(AinsworthPmatCreateSlack(in, compliance, bs, order, others, slack));
  *extended   = *in;
  extended->A = extended->aij = slack->A;
  extended->C                 = slack->C;
  extended->weight            = slack->weight;
  extended->springs           = slack->numbers.data();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverSetUpAlone - creates the preconditioning matrix without constraints, if the preconditioner takes
   another one than that of the program. Collective
*/
PetscErrorCode AinsworthSolverSetUpAlone(AinsworthSolver *solver, PC inner)
{
  AinsworthPmatInputs in;

  PetscFunctionBegin;
  PetscCall(PCBlockSASetSubspace_Private(inner, NULL, NULL)); /* of constraints that are gone */
  PetscCall(PCBlockSAExpect_Private(inner, solver->inner.ksp, PETSC_FALSE, &in.single));
  if (solver->inner.format != AINSWORTH_PMAT_HYPRE) PetscFunctionReturn(PETSC_SUCCESS);
  in.format          = solver->inner.format;
  in.bs              = solver->saddle->bs;
  in.inverseDiagonal = solver->reduced->inverseDiagonal;
  PetscCall(AinsworthGetAIJ(solver->saddle->P, &in.aij));
  PetscCall(AinsworthPmatCreateAlone(&in, solver->saddle->symmetric, solver->inner.M.out()));
  PetscCall(MatDestroy(&in.aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Conjugate gradients move at most this many shared unknowns; each costs an application of the preconditioner and a
   vector
*/
static const size_t mostShared = 16;

/*
   AinsworthSolverSetUpPmat - creates the preconditioning matrix, and sets its penalty in the operator; bad: a row with
   NaN or Inf, negative if none
*/
PetscErrorCode AinsworthSolverSetUpPmat(AinsworthSolver *solver, PC inner, PetscInt *bad)
{
  Mat_Ainsworth             *ctx;
  AinsworthPmatInputs        in, kernel;
  AinsworthPmatOptions       options = solver->choices.pmat;
  Vec                        penalty;
  Mat                        M;
  std::vector<PetscInt>      alone;
  PetscBool                  inKernel, works, shares;
  auto                       used = std::make_shared<Used>();
  const AinsworthCompliance *compliance;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUpProjector_Private(solver->reduced->mat, &ctx));
  in.A  = solver->saddle->P;
  in.bs = solver->saddle->bs;
  in.C  = solver->saddle->kept.C;
  PetscCall(MatAinsworthGetCompliance_Private(solver->reduced->mat, &compliance));
  in.compliance      = compliance ? compliance->sums : NULL;
  in.N               = compliance ? compliance->N : NULL;
  in.weight          = ctx->mobility;
  in.inverseDiagonal = solver->reduced->inverseDiagonal;
  in.format          = solver->inner.format;
  PetscCall(AinsworthGetAIJ(in.A, &in.aij));
  PetscCall(AinsworthPmatGetFill(in.aij, in.C, &in.fill));
  solver->inner.longRows = in.fill.leftOut;
  PetscCall(AinsworthPmatFindShared(in.aij, in.C, &in.fill, &shares, &alone));
  PetscCall(AinsworthSolverIteratesInKernel(solver, &inKernel));
  PetscCall(WorksInKernel(solver, ctx, &in, compliance, &works));
  in.inKernel = works ? &used->made : NULL;
  if (works && compliance) PetscCall(AddSlack(inner, compliance, &in, &used->slack, &kernel));
  else if (works) {
    kernel = in;
    PetscCall(MatAinsworthGetPlaced_Private(solver->reduced->mat, &kernel.C, &kernel.WCt, &kernel.S));
  }
  in.kernel             = works ? &kernel : NULL;
  solver->inner.springs = (PetscBool)(works && compliance);
  PetscCall(PCBlockSAExpect_Private(inner, solver->inner.ksp, (PetscBool)(solver->inner.longRows > 0 && !in.inKernel),
                                    &in.single));
  if (!in.inKernel && inKernel && in.format != AINSWORTH_PMAT_FACTOR && alone.size() <= mostShared)
    in.shared.swap(alone);
  solver->inner.left.longest = solver->inner.longRows && !in.inKernel ? in.fill.most : PETSC_MAX_INT;
  solver->inner.left.shared  = in.shared;
  if (solver->choices.pmat.type == PC_AINSWORTH_PMAT_AUTO) PetscCall(ChoosePmatType(solver, &in, shares));
  options.type      = AinsworthSolverPmatTypeInUse(solver);
  options.symmetric = solver->saddle->symmetric;
  options.factor    = AinsworthSolverPenaltyFactor(solver);
  PetscCall(AinsworthPmatCreate(&in, &options, &penalty, &M, bad));
  if (in.inKernel) PetscCall(SetSubspace(ctx, used, inner));
  else PetscCall(PCBlockSASetSubspace_Private(inner, NULL, NULL));
  if (*bad < 0 && !solver->saddle->symmetric && solver->inner.format == AINSWORTH_PMAT_AIJ)
    PetscCall(AinsworthMakePatternSymmetric(&M)); /* PETSc's orderings do not terminate otherwise */
  solver->inner.M = AinsworthOwn(M);
  PetscCall(MatDestroy(&in.aij));
  if (*bad < 0) PetscCall(MatAinsworthSetPenalty(solver->reduced->mat, penalty));
  PetscCall(VecDestroy(&penalty));
  for (Mat *M : {&kernel.WCt, &kernel.S}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}
