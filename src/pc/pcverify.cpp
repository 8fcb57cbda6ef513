#include "pcainsworth.h"
#include "../operator/matainsworth.h"
#include <petsc/private/pcimpl.h>

/*
   How much larger, in the norm of diag(A)^{-1}, a residual may be than the inner solver says in its natural norm, r' M^{-1} r: M_* and diag(A) differ
   by the number of entries of a row, and more where penalties are large. What is lost to rounding, relative to |A x| + |f|, comes on top: S may have a condition number of 1e8.
   The third figure is the rounding of x, or of A x, relative to x in the norm of diag(A): all there is of A x where x is a rigid motion.
   The fourth is the energy, relative to x' diag(A) x, below which its sign is looked at.
*/
static const PetscReal blind = 1e4, rounding = PETSC_SQRT_MACHINE_EPSILON, product = 1e3 * PETSC_MACHINE_EPSILON, suspicious = 1e4 * PETSC_MACHINE_EPSILON;

/* Are rows of C nearly dependent? */
static bool Doubtful(const PC_Ainsworth *data)
{
  Mat_Ainsworth *ctx = NULL;

  if (data->reduced) (void)MatShellGetContext(data->reduced, &ctx);
  return ctx && ctx->doubtful;
}

/* x' W y */
static PetscErrorCode WeightedDot(Vec inverseDiagonal, Vec x, Vec y, Vec work, PetscReal *dot)
{
  PetscScalar value;

  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(work, inverseDiagonal, y));
  PetscCall(VecDot(work, x, &value));
  *dot = PetscRealPart(value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A preconditioner that is zero on a part of the residual hides it in the natural norm: multigrid does so where the diagonal of M_* is zero or negative

   Ax = A x; y and work are work vectors.
*/
static PetscErrorCode CheckResidual(PC pc, PC_Ainsworth *data, Vec f, Vec x, Vec Ax, Vec lambda, Vec y, Vec work, PetscBool *failed)
{
  const char *why = Doubtful(data) ? "rows of C are nearly linearly dependent" : "the inner preconditioner does not see it";
  KSPNormType type;
  PetscReal   said, residual, sizes[2];
  PetscScalar size;

  PetscFunctionBegin;
  PetscCall(KSPGetNormType(data->ksp, &type));
  if (type != KSP_NORM_NATURAL) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetResidualNorm(data->ksp, &said));
  PetscCall(WeightedDot(data->inverseDiagonal, Ax, Ax, work, &sizes[0]));
  PetscCall(WeightedDot(data->inverseDiagonal, f, f, work, &sizes[1]));
  PetscCall(VecPointwiseDivide(work, x, data->inverseDiagonal));
  PetscCall(VecDot(work, x, &size));
  PetscCall(MatMultHermitianTranspose(data->saddle.C, lambda, y));
  PetscCall(VecAXPBYPCZ(y, 1.0, -1.0, -1.0, f, Ax)); /* f - A x - C' lambda */
  PetscCall(WeightedDot(data->inverseDiagonal, y, y, work, &residual));
  residual = PetscSqrtReal(residual);
  if (residual <= blind * said + rounding * (PetscSqrtReal(sizes[0]) + PetscSqrtReal(sizes[1])) + product * PetscSqrtReal(PetscRealPart(size)))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(!pc->erroriffailure, PetscObjectComm((PetscObject)pc), PETSC_ERR_NOT_CONVERGED,
             "The reduced solve converged to %g, but the residual is %g: %s; is A indefinite, or its diagonal zero?", (double)said, (double)residual, why);
  PetscCall(PetscInfo(pc, "The reduced solve converged to %g, but the residual is %g: %s\n", (double)said, (double)residual, why));
  *failed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C x = g where solves with the Gram matrix are not accurate, each row in units of (C_i W C_i')^1/2 |x|; work is a work vector */
static PetscErrorCode CheckConstraints(PC pc, PC_Ainsworth *data, Vec g, Vec x, Vec work, PetscBool *failed)
{
  Mat       S;
  Vec       scale, scaled, deviation;
  PetscReal residual, sizeX, sizeG;

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetGramMat_Private(data->reduced, &S));
  PetscCall(MatCreateVecs(S, &scale, NULL));
  PetscCall(VecDuplicate(scale, &scaled));
  PetscCall(VecDuplicate(scale, &deviation));
  PetscCall(MatGetDiagonal(S, scale));
  PetscCall(VecSqrtAbs(scale));
  PetscCall(MatMult(data->saddle.C, x, deviation));
  PetscCall(VecAXPY(deviation, -1.0, g));
  PetscCall(VecPointwiseDivide(scaled, deviation, scale));
  PetscCall(VecNorm(scaled, NORM_2, &residual));
  PetscCall(VecPointwiseDivide(scaled, g, scale));
  PetscCall(VecNorm(scaled, NORM_2, &sizeG));
  PetscCall(VecCopy(data->inverseDiagonal, work));
  PetscCall(VecSqrtAbs(work));
  PetscCall(VecPointwiseDivide(work, x, work));
  PetscCall(VecNorm(work, NORM_2, &sizeX));
  PetscCall(VecDestroy(&scale));
  PetscCall(VecDestroy(&scaled));
  PetscCall(VecDestroy(&deviation));
  if (residual <= rounding * (sizeX + sizeG)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(!pc->erroriffailure, PetscObjectComm((PetscObject)pc), PETSC_ERR_NOT_CONVERGED,
             "C x = g is met to %g only: rows of C are nearly linearly dependent, too nearly for the Gram matrix C W C'", (double)(residual / (sizeX + sizeG)));
  PetscCall(PetscInfo(pc, "C x = g is met to %g only: rows of C are nearly linearly dependent, too nearly for the Gram matrix C W C'\n",
                      (double)(residual / (sizeX + sizeG))));
  *failed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Where A is singular on Ker C and f pushes there, rounding makes a small positive energy of it and Krylov methods find a huge x: its part y in Ker C has an
   energy y' A y below the rounding error of that product
*/
static PetscErrorCode CheckEnergy(PC pc, PC_Ainsworth *data, PetscBool transpose, Vec g, Vec x, Vec Ax, Vec y, Vec work, PetscBool *failed)
{
  PetscReal   size, noise;
  PetscScalar energy;

  PetscFunctionBegin;
  PetscCall(VecPointwiseDivide(work, x, data->inverseDiagonal));
  PetscCall(VecDot(work, x, &energy));
  size = PetscRealPart(energy);
  PetscCall(VecDot(Ax, x, &energy));
  if (PetscAbsScalar(energy) > suspicious * size) PetscFunctionReturn(PETSC_SUCCESS);

  PetscCall(VecCopy(x, y));
  if (data->constraints) {
    PetscCall(MatAinsworthMultRightInverse(data->reduced, g, work));
    PetscCall(VecAXPY(y, -1.0, work));
  }
  PetscCall(VecPointwiseDivide(work, y, data->inverseDiagonal));
  PetscCall(VecDot(work, y, &energy));
  if (PetscRealPart(energy) <= PetscSqr(product) * size && !PetscIsInfOrNanReal(size)) PetscFunctionReturn(PETSC_SUCCESS); /* y is the rounding of x */
  PetscCall(VecPointwiseMult(work, work, y));
  PetscCall(VecNorm(work, NORM_2, &noise)); /* errors of the terms are independent */
  noise *= 30 * PETSC_MACHINE_EPSILON;
  if (transpose) PetscCall(MatMultTranspose(data->saddle.A, y, work));
  else PetscCall(MatMult(data->saddle.A, y, work));
  PetscCall(VecDot(work, y, &energy));
  if (PetscAbsScalar(energy) > noise) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(!pc->erroriffailure, PetscObjectComm((PetscObject)pc), PETSC_ERR_NOT_CONVERGED,
             "A is singular on Ker C, x' A x = %g with a rounding error of %g, and f is not balanced there: does a body float that no constraint holds?",
             (double)PetscRealPart(energy), (double)noise);
  PetscCall(PetscInfo(pc, "A is singular on Ker C, x' A x = %g with a rounding error of %g, and f is not balanced there\n", (double)PetscRealPart(energy),
                      (double)noise));
  *failed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where Ker C = 0 no inner solver looks at the right-hand side; every entry of f and g that is not finite makes lambda so */
static PetscErrorCode CheckFinite(PC pc, Vec lambda, PetscBool *failed)
{
  PetscReal norm;

  PetscFunctionBegin;
  PetscCall(VecNorm(lambda, NORM_2, &norm));
  if (!PetscIsInfOrNanReal(norm)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(!pc->erroriffailure, PetscObjectComm((PetscObject)pc), PETSC_ERR_FP, "The right-hand side holds NaN or Inf, or values too large");
  PetscCall(PetscInfo(pc, "The right-hand side holds NaN or Inf, or values too large\n"));
  *failed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the convergence test of the inner solver cannot see; one product with A */
PetscErrorCode PCAinsworthVerify_Private(PC pc, PC_Ainsworth *data, PetscBool transpose, Vec f, Vec g, Vec x, Vec lambda, PetscBool *failed)
{
  Vec      Ax, y, work;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecGetSize(x, &n));
  if (data->constraints == n) {
    PetscCall(CheckFinite(pc, lambda, failed));
    if (*failed) PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecDuplicate(data->inverseDiagonal, &Ax));
  PetscCall(VecDuplicate(data->inverseDiagonal, &y));
  PetscCall(VecDuplicate(data->inverseDiagonal, &work));
  if (transpose) PetscCall(MatMultTranspose(data->saddle.A, x, Ax));
  else PetscCall(MatMult(data->saddle.A, x, Ax));
  if (data->constraints && data->constraints < n) PetscCall(CheckResidual(pc, data, f, x, Ax, lambda, y, work, failed));
  if (!*failed && Doubtful(data)) PetscCall(CheckConstraints(pc, data, g, x, work, failed));
  if (!*failed && data->constraints < n) PetscCall(CheckEnergy(pc, data, transpose, g, x, Ax, y, work, failed));
  PetscCall(VecDestroy(&Ax));
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&work));
  PetscFunctionReturn(PETSC_SUCCESS);
}
