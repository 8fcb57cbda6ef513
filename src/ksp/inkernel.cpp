/*
   Conjugate gradients in Ker C (Gould, Hribar, Nocedal 2001): Q' A x = b with x and the directions in Ker C, b in the range of Q', and the preconditioner
   Q M^{-1}. An iteration costs one product with A, one application of M^{-1} and two solves with the Gram matrix
*/
#include "inkernel.h"
#include "../guard.h"
#include "../objects.h"
#include "../operator/matainsworth.h"
#include <string>

static const char reducedName[] = "AinsworthReduced", innerName[] = "AinsworthInner"; /* objects composed with the operator and the preconditioners */

/* Computes y = Q' A x for an x in Ker C; what Q' leaves in the range of C' would grow in residuals */
static PetscErrorCode MatMult_InKernel(Mat operation, Vec x, Vec y)
{
  Mat            reduced;
  Mat_Ainsworth *ctx;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(operation, &reduced));
  PetscCall(MatAinsworthGetContext_Private(reduced, &ctx));
  PetscCall(MatMult(ctx->product ? ctx->product : ctx->A, x, y));
  PetscCall(MatAinsworthProjectForces_Private(reduced, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthInKernelCreateOperator(Mat reduced, Mat *operation)
{
  PetscInt     m, n;
  MatNullSpace nullspace;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(reduced, &m, &n));
  PetscCall(MatCreateShell(PetscObjectComm((PetscObject)reduced), m, n, PETSC_DETERMINE, PETSC_DETERMINE, reduced, operation));
  PetscCall(MatShellSetOperation(*operation, MATOP_MULT, (void (*)(void))MatMult_InKernel));
  PetscCall(PetscObjectCompose((PetscObject)*operation, reducedName, (PetscObject)reduced));
  PetscCall(MatGetNullSpace(reduced, &nullspace));
  if (nullspace) PetscCall(MatSetNullSpace(*operation, nullspace));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthInKernelIs(Mat operation, PetscBool *inKernel)
{
  PetscObject reduced;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)operation, reducedName, &reduced));
  *inKernel = (PetscBool)(reduced != NULL);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthGetInnermostPC(PC pc, PC *inner)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)pc, innerName, (PetscObject *)inner));
  if (!*inner) *inner = pc;
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* What surrounds M^{-1} */
struct Surrounding {
  Mat                reduced = NULL, operation = NULL; /* borrowed from the operators of the preconditioner, and from what is composed with them */
  PC                 inner = NULL;                     /* composed with it */
  std::string        type;                             /* of that preconditioner */
  AinsworthLeftOut   left;
  AinsworthDeflation deflation;
};
} // namespace

/* Returns the type of a preconditioner, empty if it has none yet */
static std::string TypeName(PC pc)
{
  PCType type;

  (void)PCGetType(pc, &type);
  return type ? type : "";
}

/* Forwards the reason of a failure of M^{-1} */
static PetscErrorCode ForwardReason(PC pc, PC inner)
{
  PCFailedReason reason;

  PetscFunctionBegin;
  PetscCall(PCGetFailedReason(inner, &reason));
  PetscCall(PCSetFailedReason(pc, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetUp_Surrounding(PC pc)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(PCSetUp(s->inner));
  PetscCall(ForwardReason(pc, s->inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCPreSolve_Surrounding(PC pc, KSP ksp, Vec, Vec)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(PCPreSolve(s->inner, ksp));
  /* in the first solve, as M^{-1} depends on the method */
  if (s->operation != s->reduced) PetscCall(s->deflation.setUp(s->inner, s->reduced, s->operation, s->left));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCPostSolve_Surrounding(PC pc, KSP ksp, Vec, Vec)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(PCPostSolve(s->inner, ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes z = Q M^{-1} r with the corrections for what M leaves out */
static PetscErrorCode PCApply_InKernel(PC pc, Vec r, Vec z)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(s->deflation.apply(s->inner, s->reduced, r, z));
  PetscCall(ForwardReason(pc, s->inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Applies the inverse of M_*^+, which includes the springs of D (docs/method.md), with M_*^{-1} or its transpose */
template <PetscErrorCode (*apply)(PC, Vec, Vec)>
static PetscErrorCode PCApply_Springs(PC pc, Vec r, Vec z)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(MatAinsworthPrecondition_Private(s->reduced, s->inner, apply, r, z));
  PetscCall(ForwardReason(pc, s->inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSurrounds(PC pc, PC inner, PetscBool *surrounds)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  *surrounds = (PetscBool)(s->inner == inner && s->type == TypeName(inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCView_Surrounding(PC pc, PetscViewer viewer)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(PCView(s->inner, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_Surrounding(PC pc)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  delete s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a preconditioner around M^{-1} for an operator; *out: its context */
static PetscErrorCode Surround(Mat reduced, Mat operation, PC inner, const char name[], PC *pc, Surrounding **out)
{
  Surrounding *s = new Surrounding();
  Mat          M;
  const char  *prefix;

  PetscFunctionBegin;
  s->reduced   = reduced;
  s->operation = operation;
  s->inner     = inner;
  s->type      = TypeName(inner);
  PetscCall(PCCreate(PetscObjectComm((PetscObject)inner), pc));
  PetscCall(PCSetType(*pc, PCSHELL));
  PetscCall(PCShellSetContext(*pc, s));
  PetscCall(PCShellSetDestroy(*pc, PCDestroy_Surrounding));
  PetscCall(PCShellSetView(*pc, PCView_Surrounding));
  PetscCall(PCShellSetSetUp(*pc, PCSetUp_Surrounding));
  PetscCall(PCShellSetPreSolve(*pc, AinsworthGuarded<PCPreSolve_Surrounding>));
  PetscCall(PCShellSetPostSolve(*pc, PCPostSolve_Surrounding));
  PetscCall(PCShellSetName(*pc, name));
  PetscCall(PetscObjectCompose((PetscObject)*pc, innerName, (PetscObject)inner));
  PetscCall(PetscObjectIncrementTabLevel((PetscObject)*pc, (PetscObject)inner, 0));
  PetscCall(PCGetOptionsPrefix(inner, &prefix));
  PetscCall(PCSetOptionsPrefix(*pc, prefix));
  PetscCall(PCGetOperators(inner, NULL, &M));
  PetscCall(PCSetOperators(*pc, operation, M));
  *out = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthInKernelCreatePC(Mat reduced, Mat operation, PC inner, const AinsworthLeftOut &left, PC *pc)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(Surround(reduced, operation, inner, "preconditioner in Ker C", pc, &s));
  s->left = left;
  PetscCall(PCShellSetApply(*pc, AinsworthGuarded<PCApply_InKernel>));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSpringsCreatePC(Mat reduced, PC inner, PC *pc)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(Surround(reduced, reduced, inner, "preconditioner with the springs of D", pc, &s));
  PetscCall(PCShellSetApply(*pc, PCApply_Springs<PCApply>));
  PetscCall(PCShellSetApplyTranspose(*pc, PCApply_Springs<PCApplyTranspose>));
  PetscFunctionReturn(PETSC_SUCCESS);
}
