/* What the files of PCBLOCKSA share */
#ifndef AINSWORTH_BLOCKSAIMPL_H
#define AINSWORTH_BLOCKSAIMPL_H

#include "blocksa.h"
#include <petsc/private/pcmgimpl.h>

static inline PC_BlockSA *BlockSA(PC pc)
{
  return (PC_BlockSA *)((PC_MG *)pc->data)->innerctx;
}

/* blocksasetup.cpp */
PetscErrorCode PCSetUp_BlockSA(PC);
PetscErrorCode PCBlockSASetBounds_Private(PC, PetscReal);
PetscErrorCode PCBlockSABoundsAreChosen_Private(PC, PetscInt, PetscBool *);
PetscErrorCode PCBlockSASetLevelBounds_Private(const AinsworthLevel *, PetscReal, KSP);
/* the factor of the bounds where the cycle has shown to be indefinite */
static const PetscReal AinsworthRaised = 1.5;

/* blocksaapply.cpp */
PetscErrorCode PCBlockSATolerates_Private(KSP, PetscBool *);
PetscErrorCode PCBlockSAUseDouble_Private(PC, bool unknown);
PetscErrorCode PCBlockSASetScale_Private(const PC_BlockSA *, Vec);
PetscErrorCode PCPreSolve_BlockSA(PC, KSP, Vec, Vec);
PetscErrorCode PCPostSolve_BlockSA(PC, KSP, Vec, Vec);
PetscErrorCode PCApply_BlockSA(PC, Vec, Vec);
PetscErrorCode PCApplyTranspose_BlockSA(PC, Vec, Vec);

/* blocksacycle.cpp */
PetscErrorCode PCBlockSACycle_Private(PC, AinsworthCycle *, Vec, Vec);

/* blocksalevels.cpp, blocksacoarsest.cpp */
PetscErrorCode PCBlockSASetUpLevels_Private(PC, PC_BlockSA *, Mat, PetscBool *rebuild);
PetscErrorCode PCBlockSAConfigureCoarse_Private(PC);
PetscErrorCode PCBlockSAConfigureBlock_Private(PC);
PetscErrorCode PCBlockSACreateCoarsest_Private(PC, const AinsworthGrid &, std::unique_ptr<AinsworthLevel> &&,
                                               bool singular, const AinsworthFewRows *, Mat *);

/* blocksasubspace.cpp */
std::vector<char> AinsworthSubspaceEmbedded(const PC_BlockSA *, PetscInt, const std::vector<PetscInt> &);
PetscErrorCode    AinsworthCoarsenRows(const AinsworthGrid &, std::vector<Vec> *);
PetscErrorCode    PCBlockSAGetAIJ_Private(PC_BlockSA *, Mat, Mat *);
PetscErrorCode    PCBlockSASort_Private(const PC_BlockSA *, bool back, PetscInt width, Vec, Vec);
PetscErrorCode    PCBlockSASortRows_Private(const PC_BlockSA *, std::vector<Vec> *);
PetscErrorCode    PCBlockSAKeepRows_Private(const std::vector<Vec> &, AinsworthLevel *,
                                            std::shared_ptr<const AinsworthFewRows> *);
PetscErrorCode    PCBlockSACorrectCoarse_Private(Mat, PC_BlockSA *, AinsworthHalf *);
PetscErrorCode    PCBlockSALeaveSubspace_Private(PC, PC_BlockSA *);
PetscErrorCode    PCBlockSAStayInSubspace_Private(PC, PC_BlockSA *);

#endif
