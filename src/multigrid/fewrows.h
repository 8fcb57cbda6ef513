/* Few dense constraints that all coarser levels keep: mean values, spiders whose reference node is held */
#ifndef AINSWORTH_FEWROWS_H
#define AINSWORTH_FEWROWS_H

#include "subspace.h"

/* Rows C of a level, orthonormal in W: C W C' = I, so that Q = I - W C' C */
struct AinsworthFewRows {
  std::vector<Vec> c;                     /* the adjoint of each row */
  Vec              w = NULL, work = NULL; /* W */

  AinsworthFewRows()                         = default;
  AinsworthFewRows(const AinsworthFewRows &) = delete;
  ~AinsworthFewRows();
  PetscErrorCode create(const std::vector<Vec> &rows, const std::vector<PetscReal> &weight);
  PetscErrorCode project(bool adjoint, Vec) const;
  PetscErrorCode addSquare(Mat *) const;
};

PetscErrorCode AinsworthFewRowsSubspaceCreate(const std::shared_ptr<const AinsworthFewRows> &,
                                              std::shared_ptr<const AinsworthLevelSubspace> *);
PetscErrorCode AinsworthFewRowsPCCreate(const std::shared_ptr<const AinsworthFewRows> &, PC, PC *);

#endif
