/* What conjugate gradients side by side compute for each vector of a multivector */
#ifndef AINSWORTH_COLUMNS_H
#define AINSWORTH_COLUMNS_H

#include "../base/eigen.h"
#include <array>

template <int W>
using AinsworthValues = std::array<PetscScalar, W>; /* a number for each vector of a multivector */

/* The coefficients of conjugate gradients for one right-hand side */
struct AinsworthLanczos {
  std::vector<PetscReal> alpha, beta;

  /* Returns the smallest eigenvalue of the Lanczos matrix in *smallest */
  PetscErrorCode smallest(PetscReal *value) const
  {
    const size_t             k = alpha.size();
    std::vector<PetscScalar> T(k * k, 0.0);
    std::vector<PetscReal>   values(k);
    PetscBLASInt             info;

    PetscFunctionBegin;
    for (size_t i = 0; i < k; i++) {
      T[i * k + i] = 1.0 / alpha[i] + (i ? beta[i - 1] / alpha[i - 1] : 0.0);
      if (i) T[i * k + i - 1] = T[(i - 1) * k + i] = PetscSqrtReal(beta[i - 1]) / alpha[i - 1];
    }
    PetscCall(AinsworthHermitianEigen((PetscInt)k, T.data(), values.data(), &info));
    *value = info ? 0.0 : values[0];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

/* Computes y_k' x_k for all vectors k. Collective */
template <int W>
inline PetscErrorCode AinsworthDots(Vec x, Vec y, AinsworthValues<W> *dots)
{
  const PetscScalar *a, *b;
  PetscInt           n;
  AinsworthValues<W> sums = {};

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArrayRead(x, &a));
  PetscCall(VecGetArrayRead(y, &b));
  for (PetscInt l = 0; l < n; l += W)
    for (int k = 0; k < W; k++) sums[k] += a[l + k] * PetscConj(b[l + k]);
  PetscCall(VecRestoreArrayRead(y, &b));
  PetscCall(VecRestoreArrayRead(x, &a));
  PetscCall(MPIU_Allreduce(sums.data(), dots->data(), W, MPIU_SCALAR, MPIU_SUM, PetscObjectComm((PetscObject)x)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y_k = first_k x_k + second_k y_k for all vectors k */
template <int W>
inline PetscErrorCode AinsworthCombine(const AinsworthValues<W> &first, Vec x, const AinsworthValues<W> &second, Vec y)
{
  const PetscScalar       *a;
  PetscScalar             *b;
  PetscInt                 n;
  const AinsworthValues<W> s = first, t = second;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArrayRead(x, &a));
  PetscCall(VecGetArray(y, &b));
  for (PetscInt l = 0; l < n; l += W)
    for (int k = 0; k < W; k++) b[l + k] = s[k] * a[l + k] + t[k] * b[l + k];
  PetscCall(VecRestoreArray(y, &b));
  PetscCall(VecRestoreArrayRead(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

template <int W>
inline AinsworthValues<W> AinsworthAll(PetscScalar value)
{
  AinsworthValues<W> values;

  values.fill(value);
  return values;
}

#endif
