/*
   Products y = A x with a Hermitian block matrix: of the blocks between owned nodes only half are stored, and each is
   used twice

   The diagonal block comes first in each row. The values are padded because a load of four numbers may read past the
   last block
*/
#ifndef AINSWORTH_PRODUCT_H
#define AINSWORTH_PRODUCT_H

#include "blocks.h"
#include <algorithm>

/*
   Returns the number of values per node in vectors: the block size, but 4 for blocks of 3 in single precision, so that
   one load takes a node

   The fourth number is zero in all vectors that are multiplied
*/
template <class T>
inline PetscInt AinsworthStride(PetscInt bs)
{
  return std::is_same<T, float>::value && bs == 3 ? 4 : bs;
}

#if defined(__GNUC__)
AINSWORTH_INLINE void AinsworthRowPacked(const AinsworthBlockRowsOf<float> &U, PetscInt i, const float *x, float *y,
                                         float *sum)
{
  auto                four = [](const float *p) { return *(const AinsworthFour *)p; };
  const float        *a    = U.a.data() + (size_t)U.i[i] * 9;
  const AinsworthFour xi = four(x + 4 * i), x0 = {xi[0], xi[0], xi[0], xi[0]}, x1 = {xi[1], xi[1], xi[1], xi[1]},
                      x2 = {xi[2], xi[2], xi[2], xi[2]};
  AinsworthFour s0 = four(a) * xi, s1 = four(a + 3) * xi, s2 = four(a + 6) * xi;

  for (PetscInt k = U.i[i] + 1; k < U.i[i + 1]; k++) {
    a += 9;
    AinsworthPrefetch<9>(a);
    AinsworthFour      *yj = (AinsworthFour *)(y + 4 * U.j[k]);
    const AinsworthFour a0 = four(a), a1 = four(a + 3), a2 = four(a + 6), xj = four(x + 4 * U.j[k]);
    s0 += a0 * xj;
    s1 += a1 * xj;
    s2 += a2 * xj;
    *yj = *yj + a0 * x0 + a1 * x1 + a2 * x2;
  }
  sum[0] = (s0[0] + s0[1]) + s0[2];
  sum[1] = (s1[0] + s1[1]) + s1[2];
  sum[2] = (s2[0] + s2[1]) + s2[2];
  sum[3] = -y[4 * i + 3]; /* cancels what loads of four added to the padding */
}

/* Processes the rows of each block in pairs of entries; for odd BS the last entry is single */
template <int BS>
AINSWORTH_INLINE void AinsworthRowOfPairs(const AinsworthBlockRowsOf<double> &U, PetscInt i, const double *x, double *y,
                                          double *sum)
{
  constexpr int H = BS / 2;
  const double *a = U.a.data() + (size_t)U.i[i] * BS * BS, *xi = x + BS * i;
  AinsworthTwo  s[BS];
  double        last[BS];

  for (int p = 0; p < BS; p++) {
    s[p]    = AinsworthTwo{0.0, 0.0};
    last[p] = 0.0;
  }
  for (PetscInt k = U.i[i]; k < U.i[i + 1]; k++, a += BS * BS) {
    AinsworthPrefetch<BS * BS>(a);
    const double *xj = x + BS * U.j[k];
    double       *yj = y + BS * U.j[k], end = 0.0;
    AinsworthTwo  z[H], w[H];

    for (int q = 0; q < H; q++) {
      z[q] = *(const AinsworthTwo *)(xj + 2 * q);
      w[q] = *(const AinsworthTwo *)(yj + 2 * q);
    }
    for (int p = 0; p < BS; p++) {
      const AinsworthTwo v = {xi[p], xi[p]};
      for (int q = 0; q < H; q++) {
        const AinsworthTwo b = *(const AinsworthTwo *)(a + p * BS + 2 * q);
        s[p] += b * z[q];
        w[q] += b * v;
      }
      if constexpr (BS % 2) {
        last[p] += a[p * BS + BS - 1] * xj[BS - 1];
        end += a[p * BS + BS - 1] * xi[p];
      }
    }
    if (k == U.i[i]) continue; /* the diagonal block is used only once */
    for (int q = 0; q < H; q++) *(AinsworthTwo *)(yj + 2 * q) = w[q];
    if constexpr (BS % 2) yj[BS - 1] += end;
  }
  for (int p = 0; p < BS; p++) sum[p] = s[p][0] + s[p][1] + last[p];
}
#endif

