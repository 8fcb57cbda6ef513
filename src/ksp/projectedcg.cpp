#include "projectedcg.h"
#include "../operator/matainsworth.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>

static const PetscReal driftTolerance = 1e-12; /* from Gould, Hribar and Nocedal 2001 */
static const PetscInt  driftInterval  = 10;    /* projections between two measurements */

static const char ownSetUp[] = "KSPProjectedCGSetUp_C", ownSolve[] = "KSPProjectedCGSolve_C"; /* the original functions of the method */

/* Gets the reduced operator of a method, also from behind the observer of an error estimate */
static PetscErrorCode GetOperator(PC pc, Mat *mat, Mat_Ainsworth **ctx)
{
  Mat behind;

  PetscFunctionBegin;
  PetscCall(PCGetOperators(pc, mat, NULL));
  PetscCall(PetscObjectQuery((PetscObject)*mat, "AinsworthObserved", (PetscObject *)&behind));
  if (behind) *mat = behind;
  PetscCall(MatAinsworthGetContext_Private(*mat, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes z = Q M^{-1} r; with refinement, r = Q' r comes first: the residual update of Gould, Hribar and Nocedal keeps r as small as the error */
static PetscErrorCode PCApply_Projected(PC pc, Vec r, Vec z)
{
  Mat            mat;
  Mat_Ainsworth *ctx;
  PetscReal      drift;
  PetscErrorCode code;

  PetscFunctionBegin;
  PetscCall(GetOperator(pc, &mat, &ctx));
  if (ctx->refine) {
    PetscCall(VecLockReadPop(r)); /* PCApply() locks its input */
    code = MatAinsworthMultTransposeProjector(mat, r, r);
    PetscCall(VecLockReadPush(r));
    PetscCall(code);
  }
  PetscCall(KSPProjectedCGPrecondition_Private(pc, mat, ctx, r, z));
  if (!ctx->refine && ctx->projections++ % driftInterval == 0) {
    PetscCall(MatAinsworthGetDrift_Private(mat, z, &drift));
    if (drift > driftTolerance) {
      PetscCall(PetscInfo(mat, "Projection %" PetscInt_FMT ": directions leave Ker C by a cosine of %g, every projection is refined from here on\n",
                          ctx->projections, (double)drift));
      ctx->refine = PETSC_TRUE;
    }
  }
  if (ctx->refine) PetscCall(MatAinsworthMultProjector(mat, z, z));
  ctx->direction = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes (r' W r)^1/2, a norm of right-hand sides that does not depend on the stiffness of bodies; v is a work vector */
static PetscErrorCode WeightedNorm(const Mat_Ainsworth *ctx, Vec r, Vec v, PetscReal *norm)
{
  PetscScalar square;

  PetscFunctionBegin;
  if (ctx->weight) {
    PetscCall(VecPointwiseMult(v, ctx->weight, r));
    PetscCall(VecDot(v, r, &square));
    *norm = PetscSqrtReal(PetscRealPart(square));
  } else PetscCall(VecNorm(r, NORM_2, norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Applies the inverse of M_*^+, which includes the springs of D (docs/method.md), with the preconditioner or its transpose */
template <PetscErrorCode (*Mat_Ainsworth::*apply)(PC, Vec, Vec)>
static PetscErrorCode ApplyWithSprings(PC pc, Vec r, Vec z)
{
  Mat            mat;
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(GetOperator(pc, &mat, &ctx));
  PetscCall(MatAinsworthPrecondition_Private(mat, pc, ctx->*apply, r, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls the method's own solve, of any type, with the reduced operator and a preconditioner that includes the springs of D */
static PetscErrorCode SolveWithSprings(KSP ksp, Mat_Ainsworth *ctx, PetscErrorCode (*solve)(KSP))
{
  PC             pc = ksp->pc;
  PetscErrorCode error;

  PetscFunctionBegin;
  if (ctx->springs) {
    PetscCall((*solve)(ksp));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  ctx->apply          = pc->ops->apply;
  ctx->applyTranspose = pc->ops->applytranspose;
  pc->ops->apply      = ApplyWithSprings<&Mat_Ainsworth::apply>;
  if (ctx->applyTranspose) pc->ops->applytranspose = ApplyWithSprings<&Mat_Ainsworth::applyTranspose>;
  error                   = (*solve)(ksp); /* checked when everything is restored */
  pc->ops->apply          = ctx->apply;
  pc->ops->applytranspose = ctx->applyTranspose;
  PetscCall(error);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls the method's own solve for Q' A Q x = Q' b with the preconditioner Q M^{-1}, from an x whose part in Im(W C') is already that of the solution */
static PetscErrorCode KSPSolve_ProjectedCG(KSP ksp)
{
  PC             pc = ksp->pc;
  Vec            b = ksp->vec_rhs, x = ksp->vec_sol, r, v;
  Mat            mat;
  Mat_Ainsworth *ctx;
  PetscReal      before, after;
  PetscBool      transpose = ksp->transpose_solve;
  PetscErrorCode (*solve)(KSP), error;

  PetscFunctionBegin;
  PetscCheck(!transpose || !PetscDefined(USE_COMPLEX), PetscObjectComm((PetscObject)ksp), PETSC_ERR_SUP,
             "KSPSolveTranspose() with conjugate gradients in Ker C needs real numbers");
  PetscCall(GetOperator(pc, &mat, &ctx));
  PetscCall(PetscObjectQueryFunction((PetscObject)ksp, ownSolve, &solve));
  if (ctx->D) {
    PetscCall(SolveWithSprings(ksp, ctx, solve));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecDuplicate(b, &r));
  PetscCall(VecDuplicate(b, &v));
  PetscCall(MatAinsworthSolveRange_Private(mat, b, v));
  if (!ksp->guess_zero) PetscCall(MatAinsworthMultProjector(mat, x, x)); /* only the part of the guess in Ker C counts */
  else PetscCall(VecZeroEntries(x));
  PetscCall(VecAXPY(x, 1.0, v));
  PetscCall(WeightedNorm(ctx, b, v, &before));
  PetscCall(MatAinsworthMultTransposeProjector(mat, b, r));
  PetscCall(WeightedNorm(ctx, r, v, &after));
  if (after <= 100 * PETSC_MACHINE_EPSILON * before) PetscCall(VecZeroEntries(r)); /* only rounding is left: Ker C = 0, or x = R g */
  PetscCall(VecDestroy(&v));

  ctx->apply    = pc->ops->apply;
  const auto by = std::to_string(((PetscObject)pc)->id) + ((PetscObject)pc)->type_name;
  if (ctx->liftedBy != by) PetscCall(KSPProjectedCGForget_Private(ctx));
  ctx->liftedBy = by;
  PetscCall(KSPProjectedCGLift_Private(pc, mat, ctx));
  ctx->inKernel  = PETSC_TRUE;
  ctx->direction = ctx->refine = PETSC_FALSE;
  ctx->projections             = 0;
  pc->ops->apply               = PCApply_Projected;
  ksp->vec_rhs                 = r;
  ksp->transpose_solve         = PETSC_FALSE;   /* A is symmetric */
  error                        = (*solve)(ksp); /* checked when everything is restored */
  ksp->transpose_solve         = transpose;
  ksp->vec_rhs                 = b;
  pc->ops->apply               = ctx->apply;
  ctx->inKernel                = PETSC_FALSE;
  PetscCall(VecDestroy(&r));
  PetscCall(error);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds the residual of an iterate, which is not in Ker C, so that its product must include Q */
static PetscErrorCode KSPBuildResidual_ProjectedCG(KSP ksp, Vec t, Vec v, Vec *residual)
{
  Mat            mat;
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(GetOperator(ksp->pc, &mat, &ctx));
  ctx->direction = PETSC_FALSE;
  PetscCall(KSPBuildResidualDefault(ksp, t, v, residual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Makes a conjugate gradient method of any type iterate in Ker C, or any method include the springs of D, or undoes that

   Setters of the method may restore its own solve
*/
PetscErrorCode KSPProjectedCGSetUse_Private(KSP ksp, PetscBool use)
{
  PetscErrorCode (*solve)(KSP);

  PetscFunctionBegin;
  if (use && ksp->ops->solve != KSPSolve_ProjectedCG) {
    PetscCall(PetscObjectComposeFunction((PetscObject)ksp, ownSolve, ksp->ops->solve));
    ksp->ops->solve = KSPSolve_ProjectedCG;
    if (ksp->ops->buildresidual == KSPBuildResidualDefault) ksp->ops->buildresidual = KSPBuildResidual_ProjectedCG;
  } else if (!use && ksp->ops->solve == KSPSolve_ProjectedCG) {
    PetscCall(PetscObjectQueryFunction((PetscObject)ksp, ownSolve, &solve));
    ksp->ops->solve = solve;
    if (ksp->ops->buildresidual == KSPBuildResidual_ProjectedCG) ksp->ops->buildresidual = KSPBuildResidualDefault;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the method iterates in Ker C, which it does not if D is nonzero */
PetscErrorCode KSPProjectedCGGetUse_Private(KSP ksp, PetscBool *use)
{
  Mat            mat;
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  *use = (PetscBool)(ksp->ops->solve == KSPSolve_ProjectedCG);
  if (!*use) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetOperator(ksp->pc, &mat, &ctx));
  *use = (PetscBool)!ctx->D;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPProjectedCGGetDirection_Private - gets the search direction of KSPCG, also without constraints; NULL for other types, and before their set-up */
PetscErrorCode KSPProjectedCGGetDirection_Private(KSP ksp, Vec *direction)
{
  static const int place = 2; /* among the work vectors */
  PetscBool        cg;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPPROJECTEDCG, KSPCG, ""));
  *direction = cg && ksp->nwork > place ? ksp->work[place] : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode KSPSetUp_ProjectedCG(KSP ksp)
{
  Mat            mat;
  Mat_Ainsworth *ctx;
  PetscErrorCode (*setup)(KSP);

  PetscFunctionBegin;
  PetscCall(GetOperator(ksp->pc, &mat, &ctx)); /* raises the error for a matrix without a projector */
  PetscCall(PetscObjectQueryFunction((PetscObject)ksp, ownSetUp, &setup));
  PetscCall((*setup)(ksp));
  PetscCall(KSPProjectedCGSetUse_Private(ksp, PETSC_TRUE)); /* -ksp_cg_single_reduction may have set another solve */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   KSPPROJECTEDCG - conjugate gradients in Ker C for the reduced operator of `MATAINSWORTH` (Gould, Hribar, Nocedal 2001)

   Options Database Key:
.  -ksp_cg_single_reduction - one reduction per iteration, see `KSPCGUseSingleReduction()`

   Level: intermediate

   Notes:
   The method solves A~ x = b for any b. The part of x in Im(W C') comes from a direct solve, x_0 = R B^{-1} R' b. `KSPCG` then iterates in Ker C, with the
   operator Q' A Q, the right-hand side Q' b and the preconditioner Q M^{-1}. At every iteration C x equals C x_0 to rounding, and the penalty B does not affect
   the spectrum. An iteration costs one product with A, one application of the preconditioner and two solves with the Gram matrix.

   Options, functions and convergence reasons are those of `KSPCG`. The preconditioner must be symmetric positive definite, and A must be so on Ker C. The
   default norm is the natural one. The relative tolerance refers to the part of b in Ker C, also with an initial guess.

   Every ten projections the method measures the angle between a direction and Ker C. Once rounding has turned a direction by more than 1e-12, each projection
   is done twice, and residuals are projected before the preconditioner.

   `KSPCG`, `KSPFCG`, `KSPPIPEFCG`, `KSPPIPECG`, `KSPGROPPCG`, `KSPPIPEPRCG` and `KSPPIPECG2` iterate in Ker C in the same way if they are the inner method of
   `PCAINSWORTH`, except in the variant of the paper.

   Errors:
   `PETSC_ERR_ARG_WRONG` if the matrix is not of type `MATAINSWORTH`; `PETSC_ERR_SUP` for `KSPSolveTranspose()` in complex arithmetic.

   References:
   N. I. M. Gould, M. E. Hribar, J. Nocedal, On the solution of equality constrained quadratic programming problems arising in
   optimization, SIAM J. Sci. Comput. 23 (2001), 1376-1395.

.seealso: `MATAINSWORTH`, `PCAINSWORTH`, `KSPCG`
M*/
PetscErrorCode KSPCreate_ProjectedCG(KSP ksp)
{
  PetscErrorCode (*create)(KSP);

  PetscFunctionBegin;
  PetscCall(PetscFunctionListFind(KSPList, KSPCG, &create));
  PetscCall((*create)(ksp));
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_NATURAL, PC_LEFT, 4));
  PetscCall(PetscObjectComposeFunction((PetscObject)ksp, ownSetUp, ksp->ops->setup));
  ksp->ops->setup = KSPSetUp_ProjectedCG;
  PetscCall(KSPProjectedCGSetUse_Private(ksp, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
