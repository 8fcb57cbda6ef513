#include "symbolic.h"

/* The elimination tree: Liu, ACM Trans. Math. Software 12 (1986) */
std::vector<PetscInt> AinsworthEliminationTree(const AinsworthPattern &t)
{
  std::vector<PetscInt> parent(t.m, -1), ancestor(t.m, -1);

  for (PetscInt row = 0; row < t.m; row++) {
    for (size_t k = t.start[row]; k < t.start[row + 1]; k++) {
      for (PetscInt i = t.column[k], up; i != -1 && i < row; i = up) {
        up          = ancestor[i];
        ancestor[i] = row;
        if (up == -1) parent[i] = row;
      }
    }
  }
  return parent;
}

/* The lower triangle of a sequential M whose row i gets the number number[i] */
static PetscErrorCode CreatePattern(Mat M, const std::vector<PetscInt> &number, AinsworthPattern *t)
{
  PetscInt            rows;
  const PetscInt     *ia, *ja;
  PetscBool           done;
  std::vector<size_t> next;

  PetscFunctionBegin;
  PetscCall(MatGetRowIJ(M, 0, PETSC_FALSE, PETSC_FALSE, &rows, &ia, &ja, &done));
  t->m = rows; /* which the restoring sets to 0 */
  PetscAssert(done, PETSC_COMM_SELF, PETSC_ERR_PLIB, "The Gram matrix is not AIJ");
  t->start.assign(t->m + 1, 0);
  for (PetscInt i = 0; i < t->m; i++)
    for (PetscInt k = ia[i]; k < ia[i + 1]; k++)
      if (number[ja[k]] < number[i]) t->start[number[i] + 1]++;
  for (PetscInt i = 0; i < t->m; i++) t->start[i + 1] += t->start[i];
  t->column.resize(t->start[t->m]);
  next.assign(t->start.begin(), t->start.end() - 1);
  for (PetscInt i = 0; i < t->m; i++)
    for (PetscInt k = ia[i]; k < ia[i + 1]; k++)
      if (number[ja[k]] < number[i]) t->column[next[number[i]]++] = number[ja[k]];
  PetscCall(MatRestoreRowIJ(M, 0, PETSC_FALSE, PETSC_FALSE, &rows, &ia, &ja, &done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Entries of each column of the factor, the diagonal included: each row of it is a part of the tree, which is walked once */
static std::vector<PetscInt> CountColumns(const AinsworthPattern &t)
{
  const std::vector<PetscInt> parent = AinsworthEliminationTree(t);
  std::vector<PetscInt>       count(t.m, 1), last(t.m, -1);

  for (PetscInt row = 0; row < t.m; row++) {
    last[row] = row;
    for (size_t k = t.start[row]; k < t.start[row + 1]; k++) {
      for (PetscInt i = t.column[k]; last[i] != row; i = parent[i]) {
        count[i]++;
        last[i] = row;
      }
    }
  }
  return count;
}

/* AinsworthFactorOperations - multiplications and additions of a Cholesky factorisation of a sequential AIJ matrix in this ordering */
PetscErrorCode AinsworthFactorOperations(Mat M, MatOrderingType ordering, PetscReal *operations)
{
  PetscInt              m;
  IS                    order, same;
  const PetscInt       *old;
  std::vector<PetscInt> number;
  AinsworthPattern      pattern;

  PetscFunctionBegin;
  PetscCall(MatGetSize(M, &m, NULL));
  PetscCall(MatGetOrdering(M, ordering, &order, &same));
  PetscCall(ISGetIndices(order, &old));
  number.resize(m);
  for (PetscInt i = 0; i < m; i++) number[old[i]] = i;
  PetscCall(ISRestoreIndices(order, &old));
  PetscCall(ISDestroy(&order));
  PetscCall(ISDestroy(&same));
  PetscCall(CreatePattern(M, number, &pattern));
  *operations = 0.0;
  for (PetscInt count : CountColumns(pattern)) *operations += PetscSqr((PetscReal)count);
  PetscFunctionReturn(PETSC_SUCCESS);
}
