/* A preconditioner on the kernel of few rows C: M^{-1} - L (C L)^{-1} C M^{-1} with L = M^{-1} C' */
#ifndef AINSWORTH_BORDERED_H
#define AINSWORTH_BORDERED_H

#include "petsccompat.h"
#include <vector>

class AinsworthBordered {
public:
  AinsworthBordered()                                     = default;
  AinsworthBordered(const AinsworthBordered &)            = delete;
  AinsworthBordered &operator=(const AinsworthBordered &) = delete;
  ~AinsworthBordered();

  PetscErrorCode setUp(PC, const std::vector<Vec> &rows, PetscReal dependent, bool *apart);
  PetscErrorCode clear();
  PetscErrorCode correct(std::vector<PetscScalar> &left, Vec z) const;

  std::vector<Vec> lifted; /* L */

private:
  std::vector<PetscScalar> factor; /* Cholesky factor of C L */
};

#endif
