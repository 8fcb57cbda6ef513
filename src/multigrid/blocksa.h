/* PCBLOCKSA, multigrid by block smoothed aggregation, and KSPCHEBYSHEVSINGLE, the smoother of its levels */
#ifndef AINSWORTH_BLOCKSA_H
#define AINSWORTH_BLOCKSA_H

#include "fewrows.h"
#include "hierarchy.h"
#include "../base/objects.h"
#include "fingerprint.h"
#include <petscainsworth.h>

/* The levels of A and what they were made from; PCAINSWORTH keeps them over PCReset() */
struct AinsworthLevels {
  std::shared_ptr<const AinsworthHierarchy>         hierarchy;
  std::shared_ptr<const std::vector<AinsworthGrid>> alone; /* the levels of A alone; NULL until they are needed */
  AinsworthFingerprint                              fingerprint;
};

/* Vectors of levels that are visited twice, coarsest first: what the first visit leaves, what the second one adds */
struct AinsworthCycle {
  std::vector<AinsworthRef<Vec>> left, step;
};

struct PC_BlockSA {
  /* options */
  AinsworthHierarchyOptions options = {};
  PetscInt                  dim     = 0; /* of the coordinates, 0 without any */
  std::vector<PetscReal>    coordinates;
  PetscBool                 stale    = PETSC_FALSE; /* an option changed since the levels were made */
  PetscBool                 given    = PETSC_FALSE; /* the precision was set by an option */
  PetscBool                 tolerant = PETSC_FALSE; /* the current KSP tolerates single precision */

  std::shared_ptr<const AinsworthSubspace> subspace; /* that the cycle stays in; NULL: the whole space */
  /* AIJ, A for the unknowns of the levels, until these are set up; NULL: A itself */
  Mat extended = NULL;

  PetscBool keep = PETSC_FALSE; /* keep the coarser levels whatever the values of A */

  AinsworthLevels                                   levels;
  std::shared_ptr<const std::vector<AinsworthGrid>> grids; /* the levels in use */
  /* the coarser levels belong to earlier values of A */
  PetscBool old = PETSC_FALSE;
  /* what corrects interpolation to the finest level; NULL: nothing */
  std::shared_ptr<const AinsworthInterpolation> corrected;
  std::shared_ptr<const AinsworthFewRows>       coarseRows;    /* of the coarsest level; NULL: none */
  bool                                          dense = false; /* the last coarsest matrix was */
  /* operators of the levels, finest first; the coarsest is AIJ or dense */
  std::vector<Mat> op;
  /* what the levels in single precision scale the right-hand side of the cycle by */
  std::shared_ptr<PetscReal> scale   = std::make_shared<PetscReal>(1.0);
  PetscReal                  largest = 0.0; /* largest entry of W of the finest level on all ranks */
  /* A for products, from the current levels; NULL until requested */
  Mat product = NULL;
  /* right-hand side and solution for the unknowns of the levels; NULL if these are those of the PC */
  Vec            mapped[2] = {};
  Vec            sorted[2] = {};          /* the same node by node; NULL if not needed */
  AinsworthCycle cycle;                   /* for these levels */
  PetscBool      raised    = PETSC_FALSE; /* the bounds of the smoothers were raised since set-up */
  struct _PCOps *mg        = NULL;        /* the operations of PCMG; owned */
};

PETSC_INTERN PetscErrorCode PCCreate_BlockSA(PC);
PetscErrorCode              PCBlockSAGet_Private(PC, PC_BlockSA **); /* NULL for a PC of another type */
PetscErrorCode              PCBlockSAHasFactor_Private(const PC_BlockSA *, PetscBool *);
PetscErrorCode              PCBlockSACountOthers_Private(PC, PetscInt, PetscInt *);
PetscErrorCode              PCBlockSAFindNodes_Private(PetscInt, Mat, PetscInt *, std::vector<PetscInt> *);
PetscErrorCode              PCBlockSAExpect_Private(PC, KSP, PetscBool, PetscBool *);
PetscErrorCode              PCBlockSAGetProduct_Private(PC, Mat *);
PetscErrorCode              PCBlockSAIsUsual_Private(PC, PetscBool *);
PetscErrorCode              PCBlockSAWiden_Private(PC, PetscInt, PC *);
PetscErrorCode              AinsworthWidenMat(Mat, PetscInt, Mat *);
PetscErrorCode              PCBlockSASetSubspace_Private(PC, const std::shared_ptr<const AinsworthSubspace> &, Mat);

PETSC_INTERN PetscErrorCode KSPCreate_ChebyshevSingle(KSP);
PetscErrorCode              KSPChebyshevSingleSetEigenvalues_Private(KSP, PetscReal, PetscReal);

#endif
