#include "pcainsworth.h"
#include <petsc/private/pcimpl.h>

static const char monitorOption[] = "-pc_ainsworth_monitor_error";

/* "csv" and "csv:file" are short for PETSc's "ascii::ascii_csv" and "ascii:file:ascii_csv" */
static PetscErrorCode CreateCSVViewer(PC pc, const char file[], PetscViewer *viewer)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)pc);

  PetscFunctionBegin;
  if (file[0]) PetscCall(PetscViewerASCIIOpen(comm, file, viewer));
  else {
    PetscCall(PetscViewerASCIIGetStdout(comm, viewer));
    PetscCall(PetscObjectReference((PetscObject)*viewer));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MonitorFromOptions(PC pc, AinsworthOptionItems PetscOptionsObject)
{
  const char *const kinds[]                   = {"", "ascii", "csv", "draw"};
  char              value[PETSC_MAX_PATH_LEN] = "", kind[PETSC_MAX_PATH_LEN], *colon;
  PetscBool         set, known = PETSC_FALSE, csv;
  PetscViewer       viewer = NULL;
  PetscViewerFormat format = PETSC_VIEWER_DEFAULT;
  const char       *prefix;

  PetscFunctionBegin;
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PetscOptionsGetString(((PetscObject)pc)->options, prefix, monitorOption, value, sizeof(value), &set));
  PetscCall(PetscStrncpy(kind, value, sizeof(kind)));
  PetscCall(PetscStrchr(kind, ':', &colon));
  if (colon) *colon = 0;
  for (int i = 0; i < 4 && !known; i++) PetscCall(PetscStrcmp(kind, kinds[i], &known));
  PetscCheck(known, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONG, "Option %s is %s: it takes ascii[:file], csv[:file] and draw", monitorOption, value);
  PetscCall(PetscStrcmp(kind, "csv", &csv));
  if (csv) {
    PetscCall(CreateCSVViewer(pc, colon ? value + 4 : "", &viewer));
    format = PETSC_VIEWER_ASCII_CSV;
  } else PetscCall(PetscOptionsViewer(monitorOption, "Error against run time: also csv[:file]", "PCAinsworthSetErrorMonitor", &viewer, &format, &set));
  if (set) PetscCall(PCAinsworthSetErrorMonitor(pc, viewer, format));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReferenceFromOptions(PC pc, AinsworthOptionItems PetscOptionsObject)
{
  char        file[PETSC_MAX_PATH_LEN] = "";
  PetscBool   set;
  PetscViewer viewer;
  Vec         reference;

  PetscFunctionBegin;
  PetscCall(PetscOptionsString("-pc_ainsworth_reference", "File of the exact solution (PETSc binary), for the monitor", "PCAinsworthSetReference", file, file,
                               sizeof(file), &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerCreate(PetscObjectComm((PetscObject)pc), &viewer));
  PetscCall(PetscViewerSetType(viewer, PETSCVIEWERBINARY));
  PetscCall(PetscViewerBinarySetSkipInfo(viewer, PETSC_TRUE)); /* its options would stay in the program's database */
  PetscCall(PetscViewerFileSetMode(viewer, FILE_MODE_READ));
  PetscCall(PetscViewerFileSetName(viewer, file));
  PetscCall(VecCreate(PetscObjectComm((PetscObject)pc), &reference));
  PetscCall(VecLoad(reference, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(PCAinsworthSetReference(pc, reference));
  PetscCall(VecDestroy(&reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCAinsworthReportSetFromOptions(PC pc, AinsworthOptionItems PetscOptionsObject)
{
  AinsworthReportSettings *settings = &((PC_Ainsworth *)pc->data)->reporting;
  PCAinsworthStopType      stop     = settings->stop;
  PetscReal                real;
  PetscBool                flag = settings->residuals, set;

  PetscFunctionBegin;
  PetscCall(MonitorFromOptions(pc, PetscOptionsObject));
  PetscCall(PetscOptionsBool("-pc_ainsworth_monitor_error_residuals", "With the residuals of the original system", "PCAinsworthSetErrorMonitorResiduals", flag,
                             &flag, &set));
  if (set) PetscCall(PCAinsworthSetErrorMonitorResiduals(pc, flag));
  PetscCall(ReferenceFromOptions(pc, PetscOptionsObject));
  PetscCall(PetscOptionsEnum("-pc_ainsworth_stop", "What ends the reduced solve", "PCAinsworthSetStop", PCAinsworthStopTypes, (PetscEnum)stop,
                             (PetscEnum *)&stop, &set));
  if (set) PetscCall(PCAinsworthSetStop(pc, stop));
  real = settings->rtol;
  PetscCall(PetscOptionsReal("-pc_ainsworth_error_rtol", "Tolerance of energy_error", "PCAinsworthSetErrorTolerance", real, &real, &set));
  if (set) PetscCall(PCAinsworthSetErrorTolerance(pc, real));
  real = settings->eigenvalue;
  PetscCall(PetscOptionsReal("-pc_ainsworth_error_eigenvalue", "Lower bound of the spectrum of the preconditioned operator", "PCAinsworthSetErrorEigenvalue",
                             real, &real, &set));
  /* PETSC_DEFAULT is a negative number, which the setter takes for the default */
  PetscCheck(!set || real > 0.0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "-pc_ainsworth_error_eigenvalue must be positive, not %g",
             (double)real);
  if (set) PetscCall(PCAinsworthSetErrorEigenvalue(pc, real));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCAinsworthReportReset(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(AinsworthReportDestroy(&data->report));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the reduced solve for f and g on the kept rows */
PetscErrorCode PCAinsworthReportBegin(PC pc, PC_Ainsworth *data, Vec f, Vec g)
{
  PetscFunctionBegin;
  if (!data->reporting.viewer && data->reporting.stop == PC_AINSWORTH_STOP_RESIDUAL) PetscFunctionReturn(PETSC_SUCCESS);
  if (!data->report) {
    AinsworthReportSystem system;

    system.A      = data->saddle.A;
    system.C      = data->saddle.C;
    system.S      = data->S;
    system.primal = data->saddle.cols[0];
    PetscCall(MatGetSize(pc->pmat, NULL, &system.size));
    PetscCall(AinsworthReportCreate(&data->reporting, &system, &data->report));
  }
  PetscCall(AinsworthReportBegin(data->report, data->ksp, f, g, data->setupSeconds));
  data->setupSeconds = 0.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCAinsworthReportEnd(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  if (data->report) PetscCall(AinsworthReportEnd(data->report, data->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCAinsworthReportView(const PC_Ainsworth *data, PetscViewer viewer)
{
  const AinsworthReportSettings *settings = &data->reporting;

  PetscFunctionBegin;
  if (settings->viewer)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  error against run time: monitored%s%s\n", settings->residuals ? ", residuals of the original system" : "",
                                     settings->reference ? ", reference solution" : ""));
  if (settings->stop == PC_AINSWORTH_STOP_ENERGY_ERROR)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  stops when the energy norm of the error has fallen by %g\n", (double)settings->rtol));
  PetscFunctionReturn(PETSC_SUCCESS);
}
