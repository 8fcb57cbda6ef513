#include "half.h"

/* AinsworthTakeBlocks - copies the blocks of a level once: the upper half, and those in ghost columns */
template <class T>
void AinsworthTakeBlocks(const AinsworthBlockMat &A, AinsworthUpperHalf<T> *upper, AinsworthBlockMat *outside)
{
  const AinsworthBlockRows &rows = A.rows;

  outside->cols = A.cols;
  outside->rows = AinsworthBlockRows(rows.br, rows.br);
  for (PetscInt i = 0; i < rows.n; i++, outside->rows.endRow()) {
    const PetscScalar *a = A.row(i);

    upper->add(rows, a);
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++, a += rows.size())
      if (rows.j[k] >= rows.n) AinsworthTakeBlock(rows.j[k], a, NULL, NULL, &outside->rows);
  }
}

template void AinsworthTakeBlocks(const AinsworthBlockMat &, AinsworthUpperHalf<AinsworthSingle> *,
                                  AinsworthBlockMat *);

/* AinsworthHalfRound - returns half of a matrix in single precision, scaled by w on both sides */
std::shared_ptr<const AinsworthBlockRowsOf<AinsworthSingle>> AinsworthHalfRound(const AinsworthBlockRows &upper,
                                                                                const PetscReal          *w)
{
  auto           rounded = std::make_shared<AinsworthBlockRowsOf<AinsworthSingle>>(upper.br, upper.br);
  const PetscInt bs      = upper.br;

  rounded->a.reserve(upper.a.size());
  for (PetscInt i = 0; i < upper.n; i++)
    for (PetscInt k = upper.i[i]; k < upper.i[i + 1]; k++)
      AinsworthTakeBlock(upper.j[k], upper.block(k), w + (size_t)i * bs, w + (size_t)upper.j[k] * bs, rounded.get());
  rounded->n = upper.n;
  rounded->i = upper.i;
  rounded->a.resize(upper.a.size(), AinsworthSingle(0));
  return rounded;
}

/* AinsworthHalfTake - stores half of the blocks of a matrix */
void AinsworthHalfTake(const AinsworthBlockMat &A, AinsworthHalf *half)
{
  AinsworthUpperHalf<PetscScalar> upper(A.rows, NULL);

  AinsworthTakeBlocks(A, &upper, &half->outside);
  half->upper = upper.rows;
}

/* AinsworthHalfAdd - stores half of the sum of two matrices with the same nodes. Collective */
PetscErrorCode AinsworthHalfAdd(const AinsworthHalf &A, const AinsworthHalf &B, AinsworthHalf *sum)
{
  std::vector<std::vector<AinsworthPiece>> pieces(A.upper->n);

  PetscFunctionBegin;
  for (const AinsworthHalf *X : {&A, &B})
    for (const AinsworthBlockRows *rows : {X->upper.get(), &X->outside.rows})
      for (PetscInt i = 0; i < rows->n; i++)
        for (PetscInt k = rows->i[i]; k < rows->i[i + 1]; k++)
          pieces[i].push_back({X->outside.cols.node(rows->j[k]), rows->block(k), false});
  PetscCall(AinsworthHalfAssemble(A.outside.cols.layout, A.upper->br, pieces, sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}
