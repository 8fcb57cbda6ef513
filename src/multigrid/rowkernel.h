/* One row of a Hermitian matrix of which the upper half is stored: its part of A x, and what its blocks add to the rows below */
#ifndef AINSWORTH_ROWKERNEL_H
#define AINSWORTH_ROWKERNEL_H

#include "kernels.h"
#include <vector>

/* The blocks between owned nodes at and right of the diagonal, the diagonal block first in each row */
template <class T>
struct AinsworthUpper {
  PetscInt              n = 0, bs = 1;
  std::vector<PetscInt> i, j;
  std::vector<T>        a; /* with room behind the last block, where a load of four may end */
};

/*
   Vectors of blocks of 3 in single precision have four numbers a node: one load takes a node, and the fourth is zero in all that is multiplied.
   Others are as they are in PETSc
*/
template <class T>
inline PetscInt AinsworthStride(PetscInt bs)
{
  return std::is_same<T, float>::value && bs == 3 ? 4 : bs;
}

#if defined(__GNUC__)
/* Some numbers at a time, with what GCC, Clang and the Intel compilers understand; elsewhere the loops at the end take their place */
template <class T, int N>
struct AinsworthVector {
  typedef T type __attribute__((vector_size(N * sizeof(T))));
};
typedef AinsworthVector<float, 4>::type  AinsworthFour;
typedef AinsworthVector<double, 2>::type AinsworthTwo;

template <class V, class T>
inline V AinsworthLoad(const T *p)
{
  V v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}
template <class V, class T>
inline void AinsworthStore(T *p, V v)
{
  __builtin_memcpy(p, &v, sizeof(v));
}

inline void AinsworthRowPacked(const AinsworthUpper<float> &U, PetscInt i, const float *x, float *y, float *sum)
{
  const float        *a  = U.a.data() + (size_t)U.i[i] * 9;
  const AinsworthFour xi = AinsworthLoad<AinsworthFour>(x + 4 * i), x0 = {xi[0], xi[0], xi[0], xi[0]}, x1 = {xi[1], xi[1], xi[1], xi[1]},
                      x2 = {xi[2], xi[2], xi[2], xi[2]};
  AinsworthFour s0 = AinsworthLoad<AinsworthFour>(a) * xi, s1 = AinsworthLoad<AinsworthFour>(a + 3) * xi, s2 = AinsworthLoad<AinsworthFour>(a + 6) * xi;

  for (PetscInt k = U.i[i] + 1; k < U.i[i + 1]; k++) {
    a += 9;
    float              *yj = y + 4 * U.j[k];
    const AinsworthFour a0 = AinsworthLoad<AinsworthFour>(a), a1 = AinsworthLoad<AinsworthFour>(a + 3), a2 = AinsworthLoad<AinsworthFour>(a + 6),
                        xj = AinsworthLoad<AinsworthFour>(x + 4 * U.j[k]);
    s0 += a0 * xj;
    s1 += a1 * xj;
    s2 += a2 * xj;
    AinsworthStore(yj, AinsworthLoad<AinsworthFour>(yj) + a0 * x0 + a1 * x1 + a2 * x2);
  }
  sum[0] = (s0[0] + s0[1]) + s0[2];
  sum[1] = (s1[0] + s1[1]) + s1[2];
  sum[2] = (s2[0] + s2[1]) + s2[2];
  sum[3] = -y[4 * i + 3]; /* what loads of four brought into the fourth number is taken out */
}

