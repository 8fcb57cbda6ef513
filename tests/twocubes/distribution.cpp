static char help[] = "What DistributionCount() says of a partition, against the distributed matrices and PETSc's own ghosts of C.\n\n";

#include "../../tests/bench/distribution.h"
#include <map>
#include <set>

static PetscErrorCode Same(MPI_Comm comm, const char what[], PetscInt counted, PetscInt actual)
{
  PetscFunctionBeginUser;
  PetscCheck(counted == actual, comm, PETSC_ERR_PLIB, "%s: %" PetscInt_FMT " by the count, %" PetscInt_FMT " in truth", what, counted, actual);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckRows(MPI_Comm comm, const char name[], PetscInt rows, const RowCount &count)
{
  PetscInt local[3] = {rows > 0, rows, rows ? -rows : -PETSC_MAX_INT}, ranks, largest[2];

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(local, &ranks, 1, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(local + 1, largest, 2, MPIU_INT, MPI_MAX, comm));
  PetscCall(Same(comm, name, count.ranks, ranks));
  PetscCall(Same(comm, name, count.most, largest[0]));
  PetscCall(Same(comm, name, count.least, ranks ? -largest[1] : 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns of other ranks that PETSc found in C, and the rows of C that are not on the rank with most of them */
static PetscErrorCode CheckSpread(Mat C, const Exchange &counted)
{
  MPI_Comm              comm = PetscObjectComm((PetscObject)C);
  PetscInt              rows, m, most, sum[2] = {0, 0}, mine, busiest;
  PetscMPIInt           rank, size, holder, solver, holders, messages = 0;
  PetscBool             mpi;
  std::vector<PetscInt> wanted, asked;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  wanted.assign(size, 0);
  asked.assign(size, 0);
  PetscCall(PetscObjectTypeCompare((PetscObject)C, MATMPIAIJ, &mpi));
  if (mpi) {
    const PetscInt *ghosts;
    PetscInt        n;
    PetscLayout     columns;
    Mat             other;

    PetscCall(MatMPIAIJGetSeqAIJ(C, NULL, &other, &ghosts));
    PetscCall(MatGetSize(other, NULL, &n));
    PetscCall(MatGetLayouts(C, NULL, &columns));
    for (PetscInt i = 0; i < n; i++) {
      PetscMPIInt owner;

      PetscCall(PetscLayoutFindOwner(columns, ghosts[i], &owner));
      wanted[owner]++;
    }
    sum[1] = 2 * n;
  }
  PetscCallMPI(MPI_Alltoall(wanted.data(), 1, MPIU_INT, asked.data(), 1, MPIU_INT, comm));
  for (PetscMPIInt r = 0; r < size; r++) {
    sum[0] += wanted[r] ? 2 : 0;
    messages += (wanted[r] ? 2 : 0) + (asked[r] ? 2 : 0);
  }
  PetscCall(MatGetSize(C, &m, NULL));
  PetscCall(MatGetLocalSize(C, &rows, NULL));
  holder = rows > 0;
  PetscCallMPI(MPI_Allreduce(&holder, &holders, 1, MPI_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(&rows, &most, 1, MPIU_INT, MPI_MAX, comm));
  holder = rows == most ? rank : size;
  PetscCallMPI(MPI_Allreduce(&holder, &solver, 1, MPI_INT, MPI_MIN, comm));
  mine = messages;
  if (m && rank == solver) mine += 2 * (holders - 1);
  if (rows && rank != solver) {
    mine += 2;
    sum[0] += 2;
    sum[1] += 2 * rows;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(&mine, &busiest, 1, MPIU_INT, MPI_MAX, comm));
  PetscCall(Same(comm, "messages of C in its own layout", counted.messages, sum[0]));
  PetscCall(Same(comm, "numbers sent of C in its own layout", counted.scalars, sum[1]));
  PetscCall(Same(comm, "messages at the busiest rank of C in its own layout", counted.busiest, busiest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which unknowns each rank of the group needs of which other rank, as the layouts of the distributed system have them */
static PetscErrorCode CheckTogether(const CubesMesh &mesh, Mat C, Mat natural, PetscInt members, const Distribution &counted)
{
  PetscInt                                                          m, rows, messages = 0, scalars = 0, busiest = 0;
  PetscMPIInt                                                       size;
  PetscLayout                                                       columns;
  std::map<std::pair<PetscMPIInt, PetscMPIInt>, std::set<PetscInt>> needs; /* by solving rank and owner */
  std::multimap<PetscInt, PetscMPIInt>                              byRows;
  std::vector<PetscInt>                                             all;
  std::vector<PetscMPIInt>                                          group;
  std::map<PetscMPIInt, PetscInt>                                   held, atRank;
  RowCount                                                          shares = {0, PETSC_MAX_INT, 0};

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(mesh.comm, &size));
  PetscCall(MatGetSize(C, &m, NULL));
  PetscCall(MatGetLocalSize(C, &rows, NULL));
  all.resize(size);
  PetscCallMPI(MPI_Allgather(&rows, 1, MPIU_INT, all.data(), 1, MPIU_INT, mesh.comm));
  for (PetscMPIInt r = 0; r < size; r++) byRows.emplace(-all[r], r);
  for (const auto &entry : byRows) group.push_back(entry.second);
  members = PetscMin(members, size);
  PetscCall(MatGetLayouts(C, NULL, &columns));
  for (PetscInt row = 0; row < m; row++) {
    const PetscMPIInt solver = group[row * members / m];
    const PetscInt   *c;
    PetscInt          n;

    held[solver]++;
    PetscCall(MatGetRow(natural, row, &n, &c, NULL));
    for (PetscInt i = 0; i < n; i++) {
      PetscMPIInt owner;

      PetscCall(PetscLayoutFindOwner(columns, 3 * mesh.number[c[i] / 3] + c[i] % 3, &owner));
      if (owner != solver) needs[{solver, owner}].insert(c[i]);
    }
    PetscCall(MatRestoreRow(natural, row, &n, &c, NULL));
  }
  for (const auto &need : needs) {
    messages += 2;
    scalars += 2 * (PetscInt)need.second.size();
    atRank[need.first.first] += 2;
    atRank[need.first.second] += 2;
  }
  for (const auto &entry : atRank) busiest = PetscMax(busiest, entry.second);
  for (const auto &entry : held) {
    shares.ranks++;
    shares.least = PetscMin(shares.least, entry.second);
    shares.most  = PetscMax(shares.most, entry.second);
  }
  PetscCall(Same(mesh.comm, "messages of C where S is", counted.together.messages, messages));
  PetscCall(Same(mesh.comm, "numbers sent of C where S is", counted.together.scalars, scalars));
  PetscCall(Same(mesh.comm, "messages at the busiest rank of C where S is", counted.together.busiest, busiest));
  PetscCall(Same(mesh.comm, "ranks that solve with S", counted.grouped.ranks, shares.ranks));
  PetscCall(Same(mesh.comm, "least rows of S", counted.grouped.least, shares.ranks ? shares.least : 0));
  PetscCall(Same(mesh.comm, "most rows of S", counted.grouped.most, shares.most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  CubesOptions options;
  CubesSystem  system;
  CubesMesh    mesh;
  PetscMPIInt  size;
  Mat          natural;
  Vec          g;
  PetscInt     m, rows;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(CubesOptionsGet(PETSC_COMM_WORLD, &options));
  PetscCall(CubesSystemCreate(PETSC_COMM_WORLD, options, &system));
  PetscCall(CubesMeshCreate(PETSC_COMM_SELF, options, &mesh));
  PetscCall(CubesAssembleContact(mesh, &natural, &g));
  PetscCall(CubesMeshPartition(&mesh, size));
  PetscCall(MatGetSize(natural, &m, NULL));
  for (PetscInt members = 1; members <= 3; members++) {
    Distribution counted;

    PetscCall(DistributionCount(mesh, size, natural, (m + members - 1) / members + (m ? 0 : 1), &counted));
    PetscCall(CheckTogether(system.mesh, system.C, natural, members, counted));
    if (members > 1) continue;
    PetscCall(MatGetLocalSize(system.A, &rows, NULL));
    PetscCall(CheckRows(system.mesh.comm, "rows of A", rows, counted.A));
    PetscCall(MatGetLocalSize(system.C, &rows, NULL));
    PetscCall(CheckRows(system.mesh.comm, "rows of C", rows, counted.C));
    PetscCall(CheckSpread(system.C, counted.spread));
  }
  PetscCall(VecDestroy(&g));
  PetscCall(MatDestroy(&natural));
  PetscCall(CubesSystemDestroy(&system));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "distribution: %" PetscInt_FMT " constraints, counts agree\n", m));
  PetscCall(PetscFinalize());
  return 0;
}
