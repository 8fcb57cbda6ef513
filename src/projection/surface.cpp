#include "surface.h"
#include "shared.h"
#include "../base/events.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../saddle/saddle.h"

AinsworthSurface::~AinsworthSurface()
{
  for (Mat *M : {&sides.C, &sides.CW, &sides.own}) (void)MatDestroy(M);
  (void)VecDestroy(&values);
}

/* Scales the columns of the surface's C by the values of a vector at its places. Collective */
static PetscErrorCode WeighAt(const AinsworthSurface *surface, Vec weight, Mat *weighted)
{
  const PetscScalar *w;
  PetscScalar       *at;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(weight, &w));
  PetscCall(VecGetArrayWrite(surface->values, &at));
  for (size_t k = 0; k < surface->places.size(); k++) at[k] = w[surface->places[k]];
  PetscCall(VecRestoreArrayWrite(surface->values, &at));
  PetscCall(VecRestoreArrayRead(weight, &w));
  PetscCall(AinsworthWeigh(surface->sides.C, surface->values, weighted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSurfaceSetUp - sets up the projectors of an empty surface for B = C. Collective

   C: placed, with S = C W C' of the projector, which has it if D = 0; weight: diagonal of W. own: diagonal of W_p; NULL
   without a polynomial
*/
PetscErrorCode AinsworthSurfaceSetUp(AinsworthSurface *surface, AinsworthProjector *projector, Mat C, Vec weight,
                                     Vec own)
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
  PetscCall(MatCreateSubMatrix(C, rows, columns, MAT_INITIAL_MATRIX, &surface->sides.C));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&columns));
  PetscCall(AinsworthCreateVecs(surface->sides.C, &surface->values, NULL));
  PetscCall(WeighAt(surface, weight, &surface->sides.CW));
  if (own) PetscCall(WeighAt(surface, own, &surface->sides.own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSurfaceProject - replaces the values of x at the places by those of Q x or, if adjoint, of Q' x */
PetscErrorCode AinsworthSurfaceProject(const AinsworthSurface *surface, bool adjoint, Vec x)
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorSubtract(surface->projector, surface->sides, adjoint, x, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
