/* Sizes of the entries of AIJ matrices, their rows, and what rows need of other ranks */
#include "matrices.h"
#include "layouts.h"
#include "loops.h"
#include "objects.h"
#include <petscsf.h>
#include <vector>

/* Creates the entrywise absolute value of an AIJ matrix */
static PetscErrorCode CreateAbsolute(Mat M, Mat *absolute)
{
  Mat             block[2];
  const PetscInt *ghosts;
  PetscInt        n;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(M, MAT_COPY_VALUES, absolute));
  PetscCall(AinsworthAIJGetParts(*absolute, block, &ghosts, &n));
  for (Mat part : block) {
    MatInfo      info;
    PetscScalar *v;

    if (!part) continue;
    PetscCall(MatGetInfo(part, MAT_LOCAL, &info));
    PetscCall(MatSeqAIJGetArray(part, &v));
    for (PetscInt k = 0; k < (PetscInt)info.nz_used; k++) v[k] = PetscAbsScalar(v[k]);
    PetscCall(MatSeqAIJRestoreArray(part, &v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthAbsoluteMult - computes y = |M| |x|, entrywise, for an AIJ matrix, without a copy of M */
PetscErrorCode AinsworthAbsoluteMult(Mat M, Vec x, Vec y)
{
  Mat             mat[2];
  Vec             from[2] = {x, NULL};
  const PetscInt *ghosts;
  PetscInt        nghosts;
  PetscScalar    *sum;
  AinsworthCSR    part;

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(M, mat, &ghosts, &nghosts));
  if (mat[1]) PetscCall(AinsworthVecGather(x, nghosts, ghosts, &from[1]));
  PetscCall(VecZeroEntries(y));
  PetscCall(VecGetArray(y, &sum));
  for (int k = 0; k < 2 && mat[k]; k++) {
    const PetscScalar *v;

    PetscCall(part.open(mat[k]));
    PetscCall(VecGetArrayRead(from[k], &v));
    for (PetscInt r = 0; r < part.n; r++) {
      PetscReal terms = 0.0;

      for (PetscInt e = part.ia[r]; e < part.ia[r + 1]; e++)
        terms += PetscAbsScalar(part.a[e]) * PetscAbsScalar(v[part.ja[e]]);
      sum[r] += terms;
    }
    PetscCall(VecRestoreArrayRead(from[k], &v));
    PetscCall(part.close());
  }
  PetscCall(VecRestoreArray(y, &sum));
  PetscCall(VecDestroy(&from[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthAbsoluteMultTranspose - computes y = |M|' |x|, entrywise, for an AIJ matrix */
PetscErrorCode AinsworthAbsoluteMultTranspose(Mat M, Vec x, Vec y)
{
  Mat entries;
  Vec sizes;

  PetscFunctionBegin;
  PetscCall(CreateAbsolute(M, &entries));
  PetscCall(AinsworthVecClone(x, &sizes));
  PetscCall(VecAbs(sizes));
  PetscCall(MatMultTranspose(entries, sizes, y));
  PetscCall(VecDestroy(&sizes));
  PetscCall(MatDestroy(&entries));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the sum of |entry|^power of each row of M; power is 1 or 2 */
PetscErrorCode AinsworthRowSums(Mat M, int power, Vec sums)
{
  Mat          R;
  PetscScalar *s;

  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(M, &R));
  PetscCall(VecGetArrayWrite(sums, &s));
  PetscCall(AinsworthForRows(R, [=](const AinsworthMatRow &row) {
    PetscReal sum = 0.0;

    for (PetscInt k = 0; k < row.n; k++)
      sum += power == 2 ? PetscSqr(PetscAbsScalar(row.a[k])) : PetscAbsScalar(row.a[k]);
    s[row.local] = sum;
  }));
  PetscCall(VecRestoreArrayWrite(sums, &s));
  PetscCall(MatDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a copy of M with its columns scaled */
PetscErrorCode AinsworthScaleColumns(Mat M, Vec scale, Mat *scaled)
{
  PetscFunctionBegin;
  PetscCall(MatDuplicate(M, MAT_COPY_VALUES, scaled));
  PetscCall(MatDiagonalScale(*scaled, NULL, scale));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes diag(C W C'); scales by W^{1/2} before squaring, to avoid overflow and underflow */
PetscErrorCode AinsworthRowSquares(Mat C, Vec weight, Vec sums)
{
  Vec root;
  Mat scaled;

  PetscFunctionBegin;
  PetscCall(AinsworthVecClone(weight, &root));
  PetscCall(VecSqrtAbs(root));
  PetscCall(AinsworthScaleColumns(C, root, &scaled));
  PetscCall(AinsworthRowSums(scaled, 2, sums));
  PetscCall(MatDestroy(&scaled));
  PetscCall(VecDestroy(&root));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthAddToOwners - adds values at the columns of local rows that other ranks own, in the order of
   AinsworthAIJGetParts(), to a vector laid out as the columns. Collective
*/
PetscErrorCode AinsworthAddToOwners(Mat M, const PetscScalar there[], Vec sums)
{
  PetscSF      sf;
  PetscScalar *own;

  PetscFunctionBegin;
  PetscCall(AinsworthColumnsCreateSF(M, &sf));
  if (!sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArray(sums, &own));
  PetscCall(PetscSFReduceBegin(sf, MPIU_SCALAR, there, own, MPIU_SUM));
  PetscCall(PetscSFReduceEnd(sf, MPIU_SCALAR, there, own, MPIU_SUM));
  PetscCall(VecRestoreArray(sums, &own));
  PetscCall(PetscSFDestroy(&sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts, for each unknown, the rows of C, AIJ, with more than `length` entries that contain it. Collective */
PetscErrorCode AinsworthCountRows(Mat C, PetscInt length, Vec *counts)
{
  Mat                      part[2];
  const PetscInt          *ghosts;
  PetscInt                 n;
  PetscScalar             *count[2];
  std::vector<PetscScalar> there;
  AinsworthCSR             rows[2];

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(C, part, &ghosts, &n));
  PetscCall(AinsworthCreateVecs(C, counts, NULL));
  PetscCall(VecZeroEntries(*counts));
  PetscCall(VecGetArray(*counts, &count[0]));
  there.assign(n, 0.0);
  count[1] = there.data();
  for (int p = 0; p < 2; p++) PetscCall(rows[p].open(part[p]));
  for (PetscInt r = 0; r < rows[0].n; r++) {
    PetscInt entries = 0;

    for (int p = 0; p < 2 && part[p]; p++) entries += rows[p].ia[r + 1] - rows[p].ia[r];
    if (entries <= length) continue;
    for (int p = 0; p < 2 && part[p]; p++)
      for (PetscInt k = rows[p].ia[r]; k < rows[p].ia[r + 1]; k++) count[p][rows[p].ja[k]] += 1.0;
  }
  for (AinsworthCSR &opened : rows) PetscCall(opened.close());
  PetscCall(VecRestoreArray(*counts, &count[0]));
  PetscCall(AinsworthAddToOwners(C, there.data(), *counts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Samples up to `enough` rows of each rank, evenly spaced, that have `least` to `most` entries; number: of all such
   rows on all ranks. Collective
*/
PetscErrorCode AinsworthSampleRows(Mat M, PetscInt least, PetscInt most, PetscInt enough, IS *sample, PetscInt *number)
{
  std::vector<PetscInt> found, taken;

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(M, [&](const AinsworthMatRow &row) {
    if (row.n >= least && row.n <= most) found.push_back(row.number);
  }));
  *number = (PetscInt)found.size();
  enough  = PetscMin(enough, *number);
  for (PetscInt k = 0; k < enough; k++) taken.push_back(found[(2 * k + 1) * found.size() / (2 * enough)]);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, number, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)M)));
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)M), enough, taken.data(), PETSC_COPY_VALUES, sample));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthGetRows - appends the adjoints of some rows of a matrix, whose global numbers all ranks know. Collective */
PetscErrorCode AinsworthGetRows(Mat M, const std::vector<PetscInt> &numbers, std::vector<Vec> *rows)
{
  Vec unit, row;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(M, NULL, &unit));
  for (PetscInt number : numbers) {
    PetscCall(AinsworthCreateVecs(M, &row, NULL));
    PetscCall(VecZeroEntries(unit));
    PetscCall(VecSetValue(unit, number, 1.0, INSERT_VALUES));
    PetscCall(VecAssemblyBegin(unit));
    PetscCall(VecAssemblyEnd(unit));
    PetscCall(MatMultHermitianTranspose(M, unit, row));
    rows->push_back(row);
  }
  PetscCall(VecDestroy(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes |x' M x| */
PetscErrorCode AinsworthFormValue(Mat M, Vec x, PetscReal *value)
{
  PetscScalar product;
  Vec         Mx;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(x, &Mx));
  PetscCall(MatMult(M, x, Mx));
  PetscCall(VecDot(Mx, x, &product));
  PetscCall(VecDestroy(&Mx));
  *value = PetscAbsScalar(product);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthVecGather - gathers the n entries of v at the global places that this rank requests in a sequential vector.
   Collective

   For distinct places of other ranks: AinsworthAtColumns reads those of this rank where they are.
*/
PetscErrorCode AinsworthVecGather(Vec v, PetscInt n, const PetscInt places[], Vec *here)
{
  PetscSF            sf;
  PetscLayout        layout;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, n, here));
  PetscCall(VecGetLayout(v, &layout));
  PetscCall(PetscSFCreate(PetscObjectComm((PetscObject)v), &sf));
  PetscCall(PetscSFSetGraphLayout(sf, layout, n, NULL, PETSC_USE_POINTER, places));
  PetscCall(VecGetArrayRead(v, &from));
  PetscCall(VecGetArrayWrite(*here, &to));
  PetscCall(PetscSFBcastBegin(sf, MPIU_SCALAR, from, to, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, MPIU_SCALAR, from, to, MPI_REPLACE));
  PetscCall(VecRestoreArrayWrite(*here, &to));
  PetscCall(VecRestoreArrayRead(v, &from));
  PetscCall(PetscSFDestroy(&sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}
