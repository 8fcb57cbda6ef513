#include "activeset.h"
#include "../saddle/saddle.h"
#include <petsc/private/snesimpl.h>
#include <cmath>
#include <set>
#include <vector>

/* What a row that has bounds is given in the next step */
enum Hold : signed char {
  HOLD_NONE, /* its equation */
  HOLD_LOWER,
  HOLD_UPPER
};

struct SNES_AinsworthActiveSet {
  PetscReal             tolerance = 1e-8;
  Vec                   bounded   = NULL; /* 1 where there is a bound, else 0 */
  Mat                   step = NULL, pstep = NULL;
  std::vector<Hold>     hold;         /* of each local row */
  std::vector<Hold>     solved;       /* the same when the matrices of the step were made */
  uint64_t              state[2];     /* of the Jacobian then */
  std::vector<PetscInt> rows;         /* the local rows that have bounds */
  PetscReal             largest;      /* residual of a row with bounds, so far */
  std::set<uint64_t>    seen;         /* the sets there were */
  PetscInt              wrong, least; /* rows that must change, now and when rows began to change one by one */
  bool                  single;       /* they do */
};

/* The number of a set, the same on any number of ranks */
static PetscErrorCode NumberOfSet(SNES snes, const SNES_AinsworthActiveSet *as, uint64_t *number)
{
  PetscInt rstart;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(snes->vec_sol, &rstart, NULL));
  *number = 0;
  for (PetscInt i : as->rows) *number += AinsworthMixState(0, 4 * (uint64_t)(rstart + i) + (uint64_t)as->hold[i] + 1);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, number, 1, MPI_UINT64_T, MPI_SUM, PetscObjectComm((PetscObject)snes)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which bound each row with bounds belongs at, as X and F say; first: whatever it was before */
static PetscErrorCode FindWrong(SNES snes, SNES_AinsworthActiveSet *as, bool first, std::vector<Hold> &wanted)
{
  const PetscScalar *x, *f, *l, *u;
  PetscReal          now[2] = {0.0, 0.0};

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(snes->vec_sol, &x));
  PetscCall(VecGetArrayRead(snes->vec_func, &f));
  PetscCall(VecGetArrayRead(snes->xl, &l));
  PetscCall(VecGetArrayRead(snes->xu, &u));
  for (PetscInt i : as->rows) {
    now[0] = PetscMax(now[0], PetscAbsScalar(x[i]));
    now[1] = PetscMax(now[1], PetscAbsScalar(f[i]));
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, now, 2, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)snes)));
  as->largest = PetscMax(as->largest, now[1]);
  wanted      = as->hold;
  as->wrong   = 0;
  for (PetscInt i : as->rows) {
    const PetscReal at = PetscRealPart(x[i]), force = PetscRealPart(f[i]), low = PetscRealPart(l[i]), high = PetscRealPart(u[i]);
    const PetscReal little = as->tolerance * now[0], slight = as->tolerance * as->largest;

    if (first) as->hold[i] = at <= low ? HOLD_LOWER : at >= high ? HOLD_UPPER : HOLD_NONE;
    wanted[i] = as->hold[i];
    if (as->hold[i] == HOLD_NONE) wanted[i] = at < low - little ? HOLD_LOWER : at > high + little ? HOLD_UPPER : HOLD_NONE;
    else if (low < high && (as->hold[i] == HOLD_LOWER ? force < -slight : force > slight)) wanted[i] = HOLD_NONE;
    as->wrong += wanted[i] != as->hold[i];
  }
  PetscCall(VecRestoreArrayRead(snes->xu, &u));
  PetscCall(VecRestoreArrayRead(snes->xl, &l));
  PetscCall(VecRestoreArrayRead(snes->vec_func, &f));
  PetscCall(VecRestoreArrayRead(snes->vec_sol, &x));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &as->wrong, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)snes)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The next set. All wrong rows change at once, until a set comes for the second time; then only the last of them does, until fewer are wrong than ever.

   Where the Schur complement C A^{-1} C' is positive definite this ends (K. G. Murty, 1974; J. J. Judice and F. M. Pires, 1994). *cycles: even that way a
   set came again
