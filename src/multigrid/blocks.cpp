#include "blocks.h"
#include "../base/arrays.h"
#include <algorithm>

/* Creates the layout of the nodes, of which this rank owns `local`. Collective */
PetscErrorCode AinsworthLayoutCreate(MPI_Comm comm, PetscInt local, AinsworthLayout *nodes)
{
  PetscLayout layout;

  PetscFunctionBegin;
  PetscCall(PetscLayoutCreateFromSizes(comm, local, PETSC_DETERMINE, 1, &layout));
  nodes->reset(layout, [](PetscLayout l) { (void)PetscLayoutDestroy(&l); });
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the columns; nodes: the global numbers of the ghosts in ascending order. Collective */
PetscErrorCode AinsworthColumns::create(const AinsworthLayout &owned, std::vector<PetscInt> &&nodes)
{
  PetscFunctionBegin;
  layout = owned;
  first  = layout->rstart;
  local  = layout->rend - first;
  ghosts = std::move(nodes);
  if (layout->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFCreate(layout->comm, sf.out()));
  PetscCall(PetscSFSetGraphLayout(sf, layout.get(), (PetscInt)ghosts.size(), NULL, PETSC_COPY_VALUES, ghosts.data()));
  PetscCall(PetscSFSetUp(sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends values from owners to ghosts, one unit per node. Collective */
PetscErrorCode AinsworthColumns::toGhosts(MPI_Datatype unit, const void *owned, void *ghost) const
{
  PetscFunctionBegin;
  if (!sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFBcastBegin(sf, unit, owned, ghost, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, unit, owned, ghost, MPI_REPLACE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt AinsworthColumns::place(PetscInt node) const
{
  if (owns(node)) return node - first;
  return local + (PetscInt)(std::lower_bound(ghosts.begin(), ghosts.end(), node) - ghosts.begin());
}

/*
   AinsworthBlockMatAssemble - creates a matrix from pieces of the local rows; pieces in the same place are added.
   Collective
*/
PetscErrorCode AinsworthBlockMatAssemble(const AinsworthLayout &nodes, PetscInt bs,
                                         std::vector<std::vector<AinsworthPiece>> &pieces, AinsworthBlockMat *B)
{
  std::vector<PetscInt> ghosts;
  AinsworthBlockRows   &rows   = B->rows;
  size_t                blocks = 0;

  PetscFunctionBegin;
  for (const auto &row : pieces)
    for (const AinsworthPiece &piece : row)
      if (piece.node < nodes->rstart || piece.node >= nodes->rend) ghosts.push_back(piece.node);
  AinsworthSortUnique(&ghosts);
  PetscCall(B->cols.create(nodes, std::move(ghosts)));
  rows = AinsworthBlockRows(bs, bs);
  for (auto &row : pieces) {
    std::stable_sort(row.begin(), row.end(),
                     [](const AinsworthPiece &a, const AinsworthPiece &b) { return a.node < b.node; });
    for (size_t k = 0; k < row.size(); k++) blocks += k == 0 || row[k].node != row[k - 1].node;
  }
  rows.j.reserve(blocks);
  rows.a.reserve(blocks * bs * bs);
  for (auto &row : pieces) {
    for (auto piece = row.begin(); piece != row.end();) {
      const PetscInt node = piece->node;

      rows.j.push_back(B->cols.place(node));
      rows.a.resize(rows.a.size() + bs * bs, 0.0);
      PetscScalar *sum = &rows.a[rows.a.size() - bs * bs];
      for (; piece != row.end() && piece->node == node; ++piece)
        for (PetscInt p = 0; p < bs; p++)
          for (PetscInt q = 0; q < bs; q++)
            sum[p * bs + q] += piece->adjoint ? PetscConj(piece->values[q * bs + p]) : piece->values[p * bs + q];
    }
    rows.endRow();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBlocksToAIJ - converts block rows, with columns ascending by node number, to AIJ with the sizes of another
   matrix. Collective
*/
PetscErrorCode AinsworthBlocksToAIJ(const AinsworthBlockRows &rows, const AinsworthColumns &cols, Mat like, Mat *aij)
{
  PetscInt                 m, n, M, N;
  std::vector<PetscInt>    i = {0}, j;
  std::vector<PetscScalar> a;

  PetscFunctionBegin;
  for (PetscInt l = 0; l < rows.n * rows.br; l++) {
    for (PetscInt k = rows.i[l / rows.br]; k < rows.i[l / rows.br + 1]; k++) {
      const PetscScalar *row = rows.block(k) + l % rows.br * rows.bc;

      for (PetscInt c = 0; c < rows.bc; c++) j.push_back(cols.node(rows.j[k]) * rows.bc + c);
      a.insert(a.end(), row, row + rows.bc);
    }
    i.push_back((PetscInt)j.size());
  }
  PetscCall(MatGetLocalSize(like, &m, &n));
  PetscCall(MatGetSize(like, &M, &N));
  PetscCall(MatCreate(PetscObjectComm((PetscObject)like), aij));
  PetscCall(MatSetSizes(*aij, m, n, M, N));
  PetscCall(MatSetBlockSizes(*aij, rows.br, rows.bc));
  PetscCall(MatSetType(*aij, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(*aij, i.data(), j.data(), a.data()));
  PetscCall(MatMPIAIJSetPreallocationCSR(*aij, i.data(), j.data(), a.data()));
  PetscFunctionReturn(PETSC_SUCCESS);
}
