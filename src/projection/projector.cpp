#include "projector.h"
#include "shared.h"
#include "../base/events.h"
#include "../base/objects.h"

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

/* Creates the work vectors of the rows, and the scatter to them from vectors laid out as the program's rows of C */
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

/* Places E and creates the work vectors of D */
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

/* Scales the columns of M by the weight; without a weight, adds a reference to M */
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

/* Gets the object ids and nonzero states of the blocks, from which the nonzero pattern of S follows */
static PetscErrorCode GetPatterns(const AinsworthProjectorBlocks *blocks, AinsworthProjectorPatterns *patterns)
{
  const Mat mats[] = {blocks->C, blocks->B, blocks->D};

  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) {
    patterns->id[k]      = 0;
    patterns->pattern[k] = 0;
    if (!mats[k]) continue;
    PetscCall(PetscObjectGetId((PetscObject)mats[k], &patterns->id[k]));
    PetscCall(MatGetNonzeroState(mats[k], &patterns->pattern[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets up proj->gram and, if B is not C, proj->gramB. Both share one placement, so the components are those of both
   patterns together
*/
static PetscErrorCode SetUpGrams(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, PetscBool same,
                                 const AinsworthProjectorPatterns *patterns, PetscObject parent)
{
  const Mat           C = blocks->C, B = blocks->B;
  AinsworthGramInputs in = {proj->compliance.N, patterns->hermitian, same, patterns->rowsPerRank, parent, NULL, NULL};
  Mat                 BWt;

  PetscFunctionBegin;
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
  /* gram.S has all diagonal entries, whereas B W B' lacks those of zero rows of B */
  PetscCall(MatDuplicate(proj->gram.S, MAT_DO_NOT_COPY_VALUES, &in.other));
  PetscCall(AinsworthGramSetUp(&proj->gramB, B, proj->BW, &in));
  PetscCall(MatDestroy(&in.other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthProjectorSetUp - creates the projector from the blocks, keeping symbolic results if their patterns have not
   changed

   weight: diagonal of W, length n, positive; NULL for W = I. inverseDiagonal: diag(A)^{-1}, used only with D.
   Collective
*/
PetscErrorCode AinsworthProjectorSetUp(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, Vec weight,
                                       Vec inverseDiagonal, PetscInt rowsPerRank, PetscObject parent)
{
  const AinsworthProjectorPatterns last = proj->patterns;
  const Mat                        C    = blocks->C;
  AinsworthProjectorPatterns       now;
  PetscBool                        same; /* nothing has changed that the symbolic results depend on */

  PetscFunctionBegin;
  PetscCall(GetPatterns(blocks, &now));
  now.rowsPerRank = rowsPerRank;
  now.weighted    = weight != NULL;
  now.hermitian   = PETSC_TRUE;
  if (blocks->D) PetscCall(AinsworthProbeSymmetry(blocks->D, &now.hermitian));
  PetscCall(PetscArraycmp(now.id, last.id, 3, &same));
  if (same) PetscCall(PetscArraycmp(now.pattern, last.pattern, 3, &same));
  same = (PetscBool)(same && proj->C && last.weighted == now.weighted && last.hermitian == now.hermitian &&
                     last.rowsPerRank == now.rowsPerRank);
  if (same)
    PetscCall(PetscInfo(C, "The nonzero pattern of C is that of the last set-up: the places and the symbolic "
                           "factorization of the Gram matrix are kept\n"));
  else PetscCall(AinsworthProjectorReset(proj));
  for (Mat *M : {&proj->C, &proj->B, &proj->CW, &proj->BW}) PetscCall(MatDestroy(M));
  PetscCall(AinsworthShare(C, &proj->C));
  PetscCall(Weigh(C, weight, &proj->CW));
  if (blocks->B != C) {
    PetscCall(AinsworthShare(blocks->B, &proj->B));
    PetscCall(Weigh(proj->B, weight, &proj->BW));
  }
  PetscCall(AinsworthComplianceSetUp(&proj->compliance, C, blocks->B, blocks->D, weight, inverseDiagonal));
  PetscCall(SetUpGrams(proj, blocks, same, &now, parent));
  for (Mat *M : {&proj->B, &proj->BW})
    if (*M) PetscCall(AinsworthProjectorMoveRows(proj, M));
  if (weight) PetscCall(AinsworthProjectorMoveRows(proj, &proj->CW));
  else PetscCall(MatDestroy(&proj->CW));
  PetscCall(AinsworthProjectorMoveRows(proj, &proj->C));
  for (Mat *M : {&proj->CW, &proj->B, &proj->BW})
    if (!*M) PetscCall(AinsworthShare(M == &proj->BW ? proj->CW : proj->C, M));
  if (!same) PetscCall(CreateVectors(proj, C));
  PetscCall(PlaceCompliance(proj));
  proj->patterns = now;
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
   Computes y = Q x = x - W C' S^{-1} C x; y may be x. Leaves C x and -S^{-1} C x, placed, in proj->rowValues and
   proj->rowSolution
*/
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

/*
   Computes y = x - B' (S^{-1} (B W x + before) - after) with the S of B; y may be x

   before and after (m, placed) may be NULL, which means zero. Without both, y is x minus its part in Im(B').
*/
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

/* Computes x = R g = W C' S^{-1} g; leaves S^{-1} g, placed, in proj->rowSolution */
PetscErrorCode AinsworthProjectorRightInverse(AinsworthProjector *proj, Vec g, Vec x)
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorPlace(proj, g, proj->rowValues));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(MatMultHermitianTranspose(proj->CW, proj->rowSolution, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes l = S^{-1} (B W r + loads) with the S of B; loads (m, laid out as the program's rows) may be NULL */
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
