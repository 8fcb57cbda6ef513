/* Products of small dense blocks stored by rows, with compile-time dimensions for common sizes */
#ifndef AINSWORTH_KERNELS_H
#define AINSWORTH_KERNELS_H

#include "../base/multivector.h"
#include <complex>
#include <cstdint>
#include <cstring>
#include <type_traits>

/*
   A function that is compiled twice, for processors that multiply and add in one instruction and for all others. The
   block products in it take .6 of the time there; they are inlined whatever the compiler thinks of their size
*/
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__gnu_linux__) && \
  !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  #define AINSWORTH_CLONES __attribute__((target_clones("fma", "default")))
  #define AINSWORTH_INLINE inline __attribute__((always_inline))
#else
  #define AINSWORTH_CLONES
  #define AINSWORTH_INLINE inline
#endif

/*
   Prefetches the n values after those that will be used about 2 KiB later: a matrix that streams through the cache once
   is read at .9 instead of .6 of the bandwidth. They stay in all caches (locality 3): with 0 Intel's keep no level that
   is visited again, and solves take 1.7 times as long
*/
template <int N, class T>
AINSWORTH_INLINE void AinsworthPrefetch(const T *a)
{
#if defined(__GNUC__)
  for (const char *p = (const char *)a + 2048, *end = p + N * sizeof(T); p < end; p += 64) __builtin_prefetch(p, 0, 3);
#else
  (void)a;
#endif
}

/* Scalar type of levels in single precision */
#if defined(PETSC_USE_COMPLEX)
typedef std::complex<float> AinsworthSingle;
#else
typedef float AinsworthSingle;
#endif

template <class T>
inline T AinsworthConj(T v)
{
  if constexpr (std::is_floating_point<T>::value) return v;
  else return std::conj(v);
}

/* Returns a power of two near v^{-1/root}, v >= 0 */
inline PetscReal AinsworthInversePower(PetscReal v, int root)
{
  int exponent = 0;

  if (v > 0.0) (void)frexp((double)v, &exponent);
  return (PetscReal)ldexp(1.0, -exponent / root);
}

/* Returns 1/w for a power of two w from 2^{-1022} to 2^{1022}, without a division */
inline double AinsworthReciprocal(double w)
{
  std::int64_t bits;

  std::memcpy(&bits, &w, sizeof(w));
  bits = 0x7FE0000000000000 - bits; /* twice the exponent of 1, minus that of w */
  std::memcpy(&w, &bits, sizeof(w));
  return w;
}

/*
   Values of one unknown in L vectors of a multivector, which fill a register: processors have none for more than 32
   bytes that compilers use without a flag
*/
template <class T, int L>
struct AinsworthPackOf {
  struct type {
    T    v[L];
    void operator+=(const type &other)
    {
      for (int k = 0; k < L; k++) v[k] += other.v[k];
    }
    friend type operator*(T a, type p)
    {
      for (T &value : p.v) value *= a;
      return p;
    }
  };
};
#if defined(__GNUC__)
template <int L>
struct AinsworthPackOf<float, L> {
  typedef float type __attribute__((vector_size(L * sizeof(float)), aligned(sizeof(float)), may_alias));
};
template <int L>
struct AinsworthPackOf<double, L> {
  typedef double type __attribute__((vector_size(L * sizeof(double)), aligned(sizeof(double)), may_alias));
};
#endif
template <class T, int W>
struct AinsworthPacks {
  static constexpr int lanes = W * sizeof(T) <= 32 ? W : 32 / sizeof(T) > 0 ? 32 / sizeof(T) : 1, count = W / lanes;
  typedef typename AinsworthPackOf<T, lanes>::type type;
};

/* Calls f(AinsworthSize<bs>), or f(AinsworthSize<0>) if the size is not a common one */
template <class F>
inline void AinsworthDispatch(PetscInt bs, F f)
{
  if (bs == 1) f(AinsworthSize<1>());
  else if (bs == 2) f(AinsworthSize<2>());
  else if (bs == 3) f(AinsworthSize<3>());
  else if (bs == 6) f(AinsworthSize<6>());
  else f(AinsworthSize<0>());
}

