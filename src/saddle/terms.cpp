/* What the terms of the rows of both equations amount to: the measure of their residuals */
#include "terms.h"

PetscErrorCode AinsworthDuplicateAbs(Vec x, Vec *absolute)
{
  PetscFunctionBegin;
  PetscCall(VecDuplicate(x, absolute));
  PetscCall(VecCopy(x, *absolute));
  PetscCall(VecAbs(*absolute));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* size = |op(A)| |x| + |B|' |lambda| + |f|, what the terms of each row of the first equation amount to */
PetscErrorCode AinsworthTermsPrimal(const AinsworthSaddle *sp, PetscBool transpose, Vec f, Vec x, Vec lambda, Vec Ax, Vec size)
{
  Vec       absolute, part;
  Mat       A, M;
  PetscBool rows;

  PetscFunctionBegin;
  PetscCall(AinsworthDuplicateAbs(f, &part));
  PetscCall(MatHasOperation(sp->block[0], MATOP_GET_ROW, &rows));
  if (rows) {
    PetscCall(AinsworthGetAIJ(sp->block[0], &A));
    PetscCall(AinsworthAbsoluteAIJ(A, &M));
    PetscCall(AinsworthDuplicateAbs(x, &absolute));
    if (transpose) PetscCall(MatMultTransposeAdd(M, absolute, part, size));
    else PetscCall(MatMultAdd(M, absolute, part, size));
    PetscCall(VecDestroy(&absolute));
    PetscCall(MatDestroy(&M));
    PetscCall(MatDestroy(&A));
  } else { /* a shell tells its products only */
    PetscCall(VecCopy(Ax, size));
    PetscCall(VecAbs(size));
    PetscCall(VecAXPY(size, 1.0, part));
  }
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsB, &M));
  PetscCall(AinsworthDuplicateAbs(lambda, &absolute));
  PetscCall(MatMultTransposeAdd(M, absolute, size, part));
  PetscCall(VecCopy(part, size));
  PetscCall(VecDestroy(&absolute));
  PetscCall(VecDestroy(&part));
  PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* terms += |D| |lambda|, and slack = allowed times the square root of the sums of the rows of |D| */
static PetscErrorCode AddCompliance(const AinsworthSaddle *sp, PetscReal allowed, Vec lambda, Vec terms, Vec slack)
{
  Mat M;
  Vec absolute;

  PetscFunctionBegin;
  PetscCall(AinsworthDuplicateAbs(lambda, &absolute));
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsD, &M));
  PetscCall(MatMultAdd(M, absolute, terms, terms));
  PetscCall(AinsworthRowSums(M, 1, slack));
  PetscCall(VecSqrtAbs(slack));
  PetscCall(VecScale(slack, allowed));
  PetscCall(MatDestroy(&M));
  PetscCall(VecDestroy(&absolute));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The terms of each row of the second equation, |C| |x| + |D| |lambda| + |g|, and the rounding that it gets from others; slack: what AddCompliance() allows, or NULL */
PetscErrorCode AinsworthTermsDual(AinsworthSaddle *sp, PetscReal allowed, Vec g, Vec x, Vec lambda, Vec size, Vec *slack)
{
  Vec       absolute;
  PetscReal largest;

  PetscFunctionBegin;
  if (!sp->absolute) PetscCall(AinsworthAbsoluteAIJ(sp->givenC, &sp->absolute));
  PetscCall(VecNorm(x, NORM_INFINITY, &largest));
  PetscCall(AinsworthDuplicateAbs(x, &absolute));
  PetscCall(VecShift(absolute, AinsworthCombined / AinsworthConsistent * largest));
  PetscCall(MatMult(sp->absolute, absolute, size));
  PetscCall(VecDestroy(&absolute));
  *slack = NULL;
  if (sp->rowsD) {
    PetscCall(VecDuplicate(g, slack));
    PetscCall(AddCompliance(sp, allowed, lambda, size, *slack));
  }
  PetscCall(AinsworthDuplicateAbs(g, &absolute));
  PetscCall(VecAXPY(size, 1.0, absolute));
  PetscCall(VecDestroy(&absolute));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |B|' t, with t_k the lambda_k that has the energy 1, of A under C_k' or of D_kk: the scale of a row of A that is zero */
PetscErrorCode AinsworthTermsThroughRows(const AinsworthSaddle *sp, Vec diagonal, Vec forces)
{
  Vec          root, rows, lengths;
  Mat          M;
  PetscInt     n, m;
  PetscReal    stiffest;
  PetscScalar *r, *t;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(diagonal, &root));
  PetscCall(VecCopy(diagonal, root));
  if (PetscDefined(USE_COMPLEX)) PetscCall(VecRealPart(root));
  PetscCall(VecMax(root, NULL, &stiffest));
  PetscCall(VecGetLocalSize(root, &n));
  PetscCall(VecGetArray(root, &r));
  for (PetscInt i = 0; i < n; i++) r[i] = 1.0 / PetscSqrtReal(PetscRealPart(r[i]) > 0.0 ? PetscRealPart(r[i]) : stiffest);
  PetscCall(VecRestoreArray(root, &r));
  PetscCall(MatCreateVecs(sp->rowsC, NULL, &rows));
  PetscCall(VecDuplicate(rows, &lengths));
  PetscCall(AinsworthRowSquares(sp->rowsC, root, lengths));
  if (sp->rowsD) {
    PetscCall(MatGetDiagonal(sp->rowsD, rows));
    PetscCall(VecAbs(rows));
    PetscCall(VecAXPY(lengths, 1.0, rows));
  }
  PetscCall(VecGetLocalSize(lengths, &m));
  PetscCall(VecGetArray(lengths, &t));
  for (PetscInt k = 0; k < m; k++) t[k] = PetscRealPart(t[k]) > 0.0 ? 1.0 / PetscSqrtReal(PetscRealPart(t[k])) : 0.0;
  PetscCall(VecRestoreArray(lengths, &t));
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsB, &M));
  PetscCall(MatMultTranspose(M, lengths, forces));
  PetscCall(MatDestroy(&M));
  PetscCall(VecDestroy(&root));
  PetscCall(VecDestroy(&rows));
  PetscCall(VecDestroy(&lengths));
  PetscFunctionReturn(PETSC_SUCCESS);
}
