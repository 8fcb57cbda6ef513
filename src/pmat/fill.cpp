#include "pmat.h"
#include "../loops.h"
#include "../saddle/saddle.h"
#include <array>
#include <cmath>
#include <limits>

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

/* The first class of rows that are left out, from the sums of the squares of the lengths in each */
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

/* Rows of C on this rank: squares of their lengths in classes, the longest, and the number of those longer than `length` */
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
    PetscCall(PetscInfo(C, "%" PetscInt_FMT " rows of C with more than %" PetscInt_FMT " entries are left out of the preconditioning matrix\n", fill->leftOut,
                        fill->most));
  }
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

/*
   AinsworthPmatPredict - about as many entries as M_* will have with the approximation Inv(S) of S^{-1}, NULL: a diagonal one

   The rows of some unknowns of C' Inv(S) C W A and that times W C' Inv(S) C are counted. Collective
*/
PetscErrorCode AinsworthPmatPredict(Mat A, Mat C, Mat inverse, const AinsworthPmatFill *fill, PetscReal *entries)
{
  Mat       kept, Ct, CW, CWt, sample;
  IS        unknowns;
  PetscBool shared;
  PetscInt  found;
  PetscReal ring, row;

  PetscFunctionBegin;
  PetscCall(AinsworthPmatCreateShort(C, fill, &kept));
  PetscCall(AinsworthPmatCreatePrivate(kept, NULL, fill, &CW, &shared));
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
