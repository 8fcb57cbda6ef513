#include "pcainsworth.h"
#include "../operator/matainsworth.h"
#include <petsc/private/pcimpl.h>
#include <petsc/private/kspimpl.h>

const char *const PCAinsworthVariants[] = {"weighted", "paper", "PCAinsworthVariant", "PC_AINSWORTH_", NULL};

/* NULL for a PC of another type, whose setters do nothing, as everywhere in PETSc */
PetscErrorCode PCAinsworthGetData(PC pc, PC_Ainsworth **data)
{
  PetscBool match;

  PetscFunctionBegin;
  PetscValidHeaderSpecific(pc, PC_CLASSID, 1);
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCAINSWORTH, &match));
  *data = match ? (PC_Ainsworth *)pc->data : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* for getters: another type is an error */
PetscErrorCode PCAinsworthGetDataOrError(PC pc, PC_Ainsworth **data)
{
  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, data));
  PetscCheck(*data, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONG, "The PC has type %s, not %s",
             ((PetscObject)pc)->type_name ? ((PetscObject)pc)->type_name : "(not set)", PCAINSWORTH);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A choice changed: the next use sets up again */
PetscErrorCode PCAinsworthSetStale(PC pc, PC_Ainsworth *data)
{
  PetscFunctionBegin;
  if (data->saddle.A) {
    data->stale     = PETSC_TRUE;
    pc->setupcalled = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCAinsworthApplyVariant(PC_Ainsworth *data, PCAinsworthVariant variant)
{
  const PetscBool paper = (PetscBool)(variant == PC_AINSWORTH_PAPER);

  PetscFunctionBegin;
  data->variant      = variant;
  data->weightType   = paper ? MAT_AINSWORTH_WEIGHT_IDENTITY : MAT_AINSWORTH_WEIGHT_DIAGONAL;
  data->pmat.penalty = paper ? PC_AINSWORTH_PENALTY_NORM : PC_AINSWORTH_PENALTY_ROW;
  data->factor       = PETSC_DEFAULT;
  data->projected    = PETSC_FALSE;

  data->pmat.rowScaling = (PetscBool)!paper;
  PetscCall(KSPSetType(data->ksp, paper ? KSPCG : KSPPROJECTEDCG));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type itself, or what auto came to at the last set-up; before, jcb */
PCAinsworthPmatType PCAinsworthPmatTypeInUse(const PC_Ainsworth *data)
{
  return data->pmat.type == PC_AINSWORTH_PMAT_AUTO ? data->autoType : data->pmat.type;
}

PetscReal PCAinsworthPenaltyFactor(const PC_Ainsworth *data)
{
  if (data->factor != (PetscReal)PETSC_DEFAULT) return data->factor;
  /* paper, section 3.3; measured, docs/method.md: without Q_* the penalty alone tells AMG of the constraints */
  if (data->pmat.penalty == PC_AINSWORTH_PENALTY_NORM) return 5.0;
  return PCAinsworthPmatTypeInUse(data) == PC_AINSWORTH_PMAT_ID ? (data->format == AINSWORTH_PMAT_SUM ? 2.0 : 10.0) : 0.5;
}

/*@
   PCAinsworthSetVariant - sets weight, penalty, penalty factor, row scaling and the type of the inner `KSP` at once

   Logically Collective

   Input Parameters:
+  pc      - the preconditioner
-  variant - `PC_AINSWORTH_WEIGHTED` (default) or `PC_AINSWORTH_PAPER`

   Options Database Key:
.  -pc_ainsworth_variant <weighted,paper> - the variant; each of them can then be set alone

   Level: beginner

.seealso: `PCAINSWORTH`, `PCAinsworthVariant`, `PCAinsworthSetWeightType()`, `PCAinsworthSetPenaltyType()`
@*/
PetscErrorCode PCAinsworthSetVariant(PC pc, PCAinsworthVariant variant)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveEnum(pc, variant, 2);
  PetscCall(PCAinsworthApplyVariant(data, variant));
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetVariant - gets the variant that was set last

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  variant - the variant; weight, penalty and factor may have been set alone since

   Level: beginner

.seealso: `PCAINSWORTH`, `PCAinsworthSetVariant()`
@*/
PetscErrorCode PCAinsworthGetVariant(PC pc, PCAinsworthVariant *variant)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(variant, 2);
  *variant = data->variant;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetWeightType - chooses the diagonal weight W of the projector

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  type - `MAT_AINSWORTH_WEIGHT_DIAGONAL` (W = diag(A)^{-1}, default) or `MAT_AINSWORTH_WEIGHT_IDENTITY`

   Options Database Key:
.  -pc_ainsworth_weight <diagonal,identity> - the weight

   Level: intermediate

   Note:
   Where a diagonal entry of A is not positive, or not stored, the 1-norm of its row of A stands in for it.

.seealso: `PCAINSWORTH`, `PCAinsworthSetWeight()`, `MatAinsworthSetWeightType()`
@*/
PetscErrorCode PCAinsworthSetWeightType(PC pc, MatAinsworthWeightType type)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveEnum(pc, type, 2);
  data->weightType = type;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetWeightType - gets the kind of the weight W

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  type - the kind

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetWeightType()`
@*/
PetscErrorCode PCAinsworthGetWeightType(PC pc, MatAinsworthWeightType *type)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(type, 2);
  *type = data->weightType;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetWeight - gives the diagonal of the weight W of the projector

   Collective

   Input Parameters:
+  pc     - the preconditioner
-  weight - length n, laid out as the columns of A, every entry real and positive, in units of inverse stiffness; referenced

   Level: intermediate

   Errors:
   At set-up, `PETSC_ERR_ARG_OUTOFRANGE` naming the smallest entry if it is not positive; `PETSC_ERR_ARG_SIZ` for another length.

.seealso: `PCAINSWORTH`, `PCAinsworthSetWeightType()`, `MatAinsworthSetWeight()`
@*/
PetscErrorCode PCAinsworthSetWeight(PC pc, Vec weight)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidHeaderSpecific(weight, VEC_CLASSID, 2);
  PetscCheckSameComm(pc, 1, weight, 2);
  PetscCall(PetscObjectReference((PetscObject)weight));
  PetscCall(VecDestroy(&data->weight));
  data->weight     = weight;
  data->weightType = MAT_AINSWORTH_WEIGHT_USER;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetRowsPerRank - bounds the number of ranks that solve with the Gram matrix

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  rows - positive; connected pieces of the Gram matrix with more than 32 rows, m rows together, are solved with on ceil(m / rows) ranks,
          whole unless one has more than 16 times as many rows; 25000 by default

   Options Database Key:
.  -pc_ainsworth_rows_per_rank <25000> - the rows per rank

   Level: advanced

.seealso: `PCAINSWORTH`, `PCAinsworthGetGramKSP()`
@*/
PetscErrorCode PCAinsworthSetRowsPerRank(PC pc, PetscInt rows)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveInt(pc, rows, 2);
  PetscCheck(rows > 0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "-pc_ainsworth_rows_per_rank must be positive, not %" PetscInt_FMT "", rows);
  data->rowsPerRank = rows;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetRowsPerRank - gets the number of rows of the Gram matrix per rank

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  rows - the number

   Level: advanced

.seealso: `PCAINSWORTH`, `PCAinsworthSetRowsPerRank()`
@*/
PetscErrorCode PCAinsworthGetRowsPerRank(PC pc, PetscInt *rows)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(rows, 2);
  *rows = data->rowsPerRank;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetKSP - gets the solver of the reduced system

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  ksp - the solver, with options prefix `ainsworth_`; its operators are set by `PCSetUp()`; not to be destroyed

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthGetGramKSP()`, `PCKSPGetKSP()`
@*/
PetscErrorCode PCAinsworthGetKSP(PC pc, KSP *ksp)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(ksp, 2);
  *ksp = data->ksp;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetGramKSP - gets the solver of the Gram matrix C W C'

   Collective

   Input Parameter:
.  pc - the preconditioner, after `PCSetUp()`

   Output Parameter:
.  ksp - the solver, with options prefix `ainsworth_gram_`; `NULL` on ranks that solve for no row, and without constraints

   Level: advanced

   Errors:
   `PETSC_ERR_ORDER` before `PCSetUp()`.

.seealso: `PCAINSWORTH`, `PCAinsworthGetKSP()`, `PCAinsworthSetRowsPerRank()`
@*/
PetscErrorCode PCAinsworthGetGramKSP(PC pc, KSP *ksp)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(ksp, 2);
  PetscCheck(data->saddle.A, PetscObjectComm((PetscObject)pc), PETSC_ERR_ORDER, "Call PCSetUp() before PCAinsworthGetGramKSP()");
  *ksp = NULL;
  if (data->S) PetscCall(MatAinsworthGetGramKSP(data->S, ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}
