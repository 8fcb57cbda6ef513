/*
   Products y = A x with a Hermitian block matrix: of the blocks between owned nodes only half are stored, and each is
   used twice

   The diagonal block comes first in each row. The values are padded because a load of four numbers may read past the
   last block
*/
#ifndef AINSWORTH_PRODUCT_H
#define AINSWORTH_PRODUCT_H

#include "lowbits.h"
#include <algorithm>

/*
   Returns the number of values per node in vectors: the block size times the width, but 4 and 8 for blocks of 3 and 6
   in single precision and a width of 1, so that one load takes a node

   The numbers beyond the block are zero in all vectors that are multiplied
*/
template <class T>
constexpr PetscInt AinsworthStride(PetscInt bs, PetscInt width = 1)
{
  if (!std::is_same<T, float>::value || width > 1) return bs * width;
  return bs == 3 ? 4 : bs == 6 ? 8 : bs;
}

#if defined(__GNUC__)
/* One load takes a row of a block, and values of the next one or of the padding, which the padding of sum cancels */
template <int BS>
AINSWORTH_INLINE void AinsworthRowPacked(const AinsworthBlockRowsOf<float> &U, PetscInt i, const float *x, float *y,
                                         float *sum)
{
  constexpr int                                    S = BS == 3 ? 4 : 8;
  typedef typename AinsworthPackOf<float, S>::type Pack;
  const float                                     *a  = U.a.data() + (size_t)U.i[i] * BS * BS;
  const Pack                                       xi = *(const Pack *)(x + S * i);
  Pack                                             s[BS], v[BS];

  for (int p = 0; p < BS; p++) {
    s[p] = *(const Pack *)(a + BS * p) * xi;
    v[p] = Pack{} + xi[p];
  }
  for (PetscInt k = U.i[i] + 1; k < U.i[i + 1]; k++) {
    a += BS * BS;
    AinsworthPrefetch<BS * BS>(a);
    Pack      *yj = (Pack *)(y + (size_t)S * U.j[k]);
    const Pack xj = *(const Pack *)(x + (size_t)S * U.j[k]);
    Pack       w  = *yj;
    for (int p = 0; p < BS; p++) {
      const Pack row = *(const Pack *)(a + BS * p);
      s[p] += row * xj;
      w += row * v[p];
    }
    *yj = w;
  }
  for (int p = 0; p < BS; p++) {
    sum[p] = s[p][0];
    for (int q = 1; q < BS; q++) sum[p] += s[p][q];
  }
  for (int p = BS; p < S; p++) sum[p] = -y[S * i + p];
}

