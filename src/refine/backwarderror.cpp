/* The size of residuals relative to the terms of each row (Oettli and Prager 1964; Arioli, Demmel and Duff 1989) */
#include "backwarderror.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include <algorithm>

/* Agrees on the worst row of all ranks */
static PetscErrorCode AgreeOnWorst(MPI_Comm comm, AinsworthWorstRow *worst)
{
  struct {
    double omega = 0.0;
    int    rank  = 0;
  } mine;
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  mine = {(double)worst->omega, rank};
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &mine, 1, MPI_DOUBLE_INT, MPI_MAXLOC, comm));
  PetscCallMPI(MPI_Bcast(worst, (PetscMPIInt)sizeof(*worst), MPI_BYTE, mine.rank, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Raises `most` to |v_i| s_i, or to infinity if that is not a number */
static void Raise(PetscScalar v, PetscScalar s, PetscReal *most)
{
  const PetscReal size = PetscAbsScalar(v) * PetscRealPart(s);

  *most = PetscMax(*most, PetscIsNanReal(size) ? PETSC_MAX_REAL : size);
}

/* Finds the largest |v_i| s_i, or |v_i| / s_i for unknowns, of this rank */
static PetscErrorCode Largest(Vec v, Vec scale, bool unknowns, PetscReal *largest)
{
  PetscFunctionBegin;
  PetscCall(AinsworthForEntries(
    {v, scale}, [=](PetscInt, PetscScalar a, PetscScalar s) { Raise(a, unknowns ? 1.0 / s : s, largest); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int KindOfUnknown(const AinsworthSaddle *sp, PetscInt i, PetscScalar force)
{
  return !sp->loose[i] ? AINSWORTH_ROWS_HELD : force == 0.0 ? AINSWORTH_ROWS_LOOSE : AINSWORTH_ROWS_FORCED;
}

static int KindOfConstraint(const AinsworthSaddle *sp, PetscInt i)
{
  return sp->kind[i] == AINSWORTH_ROW_NEAR ? AINSWORTH_ROWS_NEAR
         : sp->sprung[i]                   ? AINSWORTH_ROWS_HELD
                                           : AINSWORTH_ROWS_RIGID;
}

/* Computes the terms of C x - D lambda = g, with those of earlier solves (NULL: none). Collective */
static PetscErrorCode DualTerms(const AinsworthSaddle *sp, Vec earlier, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                Vec terms)
{
  /* a residual of an earlier solve, of 1e-10 of its terms at most, may be all of g */
  static const PetscReal noted = 1e-2;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleDualTerms(sp, b, y, terms));
  if (earlier) PetscCall(VecAXPY(terms, noted, earlier));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthLargestEntry - finds the largest entry of v, whose parts may be NULL, in units of the scale: of unknowns, or
   of right-hand sides. Collective
*/
PetscErrorCode AinsworthLargestEntry(const AinsworthSaddle *sp, AinsworthSaddleVec v, bool unknowns, PetscReal *size)
{
  PetscFunctionBegin;
  *size = 0.0;
  if (v.primal) PetscCall(Largest(v.primal, sp->scale.primal, unknowns, size));
  if (v.dual) PetscCall(Largest(v.dual, sp->scale.dual, unknowns, size));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, size, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)sp->all.C)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Allowed(const AinsworthMeasure &m, PetscScalar terms, PetscScalar s, const PetscReal sizes[2])
{
  return m.relative * PetscRealPart(terms) + (m.floor * sizes[0] + m.energetic * sizes[1]) / PetscRealPart(s);
}

/*
   AinsworthAllowedOfConstraints - computes what each row of C x - D lambda = g may be left with, as the error found it.
   Collective
*/
PetscErrorCode AinsworthAllowedOfConstraints(const AinsworthSaddle *sp, const AinsworthMeasure measure[], Vec earlier,
                                             AinsworthSaddleVec b, AinsworthSaddleVec y, const AinsworthBackward *error,
                                             Vec allowed)
{
  PetscFunctionBegin;
  PetscCall(DualTerms(sp, earlier, b, y, allowed));
  PetscCall(AinsworthUpdate(allowed, {sp->scale.dual}, [&](PetscInt i, PetscScalar &t, PetscScalar s) {
    t = Allowed(measure[KindOfConstraint(sp, i)], t, s, error->sizes);
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Raises `worst` to the row of this rank with the largest residual relative to what it is allowed */
static void Look(AinsworthWorstRow *worst, PetscInt row, const AinsworthMeasure &m, PetscScalar r, PetscScalar t,
                 PetscScalar s, const PetscReal sizes[2])
{
  const PetscReal omega = AinsworthQuotient(PetscAbsScalar(r), Allowed(m, t, s, sizes));

  if (omega > worst->omega) *worst = {omega, PetscAbsScalar(r), PetscRealPart(t), row};
}

/* Finds the worst row of A x + B' lambda = f. Collective */
static PetscErrorCode PrimalError(const AinsworthSaddle *sp, PetscBool transpose, const AinsworthMeasure measure[],
                                  AinsworthSaddleVec b, AinsworthSaddleVec y, Vec Ax, Vec left, PetscReal sizes[2],
                                  AinsworthWorstRow *worst)
{
  PetscInt first;
  Vec      terms;

  PetscFunctionBegin;
  *worst = AinsworthWorstRow();
  PetscCall(VecDuplicate(left, &terms));
  PetscCall(AinsworthSaddlePrimalTerms(sp, transpose, b, y, Ax, terms));
  PetscCall(AinsworthLargestEntry(sp, {terms, NULL}, false, &sizes[0]));
  PetscCall(VecGetOwnershipRange(left, &first, NULL));
  PetscCall(AinsworthForEntries({left, terms, sp->scale.primal, b.primal},
                                [&](PetscInt i, PetscScalar r, PetscScalar t, PetscScalar s, PetscScalar force) {
                                  Look(worst, first + i, measure[KindOfUnknown(sp, i, force)], r, t, s, sizes);
                                }));
  PetscCall(VecDestroy(&terms));
  PetscCall(AgreeOnWorst(PetscObjectComm((PetscObject)left), worst));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds the worst rows of C x - D lambda = g, of those that are kept and of those that depend on others. Collective

   primal: size of the other equation, beside which all terms of this one may be rounding: then x is at rest
*/
static PetscErrorCode DualError(const AinsworthSaddle *sp, const AinsworthMeasure measure[], Vec earlier,
                                AinsworthSaddleVec b, AinsworthSaddleVec y, Vec left, PetscReal primal,
                                PetscReal sizes[2], AinsworthBackward *error)
{
  PetscInt first;
  Vec      terms;

  PetscFunctionBegin;
  error->dual = error->dependent = AinsworthWorstRow();
  PetscCall(VecDuplicate(left, &terms));
  PetscCall(DualTerms(sp, earlier, b, y, terms));
  PetscCall(AinsworthLargestEntry(sp, {NULL, terms}, false, &sizes[0]));
  if (sizes[0] <= AinsworthRoundoff * primal) sizes[0] = primal;
  error->sizes[0] = sizes[0];
  error->sizes[1] = sizes[1];
  PetscCall(VecGetOwnershipRange(left, &first, NULL));
  PetscCall(
    AinsworthForEntries({left, terms, sp->scale.dual}, [&](PetscInt i, PetscScalar r, PetscScalar t, PetscScalar s) {
      Look(AinsworthSaddleIsLeftOut(sp, i) ? &error->dependent : &error->dual, first + i,
           measure[KindOfConstraint(sp, i)], r, t, s, sizes);
    }));
  PetscCall(VecDestroy(&terms));
  for (AinsworthWorstRow *worst : {&error->dual, &error->dependent})
    PetscCall(AgreeOnWorst(PetscObjectComm((PetscObject)left), worst));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes the root of x' A x without that of unknowns that hardly anything but their own entry holds, as boundary
   values by penalty do: no strain. Collective
*/
static PetscErrorCode EnergyNorm(const AinsworthSaddle *sp, Vec x, Vec Ax, PetscReal *norm)
{
  PetscReal energy = 0.0;

  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({x, Ax, sp->stiffness}, [&](PetscInt, PetscScalar v, PetscScalar f, PetscScalar a) {
    if (PetscAbsScalar(f - a * v) > AinsworthUndetermined * PetscAbsScalar(f))
      energy += PetscRealPart(PetscConj(v) * f);
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &energy, 1, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)x)));
  *norm = PetscSqrtReal(PetscAbsReal(energy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBackwardError - finds the rows with the largest residual relative to what their measure allows: 1 is just
   enough. Collective

   Units of f and of g are free of each other, so that each equation has a floor of its own, but for C x = 0 of an x
   that is rounding of f. The largest force, and the largest product with a diagonal entry of A, are a lower bound of
   the largest terms, without a pass over A: if all rows of an equation are met relative to that, the quotients returned
   are upper bounds, and no row is named
*/
PetscErrorCode AinsworthBackwardError(const AinsworthSaddle *sp, PetscBool transpose, const AinsworthMeasure measure[],
                                      Vec earlier, AinsworthSaddleVec b, AinsworthSaddleVec y, Vec Ax,
                                      AinsworthSaddleVec left, AinsworthBackward *error)
{
  const AinsworthSaddleVec scale = sp->scale;
  /* of terms, and of residuals of each kind, of both equations */
  PetscReal        sizes[2] = {0.0, 0.0}, most[2 + 2 * AINSWORTH_ROWS_KINDS];
  PetscReal *const kinds[]  = {&most[2], &most[2 + AINSWORTH_ROWS_KINDS]};

  PetscFunctionBegin;
  *error = AinsworthBackward();
  std::fill(std::begin(most), std::end(most), 0.0);
  /* an error of t in it leaves at most 2 t in a row */
  if (measure[AINSWORTH_ROWS_HELD].energetic > 0.0) PetscCall(EnergyNorm(sp, y.primal, Ax, &sizes[1]));
  if (sp->positive) /* the stiffness is the diagonal of A */
    PetscCall(
      AinsworthForEntries({y.primal, sp->stiffness, scale.primal},
                          [&](PetscInt, PetscScalar x, PetscScalar a, PetscScalar s) { Raise(a * x, s, &most[0]); }));
  PetscCall(Largest(b.primal, scale.primal, false, &most[0]));
  PetscCall(Largest(b.dual, scale.dual, false, &most[1]));
  PetscCall(AinsworthForEntries({left.primal, scale.primal, b.primal},
                                [&](PetscInt i, PetscScalar r, PetscScalar s, PetscScalar force) {
                                  Raise(r, s, &kinds[0][KindOfUnknown(sp, i, force)]);
                                }));
  PetscCall(AinsworthForEntries({left.dual, scale.dual}, [&](PetscInt i, PetscScalar r, PetscScalar s) {
    Raise(r, s, &kinds[1][KindOfConstraint(sp, i)]);
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, most, 2 + 2 * AINSWORTH_ROWS_KINDS, MPIU_REAL, MPIU_MAX,
                           PetscObjectComm((PetscObject)Ax)));
  for (int k = 0; k < AINSWORTH_ROWS_KINDS; k++) {
    error->primal.omega = PetscMax(
      error->primal.omega,
      AinsworthQuotient(kinds[0][k], measure[k].floor * most[0] + measure[k].energetic * sizes[1]));
    error->dual.omega = PetscMax(
      error->dual.omega, AinsworthQuotient(kinds[1][k], measure[k].floor * most[1] + measure[k].energetic * sizes[1]));
  }
  error->dependent.omega = error->dual.omega;
  sizes[0]               = most[0];
  if (!(error->primal.omega <= 1.0))
    PetscCall(PrimalError(sp, transpose, measure, b, y, Ax, left.primal, sizes, &error->primal));
  if (!(error->dual.omega <= 1.0)) PetscCall(DualError(sp, measure, earlier, b, y, left.dual, sizes[0], sizes, error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGrowth - computes the largest unknown relative to the right-hand side, in units of the scale: a lower bound
   of the norm of the inverse. Collective

   Times the machine precision it is the least error of x that rounding of the system may cause. 0 for b = 0
*/
PetscErrorCode AinsworthGrowth(const AinsworthSaddle *sp, AinsworthSaddleVec b, Vec x, PetscReal *growth)
{
  PetscReal size;

  PetscFunctionBegin;
  PetscCall(AinsworthLargestEntry(sp, {x, NULL}, true, growth));
  PetscCall(AinsworthLargestEntry(sp, b, false, &size));
  *growth = size > 0.0 ? AinsworthQuotient(*growth, size) : 0.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthChange - computes the largest change p of an unknown relative to the largest x, the worse of the units of
   the program and of the scale. Collective

   In the units of the scale forces and displacements are of one size: the changes of an x at rest count relative to b.
*/
PetscErrorCode AinsworthChange(const AinsworthSaddle *sp, AinsworthSaddleVec b, Vec x, Vec p, PetscReal *change)
{
  /* changes and unknowns, in the program's units and in those of the scale; right-hand side */
  PetscReal all[5] = {0.0, 0.0, 0.0, 0.0, 0.0};

  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({x, p, sp->scale.primal}, [&](PetscInt, PetscScalar a, PetscScalar d, PetscScalar s) {
    const PetscReal v[] = {PetscAbsScalar(d), PetscAbsScalar(d) / PetscRealPart(s), PetscAbsScalar(a),
                           PetscAbsScalar(a) / PetscRealPart(s)};

    for (int k = 0; k < 4; k++) all[k] = v[k] <= all[k] ? all[k] : PetscIsNanReal(v[k]) ? PETSC_MAX_REAL : v[k];
  }));
  PetscCall(Largest(b.primal, sp->scale.primal, false, &all[4]));
  PetscCall(Largest(b.dual, sp->scale.dual, false, &all[4]));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, all, 5, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)x)));
  *change = AinsworthQuotient(all[1], PetscMax(all[3], AinsworthRest * all[4]));
  if (all[3] >= AinsworthRest * all[4]) *change = PetscMax(*change, AinsworthQuotient(all[0], all[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
