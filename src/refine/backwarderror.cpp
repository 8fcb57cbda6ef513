/* The size of residuals relative to the terms of each row (Oettli and Prager 1964; Arioli, Demmel and Duff 1989) */
#include "backwarderror.h"
#include "../loops.h"
#include "../objects.h"

/* Agrees on the worst row of all ranks */
static PetscErrorCode AgreeOnWorst(MPI_Comm comm, AinsworthWorstRow *worst)
{
  struct {
    double omega;
    int    rank;
  } mine;
  PetscMPIInt rank;
  PetscReal   values[2] = {worst->residual, worst->terms};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  mine = {(double)worst->omega, rank};
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &mine, 1, MPI_DOUBLE_INT, MPI_MAXLOC, comm));
  worst->omega = (PetscReal)mine.omega;
  PetscCallMPI(MPI_Bcast(&worst->row, 1, MPIU_INT, mine.rank, comm));
  PetscCallMPI(MPI_Bcast(values, 2, MPIU_REAL, mine.rank, comm));
  worst->residual = values[0];
  worst->terms    = values[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the largest |v_i| s_i, or |v_i| / s_i for unknowns, of this rank */
static PetscErrorCode Largest(Vec v, Vec scale, bool unknowns, PetscReal *largest)
{
  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({v, scale}, [=](PetscInt, PetscScalar a, PetscScalar s) {
    const PetscReal size = unknowns ? PetscAbsScalar(a) / PetscRealPart(s) : PetscAbsScalar(a) * PetscRealPart(s);

    *largest = PetscMax(*largest, PetscIsNanReal(size) ? PETSC_MAX_REAL : size);
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int KindOfUnknown(const AinsworthSaddle *sp, PetscInt i, PetscScalar force)
{
  return !sp->loose[i] ? AINSWORTH_ROWS_HELD : force == 0.0 ? AINSWORTH_ROWS_LOOSE : AINSWORTH_ROWS_FORCED;
}

static int KindOfConstraint(const AinsworthSaddle *sp, PetscInt i)
{
  return sp->sprung[i] ? AINSWORTH_ROWS_HELD : AINSWORTH_ROWS_RIGID;
}

/* Raises `most` to |v_i| s_i, or to infinity if that is not a number */
static void Raise(PetscScalar v, PetscScalar s, PetscReal *most)
{
  const PetscReal size = PetscAbsScalar(v) * PetscRealPart(s);

  *most = PetscMax(*most, PetscIsNanReal(size) ? PETSC_MAX_REAL : size);
}

/* Computes the terms, with those of earlier solves (NULL: none), and the largest of them in the units of the scale. Collective */
static PetscErrorCode TermsAndSize(const AinsworthSaddle *sp, PetscBool transpose, Vec earlier, AinsworthSaddleVec b, AinsworthSaddleVec y, Vec Ax,
                                   AinsworthSaddleVec terms, PetscReal *size)
{
  static const PetscReal noted = 1e-2; /* a residual of an earlier solve, of 1e-10 of its terms at most, may be all of g */

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleTerms(sp, transpose, b, y, Ax, terms));
  if (earlier) PetscCall(VecAXPY(terms.dual, noted, earlier));
  *size = 0.0;
  PetscCall(Largest(terms.primal, sp->scale.primal, false, size));
  PetscCall(Largest(terms.dual, sp->scale.dual, false, size));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, size, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)Ax)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Allowed(const AinsworthMeasure &m, PetscScalar terms, PetscScalar s, const PetscReal sizes[2])
{
  return m.enough * PetscRealPart(terms) + (m.floor * sizes[0] + m.energetic * sizes[1]) / PetscRealPart(s);
}

/* Computes the energy norm of x, if it excuses rows: an error of t in that norm leaves at most 2 t in a row, in the units of the scale. Collective */
static PetscErrorCode EnergyNorm(const AinsworthMeasure measure[], Vec x, Vec Ax, PetscReal *norm)
{
  PetscScalar dot = 0.0;

  PetscFunctionBegin;
  if (measure[AINSWORTH_ROWS_HELD].energetic > 0.0) PetscCall(VecDot(Ax, x, &dot));
  *norm = PetscSqrtReal(PetscAbsScalar(dot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthAllowedOfConstraints - computes what each row of C x - D lambda = g may be left with. Collective */
PetscErrorCode AinsworthAllowedOfConstraints(const AinsworthSaddle *sp, PetscBool transpose, const AinsworthMeasure measure[], Vec earlier,
                                             AinsworthSaddleVec b, AinsworthSaddleVec y, Vec Ax, Vec allowed)
{
  AinsworthSaddleVec terms;
  PetscReal          sizes[2];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleVecDuplicate(b, &terms));
  PetscCall(TermsAndSize(sp, transpose, earlier, b, y, Ax, terms, &sizes[0]));
  PetscCall(EnergyNorm(measure, y.primal, Ax, &sizes[1]));
  PetscCall(VecCopy(terms.dual, allowed));
  PetscCall(
    AinsworthUpdate(allowed, {sp->scale.dual}, [&](PetscInt i, PetscScalar &t, PetscScalar s) { t = Allowed(measure[KindOfConstraint(sp, i)], t, s, sizes); }));
  PetscCall(AinsworthSaddleVecDestroy(&terms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBackwardError - finds the rows with the largest residual relative to what their measure allows: 1 is just enough. Collective

   In the units of the scale each column has an entry of about 1, on the diagonal of A or in C, so that the largest unknown and the largest force are a lower
   bound of the largest terms, without a pass over A: if all rows are met relative to that, the quotients returned are upper bounds, and no row is named
*/
PetscErrorCode AinsworthBackwardError(const AinsworthSaddle *sp, PetscBool transpose, const AinsworthMeasure measure[], Vec earlier, AinsworthSaddleVec b,
                                      AinsworthSaddleVec y, Vec Ax, AinsworthSaddleVec left, AinsworthBackward *error)
{
  const MPI_Comm           comm  = PetscObjectComm((PetscObject)Ax);
  const AinsworthSaddleVec scale = sp->scale;
  PetscReal                sizes[2], most[1 + AINSWORTH_ROWS_KINDS] = {0.0, 0.0, 0.0, 0.0, 0.0}; /* most: of terms, of residuals of each kind */
  AinsworthSaddleVec       terms;
  PetscInt                 first[2];

  PetscFunctionBegin;
  *error = AinsworthBackward();
  PetscCall(EnergyNorm(measure, y.primal, Ax, &sizes[1]));
  if (sp->rowsB == sp->rowsC && sp->positive)
    PetscCall(Largest(y.primal, scale.primal, true, &most[0])); /* otherwise its rows may be small where its columns are not */
  PetscCall(Largest(b.primal, scale.primal, false, &most[0]));
  PetscCall(Largest(b.dual, scale.dual, false, &most[0]));
  PetscCall(AinsworthForEntries({left.primal, scale.primal, b.primal},
                                [&](PetscInt i, PetscScalar r, PetscScalar s, PetscScalar force) { Raise(r, s, &most[1 + KindOfUnknown(sp, i, force)]); }));
  PetscCall(AinsworthForEntries({left.dual, scale.dual}, [&](PetscInt i, PetscScalar r, PetscScalar s) { Raise(r, s, &most[1 + KindOfConstraint(sp, i)]); }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, most, 1 + AINSWORTH_ROWS_KINDS, MPIU_REAL, MPIU_MAX, comm));
  for (int k = 0; k < AINSWORTH_ROWS_KINDS; k++)
    error->primal.omega = PetscMax(error->primal.omega, AinsworthQuotient(most[1 + k], measure[k].floor * most[0] + measure[k].energetic * sizes[1]));
  error->dual.omega = error->dependent.omega = error->primal.omega;
  error->size                                = most[0];
  if (error->primal.omega <= 1.0) PetscFunctionReturn(PETSC_SUCCESS);
  *error = AinsworthBackward();
  PetscCall(AinsworthSaddleVecDuplicate(left, &terms));
  PetscCall(TermsAndSize(sp, transpose, earlier, b, y, Ax, terms, &sizes[0]));
  error->size = sizes[0];
  PetscCall(VecGetOwnershipRange(left.primal, &first[0], NULL));
  PetscCall(VecGetOwnershipRange(left.dual, &first[1], NULL));
  auto look = [&](AinsworthWorstRow *worst, PetscInt row, int kind, PetscScalar r, PetscScalar t, PetscScalar s) {
    const PetscReal omega = AinsworthQuotient(PetscAbsScalar(r), Allowed(measure[kind], t, s, sizes));

    if (omega > worst->omega) *worst = {omega, PetscAbsScalar(r), PetscRealPart(t), row};
  };
  PetscCall(
    AinsworthForEntries({left.primal, terms.primal, scale.primal, b.primal}, [&](PetscInt i, PetscScalar r, PetscScalar t, PetscScalar s, PetscScalar force) {
      look(&error->primal, first[0] + i, KindOfUnknown(sp, i, force), r, t, s);
    }));
  PetscCall(AinsworthForEntries({left.dual, terms.dual, scale.dual}, [&](PetscInt i, PetscScalar r, PetscScalar t, PetscScalar s) {
    look(AinsworthSaddleIsLeftOut(sp, i) ? &error->dependent : &error->dual, first[1] + i, KindOfConstraint(sp, i), r, t, s);
  }));
  PetscCall(AinsworthSaddleVecDestroy(&terms));
  for (AinsworthWorstRow *worst : {&error->primal, &error->dual, &error->dependent}) PetscCall(AgreeOnWorst(comm, worst));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGrowth - computes the largest unknown relative to the right-hand side, in units of the scale: a lower bound of the norm of the inverse. Collective

   Times the machine precision it is the least error of x that rounding of the system may cause. 0 for b = 0
*/
PetscErrorCode AinsworthGrowth(const AinsworthSaddle *sp, AinsworthSaddleVec b, Vec x, PetscReal *growth)
{
  PetscReal sizes[2] = {0.0, 0.0};

  PetscFunctionBegin;
  PetscCall(Largest(x, sp->scale.primal, true, &sizes[0]));
  PetscCall(Largest(b.primal, sp->scale.primal, false, &sizes[1]));
  PetscCall(Largest(b.dual, sp->scale.dual, false, &sizes[1]));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sizes, 2, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)x)));
  *growth = sizes[1] > 0.0 ? AinsworthQuotient(sizes[0], sizes[1]) : 0.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthChange - computes the largest change p of an unknown relative to the largest x, the worse of the units of the program and of the scale. Collective

   In the units of the scale forces and displacements are of one size: the changes of an x at rest count relative to b.
*/
PetscErrorCode AinsworthChange(const AinsworthSaddle *sp, AinsworthSaddleVec b, Vec x, Vec p, PetscReal *change)
{
  PetscReal all[5] = {0.0, 0.0, 0.0, 0.0, 0.0}; /* changes and unknowns, in the program's units and in those of the scale; right-hand side */

  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({x, p, sp->scale.primal}, [&](PetscInt, PetscScalar a, PetscScalar d, PetscScalar s) {
    const PetscReal v[] = {PetscAbsScalar(d), PetscAbsScalar(d) / PetscRealPart(s), PetscAbsScalar(a), PetscAbsScalar(a) / PetscRealPart(s)};

    for (int k = 0; k < 4; k++) all[k] = v[k] <= all[k] ? all[k] : PetscIsNanReal(v[k]) ? PETSC_MAX_REAL : v[k];
  }));
  PetscCall(Largest(b.primal, sp->scale.primal, false, &all[4]));
  PetscCall(Largest(b.dual, sp->scale.dual, false, &all[4]));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, all, 5, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)x)));
  *change = AinsworthQuotient(all[1], PetscMax(all[3], AinsworthRest * all[4]));
  if (all[3] >= AinsworthRest * all[4]) *change = PetscMax(*change, AinsworthQuotient(all[0], all[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
