#include "coarsen.h"

/* The values of vectors, side by side; constant: the first one is 1 everywhere */
static PetscErrorCode FromNullSpace(MatNullSpace near, PetscInt n, AinsworthModes *modes)
{
  PetscBool  constant;
  PetscInt   nvec;
  const Vec *vec;

  PetscFunctionBegin;
  PetscCall(MatNullSpaceGetVecs(near, &constant, &nvec, &vec));
  const PetscInt first = constant ? 1 : 0;
  modes->k             = nvec + first;
  modes->values.assign((size_t)n * modes->k, 1.0);
  for (PetscInt c = 0; c < nvec; c++) {
    const PetscScalar *v;
    PetscInt           local;

    PetscCall(VecGetLocalSize(vec[c], &local));
    PetscCheck(local == n, PetscObjectComm((PetscObject)vec[c]), PETSC_ERR_ARG_SIZ,
               "Vector %" PetscInt_FMT " of the near null space has %" PetscInt_FMT " values on this rank, the matrix %" PetscInt_FMT
               " rows: attach one of the layout of the matrix with MatSetNearNullSpace()",
               c, local, n);
    PetscCall(VecGetArrayRead(vec[c], &v));
    for (PetscInt l = 0; l < n; l++) modes->values[(size_t)l * modes->k + first + c] = v[l];
    PetscCall(VecRestoreArrayRead(vec[c], &v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Translations and infinitesimal rotations about the center of all nodes; bs: 2 or 3, the dimension of space */
static PetscErrorCode FromCoordinates(MPI_Comm comm, PetscInt n, PetscInt bs, const PetscReal x[], AinsworthModes *modes)
{
  PetscReal center[4] = {0.0, 0.0, 0.0, (PetscReal)(n / bs)};

  PetscFunctionBegin;
  for (PetscInt l = 0; l < n; l++) center[l % bs] += x[l];
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, center, 4, MPIU_REAL, MPIU_SUM, comm));
  modes->k = bs == 2 ? 3 : 6;
  modes->values.assign((size_t)n * modes->k, 0.0);
  for (PetscInt node = 0; node < n / bs; node++) {
    PetscScalar *v    = &modes->values[(size_t)node * bs * modes->k];
    PetscReal    p[3] = {0.0, 0.0, 0.0};

    for (PetscInt c = 0; c < bs; c++) {
      p[c]                = x[node * bs + c] - center[c] / center[3];
      v[c * modes->k + c] = 1.0;
    }
    for (PetscInt a = 0, mode = bs; a < bs; a++)
      for (PetscInt b = a + 1; b < bs; b++, mode++) {
        v[a * modes->k + mode] = -p[b];
        v[b * modes->k + mode] = p[a];
      }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each component constant */
static void Translations(PetscInt n, PetscInt bs, AinsworthModes *modes)
{
  modes->k = bs;
  modes->values.assign((size_t)n * bs, 0.0);
  for (PetscInt l = 0; l < n; l++) modes->values[(size_t)l * bs + l % bs] = 1.0;
}

/*
   AinsworthModesCreate - the near null space that interpolation keeps

   Input Parameters:
+  A     - the matrix, n rows on this rank, blocks of bs
.  near  - the near null space that the program attached, NULL for none
.  dim   - dimension of the coordinates, 0 for none
-  x     - coordinates of the nodes of this rank, dim each

   Output Parameter:
.  modes - n values of each mode
*/
PetscErrorCode AinsworthModesCreate(Mat A, MatNullSpace near, PetscInt n, PetscInt bs, PetscInt dim, const PetscReal x[], AinsworthModes *modes)
{
  PetscFunctionBegin;
  modes->rotations = true;
  if (near) PetscCall(FromNullSpace(near, n, modes));
  if (near && modes->k > 0) {
    modes->source = "the near null space of the matrix";
  } else if (dim == bs && (bs == 2 || bs == 3)) {
    PetscCall(FromCoordinates(PetscObjectComm((PetscObject)A), n, bs, x, modes));
    modes->source = "rigid-body modes from coordinates";
  } else {
    Translations(n, bs, modes);
    modes->source    = "one constant per component";
    modes->rotations = bs == 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
