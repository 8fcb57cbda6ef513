#include "source.h"
#include <petsc/private/petscimpl.h>

/* Rounding of the sums by which an entry of A, or of a mode, is made in another order each time, relative to the diagonal and to the modes */
static const PetscReal rounding = 64 * PETSC_MACHINE_EPSILON;

/* y = A x of random numbers, the same whenever x has the same layout; collective */
static PetscErrorCode GetImage(Mat A, std::vector<PetscScalar> *image)
{
  Vec                x, y;
  PetscInt           n;
  const PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(A, &x, &y));
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

/* One number of all entries that this rank has of the near null space, NULL for none, and the sum of the magnitudes that are in it */
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

/* The objects at hand, which the next time need not be looked at if they are the same */
PetscErrorCode AinsworthSource::identify(Mat A, MatNullSpace near)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)A, &id));
  PetscCall(PetscObjectStateGet((PetscObject)A, &state));
  modesId = 0;
  if (near) PetscCall(PetscObjectGetId((PetscObject)near, &modesId));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All that holds() compares with; collective */
PetscErrorCode AinsworthSource::take(Mat A, MatNullSpace near)
{
  PetscFunctionBegin;
  PetscCall(identify(A, near));
  PetscCall(GetImage(A, &image));
  PetscCall(GetDigest(near, &modes, &modesSize));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Has A the values, but for rounding, and the near null space that it had, or at least (fits) the size? diagonal: its own, then; collective */
PetscErrorCode AinsworthSource::holds(Mat A, MatNullSpace near, const std::vector<PetscReal> &diagonal, PetscBool *same, PetscBool *fits) const
{
  MPI_Comm        comm = PetscObjectComm((PetscObject)A);
  AinsworthSource now;
  PetscInt        n;
  PetscBool       answer[2]; /* the same objects, the same sizes */

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
  *same = (PetscBool)(PetscAbsScalar(now.modes - modes) <= rounding * modesSize);
  for (size_t i = 0; i < image.size(); i++)
    if (!(PetscAbsScalar(now.image[i] - image[i]) <= rounding * diagonal[i])) *same = PETSC_FALSE;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, same, 1, AINSWORTH_MPI_BOOL, MPI_LAND, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
