#include "pmat.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../saddle/saddle.h"

/*
   AinsworthCopyMarkedRows - creates a matrix with the nonzero entries of the marked local rows of C (NULL: all), and
   empty rows otherwise. Collective
*/
PetscErrorCode AinsworthCopyMarkedRows(Mat C, const std::vector<char> *marked, Mat *selected)
{
  AinsworthEntries entries;

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n && (!marked || (*marked)[row.local]); k++)
      if (row.a[k] != 0.0) entries.add(row.j[k], row.a[k]);
    entries.endRow();
  }));
  PetscCall(AinsworthCreateAIJLike(C, entries, selected));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthPmatCreateShort - creates C without the entries of long rows; C itself if there are none. Collective */
PetscErrorCode AinsworthPmatCreateShort(Mat C, const AinsworthPmatFill *fill, Mat *kept)
{
  std::vector<char> taken;

  PetscFunctionBegin;
  if (fill->leftOut) {
    PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) { taken.push_back(row.n <= fill->most); }));
    PetscCall(AinsworthCopyMarkedRows(C, &taken, kept));
  } else PetscCall(AinsworthShare(C, kept));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tells whether a row has a nonzero off-diagonal entry */
static PetscErrorCode IsCoupled(Mat A, PetscInt row, bool *coupled)
{
  PetscInt           n;
  const PetscInt    *columns;
  const PetscScalar *values;

  PetscFunctionBegin;
  *coupled = false;
  PetscCall(MatGetRow(A, row, &n, &columns, &values));
  for (PetscInt k = 0; k < n; k++) *coupled = *coupled || (columns[k] != row && values[k] != 0.0);
  PetscCall(MatRestoreRow(A, row, &n, &columns, &values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatFindShared - tells whether an unknown is in more rows of C than usual, and finds those that A couples to
   no other unknown. Collective

   shared: global numbers of the latter on all ranks, ascending.
*/
PetscErrorCode AinsworthPmatFindShared(Mat A, Mat C, const AinsworthPmatFill *fill, PetscBool *any,
                                       std::vector<PetscInt> *shared)
{
  Vec                   counts;
  PetscReal             most;
  PetscInt              rstart;
  bool                  coupled;
  std::vector<PetscInt> longer, mine;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(C, 0, &counts));
  PetscCall(VecGetOwnershipRange(counts, &rstart, NULL));
  PetscCall(AinsworthForEntries({counts}, [&](PetscInt i, PetscScalar count) {
    if (PetscRealPart(count) > fill->usual) longer.push_back(rstart + i);
  }));
  for (PetscInt i : longer) {
    PetscCall(IsCoupled(A, i, &coupled));
    if (!coupled) mine.push_back(i);
  }
  PetscCall(VecMax(counts, NULL, &most));
  *any = (PetscBool)(most > (PetscReal)fill->usual);
  PetscCall(VecDestroy(&counts));
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)C), mine, shared));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatHoldShared - removes the entries of shared unknowns from C; held replaces them by diag(A) times the
   number of their rows. Collective

   Slaves of these unknowns are then held as if tied to the ground, because interpolation from A alone has no common
   motion for them.
*/
PetscErrorCode AinsworthPmatHoldShared(const AinsworthPmatInputs *in, Mat *C, Mat *held)
{
  PetscInt rstart;
  Vec      scale, counts;
  Mat      scaled;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(*C, 0, &counts));
  PetscCall(VecDuplicate(counts, &scale));
  PetscCall(VecGetOwnershipRange(scale, &rstart, NULL));
  PetscCall(AinsworthUpdate(scale, [&](PetscInt i, PetscScalar &s) {
    s = std::binary_search(in->shared.begin(), in->shared.end(), rstart + i) ? 0.0 : 1.0;
  }));
  PetscCall(AinsworthUpdate(counts, {scale, in->inverseDiagonal},
                            [](PetscInt, PetscScalar &count, PetscScalar s, PetscScalar inverse) {
                              count = s == 0.0 ? count / inverse : 0.0;
                            }));
  PetscCall(AinsworthCreateFromDiagonal(counts, held));
  PetscCall(AinsworthScaleColumns(*C, scale, &scaled));
  PetscCall(VecDestroy(&scale));
  PetscCall(VecDestroy(&counts));
  PetscCall(MatDestroy(C));
  PetscCall(AinsworthCopyMarkedRows(scaled, NULL, C));
  PetscCall(MatDestroy(&scaled));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreatePrivate - creates C W without the entries of shared unknowns. Collective

   Q_* then keeps a shared unknown in place and moves the others of each row, so that the rows are not coupled through
   it.
