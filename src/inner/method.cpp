/* The method of the reduced solve, its norm and its side, unless they were chosen, and how it ended */
#include "solver.h"
#include <petsc/private/kspimpl.h>

/* Checks whether the method is one of conjugate gradients, for a Hermitian positive definite system */
PetscErrorCode AinsworthSolverIsConjugateGradients(KSPType type, PetscBool *definite)
{
  PetscFunctionBegin;
  PetscCall(PetscStrInList(type,
                           KSPPROJECTEDCG "," KSPCG "," KSPFCG "," KSPPIPEFCG "," KSPPIPECG "," KSPGROPPCG
                                          "," KSPPIPEPRCG "," KSPPIPECG2,
                           ',', definite));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverMethodType - returns the type of a method that we choose; NULL for that of the program */
KSPType AinsworthSolverMethodType(AinsworthMethod method)
{
  static const KSPType types[] = {NULL, KSPPROJECTEDCG, KSPCG, KSPGMRES};

  return types[method];
}

/* AinsworthSolverForgetNorm - resets the norm and the side that we chose, before options of another method are read */
PetscErrorCode AinsworthSolverForgetNorm(AinsworthInner *inner)
{
  PetscFunctionBegin;
  if (inner->plan.norm == AINSWORTH_NORM_NATURAL) PetscCall(KSPSetNormType(inner->ksp, KSP_NORM_DEFAULT));
  if (inner->plan.norm == AINSWORTH_NORM_TRUE) PetscCall(KSPSetPCSide(inner->ksp, PC_SIDE_DEFAULT));
  inner->plan.norm = AINSWORTH_NORM_GIVEN;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverChooseNorm - sets the norm and the side of the inner method unless options or calls did */
PetscErrorCode AinsworthSolverChooseNorm(AinsworthInner *inner)
{
  KSP             ksp     = inner->ksp;
  PetscOptions    options = ((PetscObject)ksp)->options;
  const char     *prefix  = ((PetscObject)ksp)->prefix;
  const PetscBool natural = (PetscBool)(ksp->normsupporttable[KSP_NORM_NATURAL][PC_LEFT] > 0);
  PetscBool       normGiven, sideGiven, once;

  PetscFunctionBegin;
  /* it tests nothing, and would report failure with a norm */
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPPREONLY, &once));
  if (once) PetscFunctionReturn(PETSC_SUCCESS);
  /* the natural norm, if the method has it, is the only one that is meaningful for both AMG and the energy */
  PetscCall(PetscOptionsHasName(options, prefix, "-ksp_norm_type", &normGiven));
  if (!normGiven && ksp->normtype == KSP_NORM_DEFAULT && natural && ksp->pc_side != PC_RIGHT) {
    PetscCall(KSPSetNormType(ksp, KSP_NORM_NATURAL));
    inner->plan.norm = AINSWORTH_NORM_NATURAL;
  }
  /* for GMRES and the like the true residual counts: precondition from the right */
  PetscCall(PetscOptionsHasName(options, prefix, "-ksp_pc_side", &sideGiven));
  if (!sideGiven && !normGiven && ksp->pc_side_set == PC_SIDE_DEFAULT && !natural &&
      ksp->normsupporttable[KSP_NORM_UNPRECONDITIONED][PC_RIGHT]) {
    PetscCall(KSPSetPCSide(ksp, PC_RIGHT));
    inner->plan.norm = AINSWORTH_NORM_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverSetMethod - sets another inner method; the options, the norm and the side that belong to it follow
   when it is configured
*/
PetscErrorCode AinsworthSolverSetMethod(AinsworthInner *inner, KSPType type)
{
  static const PetscInt restart = 100; /* more than with multigrid is needed: a restart would lose the Krylov space */
  PetscBool             same, loses, gmres;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)inner->ksp, type, &same));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompare((PetscObject)inner->ksp, AINSWORTH_FCG_NEW, &loses));
  if (loses) PetscTryTypeMethod(inner->ksp, reset);
  PetscCall(KSPSetType(inner->ksp, type));
  PetscCall(PetscStrcmp(type, KSPGMRES, &gmres));
  if (gmres) PetscCall(KSPGMRESSetRestart(inner->ksp, restart));
  inner->configured = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverKeepCoefficients - has conjugate gradients keep their coefficients, of which the stop reads the
   smallest eigenvalue

   PETSc allocates as many at their set-up as iterations are allowed then; that of KSPFCG crashes when it is asked for
   these values
*/
PetscErrorCode AinsworthSolverKeepCoefficients(AinsworthInner *inner)
{
  KSP       ksp = inner->ksp;
  PetscBool cg;

  PetscFunctionBegin;
  if (ksp->setupstage == KSP_SETUP_NEW) {
    PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPCG, KSPPROJECTEDCG, ""));
    if (cg || inner->coefficients) PetscCall(KSPSetComputeSingularValues(ksp, cg));
    inner->coefficients = cg ? ksp->max_it : 0;
  } else if (inner->coefficients && ksp->max_it > inner->coefficients)
    PetscCall(KSPSetComputeSingularValues(ksp, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverGetReason - gets the reason of the inner solve; answer: it is the answer to the program

   GCR reports convergence at the limit of iterations, which counts only with -ksp_converged_maxits or without a test.
   One cycle is no answer either, unless -ksp_norm_type none asks for it
*/
PetscErrorCode AinsworthSolverGetReason(const AinsworthSolver *solver, PetscBool answer, KSPConvergedReason *reason)
{
  PetscErrorCode (*test)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  PetscObject ksp = (PetscObject)solver->inner.ksp;
  KSPNormType norm;
  PetscBool   asked = PETSC_FALSE, given, once;

  PetscFunctionBegin;
  PetscCall(KSPGetConvergedReason(solver->inner.ksp, reason));
  PetscCall(KSPGetNormType(solver->inner.ksp, &norm));
  PetscCall(PetscObjectTypeCompare(ksp, KSPPREONLY, &once));
  PetscCall(PetscOptionsHasName(ksp->options, ksp->prefix, "-ksp_norm_type", &given));
  PetscCall(PetscOptionsGetBool(ksp->options, ksp->prefix, "-ksp_converged_maxits", &asked, NULL));
  PetscCall(KSPGetConvergenceTest(solver->inner.ksp, &test, NULL, NULL));
  if (norm == KSP_NORM_NONE && !(once && !given && answer)) PetscFunctionReturn(PETSC_SUCCESS);
  if (*reason == KSP_CONVERGED_ITS && test == KSPConvergedDefault && !asked) *reason = KSP_DIVERGED_ITS;
  PetscFunctionReturn(PETSC_SUCCESS);
}
