#include "pcainsworth.h"
#include <petsc/private/pcimpl.h>

PetscErrorCode PCAinsworthReportReset_Private(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(AinsworthReportDestroy(&data->report));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the reduced solve for f and g on the kept rows */
PetscErrorCode PCAinsworthReportBegin_Private(PC pc, PC_Ainsworth *data, Vec f, Vec g)
{
  PetscFunctionBegin;
  if (!data->reporting.viewer && data->reporting.stop == AINSWORTH_STOP_RESIDUAL) PetscFunctionReturn(PETSC_SUCCESS);
  if (!data->report) {
    AinsworthReportSystem system;

    system.A       = data->saddle.A;
    system.C       = data->saddle.C;
    system.reduced = data->reduced;
    system.primal  = data->saddle.cols[0];
    PetscCall(MatGetSize(pc->pmat, NULL, &system.size));
    PetscCall(AinsworthReportCreate(&data->reporting, &system, &data->report));
  }
  PetscCall(AinsworthReportBegin(data->report, data->ksp, f, g, data->setupSeconds));
  data->setupSeconds = 0.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCAinsworthReportEnd_Private(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  if (data->report) PetscCall(AinsworthReportEnd(data->report, data->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCAinsworthReportView_Private(const PC_Ainsworth *data, PetscViewer viewer)
{
  const AinsworthReportSettings *settings = &data->reporting;

  PetscFunctionBegin;
  if (settings->viewer) PetscCall(PetscViewerASCIIPrintf(viewer, "  error against run time: monitored%s\n", settings->reference ? ", reference solution" : ""));
  if (settings->stop == AINSWORTH_STOP_ENERGY_ERROR)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  stops when the energy norm of the error has fallen by %g\n", (double)settings->rtol));
  PetscFunctionReturn(PETSC_SUCCESS);
}
