/* A VECNEST as a plain vector: PETSc gives the parts of a nest, but not those of a field that several of them make up */
#include "saddle.h"
#include <petsc/private/petscimpl.h>

/* From the parts of v, and theirs, into flat one after the other, or back; on return flat is behind them */
static PetscErrorCode CopyParts(Vec v, PetscBool back, PetscScalar **flat)
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
    for (PetscInt i = 0; i < n; i++) PetscCall(CopyParts(part[i], back, flat));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetLocalSize(v, &n));
  if (back) {
    PetscCall(VecGetArrayWrite(v, &to));
    PetscCall(PetscArraycpy(to, *flat, n));
    PetscCall(VecRestoreArrayWrite(v, &to));
  } else {
    PetscCall(VecGetArrayRead(v, &from));
    PetscCall(PetscArraycpy(*flat, from, n));
    PetscCall(VecRestoreArrayRead(v, &from));
  }
  *flat += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Copy(Vec v, PetscBool back, Vec flat)
{
  PetscScalar *a, *end;

  PetscFunctionBegin;
  PetscCall(VecGetArray(flat, &a));
  end = a;
  PetscCall(CopyParts(v, back, &end));
  PetscCall(VecRestoreArray(flat, &a));
  if (back) PetscCall(PetscObjectStateIncrease((PetscObject)v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthVecGetFlat - v, or a plain vector with the entries of a VECNEST; to be restored */
PetscErrorCode AinsworthVecGetFlat(Vec v, Vec *flat)
{
  PetscBool nest;
  PetscInt  n;

  PetscFunctionBegin;
  *flat = v;
  PetscCall(PetscObjectTypeCompare((PetscObject)v, VECNEST, &nest));
  if (!nest) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(v, &n));
  PetscCall(VecCreateMPI(PetscObjectComm((PetscObject)v), n, PETSC_DETERMINE, flat));
  PetscCall(Copy(v, PETSC_FALSE, *flat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthVecRestoreFlat - written: the entries of flat become those of v */
PetscErrorCode AinsworthVecRestoreFlat(Vec v, PetscBool written, Vec *flat)
{
  PetscFunctionBegin;
  if (*flat == v) {
    *flat = NULL;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (written) PetscCall(Copy(v, PETSC_TRUE, *flat));
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
  PetscCall(AinsworthVecGetFlat(given, diagonal));
  if (*diagonal != given) PetscCall(VecDestroy(&given));
  PetscFunctionReturn(PETSC_SUCCESS);
}
