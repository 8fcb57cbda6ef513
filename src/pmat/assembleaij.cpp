#include "sum.h"
#include <algorithm>

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
