/* Is a vector a motion that neither A nor C resists? For the words of a failure; no verdict depends on it */
#include "solver.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../projection/matainsworth.h"

/*
   Computes x' diag(A) x, and diag(A) x in work; the 1-norm of its row stands in for an entry that is not positive,
   unless that is zero, too
*/
static PetscErrorCode DiagonalEnergy(const AinsworthSolver *solver, Vec x, Vec work, PetscReal *size)
{
  PetscScalar dot;

  PetscFunctionBegin;
  PetscCall(VecPointwiseDivide(work, x, solver->reduced->inverseDiagonal));
  PetscCall(AinsworthUpdate(work, [solver](PetscInt i, PetscScalar &w) { w = solver->saddle->loose[i] ? 0.0 : w; }));
  PetscCall(VecDot(work, x, &dot));
  *size = PetscRealPart(dot);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether y is a motion that neither A nor a row of C resists, if D is nonzero or B is not C, so that Q does not
   tell

   C_i y = 0 is checked relative to |C_i| |y| or, because y has a part that is not free, to the noise of a huge y in the
   norm of W. A y = 0 is checked in the norm of diag(A), to the root of what rounding may add to its energy. A row with
   a spring D_ii resists with the energy of the spring, which may drown in the rounding of y' A y. work: of length n
*/
static PetscErrorCode IsFree(const AinsworthSolver *solver, Vec y, Vec work, PetscBool *isFree)
{
  static const PetscReal along = 1e-8, others = 1e-10, force = 1e-7;
  const Mat              C = solver->saddle->kept.C;
  PetscReal              size;
  PetscScalar            resistance;
  PetscInt               held = 0;
  Vec                    rows, lengths, terms, root, springs;

  PetscFunctionBegin;
  PetscCall(DiagonalEnergy(solver, y, work, &size));
  PetscCall(MatMult(solver->saddle->A, y, work));
  PetscCall(VecDuplicate(work, &root));
  PetscCall(VecPointwiseMult(root, work, solver->reduced->inverseDiagonal));
  PetscCall(VecDot(root, work, &resistance));
  *isFree = (PetscBool)(size > 0.0 && PetscRealPart(resistance) <= PetscSqr(force) * size &&
                        !PetscIsInfOrNanReal(size));
  if (*isFree) {
    PetscCall(AinsworthCreateVecs(C, NULL, &rows));
    PetscCall(VecDuplicate(rows, &lengths));
    PetscCall(AinsworthRowSquares(C, solver->reduced->inverseDiagonal, lengths));
    PetscCall(MatMult(C, y, rows));
    PetscCall(VecDuplicate(rows, &terms));
    PetscCall(AinsworthAbsoluteMult(C, y, terms));
    PetscCall(VecDuplicate(rows, &springs));
    PetscCall(VecZeroEntries(springs));
    if (solver->saddle->kept.D) PetscCall(AinsworthGetDiagonal(solver->saddle->kept.D, springs));
    PetscCall(AinsworthForEntries(
      {rows, lengths, terms, springs}, [&](PetscInt, PetscScalar r, PetscScalar l, PetscScalar t, PetscScalar s) {
        const PetscReal drowned = PetscSqrtReal(1e-3 * PETSC_MACHINE_EPSILON * PetscAbsScalar(s)),
                        seen    = others * PetscSqrtReal(PetscRealPart(l));

        held += PetscAbsScalar(r) > PetscMax(along * PetscRealPart(t), PetscMax(drowned, seen) * PetscSqrtReal(size));
      }));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &held, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)C)));
    *isFree = (PetscBool)!held;
    for (Vec *v : {&rows, &lengths, &terms, &springs}) PetscCall(VecDestroy(v));
  }
  PetscCall(VecDestroy(&root));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether w = A y, projected by Q', is more than rounding in the norm of diag(A)^{-1}; A is indefinite then if
   y' A y = 0; w is overwritten
*/
static PetscErrorCode Resists(const AinsworthSolver *solver, Vec w, PetscReal size, PetscBool *resists)
{
  static const PetscReal force = 1e-5;
  PetscScalar            dot;
  Vec                    work;

  PetscFunctionBegin;
  if (solver->saddle->constraints()) PetscCall(MatAinsworthMultTransposeProjector(solver->reduced->mat, w, w));
  PetscCall(VecDuplicate(w, &work));
  PetscCall(VecPointwiseMult(work, w, solver->reduced->inverseDiagonal));
  PetscCall(VecDot(work, w, &dot));
  PetscCall(VecDestroy(&work));
  *resists = (PetscBool)(PetscRealPart(dot) > PetscSqr(force) * size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes y = Q y and the quotient y' A y / y' diag(A) y, -1 if it is 0 and A is indefinite, 1 if y has no part in Ker
   C

   If Q does not map onto Ker C, for instance if D is nonzero, y is not projected
*/
PetscErrorCode AinsworthSolverRayleighQuotient(const AinsworthSolver *solver, Vec y, PetscReal *quotient)
{
  Vec         work;
  PetscReal   size, before;
  PetscScalar energy;
  PetscBool   isFree = PETSC_FALSE, resists = PETSC_FALSE;
  const bool  projected = !solver->saddle->constraints() || (solver->saddle->adjoint && !solver->saddle->kept.D);

  PetscFunctionBegin;
  *quotient = 1.0;
  PetscCall(VecDuplicate(y, &work));
  PetscCall(DiagonalEnergy(solver, y, work, &before));
  if (!projected) {
    PetscCall(IsFree(solver, y, work, &isFree));
    if (!isFree) before = PETSC_INFINITY;
  } else if (solver->saddle->constraints()) PetscCall(MatAinsworthMultProjector(solver->reduced->mat, y, y));
  PetscCall(DiagonalEnergy(solver, y, work, &size));
  PetscCall(MatMult(solver->saddle->A, y, work));
  PetscCall(VecDot(work, y, &energy));
  if (size > PETSC_SQRT_MACHINE_EPSILON * before && !PetscIsInfOrNanReal(size) && !PetscIsInfOrNanScalar(energy))
    *quotient = PetscRealPart(energy) / size;
  if (PetscAbsReal(*quotient) <= AinsworthNoEnergy && projected) {
    PetscCall(Resists(solver, work, size, &resists));
    if (resists) *quotient = -1.0;
  }
  /* rows that y nearly satisfies may resist by more than that */
  if (!projected && *quotient < AinsworthNegative) *quotient = 1.0;
  PetscCall(VecDestroy(&work));
  PetscFunctionReturn(PETSC_SUCCESS);
}
