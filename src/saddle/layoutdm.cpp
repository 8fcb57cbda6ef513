/* A DM with fields, as PCFIELDSPLIT finds them */
#include "layout.h"
#include <petscdm.h>

/* AinsworthDMGetFields - the fields of a DM with the rows of the matrix; none where it has less than two, or is of another size */
PetscErrorCode AinsworthDMGetFields(DM dm, Mat mat, AinsworthFields *fields)
{
  PetscInt n, size, total = 0;
  char   **names;
  IS      *sets;
  DM      *dms;

  PetscFunctionBegin;
  fields->clear();
  PetscCall(DMSetUp(dm)); /* that a KSP makes for itself waits for it */
  PetscCall(DMCreateFieldDecomposition(dm, &n, &names, &sets, &dms));
  for (PetscInt i = 0; i < n; i++) {
    const AinsworthIS set = AinsworthOwnIS(sets[i]);

    PetscCall(ISGetSize(sets[i], &size));
    total += size;
    fields->push_back({names[i] ? names[i] : std::to_string(i), set, set});
    PetscCall(PetscFree(names[i]));
    if (dms) PetscCall(DMDestroy(&dms[i]));
  }
  PetscCall(PetscFree(names));
  PetscCall(PetscFree(sets));
  PetscCall(PetscFree(dms));
  PetscCall(MatGetSize(mat, &size, NULL));
  if (n < 2 || total != size) fields->clear();
  PetscFunctionReturn(PETSC_SUCCESS);
}
