/* From one level to the next: aggregates of nodes, smoothed interpolation, Galerkin products (docs/multigrid.md) */
#ifndef AINSWORTH_COARSEN_H
#define AINSWORTH_COARSEN_H

#include "blocks.h"

/* Interpolation from the nodes of the coarser level: rows of this level's nodes, columns are places in cols */
struct AinsworthInterpolation {
  AinsworthBlockRows           rows;
  AinsworthColumns             cols;
  std::vector<AinsworthSingle> single; /* the values, where this level is in single precision; rows has none then */

  void round()
  {
    single.assign(rows.a.begin(), rows.a.end());
    std::vector<PetscScalar>().swap(rows.a);
  }
  /* room: for one block */
  const PetscScalar *block(PetscInt k, PetscScalar *room) const
  {
    if (single.empty()) return rows.block(k);
    for (PetscInt q = 0; q < rows.size(); q++) room[q] = (PetscScalar)single[(size_t)k * rows.size() + q];
    return room;
  }
};

/* The aggregate of each node of this rank, from 0; -1: none, a node that A couples to no other */
struct AinsworthAggregates {
  PetscInt              count = 0;
  std::vector<PetscInt> of;
};

/* modes.cpp: the near null space that interpolation keeps, k values of each unknown */
struct AinsworthModes {
  PetscInt                 k = 0;
  std::vector<PetscScalar> values;
  const char              *source    = "";
  PetscInt                 unfit     = 0;    /* of those that were given, left out */
  bool                     rotations = true; /* false: nothing but translations, though there is more than one component */
};

PetscErrorCode AinsworthModesCreate(Mat, PetscInt, const std::vector<PetscInt> &, MatNullSpace, PetscInt, const PetscReal[], AinsworthModes *);
PetscErrorCode AinsworthModesFit(const AinsworthBlockMat &, AinsworthModes *);
PetscErrorCode AinsworthAggregate(const AinsworthBlockMat &, PetscReal, PetscInt, AinsworthAggregates *);
PetscErrorCode AinsworthInterpolationCreate(const AinsworthBlockMat &, const AinsworthAggregates &, const std::vector<PetscReal> &, PetscReal,
                                            const AinsworthLayout &, AinsworthModes *, AinsworthInterpolation *);
PetscErrorCode AinsworthGalerkin(const AinsworthBlockMat &, const AinsworthInterpolation &, AinsworthBlockMat *);

#endif
