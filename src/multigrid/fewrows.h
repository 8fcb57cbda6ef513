/* Few dense constraints that all coarser levels keep: mean values, spiders whose reference node is held */
#ifndef AINSWORTH_FEWROWS_H
#define AINSWORTH_FEWROWS_H

#include "subspace.h"

/* Rows C of a level, orthonormal in W: C W C' = I, so that Q = I - W C' C */
struct AinsworthFewRows {
  MPI_Comm                              comm = MPI_COMM_NULL;
  std::vector<PetscReal>                w; /* W, local */
  std::vector<std::vector<PetscScalar>> c; /* the local entries of each row */

  PetscErrorCode create(const std::vector<Vec> &rows, const std::vector<PetscReal> &weight);
  PetscErrorCode multiply(const PetscScalar *x, bool weighted, std::vector<PetscScalar> *y) const;
  PetscErrorCode project(bool adjoint, Vec) const;
  PetscErrorCode addSquare(Mat) const;
};

PetscErrorCode AinsworthFewRowsSubspaceCreate(const std::shared_ptr<const AinsworthFewRows> &,
                                              std::shared_ptr<const AinsworthLevelSubspace> *);
PetscErrorCode AinsworthFewRowsPCCreate(const std::shared_ptr<const AinsworthFewRows> &, PC, PC *);

#endif
