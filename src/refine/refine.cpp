#include "refine.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/objects.h"

/* The numbers that decide whether x is right (docs/method.md, verification) */
/* a row is left with at most so many times the requested tolerance of its terms */
static const PetscReal margin = 10;
/* rows of C x = g are left with no more, whatever the tolerance: the projection meets them to rounding if S has a
   condition number of 1e8 */
static const PetscReal rows = 1e-8;
/* of the largest terms of all, which the solves spread over all rows: a body at rest has only that */
static const PetscReal rounding = 0.5 * PETSC_MACHINE_EPSILON;
/* an x that another solve moves by less is determined */
static const PetscReal settled = 1e-6;
/* steps have to reduce what they reduce by this factor, as in LAPACK's xGERFSX, and there are at most so many */
static const PetscReal rate = 0.5;
static const int       most = 10;

/*
   AinsworthDecide - goes on while a row is left with too much, or x has not settled, as long as that helps; open: how
   far a step may move a settled x
*/
AinsworthProgressState AinsworthDecide(const AinsworthProgress &p, PetscReal open)
{
  const bool met = p.excess <= 1.0, still = p.settles || (p.steps > 0 && p.moved <= open);

  if (met && still) return AINSWORTH_CONVERGED;
  if (p.steps >= most) return AINSWORTH_NO_PROGRESS;
  if (p.steps == 0) return AINSWORTH_WORKING;
  if (!met) return p.excess <= rate * p.before ? AINSWORTH_WORKING : AINSWORTH_NO_PROGRESS;
  return p.steps == 1 || p.moved <= rate * p.last ? AINSWORTH_WORKING : AINSWORTH_NO_PROGRESS;
}

