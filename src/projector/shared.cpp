#include "shared.h"
#include "../saddle/saddle.h"
#include <algorithm>
#include <vector>

/* An unknown is shared where it is in more rows than this, and ... */
static const PetscReal many = 100.0;
/* ... in so many times more than the others on average: of constraints of a volume, all of whose unknowns are in many rows, S itself is sparser */
static const PetscReal unusual = 10.0;

/*
   AinsworthSharedUnweigh - sets the weight of unknowns to zero that many rows of C or B share: the projection does not move them

   p rows that share an unknown would have p^2 entries in S. Q = I - W B' S^{-1} C is a projection onto Ker C all the same, as long as the rows are
   independent in the unknowns that remain; where they are not, dependent rows are found that are not so for W = I (AinsworthProjectorDiagnose()).
*/
PetscErrorCode AinsworthSharedUnweigh(Mat C, Mat B, Vec weight, PetscBool *any)
{
  PetscInt           n;
  PetscReal          sums[2] = {0.0, 0.0}, bound, largest; /* sums: entries, and columns that have any */
  PetscScalar       *w;
  const PetscScalar *number;
  Vec                count, other;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(C, 0, &count));
  if (B != C) {
    PetscCall(AinsworthCountRows(B, 0, &other));
    PetscCall(VecAXPY(count, 1.0, other));
    PetscCall(VecDestroy(&other));
  }
  PetscCall(VecGetLocalSize(count, &n));
  PetscCall(VecGetArrayRead(count, &number));
  for (PetscInt j = 0; j < n; j++) {
    sums[0] += PetscRealPart(number[j]);
    sums[1] += number[j] != 0.0;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)C)));
  bound = PetscMax(many, unusual * sums[0] / PetscMax(sums[1], 1.0));
  PetscCall(VecGetArray(weight, &w));
  for (PetscInt j = 0; j < n; j++)
    if (PetscRealPart(number[j]) > bound) w[j] = 0.0;
  PetscCall(VecRestoreArray(weight, &w));
  PetscCall(VecRestoreArrayRead(count, &number));
  PetscCall(VecNorm(count, NORM_INFINITY, &largest));
  *any = (PetscBool)(largest > bound);
  if (*any)
    PetscCall(PetscInfo(C, "Unknowns that more than %g rows of C share, up to %g, have no weight, as the Gram matrix would be dense\n", (double)bound,
                        (double)largest));
  PetscCall(VecDestroy(&count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns of this rank's rows that have no weight, ascending */
static PetscErrorCode FindWeightless(Mat C, Vec weight, std::vector<PetscInt> &weightless)
{
  std::vector<PetscInt> columns;
  PetscInt              start, end;
  const PetscScalar    *w;
  IS                    from;
  Vec                   here;
  VecScatter            scatter;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(C, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscInt        ncols;
    const PetscInt *cols;

    PetscCall(MatGetRow(C, i, &ncols, &cols, NULL));
    columns.insert(columns.end(), cols, cols + ncols);
    PetscCall(MatRestoreRow(C, i, &ncols, &cols, NULL));
  }
  std::sort(columns.begin(), columns.end());
  columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, (PetscInt)columns.size(), columns.data(), PETSC_USE_POINTER, &from));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, (PetscInt)columns.size(), &here));
  PetscCall(VecScatterCreate(weight, from, here, NULL, &scatter));
  PetscCall(VecScatterBegin(scatter, weight, here, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, weight, here, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(here, &w));
  for (size_t k = 0; k < columns.size(); k++)
    if (w[k] == 0.0) weightless.push_back(columns[k]);
  PetscCall(VecRestoreArrayRead(here, &w));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(VecDestroy(&here));
  PetscCall(ISDestroy(&from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSharedDrop - takes the columns without weight out of the pattern of C W, and so out of that of S */
PetscErrorCode AinsworthSharedDrop(Vec weight, Mat *CW)
{
  std::vector<PetscInt>    weightless, offsets(1, 0), column;
  std::vector<PetscScalar> value;
  PetscInt                 start, end, m, n;
  Mat                      rest;

  PetscFunctionBegin;
  PetscCall(FindWeightless(*CW, weight, weightless));
  PetscCall(MatGetOwnershipRange(*CW, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscInt           ncols;
    const PetscInt    *cols;
    const PetscScalar *values;

    PetscCall(MatGetRow(*CW, i, &ncols, &cols, &values));
    for (PetscInt k = 0; k < ncols; k++) {
      if (std::binary_search(weightless.begin(), weightless.end(), cols[k])) continue;
      column.push_back(cols[k]);
      value.push_back(values[k]);
    }
    PetscCall(MatRestoreRow(*CW, i, &ncols, &cols, &values));
    offsets.push_back((PetscInt)column.size());
  }
  PetscCall(MatGetLocalSize(*CW, &m, &n));
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)*CW), m, n, offsets, column, value, &rest));
  PetscCall(MatDestroy(CW));
  *CW = rest;
  PetscFunctionReturn(PETSC_SUCCESS);
}
