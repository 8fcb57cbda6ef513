/* Shares or copies PETSc objects */
#ifndef AINSWORTH_OBJECTS_H
#define AINSWORTH_OBJECTS_H

#include "petsccompat.h"

/* Sets *to = from and adds a reference; what *to pointed to before is not destroyed */
template <typename Object>
static inline PetscErrorCode AinsworthShare(Object from, Object *to)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectReference((PetscObject)from));
  *to = from;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets *to = from (may be NULL), adds a reference and destroys what *to pointed to before */
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

/* Sets entries at random between -1 and 1. Collective */
static inline PetscErrorCode AinsworthVecSetRandom(Vec v)
{
  PetscRandom random;

  PetscFunctionBegin;
  PetscCall(PetscRandomCreate(PetscObjectComm((PetscObject)v), &random));
  PetscCall(PetscRandomSetInterval(random, -1.0, 1.0));
  PetscCall(VecSetRandom(v, random));
  PetscCall(PetscRandomDestroy(&random));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
