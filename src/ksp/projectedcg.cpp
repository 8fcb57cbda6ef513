#include "projectedcg.h"
#include "../operator/matainsworth.h"
#include <petsc/private/kspimpl.h>
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include <vector>

struct KSP_ProjectedCG {
  std::vector<PetscReal> alpha, beta; /* of each step, kept where eigenvalue estimates are asked for */
  PetscBool              refine;      /* every projection is done twice */
  PetscReal              step, rz;    /* the last alpha, and r' z after it */
};

static const PetscReal driftTolerance = 1e-12; /* as Gould, Hribar and Nocedal 2001 */
static const PetscInt  driftInterval  = 10;    /* steps between two measurements */

static PetscErrorCode KSPSetUp_ProjectedCG(KSP ksp)
{
  Mat            mat;
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(PCGetOperators(ksp->pc, &mat, NULL));
  PetscCall(MatAinsworthGetContext(mat, &ctx)); /* the error for a matrix without a projector */
  PetscCall(KSPSetWorkVecs(ksp, 4));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = Q M^{-1} r */
static PetscErrorCode Precondition(KSP ksp, Mat mat, Vec r, Vec z, PetscInt step)
{
  KSP_ProjectedCG *cg = (KSP_ProjectedCG *)ksp->data;
  PetscReal        drift;

  PetscFunctionBegin;
  PetscCall(KSP_PCApply(ksp, r, z));
  PetscCall(MatAinsworthMultProjector(mat, z, z));
  if (!cg->refine && step % driftInterval == 0) {
    PetscCall(MatAinsworthGetDrift_Private(mat, z, &drift));
    if (drift > driftTolerance) {
      PetscCall(PetscInfo(ksp, "Step %" PetscInt_FMT ": the projected residual leaves Ker C by a cosine of %g, every projection is refined from here on\n",
                          step, (double)drift));
      cg->refine = PETSC_TRUE;
    }
  }
  if (cg->refine) PetscCall(MatAinsworthMultProjector(mat, z, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For the convergence test: alpha of the step that led to the present iterate, and r' z there */
PetscErrorCode KSPProjectedCGGetCoefficients_Private(KSP ksp, PetscReal *alpha, PetscReal *rz)
{
  const KSP_ProjectedCG *cg = (KSP_ProjectedCG *)ksp->data;

  PetscFunctionBegin;
  *alpha = cg->step;
  *rz    = cg->rz;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rz = r' z and, in the same reduction, the norm that the user asked for */
static PetscErrorCode InnerProducts(KSP ksp, Vec r, Vec z, PetscScalar *rz, PetscReal *norm)
{
  Vec measured = ksp->normtype == KSP_NORM_PRECONDITIONED ? z : (ksp->normtype == KSP_NORM_UNPRECONDITIONED ? r : NULL);

  PetscFunctionBegin;
  *norm = 0.0;
  PetscCall(VecDotBegin(z, r, rz));
  if (measured) PetscCall(VecNormBegin(measured, NORM_2, norm));
  PetscCall(VecDotEnd(z, r, rz));
  if (measured) PetscCall(VecNormEnd(measured, NORM_2, norm));
  if (ksp->normtype == KSP_NORM_NATURAL) *norm = PetscSqrtReal(PetscAbsScalar(*rz));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Report(KSP ksp, PetscInt step, PetscReal norm)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectSAWsTakeAccess((PetscObject)ksp));
  ksp->its   = step;
  ksp->rnorm = norm;
  PetscCall(PetscObjectSAWsGrantAccess((PetscObject)ksp));
  PetscCall(KSPLogResidualHistory(ksp, norm));
  PetscCall(KSPMonitor(ksp, step, norm));
  PetscCall((*ksp->converged)(ksp, step, norm, &ksp->reason, ksp->cnvP));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The norm of a right-hand side that does not see how stiff a body is, (r' W r)^1/2; v is a work vector */
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

static PetscErrorCode KSPSolve_ProjectedCG(KSP ksp)
{
  KSP_ProjectedCG *cg = (KSP_ProjectedCG *)ksp->data;
  Vec              b = ksp->vec_rhs, x = ksp->vec_sol, r = ksp->work[0], z = ksp->work[1], p = ksp->work[2], w = ksp->work[3];
  Mat              mat;
  Mat_Ainsworth   *ctx;
  PetscScalar      rz, pAp;
  PetscReal        norm, alpha, beta, before, after;
  PetscBool        diagonalscale;

  PetscFunctionBegin;
  PetscCall(PCGetDiagonalScale(ksp->pc, &diagonalscale));
  PetscCheck(!diagonalscale, PetscObjectComm((PetscObject)ksp), PETSC_ERR_SUP, "Krylov method %s does not support diagonal scaling",
             ((PetscObject)ksp)->type_name);
  PetscCall(PCGetOperators(ksp->pc, &mat, NULL));
  PetscCall(MatAinsworthGetContext(mat, &ctx));
  cg->alpha.clear();
  cg->beta.clear();
  cg->refine = PETSC_FALSE;

  /* the part in Im(W C') is solved for, the guess counts in Ker C only */
  if (ksp->guess_zero) PetscCall(VecCopy(b, r));
  else {
    PetscCall(MatAinsworthMultProjector(mat, x, p));
    PetscCall(MatAinsworthMultA_Private(ctx, p, w));
    PetscCall(VecWAXPY(r, -1.0, w, b));
  }
  PetscCall(MatAinsworthSolveRange_Private(mat, b, x));
  if (!ksp->guess_zero) PetscCall(VecAXPY(x, 1.0, p));
  PetscCall(WeightedNorm(ctx, r, w, &before));
  PetscCall(MatAinsworthMultTransposeProjector(mat, r, r));
  PetscCall(WeightedNorm(ctx, r, w, &after));
  if (after <= 100 * PETSC_MACHINE_EPSILON * before) PetscCall(VecZeroEntries(r)); /* the rounding of the projection: Ker C = 0, or x = R g */

  PetscCall(Precondition(ksp, mat, r, z, 0));
  PetscCall(InnerProducts(ksp, r, z, &rz, &norm));
  KSPCheckDot(ksp, rz);
  cg->step = 0.0;
  cg->rz   = PetscRealPart(rz);
  if (!ksp->guess_zero) { /* the norm of b that the tolerance refers to is that of its part in Ker C, as with a zero guess */
    PetscCall(MatAinsworthMultTransposeProjector(mat, b, w));
    ksp->vec_rhs = w;
  }
  PetscCall(Report(ksp, 0, norm));
  ksp->vec_rhs = b;
  if (ksp->reason) PetscFunctionReturn(PETSC_SUCCESS);

  for (PetscInt step = 1; step <= ksp->max_it; step++) {
    if (PetscRealPart(rz) == 0.0) {
      ksp->reason = KSP_CONVERGED_ATOL;
      PetscCall(PetscInfo(ksp, "Converged: the residual in Ker C is zero\n"));
      break;
    }
    if (PetscRealPart(rz) < 0.0) {
      PetscCheck(!ksp->errorifnotconverged, PetscObjectComm((PetscObject)ksp), PETSC_ERR_NOT_CONVERGED,
                 "Diverged due to an indefinite preconditioner: r' z = %g at step %" PetscInt_FMT, (double)PetscRealPart(rz), step);
      PetscCall(PetscInfo(ksp, "Diverged: the preconditioner is indefinite, r' z = %g\n", (double)PetscRealPart(rz)));
      ksp->reason = KSP_DIVERGED_INDEFINITE_PC;
      break;
    }
    if (step == 1) PetscCall(VecCopy(z, p));
    else PetscCall(VecAYPX(p, beta, z));
    PetscCall(MatAinsworthMultA_Private(ctx, p, w));
    PetscCall(VecDot(w, p, &pAp));
    KSPCheckDot(ksp, pAp);
    if (PetscRealPart(pAp) <= 0.0) {
      PetscCheck(!ksp->errorifnotconverged, PetscObjectComm((PetscObject)ksp), PETSC_ERR_NOT_CONVERGED,
                 "Diverged due to a matrix that is not positive definite on Ker C: p' A p = %g at step %" PetscInt_FMT, (double)PetscRealPart(pAp), step);
      PetscCall(PetscInfo(ksp, "Diverged: A is not positive definite on Ker C, p' A p = %g\n", (double)PetscRealPart(pAp)));
      ksp->reason = KSP_DIVERGED_INDEFINITE_MAT;
      break;
    }
    alpha = PetscRealPart(rz) / PetscRealPart(pAp);
    PetscCall(VecAXPY(x, alpha, p));
    PetscCall(VecAXPY(r, -alpha, w));
    PetscCall(MatAinsworthMultTransposeProjector(mat, r, r)); /* the residual update: r stays as small as the error */
    PetscCall(Precondition(ksp, mat, r, z, step));
    beta = PetscRealPart(rz);
    PetscCall(InnerProducts(ksp, r, z, &rz, &norm));
    KSPCheckDot(ksp, rz);
    beta     = PetscRealPart(rz) / beta;
    cg->step = alpha;
    cg->rz   = PetscRealPart(rz);
    if (ksp->calc_sings) {
      cg->alpha.push_back(alpha);
      cg->beta.push_back(beta);
    }
    PetscCall(Report(ksp, step, norm));
    if (ksp->reason) break;
  }
  if (!ksp->reason) ksp->reason = KSP_DIVERGED_ITS;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Eigenvalues, ascending, of the Lanczos matrix that the coefficients of CG define (Golub, Van Loan, section 11.3) */
static PetscErrorCode RitzValues(KSP ksp, std::vector<PetscReal> &values)
{
  const KSP_ProjectedCG *cg = (KSP_ProjectedCG *)ksp->data;
  const size_t           n  = cg->alpha.size();
  std::vector<PetscReal> offdiagonal(n), work(PetscMax((size_t)1, 2 * n));
  PetscBLASInt           nb, one = 1, info;

  PetscFunctionBegin;
  values.resize(n);
  for (size_t k = 0; k < n; k++) {
    values[k] = 1.0 / cg->alpha[k] + (k ? cg->beta[k - 1] / cg->alpha[k - 1] : 0.0);
    if (k + 1 < n) offdiagonal[k] = std::sqrt(PetscMax(cg->beta[k], 0.0)) / cg->alpha[k];
  }
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast((PetscInt)n, &nb));
  PetscCallBLAS("LAPACKREALsteqr", LAPACKREALsteqr_("N", &nb, values.data(), offdiagonal.data(), NULL, &one, work.data(), &info));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK routine steqr returned %d", (int)info);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode KSPComputeExtremeSingularValues_ProjectedCG(KSP ksp, PetscReal *emax, PetscReal *emin)
{
  std::vector<PetscReal> values;

  PetscFunctionBegin;
  PetscCall(RitzValues(ksp, values));
  *emin = values.empty() ? 1.0 : values.front();
  *emax = values.empty() ? 1.0 : values.back();
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode KSPComputeEigenvalues_ProjectedCG(KSP ksp, PetscInt nmax, PetscReal *real, PetscReal *imaginary, PetscInt *number)
{
  std::vector<PetscReal> values;

  PetscFunctionBegin;
  PetscCall(RitzValues(ksp, values));
  *number = (PetscInt)values.size();
  PetscCheck(*number <= nmax, PetscObjectComm((PetscObject)ksp), PETSC_ERR_ARG_SIZ, "Room for %" PetscInt_FMT " eigenvalues, there are %" PetscInt_FMT, nmax,
             *number);
  std::copy(values.begin(), values.end(), real);
  std::fill_n(imaginary, values.size(), 0.0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode KSPView_ProjectedCG(KSP ksp, PetscViewer viewer)
{
  KSP_ProjectedCG *cg = (KSP_ProjectedCG *)ksp->data;
  PetscBool        ascii;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (ascii)
    PetscCall(
      PetscViewerASCIIPrintf(viewer, "  iterates in Ker C; refinement of the projection: %s\n", cg->refine ? "on, the constraints drifted" : "not needed"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode KSPDestroy_ProjectedCG(KSP ksp)
{
  PetscFunctionBegin;
  delete (KSP_ProjectedCG *)ksp->data;
  ksp->data = NULL;
  PetscCall(KSPDestroyDefault(ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   KSPPROJECTEDCG - conjugate gradients in Ker C for the reduced operator of `MATAINSWORTH` (Gould, Hribar, Nocedal 2001)

   Level: intermediate

   Notes:
   Solves A~ x = b for any b: the part of x in Im(W C') comes from one direct solve, x_0 = R B^{-1} R' b, and only Ker C is
   iterated on, with z = Q M^{-1} Q' r. C x stays what it is in x_0 to rounding, at every iteration, and the penalty B drops out of the
   spectrum. An iteration costs one product with A, one application of the preconditioner and two solves with the Gram matrix.

   The preconditioner must be symmetric positive definite; A must be so on Ker C (`KSP_DIVERGED_INDEFINITE_PC`,
   `KSP_DIVERGED_INDEFINITE_MAT`). The norm is the natural one unless `KSPSetNormType()` says otherwise; with an initial guess too the
   relative tolerance refers to the part of b in Ker C.

   Every ten steps the angle between the preconditioned residual and Ker C is measured; when rounding has turned it by more than
   1e-12, each projection is done twice from there on.

   The matrix must be of type `MATAINSWORTH`, otherwise `PETSC_ERR_ARG_WRONG`.

   References:
   N. I. M. Gould, M. E. Hribar, J. Nocedal, On the solution of equality constrained quadratic programming problems arising in
   optimization, SIAM J. Sci. Comput. 23 (2001), 1376-1395.

.seealso: `MATAINSWORTH`, `PCAINSWORTH`, `KSPCG`
M*/
PetscErrorCode KSPCreate_ProjectedCG(KSP ksp)
{
  PetscFunctionBegin;
  ksp->data = new KSP_ProjectedCG();
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_NATURAL, PC_LEFT, 3));
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_PRECONDITIONED, PC_LEFT, 2));
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_UNPRECONDITIONED, PC_LEFT, 2));
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_NONE, PC_LEFT, 1));
  ksp->ops->setup                        = KSPSetUp_ProjectedCG;
  ksp->ops->solve                        = KSPSolve_ProjectedCG;
  ksp->ops->destroy                      = KSPDestroy_ProjectedCG;
  ksp->ops->view                         = KSPView_ProjectedCG;
  ksp->ops->buildsolution                = KSPBuildSolutionDefault;
  ksp->ops->buildresidual                = KSPBuildResidualDefault;
  ksp->ops->computeextremesingularvalues = KSPComputeExtremeSingularValues_ProjectedCG;
  ksp->ops->computeeigenvalues           = KSPComputeEigenvalues_ProjectedCG;
  PetscFunctionReturn(PETSC_SUCCESS);
}
