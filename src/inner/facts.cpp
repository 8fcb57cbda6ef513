/*
   Facts for the plan of the inner solver, and for the ladder: what the system is, what the program chose, what was
   tried (inner/plan.h, inner/ladder.h)
*/
#include "solver.h"
#include "whole.h"
#include <petsc/private/pcimpl.h> /* setfromoptionscalled, failedreasonrank */

/* Returns whether the options of the PC, and so those of its inner solver, are read */
PetscBool AinsworthSolverReadsOptions(PC pc)
{
  return (PetscBool)pc->setfromoptionscalled;
}

/* Forgets the failure of a preconditioner, ours or the inner one, on this rank */
PetscErrorCode AinsworthSolverForgetFailure(PC pc)
{
  PetscFunctionBegin;
  PetscCall(AinsworthPCSetFailedReason(pc, PC_NOERROR));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Systems with at most this many unknowns are factored at once: PCBLOCKSA would have a single level, and factor it */
static const PetscInt single = 600;

/*
   AinsworthSolverInnerType - returns the type of a preconditioner that we choose; NULL for that of the program, and if
   no package can factor M_*
*/
PCType AinsworthSolverInnerType(const AinsworthSolver *solver, AinsworthPreconditioner preconditioner)
{
  MatSolverType package;

  switch (preconditioner) {
  case AINSWORTH_INNER_BLOCKS:
    return PCBLOCKSA;
  case AINSWORTH_INNER_AMG:
    return PetscDefined(HAVE_HYPRE) ? PCHYPRE : PCGAMG;
  case AINSWORTH_INNER_FACTOR:
    return AinsworthSolverFactorType(solver, &package);
  default:
    return NULL;
  }
}

/*
   Gets what the program chose of the inner solver: names in options count until they have been read, then the types
   that it has
*/
static PetscErrorCode GetGiven(PC pc, const AinsworthSolver *solver, AinsworthPlanFacts *facts)
{
  const AinsworthInner *in   = &solver->inner;
  const bool            read = AinsworthSolverReadsOptions(pc);
  const char           *ours = AinsworthSolverMethodType(in->plan.method);
  char                  method[256], type[256];
  PetscBool             given, norm, projected, conjugate, same = PETSC_FALSE, once;
  PCType                has;
  PC                    inner;
  PetscOptions          options;
  const char           *prefix = AinsworthSolverPrefix(solver);

  PetscFunctionBegin;
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PetscObjectGetOptions((PetscObject)in->ksp, &options));
  PetscCall(PetscOptionsGetString(options, prefix, "-ksp_type", method, sizeof(method), &given));
  PetscCall(PetscOptionsHasName(options, prefix, "-ksp_norm_type", &norm));
  if (in->configured || !given || !read)
    PetscCall(PetscStrncpy(method, AinsworthTypeName((PetscObject)in->ksp), sizeof(method)));
  if (ours) PetscCall(PetscStrcmp(method, ours, &same));
  PetscCall(PetscStrcmp(method, KSPPROJECTEDCG, &projected));
  PetscCall(PetscStrcmp(method, KSPPREONLY, &once));
  PetscCall(AinsworthSolverIsConjugateGradients(method, &conjugate));
  facts->projected = projected || same;
  facts->open      = !((given || norm) && read) && solver->choices.variant == PC_AINSWORTH_WEIGHTED;
  facts->conjugate = conjugate || once;
  PetscCall(PetscOptionsGetString(options, prefix, "-pc_type", type, sizeof(type), &given));
  PetscCall(PCGetType(inner, &has));
  ours = AinsworthSolverInnerType(solver, in->plan.preconditioner);
  same = PETSC_FALSE;
  if (in->plan.preconditioner == AINSWORTH_INNER_FACTOR)
    PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &same, PCCHOLESKY, PCLU, ""));
  else if (ours && has) PetscCall(PetscStrcmp(has, ours, &same));
  facts->own = !(given && read) && (!has || same);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tells whether the program attached a null space to A, or to the whole matrix; known: from set-up */
