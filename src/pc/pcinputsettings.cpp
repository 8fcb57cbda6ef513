#include "pcainsworth.h"
#include <petsc/private/pcimpl.h>

const char *const PCAinsworthRedundantTypes[] = {"drop", "error", "PCAinsworthRedundantType", "PC_AINSWORTH_REDUNDANT_", NULL};

/*@
   PCAinsworthSetRedundantType - sets what is done with rows of C that are linear combinations of other rows

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  type - `PC_AINSWORTH_REDUNDANT_DROP` (default) or `PC_AINSWORTH_REDUNDANT_ERROR`

   Options Database Key:
.  -pc_ainsworth_redundant <drop,error> - the choice

   Level: intermediate

   Notes:
   Dependent rows are looked for only if the Gram matrix S = C W C' cannot be factored, or if its solves have a relative error of more than 1.5e-8, which
   is found out with one solve. A row counts as dependent if its squared distance from the span of rows that are kept, in the norm of W, is at most
   1e-13 of its own square, or 1e-11, then 1e-9, where that is not enough to solve with S. Of a set of dependent rows it is not defined which are left out.

   The multipliers of rows that are left out are zero: of all lambda that solve the system this is a basic one, not that of smallest norm. x and C' lambda do not
   depend on the choice. Each right-hand side is checked against these rows, C_i x = g_i to 1e-8 of |C_i| |x| + |g_i|; if it contradicts them the
   failure is `PC_INCONSISTENT_RHS`.

   Errors:
   `PETSC_ERR_MAT_CH_ZRPVT` at set-up with `PC_AINSWORTH_REDUNDANT_ERROR`, `PETSC_ERR_ARG_INCOMP` for contradicting right-hand sides with
   `-ksp_error_if_not_converged`; both name rows of the multiplier field.

.seealso: `PCAINSWORTH`, `PCAinsworthRedundantType`, `PCAinsworthGetRedundantType()`
@*/
PetscErrorCode PCAinsworthSetRedundantType(PC pc, PCAinsworthRedundantType type)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveEnum(pc, type, 2);
  if (data->redundant != type) PetscCall(PCAinsworthSetStale(pc, data));
  data->redundant = type;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetRedundantType - gets what is done with rows of C that are linear combinations of other rows

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  type - the choice

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetRedundantType()`
@*/
PetscErrorCode PCAinsworthGetRedundantType(PC pc, PCAinsworthRedundantType *type)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(type, 2);
  *type = data->redundant;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetCheckTranspose - compares the blocks C and C' of the system entry by entry

   Logically Collective

   Input Parameters:
+  pc    - the preconditioner
-  check - `PETSC_FALSE` (default): one product with a random vector is compared, and the entries only if it differs

   Options Database Key:
.  -pc_ainsworth_check_transpose <false,true> - the choice

   Level: advanced

   Notes:
   Two blocks of which one is a transpose view of the other are not compared. A difference of more than 1e-10 of the largest entry of its row counts.

   Errors:
   `PETSC_ERR_ARG_INCOMP` at set-up, naming the first entry that differs.

.seealso: `PCAINSWORTH`, `PCAinsworthGetCheckTranspose()`
@*/
PetscErrorCode PCAinsworthSetCheckTranspose(PC pc, PetscBool check)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveBool(pc, check, 2);
  if (check && !data->checkTranspose) PetscCall(PCAinsworthSetStale(pc, data));
  data->checkTranspose = check;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetCheckTranspose - gets whether the blocks C and C' are compared entry by entry

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  check - `PETSC_TRUE` if they are

   Level: advanced

.seealso: `PCAINSWORTH`, `PCAinsworthSetCheckTranspose()`
@*/
PetscErrorCode PCAinsworthGetCheckTranspose(PC pc, PetscBool *check)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(check, 2);
  *check = data->checkTranspose;
  PetscFunctionReturn(PETSC_SUCCESS);
}
