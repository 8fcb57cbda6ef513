/* Nodes to ranks, in slabs or by METIS, and the numbering that follows */
#include "scene.h"
#include <metis.h>
#include <algorithm>
#include <limits>
#include <numeric>

/* Slabs of as many nodes each, across the longest edge of all the bodies together */
static void Slabs(const Scene &s, PetscMPIInt size, std::vector<PetscMPIInt> &rank)
{
  std::vector<PetscReal> along(s.nodes);
  std::vector<PetscInt>  order(s.nodes);
  PetscReal              low[3] = {PETSC_MAX_REAL, PETSC_MAX_REAL, PETSC_MAX_REAL},
            high[3]             = {-PETSC_MAX_REAL, -PETSC_MAX_REAL, -PETSC_MAX_REAL};
  int axis                      = 0;

  for (const SceneBody &b : s.body) {
    for (int d = 0; d < s.dim; d++) {
      low[d]  = PetscMin(low[d], b.lo[d]);
      high[d] = PetscMax(high[d], b.lo[d] + b.size[d]);
    }
  }
  for (int d = 1; d < s.dim; d++) {
    if (high[d] - low[d] >= (high[axis] - low[axis]) * (1 - 1e-12)) axis = d;
  }
  for (PetscInt node = 0; node < s.nodes; node++) {
    const SceneBody &b = s.body[s.Body(node)];
    PetscReal        x[3];
    PetscInt         ijk[3];

    b.NodeIndices(node, ijk);
    b.BoxPosition(ijk, x);
    along[node] = x[axis];
  }
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&along](PetscInt a, PetscInt b) { return along[a] < along[b]; });
  for (PetscInt i = 0; i < s.nodes; i++) rank[order[i]] = (PetscMPIInt)((PetscInt64)i * size / s.nodes);
}

/* Cells are neighbors when they share a face. On one rank. */
static PetscErrorCode PartitionCells(const Scene &s, PetscMPIInt size, std::vector<PetscMPIInt> &part)
{
  std::vector<idx_t> offset(1, 0), neighbor, found(s.cells);
  idx_t              options[METIS_NOPTIONS], nvertices = (idx_t)s.cells, nparts = size, ncon = 1, cut;
  int                ierr;

  PetscFunctionBeginUser;
  PetscCheck((PetscInt64)6 * s.cells <= (PetscInt64)std::numeric_limits<idx_t>::max(), PETSC_COMM_SELF,
             PETSC_ERR_ARG_OUTOFRANGE,
             "%" PetscInt_FMT " cells have more neighbors than METIS can count with its %d-bit integers", s.cells,
             (int)(8 * sizeof(idx_t)));
  for (const SceneBody &b : s.body) {
    const PetscInt step[3] = {1, b.CellsAlong(0), b.CellsAlong(0) * b.CellsAlong(1)};

    for (PetscInt e = 0; e < b.Cells(); e++) {
      const PetscInt ijk[3] = {e % step[1], e / step[1] % b.CellsAlong(1), e / step[2]};

      for (int d = 0; d < 3; d++) {
        if (ijk[d] > 0) neighbor.push_back((idx_t)(b.cell + e - step[d]));
        if (ijk[d] < b.CellsAlong(d) - 1) neighbor.push_back((idx_t)(b.cell + e + step[d]));
      }
      offset.push_back((idx_t)neighbor.size());
    }
  }
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  ierr = METIS_PartGraphKway(&nvertices, &ncon, offset.data(), neighbor.data(), NULL, NULL, NULL, &nparts, NULL, NULL,
                             options, &cut, found.data());
  PetscCheck(ierr == METIS_OK, PETSC_COMM_SELF, PETSC_ERR_LIB, "METIS_PartGraphKway() failed with error %d", ierr);
  for (PetscInt e = 0; e < s.cells; e++) part[e] = (PetscMPIInt)found[e];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A node follows the cell of which it is the lowest corner, or the last one where the body ends */
static PetscErrorCode Metis(const Scene &s, PetscMPIInt me, PetscMPIInt size, std::vector<PetscMPIInt> &rank)
{
  std::vector<PetscMPIInt> part(s.cells, 0);
  PetscMPIInt              count;

  PetscFunctionBeginUser;
  PetscCall(PetscMPIIntCast(s.cells, &count));
  if (s.cells <= size) std::iota(part.begin(), part.end(), 0); /* METIS wants more cells than parts */
  else {
    if (me == 0) PetscCall(PartitionCells(s, size, part));
    PetscCallMPI(MPI_Bcast(part.data(), count, MPI_INT, 0, s.comm));
  }
  for (PetscInt node = 0; node < s.nodes; node++) {
    const SceneBody &b = s.body[s.Body(node)];
    PetscInt         ijk[3];

    b.NodeIndices(node, ijk);
    for (int d = 0; d < 3; d++) ijk[d] = PetscMin(ijk[d] / b.order, b.CellsAlong(d) - 1);
    rank[node] = part[b.Cell(ijk[0], ijk[1], ijk[2])];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ScenePartitionNodes(Scene *s)
{
  std::vector<PetscMPIInt> rank(s->nodes, 0);
  std::vector<PetscInt>    next;
  PetscMPIInt              me, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(s->comm, &me));
  PetscCallMPI(MPI_Comm_size(s->comm, &size));
  if (size > 1) {
    if (s->options.partition == SCENE_METIS) PetscCall(Metis(*s, me, size, rank));
    else Slabs(*s, size, rank);
  }
  next.assign(size + 1, 0);
  for (PetscMPIInt r : rank) next[r + 1]++;
  for (PetscMPIInt r = 0; r < size; r++) next[r + 1] += next[r];
  s->start = next[me];
  s->number.resize(s->nodes);
  s->owned.clear();
  for (PetscInt node = 0; node < s->nodes; node++) {
    s->number[node] = next[rank[node]]++;
    if (rank[node] == me) s->owned.push_back(node);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
