#include "projector.h"
#include "../base/events.h"
#include "../base/objects.h"
#include "../base/words.h"

/*
   AinsworthProjectorMoveRows - moves rows to the ranks that solve for them: a projection then gets the constrained
   entries of x, and updates them, in one exchange each. Collective
*/
PetscErrorCode AinsworthProjectorMoveRows(const AinsworthProjector *proj, Mat *C)
{
  Mat moved;

  PetscFunctionBegin;
  if (!proj->gram.placement.rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateSubMatrix(*C, proj->gram.placement.rows, NULL, MAT_INITIAL_MATRIX, &moved));
  PetscCall(MatDestroy(C));
  *C = moved;
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
  for (Mat *M : {&proj->C, &proj->B, &proj->CW, &proj->BW, &proj->E}) PetscCall(MatDestroy(M));
  PetscCall(AinsworthGramReset(&proj->gram));
  PetscCall(AinsworthGramReset(&proj->gramB));
  proj->polynomial.reset();
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
   Computes y = x + scale R values for the values in proj->rowValues; leaves scale S^{-1} values in proj->rowSolution if
   S is factored; y may be x, which may be NULL for 0
*/
static PetscErrorCode Spread(AinsworthProjector *proj, const AinsworthProjectorSides &sides, PetscScalar scale, Vec x,
                             Vec y)
{
  const AinsworthPolynomial *p = proj->polynomial.get();

  PetscFunctionBegin;
  if (p) {
    PetscCall(AinsworthPolynomialSolve(p, &proj->gram, proj->rowValues, proj->rowSolution, p->last));
    PetscCall(VecScale(p->last, scale));
    if (x) PetscCall(MatMultHermitianTransposeAdd(sides.own, p->last, x, y));
    else PetscCall(MatMultHermitianTranspose(sides.own, p->last, y));
    x = y;
  } else PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(VecScale(proj->rowSolution, scale));
  if (x) PetscCall(MatMultHermitianTransposeAdd(sides.CW, proj->rowSolution, x, y));
  else PetscCall(MatMultHermitianTranspose(sides.CW, proj->rowSolution, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes R' r in proj->rowSolution, plus S^{-1} loads (placed; may be NULL), for which S is factored */
static PetscErrorCode Collect(AinsworthProjector *proj, AinsworthGram *gram, const AinsworthProjectorSides &sides,
                              Vec r, Vec loads)
{
  const AinsworthPolynomial *p = proj->polynomial.get();

  PetscFunctionBegin;
  PetscCall(MatMult(sides.CW, r, proj->rowValues));
  if (p) {
    PetscCall(MatMult(sides.own, r, p->last));
    PetscCall(AinsworthPolynomialSolveAdjoint(p, gram, proj->rowValues, p->last, proj->rowSolution));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (loads) PetscCall(VecAXPY(proj->rowValues, 1.0, loads));
  PetscCall(AinsworthGramSolve(gram, proj->rowValues, proj->rowSolution));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes y = Q x = x - R C x; y may be x. Leaves C x and, if S is factored, -S^{-1} C x, placed, in proj->rowValues
   and proj->rowSolution
*/
PetscErrorCode AinsworthProjectorMult(AinsworthProjector *proj, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorSubtract(proj, AinsworthProjectorGetSides(proj), false, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y = Q x or, if adjoint, Q' x for B = C, on the columns of the sides; y may be x */
PetscErrorCode AinsworthProjectorSubtract(AinsworthProjector *proj, const AinsworthProjectorSides &sides, bool adjoint,
                                          Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, proj->C, x, y, 0));
  if (adjoint) {
    PetscCall(Collect(proj, &proj->gram, sides, x, NULL));
    PetscCall(VecScale(proj->rowSolution, -1.0));
    PetscCall(MatMultHermitianTransposeAdd(sides.C, proj->rowSolution, x, y));
  } else {
    PetscCall(MatMult(sides.C, x, proj->rowValues));
    PetscCall(Spread(proj, sides, -1.0, x, y));
  }
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes y = x - B' (S^{-1} (B W x + before) - after) with the S of B; y may be x

   before and after (m, placed) may be NULL, which means zero; before needs a D. Without both, y is x minus its part in
   Im(B').
*/
PetscErrorCode AinsworthProjectorMultTranspose(AinsworthProjector *proj, Vec x, Vec before, Vec after, Vec y)
{
  AinsworthProjectorSides sides = AinsworthProjectorGetSides(proj);

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, proj->C, x, y, 0));
  sides.CW = proj->BW;
  PetscCall(Collect(proj, AinsworthProjectorOtherGram(proj), sides, x, before));
  if (after) PetscCall(VecAYPX(proj->rowSolution, -1.0, after));
  else PetscCall(VecScale(proj->rowSolution, -1.0));
  PetscCall(MatMultHermitianTransposeAdd(proj->B, proj->rowSolution, x, y));
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes x = R g; if S is factored, leaves S^{-1} g, placed, in proj->rowSolution */
PetscErrorCode AinsworthProjectorRightInverse(AinsworthProjector *proj, Vec g, Vec x)
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorPlace(proj, g, proj->rowValues));
  PetscCall(Spread(proj, AinsworthProjectorGetSides(proj), 1.0, NULL, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes l = R' r or, with D, S^{-1} (C W r + loads); loads (m, laid out as the program's rows) may be NULL, and need
   a D. other: with R and S of B
*/
PetscErrorCode AinsworthProjectorMultiplier(AinsworthProjector *proj, bool other, Vec r, Vec loads, Vec l)
{
  AinsworthProjectorSides sides  = AinsworthProjectorGetSides(proj);
  Vec                     placed = NULL;

  PetscFunctionBegin;
  if (loads) {
    placed = proj->rowSolution;
    PetscCall(AinsworthProjectorPlace(proj, loads, placed));
  }
  if (other) sides.CW = proj->BW;
  PetscCall(Collect(proj, other ? AinsworthProjectorOtherGram(proj) : &proj->gram, sides, r, placed));
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
  PetscFunctionBegin;
  PetscCall(MatMult(proj->BW, r, proj->held));
  PetscCall(VecPointwiseMult(proj->rowValues, proj->shared, proj->held));
  PetscCall(MatMultHermitianTransposeAdd(proj->C, proj->rowValues, r, proj->load));
  PetscCall((*apply)(pc, proj->load, y));
  PetscCall(MatMult(proj->C, y, proj->rowValues));
  PetscCall(VecPointwiseMult(proj->rowValues, proj->shared, proj->rowValues));
  PetscCall(VecPointwiseMult(proj->held, proj->inverse, proj->held));
  PetscCall(VecAXPY(proj->held, 1.0, proj->rowValues));
  PetscCall(MatMultHermitianTransposeAdd(proj->CW, proj->held, y, y));
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
