#include "activeset.h"
#include "report.h"

struct Contact {
  Mat J; /* [A C'; -C 0] */
  Vec b; /* (f, -g) */
};

static PetscErrorCode ContactFunction(SNES, Vec X, Vec F, void *ctx)
{
  const Contact *c = (const Contact *)ctx;

  PetscFunctionBeginUser;
  PetscCall(MatMult(c->J, X, F));
  PetscCall(VecAXPY(F, -1.0, c->b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The Jacobian does not change */
static PetscErrorCode ContactJacobian(SNES, Vec, Mat, Mat, void *)
{
  PetscFunctionBeginUser;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ContactCreate(const CubesSystem &s, Contact *c)
{
  Mat blocks[4] = {s.A, NULL, NULL, NULL};
  IS  is[2];

  PetscFunctionBeginUser;
  PetscCall(PetscDefined(USE_COMPLEX) ? MatCreateHermitianTranspose(s.C, &blocks[1])
                                      : MatCreateTranspose(s.C, &blocks[1]));
  PetscCall(MatDuplicate(s.C, MAT_COPY_VALUES, &blocks[2]));
  PetscCall(MatScale(blocks[2], -1.0));
  PetscCall(MatCreateNest(s.mesh.comm, 2, NULL, 2, NULL, blocks, &c->J));
  PetscCall(MatDestroy(&blocks[1]));
  PetscCall(MatDestroy(&blocks[2]));
  PetscCall(MatCreateVecs(c->J, NULL, &c->b));
  PetscCall(MatNestGetISs(c->J, is, NULL));
  PetscCall(VecISCopy(c->b, is[1], SCATTER_FORWARD, s.g));
  PetscCall(VecScale(c->b, -1.0));
  PetscCall(VecISCopy(c->b, is[0], SCATTER_FORWARD, s.f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* lambda <= 0 is C x >= g */
static PetscErrorCode SetBounds(const Contact &c, SNES snes)
{
  Vec lower, upper;
  IS  is[2];

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(c.b, &lower));
  PetscCall(VecDuplicate(c.b, &upper));
  PetscCall(VecSet(lower, PETSC_NINFINITY));
  PetscCall(VecSet(upper, PETSC_INFINITY));
  PetscCall(MatNestGetISs(c.J, is, NULL));
  PetscCall(VecISSet(upper, is[1], 0.0));
  PetscCall(SNESVISetVariableBounds(snes, lower, upper));
  PetscCall(VecDestroy(&lower));
  PetscCall(VecDestroy(&upper));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ActiveSetSolve(const CubesSystem &s, PetscBool fresh, Vec x, ActiveSetResult *result)
{
  Contact             c;
  SNES                snes;
  Vec                 X, F;
  IS                  is[2];
  SNESConvergedReason reason;

  PetscFunctionBeginUser;
  *result = ActiveSetResult();
  PetscCall(ContactCreate(s, &c));
  PetscCall(VecDuplicate(c.b, &X));
  PetscCall(VecDuplicate(c.b, &F));
  PetscCall(VecSet(X, 0.0));
  PetscCall(SNESCreate(s.mesh.comm, &snes));
  PetscCall(SNESSetFunction(snes, F, ContactFunction, &c));
  PetscCall(SNESSetJacobian(snes, c.J, c.J, ContactJacobian, NULL));
  PetscCall(SetBounds(c, snes));
  PetscCall(SNESMonitorSet(snes, ReportCount, &result->iterations, NULL));
  PetscCall(SNESSetFromOptions(snes));
  if (fresh) PetscCall(SNESSetUpdate(snes, ReportForget));
  result->seconds = -ReportProcessor();
  PetscCall(SNESSolve(snes, NULL, X));
  result->seconds += ReportProcessor();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &result->seconds, 1, MPI_DOUBLE, MPI_SUM, s.mesh.comm));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  PetscCall(SNESGetIterationNumber(snes, &result->steps));
  result->converged = reason > 0 ? PETSC_TRUE : PETSC_FALSE;
  PetscCall(MatNestGetISs(c.J, is, NULL));
  PetscCall(VecISCopy(X, is[0], SCATTER_REVERSE, x));
  PetscCall(SNESDestroy(&snes));
  for (Vec *v : {&X, &F, &c.b}) PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&c.J));
  PetscFunctionReturn(PETSC_SUCCESS);
}
