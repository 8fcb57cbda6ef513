#include "saddle.h"
#include "../loops.h"
#include "../objects.h"

/* Work space: n, and all rows of the multiplier field */
static PetscErrorCode GetWork(AinsworthSaddle *sp, Vec *primal, Vec *dual)
{
  PetscFunctionBegin;
  if (!sp->work[0]) PetscCall(MatCreateVecs(sp->rowsC, &sp->work[0], &sp->work[1]));
  *primal = sp->work[0];
  *dual   = sp->work[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* lambda_i = -g_i / D_ii where nothing else is in the row, otherwise 0, on all rows. g: less the columns of known unknowns, which the row may have had */
static PetscErrorCode SolveDecoupled(const AinsworthSaddle *sp, Vec g, Vec lambda)
{
  PetscFunctionBegin;
  PetscCall(MatGetDiagonal(sp->rowsD, lambda));
  PetscCall(AinsworthUpdate(lambda, {g}, [sp](PetscInt i, PetscScalar &l, PetscScalar a) { l = sp->kind[i] == AINSWORTH_ROW_DECOUPLED ? -a / l : 0.0; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleRestrict - the right-hand side of the rows that are kept: f and g less what is known of x and lambda times its columns

   kept.primal may be f where sp->known is NULL and B is C: nothing is moved into f then.
*/
PetscErrorCode AinsworthSaddleRestrict(AinsworthSaddle *sp, AinsworthSaddleVec b, AinsworthSaddleVec kept)
{
  Vec          x, lambda, rest = b.dual;
  PetscScalar *k;
  PetscInt     n = 0;

  PetscFunctionBegin;
  PetscCall(GetWork(sp, &x, &lambda));
  if (kept.primal != b.primal) PetscCall(VecCopy(b.primal, kept.primal));
  if (sp->count[AINSWORTH_ROW_DECOUPLED] || sp->known) PetscCall(AinsworthVecClone(b.dual, &rest));
  if (sp->known) PetscCall(AinsworthSaddleMoveColumns(sp, b.primal, x, lambda, kept.primal, rest));
  if (sp->count[AINSWORTH_ROW_DECOUPLED]) {
    PetscCall(SolveDecoupled(sp, rest, lambda));
    PetscCall(MatMultAdd(sp->rowsD, lambda, rest, rest));
    if (sp->rowsB != sp->rowsC) {
      PetscCall(MatMultHermitianTranspose(sp->rowsB, lambda, x));
      PetscCall(VecAXPY(kept.primal, -1.0, x));
    }
  }
  PetscCall(VecGetArrayWrite(kept.dual, &k));
  PetscCall(AinsworthForEntries({rest}, [&](PetscInt i, PetscScalar a) {
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) k[n++] = a;
  }));
  PetscCall(VecRestoreArrayWrite(kept.dual, &k));
  if (rest != b.dual) PetscCall(VecDestroy(&rest));
  if (sp->balance) PetscCall(VecPointwiseMult(kept.dual, kept.dual, sp->balance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSaddleExtend - x with what is known, and lambda on all rows, from the solution of what is kept */
PetscErrorCode AinsworthSaddleExtend(AinsworthSaddle *sp, AinsworthSaddleVec b, Vec kept, AinsworthSaddleVec y)
{
  Vec                work, rest;
  const PetscScalar *k;
  PetscInt           n = 0;

  PetscFunctionBegin;
  PetscCall(GetWork(sp, &work, &rest));
  if (sp->known) PetscCall(AinsworthSaddleSetKnown(sp, b.primal, y.primal));
  if (sp->count[AINSWORTH_ROW_DECOUPLED] && sp->known) {
    PetscCall(MatMult(sp->givenC, y.primal, rest));
    PetscCall(VecAYPX(rest, -1.0, b.dual));
    PetscCall(SolveDecoupled(sp, rest, y.dual));
  } else if (sp->count[AINSWORTH_ROW_DECOUPLED]) PetscCall(SolveDecoupled(sp, b.dual, y.dual));
  else PetscCall(VecZeroEntries(y.dual));
  if (sp->balance) PetscCall(VecPointwiseMult(kept, kept, sp->balance));
  PetscCall(VecGetArrayRead(kept, &k));
  PetscCall(AinsworthUpdate(y.dual, [&](PetscInt i, PetscScalar &l) {
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) l = k[n++];
  }));
  PetscCall(VecRestoreArrayRead(kept, &k));
  if (sp->count[AINSWORTH_ROW_PASSIVE]) { /* D_ii lambda_i = C_i x - g_i - (D lambda)_i, in which lambda_i is 0 yet */
    Vec diagonal;

    PetscCall(VecDuplicate(rest, &diagonal));
    PetscCall(MatMult(sp->rowsD, y.dual, rest));
    PetscCall(VecAYPX(rest, 1.0, b.dual));
    PetscCall(VecScale(rest, -1.0));
    PetscCall(MatMultAdd(sp->givenC, y.primal, rest, rest));
    PetscCall(MatGetDiagonal(sp->rowsD, diagonal));
    PetscCall(AinsworthUpdate(y.dual, {rest, diagonal}, [sp](PetscInt i, PetscScalar &l, PetscScalar r, PetscScalar d) {
      if (sp->kind[i] == AINSWORTH_ROW_PASSIVE) l = r / d;
    }));
    PetscCall(VecDestroy(&diagonal));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: the row of the first entry of f, or else of g, that is NaN or Inf, for a message; empty where there is none */
PetscErrorCode AinsworthSaddleNameNotFinite(const AinsworthSaddle *sp, AinsworthSaddleVec b, char text[], size_t len)
{
  PetscFunctionBegin;
  text[0] = 0;
  for (Vec field : {b.primal, b.dual}) {
    PetscInt start, row = -1;

    if (text[0]) continue;
    PetscCall(VecGetOwnershipRange(field, &start, NULL));
    PetscCall(AinsworthForEntries({field}, [&](PetscInt i, PetscScalar a) {
      if (row < 0 && PetscIsInfOrNanScalar(a)) row = start + i;
    }));
    PetscCall(AinsworthAgreeOnFirst(PetscObjectComm((PetscObject)sp->rowsC), &row));
    if (row >= 0) PetscCall(PetscSNPrintf(text, len, "row %" PetscInt_FMT " of the %s field", row, field == b.primal ? "primal" : "multiplier"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
