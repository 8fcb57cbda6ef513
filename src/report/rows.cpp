#include "report.h"
#include <petscdraw.h>
#include <cmath>

/* Formats a number; NaN and Inf become empty in CSV and a dash in a table */
static PetscErrorCode Number(PetscReal value, bool csv, char text[16])
{
  PetscFunctionBegin;
  if (PetscIsInfOrNanReal(value)) PetscCall(PetscStrncpy(text, csv ? "" : "-", 16));
  else PetscCall(PetscSNPrintf(text, 16, csv ? "%.8e" : "%.4e", (double)value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetKind(AinsworthReport *report, PetscBool *ascii, bool *csv)
{
  PetscFunctionBegin;
  *csv = report->settings->format == PETSC_VIEWER_ASCII_CSV;
  PetscCall(PetscObjectTypeCompare((PetscObject)report->settings->viewer, PETSCVIEWERASCII, ascii));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DestroyCount(AinsworthContext count)
{
  PetscFunctionBegin;
  delete (PetscInt *)AinsworthContextGet(count);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts the solves that the viewer has shown; KSPs on one communicator share the count if they use the same file */
static PetscErrorCode CountSolve(PetscViewer viewer, PetscInt *solve)
{
  const char     name[] = "AinsworthReportSolves";
  PetscContainer container;
  PetscInt      *count;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)viewer, name, (PetscObject *)&container));
  if (!container) {
    PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)viewer), &container));
    PetscCall(PetscContainerSetPointer(container, new PetscInt(0)));
    PetscCall(PetscContainerSetCtxDestroy(container, DestroyCount));
    PetscCall(PetscObjectCompose((PetscObject)viewer, name, (PetscObject)container));
    PetscCall(PetscObjectDereference((PetscObject)container)); /* the viewer has a reference */
  }
  PetscCall(PetscContainerGetPointer(container, (void **)&count));
  *solve = ++*count;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the file continues an earlier run; valid on the rank that writes it */
