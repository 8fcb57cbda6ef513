#include "compliance.h"
#include "../saddle/saddle.h"

/* sums_i = sum_j |C_ij|^2 w_j^2 / d_j, w the weight (NULL: 1) and d = diag(A)^{-1}: the flexibility of A under the force C_i' */
static PetscErrorCode RowFlexibility(Mat C, Vec weight, Vec inverseDiagonal, Vec sums)
{
  Vec root;
  Mat scaled;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(inverseDiagonal, &root));
  PetscCall(VecCopy(inverseDiagonal, root));
  PetscCall(VecSqrtAbs(root));
  PetscCall(VecReciprocal(root));
  if (weight) PetscCall(VecPointwiseMult(root, root, weight));
  PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &scaled));
  PetscCall(MatDiagonalScale(scaled, NULL, root));
  PetscCall(AinsworthRowSums(scaled, 2, sums));
  PetscCall(MatDestroy(&scaled));
  PetscCall(VecDestroy(&root));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of each row of C W B' the sign of its diagonal entry */
static PetscErrorCode DiagonalSigns(Mat C, Mat B, Vec weight, PetscReal signs[])
{
  PetscInt rstart, rend;
  Mat      BW = B;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(C, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) signs[i - rstart] = 1.0;
  if (B == C) PetscFunctionReturn(PETSC_SUCCESS);
  if (weight) {
    PetscCall(MatDuplicate(B, MAT_COPY_VALUES, &BW));
    PetscCall(MatDiagonalScale(BW, NULL, weight));
  }
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt           n[2];
    const PetscInt    *col[2];
    const PetscScalar *v[2];
    PetscScalar        dot = 0.0;

    PetscCall(MatGetRow(C, i, &n[0], &col[0], &v[0]));
    PetscCall(MatGetRow(BW, i, &n[1], &col[1], &v[1]));
    for (PetscInt a = 0, b = 0; a < n[0] && b < n[1];) {
      if (col[0][a] == col[1][b]) dot += v[0][a++] * PetscConj(v[1][b++]);
      else if (col[0][a] < col[1][b]) a++;
      else b++;
    }
    PetscCall(MatRestoreRow(BW, i, &n[1], &col[1], &v[1]));
    PetscCall(MatRestoreRow(C, i, &n[0], &col[0], &v[0]));
    if (PetscRealPart(dot) < 0.0) signs[i - rstart] = -1.0;
  }
  if (weight) PetscCall(MatDestroy(&BW));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   G: (D_ii / flexibility_i)^{1/2} where D has no other entry in the row, with the sign that adds N to the diagonal of C W B'; of rows that D couples all have
   the same, the mean of their decades, so that N and E are as symmetric as D
*/
static PetscErrorCode SetRatios(AinsworthCompliance *c, Mat C, Mat B, Mat D, Vec weight)
{
  PetscInt           rstart, rend;
  PetscReal         *signs, mean[2] = {0.0, 0.0};
  PetscBool         *coupled;
  PetscScalar       *g, *rest, *soft, *together, *sums;
  const PetscScalar *flexibility;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(D, &rstart, &rend));
  PetscCall(PetscMalloc2(rend - rstart, &signs, rend - rstart, &coupled));
  PetscCall(DiagonalSigns(C, B, weight, signs));
  PetscCall(VecGetArrayWrite(c->ratio, &g));
  PetscCall(VecGetArrayWrite(c->rest, &rest));
  PetscCall(VecGetArrayWrite(c->soft, &soft));
  PetscCall(VecGetArrayWrite(c->together, &together));
  PetscCall(VecGetArray(c->sums, &sums));
  PetscCall(VecGetArrayRead(c->flexibility, &flexibility));
  for (PetscInt i = rstart; i < rend; i++) {
    const PetscInt     k     = i - rstart;
    const PetscReal    total = PetscRealPart(sums[k]), met = PetscRealPart(flexibility[k]);
    PetscInt           n;
    const PetscInt    *col;
    const PetscScalar *v;
    PetscReal          diagonal = 0.0;

    coupled[k] = PETSC_FALSE;
    PetscCall(MatGetRow(D, i, &n, &col, &v));
    for (PetscInt a = 0; a < n; a++) {
      if (col[a] == i) diagonal = PetscRealPart(v[a]);
      else if (v[a] != 0.0) coupled[k] = PETSC_TRUE;
    }
    PetscCall(MatRestoreRow(D, i, &n, &col, &v));
    g[k]    = 1.0;
    rest[k] = total == 0.0 ? met : 0.0;
    if (coupled[k] && met > 0.0) {
      mean[0] += PetscLogReal(PetscSqrtReal(total) / PetscSqrtReal(met));
      mean[1] += 1.0;
    } else if (!coupled[k] && total > 0.0 && met > 0.0) g[k] = (diagonal < 0.0 ? -signs[k] : signs[k]) * PetscSqrtReal(total) / PetscSqrtReal(met);
    soft[k] = !coupled[k] && total > met ? 1.0 / g[k] : 0.0;
    if (diagonal < 0.0) sums[k] = -sums[k];
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, mean, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)D)));
  for (PetscInt k = 0; k < rend - rstart; k++)
    if (coupled[k] && mean[1] > 0.0) g[k] = PetscExpReal(mean[0] / mean[1]);
  for (PetscInt k = 0; k < rend - rstart; k++) together[k] = coupled[k] && PetscRealPart(g[k]) > 1.0 ? 1.0 / g[k] : 0.0;
  PetscCall(VecRestoreArrayWrite(c->together, &together));
  PetscCall(VecRestoreArrayRead(c->flexibility, &flexibility));
  PetscCall(VecRestoreArray(c->sums, &sums));
  PetscCall(VecRestoreArrayWrite(c->soft, &soft));
  PetscCall(VecRestoreArrayWrite(c->rest, &rest));
  PetscCall(VecRestoreArrayWrite(c->ratio, &g));
  PetscCall(PetscFree2(signs, coupled));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthComplianceSetUp - G, N and E; C, B: m x n; D: m x m, laid out as the rows of C */