*/
PetscErrorCode AinsworthPmatCreatePrivate(Mat C, Vec weight, const AinsworthPmatFill *fill, Mat *CW)
{
  PetscInt found = 0;
  Vec      W;
  Mat      scaled;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(C, 0, &W));
  PetscCall(AinsworthUpdate(W, [&](PetscInt, PetscScalar &w) {
    const bool shared = PetscRealPart(w) > fill->usual;

    found += shared;
    w = shared ? 0.0 : 1.0;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)C)));
  if (weight) PetscCall(VecPointwiseMult(W, W, weight));
  PetscCall(AinsworthScaleColumns(C, W, CW));
  PetscCall(VecDestroy(&W));
  if (!found) PetscFunctionReturn(PETSC_SUCCESS);
  scaled = *CW;
  PetscCall(AinsworthCopyMarkedRows(scaled, NULL, CW));
  PetscCall(MatDestroy(&scaled));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCreateFromDiagonal - creates a diagonal matrix from d, without its zero entries. Collective */
PetscErrorCode AinsworthCreateFromDiagonal(Vec d, Mat *mat)
{
  PetscInt         n, rstart;
  AinsworthEntries entries;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(d, &n));
  PetscCall(VecGetOwnershipRange(d, &rstart, NULL));
  PetscCall(AinsworthForEntries({d}, [&](PetscInt i, PetscScalar v) {
    if (v != 0.0) entries.add(rstart + i, v);
    entries.endRow();
  }));
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)d), n, entries, mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreateShift - creates the replacement of long rows: a fraction of diag(A) on their unknowns, all of its
   stand-in where A has a zero. Collective

   M_* remains positive definite if these rows alone hold a body. A rigid motion of all unknowns has the energy that it
   has with `small` diag(A), whatever fraction of the unknowns these rows have.
*/
PetscErrorCode AinsworthPmatCreateShift(const AinsworthPmatInputs *in, Mat *shift)
{
  /*
     below the bending energy of thin bodies, as far as precision allows: 1e-8 is too small in single, and 1e-9 in
     double precision
  */
  const PetscReal small = in->single ? 1e-5 : 1e-7, largest = 1e3 * small;
  PetscReal       held = 0.0;
  PetscInt        N;
  Vec             counts, d;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(in->C, in->fill.most, &counts));
  PetscCall(MatGetSize(in->aij, &N, NULL));
  PetscCall(AinsworthForEntries({counts}, [&](PetscInt, PetscScalar count) { held += PetscRealPart(count) > 0.0; }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &held, 1, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)in->aij)));
  PetscCall(VecDuplicate(in->inverseDiagonal, &d));
  PetscCall(AinsworthGetDiagonal(in->aij, d));
  PetscCall(AinsworthUpdate(counts, {in->inverseDiagonal, d},
                            [=](PetscInt, PetscScalar &count, PetscScalar inverse, PetscScalar diagonal) {
                              if (PetscRealPart(count) > 0.0)
                                count = (diagonal == 0.0 ? 1.0 : PetscMin(largest, small * N / held)) / inverse;
                            }));
  PetscCall(AinsworthCreateFromDiagonal(counts, shift));
  PetscCall(VecDestroy(&counts));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}
