#include "events.h"

PetscLogEvent AINSWORTH_GramMat, AINSWORTH_GramFactor, AINSWORTH_Dependent, AINSWORTH_GramSolve, AINSWORTH_Projector,
  AINSWORTH_MatMult, AINSWORTH_RHS, AINSWORTH_Multiplier, AINSWORTH_Verify, AINSWORTH_InvGram, AINSWORTH_PMat,
  AINSWORTH_PMatCopy, AINSWORTH_Aggregate, AINSWORTH_Interpolation, AINSWORTH_Galerkin, AINSWORTH_Levels,
  AINSWORTH_Layout;

/* AinsworthRegisterEvents - registers the log events, once in each PetscInitialize() */
PetscErrorCode AinsworthRegisterEvents(void)
{
  PetscClassId classid;

  PetscFunctionBegin;
  PetscCall(PetscClassIdRegister("Ainsworth", &classid));
  PetscCall(PetscLogEventRegister("AinsLayout", classid, &AINSWORTH_Layout));
  PetscCall(PetscLogEventRegister("AinsGramMat", classid, &AINSWORTH_GramMat));
  PetscCall(PetscLogEventRegister("AinsGramFact", classid, &AINSWORTH_GramFactor));
  PetscCall(PetscLogEventRegister("AinsDependent", classid, &AINSWORTH_Dependent));
  PetscCall(PetscLogEventRegister("AinsGramSolve", classid, &AINSWORTH_GramSolve));
  PetscCall(PetscLogEventRegister("AinsProjector", classid, &AINSWORTH_Projector));
  PetscCall(PetscLogEventRegister("AinsMatMult", classid, &AINSWORTH_MatMult));
  PetscCall(PetscLogEventRegister("AinsRHS", classid, &AINSWORTH_RHS));
  PetscCall(PetscLogEventRegister("AinsMultiplier", classid, &AINSWORTH_Multiplier));
  PetscCall(PetscLogEventRegister("AinsInvGram", classid, &AINSWORTH_InvGram));
  PetscCall(PetscLogEventRegister("AinsVerify", classid, &AINSWORTH_Verify));
  PetscCall(PetscLogEventRegister("AinsPMat", classid, &AINSWORTH_PMat));
  PetscCall(PetscLogEventRegister("AinsPMatCopy", classid, &AINSWORTH_PMatCopy));
  PetscCall(PetscLogEventRegister("BlockSAAggreg", classid, &AINSWORTH_Aggregate));
  PetscCall(PetscLogEventRegister("BlockSAInterp", classid, &AINSWORTH_Interpolation));
  PetscCall(PetscLogEventRegister("BlockSAGalerk", classid, &AINSWORTH_Galerkin));
  PetscCall(PetscLogEventRegister("BlockSALevels", classid, &AINSWORTH_Levels));
  PetscFunctionReturn(PETSC_SUCCESS);
}
