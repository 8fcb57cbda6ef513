#include "moments.h"
#include "../base/eigen.h"
#include <cmath>

/* Below it what is left of a combination of polynomials is rounding, of products in single precision as well */
static const PetscReal roundingOfMoments = 1e-7;

/* AinsworthHash - returns a number in [-1, 1) that depends on l alone, so that it is the same on any number of ranks */
PetscReal AinsworthHash(size_t l)
{
  unsigned long long s = (unsigned long long)l * 0x9E3779B97F4A7C15ull + 0x1234567ull;

  s ^= s >> 29;
  s *= 0xBF58476D1CE4E5B9ull;
  s ^= s >> 32;
  return (PetscReal)((double)(s >> 11) / 4503599627370496.0 - 1.0);
}

/*
   AinsworthMomentsFindLargest - finds the largest Ritz value of a Hermitian operator X in the Krylov space of a vector
   v. Not collective

   Input Parameter:
.  moments - (v, T_k(X) v) for k = 0 to 2 steps - 1; those that overflowed, and what they belong to, are left out

   Output Parameter:
.  largest - the Ritz value; -1 where v is zero or not finite, or LAPACK fails

   The Gram matrix of T_i(X) v is ((v, T_{i+j} v) + (v, T_{|i-j|} v)) / 2, and X T_j = (T_{j+1} + T_{|j-1|}) / 2
*/
PetscErrorCode AinsworthMomentsFindLargest(const std::vector<PetscReal> &moments, PetscReal *largest)
{
  PetscInt     steps = 0, kept = 0;
  PetscBLASInt info;

  PetscFunctionBegin;
  *largest = -1.0;
  for (; steps < (PetscInt)moments.size() / 2; steps++)
    if (!std::isfinite(moments[2 * steps] + moments[2 * steps + 1])) break;
  if (!steps) PetscFunctionReturn(PETSC_SUCCESS);
  std::vector<PetscScalar> gram(steps * steps), basis, shifted;
  std::vector<PetscReal>   values(steps);
  auto                     inner = [&](PetscInt i, PetscInt j) { /* of T_i v and T_j v */
                                             return (moments[i + j] + moments[PetscAbs(i - j)]) / 2;
  };

  for (PetscInt i = 0; i < steps; i++)
    for (PetscInt j = 0; j < steps; j++) gram[i * steps + j] = inner(i, j);
  PetscCall(AinsworthHermitianEigen(steps, gram.data(), values.data(), &info));
  if (info) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < steps; k++) {
    if (!(values[k] > roundingOfMoments * values[steps - 1])) continue;
    for (PetscInt i = 0; i < steps; i++) basis.push_back(gram[k * steps + i] / PetscSqrtReal(values[k]));
    kept++;
  }
  if (!kept) PetscFunctionReturn(PETSC_SUCCESS);
  shifted.assign(kept * kept, 0.0);
  for (PetscInt k = 0; k < kept; k++)
    for (PetscInt l = 0; l < kept; l++)
      for (PetscInt i = 0; i < steps; i++)
        for (PetscInt j = 0; j < steps; j++)
          shifted[k * kept + l] += PetscConj(basis[k * steps + i]) * basis[l * steps + j] *
                                   (inner(i, j + 1) + inner(i, PetscAbs(j - 1))) / (PetscReal)2;
  PetscCall(AinsworthHermitianEigen(kept, shifted.data(), values.data(), &info));
  if (info) PetscFunctionReturn(PETSC_SUCCESS);
  *largest = values[kept - 1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthMomentsReduce - makes moments, (v, T_k v), of the sums of this rank that AinsworthMomentsAdvance() left, as
   T_{i+j} = 2 T_i T_j - T_{|i-j|}. Collective
*/
PetscErrorCode AinsworthMomentsReduce(MPI_Comm comm, std::vector<PetscReal> *moments)
{
  std::vector<PetscReal> &m = *moments;

  PetscFunctionBegin;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, m.data(), (PetscMPIInt)m.size(), MPIU_REAL, MPIU_SUM, comm));
  for (size_t k = 2; k < m.size(); k++) m[k] = 2 * m[k] - m[k % 2];
  PetscFunctionReturn(PETSC_SUCCESS);
}