/* Nine numbers of a block in four pairs and a single one */
inline void AinsworthRowOfThree(const AinsworthUpper<double> &U, PetscInt i, const double *x, double *y, double *sum)
{
  const double      *a = U.a.data() + (size_t)U.i[i] * 9, *xi = x + 3 * i;
  const AinsworthTwo x0 = {xi[0], xi[0]}, x1 = {xi[1], xi[1]}, x2 = {xi[2], xi[2]};
  AinsworthTwo       s0 = {0.0, 0.0}, s1 = s0, s2 = s0, s3 = s0;
  double             s4 = 0.0;

  for (PetscInt k = U.i[i]; k < U.i[i + 1]; k++, a += 9) {
    const double      *xj = x + 3 * U.j[k];
    double            *yj = y + 3 * U.j[k];
    const AinsworthTwo a0 = AinsworthLoad<AinsworthTwo>(a), a3 = AinsworthLoad<AinsworthTwo>(a + 6), x01 = AinsworthLoad<AinsworthTwo>(xj),
                       x12 = AinsworthLoad<AinsworthTwo>(xj + 1), x20 = {xj[2], xj[0]};
    s0 += a0 * x01;
    s1 += AinsworthLoad<AinsworthTwo>(a + 2) * x20;
    s2 += AinsworthLoad<AinsworthTwo>(a + 4) * x12;
    s3 += a3 * x01;
    s4 += a[8] * xj[2];
    if (k == U.i[i]) continue; /* the diagonal block counts once */
    AinsworthStore(yj, AinsworthLoad<AinsworthTwo>(yj) + a0 * x0 + AinsworthLoad<AinsworthTwo>(a + 3) * x1 + a3 * x2);
    yj[2] += a[2] * xi[0] + a[5] * xi[1] + a[8] * xi[2];
  }
  sum[0] = s0[0] + s0[1] + s1[0];
  sum[1] = s1[1] + s2[0] + s2[1];
  sum[2] = s3[0] + s3[1] + s4;
}

template <int BS>
inline void AinsworthRowOfEven(const AinsworthUpper<double> &U, PetscInt i, const double *x, double *y, double *sum)
{
  constexpr int H = BS / 2;
  const double *a = U.a.data() + (size_t)U.i[i] * BS * BS, *xi = x + BS * i;
  AinsworthTwo  s[BS];

  for (int p = 0; p < BS; p++) s[p] = AinsworthTwo{0.0, 0.0};
  for (PetscInt k = U.i[i]; k < U.i[i + 1]; k++, a += BS * BS) {
    const double *xj = x + BS * U.j[k];
    double       *yj = y + BS * U.j[k];
    AinsworthTwo  z[H], w[H];

    for (int q = 0; q < H; q++) {
      z[q] = AinsworthLoad<AinsworthTwo>(xj + 2 * q);
      w[q] = AinsworthLoad<AinsworthTwo>(yj + 2 * q);
    }
    for (int p = 0; p < BS; p++) {
      const AinsworthTwo v = {xi[p], xi[p]};
      for (int q = 0; q < H; q++) {
        const AinsworthTwo b = AinsworthLoad<AinsworthTwo>(a + p * BS + 2 * q);
        s[p] += b * z[q];
        w[q] += b * v;
      }
    }
    if (k == U.i[i]) continue;
    for (int q = 0; q < H; q++) AinsworthStore(yj + 2 * q, w[q]);
  }
  for (int p = 0; p < BS; p++) sum[p] = s[p][0] + s[p][1];
}
#endif

/* sum = the row's part of (A x)_i; y += what its blocks add to other rows. BS 0: the size is known at run time only, and xi has room for a node */
template <class T, int BS>
inline void AinsworthUpperRow(const AinsworthUpper<T> &U, PetscInt i, const T *x, T *y, T *sum, T *xi)
{
#if defined(__GNUC__)
  if constexpr (std::is_same<T, float>::value && BS == 3) {
    AinsworthRowPacked(U, i, x, y, sum);
    return;
  } else if constexpr (std::is_same<T, double>::value && BS == 3) {
    AinsworthRowOfThree(U, i, x, y, sum);
    return;
  } else if constexpr (std::is_same<T, double>::value && BS > 0 && BS % 2 == 0) {
    AinsworthRowOfEven<BS>(U, i, x, y, sum);
    return;
  }
#endif
  const PetscInt bs = BS ? BS : U.bs, s = AinsworthStride<T>(bs);

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

#endif
