/* Residuals of both equations relative to the terms of their rows */
#include "terms.h"
#include "../loops.h"
#include "../objects.h"

/* Finds the largest |r_i| / s_i of the kept rows (all if kind is NULL); replaces size by 1 / s, and by 0 in other rows */
static PetscErrorCode LargestQuotient(Vec residual, Vec size, const AinsworthRowKind *kind, PetscReal *largest)
{
  PetscFunctionBegin;
  PetscCall(AinsworthUpdate(size, {residual}, [=](PetscInt i, PetscScalar &s, PetscScalar r) {
    const bool kept = !kind || (kind[i] != AINSWORTH_ROW_ZERO && kind[i] != AINSWORTH_ROW_DEPENDENT);

    if (kept) *largest = PetscMax(*largest, AinsworthQuotient(PetscAbsScalar(r), PetscRealPart(s)));
    s = kept && PetscRealPart(s) > 0.0 ? 1.0 / PetscRealPart(s) : 0.0;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Raises the terms of each row to at least `little` times the largest of all, in the norm of diag(A)^{-1}: the row of a body that does not move has only
   rounding

   A row without stiffness is raised less if a spring D_kk is so soft that its force would move row k of C by more than the terms `rows` of that row. These are
   raised in the norm of diag(S)^{-1} as well.
*/
static PetscErrorCode RaiseSmallTerms(AinsworthSaddle *sp, PetscReal little, Vec rows, Vec size)
{
  Vec       diagonal, forces;
  PetscReal most = 0.0;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(size, &diagonal));
  PetscCall(VecDuplicate(size, &forces));
  PetscCall(AinsworthGetDiagonal(sp->block[0], diagonal));
  PetscCall(AinsworthForEntries({size, diagonal}, [&](PetscInt, PetscScalar s, PetscScalar d) {
    if (PetscRealPart(d) > 0.0) most = PetscMax(most, PetscRealPart(s) / PetscSqrtReal(PetscRealPart(d)));
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)size)));
  PetscCall(AinsworthTermsThroughRows(sp, diagonal, little * most, rows, forces));
  PetscCall(AinsworthTermsRaise(sp, diagonal, little, rows));
  PetscCall(AinsworthUpdate(size, {diagonal, forces}, [=](PetscInt, PetscScalar &s, PetscScalar d, PetscScalar b) {
    s = PetscMax(PetscRealPart(s), PetscRealPart(d) > 0.0 ? little * most * PetscSqrtReal(PetscRealPart(d)) : PetscRealPart(b));
  }));
  PetscCall(VecDestroy(&forces));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleBackwardError - computes the largest residual of a row of both equations relative to its terms, which are raised to `little` times the largest

   left: from AinsworthSaddleResidual(). On return, weights is the inverse of these terms, 0 in rows that no x can change. Collective
*/
PetscErrorCode AinsworthSaddleBackwardError(AinsworthSaddle *sp, PetscBool transpose, PetscReal little, AinsworthSaddleVec b, AinsworthSaddleVec y, Vec Ax,
                                            AinsworthSaddleVec left, AinsworthSaddleVec weights, PetscReal *error)
{
  Vec slack;

  PetscFunctionBegin;
  *error = 0.0;
  PetscCall(AinsworthTermsPrimal(sp, transpose, PETSC_INFINITY, b.primal, y, Ax, weights.primal));
  PetscCall(AinsworthTermsDual(sp, AinsworthCombinedLeast, 0.0, b.dual, y, weights.dual, &slack));
  PetscCall(RaiseSmallTerms(sp, little, weights.dual, weights.primal));
  PetscCall(LargestQuotient(left.primal, weights.primal, NULL, error));
  PetscCall(LargestQuotient(left.dual, weights.dual, sp->kind, error));
  PetscCall(VecDestroy(&slack));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, error, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)Ax)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes |f| plus the forces of multipliers that are determined by their own row */
static PetscErrorCode GivenForces(const AinsworthSaddle *sp, Vec f, Vec lambda, Vec forces)
{
  Vec known, part;

  PetscFunctionBegin;
  PetscCall(VecCopy(f, forces));
  PetscCall(VecAbs(forces));
  if (!sp->count[AINSWORTH_ROW_DECOUPLED]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthVecClone(lambda, &known));
  PetscCall(AinsworthUpdate(known, [sp](PetscInt i, PetscScalar &k) {
    if (sp->kind[i] != AINSWORTH_ROW_DECOUPLED) k = 0.0;
  }));
  PetscCall(VecDuplicate(f, &part));
  PetscCall(AinsworthAbsoluteMultTranspose(sp->rowsB, known, part));
  PetscCall(VecAXPY(forces, 1.0, part));
  PetscCall(VecDestroy(&part));
  PetscCall(VecDestroy(&known));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleIsVacuous - tells whether the whole right-hand side is below the rounding of the terms of its rows. Collective

   Then x = 0 would pass as a solution, too, and x is, to rounding, a motion that neither equation resists. A force on an unknown without stiffness never counts
   as rounding.
*/
PetscErrorCode AinsworthSaddleIsVacuous(AinsworthSaddle *sp, AinsworthSaddleVec b, AinsworthSaddleVec y, PetscBool *vacuous)
{
  static const PetscReal rounding = 10 * PETSC_MACHINE_EPSILON;
  MPI_Comm               comm     = PetscObjectComm((PetscObject)y.primal);
  Vec                    stiffness, forces, size, absolute;
  PetscInt               found = 0;
  PetscReal              displacement;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(y.primal, &forces));
  PetscCall(AinsworthTermsStiffness(sp, &stiffness));
  PetscCall(AinsworthTermsDisplacement(stiffness, y.primal, &displacement, NULL));
  PetscCall(GivenForces(sp, b.primal, y.dual, forces));
  PetscCall(AinsworthForEntries({stiffness, forces}, [&](PetscInt, PetscScalar d, PetscScalar force) {
    if (PetscRealPart(force) > rounding * displacement * PetscRealPart(d)) found = 1;
  }));
  PetscCall(VecDestroy(&forces));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_MAX, comm));
  if (!found && sp->absolute) {
    PetscCall(VecDuplicate(b.dual, &size));
    PetscCall(AinsworthDuplicateAbs(y.primal, &absolute));
    PetscCall(VecShift(absolute, displacement));
    PetscCall(MatMult(sp->absolute, absolute, size));
    PetscCall(VecDestroy(&absolute));
    PetscCall(AinsworthForEntries({size, b.dual}, [&](PetscInt i, PetscScalar s, PetscScalar a) {
      if (sp->kind[i] != AINSWORTH_ROW_DECOUPLED && PetscAbsScalar(a) > AinsworthCombined * PetscRealPart(s)) found = 1;
    }));
    PetscCall(VecDestroy(&size));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_MAX, comm));
  }
  *vacuous = (PetscBool)(!found && displacement > 0.0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
