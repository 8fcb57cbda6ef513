/* The residuals of both equations relative to the terms of their rows */
#include "terms.h"

/* The largest |r_i| / s_i of rows that are kept, all where kind is NULL; size becomes 1 / s, 0 on other rows */
static PetscErrorCode LargestQuotient(Vec residual, Vec size, const AinsworthRowKind *kind, PetscReal *largest)
{
  PetscInt           n;
  const PetscScalar *r;
  PetscScalar       *s;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(residual, &n));
  PetscCall(VecGetArrayRead(residual, &r));
  PetscCall(VecGetArray(size, &s));
  for (PetscInt i = 0; i < n; i++) {
    const bool kept = !kind || (kind[i] != AINSWORTH_ROW_ZERO && kind[i] != AINSWORTH_ROW_DEPENDENT);

    if (kept) *largest = PetscMax(*largest, AinsworthQuotient(PetscAbsScalar(r[i]), PetscRealPart(s[i])));
    s[i] = kept && PetscRealPart(s[i]) > 0.0 ? 1.0 / PetscRealPart(s[i]) : 0.0;
  }
  PetscCall(VecRestoreArrayRead(residual, &r));
  PetscCall(VecRestoreArray(size, &s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   size_i at least `little` of the largest of all, in the norm of diag(A)^{-1}: the row of a body that nothing moves has only rounding to show. A row without
   stiffness has less where a spring D_kk is so soft that its force moves row k of C by more than the terms of that, rows
*/
static PetscErrorCode RaiseSmallTerms(AinsworthSaddle *sp, Vec rows, Vec size)
{
  static const PetscReal little = 1e-3;
  Vec                    diagonal, forces;
  PetscScalar           *s;
  const PetscScalar     *d, *b;
  PetscReal              most = 0.0;
  PetscInt               n;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(size, &diagonal));
  PetscCall(VecDuplicate(size, &forces));
  PetscCall(AinsworthGetDiagonal(sp->block[0], diagonal));
  PetscCall(VecGetLocalSize(size, &n));
  PetscCall(VecGetArrayRead(diagonal, &d));
  PetscCall(VecGetArray(size, &s));
  for (PetscInt i = 0; i < n; i++) {
    if (PetscRealPart(d[i]) > 0.0) most = PetscMax(most, PetscRealPart(s[i]) / PetscSqrtReal(PetscRealPart(d[i])));
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)size)));
  PetscCall(AinsworthTermsThroughRows(sp, diagonal, little * most, rows, forces));
  PetscCall(VecGetArrayRead(forces, &b));
  for (PetscInt i = 0; i < n; i++)
    s[i] = PetscMax(PetscRealPart(s[i]), PetscRealPart(d[i]) > 0.0 ? little * most * PetscSqrtReal(PetscRealPart(d[i])) : PetscRealPart(b[i]));
  PetscCall(VecRestoreArrayRead(forces, &b));
  PetscCall(VecDestroy(&forces));
  PetscCall(VecRestoreArray(size, &s));
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleBackwardError - the largest residual of a row of both equations, relative to its terms

   primal and dual: AinsworthSaddleResidual(). rows, of both: one over these terms, 0 where no x can do anything
*/
PetscErrorCode AinsworthSaddleBackwardError(AinsworthSaddle *sp, PetscBool transpose, Vec f, Vec g, Vec x, Vec lambda, Vec Ax, Vec primal, Vec dual,
                                            Vec rowsPrimal, Vec rowsDual, PetscReal *error)
{
  Vec slack;

  PetscFunctionBegin;
  *error = 0.0;
  PetscCall(AinsworthTermsPrimal(sp, transpose, PETSC_INFINITY, f, x, lambda, Ax, rowsPrimal));
  PetscCall(AinsworthTermsDual(sp, PETSC_TRUE, 0.0, g, x, lambda, rowsDual, &slack));
  PetscCall(RaiseSmallTerms(sp, rowsDual, rowsPrimal));
  PetscCall(LargestQuotient(primal, rowsPrimal, NULL, error));
  PetscCall(LargestQuotient(dual, rowsDual, sp->kind, error));
  PetscCall(VecDestroy(&slack));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, error, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)f)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* forces = |f|, and what multipliers that their own row determines do to A x */
