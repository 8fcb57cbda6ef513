/* The method of the reduced solve, its norm and its side, unless they were chosen, and how it ended */
#include "pcainsworth.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>

/* Checks whether the method is one of conjugate gradients, for a Hermitian positive definite system */
PetscErrorCode PCAinsworthIsConjugateGradients_Private(KSPType type, PetscBool *definite)
{
  PetscFunctionBegin;
  PetscCall(
    PetscStrInList(type, KSPPROJECTEDCG "," KSPCG "," KSPFCG "," KSPPIPEFCG "," KSPPIPECG "," KSPGROPPCG "," KSPPIPEPRCG "," KSPPIPECG2, ',', definite));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that nobody chose the method, nor a norm, which another method may not support */
PetscErrorCode PCAinsworthMethodIsOpen_Private(PC pc, const PC_Ainsworth *data, PetscBool *open)
{
  PetscObject ksp = (PetscObject)data->ksp;
  PetscBool   given, norm, projected;

  PetscFunctionBegin;
  PetscCall(PetscOptionsHasName(ksp->options, ksp->prefix, "-ksp_type", &given));
  PetscCall(PetscOptionsHasName(ksp->options, ksp->prefix, "-ksp_norm_type", &norm));
  PetscCall(PetscObjectTypeCompare(ksp, KSPPROJECTEDCG, &projected));
  *open = (PetscBool)(projected && !((given || norm) && pc->setfromoptionscalled) && data->choices.variant == PC_AINSWORTH_WEIGHTED);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const PetscInt restart = 100; /* more than with multigrid is needed: a restart would lose the Krylov space */

/* Chooses the method unless it was chosen: KSPPROJECTEDCG, or GMRES if A is not symmetric or B is not C */
PetscErrorCode PCAinsworthChooseMethod_Private(PC pc, PC_Ainsworth *data)
{
  const PetscBool hermitian = (PetscBool)(data->symmetric && data->adjoint);
  PetscBool       open, gmres;
  KSP             ksp = data->ksp;

  PetscFunctionBegin;
  PetscCall(PCAinsworthMethodIsOpen_Private(pc, data, &open));
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPGMRES, &gmres));
  if (hermitian && data->ownMethod) {
    if (gmres) PetscCall(KSPSetType(ksp, KSPPROJECTEDCG));
    data->ownMethod = PETSC_FALSE;
  } else if (!hermitian && open) {
    PetscCall(
      PetscInfo(pc, "%s: the reduced system is solved by GMRES\n", data->symmetric ? "The blocks (0,1) and (1,0) are not adjoint" : "A is not symmetric"));
    PetscCall(KSPSetType(ksp, KSPGMRES));
    PetscCall(KSPGMRESSetRestart(ksp, restart));
    data->ownMethod = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthTakeGMRES_Private - switches to GMRES until the next set-up */
PetscErrorCode PCAinsworthTakeGMRES_Private(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(PCAinsworthSetMethod_Private(data, KSPGMRES));
  PetscCall(KSPGMRESSetRestart(data->ksp, restart));
  PetscCall(PCAinsworthSetKSPOperators_Private(data));
  data->ownMethod = data->indefinite = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Resets the norm and the side that we chose for another method */
PetscErrorCode PCAinsworthForgetNorm_Private(PC_Ainsworth *data)
{
  KSP ksp = data->ksp;

  PetscFunctionBegin;
  if (data->ownNorm) ksp->normtype_set = ksp->normtype = KSP_NORM_DEFAULT;
  if (data->ownSide) ksp->pc_side_set = ksp->pc_side = PC_SIDE_DEFAULT;
  data->ownNorm = data->ownSide = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the norm and the side of the inner method unless options or calls did */
PetscErrorCode PCAinsworthChooseNorm_Private(PC_Ainsworth *data)
{
  KSP          ksp     = data->ksp;
  PetscOptions options = ((PetscObject)ksp)->options;
  const char  *prefix  = ((PetscObject)ksp)->prefix;
  PetscBool    normGiven, sideGiven, once;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPPREONLY, &once)); /* it tests nothing, and would report failure with a norm */
  if (once) PetscFunctionReturn(PETSC_SUCCESS);
  /* the natural norm, if the method has it, is the only one that is meaningful for both AMG and the energy */
  PetscCall(PetscOptionsHasName(options, prefix, "-ksp_norm_type", &normGiven));
  if (!normGiven && ksp->normtype == KSP_NORM_DEFAULT && ksp->normsupporttable[KSP_NORM_NATURAL][PC_LEFT] && ksp->pc_side != PC_RIGHT) {
    PetscCall(KSPSetNormType(ksp, KSP_NORM_NATURAL));
    data->ownNorm = PETSC_TRUE;
  }
  /* for GMRES and the like the true residual counts: precondition from the right */
  PetscCall(PetscOptionsHasName(options, prefix, "-ksp_pc_side", &sideGiven));
  if (!sideGiven && !normGiven && ksp->pc_side_set == PC_SIDE_DEFAULT && !ksp->normsupporttable[KSP_NORM_NATURAL][PC_LEFT] &&
      ksp->normsupporttable[KSP_NORM_UNPRECONDITIONED][PC_RIGHT]) {
    PetscCall(KSPSetPCSide(ksp, PC_RIGHT));
    data->ownSide = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthKeepCoefficients_Private - has conjugate gradients keep their coefficients, of which the stop reads the smallest eigenvalue

   PETSc allocates as many at their set-up as iterations are allowed then; that of KSPFCG crashes when it is asked for these values
*/
PetscErrorCode PCAinsworthKeepCoefficients_Private(PC_Ainsworth *data)
{
  KSP       ksp = data->ksp;
  PetscBool cg;

  PetscFunctionBegin;
  if (ksp->setupstage == KSP_SETUP_NEW) {
    PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPCG, KSPPROJECTEDCG, ""));
    if (cg || data->coefficients) PetscCall(KSPSetComputeSingularValues(ksp, cg));
    data->coefficients = cg ? ksp->max_it : 0;
  } else if (data->coefficients && ksp->max_it > data->coefficients) PetscCall(KSPSetComputeSingularValues(ksp, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthGetReason_Private - gets the reason of the inner solve

   GCR reports convergence at the limit of iterations, which counts only with -ksp_converged_maxits or without a test. One cycle is no answer either, unless
   -ksp_norm_type none asks for it
*/
PetscErrorCode PCAinsworthGetReason_Private(const PC_Ainsworth *data, KSPConvergedReason *reason)
{
  PetscErrorCode (*test)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  PetscObject ksp = (PetscObject)data->ksp;
  KSPNormType norm;
  PetscBool   asked = PETSC_FALSE, given, once;

  PetscFunctionBegin;
  PetscCall(KSPGetConvergedReason(data->ksp, reason));
  PetscCall(KSPGetNormType(data->ksp, &norm));
  PetscCall(PetscObjectTypeCompare(ksp, KSPPREONLY, &once));
  PetscCall(PetscOptionsHasName(ksp->options, ksp->prefix, "-ksp_norm_type", &given));
  PetscCall(PetscOptionsGetBool(ksp->options, ksp->prefix, "-ksp_converged_maxits", &asked, NULL));
  PetscCall(KSPGetConvergenceTest(data->ksp, &test, NULL, NULL));
  if (norm == KSP_NORM_NONE && !(once && !given && data->outer == AINSWORTH_OUTER_ANSWER)) PetscFunctionReturn(PETSC_SUCCESS);
  if (*reason == KSP_CONVERGED_ITS && test == KSPConvergedDefault && !asked) *reason = KSP_DIVERGED_ITS;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthSetMethod_Private - sets another inner method and, once the options have been read, the norm and the side that belong to it */
PetscErrorCode PCAinsworthSetMethod_Private(PC_Ainsworth *data, KSPType type)
{
  PetscBool loses;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)data->ksp, AINSWORTH_FCG_NEW, &loses));
  if (loses) PetscTryTypeMethod(data->ksp, reset);
  PetscCall(KSPSetType(data->ksp, type));
  if (!data->configured) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthForgetNorm_Private(data));
  PetscCall(PCAinsworthChooseNorm_Private(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}
