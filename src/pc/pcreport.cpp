#include "pcainsworth.h"
#include <petsc/private/pcimpl.h>

/* Starts the report of a reduced solve for f and g on the kept rows; start: when the computation of its right-hand side began */
PetscErrorCode PCAinsworthReportBegin_Private(PC pc, PC_Ainsworth *data, AinsworthSaddleVec b, PetscLogDouble start)
{
  PetscFunctionBegin;
  if (!data->report) {
    AinsworthReportSystem system;

    system.A               = data->saddle.A;
    system.C               = data->saddle.C;
    system.reduced         = data->reduced;
    system.primal          = data->saddle.cols[0];
    system.inverseDiagonal = data->inverseDiagonal;
    PetscCall(MatGetSize(pc->pmat, NULL, &system.size));
    PetscCall(AinsworthReportCreate(&data->reporting, &system, &data->report));
  }
  PetscCall(AinsworthReportBegin(data->report, data->ksp, b, start - data->setupSeconds));
  data->setupSeconds = 0.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCAinsworthReportView_Private(const PC_Ainsworth *data, PetscViewer viewer)
{
  const AinsworthReportSettings *settings = &data->reporting;

  PetscFunctionBegin;
  if (settings->viewer) PetscCall(PetscViewerASCIIPrintf(viewer, "  error against run time: monitored%s\n", settings->reference ? ", reference solution" : ""));
  if (settings->stop == AINSWORTH_STOP_ENERGY_ERROR)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  stops when the energy norm of the error is at most %g times that of x, %s\n", (double)settings->rtol,
                                     settings->eigenvalue > 0.0 ? "by an upper bound" : "by an estimate (-pc_ainsworth_error_eigenvalue makes it a bound)"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
