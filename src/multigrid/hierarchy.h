/* What is known of the levels of block smoothed aggregation from A alone, and the levels of A plus a surface matrix */
#ifndef AINSWORTH_HIERARCHY_H
#define AINSWORTH_HIERARCHY_H

#include "levelmat.h"
#include "../base/machine.h"

/* What smooths the finest level, if its precision is single */
enum AinsworthSmoother {
  AINSWORTH_SMOOTHER_DECIDE,
  AINSWORTH_SMOOTHER_JACOBI,
  AINSWORTH_SMOOTHER_INCOMPLETE /* an incomplete factor, if it exists */
};

struct AinsworthHierarchyOptions {
  PetscReal        threshold  = 0.0; /* theta */
  PetscInt         coarseSize = 0;   /* a level with at most this many unknowns is factored */
  PetscInt         rankSize   = -1;  /* a level with fewer unknowns per rank moves to fewer ranks; -1: by `machine` */
  AinsworthMachine machine;
  PetscInt         smoother = AINSWORTH_SMOOTHER_DECIDE;
  PetscBool        single   = PETSC_FALSE; /* levels in single precision if the values of A allow it */
  PetscBool        product  = PETSC_FALSE; /* keep what AinsworthGridCreateProduct() needs */
};

/* One level: its operator, and interpolation from the next coarser level */
struct AinsworthGrid {
  PetscInt        bs = 1;
  AinsworthLayout nodes;
  /* owned blocks on and above the diagonal; NULL if single replaces them */
  std::shared_ptr<const AinsworthBlockRowsOf<PetscScalar>>     upper;
  std::shared_ptr<const AinsworthBlockRowsOf<AinsworthSingle>> single; /* the same of W A W */
  std::shared_ptr<const AinsworthSplitRows>                    split;  /* single and what it lacks, or NULL */
  std::shared_ptr<const std::vector<PetscReal>>                w;
  AinsworthBlockMat                                            outside; /* blocks in ghost columns */
  std::shared_ptr<const std::vector<PetscReal>>                diagonal;
  PetscReal                                                    largest = 1.0; /* estimated eigenvalue of D^{-1} A */
  bool                                          incomplete = false; /* an incomplete factor is to smooth, not Jacobi */
  PetscInt64                                    blocks     = 0;     /* number of blocks on all ranks */
  PetscMPIInt                                   ranks      = 0;     /* number of ranks that own nodes */
  std::shared_ptr<const AinsworthInterpolation> P;                  /* NULL on the coarsest level */

  bool           exact() const { return upper || split; } /* has double precision */
  PetscReal      entries() const { return (PetscReal)blocks * bs * bs; }
  PetscErrorCode createLevel(const AinsworthBlockMat *added, bool rounded, bool exact,
                             std::unique_ptr<AinsworthLevel> *) const;
};

/*
   Where Jacobi has a condition number (compatible.cpp) of up to this an incomplete factor is no quicker: it takes 1.24
   times as long with 24 (quadratic elements of a thin plate), .85 with 31 (elements of 3:3:1), .34 with 77 (10:10:1)
*/
static const PetscReal AinsworthConditionOfJacobi = 25.0;

/* compatible.cpp */
PetscErrorCode AinsworthFindCompatibleCondition(const AinsworthGrid &, const AinsworthTentative &, PetscReal *);

/* grid.cpp */
PetscErrorCode AinsworthGridStore(const AinsworthHalf &, AinsworthGrid *);
PetscErrorCode AinsworthGridCreate(AinsworthHalf &&, bool, AinsworthGrid *);
PetscErrorCode AinsworthGridCreateFinest(const AinsworthBlockMat &, const AinsworthBlockSurvey &, bool, bool,
                                         const std::vector<char> &, AinsworthGrid *);
PetscErrorCode AinsworthGridView(const AinsworthGrid &, PetscViewer);
PetscErrorCode AinsworthGridCreateProduct(const AinsworthGrid &, Mat *);
void           AinsworthGridTakeDouble(const AinsworthBlockMat &, AinsworthGrid *);
PetscReal      AinsworthComplexity(const std::vector<AinsworthGrid> &);

/*
   Aggregates of all levels, the finest level, interpolation to it, and P' A P

   The graph of each coarser level is that of T' A T with tentative interpolation T, so that nothing here depends on
   what is added to A
*/
class AinsworthHierarchy {
public:
  PetscErrorCode create(Mat A, PetscInt bs, std::vector<PetscInt> &&order, AinsworthModes &&modes,
                        const AinsworthCarried &carry, const std::vector<char> &embed,
                        const AinsworthHierarchyOptions &);
  PetscErrorCode createGrids(AinsworthHalf *added, std::vector<AinsworthGrid> *) const;
  PetscErrorCode replaceFinest(Mat A, const AinsworthHierarchyOptions &);
  PetscReal      complexity() const; /* of the first two levels */
  bool           single() const { return finest.single != nullptr; }
  size_t         levels() const { return finest.P ? 2 + below.size() : 1; }

  AinsworthGrid finest;
  /* P' A P on the first coarser level, without a diagonal; empty if there is none */
  AinsworthGrid                   first;
  std::vector<AinsworthTentative> below; /* from the level below the first coarser one, and so on */
  std::vector<PetscInt>           order; /* the local rows of A node by node, if sorted */
  /* A does not store its rows node by node; the same on all ranks */
  PetscBool      sorted = PETSC_FALSE;
  AinsworthModes modes; /* without their values */
  AinsworthCarried carried; /* its rows only if nodes follow others by these */
  PetscInt         carriedToAll = 0; /* nodes on all ranks that the coarsest level has, too */
  /* local nodes of the finest level without coarse functions; empty: none */
  std::vector<char> embedded;
  PetscReal         condition = 0.0; /* of Jacobi on the finest level (compatible.cpp); 0: not estimated */
  /* why this hierarchy is likely to be inefficient; empty if nothing suggests that */
  char doubts[128] = "";

private:
  PetscErrorCode chooseSmoother(const AinsworthTentative &, const AinsworthHierarchyOptions &);
  PetscErrorCode coarsen(const AinsworthBlockMat &, std::vector<PetscReal> &&, PetscMPIInt,
                         const AinsworthHierarchyOptions &, AinsworthTies *, AinsworthTentative *, bool *);
};

#endif
