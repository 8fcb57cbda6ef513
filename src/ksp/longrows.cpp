/*
   Long rows of C, which the preconditioning matrix does not have: of M^{-1} r the preconditioner takes what leaves them, along M^{-1} C', as if it had been made
   for them. The projector would take it along W C', which is rough, and costs an iteration or two for each row. docs/models.md
*/
#include "projectedcg.h"
#include "../lists.h"
#include "../loops.h"
#include "../operator/matainsworth.h"
#include <petsc/private/pcimpl.h>
#include <petscblaslapack.h>

/* A row costs an application of the preconditioner, and a vector: more of them are left to the projector */
static const size_t most = 16;
/* What is left of the square of a row, without what it has in common with others, is a part of it larger than this, or nothing is done */
static const PetscReal dependent = 1e-6;

/* The adjoints of the rows of C with more than so many entries, on all ranks; none where they are too many */
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
  for (PetscInt number : all) {
    Vec row;

    PetscCall(MatCreateVecs(C, &row, NULL));
    if (std::find(mine.begin(), mine.end(), number) != mine.end()) {
      PetscInt           n;
      const PetscInt    *columns;
      const PetscScalar *values;

      PetscCall(MatGetRow(C, number, &n, &columns, &values));
      PetscCall(VecSetValues(row, n, columns, values, INSERT_VALUES));
      PetscCall(MatRestoreRow(C, number, &n, &columns, &values));
    }
    PetscCall(VecAssemblyBegin(row));
    PetscCall(VecAssemblyEnd(row));
    if (PetscDefined(USE_COMPLEX)) PetscCall(VecConjugate(row));
    rows->push_back(row);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPProjectedCGForgetLongRows_Private - the preconditioner, or C, is another one: rows of more than so many entries are not in it */
PetscErrorCode KSPProjectedCGForgetLongRows_Private(Mat_Ainsworth *ctx, PetscInt longest)
{
  PetscFunctionBegin;
  for (Vec &lifted : ctx->lifted) PetscCall(VecDestroy(&lifted));
  ctx->lifted.clear();
  ctx->longest = longest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPProjectedCGLiftLongRows_Private - Z = M^{-1} C' of the long rows, once for a preconditioner, and the factor of C Z */
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
  if (info || !size || !apart) PetscCall(KSPProjectedCGForgetLongRows_Private(ctx, PETSC_MAX_INT)); /* they depend on each other, or are none */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPProjectedCGTakeLongRows_Private - z = M^{-1} r becomes z - Z (C Z)^{-1} C z, where C z = Z' r */
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
