/* Objects on the layouts of others: PETSc's functions sum sizes and gather ranges of all ranks again for each */
#include "layouts.h"
#include <vector>

/*
   Creates the layout of an object, set up, on the communicator of the object. Not collective

   PETSc's layouts have the communicator of the program, which may be freed before the object is, as DOLFINx does with
   that of a mesh; VecDuplicate() of PETSc 3.22 uses it
*/
static PetscErrorCode LayoutOn(PetscObject object, PetscLayout layout, PetscLayout *own)
{
  PetscFunctionBegin;
  PetscCall(PetscLayoutCreateFromRanges(PetscObjectComm(object), layout->range, PETSC_COPY_VALUES, layout->bs, own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a vector on a layout of an object */
static PetscErrorCode CreateVec(Mat mat, PetscLayout layout, VecType type, Vec *v)
{
  PetscLayout own;

  PetscFunctionBegin;
  PetscCall(LayoutOn((PetscObject)mat, layout, &own));
  PetscCall(VecCreate(PetscObjectComm((PetscObject)mat), v));
  PetscCall(VecSetLayout(*v, own));
  PetscCall(VecSetType(*v, type));
  PetscCall(PetscLayoutDestroy(&own));
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
  VecType     type;
  PetscBool   creates, standard;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(mat, MATOP_CREATE_VECS, &creates));
  PetscCall(MatGetVecType(mat, &type));
  PetscCall(PetscStrcmp(type, VECSTANDARD, &standard));
  if (creates || !standard) {
    PetscCall(MatCreateVecs(mat, right, left));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetLayouts(mat, &rows, &columns));
  if (right) PetscCall(CreateVec(mat, columns, type, right));
  if (left) PetscCall(CreateVec(mat, rows, type, left));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthLayoutsLike - creates the layouts of the rows and columns of a matrix. Not collective */
PetscErrorCode AinsworthLayoutsLike(Mat like, PetscLayout own[2])
{
  PetscLayout rows, columns;

  PetscFunctionBegin;
  PetscCall(MatGetLayouts(like, &rows, &columns));
  PetscCall(LayoutOn((PetscObject)like, rows, &own[0]));
  PetscCall(LayoutOn((PetscObject)like, columns, &own[1]));
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
  PetscLayout own[2];

  PetscFunctionBegin;
  PetscCall(AinsworthLayoutsLike(like, own));
  PetscCall(AinsworthCreateShellOn(PetscObjectComm((PetscObject)like), own[0], own[1], ctx, shell));
  for (PetscLayout &layout : own) PetscCall(PetscLayoutDestroy(&layout));
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
