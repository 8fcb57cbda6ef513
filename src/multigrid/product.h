/* y = A x for a Hermitian block matrix: half of the blocks between owned nodes are stored, and used twice */
#ifndef AINSWORTH_PRODUCT_H
#define AINSWORTH_PRODUCT_H

#include "blocks.h"
#include "kernels.h"
#include <algorithm>
#include <memory>

/* The blocks between owned nodes at and right of the diagonal, the diagonal block first in each row */
template <class T>
struct AinsworthUpper {
  PetscInt              n = 0, bs = 1;
  std::vector<PetscInt> i, j;
  std::vector<T>        a; /* with room for one vector more, see AinsworthLanes */
};

/* Everything else in some of the rows: blocks of ghosts, and of a matrix that is added to A there, of which all are stored */
template <class T>
struct AinsworthRest {
  std::vector<PetscInt> row, i, j;
  std::vector<T>        a;
};

/*
   Vectors of blocks of 3 in single precision have four numbers a node: one load takes a node, and the fourth is zero in all that is multiplied.
   Others are as they are in PETSc
*/
template <class T, int BS>
struct AinsworthLanes {
  static constexpr bool     packed = std::is_same<T, float>::value && BS == 3;
  static constexpr PetscInt stride(PetscInt bs) { return packed ? 4 : bs; }
};
template <class T>
inline PetscInt AinsworthStride(PetscInt bs)
{
  return std::is_same<T, float>::value && bs == 3 ? 4 : bs;
}

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

/* Four numbers at a time, with what every compiler for PETSc on this kind of machine understands; elsewhere plain loops take its place */
#if defined(__GNUC__)
  #define AINSWORTH_VECTORS 1
typedef float        AinsworthFour __attribute__((vector_size(16)));
inline AinsworthFour AinsworthLoad(const float *p)
{
  AinsworthFour v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}
#endif

template <class T>
template <int BS, class F>
void AinsworthProduct<T>::passBlocks(const T *x, T *y, F finish) const
{
  const AinsworthUpper<T> &U  = *upper;
  const PetscInt           bs = BS ? BS : U.bs;

#if defined(AINSWORTH_VECTORS)
  if constexpr (AinsworthLanes<T, BS>::packed) {
    for (PetscInt i = 0; i < U.n; i++) {
      const PetscInt      first = U.i[i];
      const float        *a     = U.a.data() + (size_t)first * 9;
      const AinsworthFour xi = AinsworthLoad(x + 4 * i), x0 = {xi[0], xi[0], xi[0], xi[0]}, x1 = {xi[1], xi[1], xi[1], xi[1]},
                          x2 = {xi[2], xi[2], xi[2], xi[2]};
      AinsworthFour s0 = AinsworthLoad(a) * xi, s1 = AinsworthLoad(a + 3) * xi, s2 = AinsworthLoad(a + 6) * xi; /* the diagonal block */

      for (PetscInt k = first + 1; k < U.i[i + 1]; k++) {
        a += 9;
        float              *yj = y + 4 * U.j[k];
        const AinsworthFour a0 = AinsworthLoad(a), a1 = AinsworthLoad(a + 3), a2 = AinsworthLoad(a + 6), xj = AinsworthLoad(x + 4 * U.j[k]);
        s0 += a0 * xj;
        s1 += a1 * xj;
        s2 += a2 * xj;
        const AinsworthFour sum = AinsworthLoad(yj) + a0 * x0 + a1 * x1 + a2 * x2;
        __builtin_memcpy(yj, &sum, sizeof(sum));
      }
      float *yi = y + 4 * i;
      yi[0] += (s0[0] + s0[1]) + s0[2];
      yi[1] += (s1[0] + s1[1]) + s1[2];
      yi[2] += (s2[0] + s2[1]) + s2[2];
      yi[3] = 0.0f;
      finish(i, yi);
    }
    return;
  }
#endif
  const PetscInt s = stride();
  std::vector<T> more(BS ? 0 : 2 * bs);
  T              fixed[BS ? 2 * BS : 1], *xi = BS ? fixed : more.data(), *yi = xi + bs; /* of the present row, in registers where the size is known */
  for (PetscInt i = 0; i < U.n; i++) {
    for (PetscInt p = 0; p < bs; p++) {
      xi[p] = x[i * s + p];
      yi[p] = 0;
    }
    for (PetscInt k = U.i[i]; k < U.i[i + 1]; k++) {
      const T *a = U.a.data() + (size_t)k * bs * bs, *xj = x + (size_t)U.j[k] * s;
      T       *yj = y + (size_t)U.j[k] * s;

      for (PetscInt p = 0; p < bs; p++)
        for (PetscInt q = 0; q < bs; q++) yi[p] += a[p * bs + q] * xj[q];
      if (k == U.i[i]) continue; /* the diagonal block counts once */
      for (PetscInt q = 0; q < bs; q++) {
        T sum = yj[q];
        for (PetscInt p = 0; p < bs; p++) sum += AinsworthConj(a[p * bs + q]) * xi[p];
        yj[q] = sum;
      }
    }
    T *out = y + (size_t)i * s;
    for (PetscInt p = 0; p < bs; p++) out[p] += yi[p];
    finish(i, out);
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
