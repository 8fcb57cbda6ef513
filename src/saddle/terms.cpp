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

/*
   AinsworthTermsPrimal - |op(A)| |x| + |B|' |lambda| + |f|, what the terms of each row of the first equation amount to

   A huge lambda that B' takes to nearly nothing, where rows depend on others, would drown all else in its rounding: what cancels counts up to `others` times the
   largest of the other terms
*/
PetscErrorCode AinsworthTermsPrimal(const AinsworthSaddle *sp, PetscBool transpose, PetscReal others, Vec f, Vec x, Vec lambda, Vec Ax, Vec size)
{
  PetscReal largest;
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
  PetscCall(MatMultTranspose(M, absolute, part));
  PetscCall(VecDestroy(&absolute));
  if (others < PETSC_INFINITY) {
    PetscCall(VecNorm(size, NORM_INFINITY, &largest));
    PetscCall(VecDuplicate(size, &absolute));
    PetscCall(VecSet(absolute, others * largest));
    PetscCall(VecPointwiseMin(part, part, absolute));
    PetscCall(MatMultHermitianTranspose(sp->rowsB, lambda, absolute));
    PetscCall(VecAbs(absolute));
    PetscCall(VecPointwiseMax(part, part, absolute));
    PetscCall(VecDestroy(&absolute));
  }
  PetscCall(VecAXPY(size, 1.0, part));
  PetscCall(VecDestroy(&part));
  PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   terms += |D| |lambda|, and slack = allowed times the square root of D_ii, 0 where D couples the row to others: what D leaves free moves x

   sums: a huge lambda that D takes to nearly nothing would drown all else in its rounding; what cancels counts up to a part of the largest of the other terms
*/
static PetscErrorCode AddCompliance(const AinsworthSaddle *sp, PetscBool sums, PetscReal allowed, Vec lambda, Vec terms, Vec slack)
{
  static const PetscReal others = 1e-4;
  Mat                    M;
  Vec                    absolute, size;
  PetscReal              largest;
  PetscInt               m;
  PetscScalar           *s;
  const PetscScalar     *d;

  PetscFunctionBegin;
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsD, &M));
  PetscCall(AinsworthDuplicateAbs(lambda, &absolute));
  PetscCall(VecDuplicate(terms, &size));
  PetscCall(MatMult(M, absolute, size));
  PetscCall(VecDestroy(&absolute));
  if (sums) {
    PetscCall(VecNorm(terms, NORM_INFINITY, &largest));
    PetscCall(VecSet(slack, others * largest));
    PetscCall(VecPointwiseMin(size, size, slack));
    PetscCall(MatMult(sp->rowsD, lambda, slack));
    PetscCall(VecAbs(slack));
    PetscCall(VecPointwiseMax(size, size, slack));
  }
  PetscCall(VecAXPY(terms, 1.0, size));
  PetscCall(AinsworthRowSums(M, 1, slack));
  PetscCall(MatGetDiagonal(M, size));
  PetscCall(VecGetLocalSize(size, &m));
  PetscCall(VecGetArrayRead(size, &d));
  PetscCall(VecGetArray(slack, &s));
  for (PetscInt i = 0; i < m; i++) s[i] = PetscRealPart(s[i]) > PetscRealPart(d[i]) ? 0.0 : s[i];
  PetscCall(VecRestoreArray(slack, &s));
  PetscCall(VecRestoreArrayRead(size, &d));
  PetscCall(VecDestroy(&size));
  PetscCall(VecSqrtAbs(slack));
  PetscCall(VecScale(slack, allowed));
  PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTermsDual - the terms of each row of the second equation, |C| |x| + |D| |lambda| + |g|, and the rounding that it gets from others

   sums: what cancels in D lambda counts little; slack: what AddCompliance() allows, or NULL
*/
PetscErrorCode AinsworthTermsDual(AinsworthSaddle *sp, PetscBool sums, PetscReal allowed, Vec g, Vec x, Vec lambda, Vec size, Vec *slack)
{
  Vec                stiffness, absolute;
  PetscInt           n;
  PetscReal          largest, root;
  PetscScalar       *a;
  const PetscScalar *d;

  PetscFunctionBegin;
  if (!sp->absolute) PetscCall(AinsworthAbsoluteAIJ(sp->givenC, &sp->absolute));
  PetscCall(AinsworthTermsStiffness(sp, &stiffness));
  PetscCall(AinsworthTermsDisplacement(stiffness, x, &largest, &root));
  PetscCall(AinsworthDuplicateAbs(x, &absolute));
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArray(absolute, &a));
  PetscCall(VecGetArrayRead(stiffness, &d));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal k = PetscSqrtReal(PetscAbsScalar(d[i])); /* W moves a stiff unknown by as little as has the energy of the others */

    a[i] += AinsworthCombined / AinsworthConsistent * (k * largest > root ? root / k : largest);
  }
  PetscCall(VecRestoreArrayRead(stiffness, &d));
  PetscCall(VecRestoreArray(absolute, &a));
  PetscCall(MatMult(sp->absolute, absolute, size));
  PetscCall(VecDestroy(&absolute));
  PetscCall(AinsworthDuplicateAbs(g, &absolute));
  PetscCall(VecAXPY(size, 1.0, absolute));
  PetscCall(VecDestroy(&absolute));
  *slack = NULL;
  if (!sp->rowsD) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(g, slack));
  PetscCall(AddCompliance(sp, sums, allowed, lambda, size, *slack));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of each column of M the smallest entry, of those that are not zero; 0 where there is none. least: as the columns of M */
