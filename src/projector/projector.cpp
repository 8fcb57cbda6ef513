#include "projector.h"
#include "../events.h"

/* Rows of C go where they are solved for: a projection then asks for the constrained entries of x once, and sends once what it adds to them */
static PetscErrorCode MoveRows(const AinsworthProjector *proj, Mat *C)
{
  IS       columns;
  PetscInt start, end;
  Mat      moved;

  PetscFunctionBegin;
  if (!proj->gram.placement.rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRangeColumn(*C, &start, &end));
  PetscCall(ISCreateStride(PetscObjectComm((PetscObject)*C), end - start, start, 1, &columns));
  PetscCall(MatCreateSubMatrix(*C, proj->gram.placement.rows, columns, MAT_INITIAL_MATRIX, &moved));
  PetscCall(ISDestroy(&columns));
  PetscCall(MatDestroy(C));
  *C = moved;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The work space of the rows, and the way to it from a vector of the program's layout, that of C */
static PetscErrorCode CreateVectors(AinsworthProjector *proj, Mat C)
{
  Vec program;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(proj->C, NULL, &proj->s));
  PetscCall(VecDuplicate(proj->s, &proj->t));
  if (!proj->gram.placement.rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateVecs(C, NULL, &program));
  PetscCall(VecScatterCreate(program, proj->gram.placement.rows, proj->s, NULL, &proj->scatter));
  PetscCall(VecDestroy(&program));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Does all that depends on the nonzero pattern of C alone stand from the last set-up? */
static PetscErrorCode CompareSource(AinsworthProjector *proj, Mat C, const AinsworthProjectorSource &now, bool *same)
{
  const AinsworthProjectorSource &last = proj->source;

  PetscFunctionBegin;
  *same = proj->C && last.id == now.id && last.pattern == now.pattern && last.weighted == now.weighted && last.rowsPerRank == now.rowsPerRank;
  if (*same)
    PetscCall(PetscInfo(C, "The nonzero pattern of C is that of the last set-up: the places and the symbolic factorisation of the Gram matrix are kept\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w: the diagonal of W, length n, positive; NULL for W = I */
PetscErrorCode AinsworthProjectorSetUp(AinsworthProjector *proj, Mat C, Vec w, PetscInt rowsPerRank, PetscObject parent, const char prefix[])
{
  AinsworthProjectorSource source;
  bool                     same;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)C, &source.id));
  PetscCall(MatGetNonzeroState(C, &source.pattern));
  source.rowsPerRank = rowsPerRank;
  source.weighted    = w != NULL;
  PetscCall(CompareSource(proj, C, source, &same));
  if (!same) PetscCall(AinsworthProjectorReset(proj));
  PetscCall(MatDestroy(&proj->C));
  PetscCall(MatDestroy(&proj->CW));
  PetscCall(PetscObjectReference((PetscObject)C));
  proj->C = C;
  if (w) {
    PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &proj->CW));
    PetscCall(MatDiagonalScale(proj->CW, NULL, w));
  }
  PetscCall(AinsworthGramSetUp(&proj->gram, proj->C, w ? proj->CW : proj->C, same, rowsPerRank, parent, prefix));
  PetscCall(MoveRows(proj, &proj->C));
  if (w) PetscCall(MoveRows(proj, &proj->CW));
  else {
    PetscCall(PetscObjectReference((PetscObject)proj->C));
    proj->CW = proj->C;
  }
  if (!same) PetscCall(CreateVectors(proj, C));
  proj->source = source;
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
