#include "graph.h"
#include "../base/csr.h"
#include "../base/objects.h"
#include "../saddle/saddle.h"
#include <metis.h>
#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

/* Finds, for each row of a sequential matrix with a symmetric pattern, the smallest row of its connected component */
void AinsworthGraphComponents(const AinsworthCSR &rows, std::vector<PetscInt> *smallest)
{
  std::vector<PetscInt> front;

  smallest->assign(rows.n, -1);
  for (PetscInt first = 0; first < rows.n; first++) {
    if ((*smallest)[first] >= 0) continue;
    (*smallest)[first] = first;
    front.assign(1, first);
    while (front.size()) {
      const PetscInt i = front.back();

      front.pop_back();
      for (PetscInt k = rows.ia[i]; k < rows.ia[i + 1]; k++) {
        if ((*smallest)[rows.ja[k]] >= 0) continue;
        (*smallest)[rows.ja[k]] = first;
        front.push_back(rows.ja[k]);
      }
    }
  }
}

/*
   Gathers the whole matrix on the ranks that pass `here`, an empty matrix on the others; free with
   MatDestroySubMatrices(). Collective
*/
PetscErrorCode AinsworthGraphGather(Mat M, bool here, Mat **whole)
{
  PetscInt m, n;
  IS       rows, columns;

  PetscFunctionBegin;
  PetscCall(MatGetSize(M, &m, &n));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, here ? m : 0, 0, 1, &rows));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, here ? n : 0, 0, 1, &columns));
  PetscCall(MatCreateSubMatrices(M, 1, &rows, &columns, MAT_INITIAL_MATRIX, whole));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&columns));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGraphOfNodes - gathers on rank 0 the pattern of the sum of matrices, with one row and column for each node
   of bs unknowns

   The matrices have the same layout; the result is empty on other ranks. Collective
