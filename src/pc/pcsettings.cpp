#include "pcainsworth.h"
#include "../base/objects.h"
#include "../projection/matainsworth.h"
#include <petsc/private/pcimpl.h>

const char *const PCAinsworthVariants[] = {"weighted", "paper", "PCAinsworthVariant", "PC_AINSWORTH_", NULL};

/* Returns the data of a PC of this type */
PC_Ainsworth *PCAinsworthData_Private(PC pc)
{
  return (PC_Ainsworth *)pc->data;
}

/* Gets the data, NULL for a PC of another type, whose setters do nothing, as everywhere in PETSc */
PetscErrorCode PCAinsworthGetData_Private(PC pc, PC_Ainsworth **data)
{
  PetscBool match;

  PetscFunctionBegin;
  PetscValidHeaderSpecific(pc, PC_CLASSID, 1);
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCAINSWORTH, &match));
  *data = match ? (PC_Ainsworth *)pc->data : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthGetDataOrError_Private - gets the data for getters: another type is an error */
PetscErrorCode PCAinsworthGetDataOrError_Private(PC pc, PC_Ainsworth **data)
{
  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData_Private(pc, data));
  PetscCheck(*data, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONG, "The PC has type %s, not %s",
             ((PetscObject)pc)->type_name ? ((PetscObject)pc)->type_name : "(not set)", PCAINSWORTH);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the next use set up again because a choice changed */
