/* Transfers between the program's vectors, which may be nested, and their parts */
#include "transfer.h"
#include "../base/loops.h"
#include "../base/objects.h"

/* Creates a plain vector with n local entries, of the type of v, or of the first plain one in it. Collective */
PetscErrorCode AinsworthVecCreatePlain(Vec v, PetscInt n, Vec *plain)
{
  VecType   type;
  PetscBool nest;

  PetscFunctionBegin;
  PetscCall(VecCreate(PetscObjectComm((PetscObject)v), plain));
  PetscCall(VecSetSizes(*plain, n, PETSC_DETERMINE));
  PetscCall(PetscObjectTypeCompare((PetscObject)v, VECNEST, &nest));
  while (nest) {
    PetscCall(VecNestGetSubVec(v, 0, &v));
    PetscCall(PetscObjectTypeCompare((PetscObject)v, VECNEST, &nest));
  }
  PetscCall(VecGetType(v, &type));
  PetscCall(VecSetType(*plain, type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the local entries of a vector to one with as many, of any types; VecCopy() refuses nests with other vectors */
PetscErrorCode AinsworthVecCopyEntries(Vec from, Vec to)
{
  PetscFunctionBegin;
  PetscCall(AinsworthUpdate(to, {from}, [](PetscInt, PetscScalar &a, PetscScalar b) { a = b; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTransferIn - copies both fields of a vector to its parts; call AinsworthTransferOut() afterwards. Collective

   write: the parts may be changed
*/
PetscErrorCode AinsworthTransferIn(AinsworthTransfer *t, const IS fields[2], PetscBool write, Vec v,
                                   AinsworthSaddleVec *parts)
{
  PetscFunctionBegin;
  if (t->given || t->fields[0] != fields[0] || t->fields[1] != fields[1]) { /* an error may have left a vector given */
    PetscCall(AinsworthTransferDestroy(t));
    for (int k = 0; k < 2; k++) {
      PetscInt n;

      PetscCall(AinsworthShare(fields[k], &t->fields[k]));
      PetscCall(ISGetLocalSize(fields[k], &n));
      PetscCall(AinsworthVecCreatePlain(v, n, &t->part[k]));
      PetscCall(VecScatterCreate(v, fields[k], t->part[k], NULL, &t->scatter[k]));
    }
  }
  t->given = v;
  t->write = write;
  for (int k = 0; k < 2; k++) {
    PetscCall(VecScatterBegin(t->scatter[k], v, t->part[k], INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecScatterEnd(t->scatter[k], v, t->part[k], INSERT_VALUES, SCATTER_FORWARD));
    if (!write) PetscCall(VecLockReadPush(t->part[k]));
  }
  *parts = {t->part[0], t->part[1]};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTransferOut - gives the parts back, and their entries to the vector if they may have been changed.
   Collective
*/
PetscErrorCode AinsworthTransferOut(AinsworthTransfer *t, AinsworthSaddleVec *parts)
{
  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) {
    if (t->write) {
      PetscCall(VecScatterBegin(t->scatter[k], t->part[k], t->given, INSERT_VALUES, SCATTER_REVERSE));
      PetscCall(VecScatterEnd(t->scatter[k], t->part[k], t->given, INSERT_VALUES, SCATTER_REVERSE));
    } else PetscCall(VecLockReadPop(t->part[k]));
  }
  t->given = NULL;
  *parts   = {NULL, NULL};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthTransferDestroy(AinsworthTransfer *t)
{
  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) {
    PetscCall(ISDestroy(&t->fields[k]));
    PetscCall(VecDestroy(&t->part[k]));
    PetscCall(VecScatterDestroy(&t->scatter[k]));
  }
  *t = AinsworthTransfer();
  PetscFunctionReturn(PETSC_SUCCESS);
}
