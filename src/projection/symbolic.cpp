#include "symbolic.h"
#include "../base/csr.h"
#include "../base/lists.h"
#include "../base/objects.h"

namespace
{
/* The symmetric pattern of a sequential matrix in an ordering */
struct Pattern {
  AinsworthCSR          rows;
  std::vector<PetscInt> old, number; /* old: row of the matrix at each position; number: position of each row */

  PetscErrorCode        open(Mat, IS);
  std::vector<PetscInt> eliminationTree() const;
  std::vector<PetscInt> columnCounts(const std::vector<PetscInt> &parent) const;
};

PetscErrorCode Pattern::open(Mat M, IS order)
{
  PetscFunctionBegin;
  PetscCall(rows.open(M));
  number.resize(rows.n);
  PetscCall(AinsworthISToList(order, &old));
  for (PetscInt i = 0; i < rows.n; i++) number[old[i]] = i;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* J. W. H. Liu, ACM Trans. Math. Software 12 (1986) */
std::vector<PetscInt> Pattern::eliminationTree() const
{
  std::vector<PetscInt> parent(rows.n, -1), ancestor(rows.n, -1);

  for (PetscInt row = 0; row < rows.n; row++) {
    for (PetscInt k = rows.ia[old[row]]; k < rows.ia[old[row] + 1]; k++) {
      for (PetscInt i = number[rows.ja[k]], up; i != -1 && i < row; i = up) {
        up          = ancestor[i];
        ancestor[i] = row;
        if (up == -1) parent[i] = row;
      }
    }
  }
  return parent;
}

/* Orders children before their parents, with the descendants of each node contiguous */
std::vector<PetscInt> Postorder(const std::vector<PetscInt> &parent)
{
  const PetscInt        n = (PetscInt)parent.size();
  std::vector<PetscInt> child(n + 1, -1), sibling(n, -1), order, path; /* child[n] heads the list of roots */

  for (PetscInt i = n - 1; i >= 0; i--) {
    const PetscInt up = parent[i] < 0 ? n : parent[i];

    sibling[i] = child[up];
    child[up]  = i;
  }
  path.push_back(n);
  while (path.size()) {
    const PetscInt top = path.back(), next = child[top];

    if (next >= 0) {
      child[top] = sibling[next];
      path.push_back(next);
    } else {
      if (top < n) order.push_back(top);
      path.pop_back();
    }
  }
  return order;
}

/*
   Gilbert, Ng and Peyton, SIAM J. Matrix Anal. Appl. 15 (1994): a row of the factor is a subtree, and only its leaves
   need to be visited
*/
std::vector<PetscInt> Pattern::columnCounts(const std::vector<PetscInt> &parent) const
{
  const std::vector<PetscInt> order = Postorder(parent);
  std::vector<PetscInt>       count(rows.n, 1), first(rows.n, -1), seen(rows.n, -1), leaf(rows.n, -1), ancestor(rows.n);

  for (PetscInt k = 0; k < rows.n; k++) {
    for (PetscInt i = order[k]; i != -1 && first[i] == -1; i = parent[i]) {
      if (i != order[k]) count[i] = 0; /* an inner node counts only what its leaves add */
      first[i] = k;
    }
    ancestor[k] = k;
  }
  for (PetscInt j : order) {
    if (parent[j] >= 0) count[parent[j]]--;
    for (PetscInt k = rows.ia[old[j]]; k < rows.ia[old[j] + 1]; k++) {
      const PetscInt i = number[rows.ja[k]];

      if (i <= j || first[j] <= seen[i]) continue;
      seen[i] = first[j];
      count[j]++;
      if (leaf[i] >= 0) { /* the paths from this leaf and the last one would be counted twice from where they meet */
        PetscInt meet = leaf[i];

        while (meet != ancestor[meet]) meet = ancestor[meet];
        for (PetscInt s = leaf[i], up; s != meet; s = up) {
          up          = ancestor[s];
          ancestor[s] = meet;
        }
        count[meet]--;
      }
      leaf[i] = j;
    }
    if (parent[j] >= 0) ancestor[j] = parent[j];
  }
  for (PetscInt j : order)
    if (parent[j] >= 0) count[parent[j]] += count[j];
  return count;
}
} // namespace

/*
   AinsworthFactorPredict - predicts the cost of a Cholesky factorization of a sequential M in an ordering, in little
   more time than it takes to read M

   M has one row for each node of bs unknowns. order: of these rows, to be destroyed by the caller.
*/
PetscErrorCode AinsworthFactorPredict(Mat M, MatOrderingType ordering, PetscInt bs, AinsworthCost *cost, IS *order)
{
  Pattern pattern;
  IS      same;

  PetscFunctionBegin;
  PetscCall(MatGetOrdering(M, ordering, order, &same));
  PetscCall(ISDestroy(&same));
  PetscCall(pattern.open(M, *order));
  cost->entries = cost->operations = 0.0;
  for (PetscInt count : pattern.columnCounts(pattern.eliminationTree())) {
    for (PetscInt i = 0; i < bs; i++) {
      const PetscReal entries = (PetscReal)count * bs - i;

      cost->entries += entries;
      cost->operations += PetscSqr(entries);
    }
  }
  PetscCall(PetscInfo(
    M, "A Cholesky factor of %" PetscInt_FMT " unknowns has %g entries and takes %g operations in the ordering %s\n",
    bs * pattern.rows.n, (double)cost->entries, (double)cost->operations, ordering));
  PetscCall(pattern.rows.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthOrderingAttach - attaches an order of the rows of M, in which the ordering AinsworthPredicted has it
   factored
*/
PetscErrorCode AinsworthOrderingAttach(IS order, Mat M)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectCompose((PetscObject)M, AinsworthPredicted, (PetscObject)order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthOrderingGet - a MatOrdering: returns the order attached to M, which must have no inodes */
PetscErrorCode AinsworthOrderingGet(Mat M, MatOrderingType, IS *row, IS *column)
{
  IS order;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)M, AinsworthPredicted, (PetscObject *)&order));
  PetscCheck(order, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "The ordering %s is for factorizations that the plugin chooses: choose another one", AinsworthPredicted);
  for (IS *is : {row, column}) PetscCall(AinsworthShare(order, is));
  PetscFunctionReturn(PETSC_SUCCESS);
}