static PetscErrorCode Appends(PetscViewer viewer, bool *appends)
{
  PetscFileMode mode;
  FILE         *file;

  PetscFunctionBegin;
  PetscCall(PetscViewerFileGetMode(viewer, &mode));
  PetscCall(PetscViewerASCIIGetPointer(viewer, &file));
  *appends = mode == FILE_MODE_APPEND && file && !fseek(file, 0, SEEK_END) && ftell(file) > 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthReportHeader(AinsworthReport *report)
{
  PetscViewer viewer = report->settings->viewer;
  PetscBool   ascii;
  bool        csv, appends;
  char        upper[64];

  PetscFunctionBegin;
  PetscCall(GetKind(report, &ascii, &csv));
  PetscCall(CountSolve(viewer, &report->solve));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  if (csv) {
    PetscCall(Appends(viewer, &appends));
    if (report->solve == 1 && !appends)
      PetscCall(PetscViewerASCIIPrintf(viewer,
                                       "solve,seconds,iteration,delay,natural_norm,primal_residual,constraint_residual,"
                                       "error_lower,error_upper,error_true,error_relative,multiplier_error\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (report->settings->eigenvalue > 0.0)
    PetscCall(
      PetscSNPrintf(upper, sizeof(upper), "bound for eigenvalues from %g on", (double)report->settings->eigenvalue));
  else PetscCall(PetscStrncpy(upper, "estimate from the smallest Ritz value", sizeof(upper)));
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  Error against run time, solve %" PetscInt_FMT
                                   "; errors in the energy norm; lower: bound, upper: %s, relative: upper over x\n",
                                   report->solve, report->estimate ? upper : "none, the method is not CG"));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %5s %11s %11s %11s %11s %11s %11s %11s %11s %11s\n", "iter", "seconds",
                                   "natural", "res. f", "res. g", "error >=", "error <=", "true error", "relative",
                                   "C' lambda"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthReportPrint(AinsworthReport *report, PetscBool all)
{
  const AinsworthEstimator *e        = &report->estimator;
  const bool                estimate = report->estimate;
  const size_t              known    = all || !estimate ? report->rows.size() : (size_t)e->accurate;
  PetscViewer               viewer   = report->settings->viewer;
  PetscBool                 ascii;
  bool                      csv;

  PetscFunctionBegin;
  PetscCall(GetKind(report, &ascii, &csv));
  if (!ascii || report->printed == known) PetscFunctionReturn(PETSC_SUCCESS);
  for (; report->printed < known; report->printed++) {
    const AinsworthReportRow &row      = report->rows[report->printed];
    const PetscInt            step     = (PetscInt)report->printed;
    const PetscInt            delay    = estimate ? (PetscInt)e->fall.size() - step : 0;
    PetscReal                 values[] = {row.natural,
                                          row.primal,
                                          row.constraint,
                          delay > 0 ? AinsworthEstimatorLower(e, step) : NAN,
                          estimate ? AinsworthEstimatorUpper(e, step) : NAN,
                                          row.error,
                                          NAN,
                                          row.multipliers};
    const PetscReal           error    = estimate ? values[4] : row.error;
    char                      text[8][16];

    values[6] = report->energy > 0.0 ? error / report->energy : NAN;
    for (int i = 0; i < 8; i++) PetscCall(Number(values[i], csv, text[i]));
    if (csv)
      PetscCall(PetscViewerASCIIPrintf(
        viewer, "%" PetscInt_FMT ",%.6f,%" PetscInt_FMT ",%" PetscInt_FMT ",%s,%s,%s,%s,%s,%s,%s,%s\n", report->solve,
        (double)row.seconds, step, delay, text[0], text[1], text[2], text[3], text[4], text[5], text[6], text[7]));
    else
      PetscCall(PetscViewerASCIIPrintf(viewer, "  %5" PetscInt_FMT " %11.4f %11s %11s %11s %11s %11s %11s %11s %11s\n",
                                       step, (double)row.seconds, text[0], text[1], text[2], text[3], text[4], text[5],
                                       text[6], text[7]));
  }
  PetscCall(PetscViewerFlush(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Plots log10 of the bounds and, if known, of the true error against the seconds */
PetscErrorCode AinsworthReportDraw(AinsworthReport *report)
{
  const AinsworthEstimator *e        = &report->estimator;
  const char *const         names[3] = {"lower", "upper", "true"};
  const int                 curves   = report->exact ? 3 : 2;
  PetscBool                 isdraw;
  PetscDraw                 draw;
  PetscDrawLG               graph;
  PetscDrawAxis             axis;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)report->settings->viewer, PETSCVIEWERDRAW, &isdraw));
  if (!isdraw || !report->estimate) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerDrawGetDraw(report->settings->viewer, 0, &draw));
  PetscCall(PetscDrawLGCreate(draw, curves, &graph));
  PetscCall(PetscDrawLGSetLegend(graph, names));
  PetscCall(PetscDrawLGGetAxis(graph, &axis));
  PetscCall(PetscDrawAxisSetLabels(axis, "Error against run time", "seconds", "log10 of the error in the energy norm"));
  for (size_t k = 0; k < e->fall.size(); k++) {
    const PetscReal errors[3] = {AinsworthEstimatorLower(e, (PetscInt)k), AinsworthEstimatorUpper(e, (PetscInt)k),
                                 report->rows[k].error};
    PetscReal       x[3], y[3];
    bool            good = true;

    for (int i = 0; i < curves; i++) {
      x[i] = report->rows[k].seconds;
      y[i] = std::log10(errors[i]);
      good = good && std::isfinite(y[i]);
    }
    if (good) PetscCall(PetscDrawLGAddPoint(graph, x, y));
  }
  PetscCall(PetscDrawLGDraw(graph));
  PetscCall(PetscDrawLGSave(graph));
  PetscCall(PetscDrawLGDestroy(&graph));
  PetscFunctionReturn(PETSC_SUCCESS);
}
