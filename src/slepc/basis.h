/* The basis [X P W] of the block method, with its products */
#ifndef AINSWORTH_BASIS_H
#define AINSWORTH_BASIS_H

#include "pencil.h"
#include "small.h"

/*
   Vectors that are orthonormal in the inner product of K = K + sigma M: Ritz vectors X, directions P, new vectors W

   The inner product is that of the stiffness and not of the mass, which may be singular; then the lowest modes belong
   to the largest eigenvalues nu of M v = nu K v.
*/
class AinsworthBasis {
public:
  AinsworthBasis() = default;
  ~AinsworthBasis();
  AinsworthBasis(const AinsworthBasis &)            = delete;
  AinsworthBasis &operator=(const AinsworthBasis &) = delete;

  /* block: the most vectors of X; indefinite: M is, and vectors of negative nu are modes as well. Collective */
  PetscErrorCode create(const AinsworthPencil *, PetscInt block, bool indefinite);
  /* Appends a vector that meets the constraints, and its products */
  PetscErrorCode append(Vec v, Vec Kv, Vec Mv);
  /* Orthonormalizes what was appended, and leaves out what depends on other vectors; block: X is meant. Collective */
  PetscErrorCode orthonormalize();
  /* Makes Ritz vectors of all, at most `block`, and new directions for those that are marked. Collective */
  PetscErrorCode rayleighRitz(const std::vector<char> &active);
  /* Changes the inner product to that of K + sigma M, after which there are no directions */
  PetscErrorCode changeShift(PetscReal before, PetscReal sigma);
  /* Computes the products with a Ritz vector, and its Ritz value, anew */
  PetscErrorCode refresh(PetscInt j);

  PetscErrorCode residual(PetscInt j, Vec) const; /* (K - mu_j M) x_j */
  PetscErrorCode get(PetscInt j, Vec) const;

  PetscInt  size() const { return nx; } /* Ritz vectors */
  PetscInt  all() const { return end; }
  PetscReal ritz(PetscInt j) const { return mu[j]; }
  bool      moves(PetscInt j) const { return mu[j] < PETSC_MAX_REAL; } /* M x_j is not 0 */

private:
  PetscErrorCode transform(PetscInt end, PetscInt first, const AinsworthSmall &T);
  PetscErrorCode gram(BV products, PetscInt first, PetscInt end, AinsworthSmall *) const;

  const AinsworthPencil *pencil = NULL;
  MPI_Comm               comm   = MPI_COMM_NULL;
  BV                     S = NULL, KS = NULL, MS = NULL;
  Mat                    small = NULL; /* work space, on each rank */
  PetscInt               block = 0, nx = 0, np = 0, end = 0;
  bool                   indefinite = false;
  std::vector<PetscReal> mu; /* 1/nu, nu descending; infinite where that is 0 */
};

#endif
