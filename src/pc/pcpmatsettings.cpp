#include "pcainsworth.h"
#include <petsc/private/pcimpl.h>

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
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(type, 2);
  *type = data->pmat.penalty;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetPenaltyFactor - sets the factor gamma of the penalty

   Logically Collective

   Input Parameters:
+  pc     - the preconditioner
-  factor - positive, without unit; `PETSC_DEFAULT` for 0.5, 2 with `PC_AINSWORTH_PMAT_ID` (10 with BoomerAMG), 5 with `PC_AINSWORTH_PENALTY_NORM`

   Options Database Key:
.  -pc_ainsworth_penalty_factor <0.5> - gamma, by default 2 with id (10 with BoomerAMG) and 5 with norm

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
  PetscCheck(factor > 0.0 || factor == (PetscReal)PETSC_DEFAULT, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_ainsworth_penalty_factor must be positive, not %g", (double)factor);
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
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(factor, 2);
  *factor = PCAinsworthPenaltyFactor(data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthSetPmatType - chooses the approximation Inv(S) of the inverse Gram matrix in the preconditioning matrix

   Logically Collective

   Input Parameters:
+  pc   - the preconditioner
-  type - one of the six of the paper (Table 1), or `PC_AINSWORTH_PMAT_AUTO` (default): `PC_AINSWORTH_PMAT_ID` with `PCBLOCKSA`, or where
          constraints keep the components of each node apart, if the penalty is one per row, otherwise `PC_AINSWORTH_PMAT_JCB`

   Options Database Key:
.  -pc_ainsworth_pmat <auto,jcb,id,cc,cg,bj_cc,bj_cg> - the approximation

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
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
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
  PetscCheck(rtol > 0.0 && rtol < 1.0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "-pc_ainsworth_pmat_rtol must be between 0 and 1, not %g",
             (double)rtol);
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
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
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
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
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
  PetscCheck(blocks > 0 || blocks == PETSC_DECIDE, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_ainsworth_blocks must be positive, or -1 to decide, not %" PetscInt_FMT "", blocks);
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
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
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
  PetscCall(PCAinsworthGetDataOrError(pc, &data));
  PetscAssertPointer(flag, 2);
  *flag = data->pmat.rowScaling;
  PetscFunctionReturn(PETSC_SUCCESS);
}
