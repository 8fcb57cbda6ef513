#include "projector.h"
#include "../events.h"

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
  PetscCall(MatCreateVecs(C, NULL, &proj->s));
  PetscCall(VecDuplicate(proj->s, &proj->t));
  PetscCall(AinsworthGramSetUp(&proj->gram, proj->C, proj->CW, rowsPerRank, parent, prefix));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthProjectorReset(AinsworthProjector *proj)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&proj->C));
  PetscCall(MatDestroy(&proj->CW));
  PetscCall(AinsworthGramReset(&proj->gram));
  PetscCall(VecDestroy(&proj->s));
  PetscCall(VecDestroy(&proj->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = Q x = x - W C' S^{-1} C x; y may be x. Leaves C x in proj->s */
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

/* y = Q' x + C' l = x - C' (S^{-1} C W x - l); y may be x, l (m) may be NULL */
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
  PetscCall(AinsworthGramSolve(&proj->gram, g, proj->t));
  PetscCall(MatMultHermitianTranspose(proj->CW, proj->t, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* l = R' r = S^{-1} C W r */
PetscErrorCode AinsworthProjectorRightInverseTranspose(AinsworthProjector *proj, Vec r, Vec l)
{
  PetscFunctionBegin;
  PetscCall(MatMult(proj->CW, r, proj->s));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->s, l));
  PetscFunctionReturn(PETSC_SUCCESS);
}
