#include "fingerprint.h"
#include "../base/layouts.h"

/*
   Differences if entries of A and of the modes are summed in another order each time, relative to the diagonal
   and to the modes
*/
static const PetscReal reordered = 64 * PETSC_MACHINE_EPSILON;

/* Computes the product of A with a random vector, the same for all vectors with the same layout. Collective */
static PetscErrorCode GetImage(Mat A, std::vector<PetscScalar> *image)
{
  Vec                x, y;
  PetscInt           n;
  const PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(A, &x, &y));
  PetscCall(VecSetRandom(x, NULL));
  PetscCall(MatMult(A, x, y));
  PetscCall(VecGetLocalSize(y, &n));
  PetscCall(VecGetArrayRead(y, &a));
  image->assign(a, a + n);
  PetscCall(VecRestoreArrayRead(y, &a));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes a weighted sum of the local entries of the near null space, which may be NULL, and of their magnitudes */
static PetscErrorCode GetDigest(MatNullSpace near, PetscScalar *digest, PetscReal *size)
{
  PetscBool  constant;
  PetscInt   n = 0;
  const Vec *v;

  PetscFunctionBegin;
  *digest = 0.0;
  *size   = 0.0;
  if (!near) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNullSpaceGetVecs(near, &constant, &n, &v));
  if (constant) *digest = 1.0;
  for (PetscInt k = 0; k < n; k++) {
    const PetscScalar *a;
    PetscInt           local;

    PetscCall(VecGetLocalSize(v[k], &local));
    PetscCall(VecGetArrayRead(v[k], &a));
    for (PetscInt i = 0; i < local; i++) {
      const PetscReal factor = (PetscReal)((37 * k + i) % 1009 + 1);

      *digest += a[i] * factor;
      *size += PetscAbsScalar(a[i]) * factor;
    }
    PetscCall(VecRestoreArrayRead(v[k], &a));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Records the objects and their state: if these are the same the next time, values need not be compared */
PetscErrorCode AinsworthFingerprint::identify(Mat A, MatNullSpace near)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)A, &id));
  PetscCall(PetscObjectStateGet((PetscObject)A, &state));
  modesId = 0;
  if (near) PetscCall(PetscObjectGetId((PetscObject)near, &modesId));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Records everything that holds() compares. Collective */
PetscErrorCode AinsworthFingerprint::take(Mat A, MatNullSpace near)
{
  PetscFunctionBegin;
  PetscCall(identify(A, near));
  PetscCall(GetImage(A, &image));
  PetscCall(GetDigest(near, &modes, &modesSize));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether A has the same values up to rounding and the same near null space, or at least (fits) the same size.
   Collective

   diagonal: the diagonal of the recorded A
*/
PetscErrorCode AinsworthFingerprint::holds(Mat A, MatNullSpace near, const std::vector<PetscReal> &diagonal,
                                           PetscBool *same, PetscBool *fits) const
{
  MPI_Comm             comm = PetscObjectComm((PetscObject)A);
  AinsworthFingerprint now;
  PetscInt             n;
  PetscBool            answer[2]; /* the same objects, the same sizes */

  PetscFunctionBegin;
  PetscCall(now.identify(A, near));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  answer[0] = (PetscBool)(now.id == id && now.state == state && now.modesId == modesId);
  answer[1] = (PetscBool)((size_t)n == image.size());
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, answer, 2, AINSWORTH_MPI_BOOL, MPI_LAND, comm));
  *same = answer[0];
  *fits = answer[1];
  if (*same || !answer[1]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(now.take(A, near));
  *same = (PetscBool)(PetscAbsScalar(now.modes - modes) <= reordered * modesSize);
  for (size_t i = 0; i < image.size(); i++)
    if (!(PetscAbsScalar(now.image[i] - image[i]) <= reordered * diagonal[i])) *same = PETSC_FALSE;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, same, 1, AINSWORTH_MPI_BOOL, MPI_LAND, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
