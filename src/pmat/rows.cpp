#include "pmat.h"
#include "../saddle/saddle.h"
#include <algorithm>
#include <vector>

/* AinsworthSelectRows - C with the entries of some of its rows, those of this rank that are marked; entries that are zero are not stored */
PetscErrorCode AinsworthSelectRows(Mat C, const std::vector<char> &marked, Mat *selected)
{
  std::vector<PetscInt>    start(1, 0), columns;
  std::vector<PetscScalar> values;
  PetscInt                 m, n, rstart;

  PetscFunctionBegin;
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
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)C), m, n, start, columns, values, selected));
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
  PetscCall(AinsworthSelectRows(C, taken, kept));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Does the row have an entry beside the diagonal? */
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
   AinsworthPmatFindShared - is an unknown in more rows of C than usual? And those of them that A couples with no other unknown, on all ranks: global numbers,
   ascending. Collective
*/
PetscErrorCode AinsworthPmatFindShared(Mat A, Mat C, const AinsworthPmatFill *fill, PetscBool *any, std::vector<PetscInt> *shared)
{
  MPI_Comm                 comm = PetscObjectComm((PetscObject)C);
  Vec                      counts;
  PetscReal                most;
  PetscInt                 n, rstart;
  PetscMPIInt              size, found, start = 0;
  bool                     coupled;
  const PetscScalar       *count;
  std::vector<PetscInt>    mine;
  std::vector<PetscMPIInt> numbers, starts;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(C, 0, &counts));
  PetscCall(VecGetLocalSize(counts, &n));
  PetscCall(VecGetOwnershipRange(counts, &rstart, NULL));
  PetscCall(VecGetArrayRead(counts, &count));
  for (PetscInt i = 0; i < n; i++) {
    if (PetscRealPart(count[i]) <= fill->usual) continue;
    PetscCall(IsCoupled(A, rstart + i, &coupled));
    if (!coupled) mine.push_back(rstart + i);
  }
  PetscCall(VecRestoreArrayRead(counts, &count));
  PetscCall(VecMax(counts, NULL, &most));
  *any = (PetscBool)(most > (PetscReal)fill->usual);
  PetscCall(VecDestroy(&counts));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  numbers.resize(size);
  found = (PetscMPIInt)mine.size();
  PetscCallMPI(MPI_Allgather(&found, 1, MPI_INT, numbers.data(), 1, MPI_INT, comm));
  for (PetscMPIInt number : numbers) {
    starts.push_back(start);
    start += number;
  }
  shared->resize(start);
  PetscCallMPI(MPI_Allgatherv(mine.data(), found, MPIU_INT, shared->data(), numbers.data(), starts.data(), MPIU_INT, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatHoldShared - C becomes C without its entries of shared unknowns; held is what stands in for them, of each as many diag(A) as it has rows. Collective

   Their slaves are then held as if tied to the ground: interpolation from A alone knows of no motion that they have in common
*/
PetscErrorCode AinsworthPmatHoldShared(const AinsworthPmatInputs *in, Mat *C, Mat *held)
{
  PetscInt                 n, m, rstart;
  Vec                      scale;
  Mat                      scaled;
  PetscScalar             *s;
  const PetscScalar       *inverse;
  std::vector<PetscInt>    start(1, 0), columns;
  std::vector<PetscScalar> values;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(*C, 0, &scale));
  PetscCall(MatGetLocalSize(*C, &m, &n));
  PetscCall(VecGetOwnershipRange(scale, &rstart, NULL));
  PetscCall(VecGetArray(scale, &s));
  PetscCall(VecGetArrayRead(in->inverseDiagonal, &inverse));
  for (PetscInt i = 0; i < n; i++) {
    const bool many = std::binary_search(in->shared.begin(), in->shared.end(), rstart + i);

    if (many) {
      columns.push_back(rstart + i);
      values.push_back(s[i] / inverse[i]);
    }
    start.push_back((PetscInt)columns.size());
    s[i] = many ? 0.0 : 1.0;
  }
  PetscCall(VecRestoreArrayRead(in->inverseDiagonal, &inverse));
  PetscCall(VecRestoreArray(scale, &s));
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)*C), n, n, start, columns, values, held));
  PetscCall(AinsworthScaleColumns(*C, scale, &scaled));
  PetscCall(VecDestroy(&scale));
  PetscCall(MatDestroy(C));
  PetscCall(AinsworthSelectRows(scaled, std::vector<char>(m, 1), C));
  PetscCall(MatDestroy(&scaled));
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
  PetscCall(AinsworthCountRows(C, 0, &W));
  PetscCall(MatGetLocalSize(C, &m, &n));
  PetscCall(VecGetArray(W, &w));
  for (PetscInt i = 0; i < n; i++) {
    const bool many = PetscRealPart(w[i]) > fill->usual;

    found += many;
    w[i] = many ? 0.0 : 1.0;
  }
  PetscCall(VecRestoreArray(W, &w));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)C)));
  *shared = (PetscBool)(found > 0);
  if (weight) PetscCall(VecPointwiseMult(W, W, weight));
  PetscCall(AinsworthScaleColumns(C, W, CW));
  PetscCall(VecDestroy(&W));
  if (!*shared) PetscFunctionReturn(PETSC_SUCCESS);
  scaled = *CW;
  PetscCall(AinsworthSelectRows(scaled, std::vector<char>(m, 1), CW));
  PetscCall(MatDestroy(&scaled));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCreateFromDiagonal - the diagonal matrix of d; entries that are zero are not stored. Collective */
