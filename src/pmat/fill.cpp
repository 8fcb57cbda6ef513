#include "pmat.h"
#include "../saddle/saddle.h"
#include <array>
#include <cmath>
#include <vector>

/* Rows of about this length, or of that of a mean row of A, are not long */
static const PetscReal usualLength = 64.0;
/* Longer ones are taken, from the shortest on, while the squares of their lengths add up to this part of the entries of A */
static const PetscReal budget = 0.25;
/* M_* is not made with more than so many times the entries of A, unless that is little for any machine */
static const PetscReal mostEntries = 25.0, fewEntries = 2e7;

typedef std::array<PetscReal, 128> Classes; /* of lengths: two for each power of two */

static size_t ClassOf(PetscInt length)
{
  return (size_t)(2.0 * std::log2((PetscReal)length));
}

static PetscReal Bound(const AinsworthPmatFill *fill)
{
  return PetscMax(mostEntries * fill->entries, fewEntries);
}

/* An unknown in more rows than this is shared: what all pairs of its rows would bring into M_* is left out */
static PetscReal ManyRows(const AinsworthPmatFill *fill)
{
  return PetscMax(usualLength, fill->mean);
}

/* The first class of rows that are left out, from the sums of the squares of the lengths in each */
static size_t FirstLong(const AinsworthPmatFill *fill, const Classes &squares)
{
  const size_t usual = ClassOf((PetscInt)ManyRows(fill));
  PetscReal    all = 0.0, unusual = 0.0;

  for (size_t k = 0; k < squares.size(); k++) {
    all += squares[k];
    if (k > usual) unusual += squares[k];
    if (fill->entries + all > Bound(fill) || unusual > budget * fill->entries) return k;
  }
  return squares.size();
}

