/* Preloaded, it makes PETSc report another minor version than the one its headers had. */
#include <petscsys.h>

PETSC_EXTERN PetscErrorCode PetscGetVersionNumber(PetscInt *major, PetscInt *minor, PetscInt *subminor, PetscInt *release)
{
  if (major) *major = PETSC_VERSION_MAJOR;
  if (minor) *minor = 99;
  if (subminor) *subminor = 0;
  if (release) *release = 1;
  return (PetscErrorCode)0;
}
