#include "half.h"
#include <limits>

/*
   AinsworthTakeBlocks - copies the blocks of a level once: upper and in single precision, unless NULL, and those in
   ghost columns
*/
void AinsworthTakeBlocks(const AinsworthBlockMat &A, AinsworthUpperHalf<PetscScalar> *upper,
                         AinsworthUpperHalf<AinsworthSingle> *single, AinsworthBlockMat *outside)
{
  const AinsworthBlockRows &rows = A.rows;

  outside->cols = A.cols;
  outside->rows = AinsworthBlockRows(rows.br, rows.br);
  for (PetscInt i = 0; i < rows.n; i++, outside->rows.endRow()) {
    const PetscScalar *a = A.row(i);

    if (upper) upper->add(rows, a);
    if (single) single->add(rows, a);
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++, a += rows.size())
      if (rows.j[k] >= rows.n) AinsworthTakeBlock(rows.j[k], a, NULL, NULL, &outside->rows);
  }
}

/* AinsworthHalfTake - stores half of the blocks of a matrix */
void AinsworthHalfTake(const AinsworthBlockMat &A, AinsworthHalf *half)
{
  AinsworthUpperHalf<PetscScalar> upper(A.rows, NULL);

  AinsworthTakeBlocks(A, &upper, NULL, &half->outside);
  half->upper = upper.rows;
}

namespace
{
/* Block rows, and columns to which they are copied */
struct Term {
  const AinsworthBlockRows &rows;
  const AinsworthColumns   &from, &to;

  /* Returns the new place of a block, a large one beyond the end of the row */
  PetscInt place(PetscInt i, PetscInt k) const
  {
    return k < rows.i[i + 1] ? to.place(from.node(rows.j[k])) : std::numeric_limits<PetscInt>::max();
  }
};
} // namespace

/* Appends the sum of one row of two matrices, both with ascending columns */
static void AppendSum(const Term &A, const Term &B, PetscInt i, AinsworthBlockRows *sum)
{
  const PetscInt size = sum->size();
  PetscInt       k = A.rows.i[i], l = B.rows.i[i];

  while (k < A.rows.i[i + 1] || l < B.rows.i[i + 1]) {
    const PetscInt     a = A.place(i, k), b = B.place(i, l);
    const PetscScalar *first = a <= b ? A.rows.block(k++) : B.rows.block(l++);

    sum->j.push_back(PetscMin(a, b));
    sum->a.insert(sum->a.end(), first, first + size);
    if (a != b) continue;
    const PetscScalar *second = B.rows.block(l++);
    PetscScalar       *to     = &sum->a[sum->a.size() - size];
    for (PetscInt q = 0; q < size; q++) to[q] += second[q];
  }
  sum->endRow();
}

/* AinsworthHalfAdd - stores half of the sum of two matrices with the same nodes. Collective */
PetscErrorCode AinsworthHalfAdd(const AinsworthHalf &A, const AinsworthHalf &B, AinsworthHalf *sum)
{
  const AinsworthColumns &from = A.outside.cols, &other = B.outside.cols;
  AinsworthColumns       &to    = sum->outside.cols;
  auto                    upper = std::make_shared<AinsworthBlockRows>(A.upper->br, A.upper->bc);
  std::vector<PetscInt>   ghosts(from.ghosts);

  PetscFunctionBegin;
  ghosts.insert(ghosts.end(), other.ghosts.begin(), other.ghosts.end());
  AinsworthSortUnique(&ghosts);
  PetscCall(to.create(from.layout, std::move(ghosts)));
  sum->outside.rows = AinsworthBlockRows(upper->br, upper->bc);
  upper->j.reserve(A.upper->j.size() + B.upper->j.size());
  upper->a.reserve(A.upper->a.size() + B.upper->a.size());
  for (PetscInt i = 0; i < A.upper->n; i++) {
    AppendSum({*A.upper, from, to}, {*B.upper, other, to}, i, upper.get());
    AppendSum({A.outside.rows, from, to}, {B.outside.rows, other, to}, i, &sum->outside.rows);
  }
  upper->a.resize(upper->a.size() + 4, 0.0); /* loads of four may read beyond the last block */
  sum->upper = upper;
  PetscFunctionReturn(PETSC_SUCCESS);
}
