#include "pmat.h"
#include "../base/loops.h"
#include "../saddle/saddle.h"
#include <array>
#include <cmath>
#include <limits>

/* Rows up to about this length, or the mean length of a row of A, are never long */
static const PetscReal usualLength = 64.0;
/*
   Longer rows are included, shortest first, while their squared lengths add up to at most this fraction of the entries
   of A
*/
static const PetscReal budget = 0.25;
/* M_* is refused if it has more than mostEntries times the entries of A, unless it has at most fewEntries */
static const PetscReal mostEntries = 25.0, fewEntries = 2e7;

typedef std::array<PetscReal, 128> Classes; /* sums by length, with two classes for each power of two */

static size_t ClassOf(PetscInt length)
{
  return (size_t)(2.0 * std::log2((PetscReal)length));
}

static PetscReal Bound(const AinsworthPmatFill *fill)
{
  return PetscMax(mostEntries * fill->entries, fewEntries);
}

/* Returns the first class of rows to leave out, given the sum of squared lengths in each class */
static size_t FirstLong(const AinsworthPmatFill *fill, const Classes &squares)
{
  const size_t usual = ClassOf(fill->usual);
  PetscReal    all = 0.0, unusual = 0.0;

  for (size_t k = 0; k < squares.size(); k++) {
    all += squares[k];
    if (k > usual) unusual += squares[k];
    if (fill->entries + all > Bound(fill) || unusual > budget * fill->entries) return k;
  }
  return squares.size();
}

/* Counts the local rows of C: squared lengths by class, the longest, and the number of those longer than `length` */
static PetscErrorCode CountRows(Mat C, PetscInt length, Classes *squares, PetscInt *longest, PetscInt *longer)
{
  PetscFunctionBegin;
  *longest = *longer = 0;
  squares->fill(0.0);
  PetscCall(AinsworthForRows(C, [=](const AinsworthMatRow &row) {
    if (row.n) (*squares)[ClassOf(row.n)] += PetscSqr((PetscReal)row.n);
    *longest = PetscMax(*longest, row.n);
    *longer += row.n > length;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatGetFill - predicts the fill of M_* from the lengths of the rows of C, and decides which of them are too
   long. Collective

   A is AIJ. A row with p entries adds p^2 entries to C' B C, and p rows of A to Q_*' A Q_*.
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
  fill->usual   = (PetscInt)PetscMax(usualLength, fill->entries / PetscMax(n, 1));
  PetscCall(CountRows(C, std::numeric_limits<PetscInt>::max(), &squares, &longest, &longer));
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
    PetscCall(PetscInfo(C,
                        "%" PetscInt_FMT " rows of C with more than %" PetscInt_FMT
                        " entries are left out of the preconditioning matrix\n",
                        fill->leftOut, fill->most));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces left, which has few rows, by left * right; mean: entries per row of the product */
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

/*
   AinsworthPmatPredict - estimates the number of entries of M_* for the approximation Inv(S); inverse NULL: a diagonal
   one. Collective

   Counts the entries in sampled rows of C' Inv(S) C W A and of its product with W C' Inv(S) C.
*/
PetscErrorCode AinsworthPmatPredict(Mat A, Mat C, Mat inverse, const AinsworthPmatFill *fill, PetscReal *entries)
{
  Mat       kept, Ct, CW, CWt, sample;
  IS        unknowns;
  PetscInt  found;
  PetscReal ring, row;

  PetscFunctionBegin;
  PetscCall(AinsworthPmatCreateShort(C, fill, &kept));
  PetscCall(AinsworthPmatCreatePrivate(kept, NULL, fill, &CW));
  PetscCall(MatTranspose(CW, MAT_INITIAL_MATRIX, &CWt));
  PetscCall(MatTranspose(kept, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(AinsworthSampleRows(CWt, 1, std::numeric_limits<PetscInt>::max(), 16, &unknowns, &found));
  PetscCall(MatCreateSubMatrix(Ct, unknowns, NULL, MAT_INITIAL_MATRIX, &sample));
  if (inverse) PetscCall(MultiplySample(&sample, inverse, &row));
  PetscCall(MultiplySample(&sample, CW, &row));
  PetscCall(MultiplySample(&sample, A, &ring));
  PetscCall(MultiplySample(&sample, CWt, &row));
  if (inverse) PetscCall(MultiplySample(&sample, inverse, &row));
  PetscCall(MultiplySample(&sample, kept, &row));
  *entries = fill->entries + (PetscReal)found * (row + ring);
  PetscCall(ISDestroy(&unknowns));
  for (Mat *mat : {&kept, &Ct, &CW, &CWt, &sample}) PetscCall(MatDestroy(mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthPmatCheckFill - reports the predicted size of M_*, and raises an error if it is too large. Collective */
PetscErrorCode AinsworthPmatCheckFill(Mat A, Mat C, Mat inverse, const AinsworthPmatFill *fill,
                                      PCAinsworthPmatType type)
{
  PetscReal predicted = fill->entries + fill->squares; /* bounded, since long rows are left out */

  PetscFunctionBegin;
  if (type != PC_AINSWORTH_PMAT_ID) PetscCall(AinsworthPmatPredict(A, C, inverse, fill, &predicted));
  PetscCall(PetscInfo(C, "The preconditioning matrix of type %s has about %g entries, A has %g\n",
                      PCAinsworthPmatTypes[type], (double)predicted, (double)fill->entries));
  PetscCheck(predicted <= Bound(fill) || type == PC_AINSWORTH_PMAT_ID, PetscObjectComm((PetscObject)C),
             PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_ainsworth_pmat %s would give the preconditioning matrix about %g entries, where A has %g: use id",
             PCAinsworthPmatTypes[type], (double)predicted, (double)fill->entries);
  PetscFunctionReturn(PETSC_SUCCESS);
}
