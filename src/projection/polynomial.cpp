#include "polynomial.h"
#include "../base/matrices.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../saddle/saddle.h"
#include <petscblaslapack.h>
#include <algorithm>

/*
   AinsworthPrivateWeight - creates W_p, which is W on the unknowns that are in as few rows as any of one of their rows,
   or that A does not hold, and 0 on others. Collective

   By patterns alone, as the symbolic results depend on it. The slave of a tie is in the rows of its node only, a master
   in those of all slaves around it. The weight of what A does not hold is larger than its inverse diagonal, and would
   make the eigenvalues of S_p^{-1} S large.
*/
PetscErrorCode AinsworthPrivateWeight(Mat C, Vec weight, Vec inverseDiagonal, Vec *own)
{
  static const PetscReal   none  = 1e300; /* the count of what has no weight */
  static const PetscReal   loose = 2.0;   /* weights are 1 / a_jj, or 100 times that of what holds the unknown */
  Mat                      part[2];
  const PetscInt          *ghosts;
  PetscInt                 n;
  AinsworthCSR             rows[2];
  AinsworthRef<Vec>        counts, there, keeps;
  const PetscScalar       *count[2] = {NULL, NULL}; /* rows of each unknown of this rank, and of others */
  PetscScalar             *keep[2]  = {NULL, NULL};
  std::vector<PetscScalar> kept;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(C, 0, counts.out()));
  PetscCall(AinsworthUpdate(counts, {weight}, [&](PetscInt, PetscScalar &c, PetscScalar w) {
    if (w == 0.0) c = none;
  }));
  PetscCall(AinsworthAIJGetParts(C, part, &ghosts, &n));
  PetscCall(AinsworthVecGather(counts, n, ghosts, there.out()));
  PetscCall(VecDuplicate(weight, keeps.out()));
  PetscCall(VecZeroEntries(keeps));
  kept.assign(n, 0.0);
  PetscCall(VecGetArrayRead(counts, &count[0]));
  PetscCall(VecGetArrayRead(there, &count[1]));
  PetscCall(VecGetArray(keeps, &keep[0]));
  keep[1] = kept.data();
  for (int p = 0; p < 2; p++) PetscCall(rows[p].open(part[p]));
  for (PetscInt r = 0; r < rows[0].n; r++) {
    PetscReal fewest = none;

    for (int p = 0; p < 2 && part[p]; p++)
      for (PetscInt k = rows[p].ia[r]; k < rows[p].ia[r + 1]; k++)
        fewest = PetscMin(fewest, PetscRealPart(count[p][rows[p].ja[k]]));
    for (int p = 0; p < 2 && part[p] && fewest < none; p++)
      for (PetscInt k = rows[p].ia[r]; k < rows[p].ia[r + 1]; k++)
        if (PetscRealPart(count[p][rows[p].ja[k]]) == fewest) keep[p][rows[p].ja[k]] = 1.0;
  }
  for (AinsworthCSR &opened : rows) PetscCall(opened.close());
  PetscCall(VecRestoreArray(keeps, &keep[0]));
  PetscCall(VecRestoreArrayRead(there, &count[1]));
  PetscCall(VecRestoreArrayRead(counts, &count[0]));
  PetscCall(AinsworthAddToOwners(C, kept.data(), keeps));
  PetscCall(AinsworthVecClone(weight, own));
  PetscCall(AinsworthUpdate(*own, {(Vec)keeps, inverseDiagonal},
                            [&](PetscInt, PetscScalar &w, PetscScalar keep, PetscScalar inverse) {
                              if (keep != 0.0 || PetscRealPart(w) > loose * PetscRealPart(inverse)) return;
                              w = 0.0;
                            }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* The rows of S of one block of S_p */
struct BlockRows {
  struct Entry {
    PetscInt    row, column;
    PetscScalar value;
  };
  std::vector<PetscInt>    columns; /* of any entry */
  std::vector<PetscScalar> values;  /* size x columns, row by row */
  std::vector<Entry>       read;    /* work space */
};
} // namespace

static PetscErrorCode LoadBlock(Mat S, PetscInt first, PetscInt size, BlockRows *block)
{
  PetscInt           n;
  const PetscInt    *j;
  const PetscScalar *a;
  bool               alike = true; /* all rows have the same columns, as those of a node usually do */

  PetscFunctionBegin;
  block->read.clear();
  block->columns.clear();
  for (PetscInt i = 0; i < size; i++) {
    PetscCall(MatGetRow(S, first + i, &n, &j, &a));
    if (!i) block->columns.assign(j, j + n);
    else alike = alike && (size_t)n * i == block->read.size() && std::equal(j, j + n, block->columns.begin());
    for (PetscInt k = 0; k < n; k++) block->read.push_back({i, j[k], a[k]});
    PetscCall(MatRestoreRow(S, first + i, &n, &j, &a));
  }
  if (!alike) {
    block->columns.clear();
    for (const BlockRows::Entry &entry : block->read) block->columns.push_back(entry.column);
    AinsworthSortUnique(&block->columns);
  }
  const size_t width = block->columns.size();
  block->values.assign(width * size, 0.0);
  if (alike) {
    for (size_t k = 0; k < block->read.size(); k++) block->values[k] = block->read[k].value;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (const BlockRows::Entry &entry : block->read) {
    const auto at = std::lower_bound(block->columns.begin(), block->columns.end(), entry.column);

    block->values[entry.row * width + (at - block->columns.begin())] = entry.value;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Least pivot of a block with a unit diagonal. Rows of C are then independent, as blocks share no private unknowns, and
   solves lose four digits at most
*/
static const PetscReal leastPivot = 1e-4;

/* Replaces F, Hermitian, column by column, by its inverse, of which the lower half is set; *singular: nearly so */
static PetscErrorCode InvertBlock(PetscInt size, std::vector<PetscScalar> &F, bool *singular)
{
  const PetscBLASInt n    = (PetscBLASInt)size;
  PetscBLASInt       info = 0;

  PetscFunctionBegin;
  PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &n, F.data(), &n, &info));
  for (PetscInt i = 0; i < size; i++)
    if (!(PetscSqr(PetscRealPart(F[(size_t)i * (size + 1)])) > leastPivot)) info = 1;
  if (!info) PetscCallBLAS("LAPACKpotri", LAPACKpotri_("L", &n, F.data(), &n, &info));
  *singular = info != 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPolynomialBound - computes the largest row sum of |S_p^{-1} S|, which bounds its eigenvalues; S is
   placed, the Gram matrix is that of W_p. Infinite if S_p is singular. blocks: entries of the blocks of S_p on the
   rank that has most of them. Collective
*/
PetscErrorCode AinsworthPolynomialBound(Mat S, const AinsworthGram *gram, PetscReal *bound, PetscReal *blocks)
{
  PetscReal                largest[2] = {0.0, 0.0}; /* row sum, entries of blocks */
  PetscInt                 first, at = 0;
  std::vector<PetscScalar> F, product;
  const PetscScalar       *scale;
  BlockRows                block;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(S, &first, NULL));
  PetscCall(VecGetArrayRead(gram->scale, &scale));
  for (PetscInt size : gram->placement.sizes) {
    bool singular = false;

    F.assign((size_t)size * size, 0.0);
    for (PetscInt i = 0; i < size; i++) {
      PetscInt           n;
      const PetscInt    *j;
      const PetscScalar *a;

      PetscCall(MatGetRow(gram->placed, at + i, &n, &j, &a));
      for (PetscInt k = 0; k < n; k++) F[(size_t)(j[k] - at) * size + i] = a[k];
      PetscCall(MatRestoreRow(gram->placed, at + i, &n, &j, &a));
    }
    PetscCall(InvertBlock(size, F, &singular));
    PetscCall(LoadBlock(S, first + at, size, &block));
    const size_t width = block.columns.size();
    for (PetscInt i = 0; i < size; i++) {
      PetscReal sum = 0.0;

      product.assign(width, 0.0);
      for (PetscInt k = 0; k < size; k++) {
        const PetscScalar inverse = k <= i ? F[(size_t)k * size + i] : PetscConj(F[(size_t)i * size + k]);
        const PetscScalar factor = scale[at + i] * inverse * scale[at + k], *row = &block.values[k * width];

        for (size_t c = 0; c < width; c++) product[c] += factor * row[c];
      }
      for (PetscScalar entry : product) sum += PetscAbsScalar(entry);
      largest[0] = PetscMax(largest[0], singular ? PETSC_MAX_REAL : sum);
    }
    at += size;
    largest[1] += (PetscReal)size * (PetscReal)size;
  }
  PetscCall(VecRestoreArrayRead(gram->scale, &scale));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, largest, 2, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)S)));
  *bound  = largest[0];
  *blocks = largest[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes z = P y and, if asked for, leaves y - S z in p->rest; all placed */
static PetscErrorCode Iterate(const AinsworthPolynomial *p, AinsworthGram *gram, Vec y, bool rest, Vec z)
{
  PetscFunctionBegin;
  PetscCall(VecCopy(y, p->rest));
  if (p->steps.empty()) PetscCall(VecZeroEntries(z));
  for (size_t k = 0; k < p->steps.size(); k++) {
    PetscCall(AinsworthGramSolve(gram, p->rest, p->solution));
    if (k) PetscCall(VecAXPBY(p->direction, p->steps[k].factor, p->steps[k].momentum, p->solution));
    else {
      PetscCall(VecCopy(p->solution, p->direction));
      PetscCall(VecScale(p->direction, p->steps[k].factor));
    }
    if (k) PetscCall(VecAXPY(z, 1.0, p->direction));
    else PetscCall(VecCopy(p->direction, z));
    if (!rest && k + 1 == p->steps.size()) break;
    PetscCall(MatMult(p->S, p->direction, p->solution));
    PetscCall(VecAXPY(p->rest, -1.0, p->solution));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthPolynomialSolve - computes z and w with R y = W C' z + W_p C' w, all placed */
PetscErrorCode AinsworthPolynomialSolve(const AinsworthPolynomial *p, AinsworthGram *gram, Vec y, Vec z, Vec w)
{
  PetscFunctionBegin;
  PetscCall(Iterate(p, gram, y, true, z));
  PetscCall(AinsworthGramSolve(gram, p->rest, w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthPolynomialSolveAdjoint - computes l = R' r from all = C W r and own = C W_p r, all placed; changes both */
PetscErrorCode AinsworthPolynomialSolveAdjoint(const AinsworthPolynomial *p, AinsworthGram *gram, Vec all, Vec own,
                                               Vec l)
{
  PetscFunctionBegin;
  PetscCall(AinsworthGramSolve(gram, own, l));
  if (p->steps.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatMult(p->S, l, p->solution));
  PetscCall(VecAXPY(all, -1.0, p->solution));
  PetscCall(Iterate(p, gram, all, false, own));
  PetscCall(VecAXPY(l, 1.0, own));
  PetscFunctionReturn(PETSC_SUCCESS);
}
