#include "saddle.h"
#include <limits>

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
  PetscScalar       *l;
  const PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(MatGetDiagonal(sp->rowsD, lambda));
  PetscCall(VecGetArrayRead(g, &a));
  PetscCall(VecGetArray(lambda, &l));
  for (PetscInt i = 0; i < sp->local; i++) l[i] = sp->kind[i] == AINSWORTH_ROW_DECOUPLED ? -a[i] / l[i] : 0.0;
  PetscCall(VecRestoreArray(lambda, &l));
  PetscCall(VecRestoreArrayRead(g, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleRestrict - the right-hand side of the rows that are kept, moved: f and g less what is known of x and lambda times its columns

   moved may be f where sp->known is NULL and B is C: nothing is moved into f then.
*/
PetscErrorCode AinsworthSaddleRestrict(AinsworthSaddle *sp, Vec f, Vec g, Vec moved, Vec kept)
{
  Vec                x, lambda, rest = g;
  PetscScalar       *k;
  const PetscScalar *a;
  PetscInt           n = 0;

  PetscFunctionBegin;
  PetscCall(GetWork(sp, &x, &lambda));
  if (moved != f) PetscCall(VecCopy(f, moved));
  if (sp->count[AINSWORTH_ROW_DECOUPLED] || sp->known) {
    PetscCall(VecDuplicate(g, &rest));
    PetscCall(VecCopy(g, rest));
  }
  if (sp->known) PetscCall(AinsworthSaddleMoveColumns(sp, f, x, lambda, moved, rest));
  if (sp->count[AINSWORTH_ROW_DECOUPLED]) {
    PetscCall(SolveDecoupled(sp, rest, lambda));
    PetscCall(MatMultAdd(sp->rowsD, lambda, rest, rest));
    if (sp->rowsB != sp->rowsC) {
      PetscCall(MatMultHermitianTranspose(sp->rowsB, lambda, x));
      PetscCall(VecAXPY(moved, -1.0, x));
    }
  }
  PetscCall(VecGetArrayRead(rest, &a));
  PetscCall(VecGetArrayWrite(kept, &k));
  for (PetscInt i = 0; i < sp->local; i++)
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) k[n++] = a[i];
  PetscCall(VecRestoreArrayRead(rest, &a));
  PetscCall(VecRestoreArrayWrite(kept, &k));
  if (rest != g) PetscCall(VecDestroy(&rest));
  if (sp->balance) PetscCall(VecPointwiseMult(kept, kept, sp->balance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSaddleExtend - x with what is known, and lambda on all rows, from the solution of what is kept */
PetscErrorCode AinsworthSaddleExtend(AinsworthSaddle *sp, Vec f, Vec g, Vec kept, Vec x, Vec lambda)
{
  Vec                work, rest;
  PetscScalar       *l;
  const PetscScalar *k, *r, *d;
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
  PetscCall(VecGetArray(lambda, &l));
  for (PetscInt i = 0; i < sp->local; i++)
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) l[i] = k[n++];
  PetscCall(VecRestoreArrayRead(kept, &k));
  PetscCall(VecRestoreArray(lambda, &l));
  if (sp->count[AINSWORTH_ROW_PASSIVE]) { /* D_ii lambda_i = C_i x - g_i - (D lambda)_i, in which lambda_i is 0 yet */
    Vec diagonal;

    PetscCall(VecDuplicate(rest, &diagonal));
    PetscCall(MatMult(sp->rowsD, lambda, rest));
    PetscCall(VecAYPX(rest, 1.0, g));
    PetscCall(VecScale(rest, -1.0));
    PetscCall(MatMultAdd(sp->givenC, x, rest, rest));
    PetscCall(MatGetDiagonal(sp->rowsD, diagonal));
    PetscCall(VecGetArrayRead(rest, &r));
    PetscCall(VecGetArrayRead(diagonal, &d));
    PetscCall(VecGetArray(lambda, &l));
    for (PetscInt i = 0; i < sp->local; i++)
      if (sp->kind[i] == AINSWORTH_ROW_PASSIVE) l[i] = r[i] / d[i];
    PetscCall(VecRestoreArray(lambda, &l));
    PetscCall(VecRestoreArrayRead(diagonal, &d));
    PetscCall(VecRestoreArrayRead(rest, &r));
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
    const PetscScalar *a;
    PetscInt           n, start, row = std::numeric_limits<PetscInt>::max();

    if (text[0]) continue;
    PetscCall(VecGetLocalSize(field, &n));
    PetscCall(VecGetOwnershipRange(field, &start, NULL));
    PetscCall(VecGetArrayRead(field, &a));
    for (PetscInt i = n - 1; i >= 0; i--)
      if (PetscIsInfOrNanScalar(a[i])) row = start + i;
    PetscCall(VecRestoreArrayRead(field, &a));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &row, 1, MPIU_INT, MPI_MIN, PetscObjectComm((PetscObject)sp->rowsC)));
    if (row < std::numeric_limits<PetscInt>::max())
      PetscCall(PetscSNPrintf(text, len, "row %" PetscInt_FMT " of the %s field", row, field == f ? "primal" : "multiplier"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
