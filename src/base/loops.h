/* Loops over the local entries of vectors and over the rows of matrices */
#ifndef AINSWORTH_LOOPS_H
#define AINSWORTH_LOOPS_H

#include "petsccompat.h"
#include <utility>

template <std::size_t N, typename Loop, std::size_t... k>
static inline PetscErrorCode AinsworthWithArrays(const Vec (&v)[N], Loop loop, std::index_sequence<k...>)
{
  const PetscScalar *a[N];
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(v[0], &n));
  for (std::size_t i = 0; i < N; i++) PetscCall(VecGetArrayRead(v[i], &a[i]));
  for (PetscInt i = 0; i < n; i++) loop(i, a[k][i]...);
  for (std::size_t i = 0; i < N; i++) PetscCall(VecRestoreArrayRead(v[i], &a[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls f(i, a_i, b_i, ...) for the local entries of vectors {a, b, ...} of the same layout; i is the local index */
template <std::size_t N, typename Function>
static inline PetscErrorCode AinsworthForEntries(const Vec (&v)[N], Function f)
{
  PetscFunctionBegin;
  PetscCall(AinsworthWithArrays(v, f, std::make_index_sequence<N>()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls f(i, x_i) for the local entries of one vector; f may change x_i */
template <typename Function>
static inline PetscErrorCode AinsworthUpdate(Vec x, Function f)
{
  PetscScalar *a;
  PetscInt     n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArray(x, &a));
  for (PetscInt i = 0; i < n; i++) f(i, a[i]);
  PetscCall(VecRestoreArray(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls f(i, x_i, a_i, b_i, ...) for the local entries of vectors of the same layout; f may change only x_i */
template <std::size_t N, typename Function>
static inline PetscErrorCode AinsworthUpdate(Vec x, const Vec (&v)[N], Function f)
{
  PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(VecGetArray(x, &a));
  auto update = [&](PetscInt i, auto... values) { f(i, a[i], values...); };
  PetscCall(AinsworthWithArrays(v, update, std::make_index_sequence<N>()));
  PetscCall(VecRestoreArray(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

struct AinsworthMatRow {
  PetscInt           number = 0, local = 0; /* global and local row number */
  PetscInt           n = 0;
  const PetscInt    *j = NULL;
  const PetscScalar *a = NULL;
};

/* Calls f(row) for each local row */
template <typename Function>
static inline PetscErrorCode AinsworthForRows(Mat M, Function f)
{
  AinsworthMatRow row;
  PetscInt        start, end;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(M, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    row.number = i;
    row.local  = i - start;
    PetscCall(MatGetRow(M, i, &row.n, &row.j, &row.a));
    f(row);
    PetscCall(MatRestoreRow(M, i, &row.n, &row.j, &row.a));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
