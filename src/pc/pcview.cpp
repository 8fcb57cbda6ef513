#include "pcainsworth.h"
#include "../projection/matainsworth.h"

PetscErrorCode PCView_Ainsworth(PC pc, PetscViewer viewer)
{
  PC_Ainsworth  *data = PCAinsworthData_Private(pc);
  Mat_Ainsworth *ctx  = NULL;
  PetscBool      ascii, string, made;
  char           dropped[256] = "", layout[256], modes[128];
  std::string    text;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERSTRING, &string));
  if (string)
    PetscCall(PetscViewerStringSPrintf(viewer, " %s, pmat %s", PCAinsworthVariants[data->choices.variant],
                                       PCAinsworthPmatTypes[data->choices.pmat.type]));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "  variant: %s (weight %s, penalty %s with factor %g)\n", PCAinsworthVariants[data->choices.variant],
    MatAinsworthWeightTypes[data->choices.weightType], AinsworthPenaltyTypes[data->choices.pmat.penalty],
    (double)AinsworthSolverPenaltyFactor(data)));
  PetscCall(AinsworthDescribePmat(data, text));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  preconditioning matrix: %s\n", text.c_str()));
  if (data->history.factor == AINSWORTH_TAKEN)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  preconditioning matrix factored %s\n", data->escape.why));
  PetscCall(PCAinsworthReportView_Private(data, viewer));
  if (!data->saddle) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "  not set up yet\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleDescribeLayout(data->saddle.get(), layout, sizeof(layout)));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  layout: %s\n", layout));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  block size of A: %" PetscInt_FMT " (%s)\n", data->saddle->bs,
                                   data->saddle->bsSource));
  PetscCall(AinsworthSaddleDescribeModes(data->saddle.get(), modes, sizeof(modes)));
  if (modes[0]) PetscCall(PetscViewerASCIIPrintf(viewer, "  near null space of A: %s\n", modes));
  PetscCall(AinsworthSaddleDescribeRows(data->saddle.get(), dropped, sizeof(dropped)));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  constraints: %" PetscInt_FMT "%s%s\n", data->saddle->constraints(),
                                   data->saddle->constraints() ? "" : ", A alone is solved", dropped));
  if (AinsworthSolverReducedMat(data)) PetscCall(MatAinsworthGetContext_Private(data->reduced->mat, &ctx));
  if (ctx && ctx->weightType != data->choices.weightType)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "  weight: identity, as rows of C differ only where diag(A)^{-1} is too small to tell\n"));
  if (ctx && ctx->current) { /* otherwise an error ended its set-up, and a view must not begin another */
    PetscCall(PetscViewerASCIIPushTab(viewer));
    PetscCall(AinsworthProjectorDescribeGram(&ctx->proj, &text));
    PetscCall(PetscViewerASCIIPrintf(viewer, "%s\n", text.c_str()));
    PetscCall(AinsworthGramView(&ctx->proj.gram, viewer));
    PetscCall(PetscViewerASCIIPopTab(viewer));
  }
  if (data->outcome.why[0]) PetscCall(PetscViewerASCIIPrintf(viewer, "  last failure: %s\n", data->outcome.why));
  PetscCall(KSPGetOperatorsSet(data->inner.ksp, &made, NULL));
  if (data->state >= PC_AINSWORTH_READY && made) {
    PetscCall(AinsworthDescribeLeftOut(data, (PetscBool)(data->state == PC_AINSWORTH_UNCHANGED), text));
    PetscCall(PetscViewerASCIIPrintf(viewer, "  left out: %s\n", text.c_str()));
  }
  PetscCall(AinsworthSolverViewRebuild(data, viewer));
  if (data->whole.factor) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "  ladder: the whole system is factored: %s\n", data->whole.why));
    PetscCall(PetscViewerASCIIPushTab(viewer));
    PetscCall(AinsworthWholeView(data->whole.factor, viewer));
    PetscCall(PetscViewerASCIIPopTab(viewer));
  }
  if (data->whole.factor && !made) PetscFunctionReturn(PETSC_SUCCESS); /* there is no reduced solve */
  PetscCall(PetscViewerASCIIPrintf(viewer, "  reduced solve in the primal unknowns:\n"));
  PetscCall(PetscViewerASCIIPushTab(viewer));
  PetscCall(KSPView(data->inner.ksp, viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
