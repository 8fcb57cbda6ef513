#include "pcainsworth.h"
#include "../projection/matainsworth.h"

/* What a user has to check: the layout, the size of nodes, the modes, the rows of C */
static PetscErrorCode ViewSystem(const PC_Ainsworth *data, PetscViewer viewer)
{
  char dropped[256] = "", layout[256], modes[128];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleDescribeLayout(data->saddle.get(), layout, sizeof(layout)));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  layout: %s\n", layout));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  block size of A: %" PetscInt_FMT " (%s)\n", data->saddle->bs,
                                   data->saddle->bsSource));
  PetscCall(AinsworthSaddleDescribeModes(data->saddle.get(), modes, sizeof(modes)));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  near null space of A: %s\n", modes[0] ? modes : "none given"));
  PetscCall(AinsworthSaddleDescribeRows(data->saddle.get(), dropped, sizeof(dropped)));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  constraints: %" PetscInt_FMT "%s%s\n", data->saddle->constraints(),
                                   data->saddle->constraints() ? "" : ", A alone is solved", dropped));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What became of the solves: a failure, or a factorization that took the place of multigrid */
static PetscErrorCode ViewOutcome(const PC_Ainsworth *data, PetscViewer viewer)
{
  PetscFunctionBegin;
  if (data->history.factor == AINSWORTH_TAKEN)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  preconditioning matrix factored %s\n", data->escape.why));
  if (data->outcome.why[0]) PetscCall(PetscViewerASCIIPrintf(viewer, "  last failure: %s\n", data->outcome.why));
  if (data->whole.factor)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  ladder: the whole system is factored: %s\n", data->whole.why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The view without a format: at most ten lines */
static PetscErrorCode ViewOverview(PC pc, const PC_Ainsworth *data, PetscViewer viewer)
{
  PetscBool   made;
  const char *prefix;
  PetscReal   rtol;
  KSPNormType norm;
  PC          inner;

  PetscFunctionBegin;
  if (data->saddle) PetscCall(ViewSystem(data, viewer));
  else PetscCall(PetscViewerASCIIPrintf(viewer, "  not set up yet\n"));
  PetscCall(KSPGetOperatorsSet(data->inner.ksp, &made, NULL));
  if (data->state >= PC_AINSWORTH_READY && made) {
    PetscCall(AinsworthSolverGetInnerPC(data, &inner));
    PetscCall(KSPGetTolerances(data->inner.ksp, &rtol, NULL, NULL, NULL));
    PetscCall(KSPGetNormType(data->inner.ksp, &norm));
    PetscCall(PetscViewerASCIIPrintf(viewer, "  reduced solve: %s, preconditioned by %s",
                                     AinsworthTypeName((PetscObject)data->inner.ksp),
                                     AinsworthTypeName((PetscObject)inner)));
    PetscCall(PetscViewerASCIIUseTabs(viewer, PETSC_FALSE)); /* the same line */
    if (norm != KSP_NORM_NONE)
      PetscCall(PetscViewerASCIIPrintf(viewer, ", to a relative tolerance of %g", (double)rtol));
    PetscCall(PetscViewerASCIIPrintf(viewer, "\n"));
    PetscCall(PetscViewerASCIIUseTabs(viewer, PETSC_TRUE));
    if (data->age.counts.last >= 0)
      PetscCall(PetscViewerASCIIPrintf(viewer, "  iterations of the last reduced solve: %d\n", data->age.counts.last));
  }
  PetscCall(ViewOutcome(data, viewer));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  for more: -%sksp_view ::ascii_info_detail\n", prefix ? prefix : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The view with ::ascii_info_detail: all that was chosen, and the solvers inside */
static PetscErrorCode ViewDetails(PC_Ainsworth *data, PetscViewer viewer)
{
  Mat_Ainsworth *ctx = NULL;
  PetscBool      made;
  std::string    text;

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "  variant: %s (weight %s, penalty %s with factor %g)\n", PCAinsworthVariants[data->choices.variant],
    MatAinsworthWeightTypes[data->choices.weightType], AinsworthPenaltyTypes[data->choices.pmat.penalty],
    (double)AinsworthSolverPenaltyFactor(data)));
  PetscCall(AinsworthDescribePmat(data, text));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  preconditioning matrix: %s\n", text.c_str()));
  PetscCall(PCAinsworthReportView_Private(data, viewer));
  if (!data->saddle) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "  not set up yet\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(ViewSystem(data, viewer));
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
  PetscCall(ViewOutcome(data, viewer));
  PetscCall(KSPGetOperatorsSet(data->inner.ksp, &made, NULL));
  if (data->state >= PC_AINSWORTH_READY && made) {
    PetscCall(AinsworthDescribeLeftOut(data, (PetscBool)(data->state == PC_AINSWORTH_UNCHANGED), text));
    PetscCall(PetscViewerASCIIPrintf(viewer, "  left out: %s\n", text.c_str()));
  }
  PetscCall(AinsworthSolverViewRebuild(data, viewer));
  if (data->whole.factor) {
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

PetscErrorCode PCView_Ainsworth(PC pc, PetscViewer viewer)
{
  PC_Ainsworth     *data = PCAinsworthData_Private(pc);
  PetscViewerFormat format;
  PetscBool         ascii, string;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERSTRING, &string));
  if (string)
    PetscCall(PetscViewerStringSPrintf(viewer, " %s, pmat %s", PCAinsworthVariants[data->choices.variant],
                                       PCAinsworthPmatTypes[data->choices.pmat.type]));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerGetFormat(viewer, &format));
  if (format == PETSC_VIEWER_ASCII_INFO_DETAIL) PetscCall(ViewDetails(data, viewer));
  else PetscCall(ViewOverview(pc, data, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
