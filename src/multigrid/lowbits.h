/*
   Values in double precision as those in single precision, which the cycle reads as well, and the bits that these lack

   bits(v) = bits((double)s) + low, with s the float next to v: rounding takes the last 29 bits, so that
   |low| <= 2^28. Below 2^{-127} a float has fewer digits, and v loses as many: the diagonal is near 1 (AinsworthScaled)
*/
#ifndef AINSWORTH_LOWBITS_H
#define AINSWORTH_LOWBITS_H

#include "blocks.h"
#include <cmath>

/* Returns the bits that s, the float next to v, lacks; 0 where they are too many */
inline std::int32_t AinsworthLowBits(double v, float s)
{
  const double rounded = s;
  std::int64_t bits[2];

  std::memcpy(bits, &v, sizeof(v));
  std::memcpy(bits + 1, &rounded, sizeof(v));
  return std::fabs(v) < 0x1p-127 ? 0 : (std::int32_t)(bits[0] - bits[1]);
}

/* The same for both parts of a complex number */
inline void AinsworthLowBits(PetscScalar v, AinsworthSingle s, std::int32_t *low)
{
  low[0] = AinsworthLowBits(PetscRealPart(v), std::real(s));
  if constexpr (PetscDefined(USE_COMPLEX)) low[1] = AinsworthLowBits(PetscImaginaryPart(v), std::imag(s));
}

/* Returns v */
AINSWORTH_INLINE double AinsworthJoin(float s, std::int32_t low)
{
  double       v = s;
  std::int64_t bits;

  std::memcpy(&bits, &v, sizeof(v));
  bits += low;
  std::memcpy(&v, &bits, sizeof(v));
  return v;
}

/* Half of a matrix, split; complex values have the bits of both parts, one after the other */
struct AinsworthSplitRows {
  std::shared_ptr<const AinsworthBlockRowsOf<AinsworthSingle>> single;
  std::shared_ptr<const std::vector<std::int32_t>>             low;
};

/* The places of the blocks of half a matrix, whatever its values are stored in */
template <class T>
inline const AinsworthBlockRowsOf<T> &AinsworthPattern(const AinsworthBlockRowsOf<T> &U)
{
  return U;
}
inline const AinsworthBlockRowsOf<AinsworthSingle> &AinsworthPattern(const AinsworthSplitRows &U)
{
  return *U.single;
}

/* Goes through the values of half a matrix from one on */
template <class Half>
class AinsworthHalfValues;

template <class T>
class AinsworthHalfValues<AinsworthBlockRowsOf<T>> {
public:
  AINSWORTH_INLINE      AinsworthHalfValues(const AinsworthBlockRowsOf<T> &U, size_t first) : a(U.a.data() + first) { }
  AINSWORTH_INLINE T    one(PetscInt q) const { return a[q]; }
  AINSWORTH_INLINE void advance(PetscInt n) { a += n; }
  template <int N>
  AINSWORTH_INLINE void prefetch() const
  {
    AinsworthPrefetch<N>(a);
  }
#if defined(__GNUC__)
  AINSWORTH_INLINE AinsworthTwo two(PetscInt q) const
  {
    return *(const AinsworthTwo *)(a + q);
  }
#endif

private:
  const T *a;
};

template <>
class AinsworthHalfValues<AinsworthSplitRows> {
public:
  AINSWORTH_INLINE AinsworthHalfValues(const AinsworthSplitRows &U, size_t first)
    : s((const float *)U.single->a.data() + first * parts), low(U.low->data() + first * parts)
  {
  }
  AINSWORTH_INLINE PetscScalar one(PetscInt q) const
  {
#if defined(PETSC_USE_COMPLEX)
    return PetscScalar(AinsworthJoin(s[2 * q], low[2 * q]), AinsworthJoin(s[2 * q + 1], low[2 * q + 1]));
#else
    return AinsworthJoin(s[q], low[q]);
#endif
  }
  AINSWORTH_INLINE void advance(PetscInt n)
  {
    s += n * parts;
    low += n * parts;
  }
  template <int N>
  AINSWORTH_INLINE void prefetch() const
  {
    AinsworthPrefetch<N * parts>(s);
    AinsworthPrefetch<N * parts>(low);
  }
#if defined(__GNUC__)
  AINSWORTH_INLINE AinsworthTwo two(PetscInt q) const
  {
    typedef std::int32_t TwoInts __attribute__((vector_size(8), aligned(4)));
    typedef std::int64_t TwoLongs __attribute__((vector_size(16)));

    return (AinsworthTwo)((TwoLongs)AinsworthLoadTwo(s + q) +
                          __builtin_convertvector(*(const TwoInts *)(low + q), TwoLongs));
  }
#endif

private:
  static constexpr int parts = sizeof(PetscScalar) / sizeof(PetscReal);
  const float         *s;
  const std::int32_t  *low;
};

#endif
