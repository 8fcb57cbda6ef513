#include "saddle.h"
#include "../base/loops.h"
#include "../base/objects.h"

/*
   AinsworthSaddleUseFields - calls a function with the fields of a right-hand side (rows) or of a solution, of one of
   each kind at a time; they are given back also if it fails. Collective
*/
PetscErrorCode AinsworthSaddleUseFields(const AinsworthSaddle *sp, PetscBool rows, AinsworthAccess access, Vec v,
                                        const AinsworthFieldsUse &use)
{
  const AinsworthTransfer *transfer = &sp->transfer[rows ? 0 : 1];
  const AinsworthSaddleVec fields   = {transfer->part[0], transfer->part[1]};
  PetscErrorCode           code;

  PetscFunctionBegin;
  PetscCall(AinsworthTransferIn(transfer, access, v, fields));
  code = use(fields); /* checked when all is given back */
  PetscCall(AinsworthTransferOut(transfer, access, code != PETSC_SUCCESS, v, fields));
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets lambda_i = -g_i / D_ii in decoupled rows, else 0; g has had the columns of known unknowns subtracted */
static PetscErrorCode SolveDecoupled(const AinsworthSaddle *sp, Vec g, Vec lambda)
{
  PetscFunctionBegin;
  PetscCall(MatGetDiagonal(sp->all.D, lambda));
  PetscCall(AinsworthUpdate(lambda, {g}, [sp](PetscInt i, PetscScalar &l, PetscScalar a) {
    l = sp->kind[i] == AINSWORTH_ROW_DECOUPLED ? -a / l : 0.0;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSaddleGetKept - copies the entries of kept rows */
PetscErrorCode AinsworthSaddleGetKept(const AinsworthSaddle *sp, Vec all, Vec kept)
{
  PetscScalar *k;
  PetscInt     n = 0;

  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(kept, &k));
  PetscCall(AinsworthForEntries({all}, [&](PetscInt i, PetscScalar a) {
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) k[n++] = a;
  }));
  PetscCall(VecRestoreArrayWrite(kept, &k));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleRestrict - restricts a right-hand side to the kept rows, after subtracting the columns of known
   unknowns and multipliers. Collective

   kept.primal may be b.primal if sp->known is NULL and B is C, because f does not change then.
*/
PetscErrorCode AinsworthSaddleRestrict(const AinsworthSaddle *sp, AinsworthSaddleVec b, AinsworthSaddleVec kept)
{
  const Vec x = sp->work[0], lambda = sp->work[1];
  Vec       rest = b.dual;

  PetscFunctionBegin;
  if (kept.primal != b.primal) PetscCall(VecCopy(b.primal, kept.primal));
  if (sp->count[AINSWORTH_ROW_DECOUPLED] || sp->known) PetscCall(AinsworthVecClone(b.dual, &rest));
  if (sp->known) PetscCall(AinsworthSaddleMoveColumns(sp, b.primal, x, lambda, kept.primal, rest));
  if (sp->count[AINSWORTH_ROW_DECOUPLED]) {
    PetscCall(SolveDecoupled(sp, rest, lambda));
    PetscCall(MatMultAdd(sp->all.D, lambda, rest, rest));
    if (!sp->oneSided()) {
      PetscCall(MatMultHermitianTranspose(sp->all.B, lambda, x));
      PetscCall(VecAXPY(kept.primal, -1.0, x));
    }
  }
  PetscCall(AinsworthSaddleGetKept(sp, rest, kept.dual));
  if (rest != b.dual) PetscCall(VecDestroy(&rest));
  if (sp->balance) PetscCall(VecPointwiseMult(kept.dual, kept.dual, sp->balance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleExtend - extends a solution of the kept rows by the known unknowns and to all multipliers. Collective
*/
PetscErrorCode AinsworthSaddleExtend(const AinsworthSaddle *sp, AinsworthSaddleVec b, Vec kept, AinsworthSaddleVec y)
{
  const Vec          rest = sp->work[1];
  const PetscScalar *k;
  PetscInt           n = 0;

  PetscFunctionBegin;
  if (sp->known) { /* where y is 0 up to rounding */
    PetscCall(
      AinsworthUpdate(y.primal, {sp->known, b.primal}, [](PetscInt, PetscScalar &v, PetscScalar k, PetscScalar r) {
        if (k != 0.0) v = k * r;
      }));
  }
  if (sp->count[AINSWORTH_ROW_DECOUPLED] && sp->known) {
    PetscCall(MatMult(sp->all.C, y.primal, rest));
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
  if (sp->count[AINSWORTH_ROW_PASSIVE]) { /* D_ii lambda_i = C_i x - g_i - (D lambda)_i, where lambda_i is still 0 */
    Vec diagonal;

    PetscCall(VecDuplicate(rest, &diagonal));
    PetscCall(MatMult(sp->all.D, y.dual, rest));
    PetscCall(VecAYPX(rest, 1.0, b.dual));
    PetscCall(VecScale(rest, -1.0));
    PetscCall(MatMultAdd(sp->all.C, y.primal, rest, rest));
    PetscCall(MatGetDiagonal(sp->all.D, diagonal));
    PetscCall(AinsworthUpdate(y.dual, {rest, diagonal}, [sp](PetscInt i, PetscScalar &l, PetscScalar r, PetscScalar d) {
      if (sp->kind[i] == AINSWORTH_ROW_PASSIVE) l = r / d;
    }));
    PetscCall(VecDestroy(&diagonal));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names the first row of f, or else of g, with NaN or Inf, for a message; text is empty if there is none. Collective */
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
    PetscCall(AinsworthAgreeOnFirst(PetscObjectComm((PetscObject)sp->all.C), &row));
    if (row >= 0)
      PetscCall(PetscSNPrintf(text, len, "row %" PetscInt_FMT " of the %s field", row,
                              field == b.primal ? "primal" : "multiplier"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
