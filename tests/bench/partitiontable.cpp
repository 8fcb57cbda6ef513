static char help[] = "How METIS spreads the rows of the two-cube problem over many ranks, and what one projection sends: from the mesh alone, on one rank.\n\n";

#include "distribution.h"

struct TableOptions {
  PetscInt  ranks[64], count, rowsPerRank;
  char      csv[PETSC_MAX_PATH_LEN];
  PetscBool write;
};

static PetscErrorCode TableOptionsGet(MPI_Comm comm, TableOptions *o)
{
  PetscBool given;

  PetscFunctionBeginUser;
  o->count       = PETSC_STATIC_ARRAY_LENGTH(o->ranks);
  o->rowsPerRank = 100000;
  PetscOptionsBegin(comm, NULL, "Table of the partition", NULL);
  PetscCall(PetscOptionsIntArray("-ranks", "Numbers of ranks to cut the mesh for (default: 32,64,128,256,512)", NULL, o->ranks, &o->count, &given));
  PetscCall(
    PetscOptionsInt("-rows_per_rank", "The Gram matrix is grouped on as few ranks as hold this many rows each", NULL, o->rowsPerRank, &o->rowsPerRank, NULL));
  PetscCall(PetscOptionsString("-csv", "Write the table to this file, too", NULL, "", o->csv, sizeof(o->csv), &o->write));
  PetscOptionsEnd();
  if (!given) {
    o->count = 5;
    for (PetscInt i = 0; i < o->count; i++) o->ranks[i] = 32 << i;
  }
  for (PetscInt i = 0; i < o->count; i++) {
    PetscCheck(o->ranks[i] >= 1 && o->ranks[i] <= 1000000, comm, PETSC_ERR_ARG_OUTOFRANGE,
               "Option -ranks has %" PetscInt_FMT ", each number must be between 1 and 1000000", o->ranks[i]);
  }
  PetscCheck(o->rowsPerRank >= 1, comm, PETSC_ERR_ARG_OUTOFRANGE, "Option -rows_per_rank is %" PetscInt_FMT ", it must be at least 1", o->rowsPerRank);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static double Mean(PetscInt total, const RowCount &count)
{
  return count.ranks ? (double)total / count.ranks : 0;
}

static PetscErrorCode ViewLine(PetscInt ranks, PetscInt n, PetscInt m, const Distribution &d)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_SELF,
                        "%6" PetscInt_FMT " %9.0f (%7" PetscInt_FMT " to %7" PetscInt_FMT ") %5" PetscInt_FMT " %7.0f (%6" PetscInt_FMT " to %6" PetscInt_FMT
                        ") %4" PetscInt_FMT " %9.0f %8" PetscInt_FMT " %9.0f %8" PetscInt_FMT " %9.0f\n",
                        ranks, Mean(n, d.A), d.A.least, d.A.most, d.C.ranks, Mean(m, d.C), d.C.least, d.C.most, d.grouped.ranks, Mean(m, d.grouped),
                        d.spread.messages, 1e-3 * d.spread.scalars * sizeof(PetscScalar), d.together.messages,
                        1e-3 * d.together.scalars * sizeof(PetscScalar)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteRowCount(FILE *file, const RowCount &count)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFPrintf(PETSC_COMM_SELF, file, ",%" PetscInt_FMT ",%" PetscInt_FMT ",%" PetscInt_FMT, count.ranks, count.least, count.most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteExchange(FILE *file, const Exchange &exchange)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFPrintf(PETSC_COMM_SELF, file, ",%" PetscInt_FMT ",%.0f,%" PetscInt_FMT, exchange.messages, (double)exchange.scalars * sizeof(PetscScalar),
                         exchange.busiest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Table(const CubesOptions &options, const TableOptions &table)
{
  FILE     *file = NULL;
  CubesMesh mesh;
  PetscInt  m, n;
  Mat       C;
  Vec       g;

  PetscFunctionBeginUser;
  PetscCall(CubesMeshCreate(PETSC_COMM_SELF, options, &mesh));
  PetscCall(CubesAssembleContact(mesh, &C, &g)); /* in one part: the system's numbers are the natural ones */
  PetscCall(VecDestroy(&g));
  PetscCall(MatGetSize(C, &m, &n));
  if (table.write) {
    PetscCall(PetscFOpen(PETSC_COMM_SELF, table.csv, "w", &file));
    PetscCall(PetscFPrintf(PETSC_COMM_SELF, file,
                           "ranks,unknowns,constraints,A_ranks,A_least,A_most,C_ranks,C_least,C_most,grouped_ranks,grouped_least,grouped_most,"
                           "spread_messages,spread_bytes,spread_busiest,together_messages,together_bytes,together_busiest\n"));
  }
  PetscCall(PetscPrintf(PETSC_COMM_SELF,
                        "%" PetscInt_FMT " unknowns, %" PetscInt_FMT " constraints; rows per rank: mean (least to most) of the ranks that have some\n"
                        " ranks rows of A                       ranks with rows of S           grouped on     spread: messages, kB  together: messages, kB\n",
                        n, m));
  for (PetscInt i = 0; i < table.count; i++) {
    const PetscMPIInt parts = (PetscMPIInt)table.ranks[i];
    Distribution      d;

    PetscCall(CubesMeshPartition(&mesh, parts));
    PetscCall(DistributionCount(mesh, parts, C, table.rowsPerRank, &d));
    PetscCall(ViewLine(parts, n, m, d));
    if (!file) continue;
    PetscCall(PetscFPrintf(PETSC_COMM_SELF, file, "%d,%" PetscInt_FMT ",%" PetscInt_FMT, (int)parts, n, m));
    PetscCall(WriteRowCount(file, d.A));
    PetscCall(WriteRowCount(file, d.C));
    PetscCall(WriteRowCount(file, d.grouped));
    PetscCall(WriteExchange(file, d.spread));
    PetscCall(WriteExchange(file, d.together));
    PetscCall(PetscFPrintf(PETSC_COMM_SELF, file, "\n"));
  }
  if (file) PetscCall(PetscFClose(PETSC_COMM_SELF, file));
  PetscCall(MatDestroy(&C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt  size;
  CubesOptions cubes;
  TableOptions table;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCheck(size == 1, PETSC_COMM_WORLD, PETSC_ERR_WRONG_MPI_SIZE, "This program runs on one rank; say for how many to cut the mesh by -ranks");
  PetscCall(CubesOptionsGet(PETSC_COMM_WORLD, &cubes));
  PetscCall(TableOptionsGet(PETSC_COMM_WORLD, &table));
  PetscCall(Table(cubes, table));
  PetscCall(PetscFinalize());
  return 0;
}
