#include "projector.h"
#include "shared.h"
#include "../events.h"
#include "../objects.h"

/* Rows of C go where they are solved for: a projection then asks for the constrained entries of x once, and sends once what it adds to them */
static PetscErrorCode MoveRows(const AinsworthProjector *proj, Mat *C)
{
  Mat moved;

  PetscFunctionBegin;
  if (!proj->gram.placement.rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateSubMatrix(*C, proj->gram.placement.rows, NULL, MAT_INITIAL_MATRIX, &moved));
  PetscCall(MatDestroy(C));
  *C = moved;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The work space of the rows, and the way to it from a vector of the program's layout, that of C */
static PetscErrorCode CreateVectors(AinsworthProjector *proj, Mat C)
{
  Vec program;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(proj->C, NULL, &proj->rowValues));
  PetscCall(VecDuplicate(proj->rowValues, &proj->rowSolution));
  if (!proj->gram.placement.rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateVecs(C, NULL, &program));
  PetscCall(VecScatterCreate(program, proj->gram.placement.rows, proj->rowValues, NULL, &proj->scatter));
  PetscCall(VecDestroy(&program));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthProjectorPlaceMat - a matrix of the program's rows of C, as many columns, in the places of the rows; NULL where it is */
PetscErrorCode AinsworthProjectorPlaceMat(const AinsworthProjector *proj, Mat program, Mat *placed)
{
  const IS rows = proj->gram.placement.rows;

  PetscFunctionBegin;
  if (program && rows) PetscCall(MatCreateSubMatrix(program, rows, rows, MAT_INITIAL_MATRIX, placed));
  else PetscCall(AinsworthShare(program, placed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* E and the work space of D, placed as the rows */
static PetscErrorCode PlaceCompliance(AinsworthProjector *proj)
{
  const AinsworthCompliance *c = &proj->compliance;

  PetscFunctionBegin;
  PetscCall(MatDestroy(&proj->E));
  if (!c->N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthProjectorPlaceMat(proj, c->E, &proj->E));
  for (Vec *v : {&proj->rest, &proj->shared, &proj->inverse, &proj->held})
    if (!*v) PetscCall(VecDuplicate(proj->rowValues, v));
  if (!proj->load) PetscCall(MatCreateVecs(proj->C, &proj->load, NULL));
  PetscCall(AinsworthProjectorPlace(proj, c->rest, proj->rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* M with its columns scaled by the weight; a reference where that is 1 */
static PetscErrorCode Weigh(Mat M, Vec weight, Mat *weighted)
{
  PetscReal least;

  PetscFunctionBegin;
  if (weight) {
    PetscCall(AinsworthScaleColumns(M, weight, weighted));
    PetscCall(VecMin(weight, NULL, &least));
    if (least == 0.0) PetscCall(AinsworthSharedDrop(weight, weighted));
  } else PetscCall(AinsworthShare(M, weighted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What all that depends on nonzero patterns alone comes from */
static PetscErrorCode GetSource(const AinsworthProjectorBlocks *blocks, AinsworthProjectorSource *source)
{
  const Mat mats[] = {blocks->C, blocks->B, blocks->D};

  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) {
    source->id[k]      = 0;
    source->pattern[k] = 0;
    if (!mats[k]) continue;
    PetscCall(PetscObjectGetId((PetscObject)mats[k], &source->id[k]));
    PetscCall(MatGetNonzeroState(mats[k], &source->pattern[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* proj->gram, and proj->gramB where B is not C: their components, and so their places, are those of both together */
static PetscErrorCode SetUpGrams(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, PetscBool same, PetscInt rowsPerRank, PetscObject parent)
{
  const Mat           C = blocks->C, B = blocks->B;
  AinsworthGramInputs in = {proj->compliance.N, PETSC_TRUE, same, rowsPerRank, parent, NULL, NULL};
  Mat                 BWt;

  PetscFunctionBegin;
  if (blocks->D) PetscCall(AinsworthProbeSymmetry(blocks->D, &in.hermitian));
  if (B != C) {
    PetscCall(MatHermitianTranspose(proj->BW, MAT_INITIAL_MATRIX, &BWt));
    PetscCall(MatMatMult(B, BWt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &in.other));
    PetscCall(MatProductClear(in.other));
    PetscCall(MatZeroEntries(in.other));
    PetscCall(MatDestroy(&BWt));
  }
  PetscCall(AinsworthGramSetUp(&proj->gram, C, proj->CW, &in));
  PetscCall(MatDestroy(&in.other));
  if (B == C) PetscFunctionReturn(PETSC_SUCCESS);
  in.placement = &proj->gram.placement;
  PetscCall(MatDuplicate(proj->gram.S, MAT_DO_NOT_COPY_VALUES, &in.other)); /* with its diagonal, which a row of B that is zero lacks */
  PetscCall(AinsworthGramSetUp(&proj->gramB, B, proj->BW, &in));
  PetscCall(MatDestroy(&in.other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* weight: the diagonal of W, length n, positive, NULL for W = I; inverseDiagonal: diag(A)^{-1}, for D only */
PetscErrorCode AinsworthProjectorSetUp(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, Vec weight, Vec inverseDiagonal, PetscInt rowsPerRank,
                                       PetscObject parent)
{
  const AinsworthProjectorSource last = proj->source;
  const Mat                      C    = blocks->C;
  AinsworthProjectorSource       now;
  PetscBool                      same; /* all that depends on nonzero patterns alone */

  PetscFunctionBegin;
  PetscCall(GetSource(blocks, &now));
  now.rowsPerRank = rowsPerRank;
  now.weighted    = weight != NULL;
  PetscCall(PetscArraycmp(now.id, last.id, 3, &same));
  if (same) PetscCall(PetscArraycmp(now.pattern, last.pattern, 3, &same));
  same = (PetscBool)(same && proj->C && last.weighted == now.weighted && last.rowsPerRank == now.rowsPerRank);
  if (same)
    PetscCall(PetscInfo(C, "The nonzero pattern of C is that of the last set-up: the places and the symbolic factorization of the Gram matrix are kept\n"));
  else PetscCall(AinsworthProjectorReset(proj));
  for (Mat *M : {&proj->C, &proj->B, &proj->CW, &proj->BW}) PetscCall(MatDestroy(M));
  PetscCall(AinsworthShare(C, &proj->C));
  PetscCall(Weigh(C, weight, &proj->CW));
  if (blocks->B != C) {
    PetscCall(AinsworthShare(blocks->B, &proj->B));
    PetscCall(Weigh(proj->B, weight, &proj->BW));
  }
  PetscCall(AinsworthComplianceSetUp(&proj->compliance, C, blocks->B, blocks->D, weight, inverseDiagonal));
  PetscCall(SetUpGrams(proj, blocks, same, rowsPerRank, parent));
  for (Mat *M : {&proj->B, &proj->BW})
    if (*M) PetscCall(MoveRows(proj, M));
  if (weight) PetscCall(MoveRows(proj, &proj->CW));
  else PetscCall(MatDestroy(&proj->CW));
  PetscCall(MoveRows(proj, &proj->C));
  for (Mat *M : {&proj->CW, &proj->B, &proj->BW})
    if (!*M) PetscCall(AinsworthShare(M == &proj->BW ? proj->CW : proj->C, M));
  if (!same) PetscCall(CreateVectors(proj, C));
  PetscCall(PlaceCompliance(proj));
  proj->source = now;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthProjectorReset(AinsworthProjector *proj)
{
  PetscFunctionBegin;
  for (Mat *M : {&proj->C, &proj->B, &proj->CW, &proj->BW, &proj->E}) PetscCall(MatDestroy(M));
  PetscCall(AinsworthGramReset(&proj->gram));
  PetscCall(AinsworthGramReset(&proj->gramB));
  PetscCall(AinsworthComplianceReset(&proj->compliance));
  PetscCall(VecScatterDestroy(&proj->scatter));
  for (Vec *v : {&proj->rowValues, &proj->rowSolution, &proj->rest, &proj->shared, &proj->inverse, &proj->held, &proj->load}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A vector of length m, distributed as the program's rows of C, to the places of the rows, or back */
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

/* y = Q x = x - W C' S^{-1} C x; y may be x. Leaves C x and -S^{-1} C x, placed, in proj->rowValues and rowSolution */
PetscErrorCode AinsworthProjectorMult(AinsworthProjector *proj, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscCall(MatMult(proj->C, x, proj->rowValues));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(VecScale(proj->rowSolution, -1.0));
  PetscCall(MatMultHermitianTransposeAdd(proj->CW, proj->rowSolution, x, y));
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = x - B' (S^{-1} (B W x + before) - after), S that of B, where both are zero x less its part in Im(B'); y may be x, before and after (m, placed) may be NULL */
PetscErrorCode AinsworthProjectorMultTranspose(AinsworthProjector *proj, Vec x, Vec before, Vec after, Vec y)
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscCall(MatMult(proj->BW, x, proj->rowValues));
  if (before) PetscCall(VecAXPY(proj->rowValues, 1.0, before));
  PetscCall(AinsworthGramSolve(AinsworthProjectorOtherGram(proj), proj->rowValues, proj->rowSolution));
  if (after) PetscCall(VecAYPX(proj->rowSolution, -1.0, after));
  else PetscCall(VecScale(proj->rowSolution, -1.0));
  PetscCall(MatMultHermitianTransposeAdd(proj->B, proj->rowSolution, x, y));
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = R g = W C' S^{-1} g; leaves S^{-1} g in proj->rowSolution */
PetscErrorCode AinsworthProjectorRightInverse(AinsworthProjector *proj, Vec g, Vec x)
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorPlace(proj, g, proj->rowValues));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(MatMultHermitianTranspose(proj->CW, proj->rowSolution, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* l = S^{-1} (B W r + loads), S that of B, loads (m, as the program's rows) may be NULL */
PetscErrorCode AinsworthProjectorMultiplier(AinsworthProjector *proj, Vec r, Vec loads, Vec l)
{
  PetscFunctionBegin;
  PetscCall(MatMult(proj->BW, r, proj->rowValues));
  if (loads) {
    PetscCall(AinsworthProjectorPlace(proj, loads, proj->rowSolution));
    PetscCall(VecAXPY(proj->rowValues, 1.0, proj->rowSolution));
  }
  PetscCall(AinsworthGramSolve(AinsworthProjectorOtherGram(proj), proj->rowValues, proj->rowSolution));
  PetscCall(Move(proj, proj->rowSolution, l, SCATTER_REVERSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = R B^{-1} R' b, with the penalty B placed */
PetscErrorCode AinsworthProjectorSolveRange(AinsworthProjector *proj, Vec penalty, Vec b, Vec x)
{
  PetscFunctionBegin;
  PetscCall(MatMult(proj->CW, b, proj->rowValues));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(VecPointwiseDivide(proj->rowValues, proj->rowSolution, penalty));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(MatMultHermitianTranspose(proj->CW, proj->rowSolution, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* force = E mu, of a mu that is placed, with the energy that rows without D get */
PetscErrorCode AinsworthProjectorMultEnergy(AinsworthProjector *proj, Vec mu, Vec force)
{
  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(force, proj->rest, mu));
  PetscCall(MatMultAdd(proj->E, mu, force, force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The penalty (m, as the program's rows) that AinsworthProjectorPrecondition() has to do with */
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
   y = x + W C' mu, where (x, mu) is M_*^+^{-1} (r, B W r), by elimination of mu

   M_*^{-1} x is apply(pc): M_* = A + C' (B^{-1} + D)^{-1} C is what mu leaves of M_*^+.
*/
PetscErrorCode AinsworthProjectorPrecondition(AinsworthProjector *proj, PC pc, PetscErrorCode (*apply)(PC, Vec, Vec), Vec r, Vec y)
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
