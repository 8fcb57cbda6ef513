/* PCBLOCKSA: multigrid by block smoothed aggregation, and KSPCHEBYSHEVSINGLE, the smoother of its finest level */
#ifndef AINSWORTH_BLOCKSA_H
#define AINSWORTH_BLOCKSA_H

#include "hierarchy.h"
#include "source.h"
#include <petscainsworth.h>
#include <petsc/private/pcmgimpl.h>

/* Levels of A that one PC made, for another or for the same one after PCReset() */
struct AinsworthLevels {
  std::shared_ptr<const AinsworthHierarchy> hierarchy;
  AinsworthSource                           source;
};

struct PC_BlockSA {
  /* choices */
  AinsworthHierarchyOptions options;
  PetscInt                  dim; /* of the coordinates, 0: none */
  std::vector<PetscReal>    coordinates;
  PetscBool                 stale;    /* a choice changed since the levels were made */
  PetscBool                 given;    /* an option says the precision */
  PetscBool                 tolerant; /* the KSP that solves now tolerates single precision */

  PetscBool keep; /* the coarser levels, whatever values A has */

  AinsworthLevels  levels;
  PetscBool        old;       /* the coarser ones are of other values of A */
  std::vector<Mat> op;        /* of each level, the finest first; the coarsest is AIJ */
  Mat              product;   /* A for products, of the present levels; NULL: nobody asked for it */
  Vec              sorted[2]; /* right-hand side and solution node by node; NULL: not needed */
  PetscBool        raised;    /* the damped part of the spectrum was widened since set-up */
  struct _PCOps    mg;        /* what PCMG does */
};

static inline PC_BlockSA *BlockSA(PC pc)
{
  return (PC_BlockSA *)((PC_MG *)pc->data)->innerctx;
}

PETSC_INTERN PetscErrorCode PCCreate_BlockSA(PC);
PetscErrorCode              PCSetUp_BlockSA(PC);
PetscErrorCode              PCBlockSASetBounds_Private(PC, PetscReal);
PetscErrorCode              PCBlockSAGet_Private(PC, PC_BlockSA **); /* NULL for a PC of another type */
PetscErrorCode              PCBlockSAExpect_Private(PC, KSP, PetscBool, PetscBool *);
PetscErrorCode              PCBlockSAGetProduct_Private(PC, Mat *);

PETSC_INTERN PetscErrorCode KSPCreate_ChebyshevSingle(KSP);
PetscErrorCode              KSPChebyshevSingleSetEigenvalues_Private(KSP, PetscReal, PetscReal);

#endif
