#include "surface.h"
#include "../base/events.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../saddle/saddle.h"

AinsworthSurface::~AinsworthSurface()
{
  (void)MatDestroy(&C);
  (void)MatDestroy(&CW);
  (void)VecDestroy(&values);
}

/*
   AinsworthSurfaceSetUp - sets up the projectors of an empty surface for B = C. Collective

   C, CW: placed C and C W with S = C W C' of the projector, which has them if D = 0; weight: diagonal of W
*/
PetscErrorCode AinsworthSurfaceSetUp(AinsworthSurface *surface, AinsworthProjector *projector, Mat C, Mat CW,
                                     Vec weight)
{
  IS       rows, columns;
  Vec      counts;
  PetscInt rstart, first, last;

  PetscFunctionBegin;
  surface->projector = projector;
  PetscCall(AinsworthCountRows(C, 0, &counts));
  PetscCall(VecGetOwnershipRange(counts, &rstart, NULL));
  PetscCall(AinsworthForEntries({counts, weight}, [&](PetscInt i, PetscScalar count, PetscScalar w) {
    if (count == 0.0) return;
    surface->places.push_back(i);
    surface->weight.push_back(PetscRealPart(w));
  }));
  PetscCall(VecDestroy(&counts));
  std::vector<PetscInt> global(surface->places);
  for (PetscInt &i : global) i += rstart;
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)C), (PetscInt)global.size(), global.data(), PETSC_COPY_VALUES,
                            &columns));
  PetscCall(MatGetOwnershipRange(C, &first, &last));
  PetscCall(ISCreateStride(PetscObjectComm((PetscObject)C), last - first, first, 1, &rows));
  PetscCall(MatCreateSubMatrix(C, rows, columns, MAT_INITIAL_MATRIX, &surface->C));
  if (CW == C) PetscCall(AinsworthShare(surface->C, &surface->CW));
  else PetscCall(MatCreateSubMatrix(CW, rows, columns, MAT_INITIAL_MATRIX, &surface->CW));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&columns));
  PetscCall(MatCreateVecs(surface->C, &surface->values, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSurfaceProject - replaces the values of x at the places by those of Q x or, if adjoint, of Q' x */
PetscErrorCode AinsworthSurfaceProject(const AinsworthSurface *surface, bool adjoint, Vec x)
{
  AinsworthProjector *proj = surface->projector;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Projector, proj->C, x, x, 0));
  PetscCall(MatMult(adjoint ? surface->CW : surface->C, x, proj->rowValues));
  PetscCall(AinsworthGramSolve(&proj->gram, proj->rowValues, proj->rowSolution));
  PetscCall(VecScale(proj->rowSolution, -1.0));
  PetscCall(MatMultHermitianTransposeAdd(adjoint ? surface->C : surface->CW, proj->rowSolution, x, x));
  PetscCall(PetscLogEventEnd(AINSWORTH_Projector, proj->C, x, x, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