*/
static PetscErrorCode ChangeSet(SNES snes, SNES_AinsworthActiveSet *as, const std::vector<Hold> &wanted, bool *cycles)
{
  PetscInt last = -1, rstart;
  uint64_t number;

  PetscFunctionBegin;
  *cycles = false;
  if (!as->wrong) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(NumberOfSet(snes, as, &number));
  if (as->single && as->wrong < as->least) {
    as->single = false;
    as->seen.clear();
  }
  if (!as->seen.insert(number).second) {
    *cycles = as->single;
    if (!as->single) {
      PetscCall(PetscInfo(snes, "A set of held multipliers came for the second time: one row changes at a time, until fewer than %" PetscInt_FMT " are wrong\n",
                          as->least));
      as->single = true;
      as->seen   = {number};
    }
  }
  if (!as->single) as->least = PetscMin(as->least, as->wrong);
  if (!as->single) as->hold = wanted;
  else {
    for (PetscInt i : as->rows)
      if (wanted[i] != as->hold[i]) last = i;
    PetscCall(VecGetOwnershipRange(snes->vec_sol, &rstart, NULL));
    const PetscInt mine = last < 0 ? -1 : rstart + last;
    PetscInt       all  = mine;

    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &all, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)snes)));
    if (all == mine) as->hold[last] = wanted[last];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* keep: 0 where a row is held, else 1; known: what Newton's step is there, the distance from the bound, else 0 */
static PetscErrorCode HeldStep(SNES snes, const SNES_AinsworthActiveSet *as, Vec keep, Vec known)
{
  const PetscScalar *x, *l, *u;
  PetscScalar       *k, *d;

  PetscFunctionBegin;
  PetscCall(VecSet(keep, 1.0));
  PetscCall(VecSet(known, 0.0));
  PetscCall(VecGetArrayRead(snes->vec_sol, &x));
  PetscCall(VecGetArrayRead(snes->xl, &l));
  PetscCall(VecGetArrayRead(snes->xu, &u));
  PetscCall(VecGetArray(keep, &k));
  PetscCall(VecGetArray(known, &d));
  for (PetscInt i : as->rows) {
    if (as->hold[i] == HOLD_NONE) continue;
    k[i] = 0.0;
    d[i] = x[i] - (as->hold[i] == HOLD_LOWER ? l[i] : u[i]);
  }
  PetscCall(VecRestoreArray(known, &d));
  PetscCall(VecRestoreArray(keep, &k));
  PetscCall(VecRestoreArrayRead(snes->xu, &u));
  PetscCall(VecRestoreArrayRead(snes->xl, &l));
  PetscCall(VecRestoreArrayRead(snes->vec_sol, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the residual without held rows, to which the distances from their bounds belong */
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
   Is the function what its Jacobian said of it, so that nothing is left but what the linear solver left? predicted: F - J Y at the last X, overwritten

   Rows with bounds are compared with the largest of them, the others, where all terms cancel, with their diagonal and Y: with what rounding leaves.
*/
static PetscErrorCode WasLinear(SNES snes, SNES_AinsworthActiveSet *as, Vec Y, Vec predicted, bool *linear)
{
  const PetscReal rounding = 1e4 * PETSC_MACHINE_EPSILON;
  PetscReal       others, bounded, diagonal, step;

  PetscFunctionBegin;
  PetscCall(VecAXPY(predicted, -1.0, snes->vec_func));
  PetscCall(VecNorm(predicted, NORM_INFINITY, &others));
  PetscCall(VecPointwiseMult(predicted, as->bounded, predicted));
  PetscCall(VecNorm(predicted, NORM_INFINITY, &bounded));
  PetscCall(MatGetDiagonal(snes->jacobian, predicted));
  PetscCall(VecNorm(predicted, NORM_INFINITY, &diagonal));
  PetscCall(VecNorm(Y, NORM_INFINITY, &step));
  *linear = others <= rounding * diagonal * step && bounded <= as->tolerance * as->largest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrices of the step; the last ones where rows and Jacobian are those of before: then nothing is set up */
static PetscErrorCode UpdateStep(SNES snes, SNES_AinsworthActiveSet *as, Vec keep)
{
  uint64_t  state[2] = {0, 0};
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(AinsworthMatGetState(snes->jacobian, &state[0]));
  if (snes->jacobian_pre != snes->jacobian) PetscCall(AinsworthMatGetState(snes->jacobian_pre, &state[1]));
  same = (PetscBool)(as->step && as->solved == as->hold && as->state[0] == state[0] && as->state[1] == state[1]);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &same, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)snes)));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatDestroy(&as->step));
  PetscCall(MatDestroy(&as->pstep));
  PetscCall(AinsworthStepMatCreate(snes->jacobian, as->bounded, keep, &as->step));
  if (snes->jacobian_pre != snes->jacobian) PetscCall(AinsworthStepMatCreate(snes->jacobian_pre, as->bounded, keep, &as->pstep));
  for (int k = 0; k < 2; k++) as->state[k] = state[k];
  as->solved = as->hold;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* J Y = F, with Y = known where rows are held */