/* Processes the rows of each block in pairs of entries; for odd BS the last entry is single */
template <int BS, class Half>
AINSWORTH_INLINE void AinsworthRowOfPairs(const Half &half, PetscInt i, const double *x, double *y, double *sum)
{
  constexpr int             H = BS / 2;
  const auto               &U = AinsworthPattern(half);
  AinsworthHalfValues<Half> a(half, (size_t)U.i[i] * BS * BS);
  const double             *xi = x + BS * i;
  AinsworthTwo              s[BS];
  double                    last[BS];

  for (int p = 0; p < BS; p++) {
    s[p]    = AinsworthTwo{0.0, 0.0};
    last[p] = 0.0;
  }
  for (PetscInt k = U.i[i]; k < U.i[i + 1]; k++, a.advance(BS * BS)) {
    a.template prefetch<BS * BS>();
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
        const AinsworthTwo b = a.two(p * BS + 2 * q);
        s[p] += b * z[q];
        w[q] += b * v;
      }
      if constexpr (BS % 2) {
        const double b = a.one(p * BS + BS - 1);
        last[p] += b * xj[BS - 1];
        end += b * xi[p];
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
template <class T, int BS, class Half>
AINSWORTH_INLINE void AinsworthUpperRow(const Half &half, PetscInt i, const T *x, T *y, T *sum, T *xi)
{
#if defined(__GNUC__)
  if constexpr (std::is_same<T, float>::value && (BS == 3 || BS == 6)) {
    AinsworthRowPacked<BS>(half, i, x, y, sum);
    return;
  } else if constexpr (std::is_same<T, double>::value && BS > 1) {
    AinsworthRowOfPairs<BS>(half, i, x, y, sum);
    return;
  }
#endif
  const auto               &U  = AinsworthPattern(half);
  const PetscInt            bs = BS ? BS : U.br, s = AinsworthStride<T>(bs);
  AinsworthHalfValues<Half> a(half, (size_t)U.i[i] * bs * bs);

  for (PetscInt p = 0; p < s; p++) sum[p] = 0;
  for (PetscInt p = 0; p < bs; p++) xi[p] = x[i * s + p];
  for (PetscInt k = U.i[i]; k < U.i[i + 1]; k++, a.advance(bs * bs)) {
    const T *xj = x + (size_t)U.j[k] * s;
    T       *yj = y + (size_t)U.j[k] * s;

    for (PetscInt p = 0; p < bs; p++)
      for (PetscInt q = 0; q < bs; q++) sum[p] += a.one(p * bs + q) * xj[q];
    if (k == U.i[i]) continue;
    for (PetscInt q = 0; q < bs; q++) {
      T t = yj[q];
      for (PetscInt p = 0; p < bs; p++) t += AinsworthConj(a.one(p * bs + q)) * xi[p];
      yj[q] = t;
    }
  }
}

/*
   The same for multivectors, which are not padded: sum has the values of the node's unknowns. A register holds some of
   the vectors; the row is read again for the next ones, from the nearest cache
*/
template <class T, int BS, int W, class Half>
AINSWORTH_INLINE void AinsworthUpperRowWide(const Half &half, PetscInt i, const T *x, T *y, T *sum)
{
  typedef AinsworthPacks<T, W> Packs;
  typedef typename Packs::type Pack;
  constexpr int                H = Packs::count, most = BS ? BS : 1;
  const auto                  &U  = AinsworthPattern(half);
  const PetscInt               bs = BS ? BS : U.br;

  for (int h = 0; h < H; h++) {
    AinsworthHalfValues<Half> a(half, (size_t)U.i[i] * bs * bs);
    const Pack               *first = (const Pack *)x + h, *xi = first + (size_t)i * bs * H;
    Pack                      few[2 * most], *s                = BS ? few : (Pack *)sum + h;
    const int                 stride = BS ? 1 : H;

    for (PetscInt p = 0; p < bs; p++) s[p * stride] = Pack();
    for (PetscInt p = 0; p < BS; p++) few[most + p] = xi[p * H];
    for (PetscInt k = U.i[i]; k < U.i[i + 1]; k++, a.advance(bs * bs)) {
      const Pack *xj   = first + (size_t)U.j[k] * bs * H;
      Pack       *yj   = (Pack *)y + h + (size_t)U.j[k] * bs * H;
      const bool  once = k == U.i[i]; /* the diagonal block */

      if (!h) a.template prefetch<BS * BS>();
      for (PetscInt q = 0; q < bs; q++) {
        const Pack value   = xj[q * H];
        Pack       back[2] = {yj[q * H], Pack()}; /* two, as an addition waits for the one before it */

        for (PetscInt p = 0; p < bs; p++) {
          const T v = a.one(p * bs + q);
          s[p * stride] += v * value;
          back[p % 2] += AinsworthConj(v) * (BS ? few[most + p] : xi[p * H]);
        }
        back[0] += back[1];
        if (!once) yj[q * H] = back[0];
      }
    }
    if constexpr (BS > 0)
      for (int p = 0; p < BS; p++) ((Pack *)sum)[p * H + h] = s[p];
  }
}

/* Products with a multivector of some width, which shares the matrix with those of other widths */
template <class T, class Half = AinsworthBlockRowsOf<T>>
class AinsworthProduct {
public:
  typedef AinsworthBlockRowsOf<T> Rows;

  std::shared_ptr<const Half>             upper; /* blocks between owned nodes on and above the diagonal */
  std::shared_ptr<const Rows>             rest;  /* all other blocks: ghost columns, and a matrix added to A */
  std::shared_ptr<const AinsworthColumns> cols;  /* the columns of both */
  const PetscInt                          width;

  AinsworthProduct(const std::shared_ptr<const Half> &half, const std::shared_ptr<const Rows> &others,
                   const std::shared_ptr<const AinsworthColumns> &columns, PetscInt vectors)
    : upper(half), rest(others), cols(columns), width(vectors), ghost(cols->ghosts.size() * stride()),
      unit(stride() * (PetscInt)sizeof(T), MPI_BYTE)
  {
  }
  PetscInt n() const { return AinsworthPattern(*upper).n; }
  PetscInt bs() const { return AinsworthPattern(*upper).br; }
  PetscInt stride() const { return AinsworthStride<T>(bs(), width); }

  /* Adds the product with all but the upper half to y. Collective */
  PetscErrorCode start(const T *x, T *y)
  {
    PetscFunctionBegin;
    PetscCall(cols->toGhosts(unit.type, x, ghost.data()));
    if (rest->j.size())
      AinsworthDispatchWidth(width, [&](auto W) {
        AinsworthDispatch(bs(), [&](auto B) {
          AinsworthRowsMultAdd<B(), B(), W()>(*rest, rest->a.data(), cols->local, x, ghost.data(), stride(), stride(),
                                              y);
        });
      });
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /*
     Adds the product with the upper half to y, and calls finish(AinsworthSize<bs>, i, y_i) as soon as y_i is complete;
     W: the width
  */
  template <int W, class F>
  void pass(const T *x, T *y, F finish) const
  {
    AinsworthDispatch(bs(), [&](auto BS) { passBlocks<BS(), W>(x, y, finish); });
  }

  /* Computes y = A x and calls finish, as above. Collective */
  template <class F>
  PetscErrorCode mult(const T *x, T *y, F finish)
  {
    PetscFunctionBegin;
    std::fill_n(y, (size_t)n() * stride(), T(0));
    PetscCall(start(x, y));
    AinsworthDispatchWidth(width, [&](auto W) { pass<W()>(x, y, finish); });
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscErrorCode mult(const T *x, T *y)
  {
    return mult(x, y, [](auto, PetscInt, T *) {});
  }

private:
  std::vector<T> ghost;
  AinsworthUnit  unit;

  template <int BS, int W, class F>
  AINSWORTH_CLONES void passBlocks(const T *x, T *y, F finish) const
  {
    const PetscInt s = BS ? AinsworthStride<T>(BS, W) : stride();
    std::vector<T> more(BS ? 0 : 2 * s);
    T              few[2 * (BS ? BS + 2 : 1) * W], *sum = BS ? few : more.data(), *xi = sum + s;

    for (PetscInt i = 0; i < n(); i++) {
      T *yi = y + (size_t)i * s;

      if constexpr (W == 1) AinsworthUpperRow<T, BS>(*upper, i, x, y, sum, xi);
      else AinsworthUpperRowWide<T, BS, W>(*upper, i, x, y, sum);
      for (PetscInt p = 0; p < s; p++) yi[p] += sum[p];
      finish(AinsworthSize<BS>(), i, yi);
    }
  }
};

#endif
