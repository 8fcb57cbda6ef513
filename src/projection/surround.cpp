/*
   What takes the place of M^{-1} during a solve: a PCSHELL around the preconditioner that the program sees

   It adds what M does not have, knows when M is symmetric, and has no iteration of its own, which would be with M in
   place of the operator
*/
#include "inkernel.h"
#include "../base/guard.h"
#include "matainsworth.h"
#include <string>

static const char innerName[] = "AinsworthInner"; /* of M^{-1}, composed with the preconditioner around it */

namespace
{
struct Surrounding {
  PC                 inner = NULL; /* composed with the preconditioner */
  std::string        type;         /* of `inner` when this was made */
  PetscBool          symmetric = PETSC_FALSE;
  Mat                reduced = NULL, operation = NULL; /* referenced; operation: in Ker C */
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
  if (s->operation) PetscCall(s->deflation.setUp(s->inner, s->reduced, s->operation, s->left));
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

static PetscErrorCode PCApply_Plain(PC pc, Vec r, Vec z)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(PCApply(s->inner, r, z));
  PetscCall(ForwardReason(pc, s->inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Applies the transpose of M^{-1}; PCHYPRE of PETSc 3.18 claims to have one, but BoomerAMG then returns zeros or
   crashes
*/
static PetscErrorCode PCApplyTranspose_Plain(PC pc, Vec r, Vec z)
{
  Surrounding *s;
  const char  *prefix;
  PetscBool    hypre;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  if (s->symmetric) {
    PetscCall(PCApply_Plain(pc, r, z));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscObjectTypeCompare((PetscObject)s->inner, PCHYPRE, &hypre));
  PetscCall(PCGetOptionsPrefix(s->inner, &prefix));
  PetscCheck(!hypre, PetscObjectComm((PetscObject)pc), PETSC_ERR_SUP,
             "The transpose of a system with an A that is not symmetric needs that of its preconditioner, which %s has "
             "not: choose another -%spc_type",
             PCHYPRE, prefix);
  PetscCall(PCApplyTranspose(s->inner, r, z));
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
  PetscCall(MatAinsworthPrecondition_Private(s->reduced, pc, apply, r, z));
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
  for (Mat *M : {&s->reduced, &s->operation}) PetscCall(MatDestroy(M));
  delete s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a preconditioner around M^{-1}; reduced and operation may be NULL; *out: its context */
static PetscErrorCode Surround(PC inner, PetscBool symmetric, Mat reduced, Mat operation, const char name[], PC *pc,
                               Surrounding **out)
{
  Surrounding *s = new Surrounding();
  const char  *prefix;

  PetscFunctionBegin;
  s->inner     = inner;
  s->type      = TypeName(inner);
  s->symmetric = symmetric;
  s->reduced   = reduced;
  s->operation = operation;
  for (Mat M : {reduced, operation}) PetscCall(PetscObjectReference((PetscObject)M));
  PetscCall(PCCreate(PetscObjectComm((PetscObject)inner), pc));
  PetscCall(PCSetType(*pc, PCSHELL));
  PetscCall(PCShellSetContext(*pc, s));
  PetscCall(PCShellSetName(*pc, name));
  PetscCall(PCShellSetDestroy(*pc, PCDestroy_Surrounding));
  PetscCall(PCShellSetView(*pc, PCView_Surrounding));
  PetscCall(PCShellSetSetUp(*pc, PCSetUp_Surrounding));
  PetscCall(PCShellSetPreSolve(*pc, AinsworthGuarded<PCPreSolve_Surrounding>));
  PetscCall(PCShellSetPostSolve(*pc, PCPostSolve_Surrounding));
  PetscCall(PetscObjectCompose((PetscObject)*pc, innerName, (PetscObject)inner));
  PetscCall(PetscObjectIncrementTabLevel((PetscObject)*pc, (PetscObject)inner, 0));
  PetscCall(PCGetOptionsPrefix(inner, &prefix));
  PetscCall(PCSetOptionsPrefix(*pc, prefix));
  *out = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthInKernelCreatePC(Mat reduced, Mat operation, PC inner, const AinsworthLeftOut &left, PC *pc)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(Surround(inner, PETSC_TRUE, reduced, operation, "preconditioner in Ker C", pc, &s));
  s->left = left;
  PetscCall(PCShellSetApply(*pc, AinsworthGuarded<PCApply_InKernel>));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthInKernelGetDeflation(PC pc, const AinsworthDeflation **deflation)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &s));
  *deflation = &s->deflation;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSpringsCreatePC(Mat reduced, PC inner, PetscBool symmetric, PC *pc)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(Surround(inner, symmetric, reduced, NULL, "preconditioner with the springs of D", pc, &s));
  PetscCall(PCShellSetApply(*pc, PCApply_Springs<PCApply_Plain>));
  PetscCall(PCShellSetApplyTranspose(*pc, PCApply_Springs<PCApplyTranspose_Plain>));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthPlainCreatePC(PC inner, PetscBool symmetric, PC *pc)
{
  Surrounding *s;

  PetscFunctionBegin;
  PetscCall(Surround(inner, symmetric, NULL, NULL, "preconditioner", pc, &s));
  PetscCall(PCShellSetApply(*pc, PCApply_Plain));
  PetscCall(PCShellSetApplyTranspose(*pc, PCApplyTranspose_Plain));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthGetInnermostPC(PC pc, PC *inner)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)pc, innerName, (PetscObject *)inner));
  if (!*inner) *inner = pc;
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
