/* The magnitude of the terms of each row of both equations, to which its residual is compared */
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

/* AinsworthAbsoluteMultTranspose - computes y = |M|' |x|, entrywise, for an AIJ matrix */
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
   AinsworthTermsPrimal - computes the terms of each row of the first equation, |op(A)| |x| + |B|' |lambda| + |f|. Collective

   If rows are dependent, the rounding of a huge lambda that B' maps to nearly nothing would hide everything else: terms that cancel count at most `others`
   times the largest of the other terms.
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
  } else { /* a shell gives only products */
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
   Adds |D| |lambda| to terms, and computes slack = allowed D_ii^{1/2}, 0 if D couples the row to others, because what D leaves free moves x

   The rounding of a huge lambda that D maps to nearly nothing would hide everything else: terms that cancel count at most `others` times the largest of the
   other terms.
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
   AinsworthTermsDual - computes the terms of each row of the second equation, |C| |x| + |D| |lambda| + |g|, plus a part of the rounding that unknowns, unless
   known, receive from others. Collective

   slack: from AddCompliance(); NULL if no kept row has entries of D.
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
    const PetscReal k = PetscSqrtReal(PetscAbsScalar(d)); /* W moves a stiff unknown only as far as the energy of the others allows */

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
  if (!sp->D) PetscFunctionReturn(PETSC_SUCCESS); /* a D of decoupled rows alone gives no other row any slack */
  PetscCall(VecDuplicate(g, slack));
  PetscCall(AddCompliance(sp, allowed, y.dual, size, *slack));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the smallest nonzero entry of each column of a nonnegative M, ignoring rounded zeros; 0 for an empty column. least: laid out as the columns of M */
static PetscErrorCode LeastOfColumns(Mat M, Vec least)
{
  static const PetscReal rounding = 1e-12; /* relative to the largest entry; a lever arm, for example, is a difference of coordinates */
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
   AinsworthTermsStiffness - gets the stiffness of each unknown; borrowed, valid until the next set-up. Collective

   This is the diagonal of A or, where that is not positive, the largest entry of the row; 0 in zero rows.
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
   AinsworthTermsDisplacement - finds the largest |x_i| of unknowns with a stiffness, since others may have any unit; of all unknowns if that is 0. Collective

   root: the largest |x_i| d_i^{1/2}, the square root of its energy; may be NULL.
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

/*
   Computes the weight W = 1 / d_i, that of the stiffest unknown where d_i is 0, and the flexibility (C W C')_kk of A under each row of C

   springs: adds |D_kk| to the flexibility.
*/
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

/* AinsworthTermsSoftest - finds the largest D_kk relative to (C W C')_kk: how much further than A a spring moves under the same force. Collective */
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
    if (PetscRealPart(a) > 0.0) *softest = PetscMax(*softest, PetscAbsScalar(d) / PetscRealPart(a)); /* a zero row moves nothing */
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, softest, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)springs)));
  for (Vec *v : {&weight, &flexibility, &springs}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces v_k by 1 / v_k, or by 0 if v_k is 0 */
static PetscErrorCode Invert(Vec v)
{
  PetscFunctionBegin;
  PetscCall(AinsworthUpdate(v, [](PetscInt, PetscScalar &t) { t = PetscRealPart(t) > 0.0 ? 1.0 / PetscRealPart(t) : 0.0; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTermsThroughRows - finds the smallest |B_ki| t_k for each unknown i, the scale of a zero row of A. Collective

   t_k is the lambda_k whose energy, of A under C_k' and of D_kk, is the square of `energy`. terms: of each row of C, a bound on t_k D_kk; may be NULL.
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

/* AinsworthTermsRaise - raises the terms of each row of C to at least `little` times the largest of all, in the norm of diag(S)^{-1}. Collective */
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

/* AinsworthTermsSpread - replaces forces by |B|' diag(S)^{-1} |C| W forces, which is how their rounding spreads through the multipliers. Collective */
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
