#include "symbolic.h"
#include "../csr.h"

PetscErrorCode AinsworthTriangle::create(Mat M)
{
  IS                  order, same;
  const PetscInt     *old;
  AinsworthCSR        rows;
  std::vector<size_t> next;

  PetscFunctionBegin;
  PetscCall(rows.open(M));
  m = rows.n;
  PetscCall(MatGetOrdering(M, AinsworthOrdering, &order, &same));
  PetscCall(ISGetIndices(order, &old));
  number.resize(m);
  for (PetscInt i = 0; i < m; i++) number[old[i]] = i;
  PetscCall(ISRestoreIndices(order, &old));
  PetscCall(ISDestroy(&order));
  PetscCall(ISDestroy(&same));
  start.assign(m + 1, 0);
  diagonal.assign(m, 0.0);
  for (PetscInt i = 0; i < m; i++)
    for (PetscInt k = rows.ia[i]; k < rows.ia[i + 1]; k++)
      if (number[rows.ja[k]] < number[i]) start[number[i] + 1]++;
  for (PetscInt i = 0; i < m; i++) start[i + 1] += start[i];
  column.resize(start[m]);
  value.resize(start[m]);
  next.assign(start.begin(), start.end() - 1);
  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt k = rows.ia[i]; k < rows.ia[i + 1]; k++) {
      if (rows.ja[k] == i) diagonal[number[i]] = PetscRealPart(rows.a[k]);
      if (number[rows.ja[k]] >= number[i]) continue;
      column[next[number[i]]]  = number[rows.ja[k]];
      value[next[number[i]]++] = rows.a[k];
    }
  }
  PetscCall(rows.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Liu, ACM Trans. Math. Software 12 (1986) */
std::vector<PetscInt> AinsworthTriangle::eliminationTree() const
{
  std::vector<PetscInt> parent(m, -1), ancestor(m, -1);

  for (PetscInt row = 0; row < m; row++) {
    for (size_t k = start[row]; k < start[row + 1]; k++) {
      for (PetscInt i = column[k], up; i != -1 && i < row; i = up) {
        up          = ancestor[i];
        ancestor[i] = row;
        if (up == -1) parent[i] = row;
      }
    }
  }
  return parent;
}

/* AinsworthFactorOperations - multiplications and additions of a Cholesky factorization: the squares of the column counts of the factor */
PetscErrorCode AinsworthFactorOperations(Mat M, PetscReal *operations)
{
  AinsworthTriangle     triangle;
  std::vector<PetscInt> parent, count, last;

  PetscFunctionBegin;
  PetscCall(triangle.create(M));
  parent = triangle.eliminationTree();
  count.assign(triangle.m, 1); /* the diagonal */
  last.assign(triangle.m, -1);
  for (PetscInt row = 0; row < triangle.m; row++) { /* each row of the factor is a part of the tree, which is walked once */
    last[row] = row;
    for (size_t k = triangle.start[row]; k < triangle.start[row + 1]; k++) {
      for (PetscInt i = triangle.column[k]; last[i] != row; i = parent[i]) {
        count[i]++;
        last[i] = row;
      }
    }
  }
  *operations = 0.0;
  for (PetscInt entries : count) *operations += PetscSqr((PetscReal)entries);
  PetscFunctionReturn(PETSC_SUCCESS);
}
