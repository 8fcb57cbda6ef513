#include "sum.h"
#include <algorithm>

void AinsworthNode::read(AinsworthPart &part, PetscInt first)
{
  for (PetscInt k = 0; k < bs; k++) given[k] = part.row(first + k, k);
}

void AinsworthNode::compute(AinsworthPart &part, PetscInt first)
{
  read(part, first);
  if (bs == 1) rows[0] = given[0];
  else if (bs == 2) turn<2>();
  else turn<3>();
}

/* Entries of each row of the node */
PetscInt AinsworthNode::count(AinsworthPart &part, PetscInt first)
{
  read(part, first);
  if (bs == 1) return given[0].n;
  return bs == 2 ? width<2>() : width<3>();
}

/* The next block column where one of the rows has an entry, N: the components of a node */
template <PetscInt N>
static bool NextBlock(const AinsworthRow given[], const PetscInt at[], PetscInt *block)
{
  bool found = false;

  for (PetscInt k = 0; k < N; k++) {
    if (at[k] == given[k].n) continue;
    const PetscInt mine = given[k].columns[at[k]] / N;
    *block              = found ? PetscMin(*block, mine) : mine;
    found               = true;
  }
  return found;
}

template <PetscInt N>
PetscInt AinsworthNode::width() const
{
  PetscInt at[N] = {}, block, n = 0;

  for (; NextBlock<N>(given, at, &block); n += N)
    for (PetscInt k = 0; k < N; k++)
      while (at[k] < given[k].n && given[k].columns[at[k]] < (block + 1) * N) at[k]++;
  return n;
}

/* T M T', block after block, wherever a row has an entry in it */
template <PetscInt N>
void AinsworthNode::turn()
{
  const auto &T     = frame->T;
  PetscInt    at[N] = {}, block, n = 0, most = 0;

  for (PetscInt k = 0; k < N; k++) most += N * given[k].n;
  if ((size_t)most > columns.size()) {
    columns.resize(most);
    for (PetscInt k = 0; k < N; k++) values[k].resize(most);
  }
  for (; NextBlock<N>(given, at, &block); n += N) {
    PetscScalar M[N][N] = {}, MT[N][N] = {};

    for (PetscInt k = 0; k < N; k++)
      for (; at[k] < given[k].n && given[k].columns[at[k]] < (block + 1) * N; at[k]++) M[k][given[k].columns[at[k]] - block * N] = given[k].values[at[k]];
    for (PetscInt k = 0; k < N; k++)
      for (PetscInt l = 0; l < N; l++)
        for (PetscInt j = 0; j < N; j++) MT[k][l] += M[k][j] * T[l][j];
    for (PetscInt k = 0; k < N; k++) {
      columns[n + k] = block * N + k;
      for (PetscInt l = 0; l < N; l++) {
        PetscScalar sum = 0.0;
        for (PetscInt j = 0; j < N; j++) sum += T[k][j] * MT[j][l];
        values[k][n + l] = sum;
      }
    }
  }
  for (PetscInt k = 0; k < N; k++) rows[k] = {columns.data(), values[k].data(), n};
}

/* One part as a SeqAIJ with exact preallocation, its rows copied and not searched */
static PetscErrorCode AssemblePart(AinsworthPart &part, const AinsworthFrame *frame, PetscInt n, PetscInt ncols, PetscInt bs, PetscInt cbs, Mat *M)
{
  AinsworthNode         node(frame);
  std::vector<PetscInt> nnz(n);

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i += node.bs) std::fill_n(&nnz[i], node.bs, node.count(part, i));
  PetscCall(MatCreate(PETSC_COMM_SELF, M));
  PetscCall(MatSetSizes(*M, n, ncols, n, ncols));
  PetscCall(MatSetBlockSizes(*M, bs, cbs));
  PetscCall(MatSetType(*M, MATSEQAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*M, 0, nnz.data()));
  PetscCall(MatSetOption(*M, MAT_SORTED_FULL, PETSC_TRUE));
  for (PetscInt i = 0; i < n; i += node.bs) {
    node.compute(part, i);
    for (PetscInt k = 0; k < node.bs; k++) {
      const PetscInt row = i + k;
      PetscCall(MatSetValues(*M, 1, &row, node.rows[k].n, node.rows[k].columns, node.rows[k].values, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(*M, MAT_SORTED_FULL, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sum as n x n AIJ, in the frame; the local sizes of A are multiples of the frame's */
PetscErrorCode AinsworthAssembleAIJ(AinsworthSum *sum, const AinsworthFrame *frame, Mat *M)
{
  Mat      inside, outside;
  PetscInt bs;

  PetscFunctionBegin;
  PetscCall(MatGetBlockSize(sum->A, &bs));
  PetscCall(AssemblePart(sum->inside, frame, sum->n, sum->n, bs, bs, &inside));
  if (sum->parallel) {
    PetscCall(AssemblePart(sum->outside, frame, sum->n, (PetscInt)sum->ghosts.size(), bs, 1, &outside));
    PetscCall(MatCreateMPIAIJWithSeqAIJ(PetscObjectComm((PetscObject)sum->A), inside, outside, sum->ghosts.data(), M));
  } else *M = inside;
  PetscFunctionReturn(PETSC_SUCCESS);
}
