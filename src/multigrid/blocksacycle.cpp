/*
   The multiplicative cycle of PCBLOCKSA, on the levels of a PCMG: where a level is visited twice, the visits are steps
   of Chebyshev's iteration
*/
#include "blocksaimpl.h"
#include <cmath>

/*
   The part of the spectrum of M A of a level that its two visits damp, M the cycle from this level on: the algebraic
   multilevel iteration of O. Axelsson and P. S. Vassilevski, SIAM J. Numer. Anal. 27 (1990), 1569-1590. Two visits of
   PCMG's W-cycle leave up to (1 - least)^2 = .25 of an error there, these .06.

   Iterations with PCMG's, least = .7, .5 and .3: four parts of a mesher 20, 19, 18, 17; 79, 75, 71, 68; 30, 28, 27, 26;
   18, 16, 15, 14; two cubes 9, 9, 9, 10. The smallest eigenvalue of the first coarser level was .07 to .32.
*/
static const PetscReal least = 0.5, largest = 1.0;

/* Returns the length of the first or second of two steps, the inverse of a root of Chebyshev's polynomial */
static PetscReal StepLength(PetscInt step)
{
  const PetscReal half = (largest - least) / 2 * std::sqrt(0.5);

  return 1.0 / ((largest + least) / 2 + (step ? -half : half));
}

/* Does some work as an event of -pc_mg_log, if that is on */
template <class Work>
static PetscErrorCode Timed(PetscLogEvent event, const Work &work)
{
  PetscFunctionBegin;
  if (event) PetscCall(PetscLogEventBegin(event, 0, 0, 0, 0));
  PetscCall(work());
  if (event) PetscCall(PetscLogEventEnd(event, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Smooth(PC pc, const PC_MG_Levels *level, KSP ksp, Vec b, Vec x)
{
  PetscFunctionBegin;
  PetscCall(Timed(level->eventsmoothsolve, [=] { return KSPSolve(ksp, b, x); }));
  PetscCall(KSPCheckSolve(ksp, pc, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Residual(const PC_MG_Levels *level, Vec b, Vec x, Vec r)
{
  PetscFunctionBegin;
  PetscCall(Timed(level->eventresidual, [=] { return (*level->residual)(level->A, b, x, r); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Visit(PC, PetscInt, AinsworthCycle *, PetscInt, bool, Vec, Vec);

/* Computes x = M b, M: from level l on, the coarsest is 0, smoothing, what coarser levels add, and smoothing */
static PetscErrorCode VisitOnce(PC pc, PetscInt l, AinsworthCycle *cycle, Vec b, Vec x)
{
  PC_MG_Levels *level = ((PC_MG *)pc->data)->levels[l], *coarse = l ? ((PC_MG *)pc->data)->levels[l - 1] : NULL;

  PetscFunctionBegin;
  PetscCall(VecSet(x, 0.0)); /* the smoothers see its norm */
  PetscCall(Smooth(pc, level, level->smoothd, b, x));
  if (!coarse) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Residual(level, b, x, level->r));
  PetscCall(Timed(level->eventinterprestrict, [=] { return MatRestrict(level->restrct, level->r, coarse->b); }));
  PetscCall(Visit(pc, l - 1, cycle, l > 1 ? level->cycles : 1, true, coarse->b, coarse->x));
  PetscCall(Timed(level->eventinterprestrict, [=] { return MatInterpolateAdd(level->interpolate, coarse->x, x, x); }));
  PetscCall(Smooth(pc, level, level->smoothu, b, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes x from b by so many visits of level l, the second of which begins with what the first one leaves */
static PetscErrorCode Visit(PC pc, PetscInt l, AinsworthCycle *cycle, PetscInt visits, bool accelerated, Vec b, Vec x)
{
  const PC_MG_Levels *level = ((PC_MG *)pc->data)->levels[l];

  PetscFunctionBegin;
  PetscCall(VisitOnce(pc, l, cycle, b, x));
  if (visits == 1) PetscFunctionReturn(PETSC_SUCCESS);
  cycle->left.resize(PetscMax(cycle->left.size(), (size_t)l + 1));
  cycle->step.resize(cycle->left.size());
  for (auto *v : {&cycle->left[l], &cycle->step[l]})
    if (!*v) PetscCall(VecDuplicate(b, v->out()));
  const Vec left = cycle->left[l], step = cycle->step[l];
  if (accelerated) PetscCall(VecScale(x, StepLength(0)));
  for (PetscInt k = 1; k < visits; k++) {
    PetscCall(Residual(level, b, x, left));
    PetscCall(VisitOnce(pc, l, cycle, left, step));
    PetscCall(VecAXPY(x, accelerated ? StepLength(k) : 1.0, step));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCBlockSACycle_Private - applies the multiplicative cycle of a PCMG, or PCBLOCKSA, that is set up, from zero.
   Collective
*/
PetscErrorCode PCBlockSACycle_Private(PC pc, AinsworthCycle *cycle, Vec b, Vec x)
{
  const PC_MG *mg = (PC_MG *)pc->data;

  PetscFunctionBegin;
  if (mg->stageApply) PetscCall(PetscLogStagePush(mg->stageApply));
  PetscCall(Visit(pc, mg->nlevels - 1, cycle, mg->cyclesperpcapply, false, b, x));
  if (mg->stageApply) PetscCall(PetscLogStagePop());
  PetscFunctionReturn(PETSC_SUCCESS);
}
