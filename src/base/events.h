/* One log event per operation, for -log_view */
#ifndef AINSWORTH_EVENTS_H
#define AINSWORTH_EVENTS_H

#include "petsccompat.h"

extern PetscLogEvent AINSWORTH_GramMat, AINSWORTH_GramFactor, AINSWORTH_Dependent, AINSWORTH_GramSolve,
  AINSWORTH_Projector, AINSWORTH_MatMult, AINSWORTH_RHS, AINSWORTH_Multiplier, AINSWORTH_Verify, AINSWORTH_InvGram,
  AINSWORTH_PMat, AINSWORTH_PMatCopy, AINSWORTH_Aggregate, AINSWORTH_Interpolation, AINSWORTH_Galerkin,
  AINSWORTH_Levels, AINSWORTH_Layout;

PetscErrorCode AinsworthRegisterEvents(void);

#endif
