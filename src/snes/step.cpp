/* The linear solve of a step and its tolerance */
#include "activeset.h"
#include "../saddle/saddle.h"
#include <petsc/private/kspimpl.h> /* rnorm0 */
#include <cmath>

/*
   Updates the matrices of the step unless the held rows and the Jacobian are unchanged, so that nothing is set up then

   The largest diagonal entry is found anew when the Jacobian changes. work: overwritten
*/
static PetscErrorCode UpdateStep(Mat J, Mat P, SNES_AinsworthActiveSet *as, Vec keep, Vec work)
{
  uint64_t  state[2] = {0, 0};
  PetscBool same[2]; /* the Jacobian, and the Jacobian with the held rows */

  PetscFunctionBegin;
  PetscCall(AinsworthMatGetState(J, &state[0]));
  if (P != J) PetscCall(AinsworthMatGetState(P, &state[1]));
  same[0] = (PetscBool)(as->step && as->state[0] == state[0] && as->state[1] == state[1]);
  same[1] = (PetscBool)(same[0] && as->solved == as->hold);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, same, 2, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)J)));
  if (!same[0]) {
    PetscCall(MatGetDiagonal(J, work));
    PetscCall(VecNorm(work, NORM_INFINITY, &as->diagonal));
  }
  if (same[1]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatDestroy(&as->step));
  PetscCall(MatDestroy(&as->pstep));
  PetscCall(AinsworthStepMatCreate(J, as->bounded, keep, &as->step));
  if (P != J) PetscCall(AinsworthStepMatCreate(P, as->bounded, keep, &as->pstep));
  for (int k = 0; k < 2; k++) as->state[k] = state[k];
  as->solved = as->hold;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the solver whose tolerance counts: with KSPPREONLY that of the reduced system, or NULL if there is none */
