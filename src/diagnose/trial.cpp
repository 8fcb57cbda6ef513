/*
   Trial solve of the reduced system with a random right-hand side, which finds floating bodies, indefinite matrices,
   and multigrid that does not fit
*/
#include "diagnose.h"
#include "../base/objects.h"
#include "../projection/matainsworth.h"

/* Creates a KSP with the method and the preconditioner of the inner solver, but without its monitors and options */
static PetscErrorCode CreateKSP(const AinsworthSolver *solver, KSP *trial)
{
  /* dtol is infinite: with a floating body the residual grows until x is its motion */
  static const PetscInt most = 300, restart = 100;
  KSPType               type;
  KSPNormType           norm;
  PCSide                side;
  PC                    inner;

  PetscFunctionBegin;
  PetscCall(KSPGetType(solver->inner.ksp, &type));
  PetscCall(KSPGetNormType(solver->inner.ksp, &norm));
  PetscCall(KSPGetPCSide(solver->inner.ksp, &side));
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)solver->inner.ksp), trial));
  PetscCall(KSPSetOptionsPrefix(*trial, AinsworthSolverPrefix(solver)));
  PetscCall(KSPAppendOptionsPrefix(*trial, "trial_"));
  PetscCall(KSPSetType(*trial, type));
  PetscCall(KSPSetPC(*trial, inner));
  if (norm != KSP_NORM_NONE) PetscCall(KSPSetNormType(*trial, norm));
  PetscCall(KSPSetPCSide(*trial, side));
  PetscCall(KSPGMRESSetRestart(*trial, restart));
  PetscCall(KSPSetTolerances(*trial, 1e-8, 0.0, PETSC_MAX_REAL, most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Creates the reduced right-hand side of random forces on all unknowns, scaled by the roots of their stiffness, without
   its part in the null space

   What the view reports on the last right-hand side (ctx->homogeneous) is preserved
*/
static PetscErrorCode CreateForces(const AinsworthSolver *solver, KSP trial, Vec *f)
{
  Vec          root;
  Mat          operation;
  MatNullSpace nullsp;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(solver->reduced->inverseDiagonal, f));
  PetscCall(AinsworthVecClone(solver->reduced->inverseDiagonal, &root));
  PetscCall(VecSqrtAbs(root));
  PetscCall(AinsworthVecSetRandom(*f));
  PetscCall(VecPointwiseDivide(*f, *f, root));
  PetscCall(VecDestroy(&root));
  if (solver->saddle->constraints()) {
    Mat_Ainsworth *ctx;

    PetscCall(MatAinsworthGetContext_Private(solver->reduced->mat, &ctx));
    const PetscBool homogeneous = ctx->homogeneous;

    PetscCall(MatAinsworthReduce_Private(solver->reduced->mat, PETSC_FALSE, *f, NULL, *f));
    ctx->homogeneous = homogeneous;
  }
  PetscCall(KSPGetOperators(trial, &operation, NULL));
  PetscCall(MatGetNullSpace(operation, &nullsp));
  if (nullsp) PetscCall(MatNullSpaceRemove(nullsp, *f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTry - solves for random forces after set-up. Collective

   smallest: estimated eigenvalue of the preconditioned operator, 0 if the method is not conjugate gradients; why: the
   cause of a failure, otherwise empty, also if the solve is only slow
*/
PetscErrorCode AinsworthTry(PC pc, AinsworthSolver *solver, KSPConvergedReason *reason, PetscInt *iterations,
                            PetscReal *smallest, char why[], size_t len)
{
  static const PetscReal suspicious = 1e-10; /* relative to the energy of diag(A) */
  PetscInt               n;
  PetscReal              quotient;
  PetscBool              conjugate;
  Vec                    f, x;
  KSP                    trial;

  PetscFunctionBegin;
  why[0]      = 0;
  *iterations = 0;
  *smallest   = 0.0;
  *reason     = KSP_CONVERGED_HAPPY_BREAKDOWN;
  PetscCall(VecGetSize(solver->reduced->inverseDiagonal, &n));
  /* the constraints alone determine x */
  if (solver->saddle->constraints() == n && !solver->saddle->kept.D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CreateKSP(solver, &trial));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)trial, &conjugate, KSPCG, KSPPROJECTEDCG, ""));
  PetscCall(KSPSetComputeSingularValues(trial, conjugate));
  PetscCall(CreateForces(solver, trial, &f));
  PetscCall(VecDuplicate(f, &x));
  PetscCall(AinsworthSolverEnter(solver, trial, x));
  PetscCall(KSPSolve(trial, f, x));
  PetscCall(AinsworthSolverLeave(solver, trial));
  PetscCall(KSPGetConvergedReason(trial, reason));
  PetscCall(KSPGetIterationNumber(trial, iterations));
  /* after a breakdown PETSc has not stored the last coefficients, and its eigenvalue solver may not end */
  if (*iterations && (*reason > 0 || *reason == KSP_DIVERGED_ITS))
    PetscCall(AinsworthReportSmallestRitzValue(trial, smallest));
  PetscCall(VecCopy(x, f));
  PetscCall(AinsworthSolverRayleighQuotient(solver, f, &quotient));
  if ((*reason < 0 && *reason != KSP_DIVERGED_ITS) || (solver->saddle->symmetric && quotient < suspicious))
    PetscCall(AinsworthExplain(pc, solver, trial, x, *reason, why, len));
  PetscCall(KSPDestroy(&trial));
  PetscCall(VecDestroy(&f));
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
