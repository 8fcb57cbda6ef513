#include "plan.h"

/* Returns the method, and why */
static AinsworthMethod Method(const AinsworthPlanFacts &f, const char **why)
{
  const bool other = f.projected && f.open;

  *why = "the program chose it";
  if (!f.projected) return AINSWORTH_METHOD_GIVEN;
  *why = "A is not symmetric";
  if (other && !f.symmetric) return AINSWORTH_METHOD_GMRES;
  *why = "the blocks (0,1) and (1,0) are not adjoint";
  if (other && !f.adjoint) return AINSWORTH_METHOD_GMRES;
  *why = "conjugate gradients gave no answer";
  if (other && f.history.gmres == AINSWORTH_TAKEN) return AINSWORTH_METHOD_GMRES;
  *why = "there are no constraints";
  if (!f.constraints) return AINSWORTH_METHOD_CG;
  *why = "A and C allow it";
  return AINSWORTH_METHOD_PROJECTED;
}

/* Returns the preconditioner for a method, and why */
static AinsworthPreconditioner Preconditioner(const AinsworthPlanFacts &f, AinsworthMethod method, const char **why)
{
  *why = "the program chose it";
  if (!f.own) return AINSWORTH_INNER_GIVEN;
  *why = "it took the place of multigrid";
  if (f.history.factor == AINSWORTH_TAKEN) return AINSWORTH_INNER_FACTOR;
  *why = "multigrid is not worth its set-up";
  if (f.tiny && f.history.factor == AINSWORTH_UNTRIED) return AINSWORTH_INNER_FACTOR;
  *why = "block smoothed aggregation does not fit A";
  if (f.history.blocks == AINSWORTH_FAILED) return AINSWORTH_INNER_AMG;
  *why = "A is not symmetric";
  if (!f.symmetric) return AINSWORTH_INNER_AMG;
  *why = "the method may need its transpose, or no symmetry";
  if (method == AINSWORTH_METHOD_GIVEN && !f.conjugate) return AINSWORTH_INNER_AMG;
  *why = "the penalty is that of the paper";
  if (!f.rows) return AINSWORTH_INNER_AMG;
  *why = "A does not couple nodes of two to five unknowns";
  if (!f.nodes) return AINSWORTH_INNER_AMG;
  *why = "A couples nodes";
  return AINSWORTH_INNER_BLOCKS;
}

/* AinsworthPlanInner - chooses the method and the preconditioner of the reduced solve */
AinsworthPlan AinsworthPlanInner(const AinsworthPlanFacts &facts)
{
  AinsworthPlan plan;

  plan.method         = Method(facts, &plan.why[0]);
  plan.preconditioner = Preconditioner(facts, plan.method, &plan.why[1]);
  return plan;
}

/* AinsworthPlanRung - returns the highest rung of the ladder that was tried */
AinsworthRung AinsworthPlanRung(const AinsworthHistory &history)
{
  if (history.whole != AINSWORTH_UNTRIED) return AINSWORTH_RUNG_WHOLE;
  if (history.gmres == AINSWORTH_TAKEN) return AINSWORTH_RUNG_GMRES;
  return history.factor == AINSWORTH_TAKEN ? AINSWORTH_RUNG_FACTOR : AINSWORTH_RUNG_MULTIGRID;
}
