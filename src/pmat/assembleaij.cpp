#include "sum.h"
#include <limits>

void AinsworthNode::compute(AinsworthPart &part, PetscInt first)
{
  if (bs == 1) {
    rows[0] = part.row(first);
    return;
  }
  for (PetscInt k = 0; k < bs; k++) {
    const AinsworthRow row = part.row(first + k);
    given[k].assign(row.columns, row.columns + row.n);
    givenValues[k].assign(row.values, row.values + row.n);
  }
  turn();
  for (PetscInt k = 0; k < bs; k++) rows[k] = {columns.data(), values[k].data(), (PetscInt)columns.size()};
}

/* Entries of each row of the node */
PetscInt AinsworthNode::count(AinsworthPart &part, PetscInt first)
{
  compute(part, first);
  return rows[0].n;
}

/* T M T', block after block, wherever a row has an entry in it */
void AinsworthNode::turn()
{
  size_t at[3] = {0, 0, 0};

  columns.clear();
  for (PetscInt k = 0; k < bs; k++) values[k].clear();
  while (true) {
    PetscInt    block   = std::numeric_limits<PetscInt>::max();
    PetscScalar M[3][3] = {{0.0}}, MT[3][3];

    for (PetscInt k = 0; k < bs; k++)
      if (at[k] < given[k].size()) block = PetscMin(block, given[k][at[k]] / bs);
    if (block == std::numeric_limits<PetscInt>::max()) break;
    for (PetscInt k = 0; k < bs; k++)
      for (; at[k] < given[k].size() && given[k][at[k]] / bs == block; at[k]++) M[k][given[k][at[k]] % bs] = givenValues[k][at[k]];
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
