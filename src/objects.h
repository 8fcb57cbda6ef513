/* One more owner of a PETSc object, or a copy of it */
#ifndef AINSWORTH_OBJECTS_H
#define AINSWORTH_OBJECTS_H

#include "petsccompat.h"

/* *to = from, to be destroyed as well; what *to was before is forgotten */
template <typename Object>
static inline PetscErrorCode AinsworthShare(Object from, Object *to)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectReference((PetscObject)from));
  *to = from;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same, which may be NULL, in the place of what *to was before */
template <typename Object>
static inline PetscErrorCode AinsworthReplace(Object from, Object *to)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectReference((PetscObject)from));
  PetscCall(PetscObjectDestroy((PetscObject *)to));
  *to = from;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode AinsworthVecClone(Vec v, Vec *copy)
{
  PetscFunctionBegin;
  PetscCall(VecDuplicate(v, copy));
  PetscCall(VecCopy(v, *copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
