#include "sum.h"
#include <algorithm>

#if defined(PETSC_HAVE_HYPRE)
  #include <petscmathypre.h>
  #include <HYPRE_IJ_mv.h>
  #include <HYPRE.h>

namespace
{
/* Some rows on their way into hypre, which takes many at a time */
class Batch {
public:
  explicit Batch(HYPRE_IJMatrix m) : ij(m) { }
  void           add(const AinsworthRow &row, PetscInt shift, const std::vector<PetscInt> *map);
  void           close(PetscInt row);
  PetscErrorCode flush();
  bool           full() const { return rows.size() >= 512; }

private:
  HYPRE_IJMatrix             ij;
  size_t                     begin = 0, end = 0; /* of the row that is open */
  std::vector<HYPRE_Int>     ncols;
  std::vector<HYPRE_BigInt>  rows, columns;
  std::vector<HYPRE_Complex> values;
};

/* Every entry of M_* comes through here: room is made for many rows at a time */
void Batch::add(const AinsworthRow &row, PetscInt shift, const std::vector<PetscInt> *map)
{
  if (end + row.n > columns.size()) {
    columns.resize(2 * (end + row.n));
    values.resize(columns.size());
  }
  HYPRE_BigInt *column = columns.data() + end;
  if (map)
    for (PetscInt k = 0; k < row.n; k++) column[k] = (*map)[row.columns[k]];
  else
    for (PetscInt k = 0; k < row.n; k++) column[k] = row.columns[k] + shift;
  std::copy_n(row.values, row.n, values.data() + end);
  end += row.n;
}

void Batch::close(PetscInt row)
{
  rows.push_back(row);
  ncols.push_back((HYPRE_Int)(end - begin));
  begin = end;
}

PetscErrorCode Batch::flush()
{
  PetscFunctionBegin;
  if (rows.size()) PetscCallExternal(HYPRE_IJMatrixSetValues, ij, (HYPRE_Int)rows.size(), ncols.data(), rows.data(), columns.data(), values.data());
  begin = end = 0;
  ncols.clear();
  rows.clear();
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

static PetscErrorCode DestroyIJMatrix(AinsworthContext ij)
{
  PetscFunctionBegin;
  PetscCallExternal(HYPRE_IJMatrixDestroy, (HYPRE_IJMatrix)AinsworthContextGet(ij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows go into hypre's own storage at once: its exact sizes are known, so that nothing is stored twice on the way */
static PetscErrorCode FillIJMatrix(AinsworthSum *sum, HYPRE_IJMatrix ij)
{
  Batch                  batch(ij);
  std::vector<HYPRE_Int> inside(sum->n), outside(sum->n, 0);
  PetscInt               rstart;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(sum->A, &rstart, NULL));
  for (PetscInt i = 0; i < sum->n; i++) {
    inside[i] = (HYPRE_Int)sum->inside.row(i).n;
    if (sum->parallel) outside[i] = (HYPRE_Int)sum->outside.row(i).n;
  }
  PetscCallExternal(HYPRE_IJMatrixSetDiagOffdSizes, ij, inside.data(), outside.data());
  PetscCallExternal(HYPRE_IJMatrixSetMaxOffProcElmts, ij, 0);
  PetscCallExternal(HYPRE_IJMatrixInitialize, ij);
  for (PetscInt i = 0; i < sum->n; i++) {
    batch.add(sum->inside.row(i), rstart, NULL);
    if (sum->parallel) batch.add(sum->outside.row(i), 0, &sum->ghosts);
    batch.close(rstart + i);
    if (batch.full()) PetscCall(batch.flush());
  }
  PetscCall(batch.flush());
  PetscCallExternal(HYPRE_IJMatrixAssemble, ij);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MatCreateFromParCSR() gives a rank without rows one */
static PetscErrorCode HasEmptyRank(Mat A, bool *empty)
{
  const PetscInt *ranges;
  PetscMPIInt     size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)A), &size));
  PetscCall(MatGetOwnershipRanges(A, &ranges));
  *empty = false;
  for (PetscMPIInt r = 0; r < size; r++) *empty = *empty || ranges[r] == ranges[r + 1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sum as n x n MATHYPRE: PCHYPRE takes it as it is. Where a rank has no rows: AIJ, of which PCHYPRE makes a copy */
PetscErrorCode AinsworthAssembleHypre(AinsworthSum *sum, Mat *M)
{
  MPI_Comm            comm = PetscObjectComm((PetscObject)sum->A);
  PetscInt            rstart, rend, bs;
  HYPRE_IJMatrix      ij;
  hypre_ParCSRMatrix *rows;
  PetscContainer      owner;
  bool                empty;

  PetscFunctionBegin;
  PetscCall(HasEmptyRank(sum->A, &empty));
  if (empty) {
    PetscCall(AinsworthAssembleAIJ(sum, M));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetOwnershipRange(sum->A, &rstart, &rend));
  PetscCall(MatGetBlockSize(sum->A, &bs));
  PetscCallExternal(HYPRE_IJMatrixCreate, comm, rstart, rend - 1, rstart, rend - 1, &ij);
  PetscCallExternal(HYPRE_IJMatrixSetObjectType, ij, HYPRE_PARCSR);
  PetscCall(FillIJMatrix(sum, ij));
  PetscCallExternal(HYPRE_IJMatrixGetObject, ij, (void **)&rows);
  PetscCall(MatCreateFromParCSR(rows, MATHYPRE, PETSC_USE_POINTER, M));
  PetscCall(MatSetBlockSize(*M, bs)); /* BoomerAMG's number of functions */
  PetscCall(PetscContainerCreate(comm, &owner));
  PetscCall(PetscContainerSetPointer(owner, ij));
  PetscCall(PetscContainerSetCtxDestroy(owner, DestroyIJMatrix));
  PetscCall(PetscObjectCompose((PetscObject)*M, "AinsworthIJMatrix", (PetscObject)owner));
  PetscCall(PetscContainerDestroy(&owner));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#else
PetscErrorCode AinsworthAssembleHypre(AinsworthSum *sum, Mat *)
{
  SETERRQ(PetscObjectComm((PetscObject)sum->A), PETSC_ERR_SUP_SYS, "PETSc was built without hypre");
}
#endif
