#include "observed.h"
#include "../projection/projectedcg.h"
#include "../base/layouts.h"
#include "../base/objects.h"
#include <petsctime.h>

namespace
{
struct Observed {
  Mat            A        = NULL;
  KSP            ksp      = NULL; /* borrowed */
  PetscInt       products = 0;    /* with its search direction: a monitor or the preconditioner may make others */
  PetscReal      xAx      = 0.0;  /* of the last of them */
  PetscLogDouble seconds  = 0.0;  /* spent on these dot products, all together */
};
} // namespace

static PetscErrorCode MatMult_Observed(Mat mat, Vec x, Vec y)
{
  Observed      *observed;
  Vec            direction;
  PetscScalar    xAx;
  PetscLogDouble start, end;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &observed));
  PetscCall(MatMult(observed->A, x, y));
  PetscCall(KSPProjectedCGGetDirection_Private(observed->ksp, &direction));
  if (x != direction) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscTime(&start));
  PetscCall(VecDot(y, x, &xAx));
  PetscCall(PetscTime(&end));
  observed->xAx = PetscRealPart(xAx);
  observed->products++;
  observed->seconds += end - start;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatDestroy_Observed(Mat mat)
{
  Observed *observed;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &observed));
  PetscCall(MatDestroy(&observed->A));
  delete observed;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthObservedCreate(Mat A, KSP ksp, Mat *mat)
{
  Observed    *observed;
  MatNullSpace nullspace;

  PetscFunctionBegin;
  observed      = new Observed();
  observed->ksp = ksp;
  PetscCall(AinsworthShare(A, &observed->A));
  PetscCall(AinsworthCreateShell(A, observed, mat));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT, (void (*)(void))MatMult_Observed));
  PetscCall(MatShellSetOperation(*mat, MATOP_DESTROY, (void (*)(void))MatDestroy_Observed));
  PetscCall(MatGetNullSpace(A, &nullspace));
  if (nullspace) PetscCall(MatSetNullSpace(*mat, nullspace));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthObservedGet(Mat mat, PetscInt *products, PetscReal *xAx, PetscLogDouble *seconds)
{
  Observed *observed;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &observed));
  *products = observed->products;
  *xAx      = observed->xAx;
  *seconds  = observed->seconds;
  PetscFunctionReturn(PETSC_SUCCESS);
}
