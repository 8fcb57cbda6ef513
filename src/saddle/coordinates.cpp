/* Rigid-body modes from the coordinates of nodes, for programs that attach no near null space */
#include "saddle.h"
#include "../objects.h"
#include <petscdm.h>

/* Tells whether the number of coordinates is the expected one on all ranks. Collective */
static PetscErrorCode Fits(MPI_Comm comm, size_t have, PetscInt expected, PetscBool *fits)
{
  PetscFunctionBegin;
  *fits = (PetscBool)(expected >= 0 && have == (size_t)expected);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, fits, 1, AINSWORTH_MPI_BOOL, MPI_LAND, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the coordinates of the nodes of A, interlaced

   The program may give coordinates of the nodes of A, of the nodes of its whole matrix (as PCGAMG expects) or of all rows of its matrix (as PCFIELDSPLIT does).
*/
static PetscErrorCode GetCoordinates(const AinsworthSaddleInputs *in, Mat mat, const AinsworthSaddleBlocks *found, Vec *coordinates)
{
  MPI_Comm        comm = PetscObjectComm((PetscObject)mat);
  const PetscInt  dim = in->dim, nodes = (PetscInt)in->coordinates.size() / dim;
  PetscInt        n, m, bs, first;
  PetscBool       ofA, ofNodes, ofRows;
  const PetscInt *index;
  PetscScalar    *x;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(found->rows[0], &n));
  PetscCall(MatGetLocalSize(mat, &m, NULL));
  PetscCall(MatGetBlockSize(mat, &bs));
  PetscCall(MatGetOwnershipRange(mat, &first, NULL));
  PetscCall(Fits(comm, nodes, n / found->bs, &ofA));
  PetscCall(Fits(comm, nodes, m / bs, &ofNodes));
  PetscCall(Fits(comm, nodes, m, &ofRows));
  PetscCheck(ofA || ofNodes || ofRows, comm, PETSC_ERR_ARG_SIZ,
             "PCSetCoordinates() gave coordinates of %" PetscInt_FMT " nodes on this rank: %s, A, has %" PetscInt_FMT " nodes of %" PetscInt_FMT
             " unknowns, the matrix %" PetscInt_FMT " of %" PetscInt_FMT,
             nodes, found->name[AINSWORTH_BLOCK_A], n / found->bs, found->bs, m / bs, bs);
  if (ofRows) bs = 1;
  PetscCall(VecCreate(comm, coordinates));
  PetscCall(VecSetSizes(*coordinates, n / found->bs * dim, PETSC_DETERMINE));
  PetscCall(VecSetBlockSize(*coordinates, dim));
  PetscCall(VecSetType(*coordinates, VECSTANDARD));
  PetscCall(ISGetIndices(found->rows[0], &index));
  PetscCall(VecGetArrayWrite(*coordinates, &x));
  for (PetscInt node = 0; node < n / found->bs; node++) {
    const PetscInt at = ofA ? node : (index[node * found->bs] - first) / bs;

    for (PetscInt d = 0; d < dim; d++) x[dim * node + d] = at >= 0 && at < nodes ? in->coordinates[dim * at + d] : 0.0;
  }
  PetscCall(VecRestoreArrayWrite(*coordinates, &x));
  PetscCall(ISRestoreIndices(found->rows[0], &index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCreateRigidModes - creates rigid-body modes in 2 or 3 dimensions, for nodes with one unknown per coordinate; who: the source, for views */
PetscErrorCode AinsworthCreateRigidModes(Vec coordinates, const char who[], MatNullSpace *modes)
{
  PetscFunctionBegin;
  PetscCall(MatNullSpaceCreateRigidBody(coordinates, modes));
  PetscCall(AinsworthAttach((PetscObject)*modes, AinsworthModesSource, std::make_unique<std::string>(who)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthDMCreateRigidModes - creates rigid-body modes of n local unknowns if the DM has one coordinate for each; else NULL. Collective */
PetscErrorCode AinsworthDMCreateRigidModes(DM dm, PetscInt n, MatNullSpace *modes)
{
  Vec       coordinates = NULL;
  PetscInt  dim         = 0, m;
  PetscBool fits;

  PetscFunctionBegin;
  *modes = NULL;
  PetscCall(DMGetCoordinates(dm, &coordinates));
  if (!coordinates) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetBlockSize(coordinates, &dim));
  PetscCall(VecGetLocalSize(coordinates, &m));
  PetscCall(Fits(PetscObjectComm((PetscObject)dm), (size_t)m, dim == 2 || dim == 3 ? n : -1, &fits));
  if (fits) PetscCall(AinsworthCreateRigidModes(coordinates, "coordinates of the DM", modes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthMatCreateRigidModes - creates rigid-body modes if a DM with coordinates of its nodes made the matrix; else NULL. Collective */
PetscErrorCode AinsworthMatCreateRigidModes(Mat A, MatNullSpace *modes)
{
  DM       dm;
  PetscInt n;

  PetscFunctionBegin;
  *modes = NULL;
  PetscCall(MatGetDM(A, &dm));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  if (dm) PetscCall(AinsworthDMCreateRigidModes(dm, n, modes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindRigidModes - creates found->modes from PCSetCoordinates() or from the DM of A, or takes them from the last set-up if nothing they depend on has
   changed. Collective
*/
PetscErrorCode AinsworthFindRigidModes(const AinsworthSaddleInputs *in, Mat mat, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  MatNullSpace near;
  Vec          coordinates;

  PetscFunctionBegin;
  if (!in->dim) {
    PetscCall(AinsworthSaddleGetNearNullSpace(found, &near));
    if (!near) PetscCall(AinsworthMatCreateRigidModes(found->block[AINSWORTH_BLOCK_A], &found->modes));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  found->located = in->located;
  if (last && last->modes && last->located == in->located && last->rows[0] == found->rows[0] && last->bs == found->bs) {
    PetscCall(AinsworthShare(last->modes, &found->modes));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (in->dim == 1 || found->bs != in->dim) {
    PetscCall(PetscInfo(mat, "Coordinates are of no use: they have %" PetscInt_FMT " components, a node has %" PetscInt_FMT " unknowns\n", in->dim, found->bs));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(GetCoordinates(in, mat, found, &coordinates));
  PetscCall(AinsworthCreateRigidModes(coordinates, "PCSetCoordinates()", &found->modes));
  PetscCall(VecDestroy(&coordinates));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Describes the near null space in words, for views */
PetscErrorCode AinsworthSaddleDescribeModes(const AinsworthSaddle *sp, char text[], size_t len)
{
  MatNullSpace near;
  PetscBool    constant;
  PetscInt     n;
  std::string *source;

  PetscFunctionBegin;
  text[0] = 0;
  PetscCall(AinsworthSaddleGetNearNullSpace(sp, &near));
  if (!near) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNullSpaceGetVecs(near, &constant, &n, NULL));
  PetscCall(AinsworthGetAttached((PetscObject)near, AinsworthModesSource, &source));
  PetscCall(PetscSNPrintf(text, len, "%" PetscInt_FMT " vectors (%s)", n + (constant ? 1 : 0), source ? source->c_str() : "MatSetNearNullSpace()"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
