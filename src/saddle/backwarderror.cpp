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

/* size_i at least `little` of the largest of all, in the norm of diag(A)^{-1}: the row of a body that nothing moves has only rounding to show */
static PetscErrorCode RaiseSmallTerms(AinsworthSaddle *sp, Vec size)
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
  PetscCall(AinsworthTermsThroughRows(sp, diagonal, forces));
  PetscCall(VecGetLocalSize(size, &n));
  PetscCall(VecGetArrayRead(diagonal, &d));
  PetscCall(VecGetArray(size, &s));
  for (PetscInt i = 0; i < n; i++) {
    if (PetscRealPart(d[i]) > 0.0) most = PetscMax(most, PetscRealPart(s[i]) / PetscSqrtReal(PetscRealPart(d[i])));
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)size)));
  PetscCall(VecGetArrayRead(forces, &b));
  for (PetscInt i = 0; i < n; i++)
    s[i] = PetscMax(PetscRealPart(s[i]), little * most * (PetscRealPart(d[i]) > 0.0 ? PetscSqrtReal(PetscRealPart(d[i])) : PetscRealPart(b[i])));
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
  PetscCall(AinsworthTermsPrimal(sp, transpose, f, x, lambda, Ax, rowsPrimal));
  PetscCall(RaiseSmallTerms(sp, rowsPrimal));
  PetscCall(LargestQuotient(primal, rowsPrimal, NULL, error));
  PetscCall(AinsworthTermsDual(sp, 0.0, g, x, lambda, rowsDual, &slack));
  PetscCall(LargestQuotient(dual, rowsDual, sp->kind, error));
  PetscCall(VecDestroy(&slack));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, error, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)f)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
