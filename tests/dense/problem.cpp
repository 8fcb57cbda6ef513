#include "problem.h"

int products = 0, preconditioned = 0;

static PetscErrorCode CountedMult(Mat shell, Vec x, Vec y)
{
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(shell, &A));
  products++;
  PetscCall(MatMult(A, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CountedApply(PC pc, Vec x, Vec y)
{
  PetscReal *factor;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &factor));
  preconditioned++;
  PetscCall(VecCopy(x, y));
  PetscCall(VecScale(y, *factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ProblemCreate(const Spec &spec, bool counted, Problem *p)
{
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &p->sys));
  PetscCall(Gather(p->sys, p->d));
  if (counted) {
    PetscCall(ShellCreate(p->sys.A, true, false, &p->shell));
    PetscCall(MatShellSetOperation(p->shell, MATOP_MULT, (void (*)(void))CountedMult));
  }
  PetscCall(MatCreateAinsworth(counted ? p->shell : p->sys.A, p->sys.C, &p->S));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &p->ksp));
  PetscCall(KSPSetType(p->ksp, KSPPROJECTEDCG));
  PetscCall(KSPSetOperators(p->ksp, p->S, p->sys.A));
  PetscCall(KSPGetPC(p->ksp, &pc));
  PetscCall(PCSetType(pc, PCJACOBI));
  PetscCall(KSPSetTolerances(p->ksp, 1e-13, PETSC_DEFAULT, PETSC_DEFAULT, 1000));
  PetscCall(KSPSetFromOptions(p->ksp));
  PetscCall(VecDuplicate(p->sys.f, &p->b));
  PetscCall(VecDuplicate(p->sys.f, &p->x));
  PetscCall(SetRandom(p->b, 40));
  p->reduced = ReducedOperator(p->d.A, p->d.C, DenseProjector(p->d.C, DiagonalWeight(p->d.A)).Q, RowPenalty(p->d.A, p->d.C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ProblemDestroy(Problem *p)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&p->ksp));
  PetscCall(MatDestroy(&p->S));
  PetscCall(MatDestroy(&p->shell));
  PetscCall(VecDestroy(&p->b));
  PetscCall(VecDestroy(&p->x));
  PetscCall(SystemDestroy(&p->sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}
