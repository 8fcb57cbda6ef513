/* One number for a matrix and all that it is made of, which changes with any of them */
#include "saddle.h"
#include "../base/objects.h"

/*
   Mixes the ids and states of M and of its parts into a state; ids, because addresses may be reused. A view is
   represented by the matrix that it shows
*/
static PetscErrorCode AddState(Mat M, uint64_t *state)
{
  Mat              part;
  MatNullSpace     nullsp;
  PetscObjectId    id;
  PetscObjectState own;
  PetscInt         nr = 0, nc = 0;
  PetscBool        hermitian, nest, composite;

  PetscFunctionBegin;
  if (!M) {
    *state = AinsworthMixState(*state, 0);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthGetTransposed(M, &part, &hermitian));
  if (part) {
    *state = AinsworthMixState(*state, hermitian ? 2 : 1);
    PetscCall(AddState(part, state));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscObjectGetId((PetscObject)M, &id));
  PetscCall(PetscObjectStateGet((PetscObject)M, &own));
  *state = AinsworthMixState(AinsworthMixState(*state, (uint64_t)id), (uint64_t)own);
  PetscCall(MatGetNullSpace(M, &nullsp));
  if (nullsp) {
    PetscCall(PetscObjectGetId((PetscObject)nullsp, &id));
    *state = AinsworthMixState(*state, (uint64_t)id);
  }
  PetscCall(PetscObjectTypeCompare((PetscObject)M, MATNEST, &nest));
  PetscCall(PetscObjectTypeCompare((PetscObject)M, MATCOMPOSITE, &composite));
  if (nest) PetscCall(MatNestGetSize(M, &nr, &nc));
  for (PetscInt i = 0; i < nr; i++) {
    for (PetscInt j = 0; j < nc; j++) {
      PetscCall(MatNestGetSubMat(M, i, j, &part));
      PetscCall(AddState(part, state));
    }
  }
  if (composite) PetscCall(MatCompositeGetNumberMat(M, &nr));
  for (PetscInt i = 0; i < nr && composite; i++) {
    PetscCall(MatCompositeGetMat(M, i, &part));
    PetscCall(AddState(part, state));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthMatGetState - computes one number for M, its state and everything that it is made of; 0 if M is NULL

   PETSc does not tell a matrix that one of its parts has changed in place. If this happened since the last call, the
   state of M is increased here, so that everything cached with M (norm, symmetry, levels of multigrid) is recomputed.
*/
PetscErrorCode AinsworthMatGetState(Mat M, uint64_t *state)
{
  static const char name[] = "AinsworthState";
  uint64_t          last;
  PetscBool         parts, known;

  PetscFunctionBegin;
  *state = 0;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AddState(M, state));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)M, &parts, MATNEST, MATCOMPOSITE, ""));
  if (!parts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthRecall((PetscObject)M, name, &last, &known));
  if (known && last == *state) PetscFunctionReturn(PETSC_SUCCESS);
  if (known) {
    PetscCall(AinsworthStateIncrease((PetscObject)M));
    *state = 0;
    PetscCall(AddState(M, state));
  }
  PetscCall(AinsworthRemember((PetscObject)M, name, *state));
  PetscFunctionReturn(PETSC_SUCCESS);
}
