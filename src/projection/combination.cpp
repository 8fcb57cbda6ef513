/* A row of the multiplier field that was left out, as a combination of the rows that are kept */
#include "matainsworth.h"
#include "../base/layouts.h"
#include "../base/loops.h"

/* Subtracts the entries of the kept rows from those of all rows */
static PetscErrorCode SubtractKept(const AinsworthSaddle *sp, Vec kept, Vec all)
{
  const PetscScalar *k;
  PetscInt           n = 0;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(kept, &k));
  PetscCall(AinsworthUpdate(all, [&](PetscInt i, PetscScalar &a) {
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) a -= k[n++];
  }));
  PetscCall(VecRestoreArrayRead(kept, &k));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes left.primal = C' w and left.dual = G^{-1} D w, on the kept rows */
static PetscErrorCode Leave(const Mat_Ainsworth *ctx, const AinsworthSaddle *sp, Vec w, AinsworthSaddleVec left)
{
  Vec all;

  PetscFunctionBegin;
  PetscCall(MatMultHermitianTranspose(sp->all.C, w, left.primal));
  PetscCall(VecZeroEntries(left.dual));
  if (!ctx->D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(w, &all));
  PetscCall(MatMultHermitianTranspose(sp->all.D, w, all));
  PetscCall(AinsworthSaddleGetKept(sp, all, left.dual));
  PetscCall(VecDestroy(&all));
  if (sp->balance) PetscCall(VecPointwiseMult(left.dual, left.dual, sp->balance));
  PetscCall(VecPointwiseMult(left.dual, left.dual, ctx->proj.compliance.inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   MatAinsworthCombineRows_Private - subtracts from rows, whose coefficients are w, the combination of kept rows next to
   them, so that w' C and w' D are about 0

   Collective

   The next in the norm of W is S^{-1} (C W C' w + G^{-1} D w); it is refined, as S may be ill-conditioned
*/
PetscErrorCode MatAinsworthCombineRows_Private(Mat mat, const AinsworthSaddle *sp, Vec w)
{
  /* S has a condition number of at most 1e13 here: each step adds three digits at least */
  static const int   steps = 3;
  Mat_Ainsworth     *ctx;
  AinsworthSaddleVec left;
  Vec                kept;

  PetscFunctionBegin;
  PetscCall(MatAinsworthSetUpProjector_Private(mat, &ctx));
  PetscCall(AinsworthCreateVecs(sp->kept.C, &left.primal, &left.dual));
  PetscCall(VecDuplicate(left.dual, &kept));
  for (int k = 0; k < steps; k++) {
    PetscCall(Leave(ctx, sp, w, left));
    PetscCall(AinsworthProjectorMultiplier(&ctx->proj, false, left.primal, left.dual, kept));
    if (sp->balance) PetscCall(VecPointwiseMult(kept, kept, sp->balance));
    PetscCall(SubtractKept(sp, kept, w));
  }
  PetscCall(VecDestroy(&kept));
  PetscCall(AinsworthSaddleVecDestroy(&left));
  PetscFunctionReturn(PETSC_SUCCESS);
}
