/* Coarsening: aggregates of nodes, smoothed interpolation, Galerkin products (docs/multigrid.md) */
#ifndef AINSWORTH_COARSEN_H
#define AINSWORTH_COARSEN_H

#include "blocks.h"

/* What the coarsening needs to know of the entries of a matrix */
struct AinsworthBlockSurvey {
  std::vector<PetscReal> square;   /* |A_ij|_F^2 of each block */
  std::vector<PetscReal> diagonal; /* |a_ii| of each local unknown */
  std::vector<char>      held;     /* unknowns whose rows have no nonzero off the diagonal */

  explicit AinsworthBlockSurvey(const AinsworthBlockMat &);
};

/*
   Values up to this, less than 2^128, fit in single precision; entries of W A W of a definite A are at most 4, those of
   interpolation about 1
*/
static const PetscReal AinsworthMostOfSingle = 1e35;

/* Interpolation from the coarser level: rows are nodes of this level, columns are places in cols */
struct AinsworthInterpolation {
  AinsworthBlockRows           rows;
  AinsworthColumns             cols;
  std::vector<AinsworthSingle> single; /* the values if this level is in single precision; rows.a is empty then */

  /* Returns block k; room is work space for one block */
  const PetscScalar *block(PetscInt k, PetscScalar *room) const
  {
    if (single.empty()) return rows.block(k);
    for (PetscInt q = 0; q < rows.size(); q++) room[q] = (PetscScalar)single[(size_t)k * rows.size() + q];
    return room;
  }
  /* Stores the values in single precision if they fit */
  void round()
  {
    for (PetscScalar v : rows.a)
      if (!(PetscAbsScalar(v) <= AinsworthMostOfSingle)) return;
    single.reserve(rows.a.size());
    for (PetscScalar v : rows.a) single.push_back((AinsworthSingle)v);
    rows.a = std::vector<PetscScalar>();
  }
};

/*
   The aggregate of each local node, numbered from 0; -1 for a node that A couples to no other node, unless it is
   carried to coarser levels
*/
struct AinsworthAggregates {
  PetscInt              count = 0;
  std::vector<PetscInt> of;
};

/* Interpolation by the modes of aggregates, one block for each local node: it depends on no operator */
struct AinsworthTentative {
  AinsworthLayout          layout;        /* of the coarse nodes */
  PetscMPIInt              ranks = 0;     /* number of ranks that own these */
  PetscInt                 bs = 1, k = 0; /* size of the blocks */
  std::vector<PetscInt>    aggregate;     /* global coarse node of each local node; -1: none */
  std::vector<PetscInt>    followers;     /* local nodes that are in no aggregate, but move as one of any rank does */
  std::vector<PetscScalar> values;
};

/*
   For each local node that A knows nothing of but that constraints may let follow others: the nodes of this level that
   its rows of C tie it to. Its layout is NULL on a level without such nodes; only the pattern matters
*/
typedef AinsworthBlockMat AinsworthTies;

/* A mode satisfies an equation if what is left of it is at most this part of the sum of its terms */
static const PetscReal AinsworthModeSatisfied = 1e-4;

/* The near null space that interpolation preserves, k values for each unknown (modes.cpp) */
struct AinsworthModes {
  PetscInt                 k = 0;
  std::vector<PetscScalar> values;
  std::vector<char>        carried;  /* local nodes without entries in A that coarser levels have */
  std::vector<char>        embedded; /* local nodes of the finest level without coarse functions; empty: none */
  const char              *origin    = "";
  PetscInt                 unfit     = 0;    /* modes dropped because A does not map them to zero */
  bool                     rotations = true; /* false: only translations, although nodes have more than one component */
};

PetscErrorCode AinsworthModesCreate(Mat, PetscInt, const std::vector<PetscInt> &, MatNullSpace, PetscInt,
                                    const PetscReal[], AinsworthModes *);
PetscErrorCode AinsworthModesFit(const AinsworthBlockMat &, const AinsworthBlockSurvey &, AinsworthModes *);
void           AinsworthModesHold(const AinsworthBlockSurvey &, AinsworthModes *);
PetscErrorCode AinsworthAggregate(const AinsworthBlockRows &, std::vector<PetscReal> &&, PetscReal,
                                  const AinsworthModes &, AinsworthAggregates *);
void           AinsworthOrthonormalize(PetscInt, PetscInt, PetscScalar[], PetscScalar[]);
void AinsworthTentativeCreate(const AinsworthAggregates &, PetscInt, const AinsworthModes &, AinsworthTentative *,
                              std::vector<PetscScalar> *);
PetscErrorCode AinsworthTentativeFollow(const AinsworthTies &, const AinsworthModes &, AinsworthAggregates *,
                                        AinsworthTentative *, std::vector<PetscScalar> *);
PetscErrorCode AinsworthTentativePlace(const AinsworthAggregates &, const AinsworthLayout &,
                                       std::vector<PetscScalar> &&, AinsworthModes *, AinsworthTentative *);
PetscErrorCode AinsworthModesOfCarried(Mat, PetscInt, const std::vector<PetscInt> &, AinsworthModes *, Vec *,
                                       PetscBool *);
PetscErrorCode AinsworthTiesCreate(Mat, PetscInt, const std::vector<PetscInt> &, AinsworthModes *, AinsworthTies *);
PetscErrorCode AinsworthTiesCoarsen(const AinsworthAggregates &, const AinsworthTentative &, AinsworthTies *);
PetscErrorCode AinsworthTentativeInterpolate(const AinsworthTentative &, AinsworthInterpolation *);
PetscErrorCode AinsworthTentativeSmooth(const AinsworthBlockMat &, const AinsworthTentative &,
                                        const std::vector<PetscReal> &, PetscReal, bool, AinsworthInterpolation *);
PetscErrorCode AinsworthInterpolationMultiply(const AinsworthBlockMat &, const AinsworthInterpolation &,
                                              AinsworthInterpolation *);
PetscErrorCode AinsworthGalerkinChange(const AinsworthBlockMat &, const AinsworthInterpolation &,
                                       const AinsworthInterpolation &, AinsworthHalf *);
PetscErrorCode AinsworthGalerkin(const AinsworthBlockMat &, const AinsworthInterpolation &, AinsworthHalf *);

#endif
