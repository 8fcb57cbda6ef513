/* Facts for the plan of the inner solver, and for the ladder: what the system is, what the program chose, what was tried (inner/plan.h, inner/ladder.h) */
#include "pcainsworth.h"

/* Systems with at most this many unknowns are factored at once: PCBLOCKSA would have a single level, and factor it */
static const PetscInt tiny = 600;

/* PCAinsworthInnerType_Private - returns the type of a preconditioner that we choose; NULL for that of the program, and if no package can factor M_* */
PCType PCAinsworthInnerType_Private(const PC_Ainsworth *data, AinsworthPreconditioner preconditioner)
{
  MatSolverType package;

  switch (preconditioner) {
  case AINSWORTH_INNER_BLOCKS:
    return PCBLOCKSA;
  case AINSWORTH_INNER_AMG:
    return PetscDefined(HAVE_HYPRE) ? PCHYPRE : PCGAMG;
  case AINSWORTH_INNER_FACTOR:
    return PCAinsworthFactorType_Private(data, &package);
  default:
    return NULL;
  }
}

/* Gets what the program chose of the inner solver: names in options count until they have been read, then the types that it has */
static PetscErrorCode GetGiven(PC pc, const PC_Ainsworth *data, AinsworthPlanFacts *facts)
{
  const PCAinsworthInner *in   = &data->inner;
  const bool              read = PCAinsworthReadsOptions_Private(pc);
  const char             *ours = PCAinsworthMethodType_Private(in->plan.method);
  char                    method[256], type[256];
  PetscBool               given, norm, projected, conjugate, same = PETSC_FALSE, once;
  PCType                  has;
  PC                      inner;
  PetscOptions            options;
  const char             *prefix = PCAinsworthPrefix_Private(data);

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetInnerPC_Private(data, &inner));
  PetscCall(PetscObjectGetOptions((PetscObject)in->ksp, &options));
  PetscCall(PetscOptionsGetString(options, prefix, "-ksp_type", method, sizeof(method), &given));
  PetscCall(PetscOptionsHasName(options, prefix, "-ksp_norm_type", &norm));
  if (in->configured || !given || !read) PetscCall(PetscStrncpy(method, PCAinsworthTypeName_Private((PetscObject)in->ksp), sizeof(method)));
  if (ours) PetscCall(PetscStrcmp(method, ours, &same));
  PetscCall(PetscStrcmp(method, KSPPROJECTEDCG, &projected));
  PetscCall(PetscStrcmp(method, KSPPREONLY, &once));
  PetscCall(PCAinsworthIsConjugateGradients_Private(method, &conjugate));
  facts->projected = projected || same;
  facts->open      = !((given || norm) && read) && data->choices.variant == PC_AINSWORTH_WEIGHTED;
  facts->conjugate = conjugate || once;
  PetscCall(PetscOptionsGetString(options, prefix, "-pc_type", type, sizeof(type), &given));
  PetscCall(PCGetType(inner, &has));
  ours = PCAinsworthInnerType_Private(data, in->plan.preconditioner);
  same = PETSC_FALSE;
  if (in->plan.preconditioner == AINSWORTH_INNER_FACTOR) PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &same, PCCHOLESKY, PCLU, ""));
  else if (ours && has) PetscCall(PetscStrcmp(has, ours, &same));
  facts->own = !(given && read) && (!has || same);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tells whether the program attached a null space to A, or to the whole matrix; known: from set-up */
