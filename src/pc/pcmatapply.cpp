/* PCMatApply() of PCAINSWORTH: the reduced solves of several columns at once, each column judged as if it were alone */
#include "pcainsworth.h"
#include "../inner/together.h"

/* Gives the right-hand side of the reduced system for a column to the solver for all, as its k-th. Collective */
static PetscErrorCode SetColumn(PC_Ainsworth *data, Mat X, PetscInt column, PetscInt k, AinsworthTogether *together)
{
  Vec b;

  PetscFunctionBegin;
  PetscCall(MatDenseGetColumnVecRead(X, column, &b));
  PetscCall(
    AinsworthSaddleUseFields(data->saddle.get(), PETSC_TRUE, AINSWORTH_ACCESS_READ, b, [=](AinsworthSaddleVec right) {
      AinsworthSaddleVec kept = right;
      Mat_Ainsworth     *ctx  = NULL;

      PetscFunctionBegin;
      if (data->reduced->g) {
        kept = {data->reduced->f ? (Vec)data->reduced->f : right.primal, data->reduced->g};
        PetscCall(AinsworthSaddleRestrict(data->saddle.get(), right, kept));
      }
      PetscCall(PCAinsworthReduce_Private(data, PETSC_FALSE, kept));
      if (data->saddle->constraints()) PetscCall(MatAinsworthGetContext_Private(data->reduced->mat, &ctx));
      PetscCall(together->set(k, data->reduced->rhs, kept, !ctx || ctx->homogeneous, ctx ? ctx->energy : 0.0));
      PetscFunctionReturn(PETSC_SUCCESS);
    }));
  PetscCall(MatDenseRestoreColumnVecRead(X, column, &b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Applies the preconditioner to a column, with an error if that fails: PETSc forgets the failure at the next column */
static PetscErrorCode ApplyColumn(PC pc, PC_Ainsworth *data, Mat X, Mat Y, PetscInt j)
{
  PCFailedReason reason;
  Vec            x, y;

  PetscFunctionBegin;
  PetscCall(MatDenseGetColumnVecRead(X, j, &x));
  PetscCall(MatDenseGetColumnVecWrite(Y, j, &y));
  PetscCall(PCApply(pc, x, y));
  PetscCall(MatDenseRestoreColumnVecWrite(Y, j, &y));
  PetscCall(MatDenseRestoreColumnVecRead(X, j, &x));
  PetscCall(PCGetFailedReason(pc, &reason));
  /* a KSP cannot write Inf into a dense matrix */
  PetscCheck(!reason, PetscObjectComm((PetscObject)pc), PETSC_ERR_NOT_CONVERGED,
             "Column %" PetscInt_FMT " of the right-hand sides: %s", j, data->outcome.why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the reduced solves of n columns from `first` on, by the solver of those before where it can. Collective */
static PetscErrorCode SolveTogether(PC_Ainsworth *data, Mat X, PetscInt first, PetscInt n,
                                    std::unique_ptr<AinsworthTogether> *together)
{
  const PetscInt width = n > AinsworthNarrow ? AinsworthWidest : AinsworthNarrow;
  PetscBool      can   = PETSC_FALSE;

  PetscFunctionBegin;
  if (*together) PetscCall((*together)->again(width, &can));
  if (!can) {
    *together = std::make_unique<AinsworthTogether>();
    PetscCall((*together)->create(data, width));
    PetscCall((*together)->again(width, &can));
  }
  for (PetscInt k = 0; k < n; k++) PetscCall(SetColumn(data, X, first + k, k, together->get()));
  PetscCall((*together)->solve());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Applies the preconditioner to n columns from `first` on, whose reduced solves are made together */
static PetscErrorCode ApplyTogether(PC pc, PC_Ainsworth *data, Mat X, Mat Y, PetscInt first, PetscInt n,
                                    std::unique_ptr<AinsworthTogether> *together)
{
  PetscErrorCode code = SolveTogether(data, X, first, n, together);
  int            good = 0;

  PetscFunctionBegin;
  if (code) PetscCall(PCAinsworthAfterError_Private(data));
  PetscCall(code);
  const AinsworthTogether &all = **together;

  for (PetscInt k = 0; k < n; k++) good += all.columns[k].reason > 0;
  PetscCall(PetscInfo(pc, "%d of %" PetscInt_FMT " right-hand sides are solved together\n", good, n));
  for (PetscInt k = 0; k < n; k++) {
    if (all.columns[k].reason) data->found = {&all, k};
    code        = ApplyColumn(pc, data, X, Y, first + k);
    data->found = PCAinsworthFound(); /* it does not outlive this function */
    PetscCall(code);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCMatApply_Ainsworth(PC pc, Mat X, Mat Y)
{
  PC_Ainsworth                      *data = PCAinsworthData_Private(pc);
  std::unique_ptr<AinsworthTogether> together;
  PetscInt                           n;

  PetscFunctionBegin;
  PetscCall(MatGetSize(X, NULL, &n));
  if (n > 1) PetscCall(PCAinsworthRefresh_Private(pc));
  for (PetscInt j = 0, some; j < n; j += some) {
    PetscBool can = PETSC_FALSE; /* a column may have changed the solver */

    some = PetscMin(AinsworthWidest, n - j);
    if (some > 1 && data->state >= PC_AINSWORTH_READY && !data->whole.factor)
      PetscCall(AinsworthTogether::can(data, &can));
    if (can) PetscCall(ApplyTogether(pc, data, X, Y, j, some, &together));
    else {
      some = 1;
      PetscCall(ApplyColumn(pc, data, X, Y, j));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
