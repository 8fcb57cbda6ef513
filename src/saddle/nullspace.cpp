#include "saddle.h"

/* The near null space of A, attached to A or, as for PCFIELDSPLIT, to the index set of its field; NULL if none; not to be destroyed */
PetscErrorCode AinsworthSaddleGetNearNullSpace(const AinsworthSaddle *sp, MatNullSpace *near)
{
  PetscFunctionBegin;
  PetscCall(MatGetNearNullSpace(sp->block[0], near));
  if (!*near) PetscCall(PetscObjectQuery((PetscObject)sp->rows[0], "nearnullspace", (PetscObject *)near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleCreateNullSpace - the part of the null space of A that is also in Ker C, NULL if there is none

   What C holds is no null space of the reduced operator. Each vector v is reduced, with its image C v, against the images
   found so far; the v whose image vanishes span Ker A and Ker C.
*/
PetscErrorCode AinsworthSaddleCreateNullSpace(const AinsworthSaddle *sp, MatNullSpace *common)
{
  MatNullSpace nullsp;
  PetscBool    constant;
  PetscInt     nv, nheld = 0, nfree = 0;
  const Vec   *given;
  Vec         *v, *image, *held, *heldImage;
  PetscReal    normC;
  Mat          C = sp->all ? sp->all : sp->C; /* eliminated rows hold a vector as well as those that are kept */

  PetscFunctionBegin;
  *common = NULL;
  PetscCall(MatGetNullSpace(sp->block[0], &nullsp));
  if (!nullsp) PetscCall(PetscObjectQuery((PetscObject)sp->rows[0], "nullspace", (PetscObject *)&nullsp));
  if (!nullsp) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNullSpaceGetVecs(nullsp, &constant, &nv, &given));
  PetscCall(MatNorm(C, NORM_FROBENIUS, &normC));
  PetscCall(PetscMalloc4(nv + 1, &v, nv + 1, &image, nv + 1, &held, nv + 1, &heldImage));
  for (PetscInt i = 0; i < nv + (constant ? 1 : 0); i++) {
    PetscReal   norm;
    PetscScalar alpha;

    PetscCall(MatCreateVecs(C, &v[nfree], &image[nfree]));
    if (i < nv) PetscCall(VecCopy(given[i], v[nfree]));
    else PetscCall(VecSet(v[nfree], 1.0));
    for (PetscInt k = 0; k < nfree; k++) {
      PetscCall(VecDot(v[nfree], v[k], &alpha));
      PetscCall(VecAXPY(v[nfree], -alpha, v[k]));
    }
    PetscCall(VecNormalize(v[nfree], NULL));
    PetscCall(MatMult(C, v[nfree], image[nfree]));
    for (PetscInt k = 0; k < nheld; k++) {
      PetscCall(VecDot(image[nfree], heldImage[k], &alpha));
      PetscCall(VecAXPY(image[nfree], -alpha, heldImage[k]));
      PetscCall(VecAXPY(v[nfree], -alpha, held[k]));
    }
    PetscCall(VecNorm(image[nfree], NORM_2, &norm));
    if (norm <= PETSC_SQRT_MACHINE_EPSILON * normC) {
      PetscCall(VecDestroy(&image[nfree]));
      PetscCall(VecNormalize(v[nfree], NULL));
      nfree++;
    } else {
      PetscCall(VecScale(v[nfree], 1.0 / norm));
      PetscCall(VecScale(image[nfree], 1.0 / norm));
      held[nheld]        = v[nfree];
      heldImage[nheld++] = image[nfree];
    }
  }
  if (nfree) {
    for (PetscInt i = 0; i < nfree; i++) { /* combinations with the held vectors are no longer orthogonal to the earlier ones */
      for (PetscInt k = 0; k < i; k++) {
        PetscScalar alpha;
        PetscCall(VecDot(v[i], v[k], &alpha));
        PetscCall(VecAXPY(v[i], -alpha, v[k]));
      }
      PetscCall(VecNormalize(v[i], NULL));
    }
    PetscCall(MatNullSpaceCreate(PetscObjectComm((PetscObject)sp->A), PETSC_FALSE, nfree, v, common));
  }
  for (PetscInt i = 0; i < nfree; i++) PetscCall(VecDestroy(&v[i]));
  for (PetscInt i = 0; i < nheld; i++) {
    PetscCall(VecDestroy(&held[i]));
    PetscCall(VecDestroy(&heldImage[i]));
  }
  PetscCall(PetscFree4(v, image, held, heldImage));
  PetscFunctionReturn(PETSC_SUCCESS);
}
