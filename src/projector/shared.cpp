#include "shared.h"
#include "../lists.h"
#include "../loops.h"
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
  PetscReal sums[2] = {0.0, 0.0}, bound, largest; /* sums: entries, and columns that have any */
  Vec       count, other;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(C, 0, &count));
  if (B != C) {
    PetscCall(AinsworthCountRows(B, 0, &other));
    PetscCall(VecAXPY(count, 1.0, other));
    PetscCall(VecDestroy(&other));
  }
  PetscCall(AinsworthForEntries({count}, [&](PetscInt, PetscScalar number) {
    sums[0] += PetscRealPart(number);
    sums[1] += number != 0.0;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)C)));
  bound = PetscMax(many, unusual * sums[0] / PetscMax(sums[1], 1.0));
  PetscCall(AinsworthUpdate(weight, {count}, [=](PetscInt, PetscScalar &w, PetscScalar number) {
    if (PetscRealPart(number) > bound) w = 0.0;
  }));
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
  Vec                   here;

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) { columns.insert(columns.end(), row.j, row.j + row.n); }));
  AinsworthSortUnique(&columns);
  PetscCall(AinsworthVecGather(weight, (PetscInt)columns.size(), columns.data(), &here));
  PetscCall(AinsworthForEntries({here}, [&](PetscInt k, PetscScalar w) {
    if (w == 0.0) weightless.push_back(columns[k]);
  }));
  PetscCall(VecDestroy(&here));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSharedDrop - takes the columns without weight out of the pattern of C W, and so out of that of S */
PetscErrorCode AinsworthSharedDrop(Vec weight, Mat *CW)
{
  std::vector<PetscInt> weightless;
  AinsworthEntries      kept;
  PetscInt              n;
  Mat                   rest;

  PetscFunctionBegin;
  PetscCall(FindWeightless(*CW, weight, weightless));
  PetscCall(AinsworthForRows(*CW, [&](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n; k++)
      if (!std::binary_search(weightless.begin(), weightless.end(), row.j[k])) kept.add(row.j[k], row.a[k]);
    kept.endRow();
  }));
  PetscCall(MatGetLocalSize(*CW, NULL, &n));
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)*CW), n, kept, &rest));
  PetscCall(MatDestroy(CW));
  *CW = rest;
  PetscFunctionReturn(PETSC_SUCCESS);
}
