/*
   Facts for whether the inner preconditioner is kept for other values of A or C: -pc_ainsworth_rebuild (inner/age.h,
   docs/contact.md)
*/
#include "solver.h"

const char *const PCAinsworthRebuildTypes[] = {"auto", "always", "never", "AinsworthRebuildType", "AINSWORTH_REBUILD_",
                                               NULL};

/* AinsworthSolverMustKeepInner - returns whether the program or an option wants to keep it in any case */
PetscBool AinsworthSolverMustKeepInner(PC pc, const AinsworthSolver *solver)
{
  PetscBool reuse;

  (void)PCGetReusePreconditioner(pc, &reuse);
  return (PetscBool)(reuse || solver->choices.rebuild == AINSWORTH_REBUILD_NEVER);
}

/* Gets the price of a set-up of the inner preconditioner in iterations; it has been set up before */
static PetscErrorCode Price(PC inner, double *price)
{
  PetscBool factored, known, hypre;
  PetscInt  n;
  MatInfo   info;
  Mat       F;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, PCHYPRE, &hypre));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &factored, PCLU, PCCHOLESKY, ""));
  *price = AinsworthPriceSetUp(hypre      ? AINSWORTH_SETUP_BOOMERAMG
                               : factored ? AINSWORTH_SETUP_FACTOR
                                          : AINSWORTH_SETUP_MULTIGRID,
                               0.0);
  if (!factored) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCFactorGetMatrix(inner, &F));
  PetscCall(MatHasOperation(F, MATOP_GETINFO, &known));
  if (!known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetInfo(F, MAT_GLOBAL_SUM, &info));
  PetscCall(MatGetSize(F, &n, NULL));
  if (n) *price = AinsworthPriceSetUp(AINSWORTH_SETUP_FACTOR, (double)info.nz_allocated / (double)n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the requested reduction in decades */
static PetscErrorCode Decades(const AinsworthSolver *solver, int *decades)
{
  PetscReal rtol;

  PetscFunctionBegin;
  *decades = 0;
  PetscCall(KSPGetTolerances(solver->inner.ksp, &rtol, NULL, NULL, NULL));
  if (solver->settings.stop == AINSWORTH_STOP_ENERGY_ERROR) rtol = solver->settings.rtol;
  *decades = AinsworthAgeDecades((double)rtol);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverDecideToKeepInner - decides before a set-up whether the inner preconditioner is kept */
PetscErrorCode AinsworthSolverDecideToKeepInner(PC pc, const AinsworthSolver *solver, PetscBool *keeps)
{
  PC          inner;
  KSPNormType norm;
  double      price;
  PetscBool   expensive;

  PetscFunctionBegin;
  *keeps = AinsworthSolverMustKeepInner(pc, solver);
  if (*keeps || solver->choices.rebuild == AINSWORTH_REBUILD_ALWAYS || solver->age.counts.last < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &expensive, PCBLOCKSA, PCHYPRE, PCGAMG, PCML, PCHMG, PCLU,
                                      PCCHOLESKY, PCREDUNDANT, ""));
  PetscCall(KSPGetNormType(solver->inner.ksp, &norm));
  PetscCall(Price(inner, &price));
  *keeps = (PetscBool)(expensive && norm != KSP_NORM_NONE && AinsworthAgeKeeps(solver->age.counts, price));
  if (expensive && !*keeps)
    PetscCall(PetscInfo(pc,
                        "The inner preconditioner is not kept: it took %g iterations more than at first in %d solves, "
                        "and a set-up costs %g\n",
                        solver->age.counts.more, solver->age.counts.solves, price));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverLimit - gets the iterations after which an old preconditioner is rebuilt and the solve begun again; 0
   for no limit
*/
PetscErrorCode AinsworthSolverLimit(PC pc, const AinsworthSolver *solver, PetscInt *limit)
{
  int      decades;
  double   price;
  PetscInt most;
  PC       inner;

  PetscFunctionBegin;
  *limit = 0;
  if (solver->age.type == PC_AINSWORTH_AGE_FRESH || AinsworthSolverMustKeepInner(pc, solver) ||
      solver->age.counts.last < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(KSPGetTolerances(solver->inner.ksp, NULL, NULL, NULL, &most));
  PetscCall(Price(inner, &price));
  PetscCall(Decades(solver, &decades));
  *limit = PetscMin((PetscInt)AinsworthAgeLimit(solver->age.counts, decades, price), most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverCount - counts the iterations of a reduced solve that converged */
PetscErrorCode AinsworthSolverCount(AinsworthSolver *solver)
{
  PetscInt iterations;
  int      decades;

  PetscFunctionBegin;
  PetscCall(KSPGetIterationNumber(solver->inner.ksp, &iterations));
  PetscCall(Decades(solver, &decades));
  AinsworthAgeCount(&solver->age.counts, (int)iterations, decades, solver->age.type != PC_AINSWORTH_AGE_FRESH);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverViewRebuild - prints the rule, and what is kept now */
PetscErrorCode AinsworthSolverViewRebuild(const AinsworthSolver *solver, PetscViewer viewer)
{
  static const char *const rules[] = {"rebuilt when that is cheaper (auto)", "rebuilt for each matrix (always)",
                                      "never rebuilt (never)"};
  static const char *const words[] = {"", "; now with the coarser levels of an earlier A",
                                      "; now that of an earlier matrix"};

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "  inner preconditioner: %s%s\n", rules[solver->choices.rebuild],
                                   words[solver->age.type]));
  if (solver->age.counts.last >= 0)
    PetscCall(
      PetscViewerASCIIPrintf(viewer, "    iterations of the last reduced solve: %d\n", solver->age.counts.last));
  if (solver->age.counts.more > 0.0)
    PetscCall(PetscViewerASCIIPrintf(viewer, "    in excess of its first solve, all solves together: %d\n",
                                     (int)(solver->age.counts.more + 0.5)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
