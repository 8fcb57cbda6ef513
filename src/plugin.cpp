/*
   Entry points of the plugin: registration of types, for PETSc when it loads the plugin and for programs that link it
*/
#include <petscainsworth.h>
#include "base/events.h"
#include "projection/projectedcg.h"
#include "multigrid/blocksa.h"
#include "projection/matainsworth.h"
#include "pc/pcainsworth.h"
#include "projection/graph.h"
#include "projection/symbolic.h"
#include "snes/activeset.h"

static PetscBool  initialized = PETSC_FALSE;
static const char again[]     = "compile ainsworth again with the PETSc of the program";

static const char *KindOf(PetscDataType scalar)
{
  return scalar == PETSC_COMPLEX ? "complex" : "real";
}

static const char *ReleaseOf(PetscInt release)
{
  return release ? "a release" : "a development version";
}

/*
   Checks that the PETSc library has the scalar type, index size and minor version that the plugin was compiled for,
   because it uses private structures of PETSc. A development version reports the number of the last release, so the
   release flag is compared, too.

   The order of the checks matters: PetscGetVersionNumber() of a library with wider indices would write past a PetscInt.
   `found` is an array because PetscBool is wider before PETSc 3.24.
*/
static PetscErrorCode CheckLibrary(void)
{
  PetscDataType scalar;
  PetscBool     found[sizeof(PetscInt64)];
  PetscInt      major, minor, release;
  size_t        scalarSize, indexSize;

  PetscFunctionBegin;
  PetscCall(PetscDataTypeFromString("scalar", &scalar, found));
  PetscCall(PetscDataTypeGetSize(scalar, &scalarSize));
  PetscCheck(scalar == PETSC_SCALAR && scalarSize == sizeof(PetscScalar), PETSC_COMM_WORLD, PETSC_ERR_SUP_SYS,
             "ainsworth was compiled for a PETSc with %s scalars of %d bits and this program runs with one of %s "
             "scalars of %d bits: %s",
             KindOf(PETSC_SCALAR), (int)sizeof(PetscScalar) * 8, KindOf(scalar), (int)scalarSize * 8, again);
  PetscCall(PetscDataTypeGetSize(PETSC_INT, &indexSize));
  PetscCheck(
    indexSize == sizeof(PetscInt), PETSC_COMM_WORLD, PETSC_ERR_SUP_SYS,
    "ainsworth was compiled for a PETSc with %d-bit indices and this program runs with one of %d-bit indices: %s",
    (int)sizeof(PetscInt) * 8, (int)indexSize * 8, again);
  PetscCall(PetscGetVersionNumber(&major, &minor, NULL, &release));
  PetscCheck(!release == !PETSC_VERSION_RELEASE, PETSC_COMM_WORLD, PETSC_ERR_SUP_SYS,
             "ainsworth was compiled for PETSc %d.%d, %s, and this program runs with PETSc %d.%d, %s: %s",
             PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR, ReleaseOf(PETSC_VERSION_RELEASE), (int)major, (int)minor,
             ReleaseOf(release), again);
  PetscCheck(major == PETSC_VERSION_MAJOR && minor == PETSC_VERSION_MINOR, PETSC_COMM_WORLD, PETSC_ERR_SUP_SYS,
             "ainsworth was compiled for PETSc %d.%d and this program runs with PETSc %d.%d: %s", PETSC_VERSION_MAJOR,
             PETSC_VERSION_MINOR, (int)major, (int)minor, again);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Called by PetscFinalize(), so that types are registered again after another PetscInitialize() */
static PetscErrorCode FinalizePackage(void)
{
  PetscFunctionBegin;
  initialized = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@C
   AinsworthInitializePackage - registers the types of the plugin and their log events

   Not Collective, but to be called on all ranks

   Level: developer

   Notes:
   It registers `PCAINSWORTH`, `PCBLOCKSA`, `MATAINSWORTH`, `KSPPROJECTEDCG`, `KSPCHEBYSHEVSINGLE` and
   `SNESAINSWORTHACTIVESET`.

   PETSc calls it when it loads the plugin with `-dll_append`. A program that links the plugin calls it after
   `PetscInitialize()`. Repeated calls do no harm, nor does it to load a plugin that is also linked.

   Errors:
   `PETSC_ERR_SUP_SYS` if the PETSc of the program differs from the one that the plugin was compiled for: in the scalar
   type, the index size, the minor version, or in being a release or a development version.

.seealso: `PCAINSWORTH`, `MATAINSWORTH`, `KSPPROJECTEDCG`
@*/
PetscErrorCode AinsworthInitializePackage(void)
{
  PetscErrorCode (*present)(PC) = NULL;

  PetscFunctionBegin;
  if (initialized) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckLibrary());
  initialized = PETSC_TRUE;
  PetscCall(PetscRegisterFinalize(FinalizePackage));
  PetscCall(AinsworthRegisterEvents());

  /*
     if the file is loaded under two names, each copy has its own `initialized`: keep the types that the first one
     registered
  */
  PetscCall(PCInitializePackage());
  PetscCall(PetscFunctionListFind(PCList, PCAINSWORTH, &present));
  if (present) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCRegister(PCAINSWORTH, PCCreate_Ainsworth));
  PetscCall(PCRegister(PCBLOCKSA, PCCreate_BlockSA));
  PetscCall(MatRegister(MATAINSWORTH, MatCreate_Ainsworth));
  PetscCall(MatOrderingRegister(AinsworthDissection, AinsworthGraphDissect));
  PetscCall(MatOrderingRegister(AinsworthPredicted, AinsworthOrderingGet));
  PetscCall(KSPRegister(KSPPROJECTEDCG, KSPCreate_ProjectedCG));
  PetscCall(KSPRegister(KSPCHEBYSHEVSINGLE, KSPCreate_ChebyshevSingle));
  PetscCall(SNESRegister(SNESAINSWORTHACTIVESET, SNESCreate_AinsworthActiveSet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   MatCreateAinsworth - creates the reduced operator A~ = C' B C + Q' A Q as a matrix-free matrix

   Collective

   Input Parameters:
+  A - n x n, of any type with a product and a diagonal; referenced, never changed
-  C - m x n, `MATAIJ` with the column layout of A and linearly independent rows; referenced, never changed

   Output Parameter:
.  S - the matrix, n x n, of type `MATAINSWORTH`

   Level: intermediate

   Notes:
   Q = I - W C' (C W C')^{-1} C is the projector onto Ker C. By default W = diag(A)^{-1}, and B is diagonal with one
   penalty per row of C, see `MatAinsworthSetPenalty()`. `MatAinsworthSetWeightType()`, `MatAinsworthSetWeight()` and
   `MatAinsworthSetPenalty()` change them.

   Robert, Jolivet, Jamond and Badri have W = I and B = beta I in equation (3).

   In complex arithmetic ' is the adjoint.

   Errors:
   Those of `MatAinsworthSetMats()`.

.seealso: `MATAINSWORTH`, `MatAinsworthComputeRHS()`, `MatAinsworthComputeMultiplier()`, `MatAinsworthMultProjector()`,
`PCAINSWORTH`
@*/
PetscErrorCode MatCreateAinsworth(Mat A, Mat C, Mat *S)
{
  PetscFunctionBegin;
  PetscCall(AinsworthInitializePackage());
  PetscCall(MatAinsworthCreate_Private(A, C, S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Called by PetscDLLibraryOpen(), which derives the name from the file name without lib and .so */
PETSC_EXTERN PetscErrorCode PetscDLLibraryRegister_ainsworth(void)
{
  PetscFunctionBegin;
  PetscCall(AinsworthInitializePackage());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for libpetscainsworth.so, the naming scheme of PETSc's own libraries */
PETSC_EXTERN PetscErrorCode PetscDLLibraryRegister_petscainsworth(void)
{
  PetscFunctionBegin;
  PetscCall(AinsworthInitializePackage());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Fortran binding: call AinsworthInitializePackage(ierr). Without Fortran PETSc does not know the name mangling; most
   compilers append an underscore
*/
#if defined(PETSC_HAVE_FORTRAN_CAPS)
  #define ainsworthinitializepackage_ AINSWORTHINITIALIZEPACKAGE
#elif PetscDefined(HAVE_FORTRAN) && !defined(PETSC_HAVE_FORTRAN_UNDERSCORE)
  #define ainsworthinitializepackage_ ainsworthinitializepackage
#endif
PETSC_EXTERN void ainsworthinitializepackage_(PetscErrorCode *ierr)
{
  *ierr = AinsworthInitializePackage();
}