PetscErrorCode PCAinsworthSetStale_Private(PC pc, PC_Ainsworth *data)
{
  PetscFunctionBegin;
  if (!data->saddle) PetscFunctionReturn(PETSC_SUCCESS);
  if (data->state != PC_AINSWORTH_NONE) data->state = PC_AINSWORTH_STALE;
  pc->setupcalled = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void PCAinsworthChoicesApplyVariant_Private(AinsworthChoices *choices, PCAinsworthVariant variant)
{
  const bool paper = variant == PC_AINSWORTH_PAPER;

  choices->variant         = variant;
  choices->weightType      = paper ? MAT_AINSWORTH_WEIGHT_IDENTITY : MAT_AINSWORTH_WEIGHT_DIAGONAL;
  choices->pmat.penalty    = paper ? AINSWORTH_PENALTY_NORM : AINSWORTH_PENALTY_ROW;
  choices->pmat.factor     = PETSC_DEFAULT;
  choices->pmat.rowScaling = (PetscBool)!paper;
}

static bool Same(const AinsworthChoices &a, const AinsworthChoices &b)
{
  return a.variant == b.variant && a.weightType == b.weightType && !(a.gram != b.gram) && a.redundant == b.redundant &&
         a.pmat.type == b.pmat.type && a.pmat.penalty == b.pmat.penalty && a.pmat.factor == b.pmat.factor &&
         a.pmat.rowScaling == b.pmat.rowScaling && a.pmat.rtol == b.pmat.rtol && a.pmat.blocks == b.pmat.blocks &&
         a.ladder == b.ladder;
}

/* Sets the choices, which take effect at the next use; another variant sets its inner method */
PetscErrorCode PCAinsworthChoose_Private(PC pc, PC_Ainsworth *data, const AinsworthChoices *choices)
{
  PetscFunctionBegin;
  const bool same = Same(data->choices, *choices), variant = data->choices.variant != choices->variant;

  data->choices = *choices;
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  if (variant) {
    data->inner.plan.method = AINSWORTH_METHOD_GIVEN;
    PetscCall(AinsworthSolverSetMethod(&data->inner, choices->variant == PC_AINSWORTH_PAPER ? KSPCG : KSPPROJECTEDCG));
  }
  PetscCall(PCAinsworthSetStale_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetWeight - sets the diagonal of the weight W of the projector

   Logically Collective

   Input Parameters:
+  pc     - the preconditioner; nothing happens if its type is not `PCAINSWORTH`
-  weight - of length n, with the layout of the columns of A, real and positive, in units of inverse stiffness;
            referenced

   Level: intermediate

   Errors:
   At the next set-up, `PETSC_ERR_ARG_SIZ` for another length or layout; `PETSC_ERR_ARG_OUTOFRANGE`, with the smallest
   entry in the message, if that is not positive.

.seealso: `PCAINSWORTH`, `MatAinsworthSetWeight()`
@*/
PetscErrorCode PCAinsworthSetWeight(PC pc, Vec weight)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData_Private(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidHeaderSpecific(weight, VEC_CLASSID, 2);
  PetscCheckSameComm(pc, 1, weight, 2);
  PetscCall(AinsworthReplace(weight, &data->choices.weight));
  data->choices.weightType = MAT_AINSWORTH_WEIGHT_USER;
  PetscCall(PCAinsworthSetStale_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetKSP - gets the solver of the reduced system

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  ksp - the solver, with the options prefix `ainsworth_`; do not destroy it

   Level: intermediate

   Note:
   `PCSetUp()` sets the operators of the solver.

   Errors:
   `PETSC_ERR_ARG_WRONG` if the type of pc is not `PCAINSWORTH`.

.seealso: `PCAINSWORTH`, `PCAinsworthGetGramKSP()`, `PCKSPGetKSP()`
@*/
PetscErrorCode PCAinsworthGetKSP(PC pc, KSP *ksp)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError_Private(pc, &data));
  PetscAssertPointer(ksp, 2);
  *ksp = data->inner.ksp;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetGramKSP - gets the solver of the Gram matrix C W C'

   Not Collective

   Input Parameter:
.  pc - the preconditioner, after `PCSetUp()`

   Output Parameter:
.  ksp - the solver, with the options prefix `ainsworth_gram_`; `NULL` without constraints, and on ranks that solve for
         no row

   Options Database Keys:
+  -pc_ainsworth_gram <auto,factor,polynomial> - whether large components are factored, or need no factorization because
                                                 the rows of each node have unknowns of their own: then the solver is
                                                 that of these unknowns; auto is what is predicted to be quicker
-  -pc_ainsworth_rows_per_rank <25000>         - components of the Gram matrix with more than 32 rows, together m rows,
                                                 are factored on ceil(m / this) ranks

   Level: advanced

   Notes:
   The matrix of the solver is the Gram matrix, or that of the private unknowns, scaled to a unit diagonal.

   Each rank solves for whole connected components of the Gram matrix, without the other ranks. Only if a component has
   more than 16 times the rows per rank, several ranks share a solver.

   Errors:
   `PETSC_ERR_ARG_WRONG` if the type of pc is not `PCAINSWORTH`, `PETSC_ERR_ORDER` before `PCSetUp()`.

.seealso: `PCAINSWORTH`, `PCAinsworthGetKSP()`
@*/
PetscErrorCode PCAinsworthGetGramKSP(PC pc, KSP *ksp)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError_Private(pc, &data));
  PetscAssertPointer(ksp, 2);
  PetscCheck(data->saddle, PetscObjectComm((PetscObject)pc), PETSC_ERR_ORDER,
             "Call PCSetUp() before PCAinsworthGetGramKSP()");
  *ksp = NULL;
  if (AinsworthSolverReducedMat(data)) {
    const AinsworthGram *gram;

    PetscCall(MatAinsworthGetGram_Private(data->reduced->mat, &gram));
    *ksp = AinsworthGramGetKSP(gram);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetReference - sets the exact solution, for which the error monitor shows the true error

   Logically Collective

   Input Parameters:
+  pc        - the preconditioner; nothing happens if its type is not `PCAINSWORTH`
-  reference - the solution of the saddle-point system, of length n + m in the numbering of the program, or x alone, of
               length n; `NULL` for none

   Options Database Key:
.  -pc_ainsworth_reference <file> - a `Vec` in PETSc's binary format

   Level: intermediate

   Note:
   The vector is not copied. It belongs to one right-hand side. With an outer Krylov method each application has another
   right-hand side, and the true error has no meaning.

   Errors:
   `PETSC_ERR_ARG_SIZ` at the next solve if the length is neither n + m nor n.

.seealso: `PCAINSWORTH`, `PCAinsworthGetErrorEstimate()`
@*/
PetscErrorCode PCAinsworthSetReference(PC pc, Vec reference)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData_Private(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  if (reference) {
    PetscValidHeaderSpecific(reference, VEC_CLASSID, 2);
    PetscCheckSameComm(pc, 1, reference, 2);
  }
  PetscCall(AinsworthReplace(reference, &data->settings.reference));
  PetscCall(AinsworthReportDestroy(&data->reporting.report));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetErrorEstimate - gets the bounds of the error of the last solve

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameters:
+  iteration - the last iteration with an accurate lower bound, a few before the end; pass `NULL` if not needed
.  lower     - lower bound of the energy norm of the error at that iteration; pass `NULL` if not needed
-  upper     - upper bound of it, NaN if there is none; pass `NULL` if not needed

   Options Database Keys:
+  -pc_ainsworth_monitor_error [ascii,csv:file,draw] - prints times, residuals and bounds, one row per iteration
                                                       (docs/options.md)
.  -pc_ainsworth_stop <residual,energy_error>        - criterion that ends the reduced solve
.  -pc_ainsworth_error_rtol <1e-6>                   - tolerance of energy_error, relative to the energy norm of x
-  -pc_ainsworth_error_eigenvalue <estimated>        - lower bound of the spectrum of the preconditioned operator; makes
                                                       the upper estimate a bound

   Level: intermediate

   Notes:
   The error of the solution is smaller than the error at that iteration.

   The bounds come from the coefficients of `KSPPROJECTEDCG` or `KSPCG` in the natural norm, at the cost of one more
   inner product per iteration. Other methods have no bounds. docs/options.md has the formulas and their sources.

   Errors:
   `PETSC_ERR_ARG_WRONG` if the type of pc is not `PCAINSWORTH`; `PETSC_ERR_ARG_WRONGSTATE` if nothing was estimated, or
   if the solve was too short.

.seealso: `PCAINSWORTH`, `PCAinsworthSetReference()`
@*/
PetscErrorCode PCAinsworthGetErrorEstimate(PC pc, PetscInt *iteration, PetscReal *lower, PetscReal *upper)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError_Private(pc, &data));
  PetscCheck(data->reporting.report && data->reporting.report->estimate, PetscObjectComm((PetscObject)pc),
             PETSC_ERR_ARG_WRONGSTATE,
             "There is no estimate: use -pc_ainsworth_monitor_error or -pc_ainsworth_stop energy_error, with conjugate "
             "gradients inside");
  PetscCheck(data->reporting.report->estimator.accurate, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONGSTATE,
             "The solve was too short for an accurate estimate: it took %" PetscInt_FMT " iterations",
             (PetscInt)data->reporting.report->estimator.fall.size());
  const PetscInt last = data->reporting.report->estimator.accurate - 1;

  if (iteration) *iteration = last;
  if (lower) *lower = AinsworthEstimatorLower(&data->reporting.report->estimator, last);
  if (upper) *upper = AinsworthEstimatorUpper(&data->reporting.report->estimator, last);
  PetscFunctionReturn(PETSC_SUCCESS);
}