static PetscErrorCode LeastOfColumns(Mat M, Vec least)
{
  Mat          Mt;
  PetscInt     rstart, rend;
  PetscScalar *l;

  PetscFunctionBegin;
  PetscCall(MatTranspose(M, MAT_INITIAL_MATRIX, &Mt));
  PetscCall(MatGetOwnershipRange(Mt, &rstart, &rend));
  PetscCall(VecGetArrayWrite(least, &l));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt           n;
    const PetscScalar *v;
    PetscReal          smallest = 0.0;

    PetscCall(MatGetRow(Mt, i, &n, NULL, &v));
    for (PetscInt k = 0; k < n; k++)
      if (v[k] != 0.0 && (smallest == 0.0 || PetscRealPart(v[k]) < smallest)) smallest = PetscRealPart(v[k]);
    PetscCall(MatRestoreRow(Mt, i, &n, NULL, &v));
    l[i - rstart] = smallest;
  }
  PetscCall(VecRestoreArrayWrite(least, &l));
  PetscCall(MatDestroy(&Mt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTermsStiffness - how stiff each unknown is, borrowed until the next set-up

   Where the diagonal of A has a zero, or a negative entry, the largest of its row tells it; rows of zeros, without stiffness, have 0
*/
PetscErrorCode AinsworthTermsStiffness(const AinsworthSaddle *sp, Vec *stiffness)
{
  Mat          A;
  PetscInt     first, n;
  PetscBool    look = PETSC_FALSE, has;
  PetscScalar *d;

  PetscFunctionBegin;
  if (!sp->stiffness) {
    PetscCall(AinsworthCreateDiagonal(sp->block[0], &sp->stiffness));
    PetscCall(MatHasOperation(sp->block[0], MATOP_GET_ROW, &has));
    PetscCall(VecGetOwnershipRange(sp->stiffness, &first, NULL));
    PetscCall(VecGetLocalSize(sp->stiffness, &n));
    PetscCall(VecGetArray(sp->stiffness, &d));
    for (PetscInt i = 0; i < n && has; i++)
      if (!(PetscRealPart(d[i]) > 0.0)) look = PETSC_TRUE;
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &look, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)sp->stiffness)));
    if (look) PetscCall(AinsworthGetAIJ(sp->block[0], &A));
    for (PetscInt i = 0; i < n && look; i++) {
      PetscInt           entries;
      const PetscScalar *a;
      PetscReal          most = 0.0;

      if (PetscRealPart(d[i]) > 0.0) continue;
      PetscCall(MatGetRow(A, first + i, &entries, NULL, &a));
      for (PetscInt k = 0; k < entries; k++) most = PetscMax(most, PetscAbsScalar(a[k]));
      PetscCall(MatRestoreRow(A, first + i, &entries, NULL, &a));
      d[i] = most;
    }
    if (look) PetscCall(MatDestroy(&A));
    PetscCall(VecRestoreArray(sp->stiffness, &d));
  }
  *stiffness = sp->stiffness;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTermsDisplacement - the largest |x_i| of unknowns with a stiffness, of all where there is none: others may have any unit

   root: the largest |x_i| d_i^{1/2}, the root of its energy; may be NULL
