/* Further solves of a system [A B'; C -D] for its residual, until each row of both equations is met relative to its own terms */
#include "pcainsworth.h"
#include "../loops.h"
#include "../saddle/terms.h"
#include <vector>

/* Multiplies y by w, the weights of the rows of both equations */
static PetscErrorCode Multiply(AinsworthSaddleVec y, AinsworthSaddleVec w, AinsworthSaddleVec *product)
{
  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(product->primal, y.primal, w.primal));
  PetscCall(VecPointwiseMult(product->dual, y.dual, w.dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Dot(AinsworthSaddleVec x, AinsworthSaddleVec y, PetscScalar *dot)
{
  PetscScalar part[2];

  PetscFunctionBegin;
  PetscCall(VecDot(x.primal, y.primal, &part[0]));
  PetscCall(VecDot(x.dual, y.dual, &part[1]));
  *dot = part[0] + part[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the residual and its largest entry relative to the terms of its row, which count at least `little` of the largest; known: A x is known */
static PetscErrorCode Left(PC_Ainsworth *data, PetscBool transpose, PetscBool known, PetscReal little, AinsworthSaddleVec b, AinsworthSaddleVec y,
                           AinsworthSaddleVec left, AinsworthSaddleVec weights, PetscReal *error)
{
  PetscFunctionBegin;
  PetscCall(AinsworthSaddleResidual(&data->saddle, transpose, known, b, y, data->Ax, left));
  PetscCall(AinsworthSaddleBackwardError(&data->saddle, transpose, little, b, y, data->Ax, left, weights, error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes the largest change of an unknown by p, relative to the largest unknown with stiffness or, because its unit may be any, without; collective

   weights: one over the terms of each row of A x + B' lambda = f. An x that is less than `part` of what these terms alone would cause, as at rest, is their
   rounding
*/
static PetscErrorCode LargestChange(Vec stiffness, Vec weights, Vec x, Vec p, PetscReal *change)
{
  static const PetscReal part    = 1e-8;
  PetscReal              most[2] = {0.0, 0.0};

  PetscFunctionBegin;
  *change = 0.0;
  PetscCall(AinsworthForEntries({x, stiffness, weights}, [&](PetscInt, PetscScalar v, PetscScalar d, PetscScalar w) {
    most[d == 0.0] = PetscMax(most[d == 0.0], PetscAbsScalar(v));
    if (d != 0.0 && w != 0.0) most[0] = PetscMax(most[0], part / (PetscAbsScalar(w) * PetscAbsScalar(d)));
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, most, 2, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)x)));
  PetscCall(AinsworthForEntries({p, stiffness}, [&](PetscInt, PetscScalar v, PetscScalar d) {
    if (v != 0.0) *change = PetscMax(*change, PetscAbsScalar(v) / PetscMax(most[d == 0.0], PetscAbsScalar(v)));
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, change, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)x)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves for the residual, or a part of it, to a relative tolerance of at least `loose` */
static PetscErrorCode SolveLoosely(PC pc, PC_Ainsworth *data, PetscBool transpose, PCAinsworthExtent extent, PetscReal loose, AinsworthSaddleVec left,
                                   AinsworthSaddleVec p, KSPConvergedReason *reason)
{
  PetscReal      rtol, atol, dtol;
  PetscInt       limit;
  PetscErrorCode error;

  PetscFunctionBegin;
  PetscCall(KSPGetTolerances(data->ksp, &rtol, &atol, &dtol, &limit));
  PetscCall(KSPSetTolerances(data->ksp, PetscMax(rtol, loose), atol, dtol, limit));
  error = PCAinsworthSolveFields_Private(pc, data, transpose, extent, left, p, reason);
  PetscCall(KSPSetTolerances(data->ksp, rtol, atol, dtol, limit));
  PetscCall(error);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Adds a direction from a reduced solve to the tolerance `loose`, and takes the step along it that minimizes the residual relative to the terms of the rows

   images: weighted residuals of the directions, -K p, orthonormal; some: there was a direction; change: how far the solve moves x
*/
static PetscErrorCode Step(PC pc, PC_Ainsworth *data, PetscBool transpose, PCAinsworthExtent extent, PetscReal loose, Vec stiffness, AinsworthSaddleVec left,
                           AinsworthSaddleVec weights, AinsworthSaddleVec y, std::vector<AinsworthSaddleVec> &directions,
                           std::vector<AinsworthSaddleVec> &images, PetscBool *some, PetscReal *change)
{
  AinsworthSaddleVec p, q, r, none;
  KSPConvergedReason reason;
  PetscScalar        dot;

  PetscFunctionBegin;
  for (AinsworthSaddleVec *v : {&p, &q, &r, &none}) PetscCall(AinsworthSaddleVecDuplicate(left, v));
  PetscCall(VecZeroEntries(p.primal));
  PetscCall(SolveLoosely(pc, data, transpose, extent, loose, left, p, &reason));
  PetscCall(LargestChange(stiffness, weights.primal, y.primal, p.primal, change));
  PetscCall(VecZeroEntries(none.primal));
  PetscCall(VecZeroEntries(none.dual));
  PetscCall(AinsworthSaddleResidual(&data->saddle, transpose, data->knownAx, none, p, data->Ax, q));
  PetscCall(Multiply(q, weights, &q));
  PetscCall(Multiply(left, weights, &r));
  for (size_t k = 0; k < images.size(); k++) {
    PetscCall(Dot(q, images[k], &dot));
    PetscCall(AinsworthSaddleVecAXPY(q, -dot, images[k]));
    PetscCall(AinsworthSaddleVecAXPY(p, -dot, directions[k]));
  }
  PetscCall(Dot(q, q, &dot));
  *some = (PetscBool)(PetscRealPart(dot) > 0.0 && !PetscIsInfOrNanScalar(dot) && reason != KSP_DIVERGED_ITS /* further solves would end there, too */
                      && reason != KSP_DIVERGED_DTOL);
  if (*some) {
    const PetscScalar scale = 1.0 / PetscSqrtReal(PetscRealPart(dot));

    for (Vec v : {p.primal, p.dual, q.primal, q.dual}) PetscCall(VecScale(v, scale));
    PetscCall(Dot(r, q, &dot));
    PetscCall(AinsworthSaddleVecAXPY(y, -dot, p)); /* q = -K p */
    directions.push_back(p);
    images.push_back(q);
  } else {
    PetscCall(AinsworthSaddleVecDestroy(&p));
    PetscCall(AinsworthSaddleVecDestroy(&q));
  }
  PetscCall(AinsworthSaddleVecDestroy(&r));
  PetscCall(AinsworthSaddleVecDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Classifies the reduced solve by what its norm says of the error

   energetic: the method ends by the energy, which is fair to all unknowns. fair: it does, or it is GMRES, which is used if there is no energy. Both are only as
   good as the preconditioner. blind: that knows only single unknowns or parts of them, not what they do together, or its matrix could not be factored
*/
static PetscErrorCode IsFair(const PC_Ainsworth *data, PetscBool *energetic, PetscBool *fair, PetscBool *blind)
{
  KSPType type;
  PC      inner;

  PetscFunctionBegin;
  PetscCall(KSPGetType(data->ksp, &type));
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, blind, PCNONE, PCJACOBI, PCPBJACOBI, PCBJACOBI, PCSOR, PCILU, PCICC, ""));
  PetscCall(PCAinsworthIsConjugateGradients_Private(type, energetic));
  if (data->escape.refused) *blind = PETSC_TRUE;
  if (*blind) *energetic = PETSC_FALSE;
  *fair = *energetic;
  if (!*fair && !*blind) PetscCall(PetscStrInList(type, KSPGMRES "," KSPFGMRES, ',', fair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether each row of both equations has to be met relative to its own terms; tol: the requested tolerance, negative if there is none */
bool PCAinsworthRefinesRows_Private(const PC_Ainsworth *data, PetscReal tol)
{
  return data->constraints && (!data->adjoint || data->saddle.D) && tol >= 0.0;
}

/*
   PCAinsworthRefineRows_Private - refines by generalized conjugate residuals, preconditioned by reduced solves

   If D is nonzero, or B is not C, unknowns of very different stiffness meet, and the norms of the reduced solve are not fair to all of them. Neither are those
   of methods other than conjugate gradients and GMRES, or with a preconditioner such as Jacobi, for any system. A residual that further solves cannot reduce,
   or an x that may still be far off, is not a solution; the solves show how far the residual moves x.

   After conjugate gradients, a step of steepest descent, or at most two solves to half of the residual, suffice to show that it moves x too little to count,
   however large it is in a row with small terms. If springs are much softer than A, that step is taken after any method.

   tol: the requested tolerance, negative if there is none. stopped: rounding ended the first solve, and another one has to agree with it. verified: the result
   is met in the energy. left: the residual of both equations; it and y are overwritten. refined: there was something to do. why: set if the residual is too
   large, or moves x too far; otherwise empty
*/
PetscErrorCode PCAinsworthRefineRows_Private(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscBool stopped, PetscBool verified, PetscReal tol,
                                             AinsworthSaddleVec b, AinsworthSaddleVec y, AinsworthSaddleVec left, PetscBool *refined, char why[], size_t len)
{
  static const PetscReal          rounding = 1e-13, determined = 1e-6, margin = 10;
  static const int                most = 10, patience = 3, probes = 2;
  const PetscReal                 open = PetscMax(1e4 * tol, determined);
  PetscReal                       little, enough, nearly, wanted, error, best, softest, change = 0.0, moves = 0.0;
  int                             idle = 0, solves = 0;
  AinsworthSaddleVec              weights, others, kept;
  std::vector<AinsworthSaddleVec> directions, images;
  PetscBool                       some = PETSC_TRUE, known = PETSC_TRUE, fair, energetic, blind;
  bool                            strict, probing, helped = false;
  Vec                             stiffness;

  PetscFunctionBegin;
  *refined = PETSC_FALSE;
  why[0]   = 0;
  PetscCall(IsFair(data, &energetic, &fair, &blind));
  energetic = (PetscBool)(energetic && data->adjoint && verified && !stopped);
  strict    = PCAinsworthRefinesRows_Private(data, tol);
  if (!strict && (fair || !data->constraints || tol < 0.0)) PetscFunctionReturn(PETSC_SUCCESS);
  little = energetic || (!strict && !blind) ? AinsworthSmallTerms : AinsworthSmallTerms / 100;
  strict = strict && !fair;
  enough = PetscMax(strict ? tol : 10 * tol, rounding);
  nearly = 60 * enough;
  wanted = stopped ? 0.0 : enough;
  PetscCall(AinsworthCreateDiagonal(data->saddle.A, &stiffness));
  PetscCall(AinsworthSaddleVecDuplicate(y, &weights));
  PetscCall(AinsworthSaddleVecDuplicate(y, &others));
  PetscCall(AinsworthSaddleVecDuplicate(y, &kept));
  PetscCall(Left(data, transpose, PETSC_TRUE, little, b, y, left, weights, &error));
  best = error;
  PetscCall(VecCopy(y.primal, kept.primal));
  PetscCall(VecCopy(y.dual, kept.dual));
  PetscCall(AinsworthTermsSoftest(&data->saddle, &softest));
  probing = error > wanted ? (bool)energetic : softest > open / enough; /* by a step, if that may suffice, and by loose solves */
  /* relative change of x; without an energy the last solve has to agree, unless only rounding is left */
  auto shift = [&](PetscReal left) { return PetscMax(moves * left, energetic || left <= rounding ? 0.0 : change); };
  auto unmet = [&](PetscReal left) {
    return shift(left) > open || (left > wanted && !(helped && left <= margin * margin * enough && moves * left <= open / margin));
  };
  *refined = (PetscBool)(probing || unmet(error));
  for (; solves < most && (unmet(error) || (probing && !solves)) && some && idle < patience; solves++) {
    const PCAinsworthExtent extent = probing && !solves && error <= nearly ? PC_AINSWORTH_SOLVE_STEP : PC_AINSWORTH_SOLVE_AGAIN;
    const PetscReal         before = error, loose = probing ? 0.5 : idle ? 0.0 : PetscMin(enough / error / 10, 0.1);

    PetscCall(PetscInfo(pc, "A row of both equations is left with %g of its terms: another %s follows\n", (double)error,
                        extent == PC_AINSWORTH_SOLVE_STEP ? "step" : "solve"));
    PetscCall(Step(pc, data, transpose, extent, loose, stiffness, left, weights, y, directions, images, &some, &change));
    if (some) PetscCall(Left(data, transpose, PETSC_FALSE, little, b, y, left, others, &error)); /* all steps use the weights of the first */
    idle    = probing || error < 0.5 * best ? 0 : idle + 1;
    helped  = probing && energetic && (error < 0.25 * before || PetscMin(error, before) <= nearly);
    probing = probing && energetic && before > wanted && solves + 1 < probes;
    moves   = PetscMax(moves, change / before);
    known   = (PetscBool)(some && error < best); /* Ax belongs to the kept y, as after the verification */
    PetscCall(PetscInfo(pc, "It has moved x by up to %g, and leaves %g\n", (double)change, (double)error));
    if (!(error < best)) continue;
    best = error;
    PetscCall(VecCopy(y.primal, kept.primal));
    PetscCall(VecCopy(y.dual, kept.dual));
  }
  PetscCall(VecCopy(kept.primal, y.primal));
  PetscCall(VecCopy(kept.dual, y.dual));
  data->knownAx = known;
  wanted = enough = PetscMax(10 * tol, rounding); /* the solves aimed below that */
  if (unmet(best) && best > enough)
    PetscCall(
      PetscSNPrintf(why, len, "The system is not met: a row of both equations is left with %g of its terms, and further solves do not help", (double)best));
  else if (unmet(best))
    PetscCall(PetscSNPrintf(why, len, "The solution is not met: rows are left with up to %g of their terms, which another solve takes for %g of x",
                            (double)best, (double)shift(best)));
  for (auto *list : {&directions, &images})
    for (AinsworthSaddleVec &v : *list) PetscCall(AinsworthSaddleVecDestroy(&v));
  PetscCall(VecDestroy(&stiffness));
  PetscCall(AinsworthSaddleVecDestroy(&weights));
  PetscCall(AinsworthSaddleVecDestroy(&others));
  PetscCall(AinsworthSaddleVecDestroy(&kept));
  PetscFunctionReturn(PETSC_SUCCESS);
}
