#include "sum.h"
#include <vector>

namespace
{
/* One row of A + E: ascending columns and values */
struct Row {
  std::vector<PetscInt>    columns;
  std::vector<PetscScalar> values;
  PetscErrorCode           merge(Mat A, Mat E, PetscInt row);
};

PetscErrorCode Row::merge(Mat A, Mat E, PetscInt row)
{
  PetscInt           na, ne, a = 0, e = 0, n = 0;
  const PetscInt    *ca, *ce;
  const PetscScalar *va, *ve;

  PetscFunctionBegin;
  PetscCall(MatGetRow(A, row, &na, &ca, &va));
  PetscCall(MatGetRow(E, row, &ne, &ce, &ve));
  columns.resize(na + ne);
  values.resize(na + ne);
  while (a < na || e < ne) {
    if (e == ne || (a < na && ca[a] < ce[e])) {
      columns[n]  = ca[a];
      values[n++] = va[a++];
    } else if (a == na || ce[e] < ca[a]) {
      columns[n]  = ce[e];
      values[n++] = ve[e++];
    } else {
      columns[n]  = ca[a];
      values[n++] = va[a++] + ve[e++];
    }
  }
  columns.resize(n);
  values.resize(n);
  PetscCall(MatRestoreRow(E, row, &ne, &ce, &ve));
  PetscCall(MatRestoreRow(A, row, &na, &ca, &va));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of one node of T (A + E) T', dense by blocks; without a frame a single row */
class Node {
public:
  explicit Node(const AinsworthFrame *f) : frame(f), bs(f->bs ? f->bs : 1) { }
  PetscErrorCode compute(Mat A, Mat E, PetscInt first);

  const AinsworthFrame                 *frame;
  const PetscInt                        bs;
  std::vector<PetscInt>                 columns;
  std::vector<std::vector<PetscScalar>> values; /* of each of the bs rows */

private:
  std::vector<Row> rows;
};

PetscErrorCode Node::compute(Mat A, Mat E, PetscInt first)
{
  std::vector<size_t> at(bs, 0);

  PetscFunctionBegin;
  rows.resize(bs);
  values.resize(bs);
  for (PetscInt k = 0; k < bs; k++) PetscCall(rows[k].merge(A, E, first + k));
  if (!frame->bs) {
    columns.swap(rows[0].columns);
    values[0].swap(rows[0].values);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  columns.clear();
  for (std::vector<PetscScalar> &v : values) v.clear();
  while (true) { /* block after block, wherever a row has an entry in it */
    PetscInt    block   = PETSC_MAX_INT;
    PetscScalar M[3][3] = {{0.0}}, MT[3][3];

    for (PetscInt k = 0; k < bs; k++)
      if (at[k] < rows[k].columns.size()) block = PetscMin(block, rows[k].columns[at[k]] / bs);
    if (block == PETSC_MAX_INT) break;
    for (PetscInt k = 0; k < bs; k++)
      for (; at[k] < rows[k].columns.size() && rows[k].columns[at[k]] / bs == block; at[k]++) M[k][rows[k].columns[at[k]] % bs] = rows[k].values[at[k]];
    for (PetscInt k = 0; k < bs; k++) {
      for (PetscInt l = 0; l < bs; l++) {
        MT[k][l] = 0.0;
        for (PetscInt j = 0; j < bs; j++) MT[k][l] += M[k][j] * frame->T[l][j];
      }
    }
    for (PetscInt l = 0; l < bs; l++) columns.push_back(block * bs + l);
    for (PetscInt k = 0; k < bs; k++) {
      for (PetscInt l = 0; l < bs; l++) {
        PetscScalar sum = 0.0;
        for (PetscInt j = 0; j < bs; j++) sum += frame->T[k][j] * MT[j][l];
        values[k].push_back(sum);
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

/* ||A + E||_inf, which is the 1-norm where both are symmetric; PETSc's own 1-norm stores a row of the matrix on every rank */
PetscErrorCode AinsworthSumNorm(Mat A, Mat E, PetscReal *norm)
{
  PetscInt  rstart, rend;
  PetscReal largest = 0.0;
  Row       row;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscReal sum = 0.0;
    PetscCall(row.merge(A, E, i));
    for (const PetscScalar &v : row.values) sum += PetscAbsScalar(v);
    largest = PetscMax(largest, sum);
  }
  PetscCall(MPIU_Allreduce(&largest, norm, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Does a row of E have entries? Most have none, and those rows of A are taken over as they stand */
static PetscErrorCode RowIsEmpty(Mat E, PetscInt row, bool *empty)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(MatGetRow(E, row, &n, NULL, NULL));
  *empty = n == 0;
  PetscCall(MatRestoreRow(E, row, &n, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Entries of each row in the diagonal block and outside, of T (A + E) T' */
static PetscErrorCode CountEntries(Mat A, Mat E, Node &node, PetscInt dnnz[], PetscInt onnz[])
{
  PetscInt rstart, rend, cstart, cend;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &rstart, &rend));
  PetscCall(MatGetOwnershipRangeColumn(A, &cstart, &cend));
  for (PetscInt i = rstart; i < rend; i += node.bs) {
    const PetscInt *columns = nullptr;
    PetscInt        n = 0, inside = 0;
    bool            asis;

    PetscCall(RowIsEmpty(E, i, &asis));
    asis = asis && !node.frame->bs;
    if (asis) PetscCall(MatGetRow(A, i, &n, &columns, NULL));
    else {
      PetscCall(node.compute(A, E, i));
      n       = (PetscInt)node.columns.size();
      columns = node.columns.data();
    }
    for (PetscInt k = 0; k < n; k++) inside += columns[k] >= cstart && columns[k] < cend;
    for (PetscInt k = 0; k < node.bs; k++) {
      dnnz[i - rstart + k] = inside;
      onnz[i - rstart + k] = n - inside;
    }
    if (asis) PetscCall(MatRestoreRow(A, i, &n, &columns, NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* T (A + E) T' with exact preallocation; the local sizes of A are multiples of the frame's */
PetscErrorCode AinsworthSum(Mat A, Mat E, const AinsworthFrame *frame, Mat *sum)
{
  Mat       M;
  PetscInt  rstart, rend, n, N, bs, *dnnz, *onnz;
  PetscBool sequential;
  Node      node(frame);

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &rstart, &rend));
  PetscCall(MatGetSize(A, &N, NULL));
  PetscCall(MatGetBlockSize(A, &bs));
  n = rend - rstart;
  PetscCall(PetscMalloc2(n, &dnnz, n, &onnz));
  PetscCall(CountEntries(A, E, node, dnnz, onnz));
  PetscCall(MatCreate(PetscObjectComm((PetscObject)A), &M));
  PetscCall(MatSetSizes(M, n, n, N, N));
  PetscCall(MatSetBlockSize(M, bs));
  PetscCall(MatSetType(M, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(M, 0, dnnz));
  PetscCall(MatMPIAIJSetPreallocation(M, 0, dnnz, 0, onnz));
  PetscCall(PetscFree2(dnnz, onnz));
  PetscCall(MatSetOption(M, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)M, MATSEQAIJ, &sequential));
  if (sequential) PetscCall(MatSetOption(M, MAT_SORTED_FULL, PETSC_TRUE)); /* rows are copied, not searched */
  for (PetscInt i = rstart; i < rend; i += node.bs) {
    bool asis;

    PetscCall(RowIsEmpty(E, i, &asis));
    if (asis && !frame->bs) {
      PetscInt           ncols;
      const PetscInt    *columns;
      const PetscScalar *values;

      PetscCall(MatGetRow(A, i, &ncols, &columns, &values));
      PetscCall(MatSetValues(M, 1, &i, ncols, columns, values, INSERT_VALUES));
      PetscCall(MatRestoreRow(A, i, &ncols, &columns, &values));
      continue;
    }
    PetscCall(node.compute(A, E, i));
    for (PetscInt k = 0; k < node.bs; k++) {
      const PetscInt row = i + k;
      PetscCall(MatSetValues(M, 1, &row, (PetscInt)node.columns.size(), node.columns.data(), node.values[k].data(), INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  if (sequential) PetscCall(MatSetOption(M, MAT_SORTED_FULL, PETSC_FALSE));
  *sum = M;
  PetscFunctionReturn(PETSC_SUCCESS);
}
