/* PCBLOCKSA: multigrid by block smoothed aggregation */
#ifndef AINSWORTH_BLOCKSA_H
#define AINSWORTH_BLOCKSA_H

#include "hierarchy.h"
#include <petscainsworth.h>

/* Levels of A that one PC made, for another or for the same one after PCReset() */
struct AinsworthLevels {
  std::shared_ptr<const AinsworthHierarchy> hierarchy;
  PetscObjectId                             id = 0, modes = 0; /* of A and of its near null space */
  PetscObjectState                          state = 0;
};

struct PC_BlockSA {
  /* choices */
  AinsworthHierarchyOptions options;
  PetscInt                  dim; /* of the coordinates, 0: none */
  std::vector<PetscReal>    coordinates;
  PetscBool                 stale;    /* a choice changed since the levels were made */
  PetscBool                 given;    /* an option says the precision */
  PetscBool                 tolerant; /* the method that solves now bears with single precision */

  AinsworthLevels  levels;
  std::vector<Mat> op, P; /* of each level, the finest first; the coarsest is AIJ */
  std::vector<KSP> smoother;
  Mat              product; /* A for products, of the present levels; NULL: nobody asked for it */
  PetscBool        raised;  /* the damped part of the spectrum was widened since set-up */

  /* what PCMG does */
  PetscErrorCode (*setup)(PC), (*apply)(PC, Vec, Vec), (*reset)(PC), (*destroy)(PC);
  PetscErrorCode (*setfromoptions)(PC, AinsworthOptionItems);
};

PETSC_INTERN PetscErrorCode PCCreate_BlockSA(PC);
PetscErrorCode              PCBlockSAGet_Private(PC, PC_BlockSA **);
PetscErrorCode              PCSetUp_BlockSA(PC);
PetscErrorCode              PCBlockSARaiseBounds_Private(PC_BlockSA *);

/* For PCAINSWORTH; PCs of other types have none of this, and nothing is done */
PetscErrorCode PCBlockSAGetLevels_Private(PC, AinsworthLevels *);
PetscErrorCode PCBlockSASetLevels_Private(PC, const AinsworthLevels &);
PetscErrorCode PCBlockSAKeepProduct_Private(PC);
PetscErrorCode PCBlockSAGetProduct_Private(PC, Mat *);
PetscErrorCode PCBlockSAGetDoubts_Private(PC, const char **);

#endif
