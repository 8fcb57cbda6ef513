#include "incomplete.h"
#include "definite.h"
#include <algorithm>

/*
   Each row changes the later ones that it is coupled with, U_jl -= U_kj' D_k^{-1} U_kl where there is such a block, in
   place
*/
template <int BS>
bool AinsworthIncomplete::factor()
{
  const Rows                  &U  = *pattern;
  const PetscInt               bs = BS ? BS : U.br, size = bs * bs;
  std::vector<PetscInt>        at(U.n, -1); /* of the block of the current row in each column */
  std::vector<PetscScalar>     pivot(size);
  std::vector<AinsworthSingle> product; /* D_k^{-1} U_kl */

  for (PetscInt k = 0; k < U.n; k++) {
    if (comesLast(k)) continue;
    const PetscInt   first = U.i[k] + 1, count = U.i[k + 1] - first;
    AinsworthSingle *D = &values[(size_t)U.i[k] * size], *row = D + size;

    for (PetscInt q = 0; q < size; q++) pivot[q] = D[q];
    for (PetscInt c = 0; c < bs; c++)
      if (D[c * bs + c] == AinsworthSingle(0)) pivot[c * bs + c] = 1.0;
    if (!AinsworthInvertDefinite<BS>(bs, pivot.data())) return false;
    for (PetscInt q = 0; q < size; q++) D[q] = (AinsworthSingle)pivot[q];
    product.assign((size_t)count * size, AinsworthSingle(0));
    for (PetscInt e = 0; e < count; e++) {
      at[U.j[first + e]] = e;
      for (PetscInt p = 0; p < bs; p++)
        for (PetscInt r = 0; r < bs; r++)
          for (PetscInt q = 0; q < bs; q++)
            product[e * size + p * bs + q] += D[p * bs + r] * row[e * size + r * bs + q];
    }
    for (PetscInt e = 0; e < count; e++) {
      const PetscInt         j = U.j[first + e];
      const AinsworthSingle *a = row + e * size;

      for (PetscInt f = U.i[j]; f < U.i[j + 1]; f++) {
        if (at[U.j[f]] < 0) continue;
        const AinsworthSingle *b  = &product[at[U.j[f]] * size];
        AinsworthSingle       *to = &values[(size_t)f * size];

        for (PetscInt r = 0; r < bs; r++)
          for (PetscInt p = 0; p < bs; p++)
            for (PetscInt q = 0; q < bs; q++) to[p * bs + q] -= AinsworthConj(a[r * bs + p]) * b[r * bs + q];
      }
    }
    for (PetscInt e = 0; e < count; e++) at[U.j[first + e]] = -1;
  }
  return true;
}

/* Adds the blocks that have a place */
void AinsworthIncomplete::add(const AinsworthBlockRows &added, const PetscReal *scale)
{
  const Rows    &U  = *pattern;
  const PetscInt bs = U.br;

  for (PetscInt i = 0; i < added.n; i++)
    for (PetscInt e = added.i[i]; e < added.i[i + 1]; e++) {
      const PetscInt     j  = added.j[e];
      const PetscScalar *a  = added.block(e);
      const auto         to = std::find(U.j.begin() + U.i[i], U.j.begin() + U.i[i + 1], j);

      if (to == U.j.begin() + U.i[i + 1]) continue;
      for (PetscInt p = 0; p < bs; p++)
        for (PetscInt q = 0; q < bs; q++)
          values[(size_t)(to - U.j.begin()) * bs * bs + p * bs + q] += (AinsworthSingle)(a[p * bs + q] *
                                                                                         scale[i * bs + p] *
                                                                                         scale[j * bs + q]);
    }
}

