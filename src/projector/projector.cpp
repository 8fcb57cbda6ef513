#include "projector.h"
#include "../events.h"

/* The rows of C go where they are solved for: a projection then asks for the constrained entries of x once, and sends once what it adds to them */
static PetscErrorCode MoveRows(AinsworthProjector *proj)
{
  const bool shared = proj->CW == proj->C;
  IS         rows   = proj->gram.placement.rows, columns;
  PetscInt   start, end;
  Mat        C, CW;
  Vec        program, placed;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRangeColumn(proj->C, &start, &end));
  PetscCall(ISCreateStride(PetscObjectComm((PetscObject)proj->C), end - start, start, 1, &columns));
  PetscCall(MatCreateSubMatrix(proj->C, rows, columns, MAT_INITIAL_MATRIX, &C));
  if (shared) {
    PetscCall(PetscObjectReference((PetscObject)C));
    CW = C;
  } else PetscCall(MatCreateSubMatrix(proj->CW, rows, columns, MAT_INITIAL_MATRIX, &CW));
  PetscCall(ISDestroy(&columns));
  PetscCall(MatCreateVecs(proj->C, NULL, &program));
  PetscCall(MatCreateVecs(C, NULL, &placed));
  PetscCall(VecScatterCreate(program, rows, placed, NULL, &proj->scatter));
  PetscCall(VecDestroy(&program));
  PetscCall(VecDestroy(&placed));
  PetscCall(MatDestroy(&proj->C));
  PetscCall(MatDestroy(&proj->CW));
  proj->C  = C;
  proj->CW = CW;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   w: the diagonal of W, length n, positive; NULL for W = I. In a frame T it projects x' = T x: with C T' and C W T' for C and C W, whose
   Gram matrix is the same, vectors need no turning.
*/
PetscErrorCode AinsworthProjectorSetUp(AinsworthProjector *proj, Mat C, Vec w, const AinsworthFrame *frame, PetscInt rowsPerRank, PetscObject parent,
                                       const char prefix[])
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorReset(proj));
  PetscCall(AinsworthFrameRotateRows(frame, C, &proj->C));
  if (w) {
    Mat CW;

    PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &CW));
    PetscCall(MatDiagonalScale(CW, NULL, w));
    PetscCall(AinsworthFrameRotateRows(frame, CW, &proj->CW));
    PetscCall(MatDestroy(&CW));
  } else {
    PetscCall(PetscObjectReference((PetscObject)proj->C));
    proj->CW = proj->C;
  }
  PetscCall(AinsworthGramSetUp(&proj->gram, proj->C, proj->CW, rowsPerRank, parent, prefix));
  if (proj->gram.placement.rows) PetscCall(MoveRows(proj));
  PetscCall(MatCreateVecs(proj->C, NULL, &proj->s));
  PetscCall(VecDuplicate(proj->s, &proj->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthProjectorReset(AinsworthProjector *proj)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&proj->C));
  PetscCall(MatDestroy(&proj->CW));
  PetscCall(AinsworthGramReset(&proj->gram));
  PetscCall(VecScatterDestroy(&proj->scatter));
  PetscCall(VecDestroy(&proj->s));
  PetscCall(VecDestroy(&proj->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A vector of length m, distributed as the program's rows of C, to the places of the rows */
PetscErrorCode AinsworthProjectorPlace(AinsworthProjector *proj, Vec program, Vec placed)
{
  PetscFunctionBegin;
  if (proj->scatter) {
    PetscCall(VecScatterBegin(proj->scatter, program, placed, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecScatterEnd(proj->scatter, program, placed, INSERT_VALUES, SCATTER_FORWARD));
  } else PetscCall(VecCopy(program, placed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* And back */
static PetscErrorCode TakeBack(AinsworthProjector *proj, Vec placed, Vec program)
{
  PetscFunctionBegin;
  if (proj->scatter) {
    PetscCall(VecScatterBegin(proj->scatter, placed, program, INSERT_VALUES, SCATTER_REVERSE));
    PetscCall(VecScatterEnd(proj->scatter, placed, program, INSERT_VALUES, SCATTER_REVERSE));
  } else PetscCall(VecCopy(placed, program));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = Q x = x - W C' S^{-1} C x; y may be x. Leaves C x, placed, in proj->s */
PetscErrorCode AinsworthProjectorMult(AinsworthProjector *proj, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscCall(MatMult(proj->C, x, proj->s));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->s, proj->t));
  PetscCall(VecScale(proj->t, -1.0));
  PetscCall(MatMultHermitianTransposeAdd(proj->CW, proj->t, x, y));
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = Q' x + C' l = x - C' (S^{-1} C W x - l); y may be x, l (m, placed) may be NULL */
PetscErrorCode AinsworthProjectorMultTranspose(AinsworthProjector *proj, Vec x, Vec l, Vec y)
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscCall(MatMult(proj->CW, x, proj->s));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->s, proj->t));
  if (l) PetscCall(VecAYPX(proj->t, -1.0, l));
  else PetscCall(VecScale(proj->t, -1.0));
  PetscCall(MatMultHermitianTransposeAdd(proj->C, proj->t, x, y));
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = R g = W C' S^{-1} g */
PetscErrorCode AinsworthProjectorRightInverse(AinsworthProjector *proj, Vec g, Vec x)
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorPlace(proj, g, proj->s));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->s, proj->t));
  PetscCall(MatMultHermitianTranspose(proj->CW, proj->t, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* l = R' r = S^{-1} C W r */
PetscErrorCode AinsworthProjectorRightInverseTranspose(AinsworthProjector *proj, Vec r, Vec l)
{
  PetscFunctionBegin;
  PetscCall(MatMult(proj->CW, r, proj->s));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->s, proj->t));
  PetscCall(TakeBack(proj, proj->t, l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = R B^{-1} R' b, B placed */
PetscErrorCode AinsworthProjectorSolveRange(AinsworthProjector *proj, Vec B, Vec b, Vec x)
{
  PetscFunctionBegin;
  PetscCall(MatMult(proj->CW, b, proj->s));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->s, proj->t));
  PetscCall(VecPointwiseDivide(proj->s, proj->t, B));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->s, proj->t));
  PetscCall(MatMultHermitianTranspose(proj->CW, proj->t, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