static PetscErrorCode GivenForces(const AinsworthSaddle *sp, Vec f, Vec lambda, Vec forces)
{
  Vec          known, part;
  Mat          M;
  PetscScalar *k;

  PetscFunctionBegin;
  PetscCall(VecCopy(f, forces));
  PetscCall(VecAbs(forces));
  if (!sp->count[AINSWORTH_ROW_DECOUPLED]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthDuplicateAbs(lambda, &known));
  PetscCall(VecGetArray(known, &k));
  for (PetscInt i = 0; i < sp->local; i++)
    if (sp->kind[i] != AINSWORTH_ROW_DECOUPLED) k[i] = 0.0;
  PetscCall(VecRestoreArray(known, &k));
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsB, &M));
  PetscCall(VecDuplicate(f, &part));
  PetscCall(MatMultTranspose(M, known, part));
  PetscCall(VecAXPY(forces, 1.0, part));
  PetscCall(MatDestroy(&M));
  PetscCall(VecDestroy(&part));
  PetscCall(VecDestroy(&known));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleIsVacuous - is all of the right-hand side below the rounding of the terms of its rows? Then x = 0 would pass for a solution, too, and x is, to
   rounding, a motion that neither equation resists

   A force on an unknown without stiffness is never taken for rounding.
*/
PetscErrorCode AinsworthSaddleIsVacuous(AinsworthSaddle *sp, Vec f, Vec g, Vec x, Vec lambda, PetscBool *vacuous)
{
  static const PetscReal rounding = 10 * PETSC_MACHINE_EPSILON;
  MPI_Comm               comm     = PetscObjectComm((PetscObject)x);
  Vec                    stiffness, forces, size;
  PetscInt               n, found = 0;
  PetscReal              displacement;
  const PetscScalar     *d, *b, *s;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(x, &forces));
  PetscCall(AinsworthTermsStiffness(sp, &stiffness));
  PetscCall(AinsworthTermsDisplacement(stiffness, x, &displacement, NULL));
  PetscCall(GivenForces(sp, f, lambda, forces));
  PetscCall(VecGetLocalSize(f, &n));
  PetscCall(VecGetArrayRead(stiffness, &d));
  PetscCall(VecGetArrayRead(forces, &b));
  for (PetscInt i = 0; i < n && !found; i++) found = PetscRealPart(b[i]) > rounding * displacement * PetscRealPart(d[i]);
  PetscCall(VecRestoreArrayRead(forces, &b));
  PetscCall(VecRestoreArrayRead(stiffness, &d));
  PetscCall(VecDestroy(&forces));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_MAX, comm));
  if (!found && sp->absolute) {
    Vec absolute;

    PetscCall(VecDuplicate(g, &size));
    PetscCall(AinsworthDuplicateAbs(x, &absolute));
    PetscCall(VecShift(absolute, displacement));
    PetscCall(MatMult(sp->absolute, absolute, size));
    PetscCall(VecDestroy(&absolute));
    PetscCall(VecGetArrayRead(size, &s));
    PetscCall(VecGetArrayRead(g, &b));
    for (PetscInt i = 0; i < sp->local && !found; i++)
      found = sp->kind[i] != AINSWORTH_ROW_DECOUPLED && PetscAbsScalar(b[i]) > AinsworthCombined * PetscRealPart(s[i]);
    PetscCall(VecRestoreArrayRead(g, &b));
    PetscCall(VecRestoreArrayRead(size, &s));
    PetscCall(VecDestroy(&size));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_MAX, comm));
  }
  *vacuous = (PetscBool)(!found && displacement > 0.0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
