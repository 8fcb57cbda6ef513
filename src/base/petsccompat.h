/* Hides differences between PETSc 3.18 and 3.26 */
#ifndef AINSWORTH_PETSCCOMPAT_H
#define AINSWORTH_PETSCCOMPAT_H

#include <petscksp.h>

#if PETSC_VERSION_LT(3, 19, 0)
  #define PETSC_SUCCESS ((PetscErrorCode)0)
#endif

#if PETSC_VERSION_LT(3, 20, 0)
  #define PetscAssertPointer(ptr, arg) PetscValidPointer(ptr, arg)
  #define KSPSetNestLevel(ksp, level)  PETSC_SUCCESS
  #define PCGetKSPNestLevel(pc, level) (*(level) = 0, PETSC_SUCCESS)
#endif

/* PETSc documents these calls, but declares them in a private header */
PETSC_EXTERN PetscErrorCode PetscObjectStateGet(PetscObject, PetscObjectState *);
PETSC_EXTERN PetscErrorCode PetscObjectStateSet(PetscObject, PetscObjectState);

/* before 3.20 a PC has a failed reason per rank besides the collective one */
#if PETSC_VERSION_LT(3, 20, 0)
  #define AinsworthPCSetFailedReason(pc, reason) ((pc)->failedreasonrank = (reason), PCSetFailedReason(pc, reason))
#else
  #define AinsworthPCSetFailedReason(pc, reason) PCSetFailedReason(pc, reason)
#endif

/* gets the current log stage; logging must be active */
static inline PetscErrorCode AinsworthLogGetStage(PetscLogStage *stage)
{
#if !defined(PETSC_USE_LOG)
  *stage = 0;
#elif PETSC_VERSION_LT(3, 20, 0)
  PetscStageLog log;

  PetscCall(PetscLogGetStageLog(&log));
  PetscCall(PetscStageLogGetCurrent(log, stage));
#else
  PetscLogState state;

  PetscCall(PetscLogGetState(&state));
  PetscCall(PetscLogStateGetCurrentStage(state, stage));
#endif
  return PETSC_SUCCESS;
}

#if PETSC_VERSION_LT(3, 22, 0)
  #define VecFlag(x, flag) ((flag) ? VecSetInf(x) : PETSC_SUCCESS)
#endif

/* argument of functions such as PetscOptionsHeadBegin(), passed by value since 3.23 */
#if PETSC_VERSION_LT(3, 23, 0)
typedef PetscOptionItems *AinsworthOptionItems;
#else
typedef PetscOptionItems AinsworthOptionItems;
#endif

/*
   argument of a function that destroys the context of a PetscContainer, and the context itself: since 3.23 the argument
   is the address of the context
*/
#if PETSC_VERSION_LT(3, 23, 0)
typedef void *AinsworthContext;
  #define AinsworthContextGet(argument)                   (argument)
  #define PetscContainerSetCtxDestroy(container, destroy) PetscContainerSetUserDestroy(container, destroy)
#elif PETSC_VERSION_LT(3, 25, 0)
typedef void **AinsworthContext;
  #define AinsworthContextGet(argument) (*(argument))
#else
typedef PetscCtxRt AinsworthContext;
  #define AinsworthContextGet(argument) (*(void **)(argument))
#endif

/*
   before 3.25 KSPReset() of KSPFCG leaves dangling vectors; since then it destroys them, but KSPSetType() without
   KSPReset() leaks them
*/
#if PETSC_VERSION_LT(3, 25, 0)
  #define AINSWORTH_FCG_OLD KSPFCG
  #define AINSWORTH_FCG_NEW ""
#else
  #define AINSWORTH_FCG_OLD ""
  #define AINSWORTH_FCG_NEW KSPFCG
#endif

/* type of a function that destroys the context of a convergence test */
#if PETSC_VERSION_LT(3, 24, 0)
typedef PetscErrorCode AinsworthTestDestroyFn(void *);
#else
typedef PetscCtxDestroyFn AinsworthTestDestroyFn;
#endif

#if PETSC_VERSION_LT(3, 25, 0)
  #define SNES_DIVERGED_FUNCTION_NANORINF SNES_DIVERGED_FNORM_NAN
#endif

/* type of the text that PetscErrorMessage() returns */
#if PETSC_VERSION_LT(3, 25, 0)
typedef char *AinsworthErrorText;
#else
typedef const char *AinsworthErrorText;
#endif

/* MPI type of PetscBool, which is bool of C since 3.24 */
#if PETSC_VERSION_LT(3, 24, 0)
  #define AINSWORTH_MPI_BOOL MPIU_BOOL
#else
  #define AINSWORTH_MPI_BOOL MPI_C_BOOL
#endif

#endif
