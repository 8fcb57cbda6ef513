/*
   Long rows of C, which are not in the preconditioning matrix

   The preconditioner projects M^{-1} r onto the kernel of these rows along M^{-1} C', as if it had been made with them. The projector would do so along W C',
   which is rough and costs an iteration or two per row (docs/models.md)
*/
#include "projectedcg.h"
#include "../lists.h"
#include "../loops.h"
#include "../operator/matainsworth.h"
#include <petsc/private/pcimpl.h>
#include <petscblaslapack.h>

/* Each row costs an application of the preconditioner and a vector; if there are more rows, they are left to the projector */
static const size_t most = 16;
/* A row is dependent if the Cholesky factorization of C Z leaves at most this part of its diagonal entry; then nothing is done */
static const PetscReal dependent = 1e-6;

/* Gets the adjoints of the rows of C with more than `longest` entries on all ranks, or none if there are too many; collective */
static PetscErrorCode GetLongRows(Mat C, PetscInt longest, std::vector<Vec> *rows)
{
  PetscInt              found;
  std::vector<PetscInt> mine, all;

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    if (row.n > longest) mine.push_back(row.number);
  }));
  found = (PetscInt)mine.size();
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)C)));
  if ((size_t)found > most) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)C), mine, &all));
  PetscCall(AinsworthGetRows(C, all, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPProjectedCGForgetLongRows_Private - discards Z when the preconditioner or C changes; rows longer than `longest` are not in the preconditioner */
PetscErrorCode KSPProjectedCGForgetLongRows_Private(Mat_Ainsworth *ctx, PetscInt longest)
{
  PetscFunctionBegin;
  for (Vec &lifted : ctx->lifted) PetscCall(VecDestroy(&lifted));
  ctx->lifted.clear();
  ctx->longest = longest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPProjectedCGLiftLongRows_Private - computes Z = M^{-1} C' of the long rows and the factor of C Z, once per preconditioner */
PetscErrorCode KSPProjectedCGLiftLongRows_Private(PC pc, Mat_Ainsworth *ctx)
{
  std::vector<Vec> rows;
  PetscBLASInt     size, info = 0;
  bool             apart = true;

  PetscFunctionBegin;
  if (ctx->longest == PETSC_MAX_INT || !ctx->lifted.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetLongRows(ctx->C, ctx->longest, &rows));
  ctx->longFactor.assign(rows.size() * rows.size(), 0.0);
  for (size_t k = 0; k < rows.size(); k++) {
    Vec lifted;

    PetscCall(VecDuplicate(rows[k], &lifted));
    ctx->lifted.push_back(lifted);
    PetscCall((*ctx->apply)(pc, rows[k], lifted));
    PetscCall(VecMDot(lifted, (PetscInt)rows.size(), rows.data(), &ctx->longFactor[k * rows.size()]));
  }
  for (Vec &row : rows) PetscCall(VecDestroy(&row));
  PetscCall(PetscBLASIntCast((PetscInt)rows.size(), &size));
  std::vector<PetscReal> before;
  for (size_t k = 0; k < rows.size(); k++) before.push_back(PetscRealPart(ctx->longFactor[k * (rows.size() + 1)]));
  if (size) PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &size, ctx->longFactor.data(), &size, &info));
  for (size_t k = 0; k < rows.size(); k++) apart = apart && PetscSqr(PetscRealPart(ctx->longFactor[k * (rows.size() + 1)])) > dependent * before[k];
  if (info || !size || !apart) PetscCall(KSPProjectedCGForgetLongRows_Private(ctx, PETSC_MAX_INT)); /* the rows are dependent, or there are none */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPProjectedCGTakeLongRows_Private - turns z = M^{-1} r into z - Z (C Z)^{-1} C z, where C z = Z' r */
PetscErrorCode KSPProjectedCGTakeLongRows_Private(const Mat_Ainsworth *ctx, Vec r, Vec z)
{
  const size_t             n = ctx->lifted.size();
  std::vector<PetscScalar> left(n), factor;
  PetscBLASInt             size, one = 1, info;

  PetscFunctionBegin;
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecMDot(r, (PetscInt)n, ctx->lifted.data(), left.data()));
  PetscCall(PetscBLASIntCast((PetscInt)n, &size));
  factor = ctx->longFactor;
  PetscCallBLAS("LAPACKpotrs", LAPACKpotrs_("L", &size, &one, factor.data(), &size, left.data(), &size, &info));
  for (PetscScalar &value : left) value = -value;
  PetscCall(VecMAXPY(z, (PetscInt)n, left.data(), const_cast<Vec *>(ctx->lifted.data())));
  PetscFunctionReturn(PETSC_SUCCESS);
}