/* Rows of C on this rank: squares of their lengths in classes, the longest, and the number of those longer than `length` */
static PetscErrorCode CountRows(Mat C, PetscInt length, Classes *squares, PetscInt *longest, PetscInt *longer)
{
  PetscInt rstart, rend;

  PetscFunctionBegin;
  *longest = *longer = 0;
  squares->fill(0.0);
  PetscCall(MatGetOwnershipRange(C, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt n;

    PetscCall(MatGetRow(C, i, &n, NULL, NULL));
    if (n) (*squares)[ClassOf(n)] += PetscSqr((PetscReal)n);
    *longest = PetscMax(*longest, n);
    *longer += n > length;
    PetscCall(MatRestoreRow(C, i, &n, NULL, NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In how many rows of C each unknown is: in those longer than `length` alone where this is not negative. Collective */
static PetscErrorCode CountColumns(Mat C, PetscInt length, Vec *counts)
{
  PetscInt                 rstart, rend;
  std::vector<PetscScalar> ones;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(C, counts, NULL));
  PetscCall(MatGetOwnershipRange(C, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt        n;
    const PetscInt *columns;

    PetscCall(MatGetRow(C, i, &n, &columns, NULL));
    if (n > length) {
      ones.resize(PetscMax(ones.size(), (size_t)n), 1.0);
      PetscCall(VecSetValues(*counts, n, columns, ones.data(), ADD_VALUES));
    }
    PetscCall(MatRestoreRow(C, i, &n, &columns, NULL));
  }
  PetscCall(VecAssemblyBegin(*counts));
  PetscCall(VecAssemblyEnd(*counts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatGetFill - what the rows of C bring into M_*, from their lengths, and which of them are too long for it

   A: AIJ. A row of p entries brings p^2 into C' B C, and into Q_*' A Q_* as many rows of A as it has entries. Collective
*/
PetscErrorCode AinsworthPmatGetFill(Mat A, Mat C, AinsworthPmatFill *fill)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)C);
  MatInfo  info;
  PetscInt n, longest, longer;
  Classes  squares, again;
  size_t   end;

  PetscFunctionBegin;
  PetscCall(MatGetInfo(A, MAT_GLOBAL_SUM, &info));
  PetscCall(MatGetSize(A, &n, NULL));
  fill->entries = (PetscReal)info.nz_used;
  fill->mean    = fill->entries / PetscMax(n, 1);
  PetscCall(CountRows(C, PETSC_MAX_INT, &squares, &longest, &longer));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, squares.data(), (PetscMPIInt)squares.size(), MPIU_REAL, MPIU_SUM, comm));
  PetscCall(MPIU_Allreduce(&longest, &fill->longest, 1, MPIU_INT, MPI_MAX, comm));
  end           = FirstLong(fill, squares);
  fill->most    = fill->longest;
  fill->leftOut = 0;
  fill->squares = 0.0;
  for (size_t k = 0; k < end; k++) fill->squares += squares[k];
  if (fill->longest && end <= ClassOf(fill->longest)) {
    fill->most = (PetscInt)std::ceil(std::exp2(0.5 * (PetscReal)end)) - 1;
    PetscCall(CountRows(C, fill->most, &again, &longest, &longer));
    PetscCall(MPIU_Allreduce(&longer, &fill->leftOut, 1, MPIU_INT, MPI_SUM, comm));
    PetscCall(PetscInfo(C, "%" PetscInt_FMT " rows of C with more than %" PetscInt_FMT " entries are left out of the preconditioning matrix\n", fill->leftOut,
                        fill->most));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C with the entries of some of its rows, those of this rank that are marked; entries that are zero are not stored */
static PetscErrorCode SelectRows(Mat C, const std::vector<char> &marked, Mat *selected)
{
  std::vector<PetscInt>    start(1, 0), columns;
  std::vector<PetscScalar> values;
  PetscInt                 m, n, M, N, rstart;

  PetscFunctionBegin;
  PetscCall(MatGetSize(C, &M, &N));
  PetscCall(MatGetLocalSize(C, &m, &n));
  PetscCall(MatGetOwnershipRange(C, &rstart, NULL));
  for (PetscInt i = 0; i < m; i++) {
    PetscInt           length;
    const PetscInt    *j;
    const PetscScalar *a;

    PetscCall(MatGetRow(C, rstart + i, &length, &j, &a));
    for (PetscInt k = 0; k < length && marked[i]; k++) {
      if (a[k] == 0.0) continue;
      columns.push_back(j[k]);
      values.push_back(a[k]);
    }
    start.push_back((PetscInt)columns.size());
    PetscCall(MatRestoreRow(C, rstart + i, &length, &j, &a));
  }
  PetscCall(MatCreate(PetscObjectComm((PetscObject)C), selected));
  PetscCall(MatSetSizes(*selected, m, n, M, N));
  PetscCall(MatSetType(*selected, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(*selected, start.data(), columns.data(), values.data()));
  PetscCall(MatMPIAIJSetPreallocationCSR(*selected, start.data(), columns.data(), values.data()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthPmatCreateShort - C without the entries of its long rows, C itself where no row is long */
PetscErrorCode AinsworthPmatCreateShort(Mat C, const AinsworthPmatFill *fill, Mat *kept)
{
  std::vector<char> taken;
  PetscInt          rstart, rend;

  PetscFunctionBegin;
  if (!fill->leftOut) {
    PetscCall(PetscObjectReference((PetscObject)C));
    *kept = C;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetOwnershipRange(C, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt length;

    PetscCall(MatGetRow(C, i, &length, NULL, NULL));
    taken.push_back(length <= fill->most);
    PetscCall(MatRestoreRow(C, i, &length, NULL, NULL));
  }
  PetscCall(SelectRows(C, taken, kept));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreatePrivate - C W without its entries of shared unknowns

   Q_* leaves a shared unknown where it is, and moves the others of each row: the rows do not meet in it. Collective
*/
PetscErrorCode AinsworthPmatCreatePrivate(Mat C, Vec weight, const AinsworthPmatFill *fill, Mat *CW, PetscBool *shared)
{
  PetscInt     n, m, found = 0;
  Vec          W;
  PetscScalar *w;
  Mat          scaled;

  PetscFunctionBegin;
  PetscCall(CountColumns(C, 0, &W));
  PetscCall(MatGetLocalSize(C, &m, &n));
  PetscCall(VecGetArray(W, &w));
  for (PetscInt i = 0; i < n; i++) {
    const bool many = PetscRealPart(w[i]) > ManyRows(fill);

    found += many;
    w[i] = many ? 0.0 : 1.0;
  }
  PetscCall(VecRestoreArray(W, &w));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)C)));
  *shared = (PetscBool)(found > 0);
  if (weight) PetscCall(VecPointwiseMult(W, W, weight));
  PetscCall(MatDuplicate(C, MAT_COPY_VALUES, CW));
  PetscCall(MatDiagonalScale(*CW, NULL, W));
  PetscCall(VecDestroy(&W));
  if (!*shared) PetscFunctionReturn(PETSC_SUCCESS);
  scaled = *CW;
  PetscCall(SelectRows(scaled, std::vector<char>(m, 1), CW));
  PetscCall(MatDestroy(&scaled));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Entries of the mean row of left * right; left has few rows, and becomes the product */
static PetscErrorCode MultiplySample(Mat *left, Mat right, PetscReal *mean)
{
  Mat      product;
  MatInfo  info;
  PetscInt rows;

  PetscFunctionBegin;
  PetscCall(MatMatMult(*left, right, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
  PetscCall(MatDestroy(left));
  *left = product;
  PetscCall(MatGetInfo(product, MAT_GLOBAL_SUM, &info));
  PetscCall(MatGetSize(product, &rows, NULL));
  *mean = (PetscReal)info.nz_used / PetscMax(rows, 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Up to some unknowns of this rank that C has entries for, at even distances; and the number of such unknowns on all ranks */
static PetscErrorCode SampleUnknowns(Mat Ct, IS *sample, PetscReal *touched)
{
  static const size_t   enough = 16;
  PetscInt              rstart, rend;
  std::vector<PetscInt> found, taken;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(Ct, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt n;

    PetscCall(MatGetRow(Ct, i, &n, NULL, NULL));
    if (n) found.push_back(i);
    PetscCall(MatRestoreRow(Ct, i, &n, NULL, NULL));
  }
  for (size_t k = 0; k < enough && k < found.size(); k++) taken.push_back(found[(2 * k + 1) * found.size() / (2 * PetscMin(enough, found.size()))]);
  *touched = (PetscReal)found.size();
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, touched, 1, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)Ct)));
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)Ct), (PetscInt)taken.size(), taken.data(), PETSC_COPY_VALUES, sample));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatPredict - about as many entries as M_* will have with the approximation Inv(S) of S^{-1}, NULL: a diagonal one

   The rows of some unknowns of C' Inv(S) C W A and that times W C' Inv(S) C are counted. Collective
*/
PetscErrorCode AinsworthPmatPredict(Mat A, Mat C, Mat inverse, const AinsworthPmatFill *fill, PetscReal *entries)
{
  Mat       kept, Ct, CW, CWt, sample;
  IS        unknowns;
  PetscBool shared;
  PetscReal touched, ring, row;

  PetscFunctionBegin;
  PetscCall(AinsworthPmatCreateShort(C, fill, &kept));
  PetscCall(AinsworthPmatCreatePrivate(kept, NULL, fill, &CW, &shared));
  PetscCall(MatTranspose(CW, MAT_INITIAL_MATRIX, &CWt));
  PetscCall(MatTranspose(kept, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(SampleUnknowns(CWt, &unknowns, &touched));
  PetscCall(MatCreateSubMatrix(Ct, unknowns, NULL, MAT_INITIAL_MATRIX, &sample));
  if (inverse) PetscCall(MultiplySample(&sample, inverse, &row));
  PetscCall(MultiplySample(&sample, CW, &row));
  PetscCall(MultiplySample(&sample, A, &ring));
  PetscCall(MultiplySample(&sample, CWt, &row));
  if (inverse) PetscCall(MultiplySample(&sample, inverse, &row));
  PetscCall(MultiplySample(&sample, kept, &row));
  *entries = fill->entries + touched * (row + ring);
  PetscCall(ISDestroy(&unknowns));
  for (Mat *mat : {&kept, &Ct, &CW, &CWt, &sample}) PetscCall(MatDestroy(mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthPmatCheckFill - says how large M_* will be, and refuses one that no machine has room for */
PetscErrorCode AinsworthPmatCheckFill(Mat A, Mat C, Mat inverse, const AinsworthPmatFill *fill, PCAinsworthPmatType type)
{
  PetscReal predicted = fill->entries + fill->squares; /* what bounds the latter has been left out */

  PetscFunctionBegin;
  if (type != PC_AINSWORTH_PMAT_ID) PetscCall(AinsworthPmatPredict(A, C, inverse, fill, &predicted));
  PetscCall(PetscInfo(C, "The preconditioning matrix of type %s has about %g entries, A has %g\n", PCAinsworthPmatTypes[type], (double)predicted,
                      (double)fill->entries));
  PetscCheck(predicted <= Bound(fill) || type == PC_AINSWORTH_PMAT_ID, PetscObjectComm((PetscObject)C), PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_ainsworth_pmat %s would give the preconditioning matrix about %g entries, where A has %g: use id", PCAinsworthPmatTypes[type],
             (double)predicted, (double)fill->entries);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatSplitLoose - C = rest + loose: loose has the rows with an unknown that A does nothing to, NULL where there are none

   Interpolation that is made from A alone does not reach such unknowns, and their rows would lock it. One that is in many rows, the strain of a
   periodic cell, does not count: it alone is one direction that iterations have to find. Collective
*/
PetscErrorCode AinsworthPmatSplitLoose(Mat A, Mat C, const AinsworthPmatFill *fill, Mat *rest, Mat *loose)
{
  PetscInt           n, m, found = 0;
  Vec                counts, touched, diagonal;
  PetscScalar       *count;
  const PetscScalar *a;
  Mat                absolute;
  std::vector<char>  in, out;

  PetscFunctionBegin;
  *loose = NULL;
  *rest  = C;
  PetscCall(PetscObjectReference((PetscObject)C));
  PetscCall(MatCreateVecs(A, &diagonal, NULL));
  PetscCall(MatGetDiagonal(A, diagonal));
  PetscCall(VecGetLocalSize(diagonal, &n));
  PetscCall(VecGetArrayRead(diagonal, &a));
  for (PetscInt i = 0; i < n; i++) found += a[i] == 0.0;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  if (found) {
    PetscCall(CountColumns(C, 0, &counts));
    PetscCall(VecGetArray(counts, &count));
    for (PetscInt i = 0; i < n; i++) count[i] = a[i] == 0.0 && PetscRealPart(count[i]) <= ManyRows(fill) ? 1.0 : 0.0;
    PetscCall(VecRestoreArray(counts, &count));
    PetscCall(MatCreateVecs(C, NULL, &touched));
    PetscCall(AinsworthAbsoluteAIJ(C, &absolute));
    PetscCall(MatMult(absolute, counts, touched));
    PetscCall(MatDestroy(&absolute));
    PetscCall(VecGetLocalSize(touched, &m));
    PetscCall(VecGetArray(touched, &count));
    for (PetscInt i = 0; i < m; i++) in.push_back(PetscRealPart(count[i]) > 0.0);
    PetscCall(VecRestoreArray(touched, &count));
    found = 0;
    for (char marked : in) {
      out.push_back(!marked);
      found |= marked;
    }
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)A)));
    if (found) {
      PetscCall(MatDestroy(rest));
      PetscCall(SelectRows(C, out, rest));
      PetscCall(SelectRows(C, in, loose));
    }
    PetscCall(VecDestroy(&counts));
    PetscCall(VecDestroy(&touched));
  }
  PetscCall(VecRestoreArrayRead(diagonal, &a));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreateShift - what stands in for rows that are left out: a part of diag(A) on their unknowns, all of it where A has none

   M_* stays positive definite where they alone hold a body, and a rigid motion of all unknowns has the energy that it has with
   `shift` diag(A), whatever part of them these rows have
*/
PetscErrorCode AinsworthPmatCreateShift(Mat A, Mat C, Vec inverseDiagonal, const AinsworthPmatFill *fill, Mat *shift)
{
  static const PetscReal   small = 1e-4, largest = 1e-2;
  PetscReal                held = 0.0;
  PetscInt                 n, N, rstart;
  Vec                      counts, d;
  PetscScalar             *count;
  const PetscScalar       *inverse, *diagonal;
  std::vector<PetscInt>    start(1, 0), columns;
  std::vector<PetscScalar> values;

  PetscFunctionBegin;
  PetscCall(CountColumns(C, fill->most, &counts));
  PetscCall(MatGetSize(A, &N, NULL));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatGetOwnershipRange(A, &rstart, NULL));
  PetscCall(VecGetArray(counts, &count));
  for (PetscInt i = 0; i < n; i++) held += PetscRealPart(count[i]) > 0.0;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &held, 1, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)A)));
  PetscCall(VecDuplicate(inverseDiagonal, &d));
  PetscCall(MatGetDiagonal(A, d));
  PetscCall(VecGetArrayRead(inverseDiagonal, &inverse));
  PetscCall(VecGetArrayRead(d, &diagonal));
  for (PetscInt i = 0; i < n; i++) {
    if (PetscRealPart(count[i]) > 0.0) {
      columns.push_back(rstart + i);
      values.push_back((diagonal[i] == 0.0 ? 1.0 : PetscMin(largest, small * N / held)) / inverse[i]);
    }
    start.push_back((PetscInt)columns.size());
  }
  PetscCall(VecRestoreArrayRead(d, &diagonal));
  PetscCall(VecRestoreArrayRead(inverseDiagonal, &inverse));
  PetscCall(VecRestoreArray(counts, &count));
  PetscCall(VecDestroy(&counts));
  PetscCall(VecDestroy(&d));
  PetscCall(MatCreate(PetscObjectComm((PetscObject)A), shift));
  PetscCall(MatSetSizes(*shift, n, n, N, N));
  PetscCall(MatSetType(*shift, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(*shift, start.data(), columns.data(), values.data()));
  PetscCall(MatMPIAIJSetPreallocationCSR(*shift, start.data(), columns.data(), values.data()));
  PetscFunctionReturn(PETSC_SUCCESS);
}
