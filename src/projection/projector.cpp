#include "projector.h"
#include "../base/events.h"
#include "../base/objects.h"
#include "../base/words.h"

/*
   AinsworthProjectorMoveRows - moves rows to the ranks that solve for them: a projection then gets the constrained
   entries of x, and updates them, in one exchange each. Collective
*/
PetscErrorCode AinsworthProjectorMoveRows(const AinsworthProjector *proj, Mat C, Mat *moved)
{
  const IS rows = proj->gram.placement.rows;

  PetscFunctionBegin;
  if (rows) PetscCall(MatCreateSubMatrix(C, rows, NULL, MAT_INITIAL_MATRIX, moved));
  else PetscCall(AinsworthShare(C, moved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthProjectorPlaceMat - places the rows and columns of an m x m matrix laid out as the program's rows of C; a
   NULL matrix stays NULL. Collective
*/
PetscErrorCode AinsworthProjectorPlaceMat(const AinsworthProjector *proj, Mat program, Mat *placed)
{
  const IS rows = proj->gram.placement.rows;

  PetscFunctionBegin;
  if (program && rows) PetscCall(MatCreateSubMatrix(program, rows, rows, MAT_INITIAL_MATRIX, placed));
  else PetscCall(AinsworthShare(program, placed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthProjectorReset(AinsworthProjector *proj)
{
  PetscFunctionBegin;
  for (Mat *M : {&proj->C, &proj->B, &proj->E}) PetscCall(MatDestroy(M));
  PetscCall(AinsworthGramReset(&proj->gram));
  PetscCall(AinsworthGramReset(&proj->gramB));
  proj->polynomial.reset();
  proj->surface.reset();
  proj->surfaceB.reset();
  PetscCall(AinsworthComplianceReset(&proj->compliance));
  PetscCall(VecScatterDestroy(&proj->scatter));
  for (Vec *v :
       {&proj->rowValues, &proj->rowSolution, &proj->rest, &proj->shared, &proj->inverse, &proj->held, &proj->load})
    PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves a vector of length m from the layout of the program's rows of C to the placed rows, or back */
static PetscErrorCode Move(AinsworthProjector *proj, Vec from, Vec to, ScatterMode mode)
{
  PetscFunctionBegin;
  if (proj->scatter) {
    PetscCall(VecScatterBegin(proj->scatter, from, to, INSERT_VALUES, mode));
    PetscCall(VecScatterEnd(proj->scatter, from, to, INSERT_VALUES, mode));
  } else PetscCall(VecCopy(from, to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthProjectorPlace(AinsworthProjector *proj, Vec program, Vec placed)
{
  PetscFunctionBegin;
  PetscCall(Move(proj, program, placed, SCATTER_FORWARD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthProjectorReturn(AinsworthProjector *proj, Vec placed, Vec program)
{
  PetscFunctionBegin;
  PetscCall(Move(proj, placed, program, SCATTER_REVERSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes x += scale R values at the places, for the values in proj->rowValues; leaves scale S^{-1} values in
   proj->rowSolution if S is factored
*/
static PetscErrorCode Spread(AinsworthProjector *proj, const AinsworthSurface &surface, PetscScalar scale,
                             PetscScalar x[])
{
  const AinsworthPolynomial *p = proj->polynomial.get();
  const PetscScalar         *y, *yp = NULL;

  PetscFunctionBegin;
  if (p) {
    PetscCall(AinsworthPolynomialSolve(p, &proj->gram, proj->rowValues, proj->rowSolution, p->last));
    PetscCall(VecScale(p->last, scale));
    PetscCall(VecGetArrayRead(p->last, &yp));
  } else PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(VecScale(proj->rowSolution, scale));
  PetscCall(VecGetArrayRead(proj->rowSolution, &y));
  PetscCall(surface.spreadWeighted(1, y, yp, x));
  PetscCall(VecRestoreArrayRead(proj->rowSolution, &y));
  if (p) PetscCall(VecRestoreArrayRead(p->last, &yp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes R' r, r at the places, in proj->rowSolution, plus S^{-1} loads (placed or NULL), for which S is factored */
static PetscErrorCode Collect(AinsworthProjector *proj, AinsworthGram *gram, const AinsworthSurface &surface,
                              const PetscScalar r[], Vec loads)
{
  const AinsworthPolynomial *p = proj->polynomial.get();
  PetscScalar               *y, *yp = NULL;

  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(proj->rowValues, &y));
  if (p) PetscCall(VecGetArrayWrite(p->last, &yp));
  PetscCall(surface.multiplyWeighted(1, r, y, yp));
  if (p) PetscCall(VecRestoreArrayWrite(p->last, &yp));
  PetscCall(VecRestoreArrayWrite(proj->rowValues, &y));
  if (p) {
    PetscCall(AinsworthPolynomialSolveAdjoint(p, gram, proj->rowValues, p->last, proj->rowSolution));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (loads) PetscCall(VecAXPY(proj->rowValues, 1.0, loads));
  PetscCall(AinsworthGramSolve(gram, proj->rowValues, proj->rowSolution));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y = M x, placed, for the M of the surface; x: at the places */
static PetscErrorCode MultiplyRows(const AinsworthSurface &surface, const PetscScalar x[], Vec y)
{
  PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(y, &a));
  PetscCall(surface.multiply(1, x, a));
  PetscCall(VecRestoreArrayWrite(y, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes x += M' y at the places for a placed y */
static PetscErrorCode SpreadRows(const AinsworthSurface &surface, Vec y, PetscScalar x[])
{
  const PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(y, &a));
  PetscCall(surface.spread(1, a, x));
  PetscCall(VecRestoreArrayRead(y, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces x, at the places, by Q x or, if adjoint, by Q' x for B = C; leaves what AinsworthProjectorMult() does */
PetscErrorCode AinsworthProjectorSubtract(AinsworthProjector *proj, const AinsworthSurface &surface, bool adjoint,
                                          PetscScalar x[])
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, proj->C, 0, 0, 0));
  if (adjoint) {
    PetscCall(Collect(proj, &proj->gram, surface, x, NULL));
    PetscCall(VecScale(proj->rowSolution, -1.0));
    PetscCall(SpreadRows(surface, proj->rowSolution, x));
  } else {
    PetscCall(MultiplyRows(surface, x, proj->rowValues));
    PetscCall(Spread(proj, surface, -1.0, x));
  }
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, proj->C, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes y = Q x = x - R C x; y may be x. Leaves C x and, if S is factored, -S^{-1} C x, placed, in proj->rowValues
   and proj->rowSolution
*/
PetscErrorCode AinsworthProjectorMult(AinsworthProjector *proj, Vec x, Vec y)
{
  const AinsworthSurface &surface = *proj->surface;

  PetscFunctionBegin;
  PetscCall(VecCopy(x, y));
  PetscCall(surface.change(1, y, [&](PetscScalar v[]) { return AinsworthProjectorSubtract(proj, surface, false, v); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes y = x - B' (S^{-1} (B W x + before) - after) with the S of B; y may be x

   before and after (m, placed) may be NULL, which means zero; before needs a D. Without both, y is x minus its part in
   Im(B').
*/
PetscErrorCode AinsworthProjectorMultTranspose(AinsworthProjector *proj, Vec x, Vec before, Vec after, Vec y)
{
  const AinsworthSurface &surface = *proj->surfaceB;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscCall(VecCopy(x, y));
  PetscCall(surface.change(1, y, [&](PetscScalar v[]) {
    PetscFunctionBegin;
    PetscCall(Collect(proj, AinsworthProjectorOtherGram(proj), surface, v, before));
    if (after) PetscCall(VecAYPX(proj->rowSolution, -1.0, after));
    else PetscCall(VecScale(proj->rowSolution, -1.0));
    PetscCall(SpreadRows(surface, proj->rowSolution, v));
    PetscFunctionReturn(PETSC_SUCCESS);
  }));
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes x = R g; if S is factored, leaves S^{-1} g, placed, in proj->rowSolution */
PetscErrorCode AinsworthProjectorRightInverse(AinsworthProjector *proj, Vec g, Vec x)
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorPlace(proj, g, proj->rowValues));
  PetscCall(VecZeroEntries(x));
  PetscCall(proj->surface->change(1, x, [&](PetscScalar v[]) { return Spread(proj, *proj->surface, 1.0, v); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes l = R' r or, with D, S^{-1} (C W r + loads); loads (m, laid out as the program's rows) may be NULL, and need
   a D. other: with R and S of B
*/
PetscErrorCode AinsworthProjectorMultiplier(AinsworthProjector *proj, bool other, Vec r, Vec loads, Vec l)
{
  const AinsworthSurface &surface = other ? *proj->surfaceB : *proj->surface;
  Vec                     placed  = NULL;

  PetscFunctionBegin;
  if (loads) {
    placed = proj->rowSolution;
    PetscCall(AinsworthProjectorPlace(proj, loads, placed));
  }
  PetscCall(surface.read(r, [&](const PetscScalar v[]) {
    return Collect(proj, other ? AinsworthProjectorOtherGram(proj) : &proj->gram, surface, v, placed);
  }));
  PetscCall(Move(proj, proj->rowSolution, l, SCATTER_REVERSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes force = E mu, both placed, where E includes the energy of rows without D */
PetscErrorCode AinsworthProjectorMultEnergy(AinsworthProjector *proj, Vec mu, Vec force)
{
  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(force, proj->rest, mu));
  PetscCall(MatMultAdd(proj->E, mu, force, force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Prepares AinsworthProjectorPrecondition() for a penalty (m, laid out as the program's rows); does nothing without D
*/
PetscErrorCode AinsworthProjectorSetPenalty(AinsworthProjector *proj, Vec penalty)
{
  Vec shared, inverse;

  PetscFunctionBegin;
  if (!proj->E) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(penalty, &shared));
  PetscCall(VecDuplicate(penalty, &inverse));
  PetscCall(AinsworthComplianceGetPreconditioner(&proj->compliance, penalty, shared, inverse));
  PetscCall(AinsworthProjectorPlace(proj, shared, proj->shared));
  PetscCall(AinsworthProjectorPlace(proj, inverse, proj->inverse));
  PetscCall(VecDestroy(&shared));
  PetscCall(VecDestroy(&inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes y = x + W C' mu, where (x, mu) = (M_*^+)^{-1} (r, B W r), by elimination of mu

   apply(pc) is the action of M_*^{-1}; M_* = A + C' (B^{-1} + D)^{-1} C is the Schur complement of M_*^+ that remains.
*/
PetscErrorCode AinsworthProjectorPrecondition(AinsworthProjector *proj, PC pc, PetscErrorCode (*apply)(PC, Vec, Vec),
                                              Vec r, Vec y)
{
  const AinsworthSurface &surface = *proj->surface, &other = *proj->surfaceB;
  PetscScalar            *held;

  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(proj->held, &held));
  PetscCall(other.read(r, [&](const PetscScalar v[]) { return other.multiplyWeighted(1, v, held, NULL); }));
  PetscCall(VecRestoreArrayWrite(proj->held, &held));
  PetscCall(VecPointwiseMult(proj->rowValues, proj->shared, proj->held));
  PetscCall(VecCopy(r, proj->load));
  PetscCall(surface.change(1, proj->load, [&](PetscScalar v[]) { return SpreadRows(surface, proj->rowValues, v); }));
  PetscCall((*apply)(pc, proj->load, y));
  PetscCall(surface.read(y, [&](const PetscScalar v[]) { return MultiplyRows(surface, v, proj->rowValues); }));
  PetscCall(VecPointwiseMult(proj->rowValues, proj->shared, proj->rowValues));
  PetscCall(VecPointwiseMult(proj->held, proj->inverse, proj->held));
  PetscCall(VecAXPY(proj->held, 1.0, proj->rowValues));
  PetscCall(surface.change(1, y, [&](PetscScalar v[]) {
    const PetscScalar *mu;

    PetscFunctionBegin;
    PetscCall(VecGetArrayRead(proj->held, &mu));
    PetscCall(surface.spreadWeighted(1, mu, NULL, v));
    PetscCall(VecRestoreArrayRead(proj->held, &mu));
    PetscFunctionReturn(PETSC_SUCCESS);
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthProjectorDescribeGram - describes S and how it is solved with */
PetscErrorCode AinsworthProjectorDescribeGram(const AinsworthProjector *proj, std::string *text)
{
  const AinsworthPolynomial *p = proj->polynomial.get();
  char                       blocks[256], steps[128];

  PetscFunctionBegin;
  *text = "Gram matrix S = C W C': ";
  PetscCall(AinsworthGramDescribe(&proj->gram, blocks, sizeof(blocks)));
  if (p) {
    PetscCall(PetscSNPrintf(steps, sizeof(steps),
                            "no factorization, a polynomial of %s for eigenvalues up to %.3g; of private unknowns: ",
                            AinsworthCounted(p->steps.size(), "step").c_str(), (double)p->bound));
    *text += steps;
  }
  *text += blocks;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthProjectorGetEconomy - tells why S is not factored, in words; an empty string if it is. Collective */
PetscErrorCode AinsworthProjectorGetEconomy(const AinsworthProjector *proj, const char **text)
{
  PetscFunctionBegin;
  if (proj->polynomial) *text = "; S acts by a polynomial: no factorization";
  else PetscCall(AinsworthGramGetEconomy(&proj->gram, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}
