/* Objects on the layouts of others: PETSc's functions sum sizes and gather ranges of all ranks again for each */
#include "layouts.h"
#include <vector>

/* Creates a vector with a layout that is set up, on the communicator of an object. Not collective */
static PetscErrorCode CreateVec(MPI_Comm comm, PetscLayout layout, Vec *v)
{
  PetscFunctionBegin;
  PetscCall(VecCreate(comm, v));
  PetscCall(VecSetLayout(*v, layout));
  PetscCall(VecSetType(*v, VECSTANDARD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthVecsOnHost - checks whether a matrix asks for PETSc's standard vectors, not for those of a device */
PetscErrorCode AinsworthVecsOnHost(Mat mat, PetscBool *host)
{
  VecType type;

  PetscFunctionBegin;
  *host = PETSC_FALSE;
  PetscCall(MatGetVecType(mat, &type));
  PetscCall(PetscStrcmp(type, VECSTANDARD, host));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthCreateVecs - does what MatCreateVecs() does, without its two reductions for each vector. Collective

   Matrices that create vectors of their own, as MATNEST, and vectors of devices, which may follow where the matrix is,
   are PETSc's.
*/
PetscErrorCode AinsworthCreateVecs(Mat mat, Vec *right, Vec *left)
{
  PetscLayout rows, columns;
  PetscBool   creates, host;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(mat, MATOP_CREATE_VECS, &creates));
  PetscCall(AinsworthVecsOnHost(mat, &host));
  if (creates || !host) {
    PetscCall(MatCreateVecs(mat, right, left));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetLayouts(mat, &rows, &columns));
  if (right) PetscCall(CreateVec(PetscObjectComm((PetscObject)mat), columns, right));
  if (left) PetscCall(CreateVec(PetscObjectComm((PetscObject)mat), rows, left));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCreateShellOn - creates a MATSHELL on layouts of rows and columns that are set up. Collective */
PetscErrorCode AinsworthCreateShellOn(MPI_Comm comm, PetscLayout rows, PetscLayout columns, void *ctx, Mat *shell)
{
  PetscFunctionBegin;
  PetscCall(MatCreate(comm, shell));
  PetscCall(MatSetLayouts(*shell, rows, columns));
  PetscCall(MatSetType(*shell, MATSHELL));
  PetscCall(MatShellSetContext(*shell, ctx));
  PetscCall(MatSetUp(*shell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCreateShell - creates a MATSHELL of the rows and columns of `like`. Collective */
PetscErrorCode AinsworthCreateShell(Mat like, void *ctx, Mat *shell)
{
  PetscLayout rows, columns;

  PetscFunctionBegin;
  PetscCall(MatGetLayouts(like, &rows, &columns));
  PetscCall(AinsworthCreateShellOn(PetscObjectComm((PetscObject)like), rows, columns, ctx, shell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthLayoutOfSize - creates a layout from local sizes, with one reduction. Collective */
PetscErrorCode AinsworthLayoutOfSize(MPI_Comm comm, PetscInt local, PetscLayout *layout)
{
  PetscMPIInt           ranks;
  PetscInt64            total = 0;
  std::vector<PetscInt> range;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  range.assign(ranks + 1, 0);
  PetscCallMPI(MPI_Allgather(&local, 1, MPIU_INT, range.data() + 1, 1, MPIU_INT, comm));
  for (PetscMPIInt r = 1; r <= ranks; r++) {
    total += range[r];
    PetscCall(PetscIntCast(total, &range[r]));
  }
  PetscCall(PetscLayoutCreateFromRanges(comm, range.data(), PETSC_COPY_VALUES, 1, layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthLayoutOfBlocks - creates the layout of `count` unknowns for each place of another, with block size bs */
PetscErrorCode AinsworthLayoutOfBlocks(MPI_Comm comm, PetscLayout places, PetscInt count, PetscInt bs,
                                       PetscLayout *unknowns)
{
  std::vector<PetscInt> range(places->range, places->range + places->size + 1);

  PetscFunctionBegin;
  for (PetscInt &first : range) first *= count;
  PetscCall(PetscLayoutCreateFromRanges(comm, range.data(), PETSC_COPY_VALUES, bs, unknowns));
  PetscFunctionReturn(PETSC_SUCCESS);
}