*/
PetscErrorCode AinsworthTermsDisplacement(Vec stiffness, Vec x, PetscReal *displacement, PetscReal *root)
{
  PetscInt           n;
  PetscReal          most[2] = {0.0, 0.0};
  const PetscScalar *d, *v;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArrayRead(stiffness, &d));
  PetscCall(VecGetArrayRead(x, &v));
  for (PetscInt i = 0; i < n; i++) {
    if (d[i] == 0.0) continue;
    most[0] = PetscMax(most[0], PetscAbsScalar(v[i]));
    most[1] = PetscMax(most[1], PetscAbsScalar(v[i]) * PetscSqrtReal(PetscAbsScalar(d[i])));
  }
  PetscCall(VecRestoreArrayRead(x, &v));
  PetscCall(VecRestoreArrayRead(stiffness, &d));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, most, 2, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)x)));
  if (most[0] == 0.0) PetscCall(VecNorm(x, NORM_INFINITY, &most[0]));
  *displacement = most[0];
  if (root) *root = most[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* root: 1 / d_i^{1/2}, that of the stiffest where d_i is 0; flexibility: of each row of C, (C W C' - D)_kk */
static PetscErrorCode FlexibilityOfRows(const AinsworthSaddle *sp, Vec diagonal, Vec *root, Vec *flexibility)
{
  Vec          rows;
  PetscInt     n;
  PetscReal    stiffest;
  PetscScalar *r;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(diagonal, root));
  PetscCall(VecCopy(diagonal, *root));
  if (PetscDefined(USE_COMPLEX)) PetscCall(VecRealPart(*root));
  PetscCall(VecMax(*root, NULL, &stiffest));
  PetscCall(VecGetLocalSize(*root, &n));
  PetscCall(VecGetArray(*root, &r));
  for (PetscInt i = 0; i < n; i++) r[i] = 1.0 / PetscSqrtReal(PetscRealPart(r[i]) > 0.0 ? PetscRealPart(r[i]) : stiffest);
  PetscCall(VecRestoreArray(*root, &r));
  PetscCall(MatCreateVecs(sp->rowsC, NULL, flexibility));
  PetscCall(AinsworthRowSquares(sp->rowsC, *root, *flexibility));
  if (sp->rowsD) {
    PetscCall(VecDuplicate(*flexibility, &rows));
    PetscCall(MatGetDiagonal(sp->rowsD, rows));
    PetscCall(VecAbs(rows));
    PetscCall(VecAXPY(*flexibility, 1.0, rows));
    PetscCall(VecDestroy(&rows));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* v_k = 1 / v_k, 0 where that is 0 */
static PetscErrorCode Invert(Vec v)
{
  PetscInt     m;
  PetscScalar *t;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(v, &m));
  PetscCall(VecGetArray(v, &t));
  for (PetscInt k = 0; k < m; k++) t[k] = PetscRealPart(t[k]) > 0.0 ? 1.0 / PetscRealPart(t[k]) : 0.0;
  PetscCall(VecRestoreArray(v, &t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTermsThroughRows - the smallest |B_ki| t_k, with t_k the lambda_k whose energy, of A under C_k' or of D_kk, is the square of `energy`: the scale of a
   row of A that is zero. terms: of each row of C, or NULL; t_k D_kk is at most that
*/
PetscErrorCode AinsworthTermsThroughRows(const AinsworthSaddle *sp, Vec diagonal, PetscReal energy, Vec terms, Vec forces)
{
  Vec root, lengths, moved;
  Mat M;

  PetscFunctionBegin;
  PetscCall(FlexibilityOfRows(sp, diagonal, &root, &lengths));
  PetscCall(Invert(lengths));
  PetscCall(VecSqrtAbs(lengths));
  PetscCall(VecScale(lengths, energy));
  if (terms && sp->rowsD) {
    PetscInt           m;
    PetscScalar       *t;
    const PetscScalar *s, *d;

    PetscCall(VecDuplicate(lengths, &moved));
    PetscCall(MatGetDiagonal(sp->rowsD, moved));
    PetscCall(VecGetLocalSize(lengths, &m));
    PetscCall(VecGetArrayRead(moved, &d));
    PetscCall(VecGetArrayRead(terms, &s));
    PetscCall(VecGetArray(lengths, &t));
    for (PetscInt k = 0; k < m; k++)
      if (d[k] != 0.0) t[k] = PetscMin(PetscRealPart(t[k]), PetscRealPart(s[k]) / PetscAbsScalar(d[k]));
    PetscCall(VecRestoreArray(lengths, &t));
    PetscCall(VecRestoreArrayRead(terms, &s));
    PetscCall(VecRestoreArrayRead(moved, &d));
    PetscCall(VecDestroy(&moved));
  }
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsB, &M));
  PetscCall(MatDiagonalScale(M, lengths, NULL));
  PetscCall(LeastOfColumns(M, forces));
  PetscCall(MatDestroy(&M));
  PetscCall(VecDestroy(&root));
  PetscCall(VecDestroy(&lengths));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthTermsSpread - forces become |B|' |S|^{-1} |C| W forces, with the diagonal of S: what the rounding of forces does to each row by way of the multipliers */
PetscErrorCode AinsworthTermsSpread(const AinsworthSaddle *sp, Vec diagonal, Vec forces)
{
  Vec root, flexibility, moved;
  Mat M;

  PetscFunctionBegin;
  PetscCall(FlexibilityOfRows(sp, diagonal, &root, &flexibility));
  PetscCall(Invert(flexibility));
  PetscCall(VecDuplicate(flexibility, &moved));
  PetscCall(VecPointwiseMult(forces, forces, root));
  PetscCall(VecPointwiseMult(forces, forces, root));
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsC, &M));
  PetscCall(MatMult(M, forces, moved));
  PetscCall(MatDestroy(&M));
  PetscCall(VecPointwiseMult(moved, moved, flexibility));
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsB, &M));
  PetscCall(MatMultTranspose(M, moved, forces));
  PetscCall(MatDestroy(&M));
  for (Vec *v : {&root, &flexibility, &moved}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}
