#include "pcainsworth.h"
#include <petsc/private/pcimpl.h>

const char *const PCAinsworthStopTypes[] = {"residual", "energy_error", "PCAinsworthStopType", "PC_AINSWORTH_STOP_", NULL};

/*@
   PCAinsworthSetErrorMonitor - reports error against run time while the reduced system is solved

   Logically Collective

   Input Parameters:
+  pc     - the preconditioner
.  viewer - of type ascii or draw; NULL: no monitor
-  format - `PETSC_VIEWER_ASCII_CSV` for a CSV file

   Options Database Key:
.  -pc_ainsworth_monitor_error [ascii,csv:file,draw] - a viewer in PETSc's syntax; `csv:file` is short for `ascii:file:ascii_csv`

   Level: intermediate

   Notes:
   A row for each iteration: seconds of the set-up that the solve needed and of the solve so far, without those of the monitor; natural norm of
   the residual; relative residuals of the two blocks of the original system; lower and upper bound of the error in the energy norm of the
   reduced operator, from the coefficients of `KSPPROJECTEDCG` or `KSPCG`; the true error where a reference is known. A row comes a few
   iterations late, when its lower bound is accurate. The energy norm is that of A in Ker C; docs/report.md has the formulas.

   `KSPCG` needs the natural norm and costs one inner product more per iteration; other methods have no estimate.

   Errors:
   `PETSC_ERR_SUP` for a viewer of another type.

.seealso: `PCAINSWORTH`, `PCAinsworthSetReference()`, `PCAinsworthSetStop()`, `PCAinsworthSetErrorEigenvalue()`
@*/
PetscErrorCode PCAinsworthSetErrorMonitor(PC pc, PetscViewer viewer, PetscViewerFormat format)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  if (viewer) {
    PetscBool ascii, draw;

    PetscValidHeaderSpecific(viewer, PETSC_VIEWER_CLASSID, 2);
    PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
    PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERDRAW, &draw));
    PetscCheck(ascii || draw, PetscObjectComm((PetscObject)pc), PETSC_ERR_SUP,
               "The error cannot be monitored with a viewer of type %s: -pc_ainsworth_monitor_error takes ascii, csv and draw",
               ((PetscObject)viewer)->type_name);
    PetscCall(PetscObjectReference((PetscObject)viewer));
  }
  PetscCall(PetscViewerDestroy(&data->reporting.viewer));
  data->reporting.viewer = viewer;
  data->reporting.format = format;
  PetscCall(PCAinsworthReportReset(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetErrorMonitor - gets the viewer that error against run time is reported to

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameters:
+  viewer - NULL: none; or pass NULL
-  format - its format; or pass NULL

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetErrorMonitor()`
@*/
PetscErrorCode PCAinsworthGetErrorMonitor(PC pc, PetscViewer *viewer, PetscViewerFormat *format)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  if (viewer) *viewer = data->reporting.viewer;
  if (format) *format = data->reporting.format;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetErrorMonitorResiduals - chooses whether the error monitor computes the residuals of the original system

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  flag - true (default): both residuals in every row

   Options Database Key:
.  -pc_ainsworth_monitor_error_residuals <true,false> - with them

   Level: intermediate

   Note:
   They cost one product with A, one solve with the Gram matrix and two products with C per iteration, which the seconds of the monitor leave out.

.seealso: `PCAINSWORTH`, `PCAinsworthSetErrorMonitor()`
@*/
PetscErrorCode PCAinsworthSetErrorMonitorResiduals(PC pc, PetscBool flag)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveBool(pc, flag, 2);
  data->reporting.residuals = flag;
  PetscCall(PCAinsworthReportReset(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetErrorMonitorResiduals - tells whether the error monitor computes the residuals of the original system

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  flag - true or false

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetErrorMonitorResiduals()`
@*/
PetscErrorCode PCAinsworthGetErrorMonitorResiduals(PC pc, PetscBool *flag)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(flag, 2);
  *flag = data->reporting.residuals;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetReference - gives the exact solution, so that the error monitor shows the true error

   Logically Collective

   Input Parameters:
+  pc        - the preconditioner
-  reference - of length n + m, the solution of the saddle-point system in the numbering of the program, or of length n, its x; NULL: none

   Options Database Key:
.  -pc_ainsworth_reference <file> - a `Vec` in PETSc's binary format

   Level: intermediate

   Note:
   The vector is not copied. It belongs to one right-hand side: with an outer Krylov method every application has another one, and the true error means nothing.

   Errors:
   `PETSC_ERR_ARG_SIZ` at the next solve if the length is another one.

.seealso: `PCAINSWORTH`, `PCAinsworthSetErrorMonitor()`
@*/
PetscErrorCode PCAinsworthSetReference(PC pc, Vec reference)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  if (reference) {
    PetscValidHeaderSpecific(reference, VEC_CLASSID, 2);
    PetscCheckSameComm(pc, 1, reference, 2);
    PetscCall(PetscObjectReference((PetscObject)reference));
  }
  PetscCall(VecDestroy(&data->reporting.reference));
  data->reporting.reference = reference;
  PetscCall(PCAinsworthReportReset(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetReference - gets the exact solution that was given

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  reference - NULL: none

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetReference()`
@*/
PetscErrorCode PCAinsworthGetReference(PC pc, Vec *reference)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(reference, 2);
  *reference = data->reporting.reference;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetStop - chooses what ends the reduced solve

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  stop - `PC_AINSWORTH_STOP_RESIDUAL` (default) or `PC_AINSWORTH_STOP_ENERGY_ERROR`

   Options Database Keys:
+  -pc_ainsworth_stop <residual,energy_error> - the criterion
-  -pc_ainsworth_error_rtol <1e-6>            - tolerance of energy_error

   Level: intermediate

   Note:
   With `PC_AINSWORTH_STOP_ENERGY_ERROR` the relative tolerance of the inner `KSP` is not heeded; its absolute and divergence tolerances and its limit
   of iterations are. The reason is `KSP_CONVERGED_RTOL`. The estimate is a few iterations late, so the error is smaller than asked for.

   Errors:
   `PETSC_ERR_SUP` at the next solve for `PC_AINSWORTH_STOP_ENERGY_ERROR` with another inner method than `KSPPROJECTEDCG` or `KSPCG` in the natural norm.

.seealso: `PCAINSWORTH`, `PCAinsworthSetErrorTolerance()`, `PCAinsworthGetErrorEstimate()`
@*/
PetscErrorCode PCAinsworthSetStop(PC pc, PCAinsworthStopType stop)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveEnum(pc, stop, 2);
  data->reporting.stop = stop;
  PetscCall(PCAinsworthReportReset(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetStop - gets what ends the reduced solve

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  stop - the criterion

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetStop()`
@*/
PetscErrorCode PCAinsworthGetStop(PC pc, PCAinsworthStopType *stop)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(stop, 2);
  *stop = data->reporting.stop;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetErrorTolerance - sets the tolerance of `PC_AINSWORTH_STOP_ENERGY_ERROR`

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  rtol - quotient of the energy norms of the error, last iterate to first; between 0 and 1 (default 1e-6)

   Options Database Key:
.  -pc_ainsworth_error_rtol <1e-6> - the tolerance

   Level: intermediate

   Note:
   The first iterate is R g, so that for g = 0 the tolerance is relative to the energy norm of x.

   Errors:
   `PETSC_ERR_ARG_OUTOFRANGE` outside of (0,1).

.seealso: `PCAINSWORTH`, `PCAinsworthSetStop()`
@*/
PetscErrorCode PCAinsworthSetErrorTolerance(PC pc, PetscReal rtol)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveReal(pc, rtol, 2);
  PetscCheck(rtol > 0.0 && rtol < 1.0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_ainsworth_error_rtol must lie strictly between 0 and 1, not be %g", (double)rtol);
  data->reporting.rtol = rtol;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetErrorTolerance - gets the tolerance of `PC_AINSWORTH_STOP_ENERGY_ERROR`

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  rtol - the tolerance

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetErrorTolerance()`
@*/
PetscErrorCode PCAinsworthGetErrorTolerance(PC pc, PetscReal *rtol)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(rtol, 2);
  *rtol = data->reporting.rtol;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetErrorEigenvalue - gives a lower bound of the spectrum, which makes the upper bound of the error one

   Logically Collective

   Input Parameters:
+  pc         - the preconditioner
-  eigenvalue - positive, at most the smallest eigenvalue of the preconditioned operator (in Ker C but for the paper's variant); `PETSC_DEFAULT`: the smallest Ritz value stands in

   Options Database Key:
.  -pc_ainsworth_error_eigenvalue <estimated> - the eigenvalue

   Level: advanced

   Note:
   With an eigenvalue the upper bound is that of Gauss-Radau quadrature; from the iteration on where the eigenvalue shows to be too large there is none.
   Without, the smallest Ritz value, which is never below the smallest eigenvalue, makes it an estimate.

   Errors:
   `PETSC_ERR_ARG_OUTOFRANGE` unless positive.

.seealso: `PCAINSWORTH`, `PCAinsworthSetErrorMonitor()`
@*/
PetscErrorCode PCAinsworthSetErrorEigenvalue(PC pc, PetscReal eigenvalue)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveReal(pc, eigenvalue, 2);
  PetscCheck(eigenvalue > 0.0 || eigenvalue == (PetscReal)PETSC_DEFAULT, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_ainsworth_error_eigenvalue must be positive, not %g", (double)eigenvalue);
  data->reporting.eigenvalue = eigenvalue;
  PetscCall(PCAinsworthReportReset(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetErrorEigenvalue - gets the lower bound of the spectrum that was given

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  eigenvalue - `PETSC_DEFAULT`: none

   Level: advanced

.seealso: `PCAINSWORTH`, `PCAinsworthSetErrorEigenvalue()`
@*/
PetscErrorCode PCAinsworthGetErrorEigenvalue(PC pc, PetscReal *eigenvalue)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(eigenvalue, 2);
  *eigenvalue = data->reporting.eigenvalue;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetErrorEstimate - gets the bounds of the error of the last solve

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameters:
+  iteration - the last iteration with an accurate lower bound, a few before the end; or pass NULL
.  lower     - lower bound of the energy norm of the error then; or pass NULL
-  upper     - upper bound of it, not a number where there is none; or pass NULL

   Level: intermediate

   Note:
   The error of the solution is smaller than at that iteration.

   Errors:
   `PETSC_ERR_ARG_WRONGSTATE` if nothing was estimated, or the solve was too short.

.seealso: `PCAINSWORTH`, `PCAinsworthSetErrorMonitor()`, `PCAinsworthSetStop()`
@*/
PetscErrorCode PCAinsworthGetErrorEstimate(PC pc, PetscInt *iteration, PetscReal *lower, PetscReal *upper)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscCheck(data->report && data->report->estimate, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONGSTATE,
             "There is no estimate: call PCAinsworthSetErrorMonitor() or PCAinsworthSetStop() before the solve, with conjugate gradients inside");
  PetscCheck(data->report->estimator.accurate, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONGSTATE,
             "The solve was too short for an accurate estimate: it took %" PetscInt_FMT " iterations", (PetscInt)data->report->estimator.fall.size());
  const PetscInt last = data->report->estimator.accurate - 1;

  if (iteration) *iteration = last;
  if (lower) *lower = AinsworthEstimatorLower(&data->report->estimator, last);
  if (upper) *upper = AinsworthEstimatorUpper(&data->report->estimator, last);
  PetscFunctionReturn(PETSC_SUCCESS);
}
