#include "shared.h"
#include "../base/columns.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../saddle/saddle.h"
#include <algorithm>
#include <vector>

/*
   An unknown is shared if it is in more than `sharedRows` rows, and in more than `sharedRatio` times as many as
   unknowns of C are on average
*/
static const PetscReal sharedRows = 100.0;
/* for constraints of a volume, where all unknowns are in many rows, dropping some would not make S sparse */
static const PetscReal sharedRatio = 10.0;

/*
   Sets keeps_j = 1 for the unknowns of rows of M that would have none with a weight left, by the pattern, as the
   symbolic results depend on it. Collective
*/
static PetscErrorCode KeepLast(Mat M, Vec left, Vec keeps)
{
  std::vector<PetscInt>    columns;
  std::vector<PetscScalar> ones;
  AinsworthAtColumns       at;

  PetscFunctionBegin;
  PetscCall(at.create(M, left));
  PetscCall(AinsworthForRows(M, [&](const AinsworthMatRow &row) {
    if (std::all_of(row.j, row.j + row.n, [&](PetscInt j) { return at(j) == 0.0; }))
      columns.insert(columns.end(), row.j, row.j + row.n);
  }));
  ones.assign(columns.size(), 1.0);
  PetscCall(VecSetValues(keeps, (PetscInt)columns.size(), columns.data(), ones.data(), INSERT_VALUES));
  PetscCall(VecAssemblyBegin(keeps));
  PetscCall(VecAssemblyEnd(keeps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets the weight of unknowns with more than `bound` rows to zero, except where a row of C or B has no others.
   Collective
*/
static PetscErrorCode Unweigh(Mat C, Mat B, Vec count, PetscReal bound, Vec weight)
{
  Vec      left, keeps;
  PetscInt number[2] = {0, 0}; /* of unknowns without a weight, and of those that keep it */

  PetscFunctionBegin;
  PetscCall(AinsworthVecClone(weight, &left));
  PetscCall(AinsworthUpdate(left, {count}, [=](PetscInt, PetscScalar &w, PetscScalar rows) {
    if (PetscRealPart(rows) > bound) w = 0.0;
  }));
  PetscCall(VecDuplicate(weight, &keeps));
  PetscCall(VecZeroEntries(keeps));
  PetscCall(KeepLast(C, left, keeps));
  if (B != C) PetscCall(KeepLast(B, left, keeps));
  PetscCall(AinsworthUpdate(weight, {left, keeps}, [&](PetscInt, PetscScalar &w, PetscScalar l, PetscScalar keep) {
    if (l != 0.0) return;
    number[keep != 0.0]++;
    if (keep == 0.0) w = 0.0;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, number, 2, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)C)));
  PetscCall(PetscInfo(
    C,
    "%" PetscInt_FMT
    " unknowns that more than %g rows of C share have no weight, as the Gram matrix would be dense; %" PetscInt_FMT
    " others keep it, as some rows have no other unknown\n",
    number[0], (double)bound, number[1]));
  PetscCall(VecDestroy(&left));
  PetscCall(VecDestroy(&keeps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSharedUnweigh - sets the weight of unknowns that many rows of C or B share to zero, so that the projection
   does not move them. Collective

   p rows that share an unknown would have p^2 entries in S. Q = I - W B' S^{-1} C remains a projection onto Ker C as
   long as the rows are independent in the other unknowns; a row without any would be empty in S. If they are not,
   AinsworthProjectorDiagnose() finds dependent rows that are independent for W = I.
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
  bound = PetscMax(sharedRows, sharedRatio * sums[0] / PetscMax(sums[1], 1.0));
  PetscCall(VecNorm(count, NORM_INFINITY, &largest));
  *any = (PetscBool)(largest > bound);
  if (*any) PetscCall(Unweigh(C, B, count, bound, weight));
  PetscCall(VecDestroy(&count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCopyWeighted - copies M without columns that have no weight: S then has no entries of them. Collective */
PetscErrorCode AinsworthCopyWeighted(Mat M, Vec weight, Mat *copy)
{
  AinsworthEntries   entries;
  AinsworthAtColumns at;

  PetscFunctionBegin;
  PetscCall(at.create(M, weight));
  PetscCall(AinsworthForRows(M, [&](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n; k++)
      if (at(row.j[k]) != 0.0) entries.add(row.j[k], row.a[k]);
    entries.endRow();
  }));
  PetscCall(AinsworthCreateAIJLike(M, entries, copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
