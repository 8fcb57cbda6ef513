#include "saddle.h"
#include <limits>

/*
   AinsworthSaddleRestrict - g on the rows that are kept and f' = f + C_p' D^{-1} g_p, where p are the eliminated rows

   augmented may be NULL where no rows are eliminated, and may not be f.
*/
PetscErrorCode AinsworthSaddleRestrict(const AinsworthSaddle *sp, Vec f, Vec g, Vec kept, Vec augmented)
{
  Vec                part = sp->part[AINSWORTH_ROW_PENALISED];
  PetscScalar       *k, *p = NULL;
  const PetscScalar *a;
  PetscInt           ik = 0, ip = 0;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(g, &a));
  PetscCall(VecGetArrayWrite(kept, &k));
  if (part) PetscCall(VecGetArrayWrite(part, &p));
  for (PetscInt i = 0; i < sp->local; i++) {
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) k[ik++] = a[i];
    else if (sp->kind[i] == AINSWORTH_ROW_PENALISED) p[ip++] = -a[i] / sp->diag[i];
  }
  PetscCall(VecRestoreArrayRead(g, &a));
  PetscCall(VecRestoreArrayWrite(kept, &k));
  if (part) {
    PetscCall(VecRestoreArrayWrite(part, &p));
    PetscCall(MatMultHermitianTranspose(sp->left[AINSWORTH_ROW_PENALISED], part, augmented));
    PetscCall(VecAXPY(augmented, 1.0, f));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSaddleExtend - lambda on all rows, from that on the kept ones */
PetscErrorCode AinsworthSaddleExtend(const AinsworthSaddle *sp, Vec g, Vec x, Vec kept, Vec lambda)
{
  Vec                part = sp->part[AINSWORTH_ROW_PENALISED];
  PetscScalar       *l;
  const PetscScalar *a, *k, *p = NULL;
  PetscInt           ik = 0, ip = 0;

  PetscFunctionBegin;
  if (part) {
    PetscCall(MatMult(sp->left[AINSWORTH_ROW_PENALISED], x, part));
    PetscCall(VecGetArrayRead(part, &p));
  }
  PetscCall(VecGetArrayRead(g, &a));
  PetscCall(VecGetArrayRead(kept, &k));
  PetscCall(VecGetArrayWrite(lambda, &l));
  for (PetscInt i = 0; i < sp->local; i++) {
    switch (sp->kind[i]) {
    case AINSWORTH_ROW_CONSTRAINT:
      l[i] = k[ik++];
      break;
    case AINSWORTH_ROW_DECOUPLED:
      l[i] = a[i] / sp->diag[i];
      break;
    case AINSWORTH_ROW_PENALISED:
      l[i] = (a[i] - p[ip++]) / sp->diag[i];
      break;
    default:
      l[i] = 0.0;
    }
  }
  PetscCall(VecRestoreArrayRead(g, &a));
  PetscCall(VecRestoreArrayRead(kept, &k));
  PetscCall(VecRestoreArrayWrite(lambda, &l));
  if (part) PetscCall(VecRestoreArrayRead(part, &p));
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
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &row, 1, MPIU_INT, MPI_MIN, PetscObjectComm((PetscObject)sp->C)));
    if (row < std::numeric_limits<PetscInt>::max())
      PetscCall(PetscSNPrintf(text, len, "row %" PetscInt_FMT " of the %s field", row, field == f ? "primal" : "multiplier"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
