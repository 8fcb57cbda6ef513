/*
   Unknowns that many rows of C share: reference nodes and macroscopic strains

   The preconditioning matrix holds them and their slaves, and the preconditioner of conjugate gradients moves them: with the responses Z in Ker C of the system
   to motions of single shared unknowns, computed with M^{-1}, and Y = Q' A Z, Z' Y = I,

   Q M^{-1} becomes (I - Z Y') Q M^{-1} (I - Y Z') + Z Z' (docs/models.md)
*/
#include "projectedcg.h"
#include "../objects.h"
#include "../operator/matainsworth.h"
#include <petsc/private/pcimpl.h>

/* A motion is dropped if the preconditioner and the motions before it leave at most this part of its energy */
static const PetscReal dependent = 1e-10;

/* KSPProjectedCGForgetShared_Private - discards Z and Y when the preconditioner or C changes; the preconditioning matrix holds the unknowns in `shared` */
PetscErrorCode KSPProjectedCGForgetShared_Private(Mat_Ainsworth *ctx, const std::vector<PetscInt> &shared)
{
  PetscFunctionBegin;
  for (std::vector<Vec> *vecs : {&ctx->motions, &ctx->motionForces}) {
    for (Vec &v : *vecs) PetscCall(VecDestroy(&v));
    vecs->clear();
  }
  ctx->shared = shared;
  ctx->moved  = false;
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
  PetscCall(KSPProjectedCGTakeLongRows_Private(ctx, rest, z));
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

/* Computes Z and Y; motions without energy and unknowns that C holds have no columns */
static PetscErrorCode Lift(PC pc, Mat mat, Mat_Ainsworth *ctx)
{
  Vec answer;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(mat, &answer, NULL));
  for (PetscInt unknown : ctx->shared) {
    Vec       motion, force;
    PetscInt  rstart, rend;
    PetscReal all, left;

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
    if (left > dependent * all) {
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

/* KSPProjectedCGLiftShared_Private - computes Z and Y, once per preconditioner */
PetscErrorCode KSPProjectedCGLiftShared_Private(PC pc, Mat mat, Mat_Ainsworth *ctx)
{
  PetscErrorCode error;

  PetscFunctionBegin;
  if (ctx->shared.empty() || ctx->moved) PetscFunctionReturn(PETSC_SUCCESS);
  error         = Lift(pc, mat, ctx); /* checked when everything is restored */
  ctx->inKernel = PETSC_FALSE;
  PetscCall(error);
  ctx->moved = true;
  PetscFunctionReturn(PETSC_SUCCESS);
}