PetscErrorCode AinsworthCreateFromDiagonal(Vec d, Mat *mat)
{
  PetscInt                 n, rstart;
  const PetscScalar       *v;
  std::vector<PetscInt>    start(1, 0), columns;
  std::vector<PetscScalar> values;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(d, &n));
  PetscCall(VecGetOwnershipRange(d, &rstart, NULL));
  PetscCall(VecGetArrayRead(d, &v));
  for (PetscInt i = 0; i < n; i++) {
    if (v[i] != 0.0) {
      columns.push_back(rstart + i);
      values.push_back(v[i]);
    }
    start.push_back((PetscInt)columns.size());
  }
  PetscCall(VecRestoreArrayRead(d, &v));
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)d), n, n, start, columns, values, mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreateShift - what stands in for rows that are left out: a part of diag(A) on their unknowns, all of it where A has none

   M_* stays positive definite where they alone hold a body, and a rigid motion of all unknowns has the energy that it has with
   `shift` diag(A), whatever part of them these rows have
*/
PetscErrorCode AinsworthPmatCreateShift(Mat A, Mat C, Vec inverseDiagonal, const AinsworthPmatFill *fill, Mat *shift)
{
  static const PetscReal small = 1e-5, largest = 1e-2; /* below bending of thin bodies, and well above what single precision resolves */
  PetscReal              held = 0.0;
  PetscInt               n, N;
  Vec                    counts, d;
  PetscScalar           *count;
  const PetscScalar     *inverse, *diagonal;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(C, fill->most, &counts));
  PetscCall(MatGetSize(A, &N, NULL));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(VecGetArray(counts, &count));
  for (PetscInt i = 0; i < n; i++) held += PetscRealPart(count[i]) > 0.0;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &held, 1, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)A)));
  PetscCall(VecDuplicate(inverseDiagonal, &d));
  PetscCall(AinsworthGetDiagonal(A, d));
  PetscCall(VecGetArrayRead(inverseDiagonal, &inverse));
  PetscCall(VecGetArrayRead(d, &diagonal));
  for (PetscInt i = 0; i < n; i++)
    if (PetscRealPart(count[i]) > 0.0) count[i] = (diagonal[i] == 0.0 ? 1.0 : PetscMin(largest, small * N / held)) / inverse[i];
  PetscCall(VecRestoreArrayRead(d, &diagonal));
  PetscCall(VecRestoreArrayRead(inverseDiagonal, &inverse));
  PetscCall(VecRestoreArray(counts, &count));
  PetscCall(AinsworthCreateFromDiagonal(counts, shift));
  PetscCall(VecDestroy(&counts));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}
