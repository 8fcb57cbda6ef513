/* The levels that block smoothed aggregation makes of A, and operators of A plus a surface on them */
#ifndef AINSWORTH_HIERARCHY_H
#define AINSWORTH_HIERARCHY_H

#include "levelmat.h"

struct AinsworthHierarchyOptions {
  PetscReal threshold;  /* theta */
  PetscInt  coarseSize; /* unknowns at which a level is factored */
  PetscInt  rankSize;   /* with fewer unknowns a rank a level goes to fewer ranks */
  PetscBool single;     /* the finest level in single precision, where the values allow */
  PetscBool product;    /* keep what AinsworthHierarchyCreateProduct() needs */
};

/* One level of A: operator, and interpolation from the next coarser one */
struct AinsworthGrid {
  PetscInt                                                     bs = 1;
  AinsworthLayout                                              nodes;
  std::shared_ptr<const AinsworthBlockRowsOf<PetscScalar>>     upper;  /* either both of single and w, or this; the finest may have all */
  std::shared_ptr<const AinsworthBlockRowsOf<AinsworthSingle>> single; /* W A W */
  std::shared_ptr<const std::vector<PetscReal>>                w;
  AinsworthBlockMat                                            outside; /* blocks of ghosts */
  std::vector<PetscReal>                                       diagonal;
  PetscReal                                                    largest = 1.0; /* estimated eigenvalue of D^{-1} A */
  PetscInt64                                                   blocks  = 0;   /* on all ranks */
  PetscMPIInt                                                  ranks   = 0;   /* that own nodes */
  std::shared_ptr<const AinsworthInterpolation>                P;             /* none: the coarsest */
};

class AinsworthHierarchy {
public:
  PetscErrorCode create(Mat A, PetscInt bs, std::vector<PetscInt> &&order, AinsworthModes &&modes, const AinsworthHierarchyOptions &);
  PetscErrorCode replaceFinest(Mat A, const AinsworthHierarchyOptions &);
  PetscErrorCode createLevel(PetscInt l, const AinsworthBlockMat *added, bool single, std::unique_ptr<AinsworthLevel> *) const;
  PetscReal      complexity() const;
  bool           single() const { return grids[0].single != nullptr; }

  std::vector<AinsworthGrid> grids;                /* the finest first */
  std::vector<PetscInt>      order;                /* rows of A on this rank node by node, where sorted */
  PetscBool                  sorted = PETSC_FALSE; /* A has them in another order; on all ranks */
  AinsworthModes             modes;                /* without their values */
  PetscReal                  jump        = 1.0;    /* largest quotient of diagonals of nodes that A couples */
  char                       doubts[128] = "";     /* why this is no good hierarchy, empty where nothing speaks against it */

private:
  PetscErrorCode add(AinsworthBlockMat &, const AinsworthHierarchyOptions &);
  PetscErrorCode store(const AinsworthBlockMat &, const AinsworthHierarchyOptions &);
};

PetscErrorCode AinsworthHierarchyCreateProduct(const AinsworthHierarchy &, Mat *);

#endif
