#include "saddle.h"

/*
   A right-hand side of the constraints belongs to a dependent row if it is that of the combination, to this part of |C_i| |x| + |g_i|; the second
   figure is the rounding that a row may get from the others through the factors of the combination, relative to the largest |x|; the third is that
   of the right-hand side of a zero row, relative to the largest |g|
*/
static const PetscReal consistent = 1e-8, combined = 1e5 * PETSC_MACHINE_EPSILON, noise = 1000 * PETSC_MACHINE_EPSILON;

/* Collective: what stands in `text` behind the names of the marked rows; text is empty where none is marked */
static PetscErrorCode Name(const AinsworthSaddle *sp, PetscBool marked[], const char before[], const char behind[], char text[], size_t len)
{
  char names[128];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleNameRows(sp, marked, names, sizeof(names)));
  if (names[0]) PetscCall(PetscSNPrintf(text, len, "%s %s%s", before, names, behind));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleRestrict - g on the rows that are kept and f' = f + C_p' D^{-1} g_p, where p are the eliminated rows

   augmented may be NULL where no rows are eliminated, and may not be f. why says which zero rows have a right-hand side, or is empty.
*/
PetscErrorCode AinsworthSaddleRestrict(const AinsworthSaddle *sp, Vec f, Vec g, Vec kept, Vec augmented, char why[], size_t len)
{
  Vec                part = sp->part[AINSWORTH_ROW_PENALISED];
  PetscScalar       *k, *p = NULL;
  const PetscScalar *a;
  PetscInt           ik = 0, ip = 0;
  PetscBool         *marked;
  PetscReal          largest;

  PetscFunctionBegin;
  why[0] = 0;
  PetscCall(VecNorm(g, NORM_INFINITY, &largest));
  PetscCall(PetscCalloc1(sp->local, &marked));
  PetscCall(VecGetArrayRead(g, &a));
  PetscCall(VecGetArrayWrite(kept, &k));
  if (part) PetscCall(VecGetArrayWrite(part, &p));
  for (PetscInt i = 0; i < sp->local; i++) {
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) k[ik++] = a[i];
    else if (sp->kind[i] == AINSWORTH_ROW_PENALISED) p[ip++] = -a[i] / sp->diag[i];
    else if (sp->kind[i] == AINSWORTH_ROW_ZERO) marked[i] = (PetscBool)(PetscAbsScalar(a[i]) > noise * largest);
  }
  PetscCall(VecRestoreArrayRead(g, &a));
  PetscCall(VecRestoreArrayWrite(kept, &k));
  if (part) {
    PetscCall(VecRestoreArrayWrite(part, &p));
    PetscCall(MatMultHermitianTranspose(sp->left[AINSWORTH_ROW_PENALISED], part, augmented));
    PetscCall(VecAXPY(augmented, 1.0, f));
  }
  if (sp->count[AINSWORTH_ROW_ZERO])
    PetscCall(Name(sp, marked, "nonzero on a row of C that is zero (rows", " of the multiplier field): no solution exists", why, len));
  PetscCall(PetscFree(marked));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which of the dependent rows does x not satisfy? */
static PetscErrorCode MarkInconsistent(const AinsworthSaddle *sp, Vec g, Vec x, PetscBool marked[])
{
  Vec                size, absx, residual = sp->part[AINSWORTH_ROW_DEPENDENT];
  PetscReal          largest;
  const PetscScalar *a, *r, *s;
  PetscInt           id = 0;

  PetscFunctionBegin;
  PetscCall(MatMult(sp->left[AINSWORTH_ROW_DEPENDENT], x, residual));
  PetscCall(VecNorm(x, NORM_INFINITY, &largest));
  PetscCall(VecDuplicate(x, &absx));
  PetscCall(VecCopy(x, absx));
  PetscCall(VecAbs(absx));
  PetscCall(VecShift(absx, combined / consistent * largest));
  PetscCall(VecDuplicate(residual, &size));
  PetscCall(MatMult(sp->absolute, absx, size));
  PetscCall(VecGetArrayRead(g, &a));
  PetscCall(VecGetArrayRead(residual, &r));
  PetscCall(VecGetArrayRead(size, &s));
  for (PetscInt i = 0; i < sp->local; i++) {
    if (sp->kind[i] != AINSWORTH_ROW_DEPENDENT) continue;
    marked[i] = (PetscBool)(PetscAbsScalar(r[id] - a[i]) > consistent * (PetscRealPart(s[id]) + PetscAbsScalar(a[i])));
    id++;
  }
  PetscCall(VecRestoreArrayRead(g, &a));
  PetscCall(VecRestoreArrayRead(residual, &r));
  PetscCall(VecRestoreArrayRead(size, &s));
  PetscCall(VecDestroy(&size));
  PetscCall(VecDestroy(&absx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleExtend - lambda on all rows, from that on the kept ones

   why says which dependent rows contradict the rows that they depend on, or is empty.
*/
PetscErrorCode AinsworthSaddleExtend(const AinsworthSaddle *sp, Vec g, Vec x, Vec kept, Vec lambda, char why[], size_t len)
{
  Vec                part = sp->part[AINSWORTH_ROW_PENALISED];
  PetscScalar       *l;
  const PetscScalar *a, *k, *p = NULL;
  PetscInt           ik = 0, ip = 0;

  PetscFunctionBegin;
  why[0] = 0;
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
  if (sp->count[AINSWORTH_ROW_DEPENDENT]) {
    PetscBool *marked;

    PetscCall(PetscCalloc1(sp->local, &marked));
    PetscCall(MarkInconsistent(sp, g, x, marked));
    PetscCall(Name(sp, marked, "not that of the other rows of C on which it depends, exactly or nearly (rows", " of the multiplier field): no solution exists",
                   why, len));
    PetscCall(PetscFree(marked));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