/*
   Computes sum, the contribution of row i to (A x)_i, and adds the contributions of its blocks to other rows to y

   BS = 0: the block size is known only at run time; xi is work space for one node
*/
template <class T, int BS>
AINSWORTH_INLINE void AinsworthUpperRow(const AinsworthBlockRowsOf<T> &U, PetscInt i, const T *x, T *y, T *sum, T *xi)
{
#if defined(__GNUC__)
  if constexpr (std::is_same<T, float>::value && BS == 3) {
    AinsworthRowPacked(U, i, x, y, sum);
    return;
  } else if constexpr (std::is_same<T, double>::value && BS > 1) {
    AinsworthRowOfPairs<BS>(U, i, x, y, sum);
    return;
  }
#endif
  const PetscInt bs = BS ? BS : U.br, s = AinsworthStride<T>(bs);

  for (PetscInt p = 0; p < s; p++) sum[p] = 0;
  for (PetscInt p = 0; p < bs; p++) xi[p] = x[i * s + p];
  for (PetscInt k = U.i[i]; k < U.i[i + 1]; k++) {
    const T *a = U.a.data() + (size_t)k * bs * bs, *xj = x + (size_t)U.j[k] * s;
    T       *yj = y + (size_t)U.j[k] * s;

    for (PetscInt p = 0; p < bs; p++)
      for (PetscInt q = 0; q < bs; q++) sum[p] += a[p * bs + q] * xj[q];
    if (k == U.i[i]) continue;
    for (PetscInt q = 0; q < bs; q++) {
      T t = yj[q];
      for (PetscInt p = 0; p < bs; p++) t += AinsworthConj(a[p * bs + q]) * xi[p];
      yj[q] = t;
    }
  }
}

template <class T>
class AinsworthProduct {
public:
  std::shared_ptr<const AinsworthBlockRowsOf<T>> upper; /* blocks between owned nodes on and above the diagonal */
  AinsworthBlockRowsOf<T>                        rest;  /* all other blocks: ghost columns, and a matrix added to A */
  AinsworthColumns                               cols;  /* the columns of both */

  AinsworthProduct(std::shared_ptr<const AinsworthBlockRowsOf<T>> half, AinsworthBlockRowsOf<T> &&others,
                   AinsworthColumns &&columns)
    : upper(half), rest(std::move(others)), cols(std::move(columns)), ghost(cols.ghosts.size() * stride()),
      unit(stride() * (PetscInt)sizeof(T), MPI_BYTE)
  {
  }
  PetscInt n() const { return upper->n; }
  PetscInt bs() const { return upper->br; }
  PetscInt stride() const { return AinsworthStride<T>(upper->br); }

  /* Computes y = A x without the upper half. Collective */
  PetscErrorCode start(const T *x, T *y)
  {
    PetscFunctionBegin;
    PetscCall(cols.toGhosts(unit.type, x, ghost.data()));
    std::fill_n(y, (size_t)n() * stride(), T(0));
    if (rest.j.size())
      AinsworthDispatch(bs(), [&](auto B) {
        AinsworthRowsMultAdd<B(), B()>(rest, rest.a.data(), cols.local, x, ghost.data(), stride(), stride(), y);
      });
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* Adds the product with the upper half to y, and calls finish(i, y_i) as soon as y_i is complete */
  template <class F>
  void pass(const T *x, T *y, F finish) const
  {
    AinsworthDispatch(bs(), [&](auto BS) { passBlocks<BS()>(x, y, finish); });
  }

  PetscErrorCode mult(const T *x, T *y)
  {
    PetscFunctionBegin;
    PetscCall(start(x, y));
    pass(x, y, [](PetscInt, T *) {});
    PetscFunctionReturn(PETSC_SUCCESS);
  }

private:
  std::vector<T> ghost;
  AinsworthUnit  unit;

  template <int BS, class F>
  AINSWORTH_CLONES void passBlocks(const T *x, T *y, F finish) const
  {
    const PetscInt s = stride();
    std::vector<T> more(BS ? 0 : 2 * s);
    T              few[2 * (BS ? BS + 1 : 1)], *sum = BS ? few : more.data(), *xi = sum + s;

    for (PetscInt i = 0; i < n(); i++) {
      T *yi = y + (size_t)i * s;

      AinsworthUpperRow<T, BS>(*upper, i, x, y, sum, xi);
      for (PetscInt p = 0; p < s; p++) yi[p] += sum[p];
      finish(i, yi);
    }
  }
};

#endif
