/* Preloaded, it makes PETSc report what its headers did not say: another minor version, no release (or one), wider indices, other scalars */
#include <petscsys.h>

#if defined(OTHER_MINOR) || defined(OTHER_RELEASE)
PETSC_EXTERN PetscErrorCode PetscGetVersionNumber(PetscInt *major, PetscInt *minor, PetscInt *subminor, PetscInt *release)
{
  if (major) *major = PETSC_VERSION_MAJOR;
  if (minor) *minor = PetscDefined(OTHER_MINOR) ? 99 : PETSC_VERSION_MINOR;
  if (subminor) *subminor = 0;
  if (release) *release = PetscDefined(OTHER_RELEASE) ? !PETSC_VERSION_RELEASE : PETSC_VERSION_RELEASE;
  return (PetscErrorCode)0;
}
#else
/* a PETSc of wider indices writes them into the variables of a caller who has not found out before */
PETSC_EXTERN PetscErrorCode PetscGetVersionNumber(PetscInt *major, PetscInt *minor, PetscInt *subminor, PetscInt *release)
{
  (void)major;
  (void)minor;
  (void)subminor;
  (void)release;
  return PETSC_ERR_PLIB;
}
#endif

#if defined(OTHER_INDICES)
PETSC_EXTERN PetscErrorCode PetscDataTypeGetSize(PetscDataType type, size_t *size)
{
  *size = type == PETSC_INT ? 12 - sizeof(PetscInt) : sizeof(PetscScalar); /* 4 bytes where there were 8, or the reverse */
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