/* Moves couplings with nodes that come last into the rows of the others, and drops the rest of their rows */
void AinsworthIncomplete::moveLast(const std::vector<char> &last)
{
  const Rows                  &U  = *pattern;
  const PetscInt               bs = U.br, size = bs * bs;
  auto                         moved = std::make_shared<Rows>(bs, bs);
  std::vector<PetscInt>        next;
  std::vector<AinsworthSingle> sorted;
  auto                         row = [&](PetscInt i, PetscInt j) { return !last[i] ? i : !last[j] ? j : -1; };

  moved->n = U.n;
  moved->i.assign(U.n + 1, 0);
  for (PetscInt i = 0; i < U.n; i++)
    for (PetscInt e = U.i[i]; e < U.i[i + 1]; e++)
      if (row(i, U.j[e]) >= 0) moved->i[row(i, U.j[e]) + 1]++;
  for (PetscInt i = 0; i < U.n; i++) {
    moved->i[i + 1] += moved->i[i];
    next.push_back(moved->i[i] + 1); /* the diagonal is the first one */
  }
  moved->j.resize(moved->i[U.n]);
  sorted.resize(moved->j.size() * size);
  for (PetscInt i = 0; i < U.n; i++)
    for (PetscInt e = U.i[i]; e < U.i[i + 1]; e++) {
      const PetscInt j = U.j[e], to = row(i, j);

      if (to < 0) continue;
      const PetscInt         at   = i == j ? moved->i[i] : next[to]++;
      const AinsworthSingle *from = &values[(size_t)e * size];
      AinsworthSingle       *a    = &sorted[(size_t)at * size];

      moved->j[at] = to == i ? j : i;
      for (PetscInt p = 0; p < bs; p++)
        for (PetscInt q = 0; q < bs; q++) a[p * bs + q] = to == i ? from[p * bs + q] : AinsworthConj(from[q * bs + p]);
    }
  pattern = moved;
  values  = std::move(sorted);
}

std::shared_ptr<const AinsworthIncomplete> AinsworthIncomplete::create(const std::shared_ptr<const Rows> &upper,
                                                                       const AinsworthBlockRows          *added,
                                                                       const PetscReal                   *scale,
                                                                       const std::vector<char>           &last)
{
  auto created = std::make_shared<AinsworthIncomplete>();
  bool exists  = false;

  created->pattern = upper;
  created->values  = upper->a;
  if (added) created->add(*added, scale);
  if (!last.empty()) created->moveLast(last);
  AinsworthDispatch(upper->br, [&](auto BS) { exists = created->factor<BS()>(); });
  if (!exists) created.reset();
  return created;
}

/* Whether one load takes a node, and those of a row read values of the next one, or zeros, for the rest of it */
template <int BS, int W>
constexpr bool Packed()
{
#if defined(__GNUC__)
  return std::is_same<AinsworthSingle, float>::value && W == 1 && (BS == 3 || BS == 6);
#else
  return false;
#endif
}

/* Computes x -= a' y for a block */
template <int BS, int W>
AINSWORTH_INLINE void Subtract(PetscInt size, const AinsworthSingle *a, const AinsworthSingle *y, AinsworthSingle *x)
{
  const PetscInt bs = BS ? BS : size;

#if defined(__GNUC__)
  if constexpr (Packed<BS, W>()) {
    typedef typename AinsworthPackOf<float, AinsworthStride<float>(BS)>::type Pack;
    Pack                                                                      v = *(const Pack *)x;

    for (int p = 0; p < BS; p++) v -= *(const Pack *)(a + BS * p) * y[p];
    *(Pack *)x = v;
    return;
  }
#endif
  for (PetscInt p = 0; p < bs; p++)
    for (PetscInt q = 0; q < bs; q++)
      for (PetscInt l = 0; l < W; l++) x[q * W + l] -= AinsworthConj(a[p * bs + q]) * y[p * W + l];
}

/* Computes the sum of products with the blocks of a row right of the diagonal, a; columns: of these; s: as in x */
template <int BS, int W>
AINSWORTH_INLINE void Sum(PetscInt size, PetscInt s, const AinsworthSingle *a, const PetscInt *columns, PetscInt count,
                          const AinsworthSingle *x, AinsworthSingle *sum)
{
  const PetscInt bs = BS ? BS : size;

#if defined(__GNUC__)
  if constexpr (Packed<BS, W>()) {
    typedef typename AinsworthPackOf<float, AinsworthStride<float>(BS)>::type Pack;
    Pack                                                                      v[BS] = {};

    for (PetscInt e = 0; e < count; e++, a += BS * BS) {
      const Pack from = *(const Pack *)(x + (size_t)columns[e] * s);

      for (int p = 0; p < BS; p++) v[p] += *(const Pack *)(a + BS * p) * from;
    }
    for (int p = 0; p < BS; p++) {
      sum[p] = v[p][0];
      for (int q = 1; q < BS; q++) sum[p] += v[p][q];
    }
    return;
  }
#endif
  std::fill_n(sum, bs * W, AinsworthSingle(0));
  for (PetscInt e = 0; e < count; e++, a += bs * bs) {
    const AinsworthSingle *from = x + (size_t)columns[e] * s;

    for (PetscInt p = 0; p < bs; p++)
      for (PetscInt q = 0; q < bs; q++)
        for (PetscInt l = 0; l < W; l++) sum[p * W + l] += a[p * bs + q] * from[q * W + l];
  }
}

