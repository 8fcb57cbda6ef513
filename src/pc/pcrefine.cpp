/* Further solves of a system [A B'; C -D] for what the first has left, until each row of both equations is met relative to its own terms */
#include "pcainsworth.h"
#include "../ksp/projectedcg.h"
#include <vector>

/* weights of the rows of both equations, y * w */
static PetscErrorCode Multiply(PCAinsworthFields y, PCAinsworthFields w, PCAinsworthFields *product)
{
  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(product->primal, y.primal, w.primal));
  PetscCall(VecPointwiseMult(product->dual, y.dual, w.dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Duplicate(PCAinsworthFields like, PCAinsworthFields *y)
{
  PetscFunctionBegin;
  PetscCall(VecDuplicate(like.primal, &y->primal));
  PetscCall(VecDuplicate(like.dual, &y->dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(PCAinsworthFields *y)
{
  PetscFunctionBegin;
  PetscCall(VecDestroy(&y->primal));
  PetscCall(VecDestroy(&y->dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Add(PCAinsworthFields y, PetscScalar a, PCAinsworthFields x)
{
  PetscFunctionBegin;
  PetscCall(VecAXPY(y.primal, a, x.primal));
  PetscCall(VecAXPY(y.dual, a, x.dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Dot(PCAinsworthFields x, PCAinsworthFields y, PetscScalar *dot)
{
  PetscScalar part[2];

  PetscFunctionBegin;
  PetscCall(VecDot(x.primal, y.primal, &part[0]));
  PetscCall(VecDot(x.dual, y.dual, &part[1]));
  *dot = part[0] + part[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is left of b by y, and the largest of it relative to the terms of its row */
static PetscErrorCode Left(PC_Ainsworth *data, PetscBool transpose, PCAinsworthFields b, PCAinsworthFields y, PCAinsworthFields left, PCAinsworthFields weights,
                           PetscReal *error)
{
  PetscFunctionBegin;
  data->knownAx = PETSC_FALSE;
  PetscCall(AinsworthSaddleResidual(&data->saddle, transpose, PETSC_FALSE, b.primal, b.dual, y.primal, y.dual, data->Ax, left.primal, left.dual));
  PetscCall(AinsworthSaddleBackwardError(&data->saddle, transpose, b.primal, b.dual, y.primal, y.dual, data->Ax, left.primal, left.dual, weights.primal,
                                         weights.dual, error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   One more direction for y, from a reduced solve for what is left, and the step along it that leaves least, in the norm in which each row is relative to its
   terms; images: K times the directions, weighted, orthonormal. some: there was one
*/
static PetscErrorCode Step(PC pc, PC_Ainsworth *data, PetscBool transpose, PCAinsworthFields left, PCAinsworthFields weights, PCAinsworthFields y,
                           std::vector<PCAinsworthFields> &directions, std::vector<PCAinsworthFields> &images, PetscBool *some)
{
  PCAinsworthFields  p, q, r, none;
  KSPConvergedReason reason;
  PetscScalar        dot;

  PetscFunctionBegin;
  for (PCAinsworthFields *v : {&p, &q, &r, &none}) PetscCall(Duplicate(left, v));
  PetscCall(VecZeroEntries(p.primal));
  PetscCall(PCAinsworthSolveFields_Private(pc, data, transpose, PETSC_FALSE, left, p, &reason));
  PetscCall(VecZeroEntries(none.primal));
  PetscCall(VecZeroEntries(none.dual));
  PetscCall(AinsworthSaddleResidual(&data->saddle, transpose, PETSC_FALSE, none.primal, none.dual, p.primal, p.dual, data->Ax, q.primal, q.dual));
  PetscCall(Multiply(q, weights, &q));
  PetscCall(Multiply(left, weights, &r));
  for (size_t k = 0; k < images.size(); k++) {
    PetscCall(Dot(q, images[k], &dot));
    PetscCall(Add(q, -dot, images[k]));
    PetscCall(Add(p, -dot, directions[k]));
  }
  PetscCall(Dot(q, q, &dot));
  *some = (PetscBool)(PetscRealPart(dot) > 0.0 && !PetscIsInfOrNanScalar(dot));
  if (*some) {
    const PetscScalar scale = 1.0 / PetscSqrtReal(PetscRealPart(dot));

    for (Vec v : {p.primal, p.dual, q.primal, q.dual}) PetscCall(VecScale(v, scale));
    PetscCall(Dot(r, q, &dot));
    PetscCall(Add(y, -dot, p)); /* q = -K p */
    directions.push_back(p);
    images.push_back(q);
  } else {
    PetscCall(Destroy(&p));
    PetscCall(Destroy(&q));
  }
  PetscCall(Destroy(&r));
  PetscCall(Destroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthRefineRows_Private - generalized conjugate residuals, preconditioned by reduced solves

   Where D is not zero, or B is not C, unknowns of very different stiffness meet, and the norms of the reduced solve are not fair to all of them.

   tol: what was asked for, negative where nothing was. left: of both equations, by y; both are changed. refined: there was something to do
*/
PetscErrorCode PCAinsworthRefineRows_Private(PC pc, PC_Ainsworth *data, PetscBool transpose, PetscReal tol, PCAinsworthFields b, PCAinsworthFields y,
                                             PCAinsworthFields left, PetscBool *refined)
{
  static const PetscReal         rounding = 1e-13;
  static const int               most = 10, patience = 3;
  const PetscReal                wanted = PetscMax(10 * tol, rounding);
  PetscReal                      error, best;
  int                            idle = 0;
  PCAinsworthFields              weights, others, kept;
  std::vector<PCAinsworthFields> directions, images;
  PetscBool                      some = PETSC_TRUE;

  PetscFunctionBegin;
  *refined = PETSC_FALSE;
  if (!data->constraints || tol < 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPProjectedCGGetUse_Private(data->ksp, &some)); /* conjugate gradients in Ker C have the norm of the energy, which asks for no more */
  if (some) PetscFunctionReturn(PETSC_SUCCESS);
  some = PETSC_TRUE;
  PetscCall(Duplicate(y, &weights));
  PetscCall(Duplicate(y, &others));
  PetscCall(Duplicate(y, &kept));
  PetscCall(Left(data, transpose, b, y, left, weights, &error));
  best     = error;
  *refined = (PetscBool)(error > wanted);
  PetscCall(VecCopy(y.primal, kept.primal));
  PetscCall(VecCopy(y.dual, kept.dual));
  for (int k = 0; k < most && error > wanted && some && idle < patience; k++) {
    PetscCall(PetscInfo(pc, "A row of both equations is left with %g of its terms: another solve follows\n", (double)error));
    PetscCall(Step(pc, data, transpose, left, weights, y, directions, images, &some));
    if (some) PetscCall(Left(data, transpose, b, y, left, others, &error)); /* all steps have the norm of the first */
    idle = error < 0.5 * best ? 0 : idle + 1;
    if (!(error < best)) continue;
    best = error;
    PetscCall(VecCopy(y.primal, kept.primal));
    PetscCall(VecCopy(y.dual, kept.dual));
  }
  PetscCall(VecCopy(kept.primal, y.primal));
  PetscCall(VecCopy(kept.dual, y.dual));
  for (auto *list : {&directions, &images})
    for (PCAinsworthFields &v : *list) PetscCall(Destroy(&v));
  PetscCall(Destroy(&weights));
  PetscCall(Destroy(&others));
  PetscCall(Destroy(&kept));
  PetscFunctionReturn(PETSC_SUCCESS);
}
