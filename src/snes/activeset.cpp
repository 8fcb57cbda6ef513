#include "activeset.h"
#include "../base/loops.h"
#include <petsc/private/snesimpl.h>
#include <cmath>

/*
   Sets keep to 0 in held rows, else 1, and known to Newton's step in held rows, which is the distance from the bound,
   else 0
*/
static PetscErrorCode HeldStep(SNES snes, const SNES_AinsworthActiveSet *as, Vec keep, Vec known)
{
  PetscFunctionBegin;
  PetscCall(AinsworthUpdate(keep, [=](PetscInt i, PetscScalar &k) { k = as->hold[i] == HOLD_NONE ? 1.0 : 0.0; }));
  PetscCall(AinsworthUpdate(known, {snes->vec_sol, snes->xl, snes->xu},
                            [=](PetscInt i, PetscScalar &d, PetscScalar x, PetscScalar l, PetscScalar u) {
                              d = as->hold[i] == HOLD_NONE ? 0.0 : x - (as->hold[i] == HOLD_LOWER ? l : u);
                            }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the norm of the residual, with the distances from the bounds in held rows */
static PetscErrorCode NormOfEquations(SNES snes, Vec keep, Vec known, Vec work, PetscReal *norm)
{
  PetscReal distance;

  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(work, keep, snes->vec_func));
  PetscCall(VecNorm(work, NORM_2, norm));
  PetscCall(VecNorm(known, NORM_2, &distance));
  *norm = std::hypot(*norm, distance);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets the reason to stop in iteration i, or 0

   PETSc's test is called in the first iteration, when it stores the norm, and when no row is wrong; for a linear
   problem only after an exact solve
*/
static PetscErrorCode Test(SNES snes, const SNES_AinsworthActiveSet *as, PetscInt i, bool cycles)
{
  SNESConvergedReason reason = SNES_CONVERGED_ITERATING;

  PetscFunctionBegin;
  if (PetscIsInfOrNanReal(snes->norm)) reason = SNES_DIVERGED_FUNCTION_NANORINF;
  else if (cycles) reason = SNES_DIVERGED_LOCAL_MIN;
  else if (!as->wrong && as->linear && as->exact) reason = SNES_CONVERGED_SNORM_RELATIVE;
  else {
    if (i == 0 || (!as->wrong && (as->exact || !as->linear)))
      PetscCall((*snes->ops->converged)(snes, i, snes->xnorm, snes->ynorm, snes->norm, &reason, snes->cnvP));
    if (as->wrong) reason = SNES_CONVERGED_ITERATING;
    if (!reason && i >= snes->max_its) reason = SNES_DIVERGED_MAX_IT;
  }
  snes->reason = reason;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Updates X -= Y and computes F of the new X; before: F of the old X */
static PetscErrorCode TakeStep(SNES snes, Vec before, Vec Y)
{
  PetscFunctionBegin;
  PetscCall(VecCopy(snes->vec_func, before));
  PetscCall(VecAXPY(snes->vec_sol, -1.0, Y));
  PetscCall(VecNorm(Y, NORM_2, &snes->ynorm));
  PetscCall(VecNorm(snes->vec_sol, NORM_2, &snes->xnorm));
  PetscCall(SNESComputeFunction(snes, snes->vec_sol, snes->vec_func));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESSolve_AinsworthActiveSet(SNES snes)
{
  SNES_AinsworthActiveSet *as   = (SNES_AinsworthActiveSet *)snes->data;
  Vec                      keep = snes->work[0], known = snes->work[1], work = snes->work[2], before = snes->work[3],
      Y       = snes->vec_sol_update;
  bool cycles = false;

  PetscFunctionBegin;
  snes->numLinearSolveFailures = 0;
  snes->reason                 = SNES_CONVERGED_ITERATING;
  snes->ynorm                  = 0.0;
  as->largest                  = 0.0;
  as->seen.clear();
  as->single = as->tight = as->linear = as->exact = false;
  PetscCall(VecNorm(snes->vec_sol, NORM_2, &snes->xnorm));
  as->left  = -1.0;
  as->least = PETSC_MAX_INT;
  if (!snes->vec_func_init_set) PetscCall(SNESComputeFunction(snes, snes->vec_sol, snes->vec_func));
  snes->vec_func_init_set = PETSC_FALSE;
  for (PetscInt i = 0;; i++) {
    std::vector<AinsworthHold> wanted;
    PetscInt                   its = 0;

    PetscCall(AinsworthActiveSetFindWrong(as, snes->vec_sol, snes->vec_func, snes->xl, snes->xu, i == 0, wanted));
    if (i) PetscCall(AinsworthActiveSetJudgeStep(snes, as, before, work, Y));
    PetscCall(AinsworthActiveSetChange(snes, as, wanted, &cycles));
    PetscCall(HeldStep(snes, as, keep, known));
    PetscCall(PetscObjectSAWsTakeAccess((PetscObject)snes));
    snes->iter = i;
    PetscCall(NormOfEquations(snes, keep, known, work, &snes->norm));
    PetscCall(PetscObjectSAWsGrantAccess((PetscObject)snes));
    if (i) PetscCall(KSPGetIterationNumber(snes->ksp, &its));
    PetscCall(SNESLogConvergenceHistory(snes, snes->norm, its));
    PetscCall(PetscInfo(snes, "%" PetscInt_FMT " rows were wrong\n", as->wrong));
    PetscCall(Test(snes, as, i, cycles));
    PetscCall(SNESMonitor(snes, i, snes->norm));
    if (snes->reason) break;
    if (snes->ops->update) PetscCall((*snes->ops->update)(snes, i));
    PetscCall(AinsworthActiveSetSolveStep(snes, as, keep, known, work, Y));
    SNESCheckKSPSolve(snes);
    PetscCall(TakeStep(snes, before, Y));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes the bounds of SNESVISetVariableBounds() or SNESVISetComputeVariableBounds() */
static PetscErrorCode SNESSetUp_AinsworthActiveSet(SNES snes)
{
  SNES_AinsworthActiveSet *as = (SNES_AinsworthActiveSet *)snes->data;

  PetscFunctionBegin;
  PetscCall(SNESSetWorkVecs(snes, 4));
  PetscCall(SNESSetUpMatrices(snes));
  if (!snes->usersetbounds && snes->ops->computevariablebounds) {
    PetscCall(VecDestroy(&snes->xl));
    PetscCall(VecDestroy(&snes->xu));
    PetscCall(VecDuplicate(snes->work[0], &snes->xl));
    PetscCall(VecDuplicate(snes->work[0], &snes->xu));
    PetscCall((*snes->ops->computevariablebounds)(snes, snes->xl, snes->xu));
  }
  PetscCheck(snes->xl && snes->xu, PetscObjectComm((PetscObject)snes), PETSC_ERR_ARG_WRONGSTATE,
             "SNES type %s needs bounds of the multipliers: call SNESVISetVariableBounds(), with PETSC_NINFINITY and "
             "PETSC_INFINITY for unknowns without",
             SNESAINSWORTHACTIVESET);
  PetscCall(VecDestroy(&as->bounded));
  PetscCall(VecDuplicate(snes->work[0], &as->bounded));
  as->rows.clear();
  as->hold.clear();
  PetscCall(
    AinsworthUpdate(as->bounded, {snes->xl, snes->xu}, [=](PetscInt i, PetscScalar &b, PetscScalar l, PetscScalar u) {
      b = PetscRealPart(l) > PETSC_NINFINITY || PetscRealPart(u) < PETSC_INFINITY ? 1.0 : 0.0;
      if (b != 0.0) as->rows.push_back(i);
      as->hold.push_back(HOLD_NONE);
    }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESReset_AinsworthActiveSet(SNES snes)
{
  SNES_AinsworthActiveSet *as = (SNES_AinsworthActiveSet *)snes->data;

  PetscFunctionBegin;
  PetscCall(MatDestroy(&as->step));
  PetscCall(MatDestroy(&as->pstep));
  for (Vec *v : {&as->bounded, &snes->xl, &snes->xu}) PetscCall(VecDestroy(v));
  snes->usersetbounds = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESDestroy_AinsworthActiveSet(SNES snes)
{
  PetscFunctionBegin;
  PetscCall(SNESReset_AinsworthActiveSet(snes));
  delete (SNES_AinsworthActiveSet *)snes->data;
  snes->data = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESSetFromOptions_AinsworthActiveSet(SNES snes, AinsworthOptionItems PetscOptionsObject)
{
  SNES_AinsworthActiveSet *as = (SNES_AinsworthActiveSet *)snes->data;

  PetscFunctionBegin;
  PetscOptionsHeadBegin(PetscOptionsObject, "SNES ainsworthactiveset options");
  PetscCall(PetscOptionsReal("-snes_ainsworthactiveset_tolerance",
                             "Of the largest multiplier and the largest residual: less is zero", NULL, as->tolerance,
                             &as->tolerance, NULL));
  PetscCall(
    PetscOptionsReal("-snes_ainsworthactiveset_loose",
                     "Relative tolerance of a linear solve after which rows may change; 0: always that of the KSP",
                     NULL, as->loose, &as->loose, NULL));
  PetscOptionsHeadEnd();
  PetscCheck(as->loose >= 0.0 && as->loose < 1.0, PetscObjectComm((PetscObject)snes), PETSC_ERR_ARG_OUTOFRANGE,
             "Option -snes_ainsworthactiveset_loose is %g, it must be in [0,1)", (double)as->loose);
  PetscCheck(as->tolerance >= 0.0 && as->tolerance < 1.0, PetscObjectComm((PetscObject)snes), PETSC_ERR_ARG_OUTOFRANGE,
             "Option -snes_ainsworthactiveset_tolerance is %g, it must be in [0,1)", (double)as->tolerance);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESView_AinsworthActiveSet(SNES snes, PetscViewer viewer)
{
  SNES_AinsworthActiveSet *as       = (SNES_AinsworthActiveSet *)snes->data;
  PetscInt                 count[2] = {0, (PetscInt)as->rows.size()};
  PetscBool                ascii;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i : as->rows) count[0] += as->hold[i] != HOLD_NONE;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)snes)));
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "  rows with bounds: %" PetscInt_FMT ", of which %" PetscInt_FMT " are held at one\n", count[1], count[0]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  tolerance for a multiplier beyond its bound: %g of the largest\n",
                                   (double)as->tolerance));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  relative tolerance of linear solves after which rows may change: %g\n",
                                   (double)as->loose));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   SNESAINSWORTHACTIVESET - Newton's method with an active set, for inequalities C x <= g that are given as bounds of
   their multipliers

   Options Database Keys:
+  -snes_ainsworthactiveset_tolerance <1e-8> - values below it are zero, relative to the largest multiplier or residual
                                               of a row with bounds
-  -snes_ainsworthactiveset_loose <1e-2>     - relative tolerance of linear solves while rows may change; 0: the
                                               tolerance of the KSP

   Level: intermediate

   Notes:
   For C x <= g, the function is F(x, l) = (A x + C'l - f, g - C x) with the bounds 0 <= l, with the signs of
   `SNESVINEWTONRSLS`. The Jacobian [A C'; -C 0] may have any layout that `PCAINSWORTH` accepts. Set the bounds with
   `SNESVISetVariableBounds()`. Rows without bounds are equations. Two bounds, -b <= l <= b, describe friction with a
   known force.

   The method is the primal-dual active set method, which is a Newton method. A multiplier at a bound is held there in
   the next step, unless the sign of its residual releases it. A multiplier beyond a bound is held from then on. In each
   step C x = g holds exactly for the rows in contact. Each matrix has rows for all multipliers. A held row has -1 on
   the diagonal and no other entry. A is the program's own object, so `PCAINSWORTH` keeps what it has built from it. The
   method stops if no row is wrong and F agrees with its Jacobian, as in a linear problem, or if PETSc's convergence
   test is satisfied.

   While rows change, linear solves are loose. Their tolerance is set in the KSP, or in the reduced solve if the KSP is
   `KSPPREONLY` with `PCAINSWORTH`. When no row is wrong, one more solve reduces the error of x, in the energy norm, to
   the tolerance that was asked for. Its own tolerance is larger, because the step is smaller than x.

   If a set recurs, linear solves are no longer loose. If a set recurs again, rows change one at a time, until fewer
   rows are wrong than before. This terminates if C A^{-1} C' is positive definite. If a set recurs even then, the
   reason is `SNES_DIVERGED_LOCAL_MIN`.

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` at set-up if there are no bounds; `PETSC_ERR_ARG_OUTOFRANGE` if an option is not in [0,1).

   References:
   M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003), 865-888; J. J. Judice, F. M. Pires, Comput. Oper.
   Res. 21 (1994), 587-596.

.seealso: `PCAINSWORTH`, `SNESVISetVariableBounds()`, `SNESVINEWTONRSLS`
M*/
PetscErrorCode SNESCreate_AinsworthActiveSet(SNES snes)
{
  PetscFunctionBegin;
  snes->data                        = (void *)new SNES_AinsworthActiveSet();
  snes->ops->setup                  = SNESSetUp_AinsworthActiveSet;
  snes->ops->solve                  = SNESSolve_AinsworthActiveSet;
  snes->ops->destroy                = SNESDestroy_AinsworthActiveSet;
  snes->ops->reset                  = SNESReset_AinsworthActiveSet;
  snes->ops->setfromoptions         = SNESSetFromOptions_AinsworthActiveSet;
  snes->ops->view                   = SNESView_AinsworthActiveSet;
  snes->usesksp                     = PETSC_TRUE;
  snes->usesnpc                     = PETSC_FALSE;
  snes->alwayscomputesfinalresidual = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