*/
PetscErrorCode AinsworthGraphOfNodes(const std::vector<Mat> &parts, PetscInt bs, Mat **graph)
{
  AinsworthEntries       rows;
  std::vector<PetscInt> &columns = rows.columns;
  PetscInt               n, rstart, rend;
  Mat                    nodes;
  PetscMPIInt            rank;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(parts[0], &n, NULL));
  PetscCall(MatGetOwnershipRange(parts[0], &rstart, &rend));
  for (PetscInt node = rstart; node < rend; node += bs) {
    const auto first = columns.size();

    for (Mat part : parts) {
      for (PetscInt i = node; i < node + bs; i++) {
        PetscInt        length;
        const PetscInt *j;

        PetscCall(MatGetRow(part, i, &length, &j, NULL));
        for (PetscInt k = 0; k < length; k++)
          if (columns.size() == first || columns.back() != j[k] / bs) columns.push_back(j[k] / bs);
        PetscCall(MatRestoreRow(part, i, &length, &j, NULL));
      }
    }
    std::sort(columns.begin() + (std::ptrdiff_t)first, columns.end());
    columns.erase(std::unique(columns.begin() + (std::ptrdiff_t)first, columns.end()), columns.end());
    rows.endRow();
  }
  rows.values.assign(columns.size(), 1.0);
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)parts[0]), n / bs, rows, &nodes));
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)nodes), &rank));
  PetscCall(AinsworthGraphGather(nodes, rank == 0, graph));
  PetscCall(MatDestroy(&nodes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds the METIS graph of a sequential S; returns false if idx_t is too short for it */
static bool Neighbors(const AinsworthCSR &rows, std::vector<idx_t> &start, std::vector<idx_t> &neighbors)
{
  start.assign(1, 0);
  neighbors.clear();
  if ((PetscInt64)rows.ia[rows.n] > (PetscInt64)std::numeric_limits<idx_t>::max()) return false;
  for (PetscInt i = 0; i < rows.n; i++) {
    for (PetscInt k = rows.ia[i]; k < rows.ia[i + 1]; k++)
      if (rows.ja[k] != i) neighbors.push_back((idx_t)rows.ja[k]);
    start.push_back((idx_t)neighbors.size());
  }
  neighbors.push_back(0); /* METIS rejects a null pointer even for a graph without edges */
  return true;
}

/* Cuts a sequential S in parts with METIS; status: returned by METIS, or METIS_ERROR_INPUT if idx_t is too short */
static PetscErrorCode CutWhole(Mat S, PetscInt parts, std::vector<PetscInt> &part, PetscMPIInt *status)
{
  AinsworthCSR       rows;
  idx_t              n, one = 1, count = (idx_t)parts, cut, options[METIS_NOPTIONS];
  std::vector<idx_t> start, neighbors, where;

  PetscFunctionBegin;
  PetscCall(rows.open(S));
  n = (idx_t)rows.n;
  part.resize(rows.n);
  where.resize(rows.n);
  *status = METIS_OK;
  /* METIS supports neither a single part nor parts of a single row */
  if (parts <= 1 || parts >= rows.n) std::iota(where.begin(), where.end(), 0);
  else if (!Neighbors(rows, start, neighbors)) *status = METIS_ERROR_INPUT;
  else {
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_SEED] = 0;
    *status = METIS_PartGraphKway(&n, &one, start.data(), neighbors.data(), NULL, NULL, NULL, &count, NULL, NULL,
                                  options, &cut, where.data());
  }
  for (PetscInt i = 0; i < rows.n; i++) part[i] = parts <= 1 ? 0 : (PetscInt)where[i];
  PetscCall(rows.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGraphCut - cuts the graph of S on rank 0 and returns the part of each row, laid out as the rows of S.
   Collective

   Parts have equally many rows, and do not depend on the number of ranks. With more parts than rows, each row is a
   part.
*/
PetscErrorCode AinsworthGraphCut(Mat S, PetscInt parts, IS *part)
{
  MPI_Comm              comm = PetscObjectComm((PetscObject)S);
  PetscMPIInt           rank, status = METIS_OK;
  PetscInt              m, rstart, rend;
  PetscMPIInt           count;
  Mat                  *whole;
  std::vector<PetscInt> all;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(AinsworthGraphGather(S, rank == 0, &whole));
  if (!rank) PetscCall(CutWhole(whole[0], parts, all, &status));
  PetscCall(MatDestroySubMatrices(1, &whole));
  PetscCallMPI(MPI_Bcast(&status, 1, MPI_INT, 0, comm));
  PetscCheck(status == METIS_OK, comm, PETSC_ERR_LIB,
             "METIS with %d-bit indices cannot cut the graph of the Gram matrix: METIS_PartGraphKway() returned %d",
             (int)(8 * sizeof(idx_t)), status);
  PetscCall(MatGetSize(S, &m, NULL));
  all.resize(m);
  PetscCall(PetscMPIIntCast(m, &count));
  PetscCallMPI(MPI_Bcast(all.data(), count, MPIU_INT, 0, comm));
  PetscCall(MatGetOwnershipRange(S, &rstart, &rend));
  PetscCall(ISCreateGeneral(comm, rend - rstart, all.data() + rstart, PETSC_COPY_VALUES, part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGraphDissect - a MatOrdering: nested dissection of a sequential matrix with a symmetric pattern by METIS, or
   by PETSc if METIS fails
*/
PetscErrorCode AinsworthGraphDissect(Mat M, MatOrderingType, IS *row, IS *column)
{
  AinsworthCSR       rows;
  Mat                full;
  idx_t              n, options[METIS_NOPTIONS];
  PetscMPIInt        status = METIS_OK;
  PetscInt          *order;
  std::vector<idx_t> start, neighbors, old, number;

  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(M, &full)); /* SBAIJ stores one triangle only */
  PetscCall(rows.open(full));
  n = (idx_t)rows.n;
  old.resize(rows.n);
  number.resize(rows.n);
  std::iota(old.begin(), old.end(), 0);
  /* METIS does not support graphs without edges */
  if (!Neighbors(rows, start, neighbors)) status = METIS_ERROR_INPUT;
  else if (neighbors.size() > 1) {
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_SEED] = 0;
    status = METIS_NodeND(&n, start.data(), neighbors.data(), NULL, options, old.data(), number.data());
  }
  if (status != METIS_OK) { /* not an error, because other ranks may have succeeded */
    PetscCall(PetscInfo(M, "METIS with %d-bit indices cannot order the graph: METIS_NodeND() returned %d\n",
                        (int)(8 * sizeof(idx_t)), status));
    PetscCall(rows.close());
    PetscCall(MatDestroy(&full));
    PetscCall(MatGetOrdering(M, MATORDERINGND, row, column));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(rows.n, &order));
  for (PetscInt i = 0; i < rows.n; i++) order[i] = (PetscInt)old[i];
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, rows.n, order, PETSC_OWN_POINTER, row));
  PetscCall(rows.close());
  PetscCall(MatDestroy(&full));
  PetscCall(AinsworthShare(*row, column));
  PetscFunctionReturn(PETSC_SUCCESS);
}
