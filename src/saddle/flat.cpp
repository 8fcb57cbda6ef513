/* Plain vectors for VECNESTs: PETSc extracts single parts of a nest, but not a field made of several parts */
#include "saddle.h"
#include "../objects.h"
#include <numeric>
#include <vector>

/*
   Finds the places of the entries of v among those of the vectors of mat (left ones if rows), which have the numbers `place`

   The index sets of a MatNest determine the places; they need not be in the order of its blocks. A v without this structure is taken in order.
*/
static PetscErrorCode FindPlaces(Mat mat, PetscBool rows, Vec v, const PetscInt place[], std::vector<PetscInt> *places)
{
  PetscBool nest, nested = PETSC_FALSE;
  PetscInt  n, nr = 0, nc = 0, first, at = 0;
  Vec      *part;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)v, VECNEST, &nest));
  if (!nest) {
    PetscCall(VecGetLocalSize(v, &n));
    places->insert(places->end(), place, place + n);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecNestGetSubVecs(v, &n, &part));
  if (mat) PetscCall(PetscObjectTypeCompare((PetscObject)mat, MATNEST, &nested));
  if (nested) PetscCall(MatNestGetSize(mat, &nr, &nc));
  std::vector<IS> sets((size_t)(rows ? nr : nc));
  if (nested) PetscCall(MatNestGetISs(mat, rows ? sets.data() : NULL, rows ? NULL : sets.data()));
  if (nested) PetscCall(rows ? MatGetOwnershipRange(mat, &first, NULL) : MatGetOwnershipRangeColumn(mat, &first, NULL));
  for (PetscInt i = 0; i < n; i++) {
    PetscInt              local;
    Mat                   block = NULL;
    std::vector<PetscInt> inner;

    PetscCall(VecGetLocalSize(part[i], &local));
    if ((PetscInt)sets.size() == n) {
      const PetscInt *index;

      PetscCall(ISGetIndices(sets[i], &index));
      for (PetscInt k = 0; k < local; k++) inner.push_back(place[index[k] - first]);
      PetscCall(ISRestoreIndices(sets[i], &index));
      for (PetscInt j = 0; j < (rows ? nc : nr) && !block; j++) PetscCall(MatNestGetSubMat(mat, rows ? i : j, rows ? j : i, &block));
    } else inner.assign(place + at, place + at + local);
    at += local;
    PetscCall(FindPlaces(block, rows, part[i], inner.data(), places));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the parts of v to their places in flat, or back; advances `place` */
static PetscErrorCode CopyParts(Vec v, PetscBool back, const PetscInt **place, PetscScalar flat[])
{
  PetscBool          nest;
  PetscInt           n;
  PetscScalar       *to;
  const PetscScalar *from;
  Vec               *part;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)v, VECNEST, &nest));
  if (nest) {
    PetscCall(VecNestGetSubVecs(v, &n, &part));
    for (PetscInt i = 0; i < n; i++) PetscCall(CopyParts(part[i], back, place, flat));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetLocalSize(v, &n));
  if (back) {
    PetscCall(VecGetArrayWrite(v, &to));
    for (PetscInt k = 0; k < n; k++) to[k] = flat[(*place)[k]];
    PetscCall(VecRestoreArrayWrite(v, &to));
  } else {
    PetscCall(VecGetArrayRead(v, &from));
    for (PetscInt k = 0; k < n; k++) flat[(*place)[k]] = from[k];
    PetscCall(VecRestoreArrayRead(v, &from));
  }
  *place += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Copy(Mat mat, PetscBool rows, Vec v, PetscBool back, Vec flat)
{
  PetscScalar          *a;
  PetscInt              n;
  std::vector<PetscInt> all, places;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(flat, &n));
  all.resize(n);
  std::iota(all.begin(), all.end(), 0);
  PetscCall(FindPlaces(mat, rows, v, all.data(), &places));
  const PetscInt *place = places.data();

  PetscCall(VecGetArray(flat, &a));
  PetscCall(CopyParts(v, back, &place, a));
  PetscCall(VecRestoreArray(flat, &a));
  if (back) PetscCall(AinsworthStateIncrease((PetscObject)v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthVecGetFlat - gets v itself or, for a VECNEST, a plain copy in the numbering of the rows or columns of mat; to be restored. Collective */
PetscErrorCode AinsworthVecGetFlat(Mat mat, PetscBool rows, Vec v, Vec *flat)
{
  PetscBool nest;
  PetscInt  n;

  PetscFunctionBegin;
  *flat = v;
  PetscCall(PetscObjectTypeCompare((PetscObject)v, VECNEST, &nest));
  if (!nest) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(v, &n));
  PetscCall(VecCreateMPI(PetscObjectComm((PetscObject)v), n, PETSC_DETERMINE, flat));
  PetscCall(Copy(mat, rows, v, PETSC_FALSE, *flat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthVecRestoreFlat - restores a vector from AinsworthVecGetFlat(); written: copies its entries back to v */
PetscErrorCode AinsworthVecRestoreFlat(Mat mat, PetscBool rows, Vec v, PetscBool written, Vec *flat)
{
  PetscFunctionBegin;
  if (*flat == v) {
    *flat = NULL;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (written) PetscCall(Copy(mat, rows, v, PETSC_TRUE, *flat));
  PetscCall(VecDestroy(flat));
  PetscFunctionReturn(PETSC_SUCCESS);
}
