/*
   What conjugate gradients in Ker C add to a preconditioner for what its matrix M leaves out (docs/models.md)

   Long rows of C: M^{-1} r is projected onto their kernel along L = M^{-1} C', as if M had been made with them, to M^{-1} - L (C L)^{-1} L'. The projector would
   do so along W C', which is rough and costs an iteration or two per row

   Unknowns that many rows of C share, such as reference nodes and macroscopic strains, which M holds with their slaves: with the responses Z in Ker C of the
   system to motions of single shared unknowns, computed with the above, and Y = Q' A Z, Z' Y = I, Q M^{-1} becomes (I - Z Y') Q M^{-1} (I - Y Z') + Z Z'

   The first takes directions away and needs no product with A, the second adds some: neither is a case of the other
*/
#include "projectedcg.h"
#include "../lists.h"
#include "../loops.h"
#include "../objects.h"
#include "../operator/matainsworth.h"
#include <petscblaslapack.h>

/* Each row costs an application of the preconditioner and a vector; if there are more rows, they are left to the projector */
static const size_t most = 16;
/* A row is dependent if the Cholesky factorization of C L leaves at most this part of its diagonal entry; then nothing is done */
static const PetscReal dependentRow = 1e-6;
/* A motion is dropped if the preconditioner and the motions before it leave at most this part of its energy */
static const PetscReal dependentMotion = 1e-10;

/* KSPProjectedCGForget_Private - discards L, Z and Y when the preconditioner, C or what M leaves out changes */
PetscErrorCode KSPProjectedCGForget_Private(Mat_Ainsworth *ctx)
{
  PetscFunctionBegin;
  for (std::vector<Vec> *vecs : {&ctx->lifted, &ctx->motions, &ctx->motionForces}) {
    for (Vec &v : *vecs) PetscCall(VecDestroy(&v));
    vecs->clear();
  }
  ctx->complete = false;
  PetscFunctionReturn(PETSC_SUCCESS);
}

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

/* Computes L and the factor of C L; dependent rows are left to the projector from here on */
static PetscErrorCode LiftLongRows(PC pc, Mat_Ainsworth *ctx)
{
  std::vector<Vec> rows;
  PetscBLASInt     size, info = 0;
  bool             apart = true;

  PetscFunctionBegin;
  if (ctx->longest == PETSC_MAX_INT) PetscFunctionReturn(PETSC_SUCCESS);
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
  for (size_t k = 0; k < rows.size(); k++) apart = apart && PetscSqr(PetscRealPart(ctx->longFactor[k * (rows.size() + 1)])) > dependentRow * before[k];
  if (info || !size || !apart) {
    PetscCall(KSPProjectedCGForget_Private(ctx));
    ctx->longest = PETSC_MAX_INT;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Turns z = M^{-1} r into z - L (C L)^{-1} C z, where C z = L' r */
static PetscErrorCode TakeLongRows(const Mat_Ainsworth *ctx, Vec r, Vec z)
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

/* KSPProjectedCGPrecondition_Private - computes z = Q M^{-1} r with the corrections for long rows and shared unknowns */
PetscErrorCode KSPProjectedCGPrecondition_Private(PC pc, Mat mat, Mat_Ainsworth *ctx, Vec r, Vec z)
{
  const PetscInt           n = (PetscInt)ctx->motions.size();
  std::vector<PetscScalar> forces(n), factors(n);
  Vec                      rest = r;
  PetscErrorCode           code;

  PetscFunctionBegin;
  if (n) {
    PetscCall(VecMDot(r, n, ctx->motions.data(), forces.data()));
    for (PetscInt k = 0; k < n; k++) factors[k] = -forces[k];
    PetscCall(AinsworthVecClone(r, &rest));
    PetscCall(VecMAXPY(rest, n, factors.data(), ctx->motionForces.data()));
  }
  ctx->inKernel = PETSC_FALSE; /* products inside the preconditioner are with A~ */
  code          = (*ctx->apply)(pc, rest, z);
  ctx->inKernel = PETSC_TRUE;
  PetscCall(code);
  PetscCall(TakeLongRows(ctx, rest, z));
  PetscCall(MatAinsworthMultProjector(mat, z, z));
  if (n) {
    PetscCall(VecDestroy(&rest));
    PetscCall(VecMDot(z, n, ctx->motionForces.data(), factors.data()));
    for (PetscInt k = 0; k < n; k++) factors[k] = forces[k] - factors[k];
    PetscCall(VecMAXPY(z, n, factors.data(), ctx->motions.data()));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y = Q' A x for an x in Ker C, and the energy x' y */
static PetscErrorCode MultiplyMotion(Mat mat, Mat_Ainsworth *ctx, Vec x, Vec y, PetscReal *energy)
{
  PetscScalar product;

  PetscFunctionBegin;
  ctx->inKernel = ctx->direction = PETSC_TRUE;
  PetscCall(MatMult(mat, x, y));
  PetscCall(VecDot(y, x, &product));
  *energy = PetscRealPart(product);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes Z and Y with the preconditioner that has L already; motions without energy and unknowns that C holds have no columns */
static PetscErrorCode LiftShared(PC pc, Mat mat, Mat_Ainsworth *ctx)
{
  Vec answer;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(mat, &answer, NULL));
  for (PetscInt unknown : ctx->shared) {
    Vec       motion, force;
    PetscInt  rstart, rend;
    PetscReal all = 0.0, left = 0.0;

    PetscCall(MatCreateVecs(mat, &motion, &force));
    PetscCall(VecZeroEntries(motion));
    PetscCall(VecGetOwnershipRange(motion, &rstart, &rend));
    if (unknown >= rstart && unknown < rend) PetscCall(VecSetValue(motion, unknown, 1.0, INSERT_VALUES));
    PetscCall(VecAssemblyBegin(motion));
    PetscCall(VecAssemblyEnd(motion));
    PetscCall(MatAinsworthMultProjector(mat, motion, motion));
    PetscCall(MultiplyMotion(mat, ctx, motion, force, &all));
    PetscCall(KSPProjectedCGPrecondition_Private(pc, mat, ctx, force, answer));
    PetscCall(VecAXPY(motion, -1.0, answer)); /* now orthogonal to the motions before it */
    PetscCall(MultiplyMotion(mat, ctx, motion, force, &left));
    if (left > dependentMotion * all) {
      for (Vec v : {motion, force}) PetscCall(VecScale(v, 1.0 / PetscSqrtReal(left)));
      ctx->motions.push_back(motion);
      ctx->motionForces.push_back(force);
    } else {
      PetscCall(VecDestroy(&motion));
      PetscCall(VecDestroy(&force));
    }
  }
  PetscCall(VecDestroy(&answer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPProjectedCGLift_Private - computes L, Z and Y, once per preconditioner */
PetscErrorCode KSPProjectedCGLift_Private(PC pc, Mat mat, Mat_Ainsworth *ctx)
{
  PetscErrorCode error;

  PetscFunctionBegin;
  if (ctx->complete) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPProjectedCGForget_Private(ctx)); /* what an error left */
  PetscCall(LiftLongRows(pc, ctx));
  error         = LiftShared(pc, mat, ctx); /* checked when everything is restored */
  ctx->inKernel = PETSC_FALSE;
  PetscCall(error);
  ctx->complete = true;
  PetscFunctionReturn(PETSC_SUCCESS);
}
