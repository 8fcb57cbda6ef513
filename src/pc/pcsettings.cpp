#include "pcainsworth.h"
#include "../operator/matainsworth.h"
#include <petsc/private/pcimpl.h>
#include <petsc/private/kspimpl.h>

const char *const PCAinsworthFrameTypes[] = {"auto", "none", "PCAinsworthFrameType", "PC_AINSWORTH_FRAME_", NULL};
const char *const PCAinsworthVariants[]   = {"weighted", "paper", "PCAinsworthVariant", "PC_AINSWORTH_", NULL};

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
static PetscErrorCode GetDataOrError(PC pc, PC_Ainsworth **data)
{
  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, data));
  PetscCheck(*data, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONG, "The PC has type %s, not %s", ((PetscObject)pc)->type_name ? ((PetscObject)pc)->type_name : "(not set)", PCAINSWORTH);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A choice changed: the next use sets up again */
static PetscErrorCode PCAinsworthSetStale(PC pc, PC_Ainsworth *data)
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

PetscReal PCAinsworthPenaltyFactor(const PC_Ainsworth *data)
{
  if (data->factor != (PetscReal)PETSC_DEFAULT) return data->factor;
  return data->pmat.penalty == PC_AINSWORTH_PENALTY_NORM ? 5.0 : 0.5; /* paper, section 3.3; measured, docs/method.md */
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
  PetscCall(GetDataOrError(pc, &data));
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
  PetscCall(GetDataOrError(pc, &data));
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
   PCAinsworthSetPenaltyType - chooses the diagonal penalty B of the reduced operator

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  type - `PC_AINSWORTH_PENALTY_ROW` (one per row, default) or `PC_AINSWORTH_PENALTY_NORM` (the beta of the paper, section 3.3)

   Options Database Key:
.  -pc_ainsworth_penalty <row,norm> - the penalty

   Level: intermediate

   Note:
   For a non-symmetric A the infinity norm takes the place of the 1-norm in beta.

.seealso: `PCAINSWORTH`, `PCAinsworthPenaltyType`, `PCAinsworthSetPenaltyFactor()`
@*/
PetscErrorCode PCAinsworthSetPenaltyType(PC pc, PCAinsworthPenaltyType type)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveEnum(pc, type, 2);
  data->pmat.penalty = type;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetPenaltyType - gets the kind of the penalty B

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  type - the kind

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetPenaltyType()`
@*/
PetscErrorCode PCAinsworthGetPenaltyType(PC pc, PCAinsworthPenaltyType *type)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(GetDataOrError(pc, &data));
  PetscAssertPointer(type, 2);
  *type = data->pmat.penalty;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetPenaltyFactor - sets the factor gamma of the penalty

   Logically Collective

   Input Parameters:
+  pc     - the preconditioner
-  factor - positive, without unit; `PETSC_DEFAULT` for 0.5 (`PC_AINSWORTH_PENALTY_ROW`) or 5 (`PC_AINSWORTH_PENALTY_NORM`)

   Options Database Key:
.  -pc_ainsworth_penalty_factor <0.5 (row), 5 (norm)> - gamma

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetPenaltyType()`
@*/
PetscErrorCode PCAinsworthSetPenaltyFactor(PC pc, PetscReal factor)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveReal(pc, factor, 2);
  PetscCheck(factor > 0.0 || factor == (PetscReal)PETSC_DEFAULT, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "-pc_ainsworth_penalty_factor must be positive, not %g", (double)factor);
  data->factor = factor;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetPenaltyFactor - gets the factor gamma of the penalty

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  factor - gamma

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetPenaltyFactor()`
@*/
PetscErrorCode PCAinsworthGetPenaltyFactor(PC pc, PetscReal *factor)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(GetDataOrError(pc, &data));
  PetscAssertPointer(factor, 2);
  *factor = PCAinsworthPenaltyFactor(data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetPmatType - chooses the approximation Inv(S) of the inverse Gram matrix in the preconditioning matrix

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  type - one of the six of the paper (Table 1); `PC_AINSWORTH_PMAT_JCB` by default

   Options Database Key:
.  -pc_ainsworth_pmat <jcb,id,cc,cg,bj_cc,bj_cg> - the approximation

   Level: beginner

.seealso: `PCAINSWORTH`, `PCAinsworthPmatType`, `PCAinsworthSetPmatMaxRows()`, `PCAinsworthSetBlocks()`
@*/
PetscErrorCode PCAinsworthSetPmatType(PC pc, PCAinsworthPmatType type)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveEnum(pc, type, 2);
  data->pmat.type = type;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetPmatType - gets the approximation Inv(S) of the inverse Gram matrix

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  type - the approximation

   Level: beginner

.seealso: `PCAINSWORTH`, `PCAinsworthSetPmatType()`
@*/
PetscErrorCode PCAinsworthGetPmatType(PC pc, PCAinsworthPmatType *type)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(GetDataOrError(pc, &data));
  PetscAssertPointer(type, 2);
  *type = data->pmat.type;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetPmatTolerance - sets the relative tolerance of the approximations cg and bj_cg

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  rtol - between 0 and 1; 0.1 by default

   Options Database Key:
.  -pc_ainsworth_pmat_rtol <0.1> - the tolerance

   Level: intermediate

   Note:
   The larger it is, the fewer entries the iteration reaches and the sparser the preconditioning matrix (paper, section 4.3).

.seealso: `PCAINSWORTH`, `PCAinsworthSetPmatType()`
@*/
PetscErrorCode PCAinsworthSetPmatTolerance(PC pc, PetscReal rtol)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveReal(pc, rtol, 2);
  PetscCheck(rtol > 0.0 && rtol < 1.0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "-pc_ainsworth_pmat_rtol must be between 0 and 1, not %g", (double)rtol);
  data->pmat.rtol = rtol;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetPmatTolerance - gets the relative tolerance of the approximations cg and bj_cg

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  rtol - the tolerance

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetPmatTolerance()`
@*/
PetscErrorCode PCAinsworthGetPmatTolerance(PC pc, PetscReal *rtol)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(GetDataOrError(pc, &data));
  PetscAssertPointer(rtol, 2);
  *rtol = data->pmat.rtol;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetPmatMaxRows - bounds the number of constraints that the approximations cc and cg, which may be dense, are accepted for

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  rows - positive; 4000 by default

   Options Database Key:
.  -pc_ainsworth_pmat_max_rows <4000> - the bound

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetPmatType()`
@*/
PetscErrorCode PCAinsworthSetPmatMaxRows(PC pc, PetscInt rows)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveInt(pc, rows, 2);
  PetscCheck(rows > 0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "-pc_ainsworth_pmat_max_rows must be positive, not %" PetscInt_FMT "", rows);
  data->pmat.maxRows = rows;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetPmatMaxRows - gets the bound on the number of constraints for the approximations cc and cg

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  rows - the bound

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetPmatMaxRows()`
@*/
PetscErrorCode PCAinsworthGetPmatMaxRows(PC pc, PetscInt *rows)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(GetDataOrError(pc, &data));
  PetscAssertPointer(rows, 2);
  *rows = data->pmat.maxRows;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetBlocks - sets the number of blocks of the approximations bj_cc and bj_cg

   Logically Collective

   Input Parameters:
+  pc     - the preconditioner
-  blocks - positive, or `PETSC_DECIDE` for one per 32 constraints

   Options Database Key:
.  -pc_ainsworth_blocks <decide> - the number of blocks

   Level: intermediate

   Note:
   METIS cuts the graph of the Gram matrix, so that the blocks do not depend on the number of ranks.

.seealso: `PCAINSWORTH`, `PCAinsworthSetPmatType()`
@*/
PetscErrorCode PCAinsworthSetBlocks(PC pc, PetscInt blocks)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveInt(pc, blocks, 2);
  PetscCheck(blocks > 0 || blocks == PETSC_DECIDE, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "-pc_ainsworth_blocks must be positive, or -1 to decide, not %" PetscInt_FMT "", blocks);
  data->pmat.blocks = blocks;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetBlocks - gets the number of blocks of the approximations bj_cc and bj_cg

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  blocks - the number, or `PETSC_DECIDE`

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetBlocks()`
@*/
PetscErrorCode PCAinsworthGetBlocks(PC pc, PetscInt *blocks)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(GetDataOrError(pc, &data));
  PetscAssertPointer(blocks, 2);
  *blocks = data->pmat.blocks;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetRowScaling - makes the approximation jcb independent of the scale of the rows of C

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  flag - `PETSC_TRUE` (`PC_AINSWORTH_WEIGHTED`): 1-norms of the rows of D S D, D = diag(S)^{-1/2}; `PETSC_FALSE` (`PC_AINSWORTH_PAPER`): of S

   Options Database Key:
.  -pc_ainsworth_row_scaling <true (weighted), false (paper)> - the flag

   Level: advanced

.seealso: `PCAINSWORTH`, `PCAinsworthSetPmatType()`
@*/
PetscErrorCode PCAinsworthSetRowScaling(PC pc, PetscBool flag)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveBool(pc, flag, 2);
  data->pmat.rowScaling = flag;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetRowScaling - tells whether the approximation jcb is independent of the scale of the rows of C

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  flag - the choice

   Level: advanced

.seealso: `PCAINSWORTH`, `PCAinsworthSetRowScaling()`
@*/
PetscErrorCode PCAinsworthGetRowScaling(PC pc, PetscBool *flag)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(GetDataOrError(pc, &data));
  PetscAssertPointer(flag, 2);
  *flag = data->pmat.rowScaling;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetFrameType - chooses the frame that the reduced system is written in

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  type - `PC_AINSWORTH_FRAME_AUTO` (default) or `PC_AINSWORTH_FRAME_NONE`

   Options Database Key:
.  -pc_ainsworth_frame <auto,none> - the frame

   Level: intermediate

   Notes:
   Multigrid with one interpolation per displacement component locks where bodies slip along an interface that is turned against
   the axes. With `PC_AINSWORTH_FRAME_AUTO`, a block size of A of 2 or 3 and a direction that dominates among the node blocks of the rows of C,
   one constant rotation of all nodes brings that direction onto an axis. A is not copied: vectors are turned around its product.

.seealso: `PCAINSWORTH`, `PCAinsworthFrameType`
@*/
PetscErrorCode PCAinsworthSetFrameType(PC pc, PCAinsworthFrameType type)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetData(pc, &data));
  if (!data) PetscFunctionReturn(PETSC_SUCCESS);
  PetscValidLogicalCollectiveEnum(pc, type, 2);
  data->frameType = type;
  PetscCall(PCAinsworthSetStale(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetFrameType - gets the choice of the frame that the reduced system is written in

   Not Collective

   Input Parameter:
.  pc - the preconditioner

   Output Parameter:
.  type - the choice

   Level: intermediate

.seealso: `PCAINSWORTH`, `PCAinsworthSetFrameType()`
@*/
PetscErrorCode PCAinsworthGetFrameType(PC pc, PCAinsworthFrameType *type)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(GetDataOrError(pc, &data));
  PetscAssertPointer(type, 2);
  *type = data->frameType;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetRowsPerRank - bounds the number of ranks that solve with the Gram matrix

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  rows - positive; the Gram matrix is gathered on ceil(m / rows) ranks; 100000 by default (paper, section 5.2)

   Options Database Key:
.  -pc_ainsworth_rows_per_rank <100000> - the rows per rank

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
  PetscCall(GetDataOrError(pc, &data));
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
  PetscCall(GetDataOrError(pc, &data));
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
.  ksp - the solver, with options prefix `ainsworth_gram_`; `NULL` on the ranks that the Gram matrix is not gathered on, and without constraints

   Level: advanced

   Errors:
   `PETSC_ERR_ORDER` before `PCSetUp()`.

.seealso: `PCAINSWORTH`, `PCAinsworthGetKSP()`, `PCAinsworthSetRowsPerRank()`
@*/
PetscErrorCode PCAinsworthGetGramKSP(PC pc, KSP *ksp)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(GetDataOrError(pc, &data));
  PetscAssertPointer(ksp, 2);
  PetscCheck(data->saddle.A, PetscObjectComm((PetscObject)pc), PETSC_ERR_ORDER, "Call PCSetUp() before PCAinsworthGetGramKSP()");
  *ksp = NULL;
  if (data->S) PetscCall(MatAinsworthGetGramKSP(data->S, ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}
