/* Transfers between the program's vectors, which may be nested, and their parts */
#include "transfer.h"
#include "../base/loops.h"

/* Copies the local entries of a vector to one with as many, of any types; VecCopy() refuses nests with other vectors */
PetscErrorCode AinsworthVecCopyEntries(Vec from, Vec to)
{
  PetscFunctionBegin;
  PetscCall(AinsworthUpdate(to, {from}, [](PetscInt, PetscScalar &a, PetscScalar b) { a = b; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthTransferCreate - makes transfers between vectors like v and parts like those given. Collective */
PetscErrorCode AinsworthTransferCreate(Vec v, const AinsworthRef<IS> fields[2], Vec primal, Vec dual,
                                       AinsworthTransfer *t)
{
  const Vec parts[2] = {primal, dual};
  PetscBool in[2];
  PetscInt  first, last;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(v, &first, &last));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecDuplicate(parts[k], t->part[k].out()));
    t->field[k] = fields[k];
    PetscCall(ISContiguousLocal(fields[k], first, last, &t->offset[k], &in[k]));
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, in, 2, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)v)));
  for (int k = 0; k < 2; k++)
    if (!in[k]) t->offset[k] = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns whether part k of a vector is seen in place, which the separate arrays of a nest do not allow */
static PetscErrorCode IsInPlace(const AinsworthTransfer *t, int k, Vec v, PetscBool *place)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)v, VECNEST, place));
  *place = (PetscBool)(!*place && t->offset[k] >= 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies part k of v, or copies it back. Collective */
static PetscErrorCode Copy(const AinsworthTransfer *t, int k, Vec v, Vec part, ScatterMode mode)
{
  const Vec from = mode == SCATTER_FORWARD ? v : part, to = mode == SCATTER_FORWARD ? part : v;

  PetscFunctionBegin;
  if (!t->scatter[k]) PetscCall(VecScatterCreate(v, t->field[k], part, NULL, t->scatter[k].out()));
  PetscCall(VecScatterBegin(t->scatter[k], from, to, INSERT_VALUES, mode));
  PetscCall(VecScatterEnd(t->scatter[k], from, to, INSERT_VALUES, mode));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTransferIn - gives access to both fields of v in parts like those of t, until AinsworthTransferOut().
   Collective
*/
PetscErrorCode AinsworthTransferIn(const AinsworthTransfer *t, AinsworthAccess access, Vec v, AinsworthSaddleVec parts)
{
  const Vec part[2] = {parts.primal, parts.dual};

  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) {
    PetscBool    place;
    PetscScalar *a;

    PetscCall(IsInPlace(t, k, v, &place));
    if (place) {
      if (access == AINSWORTH_ACCESS_READ) PetscCall(VecGetArrayRead(v, (const PetscScalar **)&a));
      else PetscCall(VecGetArray(v, &a));
      PetscCall(VecPlaceArray(part[k], a + t->offset[k]));
    } else if (access != AINSWORTH_ACCESS_WRITE) PetscCall(Copy(t, k, v, part[k], SCATTER_FORWARD));
    if (access == AINSWORTH_ACCESS_READ) PetscCall(VecLockReadPush(part[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTransferOut - ends the access, and gives the entries to the vector if they may have changed. Collective

   failed: after an error, which other ranks may not have: nothing is copied, and nobody is waited for
*/
PetscErrorCode AinsworthTransferOut(const AinsworthTransfer *t, AinsworthAccess access, bool failed, Vec v,
                                    AinsworthSaddleVec parts)
{
  const Vec part[2] = {parts.primal, parts.dual};

  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) {
    PetscBool          place;
    const PetscScalar *seen;
    PetscScalar       *a;

    PetscCall(IsInPlace(t, k, v, &place));
    if (access == AINSWORTH_ACCESS_READ) PetscCall(VecLockReadPop(part[k]));
    if (place) {
      PetscCall(VecGetArrayRead(part[k], &seen));
      a = (PetscScalar *)seen - t->offset[k];
      PetscCall(VecRestoreArrayRead(part[k], &seen));
      PetscCall(VecResetArray(part[k]));
      if (access == AINSWORTH_ACCESS_READ) PetscCall(VecRestoreArrayRead(v, (const PetscScalar **)&a));
      else PetscCall(VecRestoreArray(v, &a));
    } else if (access != AINSWORTH_ACCESS_READ && !failed) PetscCall(Copy(t, k, v, part[k], SCATTER_REVERSE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
