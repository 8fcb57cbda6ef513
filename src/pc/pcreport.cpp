#include "pcainsworth.h"

/*
   Starts the report of a reduced solve for f and g on the kept rows; start: when the computation of its right-hand side
   began
*/
PetscErrorCode PCAinsworthReportBegin_Private(PC_Ainsworth *data, AinsworthSaddleVec b, PetscLogDouble start)
{
  PetscFunctionBegin;
  if (!data->reporting.report) {
    AinsworthReportSystem system;

    system.A               = data->saddle->A;
    system.C               = data->saddle->kept.C;
    system.reduced         = data->reduced->mat;
    system.primal          = data->saddle->cols[0];
    system.inverseDiagonal = data->reduced->inverseDiagonal;
    PetscCall(MatGetSize(data->given.inputs.pmat, NULL, &system.size));
    PetscCall(AinsworthReportCreate(&data->settings, &system, &data->reporting.report));
  }
  PetscCall(AinsworthReportBegin(data->reporting.report, data->inner.ksp, b, start - data->reporting.setupSeconds));
  data->reporting.setupSeconds = 0.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCAinsworthReportView_Private(const PC_Ainsworth *data, PetscViewer viewer)
{
  const AinsworthReportSettings *settings = &data->settings;

  PetscFunctionBegin;
  if (settings->viewer)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  error against run time: monitored%s\n",
                                     settings->reference ? ", reference solution" : ""));
  if (settings->stop == AINSWORTH_STOP_ENERGY_ERROR)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "  stops when the energy norm of the error is at most %g times that of x, %s\n", (double)settings->rtol,
      settings->eigenvalue > 0.0 ? "by an upper bound"
                                 : "by an estimate (-pc_ainsworth_error_eigenvalue makes it a bound)"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