static PetscErrorCode IsRegular(const AinsworthSolver *solver, PetscBool known, bool *regular)
{
  MatNullSpace common;

  PetscFunctionBegin;
  known = (PetscBool)(known && solver->saddle->constraints());
  if (known) PetscCall(MatGetNullSpace(solver->reduced->mat, &common));
  else PetscCall(AinsworthSaddleCreateNullSpace(solver->saddle.get(), &common));
  *regular = !common;
  if (!known) PetscCall(MatNullSpaceDestroy(&common));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses the rung after `end` of the rung `now`, or the first one. Collective, the same on all ranks */
static PetscErrorCode NextRung(PC pc, const AinsworthSolver *solver, const AinsworthPlanFacts &given, AinsworthRung now,
                               AinsworthEnd end, AinsworthLadderStep *step)
{
  const AinsworthSaddle *sp = solver->saddle.get();
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
  facts.cap   = solver->choices.ladder;
  facts.own   = given.own;
  facts.small = n <= single;
  facts.gmres = !given.projected || !given.open || !sp->symmetric || !sp->adjoint ||
                solver->settings.stop == AINSWORTH_STOP_ENERGY_ERROR; /* GMRES has no estimate of that error */
  facts.factors = solver->history.factor != AINSWORTH_FAILED && given.rows &&
                  AinsworthSolverFactorType(solver, &package);
  if (now != AINSWORTH_RUNG_NONE || facts.small)
    PetscCall(IsRegular(solver, (PetscBool)(end == AINSWORTH_END_DEAR), &facts.regular));
  *step = AinsworthLadderNext(facts);
  if (step->next != AINSWORTH_RUNG_WHOLE) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthFindOpaque(sp->A, &opaque)); /* what follows costs something */
  facts.regular = facts.regular && !sp->nullSpace;
  facts.entries = !opaque;
  if (facts.regular && facts.entries) {
    PetscCall(AinsworthWholePredict(sp, (PetscBool)(sp->symmetric && sp->adjoint), &cost));
    PetscCall(AinsworthSolverLeastMemory(PetscObjectComm((PetscObject)pc), &memory));
    facts.bytes  = AinsworthFactorBytes(&cost);
    facts.memory = memory;
  }
  *step = AinsworthLadderNext(facts);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers the facts of the plan; collective, the same on all ranks */
static PetscErrorCode GetFacts(PC pc, const AinsworthSolver *solver, AinsworthPlanFacts *facts)
{
  const PetscInt bs = PetscMax(solver->saddle->bs, solver->saddle->scattered);

  PetscFunctionBegin;
  PetscCall(GetGiven(pc, solver, facts));
  facts->constraints = solver->saddle->constraints() > 0;
  facts->symmetric   = solver->saddle->symmetric;
  facts->adjoint     = solver->saddle->adjoint;
  facts->rows        = solver->choices.pmat.penalty == AINSWORTH_PENALTY_ROW;
  /*
     in complex arithmetic there is no hypre, and PCGAMG restricts by P^T, not by the adjoint, so that its cycle is not
     Hermitian
  */
  facts->nodes   = PetscDefined(USE_COMPLEX) || (bs > 1 && bs < 6);
  facts->history = solver->history;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverPlan - chooses the inner solver (docs/method.md, inner solver). Collective, the same on all ranks */
PetscErrorCode AinsworthSolverPlan(PC pc, const AinsworthSolver *solver, AinsworthPlan *plan)
{
  AinsworthPlanFacts  facts;
  AinsworthLadderStep first;

  PetscFunctionBegin;
  PetscCall(GetFacts(pc, solver, &facts));
  PetscCall(NextRung(pc, solver, facts, AINSWORTH_RUNG_NONE, AINSWORTH_END_ANSWER, &first));
  facts.tiny = first.next == AINSWORTH_RUNG_FACTOR;
  *plan      = AinsworthPlanInner(facts);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverNextRung - chooses the solver after the present one, which ended like `end`. Collective, the same on
   all ranks
*/
PetscErrorCode AinsworthSolverNextRung(PC pc, const AinsworthSolver *solver, AinsworthEnd end,
                                       AinsworthLadderStep *step)
{
  AinsworthPlanFacts facts;

  PetscFunctionBegin;
  PetscCall(GetFacts(pc, solver, &facts));
  PetscCall(NextRung(pc, solver, facts, AinsworthPlanRung(solver->history), end, step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the number of unknowns, and of the entries of A */
PetscErrorCode AinsworthSolverMeasure(const AinsworthSolver *solver, PetscInt *n, PetscReal *entries)
{
  Mat     aij;
  MatInfo info;

  PetscFunctionBegin;
  PetscCall(MatGetSize(solver->saddle->A, n, NULL));
  PetscCall(AinsworthGetAIJ(solver->saddle->A, &aij));
  PetscCall(MatGetInfo(aij, MAT_GLOBAL_SUM, &info));
  *entries = (PetscReal)info.nz_used;
  PetscCall(MatDestroy(&aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverRememberFactor - remembers what became of a factorization of M_*, for which matrix, and why it was
   made
*/
PetscErrorCode AinsworthSolverRememberFactor(AinsworthSolver *solver, AinsworthTried tried, const char why[])
{
  PetscFunctionBegin;
  solver->history.factor = tried;
  PetscCall(AinsworthSolverMeasure(solver, &solver->escape.n, &solver->escape.entries));
  if (why != solver->escape.why) PetscCall(PetscStrncpy(solver->escape.why, why, sizeof(solver->escape.why)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverReview - forgets before a set-up what was tried for another matrix

   A factorization stands as long as the number of unknowns and the symmetry stay the same, the number of entries about
   the same, and the program makes no choice of its own
*/
PetscErrorCode AinsworthSolverReview(PC pc, AinsworthSolver *solver)
{
  AinsworthEscape   *e = &solver->escape;
  PetscInt           n;
  PetscReal          entries;
  AinsworthPlanFacts facts;
  PetscBool          same = PETSC_TRUE;
  PCType             type = AinsworthSolverInnerType(solver, AINSWORTH_INNER_FACTOR);
  PC                 inner;

  PetscFunctionBegin;
  e->facts = AinsworthPriceFacts();
  if (solver->history.factor == AINSWORTH_UNTRIED) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetGiven(pc, solver, &facts));
  PetscCall(AinsworthSolverMeasure(solver, &n, &entries));
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  if (solver->history.factor == AINSWORTH_TAKEN && solver->inner.plan.preconditioner == AINSWORTH_INNER_FACTOR)
    PetscCall(PetscObjectTypeCompare((PetscObject)inner, type ? type : "", &same));
  if (facts.own && same && n == e->n && PetscAbsReal(entries - e->entries) <= 0.25 * e->entries)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (facts.own) PetscCall(PetscInfo(pc, "The matrix is another one: multigrid is tried again\n"));
  solver->history.factor = AINSWORTH_UNTRIED;
  PetscFunctionReturn(PETSC_SUCCESS);
}
