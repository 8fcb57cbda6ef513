#include "wideprojector.h"
#include "../base/events.h"

PetscErrorCode AinsworthWideProjector::create(AinsworthProjector *proj, PetscInt vectors)
{
  PetscFunctionBegin;
  of      = proj;
  width   = vectors;
  surface = proj->surface;
  PetscCall(AinsworthMultivectorCreate(proj->rowValues, width, values.out()));
  PetscCall(VecDuplicate(values, solution.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthWideProjector::project(bool adjoint, Vec x) const
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, of->C, x, x, 0));
  PetscCall(surface->change(width, x, [&](PetscScalar v[]) {
    PetscScalar *y;

    PetscFunctionBegin;
    PetscCall(VecGetArrayWrite(values, &y));
    if (adjoint) PetscCall(surface->multiplyWeighted(width, v, y, NULL));
    else PetscCall(surface->multiply(width, v, y));
    PetscCall(VecRestoreArrayWrite(values, &y));
    PetscCall(AinsworthMultivectorForEach(values, width, solution, of->rowValues, of->rowSolution,
                                          [this](Vec b, Vec z) { return AinsworthGramSolve(&of->gram, b, z); }));
    PetscCall(VecScale(solution, -1.0));
    PetscCall(VecGetArray(solution, &y));
    if (adjoint) PetscCall(surface->spread(width, y, v));
    else PetscCall(surface->spreadWeighted(width, y, NULL, v));
    PetscCall(VecRestoreArray(solution, &y));
    PetscFunctionReturn(PETSC_SUCCESS);
  }));
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, of->C, x, x, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
