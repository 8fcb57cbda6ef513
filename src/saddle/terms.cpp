/* What the terms of the rows of both equations amount to: the measure of their residuals */
#include "terms.h"
#include "../loops.h"
#include "../objects.h"

PetscErrorCode AinsworthDuplicateAbs(Vec x, Vec *absolute)
{
  PetscFunctionBegin;
  PetscCall(AinsworthVecClone(x, absolute));
  PetscCall(VecAbs(*absolute));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthAbsoluteMultTranspose - y = |M|' |x|, entry by entry, of an AIJ */
PetscErrorCode AinsworthAbsoluteMultTranspose(Mat M, Vec x, Vec y)
{
  Mat entries;
  Vec sizes;

  PetscFunctionBegin;
  PetscCall(AinsworthAbsoluteAIJ(M, &entries));
  PetscCall(AinsworthDuplicateAbs(x, &sizes));
  PetscCall(MatMultTranspose(entries, sizes, y));
  PetscCall(VecDestroy(&sizes));
  PetscCall(MatDestroy(&entries));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTermsPrimal - |op(A)| |x| + |B|' |lambda| + |f|, what the terms of each row of the first equation amount to

   A huge lambda that B' takes to nearly nothing, where rows depend on others, would drown all else in its rounding: what cancels counts up to `others` times the
   largest of the other terms
*/
PetscErrorCode AinsworthTermsPrimal(const AinsworthSaddle *sp, PetscBool transpose, PetscReal others, Vec f, AinsworthSaddleVec y, Vec Ax, Vec size)
{
  PetscReal largest;
  Vec       absolute, part;
  Mat       A;
  PetscBool rows;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(sp->block[0], MATOP_GET_ROW, &rows));
  if (rows) {
    PetscCall(AinsworthGetAIJ(sp->block[0], &A));
    PetscCall((transpose ? AinsworthAbsoluteMultTranspose : AinsworthAbsoluteMult)(A, y.primal, size));
    PetscCall(MatDestroy(&A));
  } else { /* a shell tells its products only */
    PetscCall(VecCopy(Ax, size));
    PetscCall(VecAbs(size));
  }
  PetscCall(AinsworthDuplicateAbs(f, &part));
  PetscCall(VecAXPY(size, 1.0, part));
  PetscCall(AinsworthAbsoluteMultTranspose(sp->rowsB, y.dual, part));
  if (others < PETSC_INFINITY) {
    PetscCall(VecNorm(size, NORM_INFINITY, &largest));
    PetscCall(VecDuplicate(size, &absolute));
    PetscCall(VecSet(absolute, others * largest));
    PetscCall(VecPointwiseMin(part, part, absolute));
    PetscCall(MatMultHermitianTranspose(sp->rowsB, y.dual, absolute));
    PetscCall(VecAbs(absolute));
    PetscCall(VecPointwiseMax(part, part, absolute));
    PetscCall(VecDestroy(&absolute));
  }
  PetscCall(VecAXPY(size, 1.0, part));
  PetscCall(VecDestroy(&part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   terms += |D| |lambda|, and slack = allowed times the square root of D_ii, 0 where D couples the row to others: what D leaves free moves x

   A huge lambda that D takes to nearly nothing would drown all else in its rounding: what cancels counts up to a part of the largest of the other terms
*/
static PetscErrorCode AddCompliance(const AinsworthSaddle *sp, PetscReal allowed, Vec lambda, Vec terms, Vec slack)
{
  static const PetscReal others = 1e-4;
  Vec                    size;
  PetscReal              largest;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(terms, &size));
  PetscCall(AinsworthAbsoluteMult(sp->rowsD, lambda, size));
  PetscCall(VecNorm(terms, NORM_INFINITY, &largest));
  PetscCall(VecSet(slack, others * largest));
  PetscCall(VecPointwiseMin(size, size, slack));
  PetscCall(MatMult(sp->rowsD, lambda, slack));
  PetscCall(VecAbs(slack));
  PetscCall(VecPointwiseMax(size, size, slack));
  PetscCall(VecAXPY(terms, 1.0, size));
  PetscCall(AinsworthRowSums(sp->rowsD, 1, slack));
  PetscCall(MatGetDiagonal(sp->rowsD, size));
  PetscCall(AinsworthUpdate(slack, {size}, [](PetscInt, PetscScalar &s, PetscScalar d) { s = PetscRealPart(s) > PetscAbsScalar(d) ? 0.0 : s; }));
  PetscCall(VecDestroy(&size));
  PetscCall(VecSqrtAbs(slack));
  PetscCall(VecScale(slack, allowed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTermsDual - the terms of each row of the second equation, |C| |x| + |D| |lambda| + |g|, and a part of the rounding that unknowns get from others,
   unless they are known

   slack: what AddCompliance() allows, or NULL
*/
PetscErrorCode AinsworthTermsDual(AinsworthSaddle *sp, PetscReal part, PetscReal allowed, Vec g, AinsworthSaddleVec y, Vec size, Vec *slack)
{
  Vec       stiffness, absolute;
  PetscReal largest, root;

  PetscFunctionBegin;
  if (!sp->absolute) PetscCall(AinsworthAbsoluteAIJ(sp->givenC, &sp->absolute));
  PetscCall(AinsworthTermsStiffness(sp, &stiffness));
  PetscCall(AinsworthTermsDisplacement(stiffness, y.primal, &largest, &root));
  PetscCall(AinsworthDuplicateAbs(y.primal, &absolute));
  auto add = [=](PetscInt, PetscScalar &a, PetscScalar d, PetscScalar known) {
    const PetscReal k = PetscSqrtReal(PetscAbsScalar(d)); /* W moves a stiff unknown by as little as has the energy of the others */

    if (known == 0.0) a += part * AinsworthCombined / AinsworthConsistent * (k * largest > root ? root / k : largest);
  };
  if (sp->known) PetscCall(AinsworthUpdate(absolute, {stiffness, sp->known}, add));
  else PetscCall(AinsworthUpdate(absolute, {stiffness}, [=](PetscInt i, PetscScalar &a, PetscScalar d) { add(i, a, d, 0.0); }));
  PetscCall(MatMult(sp->absolute, absolute, size));
  PetscCall(VecDestroy(&absolute));
  PetscCall(AinsworthDuplicateAbs(g, &absolute));
  PetscCall(VecAXPY(size, 1.0, absolute));
  PetscCall(VecDestroy(&absolute));
  *slack = NULL;
  if (!sp->rowsD) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(g, slack));
  PetscCall(AddCompliance(sp, allowed, y.dual, size, *slack));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of each column of M the smallest entry that is not zero, or the rounding of one; 0 where there is none. M has none below 0. least: as the columns of M */
static PetscErrorCode LeastOfColumns(Mat M, Vec least)
{
  static const PetscReal rounding = 1e-12; /* relative to the largest: a lever arm, as the difference of coordinates */
  Mat                    Mt;
  PetscScalar           *l;

  PetscFunctionBegin;
  PetscCall(MatTranspose(M, MAT_INITIAL_MATRIX, &Mt));
  PetscCall(VecGetArrayWrite(least, &l));
  PetscCall(AinsworthForRows(Mt, [l](const AinsworthMatRow &row) {
    PetscReal largest = 0.0, smallest;

    for (PetscInt k = 0; k < row.n; k++) largest = PetscMax(largest, PetscRealPart(row.a[k]));
    smallest = largest;
    for (PetscInt k = 0; k < row.n; k++)
      if (PetscRealPart(row.a[k]) > rounding * largest) smallest = PetscMin(smallest, PetscRealPart(row.a[k]));
    l[row.local] = smallest;
  }));
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
  PetscBool    look = PETSC_FALSE, has;
  PetscScalar *d;

  PetscFunctionBegin;
  *stiffness = sp->stiffness;
  if (sp->stiffness) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateDiagonal(sp->block[0], &sp->stiffness));
  *stiffness = sp->stiffness;
  PetscCall(MatHasOperation(sp->block[0], MATOP_GET_ROW, &has));
  PetscCall(AinsworthForEntries({sp->stiffness}, [&](PetscInt, PetscScalar d) {
    if (has && !(PetscRealPart(d) > 0.0)) look = PETSC_TRUE;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &look, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)sp->stiffness)));
  if (!look) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(sp->block[0], &A));
  PetscCall(VecGetArray(sp->stiffness, &d));
  PetscCall(AinsworthForRows(A, [d](const AinsworthMatRow &row) {
    PetscReal most = 0.0;

    for (PetscInt k = 0; k < row.n; k++) most = PetscMax(most, PetscAbsScalar(row.a[k]));
    if (!(PetscRealPart(d[row.local]) > 0.0)) d[row.local] = most;
  }));
  PetscCall(VecRestoreArray(sp->stiffness, &d));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTermsDisplacement - the largest |x_i| of unknowns with a stiffness, of all where there is none: others may have any unit

   root: the largest |x_i| d_i^{1/2}, the root of its energy; may be NULL
*/
PetscErrorCode AinsworthTermsDisplacement(Vec stiffness, Vec x, PetscReal *displacement, PetscReal *root)
{
  PetscReal most[2] = {0.0, 0.0};

  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({stiffness, x}, [&](PetscInt, PetscScalar d, PetscScalar v) {
    if (d == 0.0) return;
    most[0] = PetscMax(most[0], PetscAbsScalar(v));
    most[1] = PetscMax(most[1], PetscAbsScalar(v) * PetscSqrtReal(PetscAbsScalar(d)));
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, most, 2, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)x)));
  if (most[0] == 0.0) PetscCall(VecNorm(x, NORM_INFINITY, &most[0]));
  *displacement = most[0];
  if (root) *root = most[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* weight W: 1 / d_i, that of the stiffest where d_i is 0; flexibility: of A under each row of C, (C W C')_kk, and with springs that of D, |D_kk|, added */
static PetscErrorCode Flexibility(const AinsworthSaddle *sp, Vec diagonal, bool springs, Vec *weight, Vec *flexibility)
{
  PetscReal stiffest;
  Vec       rows;

  PetscFunctionBegin;
  PetscCall(AinsworthVecClone(diagonal, weight));
  if (PetscDefined(USE_COMPLEX)) PetscCall(VecRealPart(*weight));
  PetscCall(VecMax(*weight, NULL, &stiffest));
  PetscCall(AinsworthUpdate(*weight, [=](PetscInt, PetscScalar &w) { w = 1.0 / (PetscRealPart(w) > 0.0 ? PetscRealPart(w) : stiffest); }));
  PetscCall(MatCreateVecs(sp->rowsC, NULL, flexibility));
  PetscCall(AinsworthRowSquares(sp->rowsC, *weight, *flexibility));
  if (!springs || !sp->rowsD) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(*flexibility, &rows));
  PetscCall(MatGetDiagonal(sp->rowsD, rows));
  PetscCall(VecAbs(rows));
  PetscCall(VecAXPY(*flexibility, 1.0, rows));
  PetscCall(VecDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthTermsSoftest - the largest D_kk relative to (C W C')_kk: how much further than A a spring lets the same force move something */
PetscErrorCode AinsworthTermsSoftest(const AinsworthSaddle *sp, PetscReal *softest)
{
  Vec stiffness, weight, flexibility, springs;

  PetscFunctionBegin;
  *softest = 0.0;
  if (!sp->rowsD) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthTermsStiffness(sp, &stiffness));
  PetscCall(Flexibility(sp, stiffness, false, &weight, &flexibility));
  PetscCall(VecDuplicate(flexibility, &springs));
  PetscCall(MatGetDiagonal(sp->rowsD, springs));
  PetscCall(AinsworthForEntries({springs, flexibility}, [=](PetscInt, PetscScalar d, PetscScalar a) {
    if (PetscRealPart(a) > 0.0) *softest = PetscMax(*softest, PetscAbsScalar(d) / PetscRealPart(a)); /* a row of zeros moves nothing */
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, softest, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)springs)));
  for (Vec *v : {&weight, &flexibility, &springs}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* v_k = 1 / v_k, 0 where that is 0 */
static PetscErrorCode Invert(Vec v)
{
  PetscFunctionBegin;
  PetscCall(AinsworthUpdate(v, [](PetscInt, PetscScalar &t) { t = PetscRealPart(t) > 0.0 ? 1.0 / PetscRealPart(t) : 0.0; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTermsThroughRows - the smallest |B_ki| t_k, with t_k the lambda_k whose energy, of A under C_k' or of D_kk, is the square of `energy`: the scale of a
   row of A that is zero. terms: of each row of C, or NULL; t_k D_kk is at most that
*/
PetscErrorCode AinsworthTermsThroughRows(const AinsworthSaddle *sp, Vec diagonal, PetscReal energy, Vec terms, Vec forces)
{
  Vec weight, lengths, moved;
  Mat M;

  PetscFunctionBegin;
  PetscCall(Flexibility(sp, diagonal, true, &weight, &lengths));
  PetscCall(Invert(lengths));
  PetscCall(VecSqrtAbs(lengths));
  PetscCall(VecScale(lengths, energy));
  if (terms && sp->rowsD) {
    PetscCall(VecDuplicate(lengths, &moved));
    PetscCall(MatGetDiagonal(sp->rowsD, moved));
    PetscCall(AinsworthUpdate(lengths, {moved, terms}, [](PetscInt, PetscScalar &t, PetscScalar d, PetscScalar s) {
      if (d != 0.0) t = PetscMin(PetscRealPart(t), PetscRealPart(s) / PetscAbsScalar(d));
    }));
    PetscCall(VecDestroy(&moved));
  }
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsB, &M));
  PetscCall(MatDiagonalScale(M, lengths, NULL));
  PetscCall(LeastOfColumns(M, forces));
  PetscCall(MatDestroy(&M));
  for (Vec *v : {&weight, &lengths}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthTermsRaise - the terms of each row of C become at least `little` of the largest of all, in the norm of diag(S)^{-1} */
PetscErrorCode AinsworthTermsRaise(const AinsworthSaddle *sp, Vec diagonal, PetscReal little, Vec terms)
{
  PetscReal most = 0.0;
  Vec       weight, flexibility;

  PetscFunctionBegin;
  PetscCall(Flexibility(sp, diagonal, true, &weight, &flexibility));
  PetscCall(VecSqrtAbs(flexibility));
  PetscCall(AinsworthForEntries({terms, flexibility}, [&](PetscInt, PetscScalar t, PetscScalar s) {
    if (PetscRealPart(s) > 0.0) most = PetscMax(most, PetscRealPart(t) / PetscRealPart(s));
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)terms)));
  PetscCall(
    AinsworthUpdate(terms, {flexibility}, [=](PetscInt, PetscScalar &t, PetscScalar s) { t = PetscMax(PetscRealPart(t), little * most * PetscRealPart(s)); }));
  for (Vec *v : {&weight, &flexibility}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthTermsSpread - forces become |B|' |S|^{-1} |C| W forces, with the diagonal of S: what the rounding of forces does to each row by way of the multipliers */
PetscErrorCode AinsworthTermsSpread(const AinsworthSaddle *sp, Vec diagonal, Vec forces)
{
  Vec weight, flexibility, moved;

  PetscFunctionBegin;
  PetscCall(Flexibility(sp, diagonal, true, &weight, &flexibility));
  PetscCall(Invert(flexibility));
  PetscCall(VecDuplicate(flexibility, &moved));
  PetscCall(VecPointwiseMult(forces, forces, weight));
  PetscCall(AinsworthAbsoluteMult(sp->rowsC, forces, moved));
  PetscCall(VecPointwiseMult(moved, moved, flexibility));
  PetscCall(AinsworthAbsoluteMultTranspose(sp->rowsB, moved, forces));
  for (Vec *v : {&weight, &flexibility, &moved}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}
