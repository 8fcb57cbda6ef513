/* The verdict of the program's own system on the solution of a reduced solve, which may be refined for that */
#include "pcainsworth.h"
#include "../base/events.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../projection/matainsworth.h"

/*
   Gets the relative tolerance of the reduced solve that has just ended with `reason`

   tol is negative if there was none: the solve ran for a number of iterations, or to an absolute tolerance
*/
static PetscErrorCode GetTolerance(const PC_Ainsworth *data, KSPConvergedReason reason, PetscReal *tol)
{
  KSPNormType norm;
  PetscReal   atol;

  PetscFunctionBegin;
  PetscCall(KSPGetTolerances(data->inner.ksp, tol, &atol, NULL, NULL));
  PetscCall(KSPGetNormType(data->inner.ksp, &norm));
  if (data->settings.stop == AINSWORTH_STOP_ENERGY_ERROR) *tol = data->settings.rtol;
  else if (reason >= 0 &&
           (norm == KSP_NORM_NONE || reason == KSP_CONVERGED_ITS || (reason == KSP_CONVERGED_ATOL && atol > 0.0)))
    *tol = -1.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks that no entry is NaN, Inf, or nearly so: sums show it on all ranks, but a maximum may lose a NaN, and a
   product with a zero column hides it
*/
static PetscErrorCode IsFinite(AinsworthSaddleVec y, PetscBool *finite)
{
  PetscReal sums[2];

  PetscFunctionBegin;
  PetscCall(VecNorm(y.primal, NORM_1, &sums[0]));
  PetscCall(VecNorm(y.dual, NORM_1, &sums[1]));
  *finite = (PetscBool)!PetscIsInfOrNanReal(sums[0] + sums[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Rejects an x that rounding of the system moves: a motion that the system does not resist, as of a body that floats

   Growth, a lower bound of the norm of the inverse, tells the same of A, B, C and D. Rows that determine an unknown or
   a multiplier by themselves may put large forces on others.
*/
static PetscErrorCode CheckDetermined(PC_Ainsworth *data, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                      const AinsworthOutcome &outcome, AinsworthVerdict *verdict, char why[],
                                      size_t len)
{
  const PetscReal most   = AinsworthUndetermined;
  PetscReal       growth = outcome.growth, rounding, quotient, norms[3];
  Vec             motion;

  PetscFunctionBegin;
  if (PETSC_MACHINE_EPSILON * growth > most && data->reduced->f) {
    PetscCall(AinsworthSaddleRestrict(data->saddle.get(), b, {data->reduced->f, data->reduced->g}));
    PetscCall(AinsworthGrowth(data->saddle.get(), {data->reduced->f, b.dual}, y.primal, &growth));
  }
  rounding = PetscMax(outcome.rounding, PETSC_MACHINE_EPSILON * growth);
  if (rounding <= most) PetscFunctionReturn(PETSC_SUCCESS);
  *verdict = AINSWORTH_VERDICT_SINGULAR;
  PetscCall(AinsworthVecClone(y.primal, &motion));
  PetscCall(AinsworthSolverRayleighQuotient(data, motion, &quotient));
  PetscCall(VecDestroy(&motion));
  PetscCall(VecNorm(b.primal, NORM_INFINITY, &norms[0]));
  PetscCall(VecNorm(b.dual, NORM_INFINITY, &norms[1]));
  PetscCall(VecNorm(y.primal, NORM_INFINITY, &norms[2]));
  if (PetscAbsReal(quotient) <= AinsworthNoEnergy)
    PetscCall(PetscSNPrintf(
      why, len,
      "A body floats that no constraint holds, and f is not balanced on it: A is singular on Ker C, x' A x is %g of x' "
      "diag(A) x, and "
      "rounding moves x by %g of itself; hold it, or attach its motions to the matrix with MatSetNullSpace()",
      (double)quotient, (double)rounding));
  else
    PetscCall(PetscSNPrintf(why, len,
                            "The reduced solve ended with an x of up to %g, where f and g, up to %g and %g, drown in "
                            "the rounding of its terms, which moves it "
                            "by %g of itself: it is a motion that neither A nor C seems to resist; does a body float?",
                            (double)norms[2], (double)norms[0], (double)norms[1], (double)rounding));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the terms of dependent rows in earlier solves if g may be the rounding of an x that is decades larger than the
   current one, otherwise NULL; collective

   Such are the last residuals of Newton's method, or of another solver around this one. A program that attaches a null
   space of multipliers knows of these rows
*/
static PetscErrorCode GetEarlierTerms(PC pc, PC_Ainsworth *data, Vec g, PetscBool *kept, Vec *earlier)
{
  const AinsworthSaddle *saddle   = data->saddle.get();
  MatNullSpace           attached = saddle->nullSpace;
  PetscInt               nested, n[2] = {0, 0};
  PetscBool              other;

  PetscFunctionBegin;
  if (!attached) PetscCall(PetscObjectQuery((PetscObject)saddle->rows[1], "nullspace", (PetscObject *)&attached));
  PetscCall(PetscObjectGetTabLevel((PetscObject)pc, &nested));
  *kept = (PetscBool)(saddle->count[AINSWORTH_ROW_DEPENDENT] + saddle->count[AINSWORTH_ROW_NEAR] &&
                      (attached || nested > 0));
  if (data->outcome.terms) {
    PetscCall(VecGetLocalSize(g, &n[0]));
    PetscCall(VecGetLocalSize(data->outcome.terms, &n[1]));
    other = (PetscBool)(n[0] != n[1]);
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &other, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)g)));
    if (other) PetscCall(VecDestroy(&data->outcome.terms));
  }
  *earlier = *kept ? data->outcome.terms : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the terms of rows of C for later solves */
static PetscErrorCode KeepTerms(PC_Ainsworth *data, AinsworthSaddleVec b, AinsworthSaddleVec y)
{
  Vec terms;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(b.dual, &terms));
  PetscCall(AinsworthSaddleDualTerms(data->saddle.get(), b, y, terms));
  if (data->outcome.terms) PetscCall(VecPointwiseMax(data->outcome.terms, data->outcome.terms, terms));
  else PetscCall(AinsworthShare(terms, &data->outcome.terms));
  PetscCall(VecDestroy(&terms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Classifies the reduced solve by what its norm says of the error: conjugate gradients end by the energy, which is fair
   to all unknowns if the preconditioner is. Jacobi and its kind know only single unknowns or parts of them, not what
   they do together, and neither does a matrix that could not be factored
*/
static PetscErrorCode IsEnergetic(const PC_Ainsworth *data, PetscBool *energetic)
{
  KSPType     type;
  KSPNormType norm;
  PC          inner;
  PetscBool   local;

  PetscFunctionBegin;
  PetscCall(KSPGetType(data->inner.ksp, &type));
  PetscCall(AinsworthSolverGetInnerPC(data, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &local, PCNONE, PCJACOBI, PCPBJACOBI, PCBJACOBI, PCSOR, PCILU,
                                      PCICC, ""));
  PetscCall(AinsworthSolverIsConjugateGradients(type, energetic));
  PetscCall(KSPGetNormType(data->inner.ksp, &norm));
  if (norm != KSP_NORM_NATURAL && norm != KSP_NORM_DEFAULT && norm != KSP_NORM_NONE) *energetic = PETSC_FALSE;
  if (data->settings.stop == AINSWORTH_STOP_ENERGY_ERROR) local = PETSC_FALSE; /* the energy itself has ended it */
  if (local || data->whole.factor || data->history.factor == AINSWORTH_FAILED || !data->saddle->adjoint)
    *energetic = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether an error of x in the energy norm bounds the residual of each row: projected with W = diag(A)^-1, it is
   at most that of A, in units of the scale
*/
static PetscErrorCode IsBounded(const PC_Ainsworth *data, PetscBool *bounded)
{
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  *bounded = PETSC_TRUE;
  if (!AinsworthSolverReducedMat(data)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAinsworthGetContext_Private(data->reduced->mat, &ctx));
  *bounded = (PetscBool)(ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the verdict, and says why */
static PetscErrorCode Describe(const PC_Ainsworth *data, const AinsworthOutcome *outcome, AinsworthVerdict *verdict,
                               char why[], size_t len)
{
  const AinsworthBackward *e        = &outcome->error;
  PetscBool                doubtful = PETSC_FALSE;
  const char              *close    = "the Gram matrix C W C' is ill-conditioned: rows of C are close to others";

  PetscFunctionBegin;
  if (AinsworthSolverReducedMat(data)) PetscCall(MatAinsworthIsDoubtful_Private(data->reduced->mat, &doubtful));
  *verdict = AINSWORTH_VERDICT_UNMET;
  switch (outcome->state) {
  case AINSWORTH_OUTCOME_SOLVED:
    *verdict = AINSWORTH_VERDICT_MET;
    break;
  case AINSWORTH_OUTCOME_CONTRADICTION:
    *verdict = AINSWORTH_VERDICT_CONTRADICTION;
    break;
  case AINSWORTH_OUTCOME_UNSETTLED:
    PetscCall(PetscSNPrintf(why, len,
                            "The solution is not met: rows are left with up to %g of what they are allowed, which "
                            "another solve takes for %g of x",
                            (double)PetscMax(e->primal.omega, e->dual.omega), (double)outcome->moved));
    break;
  default:
    if (e->dual.omega > e->primal.omega || e->dependent.omega > e->primal.omega) {
      const AinsworthWorstRow *row = e->dual.omega > e->dependent.omega ? &e->dual : &e->dependent;

      PetscCall(PetscSNPrintf(why, len,
                              "C x = g is not met: row %" PetscInt_FMT
                              " of the multiplier field is left with %g, %g of its terms%s%s",
                              row->row, (double)row->residual, (double)(row->residual / row->terms),
                              doubtful ? "; " : "", doubtful ? close : ""));
    } else
      PetscCall(PetscSNPrintf(
        why, len,
        "The %s says that it converged, but row %" PetscInt_FMT
        " of A x + C' lambda = f is left with %g, %g of its terms: %s",
        data->whole.factor ? "factored whole system" : "reduced solve", e->primal.row, (double)e->primal.residual,
        (double)(e->primal.residual / e->primal.terms),
        doubtful
          ? close
          : "its method, or its preconditioner, does not see this; is A indefinite on Ker C, or its diagonal zero?"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names the rows that contradict others */
static PetscErrorCode DescribeContradiction(const PC_Ainsworth *data, std::vector<bool> &marked, char why[], size_t len)
{
  const AinsworthSaddle *sp   = data->saddle.get();
  PetscBool              zero = PETSC_FALSE;
  char                   names[128];
  const char            *text;

  PetscFunctionBegin;
  for (size_t i = 0; i < marked.size(); i++)
    zero = (PetscBool)(zero || (marked[i] && sp->kind[i] == AINSWORTH_ROW_ZERO));
  PetscCall(
    MPIU_Allreduce(MPI_IN_PLACE, &zero, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)sp->all.C)));
  for (size_t i = 0; i < marked.size(); i++) marked[i] = marked[i] && (zero == (sp->kind[i] == AINSWORTH_ROW_ZERO));
  PetscCall(AinsworthSaddleNameRows(sp, marked, names, sizeof(names)));
  if (zero) text = "nonzero on a row of C that is zero (rows %s of the multiplier field): no solution exists";
  else
    text = "not that of the other rows of C on which it depends (rows %s of the multiplier field): no solution exists";
  PetscCall(PetscStrncpy(why, "The right-hand side of the constraints is ", len));
  {
    char rest[384];

    PetscCall(PetscSNPrintf(rest, sizeof(rest), text, names));
    PetscCall(PetscStrlcat(why, rest, len));
  }
  PetscCall(PetscStrlcat(why, "; remove the rows or mend it", len));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthJudge_Private - refines y until it solves the program's system, and gets the verdict on it; why is set
   unless that is MET

   reason: how the reduced solve ended; one that was stopped by rounding is a solution if further solves agree with it.
   known: data->reduced->Ax is op(A) x. left: the residual of y, on return
*/
PetscErrorCode PCAinsworthJudge_Private(PC pc, PC_Ainsworth *data, PetscBool transpose, KSPConvergedReason reason,
                                        const AinsworthSolveFn &solver, PetscBool known, AinsworthSaddleVec b,
                                        AinsworthSaddleVec y, AinsworthSaddleVec left, AinsworthVerdict *verdict,
                                        char why[], size_t len)
{
  const AinsworthSaddle *sp = data->saddle.get();
  AinsworthRequest       request;
  AinsworthOutcome       outcome;
  PetscBool              finite = PETSC_TRUE, kept = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Verify, pc, 0, 0, 0));
  why[0]            = 0;
  request.transpose = transpose;
  PetscCall(GetTolerance(data, reason, &request.tol));
  PetscCall(IsEnergetic(data, &request.energetic));
  if (reason < 0) request.energetic = PETSC_FALSE;
  PetscCall(IsBounded(data, &request.bounded));
  PetscCall(GetEarlierTerms(pc, data, b.dual, &kept, &request.earlier));
  request.combination = [data](Vec w) {
    return data->saddle->constraints() ? MatAinsworthCombineRows_Private(data->reduced->mat, data->saddle.get(), w)
                                       : PETSC_SUCCESS; /* a row of zeros is one by itself */
  };
  PetscCall(IsFinite(y, &finite));
  if (!finite) {
    *verdict = AINSWORTH_VERDICT_UNMET;
    PetscCall(PetscSNPrintf(
      why, len, "The reduced solve says that it converged, but x or lambda holds NaN or Inf, or values too large"));
  } else {
    PetscCall(AinsworthRefine(sp, &request, solver, b, y, data->reduced->Ax, left, &known, &outcome));
    PetscCall(Describe(data, &outcome, verdict, why, len));
    if (*verdict == AINSWORTH_VERDICT_CONTRADICTION)
      PetscCall(DescribeContradiction(data, outcome.contradictory, why, len));
  }
  if (*verdict == AINSWORTH_VERDICT_MET) PetscCall(CheckDetermined(data, b, y, outcome, verdict, why, len));
  if (kept && *verdict == AINSWORTH_VERDICT_MET) PetscCall(KeepTerms(data, b, y));
  PetscCall(PetscLogEventEnd(AINSWORTH_Verify, pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
