/* Eigenvalues of small dense matrices */
#ifndef AINSWORTH_EIGEN_H
#define AINSWORTH_EIGEN_H

#include "petsccompat.h"
#include <petscblaslapack.h>
#include <vector>

/*
   Computes the eigenvalues, ascending, and the eigenvectors, which replace the entries, of a Hermitian matrix with n
   rows, on this rank alone; info: what LAPACK says, 0 for success
*/
inline PetscErrorCode AinsworthHermitianEigen(PetscInt n, PetscScalar a[], PetscReal values[], PetscBLASInt *info)
{
  static const PetscInt    columns = 64; /* of LAPACK's blocks, at most */
  PetscBLASInt             nb, lwork;
  std::vector<PetscScalar> work(columns * n);
  std::vector<PetscReal>   real(3 * n);

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(PetscBLASIntCast((PetscInt)work.size(), &lwork));
#if defined(PETSC_USE_COMPLEX)
  PetscCallBLAS("LAPACKsyev", LAPACKsyev_("V", "U", &nb, a, &nb, values, work.data(), &lwork, real.data(), info));
#else
  PetscCallBLAS("LAPACKsyev", LAPACKsyev_("V", "U", &nb, a, &nb, values, work.data(), &lwork, info));
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