/* The same for the two block sizes of an interpolation */
template <class F>
inline void AinsworthDispatch(PetscInt br, PetscInt bc, F f)
{
  if (br == 3 && bc == 6) f(AinsworthSize<3>(), AinsworthSize<6>());
  else if (br == 6 && bc == 6) f(AinsworthSize<6>(), AinsworthSize<6>());
  else if (br == 2 && bc == 3) f(AinsworthSize<2>(), AinsworthSize<3>());
  else if (br == 3 && bc == 3) f(AinsworthSize<3>(), AinsworthSize<3>());
  else if (br == 1 && bc == 1) f(AinsworthSize<1>(), AinsworthSize<1>());
  else f(AinsworthSize<0>(), AinsworthSize<0>());
}

#if defined(__GNUC__)
/* Vector types of GCC, Clang, and the Intel compilers; other compilers use scalar loops */
typedef float  AinsworthFour __attribute__((vector_size(16), aligned(4)));
typedef double AinsworthTwo __attribute__((vector_size(16), aligned(8)));
typedef float  AinsworthTwoSingle __attribute__((vector_size(8), aligned(4)));

AINSWORTH_INLINE AinsworthTwo AinsworthLoadTwo(const double *a)
{
  return *(const AinsworthTwo *)a;
}
AINSWORTH_INLINE AinsworthTwo AinsworthLoadTwo(const float *a)
{
  return __builtin_convertvector(*(const AinsworthTwoSingle *)a, AinsworthTwo);
}

/* Computes Z += X Y for A rows of Z of 2 H entries; X(r, l) is at x[r * xr + l * xl] */
template <int A, int K, int H, class V>
AINSWORTH_INLINE void AinsworthRowsMultAddTwo(const double *x, int xr, int xl, const V *y, double *z)
{
  AinsworthTwo s[A][H];

  for (int a = 0; a < A; a++)
    for (int h = 0; h < H; h++) s[a][h] = *(const AinsworthTwo *)(z + (a * H + h) * 2);
  for (int l = 0; l < K; l++)
    for (int a = 0; a < A; a++) {
      const AinsworthTwo v = {x[a * xr + l * xl], x[a * xr + l * xl]};
      for (int h = 0; h < H; h++) s[a][h] += v * AinsworthLoadTwo(y + (l * H + h) * 2);
    }
  for (int a = 0; a < A; a++)
    for (int h = 0; h < H; h++) *(AinsworthTwo *)(z + (a * H + h) * 2) = s[a][h];
}
#endif

/* Computes z += x y with x of size R x K and y of size K x C; a template size of 0 stands for the run-time size */
template <int R, int K, int C, class V>
AINSWORTH_INLINE void AinsworthMultAdd(PetscInt r, PetscInt k, PetscInt c, const PetscScalar *PETSC_RESTRICT x,
                                       const V *PETSC_RESTRICT y, PetscScalar *PETSC_RESTRICT z)
{
#if defined(__GNUC__) && defined(PETSC_USE_REAL_DOUBLE) && !defined(PETSC_USE_COMPLEX)
  if constexpr (R == 6 && K == 6 && C == 6) {
    for (int a = 0; a < 6; a += 2) AinsworthRowsMultAddTwo<2, 6, 3>(x + 6 * a, 6, 1, y, z + 6 * a);
    return;
  } else if constexpr ((R == 1 || (R == 3 && K == 3)) && K > 0 && C == 6) {
    AinsworthRowsMultAddTwo<R, K, 3>(x, K, 1, y, z);
    return;
  }
#endif
  const PetscInt nr = R ? R : r, nk = K ? K : k, nc = C ? C : c;

  for (PetscInt a = 0; a < nr; a++)
    for (PetscInt l = 0; l < nk; l++) {
      const PetscScalar v = x[a * nk + l];
      for (PetscInt b = 0; b < nc; b++) z[a * nc + b] += v * (PetscScalar)y[l * nc + b];
    }
}

