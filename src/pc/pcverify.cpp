/* Verification of a reduced solve with the program's own system */
#include "pcainsworth.h"
#include "../events.h"
#include "../loops.h"
#include "../operator/matainsworth.h"
#include "../saddle/terms.h"
#include <petsc/private/pcimpl.h>

/*
   `blind`: factor by which the error of an iterate may exceed the requested tolerance in the energy norm: the method stops by r' M^{-1} r, a norm of the
   residual, and M_* and A may differ by the square of this factor.

   `rounding`: that of x, or of A x, relative to x in the norm of diag(A); if x is a rigid motion, A x is nothing but rounding.

   `suspicious`: the energy, relative to x' diag(A) x, below which its sign is checked.
*/
static const PetscReal blind      = 100;
static const PetscReal rounding   = 1e3 * PETSC_MACHINE_EPSILON;
static const PetscReal suspicious = 1e4 * PETSC_MACHINE_EPSILON;

/*
   PCAinsworthAskedFor_Private - gets the relative tolerance of the reduced solve that has just ended with `reason`

   tol is negative if there was none: the solve ran for a number of iterations, or to an absolute tolerance
*/
PetscErrorCode PCAinsworthAskedFor_Private(const PC_Ainsworth *data, KSPConvergedReason reason, PetscReal *tol)
{
  KSPNormType norm;
  PetscReal   atol;

  PetscFunctionBegin;
  PetscCall(KSPGetTolerances(data->ksp, tol, &atol, NULL, NULL));
  PetscCall(KSPGetNormType(data->ksp, &norm));
  if (data->reporting.stop == AINSWORTH_STOP_ENERGY_ERROR) *tol = data->reporting.rtol;
  else if (norm == KSP_NORM_NONE || reason == KSP_CONVERGED_ITS || (reason == KSP_CONVERGED_ATOL && atol > 0.0)) *tol = -1.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes x' diag(A) x, and diag(A) x in work; both skip zero rows of A, whose weight is made up */
PetscErrorCode PCAinsworthDiagonalEnergy_Private(const PC_Ainsworth *data, Vec x, Vec work, PetscReal *size)
{
  PetscScalar dot;
  Vec         stiffness;

  PetscFunctionBegin;
  PetscCall(AinsworthTermsStiffness(&data->saddle, &stiffness));
  PetscCall(VecPointwiseDivide(work, x, data->inverseDiagonal));
  PetscCall(AinsworthUpdate(work, {stiffness}, [](PetscInt, PetscScalar &w, PetscScalar d) { w = d == 0.0 ? 0.0 : w; }));
  PetscCall(VecDot(work, x, &dot));
  *size = PetscRealPart(dot);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthIsFree_Private - checks whether y is a motion that neither A nor a row of C resists, if D is nonzero or B is not C, so that Q does not tell

   C_i y = 0 is checked relative to |C_i| |y| or, because y has a part that is not free, to the noise of a huge y in the norm of W. A y = 0 is checked in the
   norm of diag(A), to the root of what rounding may add to its energy. A row with a spring D_ii resists with the energy of the spring, which may drown in the
   rounding of y' A y. work: of length n
*/
PetscErrorCode PCAinsworthIsFree_Private(const PC_Ainsworth *data, Vec y, Vec work, PetscBool *isFree)
{
  static const PetscReal along = 1e-8, others = 1e-10, force = 1e-7;
  const Mat              C = data->saddle.C;
  PetscReal              size;
  PetscScalar            resistance;
  PetscInt               held = 0;
  Vec                    rows, lengths, terms, root, springs;

  PetscFunctionBegin;
  PetscCall(PCAinsworthDiagonalEnergy_Private(data, y, work, &size));
  PetscCall(MatMult(data->saddle.A, y, work));
  PetscCall(VecDuplicate(work, &root));
  PetscCall(VecPointwiseMult(root, work, data->inverseDiagonal));
  PetscCall(VecDot(root, work, &resistance));
  *isFree = (PetscBool)(size > 0.0 && PetscRealPart(resistance) <= PetscSqr(force) * size && !PetscIsInfOrNanReal(size));
  if (*isFree) {
    PetscCall(MatCreateVecs(C, NULL, &rows));
    PetscCall(VecDuplicate(rows, &lengths));
    PetscCall(AinsworthRowSquares(C, data->inverseDiagonal, lengths));
    PetscCall(MatMult(C, y, rows));
    PetscCall(VecDuplicate(rows, &terms));
    PetscCall(AinsworthAbsoluteMult(C, y, terms));
    PetscCall(VecDuplicate(rows, &springs));
    PetscCall(VecZeroEntries(springs));
    if (data->saddle.D) PetscCall(AinsworthGetDiagonal(data->saddle.D, springs));
    PetscCall(AinsworthForEntries({rows, lengths, terms, springs}, [&](PetscInt, PetscScalar r, PetscScalar l, PetscScalar t, PetscScalar s) {
      const PetscReal drowned = PetscSqrtReal(1e-3 * PETSC_MACHINE_EPSILON * PetscAbsScalar(s)), seen = others * PetscSqrtReal(PetscRealPart(l));

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
   Detects a floating body by the energy of x

   If A is singular on Ker C and f is not balanced there, rounding makes the energy slightly positive, and Krylov methods find a huge x. The energy y' A y of
   its part y in Ker C is then below the rounding error of this product
*/
static PetscErrorCode CheckEnergy(PC_Ainsworth *data, PetscBool transpose, Vec x, Vec Ax, Vec y, AinsworthVerdict *verdict, char why[], size_t len)
{
  PetscReal   size, sizeY, noise;
  PetscScalar energy;
  PetscBool   isFree, resists = PETSC_TRUE;
  Vec         work;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(x, &work));
  PetscCall(PCAinsworthDiagonalEnergy_Private(data, x, work, &size));
  PetscCall(VecDot(Ax, x, &energy));
  if (data->constraints && !(data->adjoint && !data->saddle.D)) {
    isFree = PETSC_FALSE;
    if (PetscAbsScalar(energy) <= suspicious * size) PetscCall(PCAinsworthIsFree_Private(data, x, work, &isFree));
    if (isFree) {
      *verdict = AINSWORTH_VERDICT_SINGULAR;
      PetscCall(PetscSNPrintf(why, len,
                              "A body floats that no constraint holds, and f is not balanced on it: A is singular on Ker C, x' A x = %g, %g of x' diag(A) x; "
                              "hold it, or attach its motions to the matrix with MatSetNullSpace()",
                              (double)PetscRealPart(energy), (double)(PetscRealPart(energy) / size)));
    }
  } else if (PetscAbsScalar(energy) <= suspicious * size) {
    if (data->constraints) PetscCall(MatAinsworthMultProjector(data->reduced, x, y));
    else PetscCall(VecCopy(x, y));
    PetscCall(PCAinsworthDiagonalEnergy_Private(data, y, work, &sizeY));
    if (sizeY > PetscSqr(rounding) * size || PetscIsInfOrNanReal(size)) { /* otherwise y is only the rounding of x */
      PetscCall(VecPointwiseMult(work, work, y));
      PetscCall(VecNorm(work, NORM_2, &noise)); /* the errors of the terms are independent */
      noise *= 30 * PETSC_MACHINE_EPSILON;
      PetscCall((transpose ? MatMultTranspose : MatMult)(data->saddle.A, y, work));
      PetscCall(VecDot(work, y, &energy));
      if (!(PetscAbsScalar(energy) > noise)) PetscCall(PCAinsworthResists_Private(data, work, sizeY, &resists)); /* y' A y may also be 0 for an indefinite A */
      if (!resists) {
        *verdict = AINSWORTH_VERDICT_SINGULAR;
        PetscCall(
          PetscSNPrintf(why, len,
                        "A body floats that no constraint holds, and f is not balanced on it: A is singular on Ker C, x' A x = %g with a rounding error of "
                        "%g; hold it, or attach its motions to the matrix with MatSetNullSpace()",
                        (double)PetscRealPart(energy), (double)noise));
      }
    }
  }
  PetscCall(VecDestroy(&work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that no entry is NaN, Inf, or nearly so: sums show it on all ranks, but a maximum may lose a NaN, and a product with a zero column hides it */
static PetscErrorCode IsFinite(AinsworthSaddleVec y, PetscBool *finite)
{
  PetscReal sums[2];

  PetscFunctionBegin;
  PetscCall(VecNorm(y.primal, NORM_1, &sums[0]));
  PetscCall(VecNorm(y.dual, NORM_1, &sums[1]));
  *finite = (PetscBool)!PetscIsInfOrNanReal(sums[0] + sums[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rejects an x so large that f and g drown in the rounding of its terms: for any D or B, it is a motion that the system does not resist */
static PetscErrorCode CheckVacuous(PC_Ainsworth *data, AinsworthSaddleVec b, AinsworthSaddleVec y, AinsworthVerdict *verdict, char why[], size_t len)
{
  PetscReal norms[3];
  PetscBool vacuous;

  PetscFunctionBegin;
  PetscCall(VecNorm(b.primal, NORM_INFINITY, &norms[0]));
  PetscCall(VecNorm(b.dual, NORM_INFINITY, &norms[1]));
  PetscCall(VecNorm(y.primal, NORM_INFINITY, &norms[2]));
  if (norms[0] == 0.0 && norms[1] == 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSaddleIsVacuous(&data->saddle, b, y, &vacuous));
  if (!vacuous) PetscFunctionReturn(PETSC_SUCCESS);
  *verdict = AINSWORTH_VERDICT_SINGULAR;
  PetscCall(PetscSNPrintf(why, len,
                          "The reduced solve ended with an x of up to %g, where f and g, up to %g and %g, drown in the rounding of its terms: it is a motion "
                          "that neither A nor C seems to resist, and no solution; does a body float?",
                          (double)norms[2], (double)norms[0], (double)norms[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the terms of dependent rows in earlier solves if g may be the rounding of an x that is decades larger than the current one, otherwise NULL; collective

   Such are the last residuals of Newton's method, or of another solver around this one. A program that attaches a null space of multipliers knows of these rows
*/
static PetscErrorCode GetEarlierTerms(PC pc, PC_Ainsworth *data, Vec g, PetscBool *kept, Vec *earlier)
{
  const AinsworthSaddle *saddle   = &data->saddle;
  MatNullSpace           attached = saddle->nullSpace;
  PetscInt               nested, n[2] = {0, 0};
  PetscBool              other;

  PetscFunctionBegin;
  if (!attached) PetscCall(PetscObjectQuery((PetscObject)saddle->rows[1], "nullspace", (PetscObject *)&attached));
  PetscCall(PetscObjectGetTabLevel((PetscObject)pc, &nested));
  *kept = (PetscBool)(saddle->count[AINSWORTH_ROW_DEPENDENT] && (attached || nested > 0));
  if (data->terms) {
    PetscCall(VecGetLocalSize(g, &n[0]));
    PetscCall(VecGetLocalSize(data->terms, &n[1]));
    other = (PetscBool)(n[0] != n[1]);
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &other, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)g)));
    if (other) PetscCall(VecDestroy(&data->terms));
  }
  *earlier = *kept ? data->terms : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthVerify_Private - computes the residual left = b - K y of both equations, and the verdict on it; why is set unless that is MET

   Needs one product with the program's A, unless A x is known. tol: the requested tolerance, negative if there is none.
*/
PetscErrorCode PCAinsworthVerify_Private(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscReal tol, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                         AinsworthSaddleVec left, AinsworthVerdict *verdict, char why[], size_t len)
{
  AinsworthSaddle *sp = &data->saddle;
  AinsworthUnmet   worst;
  PetscReal        norm, energy;
  PetscBool        doubtful = PETSC_FALSE, finite = PETSC_TRUE, kept = PETSC_FALSE;
  Vec              earlier = NULL, terms;
  PetscInt         n;
  const Vec        Ax = data->Ax;
  char             rows[256];

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Verify, pc, 0, 0, 0));
  *verdict = AINSWORTH_VERDICT_MET;
  why[0]   = 0;
  PetscCall(VecGetSize(y.primal, &n));
  if (data->reduced) PetscCall(MatAinsworthIsDoubtful_Private(data->reduced, &doubtful));
  PetscCall(AinsworthSaddleResidual(sp, transpose, data->knownAx, b, y, Ax, left));
  PetscCall(AinsworthSaddleEnergy(sp, y, Ax, &energy));
  PetscCall(GetEarlierTerms(pc, data, b.dual, &kept, &earlier));
  /* without a requested tolerance any error is allowed, up to a root, so that the product with the root of D_ii does not overflow */
  PetscCall(AinsworthSaddleCheckDual(sp, tol < 0.0 ? PETSC_MAX_REAL : tol, tol < 0.0 ? PetscSqrtReal(PETSC_MAX_REAL) : blind * tol * energy, earlier, b.dual, y,
                                     left.dual, &worst, rows, sizeof(rows), &terms));
  PetscCall(IsFinite(y, &finite));
  if (worst.quotient > 1.0) {
    *verdict = AINSWORTH_VERDICT_UNMET;
    PetscCall(PetscSNPrintf(why, len, "C x = g is not met: row %" PetscInt_FMT " of the multiplier field is left with %g, %g of its terms%s", worst.row,
                            (double)worst.residual, (double)(worst.residual / worst.size),
                            doubtful ? "; the Gram matrix C W C' is ill-conditioned: rows of C are close to others" : ""));
  } else if (!finite) {
    *verdict = AINSWORTH_VERDICT_UNMET;
    PetscCall(PetscSNPrintf(why, len, "The reduced solve says that it converged, but x or lambda holds NaN or Inf, or values too large"));
  } else if (rows[0]) {
    *verdict = AINSWORTH_VERDICT_CONTRADICTION;
    PetscCall(PetscSNPrintf(why, len, "The right-hand side of the constraints is %s; remove the rows or mend it", rows));
  } else {
    worst.quotient = 0.0;
    PetscCall(VecNorm(left.primal, NORM_1, &norm));
    if (PetscIsInfOrNanReal(norm)) tol = PetscMax(tol, 0.0); /* whatever was requested */
    if (tol >= 0.0) PetscCall(AinsworthSaddleCheckPrimal(sp, transpose, doubtful, blind * tol, energy, b.primal, y, Ax, left.primal, &worst));
    if (worst.quotient > 1.0) {
      *verdict = AINSWORTH_VERDICT_UNMET;
      PetscCall(PetscSNPrintf(why, len,
                              "The reduced solve says that it converged, but row %" PetscInt_FMT " of A x + C' lambda = f is left with %g, %g of its terms: %s",
                              worst.row, (double)worst.residual, (double)(worst.residual / worst.size),
                              doubtful ? "the Gram matrix C W C' is ill-conditioned: rows of C are close to others"
                                       : "its method, or its preconditioner, does not see this; is A indefinite on Ker C, or its diagonal zero?"));
    } else if (data->constraints < n || data->saddle.D) PetscCall(CheckEnergy(data, transpose, y.primal, Ax, left.primal, verdict, why, len));
    if (*verdict == AINSWORTH_VERDICT_MET) PetscCall(CheckVacuous(data, b, y, verdict, why, len));
  }
  if (kept && *verdict == AINSWORTH_VERDICT_MET) {
    if (data->terms) PetscCall(VecPointwiseMax(data->terms, data->terms, terms));
    else {
      data->terms = terms;
      terms       = NULL;
    }
  }
  PetscCall(VecDestroy(&terms));
  PetscCall(PetscLogEventEnd(AINSWORTH_Verify, pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