PetscErrorCode AinsworthComplianceSetUp(AinsworthCompliance *c, Mat C, Mat B, Mat D, Vec weight, Vec inverseDiagonal)
{
  Vec inverse, other;

  PetscFunctionBegin;
  PetscCall(AinsworthComplianceReset(c));
  if (!D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateVecs(C, NULL, &c->ratio));
  for (Vec *v : {&c->flexibility, &c->sums, &c->rest, &c->soft, &c->together, &inverse}) PetscCall(VecDuplicate(c->ratio, v));
  PetscCall(RowFlexibility(C, weight, inverseDiagonal, c->flexibility));
  if (B != C) { /* the geometric mean of both sides */
    PetscCall(VecDuplicate(c->flexibility, &other));
    PetscCall(RowFlexibility(B, weight, inverseDiagonal, other));
    for (Vec v : {other, c->flexibility}) PetscCall(VecSqrtAbs(v));
    PetscCall(VecPointwiseMult(c->flexibility, c->flexibility, other));
    PetscCall(VecDestroy(&other));
  }
  PetscCall(AinsworthRowSums(D, 1, c->sums));
  PetscCall(SetRatios(c, C, B, D, weight));
  PetscCall(VecCopy(c->ratio, inverse));
  PetscCall(VecReciprocal(inverse));
  PetscCall(MatDuplicate(D, MAT_COPY_VALUES, &c->N));
  PetscCall(MatDiagonalScale(c->N, NULL, inverse));
  PetscCall(MatDuplicate(c->N, MAT_COPY_VALUES, &c->E));
  PetscCall(MatDiagonalScale(c->E, inverse, NULL));
  PetscCall(VecDestroy(&inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthComplianceGetPreconditioner - of M_*^+ = [A 0; 0 E] + [C -N]' B [C -N] with E and N lumped: shared = N B / F, inverse = 1 / F, F = E + N^2 B

   penalty: B, where D_ii < 0 it does not count.
*/
PetscErrorCode AinsworthComplianceGetPreconditioner(const AinsworthCompliance *c, Vec penalty, Vec shared, Vec inverse)
{
  Vec                N, E;
  PetscInt           n;
  PetscScalar       *s, *f;
  const PetscScalar *a, *e, *b, *sums, *rest;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(penalty, &N));
  PetscCall(VecDuplicate(penalty, &E));
  PetscCall(AinsworthRowSums(c->N, 1, N));
  PetscCall(AinsworthRowSums(c->E, 1, E));
  PetscCall(VecGetLocalSize(penalty, &n));
  PetscCall(VecGetArrayRead(N, &a));
  PetscCall(VecGetArrayRead(E, &e));
  PetscCall(VecGetArrayRead(penalty, &b));
  PetscCall(VecGetArrayRead(c->sums, &sums));
  PetscCall(VecGetArrayRead(c->rest, &rest));
  PetscCall(VecGetArrayWrite(shared, &s));
  PetscCall(VecGetArrayWrite(inverse, &f));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal B = PetscRealPart(sums[i]) > 0.0 ? PetscRealPart(b[i]) : 0.0, Ni = PetscRealPart(a[i]);
    const PetscReal F = PetscRealPart(e[i]) + PetscRealPart(rest[i]) + (B > 0.0 ? Ni * Ni * B : 0.0);

    f[i] = F > 0.0 ? 1.0 / F : 0.0;
    s[i] = F > 0.0 && B > 0.0 ? Ni / F * B : 0.0;
  }
  PetscCall(VecRestoreArrayWrite(inverse, &f));
  PetscCall(VecRestoreArrayWrite(shared, &s));
  PetscCall(VecRestoreArrayRead(c->rest, &rest));
  PetscCall(VecRestoreArrayRead(c->sums, &sums));
  PetscCall(VecRestoreArrayRead(penalty, &b));
  PetscCall(VecRestoreArrayRead(E, &e));
  PetscCall(VecRestoreArrayRead(N, &a));
  PetscCall(VecDestroy(&N));
  PetscCall(VecDestroy(&E));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthComplianceReset(AinsworthCompliance *c)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&c->N));
  PetscCall(MatDestroy(&c->E));
  for (Vec *v : {&c->ratio, &c->flexibility, &c->sums, &c->rest, &c->soft, &c->together}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}
