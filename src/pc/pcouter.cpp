/* The outer Krylov method: what PETSc tells of it before and after each solve, and checks of what it returns */
#include "pcainsworth.h"
#include "../base/events.h"
#include <petsc/private/kspimpl.h>

/*
   PCAinsworthReductionsCollide_Private - checks whether the outer method has a reduction under way, in which a
   pipelined inner method cannot begin its own

   PETSc allows one at a time on a communicator
*/
PetscErrorCode PCAinsworthReductionsCollide_Private(const PC_Ainsworth *data, Vec v, PetscBool *collide)
{
  const char *const pipelined = KSPPIPECG "," KSPPIPECGRR "," KSPPIPELCG "," KSPPIPEPRCG "," KSPPIPECG2 "," KSPGROPPCG
                                          "," KSPPIPEFCG "," KSPPIPECR "," KSPPIPEBCGS "," KSPPIPEGCR "," KSPPIPEFGMRES
                                          "," KSPPGMRES;
  KSPType        type;
  PetscScalar    dot;
  PetscErrorCode code;

  PetscFunctionBegin;
  PetscCall(KSPGetType(data->inner.ksp, &type));
  PetscCall(PetscStrInList(type, pipelined, ',', collide));
  if (!*collide) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  code = VecDotBegin(v, v, &dot); /* the only way to ask */
  PetscCall(PetscPopErrorHandler());
  *collide = (PetscBool)(code != PETSC_SUCCESS);
  if (!code) PetscCall(VecDotEnd(v, v, &dot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Begins an outer solve, to which all applications belong until PCPostSolve() */
PetscErrorCode PCPreSolve_Ainsworth(PC pc, KSP ksp, Vec, Vec)
{
  PC_Ainsworth  *data = PCAinsworthData_Private(pc);
  PetscBool      answer, flexible;
  PCFailedReason failed;

  PetscFunctionBegin;
  /* KSPSetUp() of a new outer method takes the failure of the last solve for one of set-up */
  PetscCall(PCGetFailedReason(pc, &failed));
  if (ksp->reason == KSP_DIVERGED_PC_FAILED && !failed) ksp->reason = KSP_CONVERGED_ITERATING;
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPPREONLY, &answer));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &flexible, KSPFGMRES, KSPGCR, KSPFCG, KSPPIPEFGMRES, KSPPIPEGCR,
                                      KSPPIPEFCG, ""));
  data->outer.method = answer ? AINSWORTH_OUTER_ANSWER : flexible ? AINSWORTH_OUTER_FLEXIBLE : AINSWORTH_OUTER_RIGID;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Clears the failure of the last solve, which the program may query until then, before a KSP takes it for its own */
PetscErrorCode PCSetUpOnBlocks_Ainsworth(PC pc)
{
  PC_Ainsworth *data    = PCAinsworthData_Private(pc);
  PetscBool     changed = PETSC_FALSE;

  PetscFunctionBegin;
  if (data->outer.applications &&
      /* the method would end before it calls PCApply(), where a block changed in place is noticed */
      data->state == PC_AINSWORTH_REFUSED) {
    PetscCall(PCAinsworthUpdateInputs_Private(pc, data));
    PetscCall(AinsworthSaddleChanged(&data->given.inputs, data->saddle.get(), &changed));
    if (changed) PetscCall(PCSetUp_Ainsworth(pc));
  } else if (data->outer.applications) PetscCall(AinsworthSolverForgetFailure(pc));
  data->outer.applications = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Fails if the outer method took b for zero without applying this PC, because the squares of its entries underflow, and
   returned x = 0
*/
static PetscErrorCode CheckUnderflow(PC pc, PC_Ainsworth *data, KSP ksp, Vec b)
{
  PetscReal norm, largest;
  char      why[256];

  PetscFunctionBegin;
  if (data->outer.applications || ksp->reason <= 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecNorm(b, NORM_2, &norm));
  PetscCall(VecNorm(b, NORM_INFINITY, &largest));
  if (norm > 0.0 || largest == 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSNPrintf(
    why, sizeof(why),
    "The outer method, %s, takes the right-hand side for zero: the squares of its entries, of %g at most, underflow. "
    "Scale the system, or use -ksp_type %s",
    AinsworthTypeName((PetscObject)ksp), (double)largest, KSPPREONLY));
  ksp->reason = KSP_DIVERGED_PC_FAILED;
  PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_FP, why));
  data->outer.applications++; /* the failure is that of a solve, not of set-up */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the largest residual of a row of the program's system relative to its terms */
