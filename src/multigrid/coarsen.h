/* From one level to the next: aggregates of nodes, smoothed interpolation, Galerkin products (docs/multigrid.md) */
#ifndef AINSWORTH_COARSEN_H
#define AINSWORTH_COARSEN_H

#include "blocks.h"

/* Interpolation from the nodes of the coarser level: rows of this level's nodes, columns are places in cols */
struct AinsworthInterpolation {
  AinsworthBlockRows rows;
  AinsworthColumns   cols;
};

/* The aggregate of each node of this rank, from 0; -1: none, a node that A couples to no other */
struct AinsworthAggregates {
  PetscInt              count = 0;
  std::vector<PetscInt> of;
};

PetscErrorCode AinsworthAggregate(const AinsworthBlockMat &, PetscReal, PetscInt, AinsworthAggregates *);
PetscErrorCode AinsworthInterpolationCreate(const AinsworthBlockMat &, const AinsworthAggregates &, const std::vector<PetscReal> &, PetscReal,
                                            const std::vector<PetscScalar> &, PetscInt, PetscLayout, AinsworthInterpolation *, std::vector<PetscScalar> *);
PetscErrorCode AinsworthGalerkin(const AinsworthBlockMat &, const AinsworthInterpolation &, AinsworthBlockMat *);

/* modes.cpp: the near null space that interpolation keeps, n values of each of k modes, those of an unknown side by side */
struct AinsworthModes {
  PetscInt                 k = 0;
  std::vector<PetscScalar> values;
  const char              *source    = "";
  bool                     rotations = true; /* false: nothing but translations, though there is more than one component */
};

PetscErrorCode AinsworthModesCreate(Mat, MatNullSpace, PetscInt, PetscInt, PetscInt, const PetscReal[], AinsworthModes *);

#endif