/* Computes y += a x with a of size R x C */
template <int R, int C, class T, class V>
AINSWORTH_INLINE void AinsworthMultVecAdd(PetscInt r, PetscInt c, const T *a, const V *x, V *y)
{
#if defined(__GNUC__)
  if constexpr (R > 0 && C == 6 && std::is_same<V, double>::value &&
                (std::is_same<T, double>::value || std::is_same<T, float>::value)) {
    const AinsworthTwo x0 = AinsworthLoadTwo(x), x2 = AinsworthLoadTwo(x + 2), x4 = AinsworthLoadTwo(x + 4);

    for (int p = 0; p < R; p++, a += 6) {
      const AinsworthTwo s = AinsworthLoadTwo(a) * x0 + AinsworthLoadTwo(a + 2) * x2 + AinsworthLoadTwo(a + 4) * x4;

      y[p] += s[0] + s[1];
    }
    return;
  }
#endif
  const PetscInt nr = R ? R : r, nc = C ? C : c;

  for (PetscInt p = 0; p < nr; p++) {
    V sum = 0;
    for (PetscInt q = 0; q < nc; q++) sum += (V)a[p * nc + q] * x[q];
    y[p] += sum;
  }
}

/* Computes z += x' y with x of size K x R and y of size K x C */
template <int R, int K, int C>
AINSWORTH_INLINE void AinsworthMultAdjointAdd(PetscInt r, PetscInt k, PetscInt c, const PetscScalar *PETSC_RESTRICT x,
                                              const PetscScalar *PETSC_RESTRICT y, PetscScalar *PETSC_RESTRICT z)
{
#if defined(__GNUC__) && defined(PETSC_USE_REAL_DOUBLE) && !defined(PETSC_USE_COMPLEX)
  if constexpr (R == 6 && (K == 3 || K == 6) && C == 6) {
    for (int a = 0; a < 6; a += 2) AinsworthRowsMultAddTwo<2, K, 3>(x + a, 1, 6, y, z + 6 * a);
    return;
  }
#endif
  const PetscInt nr = R ? R : r, nk = K ? K : k, nc = C ? C : c;

  for (PetscInt l = 0; l < nk; l++)
    for (PetscInt a = 0; a < nr; a++) {
      const PetscScalar v = AinsworthConj(x[l * nr + a]);
      for (PetscInt b = 0; b < nc; b++) z[a * nc + b] += v * y[l * nc + b];
    }
}

/* Computes y += a x or, if transposed, y += a^T x or y += a' x for multivectors, with a of size R x C */
template <bool transposed, bool conjugated, int R, int C, int W, class T, class V>
AINSWORTH_INLINE void AinsworthMultWideAdd(PetscInt r, PetscInt c, const T *PETSC_RESTRICT a, const V *PETSC_RESTRICT x,
                                           V *PETSC_RESTRICT y)
{
  typedef AinsworthPacks<V, W> Packs;
  typedef typename Packs::type Pack;
  const PetscInt               nr = R ? R : r, nc = C ? C : c;
  const Pack                  *from = (const Pack *)x;
  Pack                        *to   = (Pack *)y;

  for (int h = 0; h < Packs::count; h++)
    for (PetscInt p = 0; p < nr; p++)
      if constexpr (transposed) {
        const Pack v = from[p * Packs::count + h];
        for (PetscInt q = 0; q < nc; q++)
          to[q * Packs::count + h] += (V)(conjugated ? AinsworthConj(a[p * nc + q]) : a[p * nc + q]) * v;
      } else {
        Pack sum = to[p * Packs::count + h];
        for (PetscInt q = 0; q < nc; q++) sum += (V)a[p * nc + q] * from[q * Packs::count + h];
        to[p * Packs::count + h] = sum;
      }
}

#endif
