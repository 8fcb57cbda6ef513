/*
   Preloaded, it makes PETSc report what its headers did not say: another minor version, no release (or one), wider
   indices, other scalars
*/
#include <petscsys.h>

PETSC_EXTERN PetscErrorCode PetscGetVersionNumber(PetscInt *major, PetscInt *minor, PetscInt *subminor,
                                                  PetscInt *release)
{
#if defined(OTHER_INDICES)
  (void)major;
  (void)minor;
  (void)subminor;
  (void)release;
  /* wider indices would be written into the variables of a caller who has not found out before */
  return PETSC_ERR_PLIB;
#else
  if (major) *major = PETSC_VERSION_MAJOR;
  if (minor) *minor = PETSC_VERSION_MINOR;
  if (subminor) *subminor = 0;
  if (release) *release = PETSC_VERSION_RELEASE;
  #if defined(OTHER_MINOR)
  if (minor) *minor = 99;
  #elif defined(OTHER_RELEASE)
  if (release) *release = !PETSC_VERSION_RELEASE;
  #endif
  return (PetscErrorCode)0;
#endif
}

#if defined(OTHER_INDICES)
PETSC_EXTERN PetscErrorCode PetscDataTypeGetSize(PetscDataType type, size_t *size)
{
  /* 4 bytes where there were 8, or the reverse */
  *size = type == PETSC_INT ? 12 - sizeof(PetscInt) : sizeof(PetscScalar);
  return (PetscErrorCode)0;
}
#endif

#if defined(OTHER_SCALARS)
PETSC_EXTERN PetscErrorCode PetscDataTypeFromString(const char name[], PetscDataType *type, PetscBool *found)
{
  (void)name;
  *type  = PetscDefined(USE_COMPLEX) ? PETSC_REAL : PETSC_COMPLEX;
  *found = PETSC_TRUE;
  return (PetscErrorCode)0;
}
#endif
