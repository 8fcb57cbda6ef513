/* Decides whether the inner preconditioner is kept for other values of A or C: -pc_ainsworth_rebuild (docs/sequence.md) */
#include "pcainsworth.h"
#include "../multigrid/blocksa.h"
#include "../operator/matainsworth.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>

/*
   Measured cost of a set-up in iterations: BoomerAMG 8 to 10, PCGAMG 15, PCBLOCKSA 14 to 20; a factorization of 3 000 to 28 000 unknowns 30 to 45 with CHOLMOD
   and 28 to 35 with MUMPS, because the analysis is repeated; if columns of the factor are long, `column` times their mean length
*/
static const PetscReal boomer = 9, multigrid = 15, factorization = 30, column = 0.04;
/* A solve with an old preconditioner ends after this many times the iterations of the first solve, plus those of a set-up */
static const PetscReal many = 1.3;

/* PCAinsworthIsOld_Private - checks whether the inner preconditioner is that of an earlier matrix, in whole or in part */
PetscErrorCode PCAinsworthIsOld_Private(const PC_Ainsworth *data, PetscBool *old)
{
  PC          inner;
  PC_BlockSA *sa;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  *old = (PetscBool)(data->kept || (sa && sa->old));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthMustKeepInner_Private - returns whether the program or an option wants to keep it in any case */
PetscBool PCAinsworthMustKeepInner_Private(PC pc, const PC_Ainsworth *data)
{
  return (PetscBool)(pc->reusepreconditioner || data->rebuild == AINSWORTH_REBUILD_NEVER);
}

/* Estimates the cost of a set-up of the inner preconditioner in iterations, by type and entries, not by a clock, so that all runs are alike */
static PetscErrorCode SetUpCost(PC inner, PetscReal *iterations)
{
  PetscBool factored, known, hypre;
  PetscInt  n;
  MatInfo   info;
  Mat       F;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, PCHYPRE, &hypre));
  *iterations = hypre ? boomer : multigrid;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &factored, PCLU, PCCHOLESKY, ""));
  if (factored) *iterations = factorization;
  if (!factored || !inner->setupcalled) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCFactorGetMatrix(inner, &F));
  PetscCall(MatHasOperation(F, MATOP_GETINFO, &known));
  if (!known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetInfo(F, MAT_GLOBAL_SUM, &info));
  PetscCall(MatGetSize(F, &n, NULL));
  if (n && info.nz_allocated > 0.0) *iterations = PetscMax(factorization, column * (PetscReal)info.nz_allocated / (PetscReal)n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the requested reduction in decades: solves are compared with those of about the same tolerance */
static PetscErrorCode Decades(const PC_Ainsworth *data, PetscInt *decades)
{
  PetscReal rtol;

  PetscFunctionBegin;
  PetscCall(KSPGetTolerances(data->ksp, &rtol, NULL, NULL, NULL));
  if (data->reporting.stop == AINSWORTH_STOP_ENERGY_ERROR) rtol = data->reporting.rtol;
  *decades = rtol > 0.0 ? (PetscInt)(0.5 - PetscLog10Real(rtol)) : PC_AINSWORTH_DECADES - 1;
  *decades = PetscMin(PetscMax(*decades, 1), PC_AINSWORTH_DECADES - 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the iterations of the first solve for so many decades, scaled from those for the nearest number of decades; negative before the first solve */
static PetscReal FirstTook(const PC_Ainsworth *data, PetscInt decades)
{
  for (PetscInt k = 0; k < PC_AINSWORTH_DECADES; k++) {
    for (PetscInt d : {decades - k, decades + k})
      if (d > 0 && d < PC_AINSWORTH_DECADES && data->took[d] >= 0) return (PetscReal)(data->took[d] * decades) / (PetscReal)d;
  }
  return -1.0;
}

/* PCAinsworthForgetCounts_Private - resets the counts for a new preconditioner */
PetscErrorCode PCAinsworthForgetCounts_Private(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  for (PetscInt &took : data->took) took = -1;
  data->more = data->extra = 0.0;
  data->solves             = 0;
  data->last               = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthDecideToKeepInner_Private - decides before a set-up whether the inner preconditioner is kept

   By replacement theory, it is kept until the next solve would cost more than the mean so far, including the set-up. The extra iterations of the next solve are
   extrapolated as if they grew in equal steps.
*/
PetscErrorCode PCAinsworthDecideToKeepInner_Private(PC pc, const PC_Ainsworth *data, PetscBool *keeps)
{
  PC          inner;
  KSPNormType norm;
  PetscReal   cost, next, mean;
  PetscBool   expensive;

  PetscFunctionBegin;
  *keeps = PCAinsworthMustKeepInner_Private(pc, data);
  if (*keeps || data->rebuild == AINSWORTH_REBUILD_ALWAYS || data->last < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &expensive, PCBLOCKSA, PCHYPRE, PCGAMG, PCML, PCHMG, PCLU, PCCHOLESKY, PCREDUNDANT, ""));
  PetscCall(KSPGetNormType(data->ksp, &norm));
  PetscCall(SetUpCost(inner, &cost));
  next   = data->solves ? data->extra * (PetscReal)(data->solves + 1) / (PetscReal)data->solves : 0.0;
  mean   = (cost + data->more) / (PetscReal)(data->solves + 1);
  *keeps = (PetscBool)(expensive && norm != KSP_NORM_NONE && next <= mean);
  if (expensive && !*keeps)
    PetscCall(PetscInfo(pc,
                        "The inner preconditioner is not kept: it took %g iterations more than at first in %" PetscInt_FMT " solves, and a set-up costs %g\n",
                        (double)data->more, data->solves, (double)cost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthLimit_Private - gets the iterations after which an old preconditioner is rebuilt and the solve begun again; 0 for no limit */
PetscErrorCode PCAinsworthLimit_Private(PC pc, const PC_Ainsworth *data, PetscInt *limit)
{
  PetscBool old;
  PetscInt  decades;
  PetscReal cost;
  PC        inner;

  PetscFunctionBegin;
  PetscCall(PCAinsworthIsOld_Private(data, &old));
  *limit = 0;
  if (!old || PCAinsworthMustKeepInner_Private(pc, data) || data->last < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(SetUpCost(inner, &cost));
  PetscCall(Decades(data, &decades));
  *limit = PetscMin((PetscInt)(many * FirstTook(data, decades) + cost), data->ksp->max_it);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthCount_Private - counts the iterations of a reduced solve that converged */
PetscErrorCode PCAinsworthCount_Private(PC_Ainsworth *data)
{
  PetscBool old;
  PetscInt  decades;
  PetscReal first;

  PetscFunctionBegin;
  PetscCall(KSPGetIterationNumber(data->ksp, &data->last));
  PetscCall(Decades(data, &decades));
  PetscCall(PCAinsworthIsOld_Private(data, &old));
  first = FirstTook(data, decades);
  if (data->took[decades] < 0 && (!old || first < 0.0)) data->took[decades] = data->last;
  else if (old) {
    data->extra = PetscMax(0.0, (PetscReal)data->last - first);
    data->more += data->extra;
    data->solves++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthRebuild_Private - rebuilds the inner preconditioner in the middle of an application; data->failure says why if that is impossible */
PetscErrorCode PCAinsworthRebuild_Private(PC pc, PC_Ainsworth *data)
{
  Mat_Ainsworth *ctx = NULL;

  PetscFunctionBegin;
  PetscCall(PetscInfo(pc, "The inner preconditioner of an earlier matrix took more iterations than a set-up costs: it is made anew\n"));
  if (data->constraints) PetscCall(MatAinsworthSetUpProjector_Private(data->reduced, &ctx));
  PetscCall(PCAinsworthSetUpInner_Private(pc, data, ctx, PETSC_FALSE, data->failure, sizeof(data->failure)));
  if (data->failure[0]) data->stale = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthViewRebuild_Private - prints the rule, and what is kept now */
PetscErrorCode PCAinsworthViewRebuild_Private(const PC_Ainsworth *data, PetscViewer viewer)
{
  PetscBool old;

  PetscFunctionBegin;
  PetscCall(PCAinsworthIsOld_Private(data, &old));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  inner preconditioner: rebuilt %s%s\n", PCAinsworthRebuildTypes[data->rebuild],
                                   !old         ? ""
                                   : data->kept ? "; now that of an earlier matrix"
                                                : "; now with the coarser levels of an earlier A"));
  if (data->last >= 0)
    PetscCall(PetscViewerASCIIPrintf(viewer, "    iterations: %" PetscInt_FMT " in the last solve with it; all took %g more than at first\n", data->last,
                                     (double)data->more));
  PetscFunctionReturn(PETSC_SUCCESS);
}