/* Computes z = D v for a block */
template <int BS, int W>
AINSWORTH_INLINE void Multiply(PetscInt size, const AinsworthSingle *D, const AinsworthSingle *v, AinsworthSingle *z)
{
  const PetscInt bs = BS ? BS : size;

  for (PetscInt p = 0; p < bs; p++)
    for (PetscInt l = 0; l < W; l++) {
      z[p * W + l] = 0;
      for (PetscInt q = 0; q < bs; q++) z[p * W + l] += D[p * bs + q] * v[q * W + l];
    }
}

/* Solves (U' + D) y = x in x as D^{-1} y; what x has beyond a node is zero then */
template <int BS, int W>
AINSWORTH_CLONES void AinsworthIncomplete::forwardBlocks(AinsworthSingle *x) const
{
  const Rows    &U  = *pattern;
  const PetscInt bs = BS ? BS : U.br, size = bs * bs, s = AinsworthStride<AinsworthSingle>(bs, W), n = bs * W;
  std::vector<AinsworthSingle> more(BS ? 0 : n);
  AinsworthSingle              few[(BS ? BS : 1) * W], *y = BS ? few : more.data();

  for (PetscInt k = 0; k < U.n; k++) {
    if (comesLast(k)) continue;
    const AinsworthSingle *a = &values[(size_t)U.i[k] * size];

    Multiply<BS, W>(bs, a, x + k * s, y);
    std::fill(std::copy_n(y, n, x + k * s), x + (k + 1) * s, AinsworthSingle(0));
    for (PetscInt e = U.i[k] + 1; e < U.i[k + 1]; e++) {
      a += size;
      AinsworthPrefetch<BS * BS>(a);
      Subtract<BS, W>(bs, a, y, x + (size_t)U.j[e] * s);
    }
  }
  for (PetscInt k = 0; k < U.n; k++)
    if (comesLast(k)) std::fill(x + k * s + n, x + (k + 1) * s, AinsworthSingle(0));
}

/* Solves D^{-1} (D + U) x = y for y in x */
template <int BS, int W>
AINSWORTH_CLONES void AinsworthIncomplete::backwardBlocks(AinsworthSingle *x) const
{
  const Rows    &U  = *pattern;
  const PetscInt bs = BS ? BS : U.br, size = bs * bs, s = AinsworthStride<AinsworthSingle>(bs, W), n = bs * W;
  std::vector<AinsworthSingle> more(BS ? 0 : 2 * n);
  AinsworthSingle              few[2 * (BS ? BS : 1) * W], *sum = BS ? few : more.data(), *y = sum + n;

  for (PetscInt k = U.n - 1; k >= 0; k--) {
    if (comesLast(k)) continue;
    const AinsworthSingle *D = &values[(size_t)U.i[k] * size];

    Sum<BS, W>(bs, s, D + size, U.j.data() + U.i[k] + 1, U.i[k + 1] - U.i[k] - 1, x, sum);
    Multiply<BS, W>(bs, D, sum, y);
    for (PetscInt l = 0; l < n; l++) x[k * s + l] -= y[l];
  }
}

void AinsworthIncomplete::forward(PetscInt width, AinsworthSingle *x) const
{
  AinsworthDispatchWidth(
    width, [&](auto W) { AinsworthDispatch(pattern->br, [&](auto BS) { forwardBlocks<BS(), W()>(x); }); });
}

void AinsworthIncomplete::backward(PetscInt width, AinsworthSingle *x) const
{
  AinsworthDispatchWidth(
    width, [&](auto W) { AinsworthDispatch(pattern->br, [&](auto BS) { backwardBlocks<BS(), W()>(x); }); });
}
