/* Whether the inner preconditioner is kept when A or C have other values: -pc_ainsworth_rebuild (docs/sequence.md) */
#include "pcainsworth.h"
#include "../multigrid/blocksa.h"
#include "../operator/matainsworth.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>

/* A set-up of multigrid costs as much as so many iterations: 10 of BoomerAMG's, 15 of PCGAMG's, 15 to 20 of PCBLOCKSA's, measured */
static const PetscInt setUp = 15;
/* A solve that takes so many times the iterations of the first ends the life of its preconditioner */
static const PetscReal many = 1.3;

/* PCAinsworthIsOld_Private - is the preconditioner that the reduced solve has of an earlier matrix, in the whole or in part? */
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

/* PCAinsworthKeepsAlways_Private - did the program, or an option, say so? */
PetscBool PCAinsworthKeepsAlways_Private(PC pc, const PC_Ainsworth *data)
{
  return (PetscBool)(pc->reusepreconditioner || data->rebuild == AINSWORTH_REBUILD_NEVER);
}

/* PCAinsworthKeeps_Private - before a set-up: is the inner preconditioner to be kept? */
PetscErrorCode PCAinsworthKeeps_Private(PC pc, const PC_Ainsworth *data, PetscBool *keeps)
{
  PC          inner;
  KSPNormType norm;
  PetscBool   expensive;

  PetscFunctionBegin;
  *keeps = PCAinsworthKeepsAlways_Private(pc, data);
  if (*keeps || data->rebuild == AINSWORTH_REBUILD_ALWAYS || data->first < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &expensive, PCBLOCKSA, PCHYPRE, PCGAMG, PCML, PCHMG, PCLU, PCCHOLESKY, PCREDUNDANT, ""));
  PetscCall(KSPGetNormType(data->ksp, &norm));
  *keeps = (PetscBool)(expensive && norm != KSP_NORM_NONE && data->last <= many * data->first && data->more <= setUp);
  if (expensive && !*keeps)
    PetscCall(PetscInfo(pc,
                        "The inner preconditioner is not kept: the first solve with it took %" PetscInt_FMT " iterations, the last one %" PetscInt_FMT
                        ", and all %" PetscInt_FMT " more than the first\n",
                        data->first, data->last, data->more));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthLimit_Private - before a reduced solve: the iterations after which an old preconditioner is made anew, and the solve begun again; 0: none */
PetscErrorCode PCAinsworthLimit_Private(PC pc, const PC_Ainsworth *data, PetscInt *limit)
{
  PetscBool old;

  PetscFunctionBegin;
  PetscCall(PCAinsworthIsOld_Private(data, &old));
  *limit = 0;
  if (!old || PCAinsworthKeepsAlways_Private(pc, data) || data->first < 0) PetscFunctionReturn(PETSC_SUCCESS);
  *limit = PetscMin((PetscInt)(many * data->first) + setUp, data->ksp->max_it);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthCount_Private - after a reduced solve that converged: what it says of the preconditioner */
PetscErrorCode PCAinsworthCount_Private(PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(KSPGetIterationNumber(data->ksp, &data->last));
  if (data->first < 0) {
    data->first = data->last;
    data->more  = 0;
  } else data->more += PetscMax(0, data->last - data->first);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthRebuild_Private - the inner preconditioner of the matrix at hand, in the middle of an application */
PetscErrorCode PCAinsworthRebuild_Private(PC pc, PC_Ainsworth *data, char why[], size_t len)
{
  Mat_Ainsworth *ctx = NULL;

  PetscFunctionBegin;
  PetscCall(PetscInfo(pc, "The inner preconditioner of an earlier matrix took more iterations than its set-up costs: it is made anew\n"));
  if (data->constraints) PetscCall(MatAinsworthSetUpProjector_Private(data->reduced, &ctx));
  PetscCall(PCAinsworthKeepOrSetUpInner_Private(pc, data, ctx, PETSC_FALSE, why, len));
  if (why[0]) data->stale = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthViewRebuild_Private - the rule, and what is kept now */
PetscErrorCode PCAinsworthViewRebuild_Private(const PC_Ainsworth *data, PetscViewer viewer)
{
  PetscBool old;

  PetscFunctionBegin;
  PetscCall(PCAinsworthIsOld_Private(data, &old));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  inner preconditioner: rebuilt %s%s\n", PCAinsworthRebuildTypes[data->rebuild],
                                   !old         ? ""
                                   : data->kept ? "; now that of an earlier matrix"
                                                : "; now with the levels of an earlier A"));
  if (data->first >= 0)
    PetscCall(
      PetscViewerASCIIPrintf(viewer, "    iterations: %" PetscInt_FMT " in the first solve with it, %" PetscInt_FMT " in the last\n", data->first, data->last));
  PetscFunctionReturn(PETSC_SUCCESS);
}
