/* Failures: agreed on by all ranks, raised as errors where the program wants that, kept in words */
#include "pcainsworth.h"
#include <petsc/private/pcimpl.h>

/* Sets the worst failure of all ranks on all of them; collective */
PetscErrorCode PCAinsworthAgreeOnFailure_Private(PC pc, PCFailedReason reason)
{
  PetscMPIInt worst = (PetscMPIInt)reason;

  PetscFunctionBegin;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)pc)));
  PetscCall(AinsworthPCSetFailedReason(pc, (PCFailedReason)worst));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prints the cause where -ksp_converged_reason asks for one: PETSc itself knows only PC_SUBPC_ERROR. Collective */
static PetscErrorCode PrintCause(PC pc, const char why[])
{
  const char  *prefix;
  PetscOptions options;
  char         value[PETSC_MAX_PATH_LEN] = "";
  PetscBool    wanted, no;

  PetscFunctionBegin;
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PetscObjectGetOptions((PetscObject)pc, &options));
  PetscCall(PetscOptionsGetString(options, prefix, "-ksp_converged_reason", value, sizeof(value), &wanted));
  PetscCall(PetscStrInList(value, "false,no,off,0", ',', &no));
  if (wanted && !no) PetscCall(PetscPrintf(PetscObjectComm((PetscObject)pc), "  PCAINSWORTH failed: %s\n", why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Raises an error if the program wants errors, otherwise sets a reason; keeps the text for -ksp_view and
   PCAinsworthGetFailure(); collective
*/
PetscErrorCode PCAinsworthFail_Private(PC pc, PC_Ainsworth *data, PCFailedReason reason, PetscErrorCode code,
                                       const char why[])
{
  PetscFunctionBegin;
  PetscCall(PetscStrncpy(data->outcome.why, why, sizeof(data->outcome.why)));
  PetscCall(AinsworthDiagnoseFailure(PetscObjectComm((PetscObject)pc), data->diagnosis.get(), PETSC_SUCCESS, why));
  PetscCheck(!pc->erroriffailure, PetscObjectComm((PetscObject)pc), code, "%s", why);
  PetscCall(PetscInfo(pc, "%s\n", why));
  PetscCall(PrintCause(pc, why));
  PetscCall(PCAinsworthAgreeOnFailure_Private(pc, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@C
   PCAinsworthGetFailure - gets the cause of the failure of the last set-up or solve of a `PCAINSWORTH`, in words

   Not Collective

   Input Parameter:
.  pc - the preconditioner, of type `PCAINSWORTH`

   Output Parameter:
.  why - the text, valid until the next set-up or solve; empty if nothing failed

   Level: beginner

   Note:
   `-ksp_view` and `-ksp_converged_reason` also print the text. With `-ksp_error_if_not_converged` it is the message of
   the error.
   docs/troubleshooting.md explains all texts.

.seealso: `PCAINSWORTH`, `PCGetFailedReason()`, `KSPGetConvergedReason()`
@*/
PetscErrorCode PCAinsworthGetFailure(PC pc, const char *why[])
{
  PC_Ainsworth *data;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError_Private(pc, &data));
  PetscAssertPointer(why, 2);
  *why = data->outcome.why;
  PetscFunctionReturn(PETSC_SUCCESS);
}
