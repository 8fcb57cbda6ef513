/* The program's Krylov method around PCAINSWORTH: what PETSc tells of it before and after each solve, and what both must agree on */
#include "pcainsworth.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>

/* PCAinsworthReductionsCollide_Private - has the outer method a reduction under way, among which a pipelined inner method cannot begin its own? PETSc has one at a time on a communicator */
PetscErrorCode PCAinsworthReductionsCollide_Private(const PC_Ainsworth *data, Vec v, PetscBool *collide)
{
  const char *const pipelined = KSPPIPECG "," KSPPIPECGRR "," KSPPIPELCG "," KSPPIPEPRCG "," KSPPIPECG2 "," KSPGROPPCG "," KSPPIPEFCG "," KSPPIPECR
                                          "," KSPPIPEBCGS "," KSPPIPEGCR "," KSPPIPEFGMRES "," KSPPGMRES;
  KSPType        type;
  PetscScalar    dot;
  PetscErrorCode code;

  PetscFunctionBegin;
  PetscCall(KSPGetType(data->ksp, &type));
  PetscCall(PetscStrInList(type, pipelined, ',', collide));
  if (!*collide) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  code = VecDotBegin(v, v, &dot); /* the only way to ask */
  PetscCall(PetscPopErrorHandler());
  *collide = (PetscBool)(code != PETSC_SUCCESS);
  if (!code) PetscCall(VecDotEnd(v, v, &dot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From here on to PCPostSolve() all applications are those of one outer solve */
PetscErrorCode PCPreSolve_Ainsworth(PC pc, KSP ksp, Vec, Vec)
{
  PC_Ainsworth  *data = (PC_Ainsworth *)pc->data;
  PetscBool      flexible;
  PCFailedReason failed;

  PetscFunctionBegin;
  PetscCall(PCGetFailedReason(pc, &failed)); /* KSPSetUp() of another method than before has taken the failure of the last solve for one of the set-up */
  if (ksp->reason == KSP_DIVERGED_PC_FAILED && !failed) ksp->reason = KSP_CONVERGED_ITERATING;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &flexible, KSPPREONLY, KSPFGMRES, KSPGCR, KSPFCG, KSPPIPEFGMRES, KSPPIPEGCR, KSPPIPEFCG, ""));
  data->rigid        = (PetscBool)!flexible;
  data->applications = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before each solve of a KSP, which would take the failure of the last one, that the program may ask for until then, for one of its own */
PetscErrorCode PCSetUpOnBlocks_Ainsworth(PC pc)
{
  PC_Ainsworth *data    = (PC_Ainsworth *)pc->data;
  PetscBool     changed = PETSC_FALSE;

  PetscFunctionBegin;
  if (data->applied && data->refused) { /* the method would end before it asked PCApply(), where a block changed in place is noticed */
    PetscCall(PCAinsworthUpdateInputs_Private(pc, data));
    PetscCall(AinsworthSaddleChanged(&data->inputs, &data->saddle, &changed));
    if (changed) PetscCall(PCSetUp_Ainsworth(pc));
  } else if (data->applied) PetscCall(AinsworthPCSetFailedReason(pc, PC_NOERROR));
  data->applied = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A method that asked for nothing, as the squares of the entries of b underflow: it takes b for zero, and x = 0 for the answer */
static PetscErrorCode CheckUnderflow(PC pc, PC_Ainsworth *data, KSP ksp, Vec b)
{
  PetscReal norm, largest;
  char      why[256];

  PetscFunctionBegin;
  if (data->applied || ksp->reason <= 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecNorm(b, NORM_2, &norm));
  PetscCall(VecNorm(b, NORM_INFINITY, &largest));
  if (norm > 0.0 || largest == 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSNPrintf(why, sizeof(why),
                          "The outer method, %s, takes the right-hand side for zero: the squares of its entries, of %g at most, underflow. "
                          "Scale the system, or use -ksp_type %s",
                          ((PetscObject)ksp)->type_name, (double)largest, KSPPREONLY));
  ksp->reason = KSP_DIVERGED_PC_FAILED;
  PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_FP, why));
  data->applied = PETSC_TRUE; /* this was said of a solve, not of the set-up */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Some methods apply the preconditioner once more when they have converged, to get x, and do not ask whether that was good */
PetscErrorCode PCPostSolve_Ainsworth(PC pc, KSP ksp, Vec b, Vec)
{
  PC_Ainsworth *data = (PC_Ainsworth *)pc->data;

  PetscFunctionBegin;
  if (data->applied && !data->usable && ksp->reason > 0) ksp->reason = KSP_DIVERGED_PC_FAILED;
  data->applications = 0;
  data->rigid        = PETSC_FALSE;
  PetscCall(CheckUnderflow(pc, data, ksp, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}
