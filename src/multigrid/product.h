/* y = A x for a Hermitian block matrix: half of the blocks between owned nodes are stored, and used twice */
#ifndef AINSWORTH_PRODUCT_H
#define AINSWORTH_PRODUCT_H

#include "blocks.h"
#include "rowkernel.h"
#include <algorithm>
#include <memory>

/* Everything else in some of the rows: blocks of ghosts, and of a matrix that is added to A there, of which all are stored */
template <class T>
struct AinsworthRest {
  std::vector<PetscInt> row, i, j;
  std::vector<T>        a;
};

template <class T>
class AinsworthProduct {
public:
  ~AinsworthProduct() { (void)cols.destroy(); }
  PetscErrorCode create(std::shared_ptr<const AinsworthUpper<T>>, AinsworthColumns &&, AinsworthRest<T> &&);
  PetscErrorCode start(const T *x, T *y); /* y = what does not come from the upper half; collective */
  template <class F>
  void           pass(const T *x, T *y, F finish) const; /* y += the upper half's part; finish(i, y_i) as soon as y_i is complete */
  PetscErrorCode mult(const T *x, T *y);
  PetscInt       n() const { return upper->n; }
  PetscInt       bs() const { return upper->bs; }
  PetscInt       stride() const { return AinsworthStride<T>(upper->bs); }

  std::shared_ptr<const AinsworthUpper<T>> upper;
  AinsworthRest<T>                         rest;
  AinsworthColumns                         cols;

private:
  template <int BS>
  void multRest(const T *x, T *y) const;
  template <int BS, class F>
  void                           passBlocks(const T *x, T *y, F finish) const;
  std::vector<T>                 ghost;
  std::unique_ptr<AinsworthUnit> unit;
};

template <class T>
PetscErrorCode AinsworthProduct<T>::create(std::shared_ptr<const AinsworthUpper<T>> half, AinsworthColumns &&columns, AinsworthRest<T> &&others)
{
  PetscFunctionBegin;
  upper   = half;
  cols    = columns;
  columns = AinsworthColumns();
  rest    = std::move(others);
  ghost.assign(cols.ghosts.size() * stride(), T(0));
  unit.reset(new AinsworthUnit(stride() * (PetscInt)sizeof(T), MPI_BYTE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

template <class T>
template <int BS>
void AinsworthProduct<T>::multRest(const T *x, T *y) const
{
  const PetscInt bs = BS ? BS : upper->bs, s = stride();

  for (size_t r = 0; r < rest.row.size(); r++) {
    T *out = y + (size_t)rest.row[r] * s;

    for (PetscInt k = rest.i[r]; k < rest.i[r + 1]; k++) {
      const T *a = rest.a.data() + (size_t)k * bs * bs;
      const T *z = rest.j[k] < cols.local ? x + (size_t)rest.j[k] * s : ghost.data() + (size_t)(rest.j[k] - cols.local) * s;
      for (PetscInt p = 0; p < bs; p++) {
        T sum = 0;
        for (PetscInt q = 0; q < bs; q++) sum += a[p * bs + q] * z[q];
        out[p] += sum;
      }
    }
  }
}

template <class T>
PetscErrorCode AinsworthProduct<T>::start(const T *x, T *y)
{
  PetscFunctionBegin;
  PetscCall(cols.toGhosts(unit->type, x, ghost.data()));
  std::fill_n(y, (size_t)n() * stride(), T(0));
  if (rest.row.size()) AinsworthDispatch(bs(), [&](auto BS) { multRest<BS()>(x, y); });
  PetscFunctionReturn(PETSC_SUCCESS);
}

template <class T>
template <int BS, class F>
void AinsworthProduct<T>::passBlocks(const T *x, T *y, F finish) const
{
  const AinsworthUpper<T> &U = *upper;
  const PetscInt           s = stride();
  std::vector<T>           more(BS ? 0 : 2 * s);
  T                        few[2 * (BS ? BS + 1 : 1)], *sum = BS ? few : more.data(), *xi = sum + s;

  for (PetscInt i = 0; i < U.n; i++) {
    T *yi = y + (size_t)i * s;

    AinsworthUpperRow<T, BS>(U, i, x, y, sum, xi);
    for (PetscInt p = 0; p < s; p++) yi[p] += sum[p];
    finish(i, yi);
  }
}

template <class T>
template <class F>
void AinsworthProduct<T>::pass(const T *x, T *y, F finish) const
{
  AinsworthDispatch(bs(), [&](auto BS) { passBlocks<BS()>(x, y, finish); });
}

template <class T>
PetscErrorCode AinsworthProduct<T>::mult(const T *x, T *y)
{
  PetscFunctionBegin;
  PetscCall(start(x, y));
  pass(x, y, [](PetscInt, T *) {});
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
