#include "surface.h"
#include "../base/events.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../saddle/saddle.h"

AinsworthSurface::~AinsworthSurface()
{
  for (Mat *M : {&sides.C, &sides.CW, &sides.own}) (void)MatDestroy(M);
  (void)VecDestroy(&values);
}

/*
   AinsworthSurfaceSetUp - sets up the projectors of an empty surface for B = C. Collective

   sides: placed, with S = C W C' of the projector, which has them if D = 0; weight: diagonal of W
*/
PetscErrorCode AinsworthSurfaceSetUp(AinsworthSurface *surface, AinsworthProjector *projector,
                                     const AinsworthProjectorSides &sides, Vec weight)
{
  const Mat C = sides.C;
  IS        rows, columns;
  Vec       counts;
  PetscInt  rstart, first, last;

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
  PetscCall(MatCreateSubMatrix(C, rows, columns, MAT_INITIAL_MATRIX, &surface->sides.C));
  if (sides.CW == C) PetscCall(AinsworthShare(surface->sides.C, &surface->sides.CW));
  else PetscCall(MatCreateSubMatrix(sides.CW, rows, columns, MAT_INITIAL_MATRIX, &surface->sides.CW));
  if (sides.own) PetscCall(MatCreateSubMatrix(sides.own, rows, columns, MAT_INITIAL_MATRIX, &surface->sides.own));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&columns));
  PetscCall(MatCreateVecs(surface->sides.C, &surface->values, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSurfaceProject - replaces the values of x at the places by those of Q x or, if adjoint, of Q' x */
PetscErrorCode AinsworthSurfaceProject(const AinsworthSurface *surface, bool adjoint, Vec x)
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorSubtract(surface->projector, surface->sides, adjoint, x, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
