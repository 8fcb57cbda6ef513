#include "sum.h"

/* One part as a SeqAIJ with exact preallocation, its rows copied and not searched */
static PetscErrorCode AssemblePart(AinsworthPart &part, PetscInt n, PetscInt ncols, PetscInt bs, PetscInt cbs, Mat *M)
{
  std::vector<PetscInt> nnz(n);

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++) nnz[i] = part.row(i).n;
  PetscCall(MatCreate(PETSC_COMM_SELF, M));
  PetscCall(MatSetSizes(*M, n, ncols, n, ncols));
  PetscCall(MatSetBlockSizes(*M, bs, cbs));
  PetscCall(MatSetType(*M, MATSEQAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*M, 0, nnz.data()));
  PetscCall(MatSetOption(*M, MAT_SORTED_FULL, PETSC_TRUE));
  for (PetscInt i = 0; i < n; i++) {
    const AinsworthRow row = part.row(i);

    PetscCall(MatSetValues(*M, 1, &i, row.n, row.columns, row.values, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(*M, MAT_SORTED_FULL, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sum as n x n AIJ */
PetscErrorCode AinsworthAssembleAIJ(AinsworthSum *sum, Mat *M)
{
  Mat      inside, outside;
  PetscInt bs;

  PetscFunctionBegin;
  PetscCall(MatGetBlockSize(sum->A, &bs));
  PetscCall(AssemblePart(sum->inside, sum->n, sum->n, bs, bs, &inside));
  if (sum->parallel) {
    PetscCall(AssemblePart(sum->outside, sum->n, (PetscInt)sum->ghosts.size(), bs, 1, &outside));
    PetscCall(AinsworthMatCreateMPIAIJ(PetscObjectComm((PetscObject)sum->A), inside, outside, (PetscInt)sum->ghosts.size(), sum->ghosts.data(), M));
  } else *M = inside;
  PetscFunctionReturn(PETSC_SUCCESS);
}
