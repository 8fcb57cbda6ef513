/* Small dense Hermitian matrices */
#ifndef AINSWORTH_DEFINITE_H
#define AINSWORTH_DEFINITE_H

#include "kernels.h"

/*
   Replaces a Hermitian matrix of n rows by its inverse; returns false, and leaves a useless matrix, unless it is
   positive definite
*/
template <int N>
inline bool AinsworthInvertDefinite(PetscInt size, PetscScalar *a)
{
  const PetscInt n = N ? N : size;

  for (PetscInt p = 0; p < n; p++) {
    const PetscReal pivot = PetscRealPart(a[p * n + p]);

    if (!(pivot > 0.0)) return false;
    a[p * n + p] = 1.0;
    for (PetscInt j = 0; j < n; j++) a[p * n + j] /= pivot;
    for (PetscInt i = 0; i < n; i++) {
      const PetscScalar factor = a[i * n + p];

      if (i == p) continue;
      a[i * n + p] = 0.0;
      for (PetscInt j = 0; j < n; j++) a[i * n + j] -= factor * a[p * n + j];
    }
  }
  return true;
}

#endif
