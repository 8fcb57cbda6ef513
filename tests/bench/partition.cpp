/* Elements to ranks by METIS, nodes to ranks after them, and the numbering that follows */
#include "cubes.h"
#include <metis.h>
#include <algorithm>
#include <limits>
#include <utility>

typedef std::vector<std::pair<PetscInt, PetscInt>> Pairs;

/*
   Pairs of elements that face each other across the contact surface, both ways round, sorted: each element of it with
   the one at its middle
*/
static Pairs ContactPairs(const CubesMesh &mesh)
{
  Pairs pairs;

  for (int i = 0; i < 2; i++) {
    const CubesBody &b = mesh.body[i], &other = mesh.body[1 - i];

    for (PetscInt y = 0; y < b.n[1]; y++) {
      for (PetscInt x = 0; x < b.n[0]; x++) {
        const PetscInt ox    = (PetscInt)((x + 0.5) / b.n[0] * other.n[0]),
                       oy    = (PetscInt)((y + 0.5) / b.n[1] * other.n[1]);
        const PetscInt here  = b.Element(x, y, i ? 0 : b.n[2] - 1),
                       there = other.Element(ox, oy, i ? other.n[2] - 1 : 0);

        pairs.emplace_back(here, there);
        pairs.emplace_back(there, here);
      }
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

/*
   Elements are neighbours when they share a face and, if the partition is to know of contact, when they face each other
   across it, with a weight that makes METIS keep them on one rank.
*/
static PetscErrorCode PartitionOnThisRank(CubesMesh *mesh, PetscMPIInt parts)
{
  const idx_t        together = 10;
  const Pairs        pairs    = mesh->options.partition == CUBES_PARTITION_CONTACT ? ContactPairs(*mesh) : Pairs();
  std::vector<idx_t> offset, neighbour, weight, part;
  idx_t              options[METIS_NOPTIONS], nvertices, nparts = parts, ncon = 1, cut;
  int                ierr;

  PetscFunctionBeginUser;
  PetscCheck((PetscInt64)6 * mesh->elements + (PetscInt64)pairs.size() <= (PetscInt64)std::numeric_limits<idx_t>::max(),
             PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "%" PetscInt_FMT " elements have more neighbours than METIS can count with its %d-bit integers",
             mesh->elements, (int)(8 * sizeof(idx_t)));
  nvertices = (idx_t)mesh->elements;
  offset.reserve(nvertices + 1);
  neighbour.reserve(6 * (size_t)nvertices + pairs.size());
  offset.push_back(0);
  for (const CubesBody &b : mesh->body) {
    const PetscInt step[3] = {1, b.n[0], b.n[0] * b.n[1]};

    for (PetscInt e = 0; e < b.Elements(); e++) {
      const PetscInt ijk[3] = {e % b.n[0], e / b.n[0] % b.n[1], e / b.n[0] / b.n[1]};

      for (int d = 0; d < 3; d++) {
        if (ijk[d] > 0) neighbour.push_back((idx_t)(b.element + e - step[d]));
        if (ijk[d] < b.n[d] - 1) neighbour.push_back((idx_t)(b.element + e + step[d]));
      }
      if (!pairs.empty()) {
        weight.resize(neighbour.size(), 1);
        for (auto p = std::lower_bound(pairs.begin(), pairs.end(), Pairs::value_type(b.element + e, 0));
             p != pairs.end() && p->first == b.element + e; ++p) {
          neighbour.push_back((idx_t)p->second);
          weight.push_back(together);
        }
      }
      offset.push_back((idx_t)neighbour.size());
    }
  }
  part.resize(nvertices);
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  ierr                       = METIS_PartGraphKway(&nvertices, &ncon, offset.data(), neighbour.data(), NULL, NULL,
                             weight.empty() ? NULL : weight.data(), &nparts, NULL, NULL, options, &cut, part.data());
  PetscCheck(ierr == METIS_OK, PETSC_COMM_SELF, PETSC_ERR_LIB, "METIS_PartGraphKway() failed with error %d", ierr);
  for (size_t e = 0; e < part.size(); e++) mesh->part[e] = (PetscMPIInt)part[e];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A node follows the element of which it is the lowest corner, or the last element where the body ends: as balanced as
   the elements are
*/
PetscMPIInt CubesMesh::Rank(PetscInt id) const
{
  const CubesBody &b = body[Body(id)];
  PetscInt         ijk[3];

  b.NodeIndices(id, ijk);
  for (int d = 0; d < 3; d++) ijk[d] = PetscMin(ijk[d], b.n[d] - 1);
  return part[b.Element(ijk[0], ijk[1], ijk[2])];
}

static PetscErrorCode NumberNodes(CubesMesh *mesh, PetscMPIInt rank, PetscMPIInt parts)
{
  std::vector<PetscInt> next(parts + 1, 0);

  PetscFunctionBeginUser;
  mesh->number.resize(mesh->nodes);
  for (PetscInt node = 0; node < mesh->nodes; node++) next[mesh->Rank(node) + 1]++;
  for (PetscMPIInt r = 0; r < parts; r++) next[r + 1] += next[r];
  mesh->start = next[rank];
  mesh->owned.clear();
  mesh->owned.reserve(next[rank + 1] - next[rank]);
  for (PetscInt node = 0; node < mesh->nodes; node++) {
    const PetscMPIInt owner = mesh->Rank(node);

    mesh->number[node] = next[owner]++;
    if (owner == rank) mesh->owned.push_back(node);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CubesMeshPartition(CubesMesh *mesh, PetscMPIInt parts)
{
  PetscMPIInt rank, size, count;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(mesh->comm, &rank));
  PetscCallMPI(MPI_Comm_size(mesh->comm, &size));
  PetscCheck(parts >= size, mesh->comm, PETSC_ERR_ARG_OUTOFRANGE,
             "The mesh cannot be cut in %d parts on %d ranks: take at least as many parts", (int)parts, (int)size);
  PetscCall(PetscMPIIntCast(mesh->elements, &count));
  mesh->part.assign(mesh->elements, 0);
  if (mesh->elements <= parts) { /* METIS wants more elements than parts */
    for (PetscInt e = 0; e < mesh->elements; e++) mesh->part[e] = (PetscMPIInt)e;
  } else if (parts > 1) {
    if (rank == 0) PetscCall(PartitionOnThisRank(mesh, parts));
    PetscCallMPI(MPI_Bcast(mesh->part.data(), count, MPI_INT, 0, mesh->comm));
  }
  PetscCall(NumberNodes(mesh, rank, parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}
