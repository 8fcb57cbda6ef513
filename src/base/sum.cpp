/*
   Sums of AIJ matrices in one pass over their rows; MatAXPY() inserts entries one by one, which took a third of the
   time for M_*
*/
#include "matrices.h"
#include "csr.h"
#include "objects.h"
#include <algorithm>

namespace
{
/* A matrix times a scalar: its local columns, or those of other ranks */
struct Term : AinsworthCSR {
  PetscScalar     scale  = 1.0;
  const PetscInt *ghosts = NULL; /* global numbers of the columns; NULL: local columns */

  PetscInt start(PetscInt r) const { return mat ? ia[r] : 0; } /* first entry of row r */
  PetscInt column(PetscInt k) const { return ghosts ? ghosts[ja[k]] : ja[k]; }
};
} // namespace

/* Sums n rows with ascending columns; entries: how many, to be checked by the caller */
static PetscErrorCode Sum(const std::vector<Term> &terms, PetscInt n, AinsworthRows *rows, PetscInt64 *entries)
{
  const size_t          count = terms.size();
  std::vector<PetscInt> at(count, 0), column(count); /* next entry of each term, and its column */
  PetscInt64            most = 0, next = 0;

  PetscFunctionBegin;
  for (const Term &term : terms) most += term.start(n);
  rows->reserve(most); /* an upper bound, as patterns overlap; untouched memory is not resident */
  rows->i.reserve(n + 1);
  for (PetscInt r = 0; r < n; r++) {
    const auto look = [&](size_t t) {
      column[t] = at[t] < terms[t].start(r + 1) ? terms[t].column(at[t]) : PETSC_MAX_INT;
    };

    for (size_t t = 0; t < count; t++) look(t);
    for (PetscInt first; (first = *std::min_element(column.begin(), column.end())) < PETSC_MAX_INT; next++) {
      PetscScalar sum = 0.0;

      for (size_t t = 0; t < count; t++) {
        if (column[t] > first) continue;
        sum += terms[t].scale * terms[t].a[at[t]++];
        look(t);
      }
      rows->j[next] = first;
      rows->a[next] = sum;
    }
    rows->i.push_back((PetscInt)next);
  }
  *entries = next;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthAddAIJ - computes *Y += scale times the sum of X, AIJ matrices with any patterns, some of which may be NULL.
   Collective
*/
PetscErrorCode AinsworthAddAIJ(PetscScalar scale, const std::vector<Mat> &X, Mat *Y)
{
  MPI_Comm                       comm = PetscObjectComm((PetscObject)*Y);
  std::vector<Mat>               all(1, *Y);
  std::vector<Term>              terms[2];
  std::unique_ptr<AinsworthRows> rows[2];
  Mat                            sum;
  PetscInt                       m, n, rbs, cbs;
  PetscInt64                     entries[2];
  MatType                        type;

  PetscFunctionBegin;
  std::copy_if(X.begin(), X.end(), std::back_inserter(all), [](Mat mat) { return mat != NULL; });
  if (all.size() == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLocalSize(*Y, &m, &n));
  for (Mat mat : all) {
    Term            term[2];
    Mat             part[2];
    const PetscInt *ghosts;
    PetscInt        nghosts;

    PetscCall(AinsworthAIJGetParts(mat, part, &ghosts, &nghosts));
    term[1].ghosts = ghosts;
    for (int p = 0; p < 2; p++) {
      PetscCall(term[p].open(part[p]));
      term[p].scale = mat == *Y ? 1.0 : scale;
      terms[p].push_back(term[p]);
    }
  }
  for (int p = 0; p < 2; p++) {
    rows[p].reset(new AinsworthRows);
    PetscCall(Sum(terms[p], m, rows[p].get(), &entries[p]));
    for (Term &term : terms[p]) PetscCall(term.close());
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, entries, 2, MPIU_INT64, MPI_MAX, comm));
  PetscCheck(PetscMax(entries[0], entries[1]) <= (PetscInt64)PETSC_MAX_INT, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "A sum of matrices has %" PetscInt64_FMT
             " entries on one rank: use more ranks, or PETSc with 64-bit indices",
             PetscMax(entries[0], entries[1]));
  PetscCall(AinsworthMatCreateFromRows(comm, n, std::move(rows[0]), std::move(rows[1]), &sum));
  PetscCall(MatGetType(*Y, &type));
  PetscCall(MatConvert(sum, type, MAT_INPLACE_MATRIX, &sum)); /* may be a device type */
  PetscCall(MatGetBlockSizes(*Y, &rbs, &cbs));
  PetscCall(MatSetBlockSizes(sum, rbs, cbs));
  PetscCall(AinsworthCopyNullSpaces(*Y, sum));
  PetscCall(MatDestroy(Y));
  *Y = sum;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Adds explicit zeros where only the transpose of an AIJ matrix has entries: components, orderings and packages assume
   a symmetric pattern. Collective
*/
PetscErrorCode AinsworthMakePatternSymmetric(Mat *M)
{
  Mat transposed;

  PetscFunctionBegin;
  PetscCall(MatTranspose(*M, MAT_INITIAL_MATRIX, &transposed));
  PetscCall(MatZeroEntries(transposed)); /* also clears NaN */
  PetscCall(AinsworthAddAIJ(1.0, {transposed}, M));
  PetscCall(MatDestroy(&transposed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthStoreDiagonal - adds explicit zeros where a square AIJ matrix stores no diagonal entry, to a copy.
   Collective

   PETSc's shifts, factorizations and relaxations raise an error without one, on the ranks that miss one only
*/
PetscErrorCode AinsworthStoreDiagonal(Mat *M)
{
  AinsworthEntries entries;
  AinsworthCSR     own;
  const PetscInt  *ghosts;
  PetscInt         missing = 0, rstart, n;
  Mat              given, zeros, part[2];

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(*M, &rstart, NULL));
  PetscCall(AinsworthAIJGetParts(*M, part, &ghosts, &n));
  PetscCall(own.open(part[0]));
  for (PetscInt r = 0; r < own.n; r++) {
    missing += !std::binary_search(own.ja + own.ia[r], own.ja + own.ia[r + 1], r);
    entries.add(rstart + r, 0.0);
    entries.endRow();
  }
  PetscCall(own.close());
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &missing, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)*M)));
  if (!missing) PetscFunctionReturn(PETSC_SUCCESS); /* the usual case */
  PetscCall(AinsworthShare(*M, &given));
  PetscCall(AinsworthCreateAIJLike(given, entries, &zeros));
  PetscCall(AinsworthAddAIJ(1.0, {zeros}, M));
  PetscCall(MatPropagateSymmetryOptions(given, *M));
  PetscCall(MatDestroy(&given));
  PetscCall(MatDestroy(&zeros));
  PetscFunctionReturn(PETSC_SUCCESS);
}
