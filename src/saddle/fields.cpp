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
   AinsworthSaddleRestrict - the right-hand side of the rows that are kept, moved: f and g less what is known of x and lambda times its columns

   moved may be f where sp->known is NULL and B is C: nothing is moved into f then.
*/
PetscErrorCode AinsworthSaddleRestrict(AinsworthSaddle *sp, Vec f, Vec g, Vec moved, Vec kept)
{
  Vec          x, lambda, rest = g;
  PetscScalar *k;
  PetscInt     n = 0;

  PetscFunctionBegin;
  PetscCall(GetWork(sp, &x, &lambda));
  if (moved != f) PetscCall(VecCopy(f, moved));
  if (sp->count[AINSWORTH_ROW_DECOUPLED] || sp->known) PetscCall(AinsworthVecClone(g, &rest));
  if (sp->known) PetscCall(AinsworthSaddleMoveColumns(sp, f, x, lambda, moved, rest));
  if (sp->count[AINSWORTH_ROW_DECOUPLED]) {
    PetscCall(SolveDecoupled(sp, rest, lambda));
    PetscCall(MatMultAdd(sp->rowsD, lambda, rest, rest));
    if (sp->rowsB != sp->rowsC) {
      PetscCall(MatMultHermitianTranspose(sp->rowsB, lambda, x));
      PetscCall(VecAXPY(moved, -1.0, x));
    }
  }
  PetscCall(VecGetArrayWrite(kept, &k));
  PetscCall(AinsworthForEntries({rest}, [&](PetscInt i, PetscScalar a) {
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) k[n++] = a;
  }));
  PetscCall(VecRestoreArrayWrite(kept, &k));
  if (rest != g) PetscCall(VecDestroy(&rest));
  if (sp->balance) PetscCall(VecPointwiseMult(kept, kept, sp->balance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSaddleExtend - x with what is known, and lambda on all rows, from the solution of what is kept */
PetscErrorCode AinsworthSaddleExtend(AinsworthSaddle *sp, Vec f, Vec g, Vec kept, Vec x, Vec lambda)
{
  Vec                work, rest;
  const PetscScalar *k;
  PetscInt           n = 0;

  PetscFunctionBegin;
  PetscCall(GetWork(sp, &work, &rest));
  if (sp->known) PetscCall(AinsworthSaddleSetKnown(sp, f, x));
  if (sp->count[AINSWORTH_ROW_DECOUPLED] && sp->known) {
    PetscCall(MatMult(sp->givenC, x, rest));
    PetscCall(VecAYPX(rest, -1.0, g));
    PetscCall(SolveDecoupled(sp, rest, lambda));
  } else if (sp->count[AINSWORTH_ROW_DECOUPLED]) PetscCall(SolveDecoupled(sp, g, lambda));
  else PetscCall(VecZeroEntries(lambda));
  if (sp->balance) PetscCall(VecPointwiseMult(kept, kept, sp->balance));
  PetscCall(VecGetArrayRead(kept, &k));
  PetscCall(AinsworthUpdate(lambda, [&](PetscInt i, PetscScalar &l) {
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) l = k[n++];
  }));
  PetscCall(VecRestoreArrayRead(kept, &k));
  if (sp->count[AINSWORTH_ROW_PASSIVE]) { /* D_ii lambda_i = C_i x - g_i - (D lambda)_i, in which lambda_i is 0 yet */
    Vec diagonal;

    PetscCall(VecDuplicate(rest, &diagonal));
    PetscCall(MatMult(sp->rowsD, lambda, rest));
    PetscCall(VecAYPX(rest, 1.0, g));
    PetscCall(VecScale(rest, -1.0));
    PetscCall(MatMultAdd(sp->givenC, x, rest, rest));
    PetscCall(MatGetDiagonal(sp->rowsD, diagonal));
    PetscCall(AinsworthUpdate(lambda, {rest, diagonal}, [sp](PetscInt i, PetscScalar &l, PetscScalar r, PetscScalar d) {
      if (sp->kind[i] == AINSWORTH_ROW_PASSIVE) l = r / d;
    }));
    PetscCall(VecDestroy(&diagonal));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: the row of the first entry of f, or else of g, that is NaN or Inf, for a message; empty where there is none */
PetscErrorCode AinsworthSaddleNameNotFinite(const AinsworthSaddle *sp, Vec f, Vec g, char text[], size_t len)
{
  PetscFunctionBegin;
  text[0] = 0;
  for (Vec field : {f, g}) {
    PetscInt start, row = -1;

    if (text[0]) continue;
    PetscCall(VecGetOwnershipRange(field, &start, NULL));
    PetscCall(AinsworthForEntries({field}, [&](PetscInt i, PetscScalar a) {
      if (row < 0 && PetscIsInfOrNanScalar(a)) row = start + i;
    }));
    PetscCall(AinsworthAgreeOnFirst(PetscObjectComm((PetscObject)sp->rowsC), &row));
    if (row >= 0) PetscCall(PetscSNPrintf(text, len, "row %" PetscInt_FMT " of the %s field", row, field == f ? "primal" : "multiplier"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
