#include "shared.h"
#include "../lists.h"
#include "../loops.h"
#include "../saddle/saddle.h"
#include <algorithm>
#include <vector>

/* An unknown is shared if it is in more than `many` rows, and in more than `unusual` times as many as unknowns of C are on average */
static const PetscReal many = 100.0;
/* for constraints of a volume, where all unknowns are in many rows, dropping some would not make S sparse */
static const PetscReal unusual = 10.0;

/*
   AinsworthSharedUnweigh - sets the weight of unknowns that many rows of C or B share to zero, so that the projection does not move them. Collective

   p rows that share an unknown would have p^2 entries in S. Q = I - W B' S^{-1} C remains a projection onto Ker C as long as the rows are independent in the
   other unknowns. If they are not, AinsworthProjectorDiagnose() finds dependent rows that are independent for W = I.
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

/* Finds the columns of the local rows that have no weight, ascending */
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

/* AinsworthSharedDrop - removes the columns without weight from the pattern of C W, and thereby from that of S */
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
