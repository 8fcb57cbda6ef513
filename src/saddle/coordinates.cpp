/* Rigid-body modes from the coordinates of nodes, for programs that attach no near null space */
#include "saddle.h"
#include "../base/objects.h"
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
   Creates rigid-body modes in 2 or 3 dimensions, for nodes with one unknown per coordinate; who: the source, for views
*/
static PetscErrorCode Create(Vec coordinates, const char who[], MatNullSpace *modes)
{
  PetscFunctionBegin;
  PetscCall(MatNullSpaceCreateRigidBody(coordinates, modes));
  PetscCall(AinsworthAttach((PetscObject)*modes, AinsworthModesSource, std::make_unique<std::string>(who)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the coordinates of the nodes of A, interlaced

   The program may give coordinates of the nodes of A, of the nodes of its whole matrix (as PCGAMG expects) or of all
   rows of its matrix (as PCFIELDSPLIT does).
*/
static PetscErrorCode GetCoordinates(const AinsworthSaddleInputs *in, Mat mat, const AinsworthSaddleBlocks *found,
                                     Vec *coordinates)
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
             "PCSetCoordinates() gave coordinates of %" PetscInt_FMT " nodes on this rank: %s, A, has %" PetscInt_FMT
             " nodes of %" PetscInt_FMT " unknowns, the matrix %" PetscInt_FMT " of %" PetscInt_FMT,
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

/*
   AinsworthSaddleCreateRigidModes - creates rigid-body modes of A from the coordinates of PCSetCoordinates().
   Collective
*/
PetscErrorCode AinsworthSaddleCreateRigidModes(const AinsworthSaddleInputs *in, Mat mat,
                                               const AinsworthSaddleBlocks *found, MatNullSpace *modes)
{
  Vec coordinates;

  PetscFunctionBegin;
  PetscCall(GetCoordinates(in, mat, found, &coordinates));
  PetscCall(Create(coordinates, "PCSetCoordinates()", modes));
  PetscCall(VecDestroy(&coordinates));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthDMCreateRigidModes - creates rigid-body modes of n local unknowns if the DM has one coordinate for each;
   else NULL. Collective
*/
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
  if (fits) PetscCall(Create(coordinates, "coordinates of the DM", modes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthMatCreateRigidModes - creates rigid-body modes if a DM with coordinates of its nodes made the matrix; else
   NULL. Collective
*/
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