/* Multiplies rows by the scale, and by 0 those that no solution can change */
static PetscErrorCode Scale(const AinsworthSaddle *sp, AinsworthSaddleVec v)
{
  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(v.primal, v.primal, sp->scale.primal));
  PetscCall(AinsworthUpdate(v.dual, {sp->scale.dual}, [sp](PetscInt i, PetscScalar &r, PetscScalar s) {
    r = AinsworthSaddleIsLeftOut(sp, i) ? 0.0 : r * s;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Dot(AinsworthSaddleVec x, AinsworthSaddleVec y, PetscScalar *dot)
{
  PetscScalar dual;

  PetscFunctionBegin;
  PetscCall(VecDot(x.primal, y.primal, dot));
  PetscCall(VecDot(x.dual, y.dual, &dual));
  *dot += dual;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Directions p of generalized conjugate residuals and their images K p, orthonormal in the units of the scale */
struct Directions {
  std::vector<AinsworthSaddleVec> p, image;
};

/*
   Makes a direction of p, which it changes and keeps, and adds the multiple to y that minimizes the residual `left`,
   which it scales; moved: by that step; solves: it takes away the part of the residual that steps have to
*/
static PetscErrorCode Advance(const AinsworthSaddle *sp, PetscBool transpose, AinsworthSaddleVec b,
                              AinsworthSaddleVec left, AinsworthSaddleVec p, Vec Ax, AinsworthSaddleVec y,
                              Directions *all, PetscReal *moved, bool *solves, bool *some)
{
  AinsworthSaddleVec q;
  PetscScalar        dot, square;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleVecDuplicate(left, &q));
  PetscCall(AinsworthSaddleMult(sp, transpose, p, Ax, q));
  PetscCall(Scale(sp, q));
  PetscCall(Scale(sp, left));
  for (size_t k = 0; k < all->p.size(); k++) {
    PetscCall(Dot(q, all->image[k], &dot));
    PetscCall(AinsworthSaddleVecAXPY(q, -dot, all->image[k]));
    PetscCall(AinsworthSaddleVecAXPY(p, -dot, all->p[k]));
  }
  PetscCall(Dot(q, q, &dot));
  *some = PetscRealPart(dot) > 0.0 && !PetscIsInfOrNanScalar(dot);
  if (*some) {
    dot = 1.0 / PetscSqrtReal(PetscRealPart(dot));
    PetscCall(AinsworthSaddleVecScale(p, dot));
    PetscCall(AinsworthSaddleVecScale(q, dot));
    PetscCall(Dot(left, left, &square));
    PetscCall(Dot(left, q, &dot));
    *solves = PetscSqr(PetscAbsScalar(dot)) >= (1.0 - PetscSqr(rate)) * PetscRealPart(square);
    PetscCall(AinsworthSaddleVecAXPY(y, dot, p));
    PetscCall(AinsworthChange(sp, b, y.primal, p.primal, moved));
    *moved *= PetscAbsScalar(dot);
    all->p.push_back(p);
    all->image.push_back(q);
  } else {
    PetscCall(AinsworthSaddleVecDestroy(&p));
    PetscCall(AinsworthSaddleVecDestroy(&q));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets what rows are allowed; where the energy decides, those with stiffness as a whole, relative to x: an x at rest
   has no energy that could excuse them
*/
static void Measure(bool D, const AinsworthRequest *request, AinsworthMeasure measure[])
{
  const bool      excuses = request->energetic && request->bounded;
  const PetscReal allowed = request->tol < 0.0 ? PetscSqrtReal(PETSC_MAX_REAL) /* anything, but no overflow */
                                               : PetscMax(margin * request->tol, AinsworthLeast);

  measure[AINSWORTH_ROWS_HELD]   = {allowed, rounding, !excuses ? 0.0 : D ? allowed / margin : allowed};
  measure[AINSWORTH_ROWS_RIGID]  = {PetscMin(allowed, rows), rounding};
  measure[AINSWORTH_ROWS_NEAR]   = {AinsworthLeast, rounding};
  measure[AINSWORTH_ROWS_FORCED] = {measure[AINSWORTH_ROWS_RIGID].relative, 0.0};
  measure[AINSWORTH_ROWS_LOOSE]  = measure[AINSWORTH_ROWS_RIGID];
  /* by what they are tied to */
  if (excuses && !D) measure[AINSWORTH_ROWS_LOOSE] = measure[AINSWORTH_ROWS_FORCED] = measure[AINSWORTH_ROWS_HELD];
}

/*
   Judges the rows that depend on others and are left with more than rows are allowed: the combination of rows that they
   are tells what that means. Collective
*/
static PetscErrorCode Depend(const AinsworthSaddle *sp, const AinsworthRequest *request,
                             const AinsworthMeasure measure[], AinsworthSaddleVec b, AinsworthSaddleVec y,
                             AinsworthSaddleVec left, AinsworthOutcome *outcome)
{
  std::vector<PetscInt> mine, rows;
  PetscReal             size;
  Vec                   allowed, w;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(b.dual, &allowed));
  PetscCall(VecDuplicate(b.dual, &w));
  PetscCall(AinsworthAllowedOfConstraints(sp, measure, request->earlier, b, y, &outcome->error, allowed));
  PetscCall(AinsworthForEntries({left.dual, allowed}, [&](PetscInt i, PetscScalar r, PetscScalar a) {
    if (AinsworthSaddleIsLeftOut(sp, i) && !(PetscAbsScalar(r) <= PetscRealPart(a))) mine.push_back(sp->first + i);
  }));
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)w), mine, &rows));
  PetscCall(AinsworthLargestEntry(sp, y, true, &size));
  outcome->contradictory.assign(sp->local(), false);
  for (PetscInt row : rows) {
    AinsworthDependence what;

    PetscCall(AinsworthUpdate(w, [&](PetscInt i, PetscScalar &v) { v = sp->first + i == row ? 1.0 : 0.0; }));
    PetscCall(request->combination(w));
    PetscCall(AinsworthCertify(sp, w, left.dual, size, allowed, &what));
    if (what == AINSWORTH_DEPENDENCE_NONE && outcome->state != AINSWORTH_OUTCOME_CONTRADICTION)
      outcome->state = AINSWORTH_OUTCOME_UNMET;
    if (what != AINSWORTH_DEPENDENCE_CONTRADICTION) continue;
    outcome->state = AINSWORTH_OUTCOME_CONTRADICTION;
    if (row >= sp->first && row < sp->first + sp->local()) outcome->contradictory[row - sp->first] = true;
  }
  for (Vec *v : {&allowed, &w}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether K p = 0 to rounding of each row, but for entries of p that are its own rounding: a step along p leads
   to another solution. Collective
*/
static PetscErrorCode IsNull(const AinsworthSaddle *sp, PetscBool transpose, AinsworthSaddleVec given, bool *null)
{
  AinsworthMeasure   measure[AINSWORTH_ROWS_KINDS];
  AinsworthBackward  error;
  AinsworthSaddleVec zero, product, p;
  PetscReal          most;
  Vec                Ap;

  PetscFunctionBegin;
  for (AinsworthMeasure &m : measure) m = {AinsworthRoundoff, 0.0, 0.0};
  for (AinsworthSaddleVec *v : {&p, &zero, &product}) PetscCall(AinsworthSaddleVecDuplicate(given, v));
  PetscCall(VecDuplicate(p.primal, &Ap));
  PetscCall(AinsworthSaddleVecCopy(given, p));
  PetscCall(AinsworthLargestEntry(sp, p, true, &most));
  const auto clean = [most](PetscInt, PetscScalar &v, PetscScalar s) {
    v = PetscAbsScalar(v) / PetscRealPart(s) > AinsworthRest * most ? v : 0.0;
  };
  PetscCall(AinsworthUpdate(p.primal, {sp->scale.primal}, clean));
  PetscCall(AinsworthUpdate(p.dual, {sp->scale.dual}, clean));
  PetscCall(AinsworthSaddleVecZero(zero));
  PetscCall(AinsworthSaddleMult(sp, transpose, p, Ap, product));
  PetscCall(AinsworthBackwardError(sp, transpose, measure, NULL, zero, p, Ap, product, &error));
  *null = PetscMax(error.primal.omega, PetscMax(error.dual.omega, error.dependent.omega)) <= 1.0;
  for (AinsworthSaddleVec *v : {&p, &zero, &product}) PetscCall(AinsworthSaddleVecDestroy(v));
  PetscCall(VecDestroy(&Ap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the residual of y is rounding of the terms of its rows; Ax and left: overwritten. Collective */
static PetscErrorCode IsRounding(const AinsworthSaddle *sp, PetscBool transpose, AinsworthSaddleVec b,
                                 AinsworthSaddleVec y, Vec Ax, AinsworthSaddleVec left, bool *is)
{
  AinsworthMeasure  measure[AINSWORTH_ROWS_KINDS];
  AinsworthBackward error;

  PetscFunctionBegin;
  for (AinsworthMeasure &m : measure) m = {AinsworthRoundoff, rounding, 0.0};
  PetscCall(AinsworthSaddleResidual(sp, transpose, PETSC_FALSE, b, y, Ax, left));
  PetscCall(AinsworthBackwardError(sp, transpose, measure, NULL, b, y, Ax, left, &error));
  *is = PetscMax(error.primal.omega, error.dual.omega) <= 1.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether f and g are nearly nothing of x, in units of the scale, or g and the energy of x are: forces on others
   may hide the former. Collective
*/
static PetscErrorCode Drowns(const AinsworthSaddle *sp, AinsworthSaddleVec b, Vec x, Vec Ax, PetscReal *growth,
                             bool *drowns)
{
  PetscReal   size = 0.0, given;
  PetscScalar energy;

  PetscFunctionBegin;
  PetscCall(AinsworthGrowth(sp, b, x, growth));
  PetscCall(AinsworthForEntries(
    {x, sp->scale.primal}, [&](PetscInt, PetscScalar v, PetscScalar s) { size += PetscSqr(PetscAbsScalar(v / s)); }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &size, 1, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)x)));
  PetscCall(VecDot(Ax, x, &energy));
  PetscCall(AinsworthLargestEntry(sp, {NULL, b.dual}, false, &given));
  *drowns = *growth * AinsworthRest > 1.0 ||
            (AinsworthRest * PetscSqrtReal(size) > given &&
             PetscAbsScalar(energy) < PETSC_MACHINE_EPSILON / AinsworthUndetermined * size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds how far rounding of A moves x, if f and g may drown in it. Collective

   Rounding of A may be eps diag(A). Along a motion z that nothing resists it moves x by eps z' diag(A) z / z' A z of
   itself: of size 1, as z' A z is rounding, however f is balanced on z. A solver that found x, but leaves more than
   half of the work of these forces along x, moves it by infinity.
*/
static PetscErrorCode FindRounding(const AinsworthSaddle *sp, const AinsworthRequest *request,
                                   const AinsworthSolveFn &solver, AinsworthSaddleVec b, AinsworthSaddleVec y, Vec Ax,
                                   AinsworthOutcome *outcome)
{
  AinsworthSaddleVec r, d, after;
  PetscScalar        work[2]; /* of the forces along x */
  bool               drowns = false;
  Vec                Ad;

  PetscFunctionBegin;
  PetscCall(Drowns(sp, b, y.primal, Ax, &outcome->growth, &drowns));
  if (!drowns) PetscFunctionReturn(PETSC_SUCCESS);
  for (AinsworthSaddleVec *v : {&r, &d, &after}) PetscCall(AinsworthSaddleVecDuplicate(y, v));
  PetscCall(VecDuplicate(Ax, &Ad));
  PetscCall(VecPointwiseMult(r.primal, sp->stiffness, y.primal));
  PetscCall(VecScale(r.primal, PETSC_MACHINE_EPSILON));
  PetscCall(VecZeroEntries(r.dual));
  PetscCall(solver(r, 1.0 / margin, d));
  PetscCall(AinsworthChange(sp, b, y.primal, d.primal, &outcome->rounding));
  PetscCall(AinsworthSaddleResidual(sp, request->transpose, PETSC_FALSE, r, d, Ad, after));
  PetscCall(VecDot(r.primal, y.primal, &work[0]));
  PetscCall(VecDot(after.primal, y.primal, &work[1]));
  if (request->tol >= 0.0 && !(PetscAbsScalar(work[1]) <= rate * PetscAbsScalar(work[0])))
    outcome->rounding = PETSC_INFINITY;
  PetscCall(PetscInfo(sp->all.C, "x is %g of f and g: rounding of A moves it by %g\n", (double)outcome->growth,
                      (double)outcome->rounding));
  for (AinsworthSaddleVec *v : {&r, &d, &after}) PetscCall(AinsworthSaddleVecDestroy(v));
  PetscCall(VecDestroy(&Ad));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthRefine - refines y until it solves the program's system, and says whether it does. Collective

   Most solutions need no step: where the solver ends by the energy, the residual decides. Otherwise one more, loose,
   solve shows how far the residual moves x.

   left: the residual of y, on return. known: Ax is A x already; on return it is
*/
PetscErrorCode AinsworthRefine(const AinsworthSaddle *sp, const AinsworthRequest *request,
                               const AinsworthSolveFn &solver, AinsworthSaddleVec b, AinsworthSaddleVec y, Vec Ax,
                               AinsworthSaddleVec left, PetscBool *known, AinsworthOutcome *outcome)
{
  const PetscReal   open = PetscMax(settled, 1e4 * request->tol);
  AinsworthProgress p = {0.0, PETSC_MAX_REAL, PETSC_MAX_REAL, PETSC_MAX_REAL, request->energetic || request->tol < 0.0,
                         0};
  AinsworthProgressState state;
  AinsworthMeasure       measure[AINSWORTH_ROWS_KINDS];
  AinsworthBackward      error;
  AinsworthSaddleVec     kept = {NULL, NULL};
  Directions             all;
  bool                   some = true, solves = true;
  PetscReal              far;

  PetscFunctionBegin;
  Measure(sp->kept.D, request, measure);
  if (sp->kept.D) p.settles = request->tol < 0.0; /* springs may be far softer than what the energy sees */
  const auto look = [&](PetscBool given) -> PetscErrorCode {
    PetscFunctionBegin;
    PetscCall(AinsworthSaddleResidual(sp, request->transpose, given, b, y, Ax, left));
    PetscCall(AinsworthBackwardError(sp, request->transpose, measure, request->earlier, b, y, Ax, left, &error));
    p.excess = PetscMax(error.primal.omega, error.dual.omega);
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  for (;; p.steps++) {
    AinsworthSaddleVec correction;

    PetscCall(look(*known));
    *known = PETSC_TRUE;
    /* the step went along what the system does not resist: it only shows how far x moves */
    if (p.steps && p.excess > PetscMax(p.before, 1.0)) {
      PetscCall(AinsworthSaddleVecCopy(kept, y));
      PetscCall(look(PETSC_FALSE));
      some = false;
    }
    if (error.primal.omega == 0.0 && error.dual.omega == 0.0) p.settles = true; /* there is nothing that could move x */
    state = AinsworthDecide(p, open);
    if (!some && state == AINSWORTH_WORKING) state = AINSWORTH_NO_PROGRESS;
    PetscCall(PetscInfo(sp->all.C,
                        "After %d further solves, the last of which moved x by %g, rows of both equations are left "
                        "with up to %g and %g times what they are "
                        "allowed\n",
                        p.steps, (double)(p.steps ? p.moved : 0.0), (double)error.primal.omega,
                        (double)error.dual.omega));
    if (state != AINSWORTH_WORKING) break;
    PetscCall(AinsworthSaddleVecDuplicate(y, &correction));
    PetscCall(solver(left, 1.0 / (margin * PetscMax(p.excess, 1.0)), correction)); /* it overwrites A x */
    *known = PETSC_FALSE;
    PetscCall(AinsworthChange(sp, b, y.primal, correction.primal, &far));
    if (p.excess <= 1.0 && far > open) PetscCall(IsNull(sp, request->transpose, correction, &p.settles));
    if (p.excess <= 1.0 && p.settles) { /* there are other solutions, too */
      PetscCall(AinsworthSaddleVecDestroy(&correction));
      p.moved = 0.0;
      continue;
    }
    p.before = p.excess;
    p.last   = p.moved;
    if (!kept.primal) PetscCall(AinsworthSaddleVecDuplicate(y, &kept));
    PetscCall(AinsworthSaddleVecCopy(y, kept));
    PetscCall(Advance(sp, request->transpose, b, left, correction, Ax, y, &all, &p.moved, &solves, &some));
    /* a small multiple of what does not solve for the residual says little of how far that moves x */
    if (some && !solves && far > p.moved) {
      PetscCall(IsRounding(sp, request->transpose, b, kept, Ax, left, &solves));
      if (!solves) p.moved = far;
    }
  }
  for (auto *list : {&all.p, &all.image})
    for (AinsworthSaddleVec &v : *list) PetscCall(AinsworthSaddleVecDestroy(&v));
  if (kept.primal) PetscCall(AinsworthSaddleVecDestroy(&kept));
  outcome->error = error;
  outcome->moved = p.steps ? p.moved : 0.0;
  outcome->steps = p.steps;
  outcome->state = p.excess > 1.0                 ? AINSWORTH_OUTCOME_UNMET
                   : state != AINSWORTH_CONVERGED ? AINSWORTH_OUTCOME_UNSETTLED
                                                  : AINSWORTH_OUTCOME_SOLVED;
  if (outcome->state == AINSWORTH_OUTCOME_SOLVED) PetscCall(FindRounding(sp, request, solver, b, y, Ax, outcome));
  if (p.excess <= 1.0 && error.dependent.omega > 1.0 && request->combination)
    PetscCall(Depend(sp, request, measure, b, y, left, outcome));
  PetscFunctionReturn(PETSC_SUCCESS);
}
