/* Elements to ranks by METIS, nodes to ranks after them, and the numbering that follows */
#include "cubes.h"
#include <metis.h>
#include <limits>

/* Elements are neighbours when they share a face; the bodies are not neighbours, as their contact is no business of the mesh */
static PetscErrorCode PartitionOnThisRank(CubesMesh *mesh, PetscMPIInt parts)
{
  std::vector<idx_t> offset, neighbour, part;
  idx_t              options[METIS_NOPTIONS], nvertices, nparts = parts, ncon = 1, cut;
  int                ierr;

  PetscFunctionBeginUser;
  PetscCheck((PetscInt64)6 * mesh->elements <= (PetscInt64)std::numeric_limits<idx_t>::max(), PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "%" PetscInt_FMT " elements have more neighbours than METIS can count with its %d-bit integers", mesh->elements, (int)(8 * sizeof(idx_t)));
  nvertices = (idx_t)mesh->elements;
  offset.reserve(nvertices + 1);
  neighbour.reserve(6 * (size_t)nvertices);
  offset.push_back(0);
  for (const CubesBody &b : mesh->body) {
    const PetscInt step[3] = {1, b.n[0], b.n[0] * b.n[1]};

    for (PetscInt k = 0; k < b.n[2]; k++) {
      for (PetscInt j = 0; j < b.n[1]; j++) {
        for (PetscInt i = 0; i < b.n[0]; i++) {
          const PetscInt ijk[3] = {i, j, k}, element = b.Element(i, j, k);

          for (int d = 0; d < 3; d++) {
            if (ijk[d] > 0) neighbour.push_back((idx_t)(element - step[d]));
            if (ijk[d] < b.n[d] - 1) neighbour.push_back((idx_t)(element + step[d]));
          }
          offset.push_back((idx_t)neighbour.size());
        }
      }
    }
  }
  part.resize(nvertices);
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  ierr = METIS_PartGraphKway(&nvertices, &ncon, offset.data(), neighbour.data(), NULL, NULL, NULL, &nparts, NULL, NULL, options, &cut, part.data());
  PetscCheck(ierr == METIS_OK, PETSC_COMM_SELF, PETSC_ERR_LIB, "METIS_PartGraphKway() failed with error %d", ierr);
  for (size_t e = 0; e < part.size(); e++) mesh->part[e] = (PetscMPIInt)part[e];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A node follows the element of which it is the lowest corner, or the last element where the body ends: as balanced as the elements are */
static PetscMPIInt NodeRank(const CubesMesh &mesh, const CubesBody &b, PetscInt i, PetscInt j, PetscInt k)
{
  return mesh.part[b.Element(PetscMin(i, b.n[0] - 1), PetscMin(j, b.n[1] - 1), PetscMin(k, b.n[2] - 1))];
}

static PetscErrorCode NumberNodes(CubesMesh *mesh, PetscMPIInt rank, PetscMPIInt size)
{
  std::vector<PetscInt> next(size + 1, 0);

  PetscFunctionBeginUser;
  mesh->number.resize(mesh->nodes);
  for (int sweep = 0; sweep < 2; sweep++) { /* count, then number */
    PetscInt node = 0;

    for (const CubesBody &b : mesh->body) {
      for (PetscInt k = 0; k <= b.n[2]; k++) {
        for (PetscInt j = 0; j <= b.n[1]; j++) {
          for (PetscInt i = 0; i <= b.n[0]; i++, node++) {
            const PetscMPIInt owner = NodeRank(*mesh, b, i, j, k);

            if (sweep == 0) next[owner + 1]++;
            else mesh->number[node] = next[owner]++;
            if (sweep == 1 && owner == rank) mesh->owned.push_back(node);
          }
        }
      }
    }
    if (sweep == 0) {
      for (PetscMPIInt r = 0; r < size; r++) next[r + 1] += next[r];
      mesh->start = next[rank];
      mesh->owned.clear();
      mesh->owned.reserve(next[rank + 1] - next[rank]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CubesMeshPartition(CubesMesh *mesh)
{
  PetscMPIInt rank, size, count;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(mesh->comm, &rank));
  PetscCallMPI(MPI_Comm_size(mesh->comm, &size));
  PetscCall(PetscMPIIntCast(mesh->elements, &count));
  mesh->part.assign(mesh->elements, 0);
  if (mesh->elements <= size) { /* METIS wants more elements than parts */
    for (PetscInt e = 0; e < mesh->elements; e++) mesh->part[e] = (PetscMPIInt)e;
  } else if (size > 1) {
    if (rank == 0) PetscCall(PartitionOnThisRank(mesh, size));
    PetscCallMPI(MPI_Bcast(mesh->part.data(), count, MPI_INT, 0, mesh->comm));
  }
  PetscCall(NumberNodes(mesh, rank, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}