static PetscErrorCode SolveStep(SNES snes, SNES_AinsworthActiveSet *as, Vec keep, Vec known, Vec rhs, Vec Y)
{
  PetscFunctionBegin;
  PetscCall(SNESComputeJacobian(snes, snes->vec_sol, snes->jacobian, snes->jacobian_pre));
  PetscCall(UpdateStep(snes, as, keep));
  PetscCall(MatMult(snes->jacobian, known, rhs));
  PetscCall(VecAYPX(rhs, -1.0, snes->vec_func));
  PetscCall(VecPointwiseMult(rhs, keep, rhs));
  PetscCall(VecAXPY(rhs, -1.0, known)); /* -1 is on the diagonal of a held row */
  PetscCall(KSPSetOperators(snes->ksp, as->step, as->pstep ? as->pstep : as->step));
  PetscCall(KSPSolve(snes->ksp, rhs, Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reason to stop in iteration i, with a norm, or 0; PETSc's test is asked where no row is wrong, and at first, when it keeps the norm */
static PetscErrorCode Test(SNES snes, const SNES_AinsworthActiveSet *as, PetscInt i, bool cycles, bool linear)
{
  SNESConvergedReason reason = SNES_CONVERGED_ITERATING;

  PetscFunctionBegin;
  if (PetscIsInfOrNanReal(snes->norm)) reason = SNES_DIVERGED_FUNCTION_NANORINF;
  else if (cycles) reason = SNES_DIVERGED_LOCAL_MIN;
  else if (!as->wrong && linear) reason = SNES_CONVERGED_SNORM_RELATIVE;
  else {
    if (i == 0 || !as->wrong) PetscCall((*snes->ops->converged)(snes, i, snes->xnorm, snes->ynorm, snes->norm, &reason, snes->cnvP));
    if (as->wrong) reason = SNES_CONVERGED_ITERATING;
    if (!reason && i >= snes->max_its) reason = SNES_DIVERGED_MAX_IT;
  }
  snes->reason = reason;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESSolve_AinsworthActiveSet(SNES snes)
{
  SNES_AinsworthActiveSet *as   = (SNES_AinsworthActiveSet *)snes->data;
  Vec                      keep = snes->work[0], known = snes->work[1], rhs = snes->work[2], work = snes->work[3], Y = snes->vec_sol_update;
  bool                     linear = false, cycles = false;

  PetscFunctionBegin;
  snes->numLinearSolveFailures = 0;
  snes->reason                 = SNES_CONVERGED_ITERATING;
  snes->xnorm = snes->ynorm = 0.0;
  as->largest               = 0.0;
  as->seen.clear();
  as->single = false;
  as->least  = PETSC_MAX_INT;
  if (!snes->vec_func_init_set) PetscCall(SNESComputeFunction(snes, snes->vec_sol, snes->vec_func));
  snes->vec_func_init_set = PETSC_FALSE;
  for (PetscInt i = 0;; i++) {
    std::vector<Hold> wanted;
    PetscInt          its = 0;

    PetscCall(FindWrong(snes, as, i == 0, wanted));
    PetscCall(ChangeSet(snes, as, wanted, &cycles));
    PetscCall(HeldStep(snes, as, keep, known));
    PetscCall(PetscObjectSAWsTakeAccess((PetscObject)snes));
    snes->iter = i;
    PetscCall(NormOfEquations(snes, keep, known, work, &snes->norm));
    PetscCall(PetscObjectSAWsGrantAccess((PetscObject)snes));
    if (i) PetscCall(KSPGetIterationNumber(snes->ksp, &its));
    PetscCall(SNESLogConvergenceHistory(snes, snes->norm, its));
    PetscCall(PetscInfo(snes, "%" PetscInt_FMT " rows were wrong\n", as->wrong));
    PetscCall(Test(snes, as, i, cycles, linear));
    PetscCall(SNESMonitor(snes, i, snes->norm));
    if (snes->reason) break;
    if (snes->ops->update) PetscCall((*snes->ops->update)(snes, i));
    PetscCall(SolveStep(snes, as, keep, known, rhs, Y));
    SNESCheckKSPSolve(snes);
    PetscCall(MatMult(snes->jacobian, Y, rhs));
    PetscCall(VecWAXPY(work, -1.0, rhs, snes->vec_func));
    PetscCall(VecAXPY(snes->vec_sol, -1.0, Y));
    PetscCall(VecNorm(Y, NORM_2, &snes->ynorm));
    PetscCall(VecNorm(snes->vec_sol, NORM_2, &snes->xnorm));
    PetscCall(SNESComputeFunction(snes, snes->vec_sol, snes->vec_func));
    PetscCall(WasLinear(snes, as, Y, work, &linear));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bounds of SNESVISetVariableBounds() or SNESVISetComputeVariableBounds() */
static PetscErrorCode SNESSetUp_AinsworthActiveSet(SNES snes)
{
  SNES_AinsworthActiveSet *as = (SNES_AinsworthActiveSet *)snes->data;
  const PetscScalar       *l, *u;
  PetscScalar             *b;
  PetscInt                 n;

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
             "SNES type %s needs bounds of the multipliers: call SNESVISetVariableBounds(), with PETSC_NINFINITY and PETSC_INFINITY for unknowns without",
             SNESAINSWORTHACTIVESET);
  PetscCall(VecDestroy(&as->bounded));
  PetscCall(VecDuplicate(snes->work[0], &as->bounded));
  PetscCall(VecGetLocalSize(as->bounded, &n));
  PetscCall(VecGetArrayRead(snes->xl, &l));
  PetscCall(VecGetArrayRead(snes->xu, &u));
  PetscCall(VecGetArrayWrite(as->bounded, &b));
  as->rows.clear();
  for (PetscInt i = 0; i < n; i++) {
    b[i] = PetscRealPart(l[i]) > PETSC_NINFINITY || PetscRealPart(u[i]) < PETSC_INFINITY ? 1.0 : 0.0;
    if (b[i] != 0.0) as->rows.push_back(i);
  }
  as->hold.assign(n, HOLD_NONE);
  PetscCall(VecRestoreArrayWrite(as->bounded, &b));
  PetscCall(VecRestoreArrayRead(snes->xu, &u));
  PetscCall(VecRestoreArrayRead(snes->xl, &l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESReset_AinsworthActiveSet(SNES snes)
{
  SNES_AinsworthActiveSet *as = (SNES_AinsworthActiveSet *)snes->data;

  PetscFunctionBegin;
  PetscCall(MatDestroy(&as->step));
  PetscCall(MatDestroy(&as->pstep));
  PetscCall(VecDestroy(&as->bounded));
  PetscCall(VecDestroy(&snes->xl));
  PetscCall(VecDestroy(&snes->xu));
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
  PetscCall(PetscOptionsReal("-snes_ainsworthactiveset_tolerance", "Of the largest multiplier and the largest residual: less is zero", NULL, as->tolerance,
                             &as->tolerance, NULL));
  PetscOptionsHeadEnd();
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
  PetscCall(PetscViewerASCIIPrintf(viewer, "  rows with bounds: %" PetscInt_FMT ", of which %" PetscInt_FMT " are held at one\n", count[1], count[0]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  tolerance for a multiplier beyond its bound: %g of the largest\n", (double)as->tolerance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   SNESAINSWORTHACTIVESET - Newton's method with an active set: inequalities C x <= g, given as bounds of their multipliers

   Options Database Key:
.  -snes_ainsworthactiveset_tolerance <1e-8> - what counts as zero, of the largest multiplier and of the largest residual of a row with bounds

   Level: intermediate

   Notes:
   For C x <= g: F(x, l) = (A x + C'l - f, g - C x), with bounds 0 <= l, in the sign that `SNESVINEWTONRSLS` wants; the Jacobian is [A C'; -C 0], of any
   layout that `PCAINSWORTH` takes. `SNESVISetVariableBounds()` tells which rows are inequalities. Rows without bounds are equations. With two bounds,
   -b <= l <= b, it is friction with a known force.

   A multiplier that is at a bound is held there in the next step unless its residual wants it back, any other one that is beyond a bound is held from
   then on: the primal-dual active set, which is Newton's method. In a step C x = g holds exactly for the rows in contact. Each matrix has the rows of all
   multipliers; those that are held have -1 on their diagonal and nothing else, and A is the program's own object: `PCAINSWORTH` keeps what it made of it.
   It ends when no row is wrong and F was what its Jacobian said, as for a linear problem, or PETSc's test is met.

   If a set comes for the second time, rows change one by one until fewer are wrong than before, which ends where C A^{-1} C' is positive definite; if even
   so a set comes again the reason is `SNES_DIVERGED_LOCAL_MIN`.

   References:
   M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003), 865-888; J. J. Judice, F. M. Pires, Comput. Oper. Res. 21 (1994), 587-596.

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
