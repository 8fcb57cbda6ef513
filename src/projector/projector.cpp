#include "projector.h"
#include "../events.h"

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

/* weight: the diagonal of W, length n, positive; NULL for W = I */
PetscErrorCode AinsworthProjectorSetUp(AinsworthProjector *proj, Mat C, Vec weight, PetscInt rowsPerRank, PetscObject parent, const char prefix[])
{
  const AinsworthProjectorSource last = proj->source;
  AinsworthProjectorSource       now;
  bool                           same; /* all that depends on the nonzero pattern of C alone */

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)C, &now.id));
  PetscCall(MatGetNonzeroState(C, &now.pattern));
  now.rowsPerRank = rowsPerRank;
  now.weighted    = weight != NULL;
  same            = proj->C && last.id == now.id && last.pattern == now.pattern && last.weighted == now.weighted && last.rowsPerRank == now.rowsPerRank;
  if (same)
    PetscCall(PetscInfo(C, "The nonzero pattern of C is that of the last set-up: the places and the symbolic factorisation of the Gram matrix are kept\n"));
  else PetscCall(AinsworthProjectorReset(proj));
  PetscCall(MatDestroy(&proj->C));
  PetscCall(MatDestroy(&proj->CW));
  PetscCall(PetscObjectReference((PetscObject)C));
  proj->C = C;
  if (weight) {
    PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &proj->CW));
    PetscCall(MatDiagonalScale(proj->CW, NULL, weight));
  }
  PetscCall(AinsworthGramSetUp(&proj->gram, proj->C, weight ? proj->CW : proj->C, same, rowsPerRank, parent, prefix));
  PetscCall(MoveRows(proj, &proj->C));
  if (weight) PetscCall(MoveRows(proj, &proj->CW));
  else {
    PetscCall(PetscObjectReference((PetscObject)proj->C));
    proj->CW = proj->C;
  }
  if (!same) PetscCall(CreateVectors(proj, C));
  proj->source = now;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthProjectorReset(AinsworthProjector *proj)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&proj->C));
  PetscCall(MatDestroy(&proj->CW));
  PetscCall(AinsworthGramReset(&proj->gram));
  PetscCall(VecScatterDestroy(&proj->scatter));
  PetscCall(VecDestroy(&proj->rowValues));
  PetscCall(VecDestroy(&proj->rowSolution));
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

/* y = Q x = x - W C' S^{-1} C x; y may be x. Leaves C x, placed, in proj->rowValues */
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

/* y = Q' x + C' l = x - C' (S^{-1} C W x - l); y may be x, l (m, placed) may be NULL */
PetscErrorCode AinsworthProjectorMultTranspose(AinsworthProjector *proj, Vec x, Vec l, Vec y)
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscCall(MatMult(proj->CW, x, proj->rowValues));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  if (l) PetscCall(VecAYPX(proj->rowSolution, -1.0, l));
  else PetscCall(VecScale(proj->rowSolution, -1.0));
  PetscCall(MatMultHermitianTransposeAdd(proj->C, proj->rowSolution, x, y));
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, proj->C, x, y, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = R g = W C' S^{-1} g */
PetscErrorCode AinsworthProjectorRightInverse(AinsworthProjector *proj, Vec g, Vec x)
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorPlace(proj, g, proj->rowValues));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(MatMultHermitianTranspose(proj->CW, proj->rowSolution, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* l = R' r = S^{-1} C W r */
PetscErrorCode AinsworthProjectorRightInverseTranspose(AinsworthProjector *proj, Vec r, Vec l)
{
  PetscFunctionBegin;
  PetscCall(MatMult(proj->CW, r, proj->rowValues));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(Move(proj, proj->rowSolution, l, SCATTER_REVERSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = R B^{-1} R' b, B placed */
PetscErrorCode AinsworthProjectorSolveRange(AinsworthProjector *proj, Vec B, Vec b, Vec x)
{
  PetscFunctionBegin;
  PetscCall(MatMult(proj->CW, b, proj->rowValues));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(VecPointwiseDivide(proj->rowValues, proj->rowSolution, B));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(MatMultHermitianTranspose(proj->CW, proj->rowSolution, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
