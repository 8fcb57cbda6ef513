/* Facts for whether the inner preconditioner is kept for other values of A or C: -pc_ainsworth_rebuild (inner/age.h, docs/contact.md) */
#include "pcainsworth.h"

/* PCAinsworthMustKeepInner_Private - returns whether the program or an option wants to keep it in any case */
PetscBool PCAinsworthMustKeepInner_Private(PC pc, const PC_Ainsworth *data)
{
  PetscBool reuse;

  (void)PCGetReusePreconditioner(pc, &reuse);
  return (PetscBool)(reuse || data->choices.rebuild == AINSWORTH_REBUILD_NEVER);
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
  *price = AinsworthPriceSetUp(hypre ? AINSWORTH_SETUP_BOOMERAMG : factored ? AINSWORTH_SETUP_FACTOR : AINSWORTH_SETUP_MULTIGRID, 0.0);
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
static PetscErrorCode Decades(const PC_Ainsworth *data, int *decades)
{
  PetscReal rtol;

  PetscFunctionBegin;
  PetscCall(KSPGetTolerances(data->inner.ksp, &rtol, NULL, NULL, NULL));
  if (data->reporting.settings.stop == AINSWORTH_STOP_ENERGY_ERROR) rtol = data->reporting.settings.rtol;
  *decades = AinsworthAgeDecades((double)rtol);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthDecideToKeepInner_Private - decides before a set-up whether the inner preconditioner is kept */
PetscErrorCode PCAinsworthDecideToKeepInner_Private(PC pc, const PC_Ainsworth *data, PetscBool *keeps)
{
  PC          inner;
  KSPNormType norm;
  double      price;
  PetscBool   expensive;

  PetscFunctionBegin;
  *keeps = PCAinsworthMustKeepInner_Private(pc, data);
  if (*keeps || data->choices.rebuild == AINSWORTH_REBUILD_ALWAYS || data->age.counts.last < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthGetInnerPC_Private(data, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &expensive, PCBLOCKSA, PCHYPRE, PCGAMG, PCML, PCHMG, PCLU, PCCHOLESKY, PCREDUNDANT, ""));
  PetscCall(KSPGetNormType(data->inner.ksp, &norm));
  PetscCall(Price(inner, &price));
  *keeps = (PetscBool)(expensive && norm != KSP_NORM_NONE && AinsworthAgeKeeps(data->age.counts, price));
  if (expensive && !*keeps)
    PetscCall(PetscInfo(pc, "The inner preconditioner is not kept: it took %g iterations more than at first in %d solves, and a set-up costs %g\n",
                        data->age.counts.more, data->age.counts.solves, price));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthLimit_Private - gets the iterations after which an old preconditioner is rebuilt and the solve begun again; 0 for no limit */
PetscErrorCode PCAinsworthLimit_Private(PC pc, const PC_Ainsworth *data, PetscInt *limit)
{
  int      decades;
  double   price;
  PetscInt most;
  PC       inner;

  PetscFunctionBegin;
  *limit = 0;
  if (data->age.type == PC_AINSWORTH_AGE_FRESH || PCAinsworthMustKeepInner_Private(pc, data) || data->age.counts.last < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthGetInnerPC_Private(data, &inner));
  PetscCall(KSPGetTolerances(data->inner.ksp, NULL, NULL, NULL, &most));
  PetscCall(Price(inner, &price));
  PetscCall(Decades(data, &decades));
  *limit = PetscMin((PetscInt)AinsworthAgeLimit(data->age.counts, decades, price), most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthCount_Private - counts the iterations of a reduced solve that converged */
PetscErrorCode PCAinsworthCount_Private(PC_Ainsworth *data)
{
  PetscInt iterations;
  int      decades;

  PetscFunctionBegin;
  PetscCall(KSPGetIterationNumber(data->inner.ksp, &iterations));
  PetscCall(Decades(data, &decades));
  AinsworthAgeCount(&data->age.counts, (int)iterations, decades, data->age.type != PC_AINSWORTH_AGE_FRESH);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthViewRebuild_Private - prints the rule, and what is kept now */
PetscErrorCode PCAinsworthViewRebuild_Private(const PC_Ainsworth *data, PetscViewer viewer)
{
  static const char *const words[] = {"", "; now with the coarser levels of an earlier A", "; now that of an earlier matrix"};

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "  inner preconditioner: rebuilt %s%s\n", PCAinsworthRebuildTypes[data->choices.rebuild], words[data->age.type]));
  if (data->age.counts.last >= 0)
    PetscCall(PetscViewerASCIIPrintf(viewer, "    iterations: %d in the last solve with it; all took %g more than at first\n", data->age.counts.last,
                                     data->age.counts.more));
  PetscFunctionReturn(PETSC_SUCCESS);
}