static PetscErrorCode GetSolver(KSP ksp, KSP *solver)
{
  PetscBool once, ours;
  PC        pc;

  PetscFunctionBegin;
  *solver = ksp;
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPPREONLY, &once));
  if (!once) PetscFunctionReturn(PETSC_SUCCESS);
  *solver = NULL;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCAINSWORTH, &ours));
  if (!ours) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPSetUp(ksp)); /* reads the options of the inner solver */
  PetscCall(PCAinsworthGetKSP(pc, solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Returns the relative tolerance of the next linear solve

   It is loose if rows were wrong. If F followed its linearization, the error of x, not that of the step, has to come
   down to rtol; otherwise it is rtol
*/
static PetscReal ToleranceOf(const SNES_AinsworthActiveSet *as, PetscReal rtol)
{
  static const PetscReal margin = 0.5;

  if (as->tight) return rtol;
  if (as->left < 0.0) return PetscMax(rtol, as->loose);
  return as->linear ? PetscMax(rtol, PetscMin(as->loose, margin * rtol / as->left)) : rtol;
}

/*
   Calls KSPSolve() with the tolerance of the step, and records the reduction of the residual, 0 if the method does not
   tell
*/
static PetscErrorCode SolveLoosely(KSP ksp, SNES_AinsworthActiveSet *as, Vec rhs, Vec Y)
{
  KSP            solver;
  PetscReal      rtol, atol, dtol, norm;
  PetscInt       most;
  PetscErrorCode error;

  PetscFunctionBegin;
  as->asked = as->reached = 0.0;
  PetscCall(GetSolver(ksp, &solver));
  if (!solver) {
    PetscCall(KSPSolve(ksp, rhs, Y));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(KSPGetTolerances(solver, &rtol, &atol, &dtol, &most));
  PetscCall(KSPSetTolerances(solver, ToleranceOf(as, rtol), atol, dtol, most));
  solver->rnorm0 = 0.0;
  error          = KSPSolve(ksp, rhs, Y); /* checked when the tolerances are restored */
  PetscCall(KSPSetTolerances(solver, rtol, atol, dtol, most));
  PetscCall(error);
  PetscCall(KSPGetResidualNorm(solver, &norm));
  if (solver->rnorm0 > 0.0 && norm > 0.0) as->reached = norm / solver->rnorm0;
  as->asked = rtol;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves J Y = F, with Y = known in held rows */
PetscErrorCode AinsworthActiveSetSolveStep(SNES snes, SNES_AinsworthActiveSet *as, Vec keep, Vec known, Vec rhs, Vec Y)
{
  Mat J, P;
  Vec X, F;
  KSP ksp;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(snes, &J, &P, NULL, NULL));
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(SNESGetFunction(snes, &F, NULL, NULL));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(SNESComputeJacobian(snes, X, J, P));
  PetscCall(UpdateStep(J, P, as, keep, rhs));
  PetscCall(AinsworthStepMultKnown(J, known, rhs));
  PetscCall(VecAYPX(rhs, -1.0, F));
  PetscCall(VecPointwiseMult(rhs, keep, rhs));
  PetscCall(VecAXPY(rhs, -1.0, known)); /* held rows have -1 on the diagonal */
  PetscCall(KSPSetOperators(ksp, as->step, as->pstep ? as->pstep : as->step));
  PetscCall(SolveLoosely(ksp, as, rhs, Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether F followed its linearization, so that the only error is that of the linear solver; predicted: F - J Y
   at the old X, overwritten

   Rows with bounds are compared with the largest residual of such a row. In the others all terms cancel: they are
   compared with the rounding of the diagonal times Y or X.
*/
static PetscErrorCode WasLinear(SNES_AinsworthActiveSet *as, Vec X, Vec F, Vec Y, Vec predicted)
{
  const PetscReal ofStep = 1e4 * PETSC_MACHINE_EPSILON, ofX = 100 * PETSC_MACHINE_EPSILON;
  PetscReal       others, bounded, step, x;

  PetscFunctionBegin;
  PetscCall(VecAXPY(predicted, -1.0, F));
  PetscCall(VecNorm(predicted, NORM_INFINITY, &others));
  PetscCall(VecPointwiseMult(predicted, as->bounded, predicted));
  PetscCall(VecNorm(predicted, NORM_INFINITY, &bounded));
  PetscCall(VecNorm(Y, NORM_INFINITY, &step));
  PetscCall(VecNorm(X, NORM_INFINITY, &x));
  as->linear = others <= PetscMax(ofStep * step, ofX * x) * as->diagonal && bounded <= as->tolerance * as->largest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Estimates the error that the linear solve left, relative to the energy norm of x; Y' J Y = y' A y, because C and -C
   cancel; JY is overwritten
*/
static PetscErrorCode EstimateLeft(Mat J, SNES_AinsworthActiveSet *as, Vec X, Vec Y, Vec JY)
{
  PetscScalar energy[2];
  PetscReal   ratio = 1.0;

  PetscFunctionBegin;
  if (as->linear && as->left >= 0.0) as->left *= as->reached; /* Y was the error of the last solve */
  else {
    PetscCall(VecDot(JY, Y, &energy[0]));
    PetscCall(MatMult(J, X, JY));
    PetscCall(VecDot(JY, X, &energy[1]));
    if (PetscRealPart(energy[0]) > 0.0 && PetscRealPart(energy[1]) > 0.0)
      ratio = PetscSqrtReal(PetscRealPart(energy[0]) / PetscRealPart(energy[1]));
    as->left = as->reached * ratio;
  }
  as->exact = as->left <= as->asked || as->reached <= as->asked;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Estimates the error left by step Y, and checks linearity, if no row is wrong; otherwise the next solve is loose in
   any case

   before: F of the old X; before and JY are overwritten
*/
PetscErrorCode AinsworthActiveSetJudgeStep(SNES snes, SNES_AinsworthActiveSet *as, Vec before, Vec JY, Vec Y)
{
  Mat J;
  Vec X, F;

  PetscFunctionBegin;
  if (as->wrong) {
    as->left = -1.0;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SNESGetJacobian(snes, &J, NULL, NULL, NULL));
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(SNESGetFunction(snes, &F, NULL, NULL));
  PetscCall(MatMult(J, Y, JY));
  PetscCall(VecAXPY(before, -1.0, JY));
  PetscCall(EstimateLeft(J, as, X, Y, JY));
  PetscCall(PetscInfo(snes,
                      "The linear solve came to %g of its right-hand side: %g of the energy norm of x may be left\n",
                      (double)as->reached, (double)as->left));
  PetscCall(WasLinear(as, X, F, Y, before));
  PetscFunctionReturn(PETSC_SUCCESS);
}
