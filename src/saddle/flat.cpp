/* A VECNEST as a plain vector: PETSc gives the parts of a nest, but not those of a field that several of them make up */
#include "saddle.h"
#include <petsc/private/petscimpl.h>
#include <numeric>
#include <vector>

/*
   Where the entries of v stand among `place`, those of the vectors of mat; rows: of its left ones. The index sets of a MatNest say it, which need not be in the
   order of its blocks. A v that is not made like them is taken in order.
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

/* From the parts of v, and theirs, to their places in flat, or back; on return place is behind them */
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
  if (back) PetscCall(PetscObjectStateIncrease((PetscObject)v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthVecGetFlat - v, or a plain vector with the entries of a VECNEST in the numbering of mat, that of its rows or columns; to be restored */
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

/* AinsworthVecRestoreFlat - written: the entries of flat become those of v */
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

/* AinsworthCreateDiagonal - the diagonal of any matrix, of a MatNest with vectors that are nests, too */
PetscErrorCode AinsworthCreateDiagonal(Mat mat, Vec *diagonal)
{
  Vec given;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(mat, NULL, &given));
  PetscCall(AinsworthGetDiagonal(mat, given));
  PetscCall(AinsworthVecGetFlat(mat, PETSC_TRUE, given, diagonal));
  if (*diagonal != given) PetscCall(VecDestroy(&given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthVecGather - the n entries of v at global places that this rank asks for, as a sequential vector; collective */
PetscErrorCode AinsworthVecGather(Vec v, PetscInt n, const PetscInt places[], Vec *here)
{
  IS         from;
  VecScatter scatter;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, places, PETSC_USE_POINTER, &from));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, n, here));
  PetscCall(VecScatterCreate(v, from, *here, NULL, &scatter));
  PetscCall(VecScatterBegin(scatter, v, *here, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, v, *here, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(ISDestroy(&from));
  PetscFunctionReturn(PETSC_SUCCESS);
}
