#include "survey.h"
#include "../saddle/saddle.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include <algorithm>

/* Summarizes the signs and absolute values of the entries of a vector. Collective */
static PetscErrorCode SurveyVec(Vec v, AinsworthSurvey *survey)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)v);
  PetscInt start, place, count[3] = {0, 0, 0};
  Vec      sizes;

  PetscFunctionBegin;
  *survey = AinsworthSurvey();
  PetscCall(VecGetOwnershipRange(v, &start, NULL));
  PetscCall(VecDuplicate(v, &sizes));
  PetscCall(AinsworthUpdate(sizes, {v}, [&](PetscInt i, PetscScalar &size, PetscScalar a) {
    size = PetscAbsScalar(a) > 0.0 ? PetscAbsScalar(a) : 0.0;
    count[0] += PetscRealPart(a) > 0.0;
    count[1] += PetscRealPart(a) < 0.0;
    count[2] += a == 0.0;
    if (PetscRealPart(a) < 0.0 && survey->firstNegative < 0) survey->firstNegative = start + i;
    if (a == 0.0 && survey->firstZero < 0) survey->firstZero = start + i;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 3, MPIU_INT, MPI_SUM, comm));
  survey->positive = count[0];
  survey->negative = count[1];
  survey->zero     = count[2];
  PetscCall(VecMax(sizes, &place, &survey->most));
  if (survey->most > 0.0) {
    survey->mostRow = place;
    PetscCall(AinsworthUpdate(sizes, [](PetscInt, PetscScalar &size) { size = size == 0.0 ? PETSC_INFINITY : size; }));
    PetscCall(VecMin(sizes, &survey->leastRow, &survey->least));
  } else survey->most = 0.0;
  PetscCall(VecDestroy(&sizes));
  PetscCall(AinsworthAgreeOnFirst(comm, &survey->firstNegative));
  PetscCall(AinsworthAgreeOnFirst(comm, &survey->firstZero));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSurveyDiagonal(Mat M, AinsworthSurvey *survey)
{
  Vec diagonal;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateDiagonal(M, &diagonal));
  PetscCall(SurveyVec(diagonal, survey));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Summarizes the norms of the rows of an AIJ matrix, and finds the row with the most entries. Collective */
PetscErrorCode AinsworthSurveyRows(Mat M, AinsworthSurvey *norms, PetscInt *longest, PetscInt *row)
{
  Vec          sums;
  PetscScalar *length;
  PetscReal    most;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(M, NULL, &sums));
  PetscCall(AinsworthRowSums(M, 2, sums));
  PetscCall(VecSqrtAbs(sums));
  PetscCall(SurveyVec(sums, norms));
  PetscCall(VecGetArrayWrite(sums, &length));
  PetscCall(AinsworthForRows(M, [=](const AinsworthMatRow &r) { length[r.local] = (PetscReal)r.n; }));
  PetscCall(VecRestoreArrayWrite(sums, &length));
  PetscCall(VecMax(sums, row, &most));
  PetscCall(VecDestroy(&sums));
  *longest = (PetscInt)PetscMax(most, 0.0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the column with the most entries. Collective */
PetscErrorCode AinsworthSurveyColumns(Mat M, PetscInt *most, PetscInt *column)
{
  Vec       counts;
  PetscReal largest;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(M, 0, &counts));
  PetscCall(VecMax(counts, column, &largest));
  PetscCall(VecDestroy(&counts));
  *most = (PetscInt)PetscMax(largest, 0.0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts unknowns that are in no equation: their row of [A B'] is zero. Collective */
PetscErrorCode AinsworthSurveyLoose(Mat A, Mat B, PetscInt *loose, PetscInt *first)
{
  Vec             size, ones, held;
  AinsworthSurvey survey;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(A, &size, NULL));
  PetscCall(VecDuplicate(size, &held));
  PetscCall(AinsworthRowSums(A, 1, size));
  PetscCall(AinsworthCreateVecs(B, NULL, &ones));
  PetscCall(VecSet(ones, 1.0));
  PetscCall(AinsworthAbsoluteMultTranspose(B, ones, held));
  PetscCall(VecAXPY(held, 1.0, size));
  PetscCall(SurveyVec(held, &survey));
  *loose = survey.zero;
  *first = survey.firstZero;
  for (Vec *v : {&size, &held, &ones}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds the largest jump of the diagonal between unknowns coupled by an entry of A that matters for the smaller one.
   Collective

   bs: compares only unknowns of the same component.
*/
PetscErrorCode AinsworthSurveyJump(Mat A, PetscInt bs, AinsworthJump *jump)
{
  static const PetscReal felt = 1e-3;
  Mat                    part[2];
  Vec                    d[2] = {}, largest; /* diagonal entries of own columns, and of those of other ranks */
  const PetscInt        *ghosts;
  PetscInt               n, start, end;
  PetscScalar           *most;

  PetscFunctionBegin;
  *jump = AinsworthJump();
  PetscCall(AinsworthCreateDiagonal(A, &d[0]));
  PetscCall(VecAbs(d[0]));
  PetscCall(AinsworthAIJGetParts(A, part, &ghosts, &n));
  if (part[1]) PetscCall(AinsworthVecGather(d[0], n, ghosts, &d[1]));
  PetscCall(VecGetOwnershipRange(d[0], &start, &end));
  std::vector<PetscInt> cols(end - start, -1);

  PetscCall(VecDuplicate(d[0], &largest));
  PetscCall(VecGetArray(largest, &most));
  for (int p = 0; p < 2 && part[p]; p++) {
    const PetscScalar *own, *others;
    AinsworthCSR       csr;

    PetscCall(csr.open(part[p]));
    PetscCall(VecGetArrayRead(d[0], &own));
    PetscCall(VecGetArrayRead(d[p], &others));
    for (PetscInt r = 0; r < csr.n; r++) {
      for (PetscInt k = csr.ia[r]; k < csr.ia[r + 1]; k++) {
        const PetscInt  i = start + r, j = p ? ghosts[csr.ja[k]] : start + csr.ja[k];
        const PetscReal a = PetscRealPart(own[r]), b = PetscRealPart(others[csr.ja[k]]);
        const PetscReal low = PetscMin(a, b), high = PetscMax(a, b), known = PetscMax(1.0, PetscRealPart(most[r]));

        if (j == i || (j - i) % bs || low == 0.0 || high <= known * low) continue;
        if (PetscAbsScalar(csr.a[k]) < felt * low) continue;
        most[r] = high / low;
        cols[r] = j;
      }
    }
    PetscCall(VecRestoreArrayRead(d[p], &others));
    PetscCall(VecRestoreArrayRead(d[0], &own));
    PetscCall(csr.close());
  }
  PetscCall(VecRestoreArray(largest, &most));
  PetscCall(VecMax(largest, &jump->row, &jump->quotient));
  if (jump->row >= start && jump->row < end) jump->col = cols[jump->row - start];
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &jump->col, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)A)));
  for (Vec *v : {&d[0], &d[1], &largest}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the real part of y' z for two sparse rows with ascending columns */
static PetscReal Dot(PetscInt n, const PetscInt columns[], const PetscScalar y[], PetscInt m, const PetscInt others[],
                     const PetscScalar z[])
{
  PetscReal sum = 0.0;

  for (PetscInt i = 0, k = 0; i < n && k < m;) {
    if (columns[i] < others[k]) i++;
    else if (columns[i] > others[k]) k++;
    else sum += PetscRealPart(PetscConj(y[i++]) * z[k++]);
  }
  return sum;
}

/*
   AinsworthSurveyPenalty - tells whether A has penalty terms beta C'C for most rows of C. Collective

   If A is beta c c' on the p unknowns of a row c, and W = diag(A)^{-1}, then c'W A W c is p times c'W c; without such
   terms it is far smaller.
*/
PetscErrorCode AinsworthSurveyPenalty(Mat A, Mat C, PetscBool *penalty)
{
  static const PetscReal all  = 0.99;
  static const PetscInt  few  = 64;
  MPI_Comm               comm = PetscObjectComm((PetscObject)C);
  Mat                    rows, CW, CWA;
  Vec                    inverse;
  IS                     sample;
  PetscInt               found, start, end, count[2] = {0, 0}; /* rows examined, rows with a penalty */

  PetscFunctionBegin;
  PetscCall(AinsworthSampleRows(C, 2, few, 32, &sample, &found));
  PetscCall(MatCreateSubMatrix(C, sample, NULL, MAT_INITIAL_MATRIX, &rows));
  PetscCall(ISDestroy(&sample));
  PetscCall(AinsworthCreateDiagonal(A, &inverse));
  PetscCall(VecReciprocal(inverse)); /* 0 where the diagonal is 0 */
  PetscCall(AinsworthScaleColumns(rows, inverse, &CW));
  PetscCall(VecDestroy(&inverse));
  PetscCall(MatMatMult(CW, A, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &CWA));
  PetscCall(MatGetOwnershipRange(rows, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscInt           n, m;
    const PetscInt    *columns, *others;
    const PetscScalar *c, *w, *energy;

    PetscCall(MatGetRow(rows, i, &n, &columns, &c));
    PetscCall(MatGetRow(CW, i, NULL, NULL, &w)); /* has the same columns */
    PetscCall(MatGetRow(CWA, i, &m, &others, &energy));
    count[0]++;
    count[1] += Dot(n, columns, w, m, others, energy) > all * (PetscReal)n * Dot(n, columns, c, n, columns, w);
    PetscCall(MatRestoreRow(CWA, i, &m, &others, &energy));
    PetscCall(MatRestoreRow(CW, i, NULL, NULL, &w));
    PetscCall(MatRestoreRow(rows, i, &n, &columns, &c));
  }
  for (Mat *M : {&rows, &CW, &CWA}) PetscCall(MatDestroy(M));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, comm));
  *penalty = (PetscBool)(count[0] > 0 && 2 * count[1] > count[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}
