/* Small dense Hermitian matrices, the same on all ranks */
#ifndef AINSWORTH_SMALL_H
#define AINSWORTH_SMALL_H

#include "slepccompat.h"
#include <vector>

/* Column by column */
struct AinsworthSmall {
  PetscInt                 rows = 0, cols = 0;
  std::vector<PetscScalar> a;

  AinsworthSmall() = default;
  AinsworthSmall(PetscInt m, PetscInt n) : rows(m), cols(n), a((size_t)m * n, 0.0) { }
  PetscScalar       &operator()(PetscInt i, PetscInt j) { return a[(size_t)j * rows + i]; }
  const PetscScalar &operator()(PetscInt i, PetscInt j) const { return a[(size_t)j * rows + i]; }
};

AinsworthSmall AinsworthSmallProduct(const AinsworthSmall &, const AinsworthSmall &);
AinsworthSmall AinsworthSmallAdjointProduct(const AinsworthSmall &, const AinsworthSmall &); /* A' B */

/* Eigenvalues, ascending, and eigenvectors, which replace the matrix; rank 0 computes them. Collective */
PetscErrorCode AinsworthSmallEigen(MPI_Comm, AinsworthSmall *, std::vector<PetscReal> *);

/*
   Finds T with T' G T = 1 for a positive semidefinite G; directions with an eigenvalue of at most `least` after scaling
   to a unit diagonal are left out. Collective

   diagonal: scale G by these instead of by its own diagonal; empty: its own. *smallest: the smallest scaled eigenvalue
*/
PetscErrorCode AinsworthSmallOrthonormalize(MPI_Comm, AinsworthSmall G, std::vector<PetscReal> diagonal,
                                            PetscReal least, AinsworthSmall *T, PetscReal *smallest);

#endif
