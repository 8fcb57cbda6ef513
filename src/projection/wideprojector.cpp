#include "wideprojector.h"
#include "../base/events.h"

PetscErrorCode AinsworthWideProjector::create(AinsworthProjector *proj, PetscInt vectors)
{
  PetscFunctionBegin;
  of    = proj;
  width = vectors;
  PetscCall(MatCreateMAIJ(proj->C, width, C.out()));
  if (proj->CW == proj->C) CW = C;
  else PetscCall(MatCreateMAIJ(proj->CW, width, CW.out()));
  PetscCall(AinsworthMultivectorCreate(proj->rowValues, width, values.out()));
  PetscCall(VecDuplicate(values, solution.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthWideProjector::project(bool adjoint, Vec x) const
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, of->C, x, x, 0));
  PetscCall(MatMult(adjoint ? CW : C, x, values));
  PetscCall(AinsworthMultivectorForEach(values, width, solution, of->rowValues, of->rowSolution,
                                        [this](Vec b, Vec y) { return AinsworthGramSolve(&of->gram, b, y); }));
  PetscCall(VecScale(solution, -1.0));
  /* MATMAIJ has transposes alone: x + C' y is the conjugate of conj(x) + C^T conj(y) */
  PetscCall(VecConjugate(solution));
  PetscCall(VecConjugate(x));
  PetscCall(MatMultTransposeAdd(adjoint ? C : CW, solution, x, x));
  PetscCall(VecConjugate(x));
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, of->C, x, x, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
