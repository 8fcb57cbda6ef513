/* Fields of a DM, found as PCFIELDSPLIT finds them */
#include "layout.h"
#include <petscdm.h>

/* Attaches rigid-body modes to the index set of a field if its DM has coordinates of its nodes */
static PetscErrorCode AttachModes(DM dm, IS field)
{
  MatNullSpace modes;
  PetscInt     n;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)field, "nearnullspace", (PetscObject *)&modes));
  if (modes || !dm) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ISGetLocalSize(field, &n));
  PetscCall(AinsworthDMCreateRigidModes(dm, n, &modes));
  if (modes) PetscCall(PetscObjectCompose((PetscObject)field, "nearnullspace", (PetscObject)modes));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthDMGetFields - gets the fields of a DM; none if it has fewer than two or its size is not that of the matrix.
   Collective
*/
PetscErrorCode AinsworthDMGetFields(DM dm, Mat mat, AinsworthFields *fields)
{
  PetscInt n, size, total = 0;
  char   **names;
  IS      *sets;
  DM      *dms;

  PetscFunctionBegin;
  fields->clear();
  PetscCall(DMSetUp(dm)); /* a DM created by the KSP is not set up yet */
  PetscCall(DMCreateFieldDecomposition(dm, &n, &names, &sets, &dms));
  for (PetscInt i = 0; i < n; i++) {
    const AinsworthRef<IS> set = AinsworthOwn(sets[i]);

    PetscCall(ISGetSize(sets[i], &size));
    total += size;
    fields->push_back({names[i] ? names[i] : std::to_string(i), set, set});
    PetscCall(PetscFree(names[i]));
    if (dms) PetscCall(AttachModes(dms[i], sets[i]));
    if (dms) PetscCall(DMDestroy(&dms[i]));
  }
  PetscCall(PetscFree(names));
  PetscCall(PetscFree(sets));
  PetscCall(PetscFree(dms));
  PetscCall(MatGetSize(mat, &size, NULL));
  if (n < 2 || total != size) fields->clear();
  PetscFunctionReturn(PETSC_SUCCESS);
}
