#include "reduced.h"
#include "../base/layouts.h"
#include "../base/objects.h"

/*
   Creates next->mat with its projector, or takes it from the last set-up: for the same A, B, C and D with other values,
   what depends on their patterns alone stays
*/
static PetscErrorCode CreateOperator(const AinsworthReducedChoices &choices, MatAinsworthWeightType weight,
                                     const AinsworthSaddle *sp, AinsworthReduced *next)
{
  Mat_Ainsworth *old = NULL, *ctx;
  const char    *prefix;

  PetscFunctionBegin;
  if (next->mat) PetscCall(MatAinsworthGetContext_Private(next->mat, &old));
  if (!old || old->A != sp->A || old->C != sp->kept.C || old->B != sp->kept.B || old->D != sp->kept.D ||
      old->adjoint != sp->adjoint) {
    PetscCall(MatAinsworthCreate_Private(sp->A, sp->kept.C, next->mat.out()));
    PetscCall(MatSetBlockSize(next->mat, sp->bs));
    PetscCall(
      MatAinsworthSetOtherBlocks_Private(next->mat, sp->oneSided() ? (Mat)NULL : sp->kept.B, sp->kept.D, sp->adjoint));
    PetscCall(PetscObjectGetOptionsPrefix(choices.parent, &prefix));
    PetscCall(MatSetOptionsPrefix(next->mat, prefix));
    PetscCall(PetscObjectIncrementTabLevel((PetscObject)next->mat, choices.parent, 0));
  }
  PetscCall(MatAinsworthSetGramChoices_Private(next->mat, choices.gram));
  if (weight == MAT_AINSWORTH_WEIGHT_USER) {
    PetscCheck(choices.weight, PetscObjectComm(choices.parent), PETSC_ERR_ARG_WRONGSTATE,
               "-pc_ainsworth_weight user needs a vector: call PCAinsworthSetWeight()");
    PetscCall(MatAinsworthSetWeight(next->mat, choices.weight));
  } else PetscCall(MatAinsworthSetWeightType(next->mat, weight));
  PetscCall(MatAinsworthSetUpProjector_Private(next->mat, &ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes rows of C that depend on others, or nearly so, from the constraints, or raises an error */
static PetscErrorCode DropDependentRows(const AinsworthReducedChoices &choices, AinsworthRowKind kind, PetscInt n,
                                        const PetscInt dependent[], AinsworthSaddleStage *saddle)
{
  char names[128];

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleDropDependent(saddle, n, dependent, kind));
  PetscCall(AinsworthSaddleNameKind(saddle->get(), kind, names, sizeof(names)));
  PetscCheck(choices.redundant != AINSWORTH_REDUNDANT_ERROR, PetscObjectComm(choices.parent), PETSC_ERR_MAT_CH_ZRPVT,
             "%" PetscInt_FMT " rows of C are linear combinations of others: rows %s of the multiplier field; remove "
             "them or use -pc_ainsworth_redundant drop",
             n, names);
  PetscCall(PetscInfo(choices.parent,
                      "%" PetscInt_FMT
                      " rows of C are linear combinations of others and left out: rows %s of the multiplier field\n",
                      n, names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets up the operator without dependent rows of C, which are looked for only if the Gram matrix is suspicious

   If it has too few digits to tell rows apart that do not depend on each other, or cannot be factored, another solver
   is asked for. If there is none, such rows are left out, and have to be met to rounding
*/
static PetscErrorCode SetUpOperator(const AinsworthReducedChoices &choices, const AinsworthReplaceFn &replace,
                                    AinsworthSaddleStage *saddle, AinsworthReduced *next, PCFailedReason *reason)
{
  MatAinsworthWeightType weight = choices.weightType;
  PetscInt               pass = 0, n      = 1;
  PetscBool              hidden, replaced = PETSC_FALSE;

  PetscFunctionBegin;
  while (n && (*saddle)->constraints()) {
    PetscInt      *dependent;
    PetscErrorCode error = PETSC_SUCCESS; /* checked after PetscFree() */

    PetscCall(CreateOperator(choices, weight, saddle->get(), next));
    PetscCall(MatAinsworthDiagnose_Private(next->mat, &pass, &n, &dependent, reason, &hidden));
    hidden = (PetscBool)(hidden && weight == MAT_AINSWORTH_WEIGHT_DIAGONAL);
    if (hidden) {
      PetscCall(PetscInfo(
        choices.parent,
        "Rows of C that diag(A)^{-1} cannot tell apart are independent without it: the weight is the identity\n"));
      weight = MAT_AINSWORTH_WEIGHT_IDENTITY;
    } else if (n ? pass > 1 : *reason != PC_NOERROR) PetscCall(replace(&replaced));
    if (replaced) n = 0;
    else if (n && !hidden)
      error = DropDependentRows(choices, pass > 1 ? AINSWORTH_ROW_NEAR : AINSWORTH_ROW_DEPENDENT, n, dependent, saddle);
    PetscCall(PetscFree(dependent));
    PetscCall(error);
  }
  if (replaced) *reason = PC_NOERROR;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates vectors for the kept rows, if not all rows are constraints or some unknowns are known */
static PetscErrorCode CreateKeptVectors(const AinsworthReducedChoices &choices, const AinsworthSaddle *sp,
                                        AinsworthReduced *next)
{
  char text[256];

  PetscFunctionBegin;
  if (sp->kept.C == sp->all.C && !sp->known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSaddleDescribeRows(sp, text, sizeof(text)));
  PetscCall(PetscInfo(choices.parent, "%" PetscInt_FMT " constraints%s\n", sp->constraints(), text));
  PetscCall(AinsworthCreateVecs(sp->kept.C, NULL, next->g.out()));
  PetscCall(VecDuplicate(next->g, next->lambda.out()));
  if (sp->known || !sp->oneSided()) PetscCall(AinsworthCreateVecs(sp->A, NULL, next->f.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether vectors of the last set-up have the layout of A on all ranks. Collective */
static PetscErrorCode HaveLayout(const AinsworthReduced *last, Mat A, PetscBool *have)
{
  PetscInt before, now;

  PetscFunctionBegin;
  *have = (PetscBool)(last && last->rhs);
  if (!*have) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(last->rhs, &before));
  PetscCall(MatGetLocalSize(A, &now, NULL));
  *have = (PetscBool)(before == now);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, have, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthReducedBuild - builds the reduced system; rows of C that depend on others are taken from the constraints of
   the saddle point. Collective

   Input Parameters:
+  replace - called if the Gram matrix C W C' has too few digits
-  last    - its operator and vectors are used again where they fit; or NULL

   reason: PC_NOERROR, or why solves with the Gram matrix fail; then nothing is built
*/
PetscErrorCode AinsworthReducedBuild(const AinsworthReducedChoices &choices, const AinsworthReplaceFn &replace,
                                     const AinsworthReduced *last, AinsworthSaddleStage *saddle,
                                     AinsworthReducedStage *built, PCFailedReason *reason)
{
  auto           next = std::make_unique<AinsworthReduced>();
  Mat_Ainsworth *ctx  = NULL;
  PetscBool      have;

  PetscFunctionBegin;
  *reason = PC_NOERROR;
  PetscCall(HaveLayout(last, saddle->get()->A, &have));
  if (have) {
    next->mat = last->mat;
    next->rhs = last->rhs;
    next->Ax  = last->Ax;
  }
  PetscCall(SetUpOperator(choices, replace, saddle, next.get(), reason));
  if (*reason) PetscFunctionReturn(PETSC_SUCCESS);
  const AinsworthSaddle *sp = saddle->get();

  if (sp->constraints()) PetscCall(MatAinsworthGetContext_Private(next->mat, &ctx));
  else {
    PetscCall(PetscInfo(choices.parent, "No constraints: the reduced system is that of A alone\n"));
    next->mat.reset();
  }
  if (ctx && ctx->weightType == MAT_AINSWORTH_WEIGHT_DIAGONAL) next->inverseDiagonal = AinsworthRetain(ctx->weight);
  else PetscCall(AinsworthWeightCreate(sp->A, next->inverseDiagonal.out()));
  PetscCall(CreateKeptVectors(choices, sp, next.get()));
  if (!next->rhs) PetscCall(AinsworthCreateVecs(sp->A, next->Ax.out(), next->rhs.out()));
  *built = std::move(next);
  PetscFunctionReturn(PETSC_SUCCESS);
}