static PetscErrorCode WorstRow(PC_Ainsworth *data, PetscBool transpose, PetscReal allowed, Vec b, Vec x, Vec left,
                               PetscReal *error)
{
  /* of what a row is allowed: that part of the largest row is allowed to all */
  static const PetscReal part       = 1e-3;
  const AinsworthMeasure measure[3] = {
    {allowed, part * allowed},
    {allowed, part * allowed},
    {allowed, part * allowed}
  };
  const PetscBool        other = (PetscBool)!transpose; /* b has the numbering of the rows */
  const AinsworthSaddle *sp    = data->saddle.get();
  AinsworthSaddleVecRef  rest;
  AinsworthBackward      worst;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleUseFields(sp, other, AINSWORTH_ACCESS_READ, left, [&](AinsworthSaddleVec part) {
    PetscFunctionBegin;
    PetscCall(AinsworthVecClone(part.primal, rest.primal.out()));
    PetscCall(AinsworthVecClone(part.dual, rest.dual.out()));
    PetscFunctionReturn(PETSC_SUCCESS);
  }));
  PetscCall(AinsworthSaddleUseFields(sp, other, AINSWORTH_ACCESS_READ, b, [&](AinsworthSaddleVec given) {
    return AinsworthSaddleUseFields(sp, transpose, AINSWORTH_ACCESS_READ, x, [&](AinsworthSaddleVec y) {
      PetscFunctionBegin;
      PetscCall((transpose ? MatMultTranspose : MatMult)(sp->block[AINSWORTH_BLOCK_A], y.primal, data->reduced->Ax));
      /* signs do not matter for sizes */
      PetscCall(AinsworthBackwardError(sp, transpose, measure, NULL, given, y, data->reduced->Ax, rest, &worst));
      PetscFunctionReturn(PETSC_SUCCESS);
    });
  }));
  *error = allowed * PetscMax(worst.primal.omega, worst.dual.omega);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Fails if the residual at the end of an outer solve is small neither in the norm of b nor row by row

   A method that stops by P (b - K x) relative to P b accepts anything if P b is huge, as it is if a motion is free
*/
static PetscErrorCode CheckOuter(PC pc, PC_Ainsworth *data, KSP ksp, Vec b, Vec x)
{
  static const PetscReal slack = 100, little = 1e-3;
  const PetscReal        allowed   = PetscMax(little, slack * ksp->rtol);
  const PetscBool        transpose = ksp->transpose_solve;
  PetscReal              norm, rest, error = 0.0;
  MatNullSpace           nullspace;
  Vec                    left;
  char                   why[256];
  PetscErrorCode (*test)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);

  PetscFunctionBegin;
  PetscCall(KSPGetConvergenceTest(ksp, &test, NULL, NULL));
  if (data->outer.applications <= 1 || ksp->reason != KSP_CONVERGED_RTOL || test != KSPConvergedDefault)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(AINSWORTH_Verify, pc, 0, 0, 0));
  PetscCall(VecDuplicate(b, &left));
  PetscCall((transpose ? MatMultTranspose : MatMult)(data->given.inputs.amat, x, left));
  PetscCall(VecAYPX(left, -1.0, b));
  PetscCall((transpose ? MatGetNullSpace : MatGetTransposeNullSpace)(data->given.inputs.amat, &nullspace));
  if (nullspace) PetscCall(MatNullSpaceRemove(nullspace, left));
  PetscCall(VecNorm(b, NORM_2, &norm));
  PetscCall(VecNorm(left, NORM_2, &rest));
  if (!(rest <= allowed * norm)) PetscCall(WorstRow(data, transpose, allowed, b, x, left, &error));
  PetscCall(VecDestroy(&left));
  PetscCall(PetscLogEventEnd(AINSWORTH_Verify, pc, 0, 0, 0));
  if (error <= allowed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSNPrintf(why, sizeof(why),
                          "The outer method, %s, says that it converged, but a row of the system is left with %g of "
                          "its terms, which its norm does not see: "
                          "use -ksp_type %s, or %s",
                          AinsworthTypeName((PetscObject)ksp), (double)error, KSPPREONLY, KSPFGMRES));
  ksp->reason = KSP_DIVERGED_PC_FAILED;
  PetscCall(PCAinsworthFail_Private(pc, data, PC_SUBPC_ERROR, PETSC_ERR_NOT_CONVERGED, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Ends an outer solve and checks it: some methods apply the preconditioner once more after convergence, to get x, and
   do not check for failure
*/
PetscErrorCode PCPostSolve_Ainsworth(PC pc, KSP ksp, Vec b, Vec x)
{
  PC_Ainsworth *data = PCAinsworthData_Private(pc);

  PetscFunctionBegin;
  if (data->outer.applications && !data->outcome.usable && ksp->reason > 0) ksp->reason = KSP_DIVERGED_PC_FAILED;
  if (data->outer.applications && data->outcome.usable) PetscCall(CheckOuter(pc, data, ksp, b, x));
  data->outer.method = AINSWORTH_OUTER_NONE;
  PetscCall(CheckUnderflow(pc, data, ksp, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}
