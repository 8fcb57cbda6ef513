#include "survey.h"
#include "saddle.h"
#include "../base/loops.h"
#include <algorithm>

/* Finds the smallest (or largest) value of all ranks and its place; place is -1 if no rank has one. Collective */
static PetscErrorCode AgreeOnPlace(MPI_Comm comm, bool largest, PetscReal *value, PetscInt *place)
{
  PetscReal best = *place < 0 ? PETSC_MAX_REAL : largest ? -*value : *value, mine = best;
  PetscFunctionBegin;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &best, 1, MPIU_REAL, MPIU_MIN, comm));
  if (mine != best) *place = -1;
  PetscCall(AinsworthAgreeOnFirst(comm, place));
  *value = *place < 0 ? 0.0 : largest ? -best : best;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Summarizes the signs and absolute values of the entries of a vector. Collective */
static PetscErrorCode SurveyVec(Vec v, AinsworthSurvey *survey)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)v);
  PetscInt start, count[3] = {0, 0, 0};

  PetscFunctionBegin;
  *survey = AinsworthSurvey();
  PetscCall(VecGetOwnershipRange(v, &start, NULL));
  PetscCall(AinsworthForEntries({v}, [&](PetscInt i, PetscScalar a) {
    const PetscReal size = PetscAbsScalar(a);

    count[0] += PetscRealPart(a) > 0.0;
    count[1] += PetscRealPart(a) < 0.0;
    count[2] += size == 0.0;
    if (PetscRealPart(a) < 0.0 && survey->firstNegative < 0) survey->firstNegative = start + i;
    if (size == 0.0 && survey->firstZero < 0) survey->firstZero = start + i;
    if (!(size > 0.0)) return;
    if (survey->leastRow < 0 || size < survey->least) {
      survey->least    = size;
      survey->leastRow = start + i;
    }
    if (survey->mostRow < 0 || size > survey->most) {
      survey->most    = size;
      survey->mostRow = start + i;
    }
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 3, MPIU_INT, MPI_SUM, comm));
  survey->positive = count[0];
  survey->negative = count[1];
  survey->zero     = count[2];
  PetscCall(AgreeOnPlace(comm, false, &survey->least, &survey->leastRow));
  PetscCall(AgreeOnPlace(comm, true, &survey->most, &survey->mostRow));
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
  Vec       sums;
  PetscReal most = 0.0;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(M, NULL, &sums));
  PetscCall(AinsworthRowSums(M, 2, sums));
  PetscCall(VecSqrtAbs(sums));
  PetscCall(SurveyVec(sums, norms));
  PetscCall(VecDestroy(&sums));
  *row = -1;
  PetscCall(AinsworthForRows(M, [&](const AinsworthMatRow &r) {
    if (*row >= 0 && (PetscReal)r.n <= most) return;
    most = (PetscReal)r.n;
    *row = r.number;
  }));
  PetscCall(AgreeOnPlace(PetscObjectComm((PetscObject)M), true, &most, row));
  *longest = (PetscInt)most;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the column with the most entries. Collective */
PetscErrorCode AinsworthSurveyColumns(Mat M, PetscInt *most, PetscInt *column)
{
  Vec             counts;
  AinsworthSurvey survey;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(M, 0, &counts));
  PetscCall(SurveyVec(counts, &survey));
  PetscCall(VecDestroy(&counts));
  *most   = (PetscInt)survey.most;
  *column = survey.mostRow;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts unknowns that are in no equation: their row of [A B'] is zero. Collective */
PetscErrorCode AinsworthSurveyLoose(Mat A, Mat B, PetscInt *loose, PetscInt *first)
{
  Vec             size, ones, held;
  AinsworthSurvey survey;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(A, &size, NULL));
  PetscCall(VecDuplicate(size, &held));
  PetscCall(AinsworthRowSums(A, 1, size));
  PetscCall(MatCreateVecs(B, NULL, &ones));
  PetscCall(VecSet(ones, 1.0));
  PetscCall(AinsworthAbsoluteMultTranspose(B, ones, held));
  PetscCall(VecAXPY(held, 1.0, size));
  PetscCall(SurveyVec(held, &survey));
  *loose = survey.zero;
  *first = survey.firstZero;
  for (Vec *v : {&size, &held, &ones}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Absolute values of the local entries of a vector and of those in the off-process columns of a matrix, which are ascending */
namespace
{
struct Neighbors {
  PetscInt               start = 0, n = 0;
  const PetscInt        *ghosts = nullptr;
  std::vector<PetscReal> own, others;

  PetscErrorCode open(Mat M, Vec v);
  PetscReal      operator[](PetscInt column) const
  {
    if (column >= start && column < start + (PetscInt)own.size()) return own[column - start];
    return others[std::lower_bound(ghosts, ghosts + n, column) - ghosts];
  }
};

PetscErrorCode Neighbors::open(Mat M, Vec v)
{
  Vec ghosted;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(v, &start, NULL));
  PetscCall(AinsworthForEntries({v}, [this](PetscInt, PetscScalar a) { own.push_back(PetscAbsScalar(a)); }));
  PetscCall(MatGetGhosts(M, &n, &ghosts));
  PetscCall(AinsworthVecGather(v, n, ghosts, &ghosted));
  PetscCall(AinsworthForEntries({ghosted}, [this](PetscInt, PetscScalar a) { others.push_back(PetscAbsScalar(a)); }));
  PetscCall(VecDestroy(&ghosted));
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

/*
   Finds the largest jump of the diagonal between unknowns coupled by an entry of A that matters for the smaller one. Collective

   bs: compares only unknowns of the same component.
*/
PetscErrorCode AinsworthSurveyJump(Mat A, PetscInt bs, AinsworthJump *jump)
{
  static const PetscReal felt = 1e-3;
  Vec                    diagonal;
  Neighbors              d;
  PetscInt               mine;

  PetscFunctionBegin;
  *jump = AinsworthJump();
  PetscCall(AinsworthCreateDiagonal(A, &diagonal));
  PetscCall(d.open(A, diagonal));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(AinsworthForRows(A, [&](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n; k++) {
      const PetscInt  i = row.number, j = row.j[k];
      const PetscReal low = PetscMin(d[i], d[j]), high = PetscMax(d[i], d[j]);

      if (j == i || (j - i) % bs || low == 0.0 || PetscAbsScalar(row.a[k]) < felt * low || high <= jump->quotient * low) continue;
      *jump = {high / low, i, j};
    }
  }));
  mine = jump->row;
  PetscCall(AgreeOnPlace(PetscObjectComm((PetscObject)A), true, &jump->quotient, &jump->row));
  if (mine != jump->row) jump->col = -1;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &jump->col, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the real part of y' z for two sparse rows with ascending columns */
static PetscReal Dot(PetscInt n, const PetscInt columns[], const PetscScalar y[], PetscInt m, const PetscInt others[], const PetscScalar z[])
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

   If A is beta c c' on the p unknowns of a row c, and W = diag(A)^{-1}, then c'W A W c is p times c'W c; without such terms it is far smaller.
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
