/* Set-up of the inner solver by its plan, rebuilt or kept */
#include "solver.h"
#include "../base/layouts.h"
#include "../multigrid/blocksa.h"
#include "../projection/matainsworth.h"

/* Checks by a solve whether the factorization is accurate: M may be singular to rounding without a bad pivot */
static PetscErrorCode Solves(PC inner, PetscBool *good)
{
  static const PetscReal accuracy = 1e-3;
  Vec                    x, b, y;
  Mat                    M;
  PetscReal              norm, error;
  PCFailedReason         reason;

  PetscFunctionBegin;
  PetscCall(PCGetOperators(inner, NULL, &M));
  PetscCall(PCGetFailedReason(inner, &reason));
  *good = (PetscBool)!reason;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, good, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)inner)));
  if (!*good) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateVecs(M, &x, &b));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecSetRandom(x, NULL));
  PetscCall(MatMult(M, x, b));
  PetscCall(PCApply(inner, b, y));
  PetscCall(VecAXPY(y, -1.0, x));
  PetscCall(VecNorm(x, NORM_2, &norm));
  PetscCall(VecNorm(y, NORM_2, &error));
  *good = (PetscBool)(error <= accuracy * norm); /* not for NaN */
  for (Vec *v : {&x, &b, &y}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the operators, the preconditioner and the solver up, in this order; *end and why: how that ended if it failed */
static PetscErrorCode SetUpParts(AinsworthSolver *solver, PC inner, AinsworthEnd *end, char why[], size_t len)
{
  KSP       ksp = solver->inner.ksp;
  PetscBool definite, good = PETSC_TRUE;
  Mat       operation, M;

  PetscFunctionBegin;
  PetscCall(AinsworthSolverConvertPmat(solver));
  PetscCall(AinsworthSolverSetKSPOperators(solver));
  /* the preconditioner gets M_* for both operators, because GAMG and ML smooth with the first one */
  PetscCall(KSPGetOperators(ksp, &operation, &M));
  PetscCall(AinsworthSolverLooksDefinite(solver, M, &definite));
  if (!definite) {
    *end = AINSWORTH_END_SETUP;
    PetscCall(PetscSNPrintf(
      why, len,
      "The preconditioning matrix is not positive definite, as BoomerAMG needs it: is A indefinite? %s-%spc_type",
      solver->saddle->constraints() ? "A larger -pc_ainsworth_penalty_factor may help, or another " : "Choose another ",
      AinsworthSolverPrefix(solver)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscObjectReference((PetscObject)operation));
  PetscCall(PCSetOperators(inner, M, M));
  PetscCall(AinsworthSolverForgetFailure(inner)); /* the reason for an earlier matrix, or type, would stay */
  PetscCall(AinsworthSolverSetUpPreconditioner(solver, inner, &definite));
  if (definite && solver->inner.plan.preconditioner == AINSWORTH_INNER_FACTOR) PetscCall(Solves(inner, &good));
  PetscCall(KSPSetOperators(ksp, operation, M));
  PetscCall(MatDestroy(&operation));
  if (!definite || !good) {
    *end = AINSWORTH_END_SETUP;
    PetscCall(PetscSNPrintf(
      why, len, "The preconditioning matrix %s: is A indefinite, or does a body float? Choose another -%spc_type",
      definite ? "cannot be factored" : "is not positive definite, as a Cholesky factorization needs it",
      AinsworthSolverPrefix(solver)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSolverKeepCoefficients(&solver->inner));
  PetscCall(KSPSetUp(ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Tells whether block smoothed aggregation, if it was our choice, does not fit the matrix, so that another multigrid
   has to take its place

   In Ker C larger levels are better than another multigrid, which would need M_*: a periodic cell with a complexity of
   2.9 takes 21 iterations, by BoomerAMG 149
*/
static PetscErrorCode IsUnfit(const AinsworthSolver *solver, PC inner, const char **doubts)
{
  static const PetscReal bearable = 4.0;
  PC_BlockSA            *sa       = NULL;

  PetscFunctionBegin;
  *doubts = NULL;
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  if (!sa || solver->inner.plan.preconditioner != AINSWORTH_INNER_BLOCKS || !sa->levels.hierarchy)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (sa->subspace && sa->levels.hierarchy->levels() > 1 && sa->levels.hierarchy->complexity() <= bearable)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (sa->levels.hierarchy->doubts[0]) *doubts = sa->levels.hierarchy->doubts;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the preconditioning matrix and the inner solver; *end and why: how that ended if it failed */
static PetscErrorCode SetUpAnew(AinsworthSolver *solver, PC inner, AinsworthEnd *end, char why[], size_t len)
{
  PetscInt    bad = -1;
  const char *doubts;

  PetscFunctionBegin;
  PetscCall(AinsworthSolverForgetOperators(&solver->inner));
  solver->inner.M.reset();
  PetscCall(AinsworthSolverGetPmatFormat(solver, &solver->inner.format));
  if (solver->saddle->constraints()) PetscCall(AinsworthSolverSetUpPmat(solver, inner, &bad));
  else PetscCall(AinsworthSolverSetUpAlone(solver, inner));
  if (bad >= 0) {
    *end = AINSWORTH_END_SETUP;
    PetscCall(PetscSNPrintf(
      why, len,
      "Row %" PetscInt_FMT
      " of the preconditioning matrix holds NaN or Inf: the penalty factor, or the values of A, C or D, are too large "
      "or too small",
      bad));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SetUpParts(solver, inner, end, why, len));
  if (*end != AINSWORTH_END_ANSWER) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(IsUnfit(solver, inner, &doubts));
  if (doubts) {
    *end = AINSWORTH_END_UNFIT;
    PetscCall(PetscStrncpy(why, doubts, len));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSolverUseProduct(solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Keeps the preconditioning matrix and its preconditioner, with the operator and the constraints of the current matrix
*/
static PetscErrorCode KeepWhole(PC pc, AinsworthSolver *solver)
{
  PC  inner;
  Mat M;

  PetscFunctionBegin;
  PetscCall(PetscInfo(pc, "The inner preconditioner is kept, the constraints are set up anew\n"));
  PetscCall(AinsworthSolverReuseInner(solver, PETSC_TRUE));
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PCGetOperators(inner, NULL, &M));
  solver->inner.M = AinsworthRetain(M);
  if (solver->saddle->constraints()) { /* these may belong to an earlier A or C */
    solver->inner.left = AinsworthLeftOut();
    PetscCall(MatAinsworthSetPenalty(solver->reduced->mat, NULL));
    PetscCall(MatAinsworthSetProduct_Private(solver->reduced->mat, NULL));
  }
  PetscCall(AinsworthSolverSetKSPOperators(solver));
  PetscCall(AinsworthSolverKeepCoefficients(&solver->inner));
  PetscCall(KSPSetUp(solver->inner.ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether C is what it was when the inner preconditioner was made; otherwise keeping that as a whole costs more
   iterations than it saves
*/
static PetscErrorCode SameConstraints(const AinsworthSolver *solver, PetscBool *same)
{
  PetscInt  m;
  PetscBool fits;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(solver->saddle->kept.C, &m, NULL));
  PetscCall(solver->age.source.holds(solver->saddle->kept.C, NULL, std::vector<PetscReal>(m, 0.0), same, &fits));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverSetUpInner - sets up the inner solver by its plan, or keeps its preconditioner. Collective

   keep: it is kept if that was requested or C is the same; PCBLOCKSA keeps its levels of A then, and gets the surface
   of the current matrix, which costs little. *end and why: how the set-up ended, AINSWORTH_END_ANSWER if the solver can
   be used
*/
PetscErrorCode AinsworthSolverSetUpInner(PC pc, AinsworthSolver *solver, PetscBool keep, AinsworthEnd *end, char why[],
                                         size_t len)
{
  PC          inner;
  PetscBool   made;
  PC_BlockSA *sa;

  PetscFunctionBegin;
  *end = AINSWORTH_END_ANSWER;
  PetscCall(AinsworthSolverReview(pc, solver));
  PetscCall(AinsworthSolverConfigureKSP(pc, solver));
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  PetscCall(PCGetOperatorsSet(inner, NULL, &made));
  if (!sa) keep = (PetscBool)(keep && made);
  if (!sa && keep && !AinsworthSolverMustKeepInner(pc, solver)) PetscCall(SameConstraints(solver, &keep));
  if (!sa && keep) {
    PetscCall(KeepWhole(pc, solver));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSolverReuseInner(solver, PETSC_FALSE));
  if (sa) sa->keep = keep;
  else PetscCall(solver->age.source.take(solver->saddle->kept.C, NULL));
  if (!keep) solver->age.counts = AinsworthAge();
  PetscCall(SetUpAnew(solver, inner, end, why, len));
  solver->age.type = sa && sa->old ? PC_AINSWORTH_AGE_LEVELS : PC_AINSWORTH_AGE_FRESH;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverChangeMethod - takes the method of the present plan, with the preconditioner that there is */
PetscErrorCode AinsworthSolverChangeMethod(PC pc, AinsworthSolver *solver, AinsworthEnd *end)
{
  PetscFunctionBegin;
  PetscCall(AinsworthSolverConfigureKSP(pc, solver));
  PetscCall(AinsworthSolverSetKSPOperators(solver));
  *end = AINSWORTH_END_ANSWER;
  PetscFunctionReturn(PETSC_SUCCESS);
}