static PetscErrorCode IsRegular(const PC_Ainsworth *data, PetscBool known, bool *regular)
{
  MatNullSpace common;

  PetscFunctionBegin;
  known = (PetscBool)(known && data->saddle.constraints());
  if (known) PetscCall(MatGetNullSpace(data->reduced.mat, &common));
  else PetscCall(AinsworthSaddleCreateNullSpace(&data->saddle, &common));
  *regular = !common;
  if (!known) PetscCall(MatNullSpaceDestroy(&common));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses the rung after `end` of the rung `now`, or the first one. Collective, the same on all ranks */
static PetscErrorCode NextRung(PC pc, const PC_Ainsworth *data, const AinsworthPlanFacts &given, AinsworthRung now, AinsworthEnd end, AinsworthLadderStep *step)
{
  const AinsworthSaddle *sp = &data->saddle;
  AinsworthLadderFacts   facts;
  AinsworthCost          cost;
  MatSolverType          package;
  PetscReal              memory;
  PetscInt               n;
  Mat                    opaque;

  PetscFunctionBegin;
  PetscCall(MatGetSize(sp->A, &n, NULL));
  facts.now   = now;
  facts.end   = end;
  facts.cap   = data->choices.ladder;
  facts.own   = given.own;
  facts.small = n <= tiny;
  facts.gmres = !given.projected || !given.open || !sp->symmetric || !sp->adjoint ||
                data->reporting.settings.stop == AINSWORTH_STOP_ENERGY_ERROR; /* GMRES has no estimate of that error */
  facts.factors = data->history.factor != AINSWORTH_FAILED && given.rows && PCAinsworthFactorType_Private(data, &package);
  if (now != AINSWORTH_RUNG_NONE || facts.small) PetscCall(IsRegular(data, (PetscBool)(end == AINSWORTH_END_DEAR), &facts.regular));
  *step = AinsworthLadderNext(facts);
  if (step->next != AINSWORTH_RUNG_WHOLE) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthFindOpaque(sp->A, &opaque)); /* what follows costs something */
  facts.regular = facts.regular && !sp->nullSpace;
  facts.entries = !opaque;
  if (facts.regular && facts.entries) {
    PetscCall(AinsworthWholePredict(sp, (PetscBool)(sp->symmetric && sp->adjoint), &cost));
    PetscCall(PCAinsworthLeastMemory_Private(PetscObjectComm((PetscObject)pc), &memory));
    facts.bytes  = PCAinsworthFactorBytes_Private(&cost);
    facts.memory = memory;
  }
  *step = AinsworthLadderNext(facts);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers the facts of the plan; collective, the same on all ranks */
static PetscErrorCode GetFacts(PC pc, const PC_Ainsworth *data, AinsworthPlanFacts *facts)
{
  const PetscInt bs = PetscMax(data->saddle.bs, data->saddle.scattered);

  PetscFunctionBegin;
  PetscCall(GetGiven(pc, data, facts));
  facts->constraints = data->saddle.constraints() > 0;
  facts->symmetric   = data->saddle.symmetric;
  facts->adjoint     = data->saddle.adjoint;
  facts->rows        = data->choices.pmat.penalty == AINSWORTH_PENALTY_ROW;
  /* in complex arithmetic there is no hypre, and PCGAMG restricts by P^T, not by the adjoint, so that its cycle is not Hermitian */
  facts->nodes   = PetscDefined(USE_COMPLEX) || (bs > 1 && bs < 6);
  facts->history = data->history;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthPlan_Private - chooses the inner solver (docs/method.md, inner solver). Collective, the same on all ranks */
PetscErrorCode PCAinsworthPlan_Private(PC pc, const PC_Ainsworth *data, AinsworthPlan *plan)
{
  AinsworthPlanFacts  facts;
  AinsworthLadderStep first;

  PetscFunctionBegin;
  PetscCall(GetFacts(pc, data, &facts));
  PetscCall(NextRung(pc, data, facts, AINSWORTH_RUNG_NONE, AINSWORTH_END_ANSWER, &first));
  facts.tiny = first.next == AINSWORTH_RUNG_FACTOR;
  *plan      = AinsworthPlanInner(facts);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthNextRung_Private - chooses the solver after the present one, which ended like `end`. Collective, the same on all ranks */
PetscErrorCode PCAinsworthNextRung_Private(PC pc, const PC_Ainsworth *data, AinsworthEnd end, AinsworthLadderStep *step)
{
  AinsworthPlanFacts facts;

  PetscFunctionBegin;
  PetscCall(GetFacts(pc, data, &facts));
  PetscCall(NextRung(pc, data, facts, AinsworthPlanRung(data->history), end, step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the number of unknowns, and of the entries of A */
PetscErrorCode PCAinsworthMeasure_Private(const PC_Ainsworth *data, PetscInt *n, PetscReal *entries)
{
  Mat     aij;
  MatInfo info;

  PetscFunctionBegin;
  PetscCall(MatGetSize(data->saddle.A, n, NULL));
  PetscCall(AinsworthGetAIJ(data->saddle.A, &aij));
  PetscCall(MatGetInfo(aij, MAT_GLOBAL_SUM, &info));
  *entries = (PetscReal)info.nz_used;
  PetscCall(MatDestroy(&aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthRememberFactor_Private - remembers what became of a factorization of M_*, for which matrix, and why it was made */
PetscErrorCode PCAinsworthRememberFactor_Private(PC_Ainsworth *data, AinsworthTried tried, const char why[])
{
  PetscFunctionBegin;
  data->history.factor = tried;
  PetscCall(PCAinsworthMeasure_Private(data, &data->escape.n, &data->escape.entries));
  if (why != data->escape.why) PetscCall(PetscStrncpy(data->escape.why, why, sizeof(data->escape.why)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthReview_Private - forgets before a set-up what was tried for another matrix

   A factorization stands as long as the number of unknowns and the symmetry stay the same, the number of entries about the same, and the program makes no
   choice of its own
*/
PetscErrorCode PCAinsworthReview_Private(PC pc, PC_Ainsworth *data)
{
  PCAinsworthEscape *e = &data->escape;
  PetscInt           n;
  PetscReal          entries;
  AinsworthPlanFacts facts;
  PetscBool          same = PETSC_TRUE;
  PCType             type = PCAinsworthInnerType_Private(data, AINSWORTH_INNER_FACTOR);
  PC                 inner;

  PetscFunctionBegin;
  e->facts = AinsworthPriceFacts();
  if (data->history.factor == AINSWORTH_UNTRIED) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetGiven(pc, data, &facts));
  PetscCall(PCAinsworthMeasure_Private(data, &n, &entries));
  PetscCall(PCAinsworthGetInnerPC_Private(data, &inner));
  if (data->history.factor == AINSWORTH_TAKEN && data->inner.plan.preconditioner == AINSWORTH_INNER_FACTOR)
    PetscCall(PetscObjectTypeCompare((PetscObject)inner, type ? type : "", &same));
  if (facts.own && same && n == e->n && PetscAbsReal(entries - e->entries) <= 0.25 * e->entries) PetscFunctionReturn(PETSC_SUCCESS);
  if (facts.own) PetscCall(PetscInfo(pc, "The matrix is another one: multigrid is tried again\n"));
  data->history.factor = AINSWORTH_UNTRIED;
  PetscFunctionReturn(PETSC_SUCCESS);
}
