#include "pcainsworth.h"
#include "../operator/matainsworth.h"
#include <petsc/private/pcimpl.h>

PetscErrorCode PCSetFromOptions_Ainsworth(PC pc, AinsworthOptionItems PetscOptionsObject)
{
  PC_Ainsworth          *data    = (PC_Ainsworth *)pc->data;
  PCAinsworthVariant     variant = data->variant;
  MatAinsworthWeightType weight;
  PCAinsworthPenaltyType penalty;
  PCAinsworthPmatType    pmat;

  PCAinsworthRedundantType redundant;
  PetscReal                real;
  PetscInt                 integer;
  PetscBool                set, flag;
  const char              *prefix;

  PetscFunctionBegin;
  PetscOptionsHeadBegin(PetscOptionsObject, "Ainsworth options");
  PetscCall(PetscOptionsEnum("-pc_ainsworth_variant", "Sets weight, penalty, penalty factor, row scaling and the inner KSP type at once",
                             "PCAinsworthSetVariant", PCAinsworthVariants, (PetscEnum)variant, (PetscEnum *)&variant, &set));
  if (set) PetscCall(PCAinsworthSetVariant(pc, variant));
  weight = data->weightType;
  PetscCall(PetscOptionsEnum("-pc_ainsworth_weight", "Diagonal weight W of the projector", "PCAinsworthSetWeightType", MatAinsworthWeightTypes,
                             (PetscEnum)weight, (PetscEnum *)&weight, &set));
  if (set) PetscCall(PCAinsworthSetWeightType(pc, weight));
  penalty = data->pmat.penalty;
  PetscCall(PetscOptionsEnum("-pc_ainsworth_penalty", "Diagonal penalty B", "PCAinsworthSetPenaltyType", PCAinsworthPenaltyTypes, (PetscEnum)penalty,
                             (PetscEnum *)&penalty, &set));
  if (set) PetscCall(PCAinsworthSetPenaltyType(pc, penalty));
  real = PCAinsworthPenaltyFactor(data);
  PetscCall(PetscOptionsReal("-pc_ainsworth_penalty_factor", "Factor gamma of the penalty", "PCAinsworthSetPenaltyFactor", real, &real, &set));
  /* PETSC_DEFAULT is a negative number, which the setter takes for the default */
  PetscCheck(!set || real > 0.0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "-pc_ainsworth_penalty_factor must be positive, not %g",
             (double)real);
  if (set) PetscCall(PCAinsworthSetPenaltyFactor(pc, real));
  pmat = data->pmat.type;
  PetscCall(PetscOptionsEnum("-pc_ainsworth_pmat", "Approximation of the inverse Gram matrix in the preconditioning matrix", "PCAinsworthSetPmatType",
                             PCAinsworthPmatTypes, (PetscEnum)pmat, (PetscEnum *)&pmat, &set));
  if (set) PetscCall(PCAinsworthSetPmatType(pc, pmat));
  real = data->pmat.rtol;
  PetscCall(PetscOptionsReal("-pc_ainsworth_pmat_rtol", "Relative tolerance of cg and bj_cg", "PCAinsworthSetPmatTolerance", real, &real, &set));
  if (set) PetscCall(PCAinsworthSetPmatTolerance(pc, real));
  integer = data->pmat.maxRows;
  PetscCall(
    PetscOptionsInt("-pc_ainsworth_pmat_max_rows", "Refuse cc and cg above this number of constraints", "PCAinsworthSetPmatMaxRows", integer, &integer, &set));
  if (set) PetscCall(PCAinsworthSetPmatMaxRows(pc, integer));
  integer = data->pmat.blocks;
  PetscCall(PetscOptionsInt("-pc_ainsworth_blocks", "Number of blocks of bj_cc and bj_cg (-1: one per 32 constraints)", "PCAinsworthSetBlocks", integer,
                            &integer, &set));
  if (set) PetscCall(PCAinsworthSetBlocks(pc, integer));
  flag = data->pmat.rowScaling;
  PetscCall(PetscOptionsBool("-pc_ainsworth_row_scaling", "Make jcb independent of the scale of the rows of C", "PCAinsworthSetRowScaling", flag, &flag, &set));
  if (set) PetscCall(PCAinsworthSetRowScaling(pc, flag));
  integer = data->rowsPerRank;
  PetscCall(PetscOptionsInt("-pc_ainsworth_rows_per_rank", "The Gram matrix is gathered on ceil(constraints / this) ranks", "PCAinsworthSetRowsPerRank",
                            integer, &integer, &set));
  if (set) PetscCall(PCAinsworthSetRowsPerRank(pc, integer));
  redundant = data->redundant;
  PetscCall(PetscOptionsEnum("-pc_ainsworth_redundant", "Rows of C that are linear combinations of others", "PCAinsworthSetRedundantType",
                             PCAinsworthRedundantTypes, (PetscEnum)redundant, (PetscEnum *)&redundant, &set));
  if (set) PetscCall(PCAinsworthSetRedundantType(pc, redundant));
  flag = data->checkTranspose;
  PetscCall(PetscOptionsBool("-pc_ainsworth_check_transpose", "Compare the blocks C and C' entry by entry", "PCAinsworthSetCheckTranspose", flag, &flag, &set));
  if (set) PetscCall(PCAinsworthSetCheckTranspose(pc, flag));
  PetscCall(PCAinsworthReportSetFromOptions(pc, PetscOptionsObject));
  PetscOptionsHeadEnd();
  PetscCall(PCGetOptionsPrefix(pc, &prefix)); /* it may have been set after the creation of this PC */
  PetscCall(KSPSetOptionsPrefix(data->ksp, prefix));
  PetscCall(KSPAppendOptionsPrefix(data->ksp, "ainsworth_"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCView_Ainsworth(PC pc, PetscViewer viewer)
{
  PC_Ainsworth *data = (PC_Ainsworth *)pc->data;
  PetscBool     ascii, string;
  char          tolerance[64] = "", blocks[64] = "", dropped[256] = "";
  const char   *why = "";

  const PCAinsworthPmatType type = PCAinsworthPmatTypeInUse(data);

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERSTRING, &string));
  if (string) PetscCall(PetscViewerStringSPrintf(viewer, " %s, pmat %s", PCAinsworthVariants[data->variant], PCAinsworthPmatTypes[data->pmat.type]));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerASCIIPrintf(viewer, "  variant: %s (weight %s, penalty %s with factor %g)\n", PCAinsworthVariants[data->variant],
                                   MatAinsworthWeightTypes[data->weightType], PCAinsworthPenaltyTypes[data->pmat.penalty],
                                   (double)PCAinsworthPenaltyFactor(data)));
  if (type == PC_AINSWORTH_PMAT_CG || type == PC_AINSWORTH_PMAT_BJ_CG)
    PetscCall(PetscSNPrintf(tolerance, sizeof(tolerance), ", relative tolerance %g", (double)data->pmat.rtol));
  if (type == PC_AINSWORTH_PMAT_BJ_CC || type == PC_AINSWORTH_PMAT_BJ_CG) {
    if (data->pmat.blocks == PETSC_DECIDE) PetscCall(PetscSNPrintf(blocks, sizeof(blocks), ", one block per 32 constraints"));
    else PetscCall(PetscSNPrintf(blocks, sizeof(blocks), ", %" PetscInt_FMT " blocks", data->pmat.blocks));
  }
  if (data->pmat.type == PC_AINSWORTH_PMAT_AUTO && data->S && data->pmat.penalty == PC_AINSWORTH_PENALTY_ROW) why = data->autoReason;
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "  preconditioning matrix: %s%s%s%s%s\n", data->S || data->pmat.type != PC_AINSWORTH_PMAT_AUTO ? PCAinsworthPmatTypes[type] : "auto",
    type == PC_AINSWORTH_PMAT_JCB && data->pmat.rowScaling && (data->S || data->pmat.type == type) ? ", rows scaled" : "", tolerance, blocks, why));
  if (!data->saddle.A) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "  not set up yet\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleDescribeRows(&data->saddle, dropped, sizeof(dropped)));
  PetscCall(
    PetscViewerASCIIPrintf(viewer, "  constraints: %" PetscInt_FMT "%s%s\n", data->constraints, data->constraints ? "" : ", A alone is solved", dropped));
  if (data->S) {
    Mat_Ainsworth *ctx;

    PetscCall(MatAinsworthGetContext(data->S, &ctx));
    PetscCall(PetscViewerASCIIPushTab(viewer));
    PetscCall(AinsworthGramView(&ctx->proj.gram, viewer));
    PetscCall(PetscViewerASCIIPopTab(viewer));
  }
  if (!data->stale) PetscCall(PCAinsworthViewLeftOut(data, viewer));
  PetscCall(PCAinsworthReportView(data, viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  reduced solve in the primal unknowns:\n"));
  PetscCall(PetscViewerASCIIPushTab(viewer));
  PetscCall(KSPView(data->ksp, viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
