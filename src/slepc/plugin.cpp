/* Entry points of libainsworthslepc.so: registration of EPSAINSWORTH, and its public functions */
#include "epsainsworth.h"
#include <slepcainsworth.h>
#include <slepc/private/epsimpl.h>

static PetscBool initialized = PETSC_FALSE;

/* Called by PetscFinalize(), so that the type is registered again after another PetscInitialize() */
static PetscErrorCode FinalizePackage(void)
{
  PetscFunctionBegin;
  initialized = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Private structures of SLEPc are used, which change with its minor version */
static PetscErrorCode CheckLibrary(void)
{
  PetscInt major, minor;

  PetscFunctionBegin;
  PetscCall(SlepcGetVersionNumber(&major, &minor, NULL, NULL));
  PetscCheck(major == SLEPC_VERSION_MAJOR && minor == SLEPC_VERSION_MINOR, PETSC_COMM_WORLD, PETSC_ERR_SUP_SYS,
             "ainsworth was compiled for SLEPc %d.%d and this program runs with SLEPc %d.%d: compile ainsworth again "
             "with the SLEPc of the program",
             SLEPC_VERSION_MAJOR, SLEPC_VERSION_MINOR, (int)major, (int)minor);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@C
   AinsworthSlepcInitializePackage - registers `EPSAINSWORTH`, and the types of the plugin

   Not Collective, but to be called on all ranks

   Level: developer

   Notes:
   PETSc calls it when it loads libainsworthslepc.so with `-dll_append`. A program that links the library calls it after
   `SlepcInitialize()`. Repeated calls do no harm.

   Errors:
   `PETSC_ERR_SUP_SYS` if the PETSc or SLEPc of the program differs from the one that the library was compiled for.

.seealso: `EPSAINSWORTH`, `AinsworthInitializePackage()`
@*/
PetscErrorCode AinsworthSlepcInitializePackage(void)
{
  PetscErrorCode (*present)(EPS) = NULL;

  PetscFunctionBegin;
  if (initialized) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthInitializePackage());
  PetscCall(CheckLibrary());
  initialized = PETSC_TRUE;
  PetscCall(PetscRegisterFinalize(FinalizePackage));
  PetscCall(EPSInitializePackage());
  PetscCall(PetscFunctionListFind(EPSList, EPSAINSWORTH, &present));
  if (!present) PetscCall(EPSRegister(EPSAINSWORTH, EPSCreate_Ainsworth));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Called by PetscDLLibraryOpen(), which derives the name from the file name without lib and .so */
PETSC_EXTERN PetscErrorCode PetscDLLibraryRegister_ainsworthslepc(void)
{
  PetscFunctionBegin;
  PetscCall(AinsworthSlepcInitializePackage());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   EPSAinsworthSetShift - sets sigma of the matrix K + sigma M that is preconditioned

   Logically Collective

   Input Parameters:
+  eps   - the eigensolver; nothing happens if its type is not `EPSAINSWORTH`
-  shift - sigma, not negative; `PETSC_DECIDE` for the default

   Options Database Key:
.  -eps_ainsworth_shift <decided> - sigma

   Level: intermediate

   Notes:
   K + sigma M has to be positive definite where C x = 0. Any positive sigma makes it so if K is semidefinite there, as
   with rigid modes. The larger it is, the closer are its eigenvalues to each other, and the slower is the convergence.

   By default sigma begins with an estimate from the diagonals of K and M, and follows a hundredth of the highest of the
   modes that are iterated, as far as orders of magnitude. If K has negative eigenvalues, sigma has to be given.

.seealso: `EPSAINSWORTH`, `EPSAinsworthGetShift()`
@*/
PetscErrorCode EPSAinsworthSetShift(EPS eps, PetscReal shift)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(eps, EPS_CLASSID, 1);
  PetscValidLogicalCollectiveReal(eps, shift, 2);
  PetscTryMethod(eps, "EPSAinsworthSetShift_C", (EPS, PetscReal), (eps, shift));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   EPSAinsworthGetShift - gets sigma of the matrix K + sigma M that is preconditioned

   Not Collective

   Input Parameter:
.  eps - the eigensolver

   Output Parameter:
.  shift - sigma of the last solve; before it what was set, `PETSC_DECIDE` by default

   Level: intermediate

   Errors:
   `PETSC_ERR_SUP` if the type of eps is not `EPSAINSWORTH`.

.seealso: `EPSAINSWORTH`, `EPSAinsworthSetShift()`
@*/
PetscErrorCode EPSAinsworthGetShift(EPS eps, PetscReal *shift)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(eps, EPS_CLASSID, 1);
  PetscAssertPointer(shift, 2);
  PetscUseMethod(eps, "EPSAinsworthGetShift_C", (EPS, PetscReal *), (eps, shift));
  PetscFunctionReturn(PETSC_SUCCESS);
}
