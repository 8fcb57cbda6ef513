/* What PETSc calls when it loads the plugin, and what a program that links it may call: registration of types and events */
#include <petscainsworth.h>
#include "events.h"
#include "ksp/projectedcg.h"
#include "multigrid/blocksa.h"
#include "multigrid/chebyshev.h"
#include "operator/matainsworth.h"
#include "pc/pcainsworth.h"

PetscLogEvent AINSWORTH_GramMat, AINSWORTH_GramFactor, AINSWORTH_GramSolve, AINSWORTH_Projector, AINSWORTH_MatMult, AINSWORTH_RHS, AINSWORTH_Multiplier,
  AINSWORTH_InvGram, AINSWORTH_PMat, AINSWORTH_PMatCopy, AINSWORTH_Aggregate, AINSWORTH_Interpolation, AINSWORTH_Galerkin, AINSWORTH_Levels;

static PetscBool initialized = PETSC_FALSE;

/* PETSc's private structures, which the plugin uses, change between minor versions */
static PetscErrorCode CheckVersion(void)
{
  PetscInt major, minor, subminor, release;

  PetscFunctionBegin;
  PetscCall(PetscGetVersionNumber(&major, &minor, &subminor, &release));
  PetscCheck(major == PETSC_VERSION_MAJOR && minor == PETSC_VERSION_MINOR, PETSC_COMM_SELF, PETSC_ERR_SUP_SYS,
             "ainsworth was compiled for PETSc %d.%d and this program runs with PETSc %d.%d: compile ainsworth again with the PETSc of the program",
             PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR, (int)major, (int)minor);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@C
   AinsworthFinalizePackage - forgets that the package was initialized; called by `PetscFinalize()`

   Level: developer

.seealso: `AinsworthInitializePackage()`
@*/
PetscErrorCode AinsworthFinalizePackage(void)
{
  PetscFunctionBegin;
  initialized = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@C
   AinsworthInitializePackage - registers `PCAINSWORTH`, `MATAINSWORTH`, `KSPPROJECTEDCG` and their log events

   Level: developer

   Notes:
   Called when PETSc loads the plugin with `-dll_append`. A program that is linked to it calls this after `PetscInitialize()`. To do
   both, or to load it twice, does no harm.

   Errors:
   `PETSC_ERR_SUP_SYS` if the PETSc of the program is of another minor version than the one compiled with.

.seealso: `PCAINSWORTH`, `MATAINSWORTH`, `KSPPROJECTEDCG`
@*/
PetscErrorCode AinsworthInitializePackage(void)
{
  PetscErrorCode (*present)(PC) = NULL;
  PetscClassId classid;

  PetscFunctionBegin;
  if (initialized) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckVersion());
  initialized = PETSC_TRUE;
  PetscCall(PetscRegisterFinalize(AinsworthFinalizePackage));
  PetscCall(PetscClassIdRegister("Ainsworth", &classid));
  PetscCall(PetscLogEventRegister("AinsGramMat", classid, &AINSWORTH_GramMat));
  PetscCall(PetscLogEventRegister("AinsGramFact", classid, &AINSWORTH_GramFactor));
  PetscCall(PetscLogEventRegister("AinsGramSolve", classid, &AINSWORTH_GramSolve));
  PetscCall(PetscLogEventRegister("AinsProjector", classid, &AINSWORTH_Projector));
  PetscCall(PetscLogEventRegister("AinsMatMult", classid, &AINSWORTH_MatMult));
  PetscCall(PetscLogEventRegister("AinsRHS", classid, &AINSWORTH_RHS));
  PetscCall(PetscLogEventRegister("AinsMultiplier", classid, &AINSWORTH_Multiplier));
  PetscCall(PetscLogEventRegister("AinsInvGram", classid, &AINSWORTH_InvGram));
  PetscCall(PetscLogEventRegister("AinsPMat", classid, &AINSWORTH_PMat));
  PetscCall(PetscLogEventRegister("AinsPMatCopy", classid, &AINSWORTH_PMatCopy));
  PetscCall(PetscLogEventRegister("BlockSAAggreg", classid, &AINSWORTH_Aggregate));
  PetscCall(PetscLogEventRegister("BlockSAInterp", classid, &AINSWORTH_Interpolation));
  PetscCall(PetscLogEventRegister("BlockSAGalerk", classid, &AINSWORTH_Galerkin));
  PetscCall(PetscLogEventRegister("BlockSALevels", classid, &AINSWORTH_Levels));

  /* the same file under two names is loaded twice, with two guards: the first to register its types stays */
  PetscCall(PCInitializePackage());
  PetscCall(PetscFunctionListFind(PCList, PCAINSWORTH, &present));
  if (present) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCRegister(PCAINSWORTH, PCCreate_Ainsworth));
  PetscCall(PCRegister(PCBLOCKSA, PCCreate_BlockSA));
  PetscCall(MatRegister(MATAINSWORTH, MatCreate_Ainsworth));
  PetscCall(KSPRegister(KSPPROJECTEDCG, KSPCreate_ProjectedCG));
  PetscCall(KSPRegister(KSPCHEBYSHEVSINGLE, KSPCreate_ChebyshevSingle));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The entry point that PetscDLLibraryOpen() looks for: its name ends with that of the file, without lib and .so */
PETSC_EXTERN PetscErrorCode PetscDLLibraryRegister_ainsworth(void)
{
  PetscFunctionBegin;
  PetscCall(AinsworthInitializePackage());
  PetscFunctionReturn(PETSC_SUCCESS);
}
