#include "dependent.h"
#include "elimination.h"
#include "../events.h"
#include "../lists.h"
#include "../loops.h"
#include "../objects.h"
#include "graph.h"
#include "symbolic.h"
#include <petscsf.h>
#include <algorithm>
#include <numeric>

/* Relative errors of solves with S, about its condition number times the machine precision, above which ... */
static const PetscReal inexact = 1e6 * PETSC_MACHINE_EPSILON; /* ... they are refined: below, they do not come near the tolerances of what is verified */
static const PetscReal
  suspicious = 1e-3; /* ... times m^{-1/2}, dependent rows are looked for: S v has lost the part of v in Ker S, about m^{-1/2} of a random v */
static const PetscReal unusable = 1e-3; /* ... more rows have to go, or the set-up fails: refinement would not converge */
/* A row is dependent if its distance from the others' span, in the norm of W, is at most this part of its length: in the first and second pass ... */
static const PetscReal distances[] = {
  1e-12, /* ... some thousand roundings */
  1e-5   /* ... its square, of which S knows, is some hundred thousand: only if solves are unusable with such rows */
};
/* Rows so near to others' span, the square root of the condition number that makes solves inexact, are nearly dependent */
static const PetscReal nearly = 1e-3;
static const PetscInt  passes = sizeof(distances) / sizeof(distances[0]);

/*
   The relative error of S^{-1} S v for a random v, about the condition number of S times the machine precision

   Of S scaled to a unit diagonal, so that the scale of the rows of C does not count. Not a number, or Inf, if the solve fails.
*/
static PetscErrorCode Probe(AinsworthGram *gram, PetscReal *error)
{
  PetscReal sums[2] = {0.0, 0.0}; /* squares of the error and of v */

  PetscFunctionBegin;
  if (gram->placement.sizes.size()) {
    KSPConvergedReason reason;
    PetscMPIInt        rank;
    Vec                v, y;

    PetscCall(VecDuplicate(gram->b, &v));
    PetscCall(VecDuplicate(gram->b, &y));
    PetscCall(VecSetRandom(v, NULL));
    PetscCall(VecShift(v, -0.5)); /* of both signs: duplicated rows appear as differences */
    PetscCall(MatMult(gram->placed, v, gram->b));
    PetscCall(KSPSolve(gram->ksp, gram->b, y));
    PetscCall(KSPGetConvergedReason(gram->ksp, &reason));
    PetscCall(VecAXPY(y, -1.0, v));
    PetscCall(VecNorm(y, NORM_2, &sums[0]));
    PetscCall(VecNorm(v, NORM_2, &sums[1]));
    if (reason < 0) sums[0] = PETSC_INFINITY;
    PetscCall(VecDestroy(&v));
    PetscCall(VecDestroy(&y));
    PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)gram->b), &rank));
    for (PetscReal &sum : sums) sum = rank ? 0.0 : PetscSqr(sum); /* of a shared component one rank speaks */
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)gram->S)));
  *error = PetscSqrtReal(sums[0] / sums[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nonzero entries of a row of M over the square roots of `roots`, NULL for 1, are added, in columns that begin with `first`: those of this rank, with roots */
static PetscErrorCode AddEntries(Mat M, PetscInt i, Vec roots, PetscInt first, AinsworthRow *row)
{
  PetscInt           n, start, end;
  const PetscInt    *cols;
  const PetscScalar *values, *d = NULL;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRangeColumn(M, &start, &end));
  if (roots) PetscCall(VecGetArrayRead(roots, &d));
  PetscCall(MatGetRow(M, i, &n, &cols, &values));
  for (PetscInt k = 0; k < n; k++) {
    if (values[k] == 0.0 || (d && (cols[k] < start || cols[k] >= end || d[cols[k] - start] == 0.0))) continue;
    row->column.push_back(first + cols[k]);
    row->value.push_back(d ? values[k] / PetscSqrtReal(PetscAbsScalar(d[cols[k] - start])) : values[k]);
  }
  PetscCall(MatRestoreRow(M, i, &n, &cols, &values));
  if (roots) PetscCall(VecRestoreArrayRead(roots, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The rows of C W^{1/2}, or of C without a weight, over their largest entries; where N is not NULL each with those of N diag(N)^{-1/2} behind it: C' z = 0 and
   N z = 0 is what makes S singular
*/
static PetscErrorCode LoadRows(Mat C, Vec weight, Mat N, std::vector<AinsworthRow> &rows)
{
  Mat      scaled   = C;
  Vec      diagonal = NULL;
  PetscInt start, end, n;

  PetscFunctionBegin;
  if (weight) {
    Vec root;

    PetscCall(AinsworthVecClone(weight, &root));
    PetscCall(VecSqrtAbs(root));
    PetscCall(AinsworthScaleColumns(C, root, &scaled));
    PetscCall(VecDestroy(&root));
  }
  if (N) {
    PetscCall(MatCreateVecs(N, NULL, &diagonal));
    PetscCall(MatGetDiagonal(N, diagonal));
  }
  PetscCall(MatGetSize(C, NULL, &n));
  PetscCall(MatGetOwnershipRange(scaled, &start, &end));
  rows.resize(end - start);
  for (PetscInt i = start; i < end; i++) {
    AinsworthRow &row     = rows[i - start];
    PetscReal     largest = 0.0;

    PetscCall(AddEntries(scaled, i, NULL, 0, &row));
    if (N) PetscCall(AddEntries(N, i, diagonal, n, &row));
    for (const PetscScalar &v : row.value) largest = PetscMax(largest, PetscAbsScalar(v));
    for (PetscScalar &v : row.value) v /= largest;
  }
  PetscCall(VecDestroy(&diagonal));
  if (scaled != C) PetscCall(MatDestroy(&scaled));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns in which rows have entries, ascending; the rows then count those only */
static void Compress(std::vector<AinsworthRow> &rows, std::vector<PetscInt> &columns)
{
  columns.clear();
  for (const AinsworthRow &row : rows) columns.insert(columns.end(), row.column.begin(), row.column.end());
  AinsworthSortUnique(&columns);
  for (AinsworthRow &row : rows)
    for (PetscInt &c : row.column) c = (PetscInt)(std::lower_bound(columns.begin(), columns.end(), c) - columns.begin());
}

/* 0 for columns that several ranks have */
static PetscErrorCode FindShared(Mat C, const std::vector<PetscInt> &columns, std::vector<char> &own)
{
  std::vector<PetscInt> count(columns.size(), 1), all;
  PetscLayout           layout;
  PetscSF               sf;
  PetscInt              n, common;

  PetscFunctionBegin;
  PetscCall(MatGetLayouts(C, NULL, &layout));
  PetscCall(PetscLayoutGetSize(layout, &n));
  common = (PetscInt)(std::lower_bound(columns.begin(), columns.end(), n) - columns.begin()); /* the others are the rows' own */
  PetscCall(PetscLayoutGetLocalSize(layout, &n));
  all.assign(n, 0);
  PetscCall(PetscSFCreate(PetscObjectComm((PetscObject)C), &sf));
  PetscCall(PetscSFSetGraphLayout(sf, layout, common, NULL, PETSC_USE_POINTER, columns.data()));
  PetscCall(PetscSFReduceBegin(sf, MPIU_INT, count.data(), all.data(), MPI_SUM));
  PetscCall(PetscSFReduceEnd(sf, MPIU_INT, count.data(), all.data(), MPI_SUM));
  PetscCall(PetscSFBcastBegin(sf, MPIU_INT, all.data(), count.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, MPIU_INT, all.data(), count.data(), MPI_REPLACE));
  PetscCall(PetscSFDestroy(&sf));
  for (size_t c = 0; c < columns.size(); c++) own[c] = count[c] == 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An order of the rows of this rank with little fill: that of its part of S */
static PetscErrorCode OrderRows(const AinsworthGram *gram, std::vector<PetscInt> *order)
{
  Mat     own = gram->placed;
  MatInfo info;
  IS      rows, columns;

  PetscFunctionBegin;
  if (!gram->placement.sizes.size()) PetscFunctionReturn(PETSC_SUCCESS);
  if (gram->placement.split) PetscCall(MatGetDiagonalBlock(gram->placed, &own));
  PetscCall(MatGetInfo(own, MAT_LOCAL, &info));
  PetscCall(MatGetOrdering(own, info.nz_used > 0.0 ? AinsworthOrdering : MATORDERINGNATURAL, &rows, &columns)); /* AMD refuses a matrix without entries */
  PetscCall(AinsworthISToList(rows, order));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&columns));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is left of rows that share columns with those of other ranks, on rank 0. Collective */
static PetscErrorCode GatherRows(Mat C, const std::vector<AinsworthRow> &rows, const std::vector<PetscInt> &columns, std::vector<AinsworthRow> &all)
{
  AinsworthEntries entries;
  PetscInt         n, m;
  PetscMPIInt      rank;
  Mat              rest, *whole;

  PetscFunctionBegin;
  PetscCall(MatGetSize(C, NULL, &n));
  for (const AinsworthRow &row : rows) {
    for (size_t k = 0; k < row.column.size(); k++)
      if (columns[row.column[k]] < n) entries.add(columns[row.column[k]], row.value[k]); /* others are its own, which was too small for a pivot */
    entries.endRow();
  }
  PetscCall(MatGetLocalSize(C, NULL, &n));
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)C), n, entries, &rest));
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)C), &rank));
  PetscCall(AinsworthGraphGather(rest, rank == 0, &whole));
  PetscCall(MatDestroy(&rest));
  PetscCall(MatGetSize(whole[0], &m, NULL));
  all.resize(m);
  PetscCall(AinsworthForRows(whole[0], [&](const AinsworthMatRow &row) {
    all[row.number].column.assign(row.j, row.j + row.n);
    all[row.number].value.assign(row.a, row.a + row.n);
  }));
  PetscCall(MatDestroySubMatrices(1, &whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of a component that lies on several ranks each eliminates the unknowns that are its own; rank 0 does the rest */
static PetscErrorCode FindAmongShared(Mat C, PetscReal distance, const AinsworthElimination &own, const std::vector<PetscInt> &columns,
                                      std::vector<char> &dependent)
{
  MPI_Comm                  comm = PetscObjectComm((PetscObject)C);
  AinsworthElimination      shared;
  std::vector<AinsworthRow> rest;
  std::vector<PetscInt>     left, all, order;
  std::vector<char>         found;
  PetscInt                  n, end, total;
  PetscMPIInt               count;

  PetscFunctionBegin;
  for (size_t i = 0; i < own.rows.size(); i++) {
    if (!own.left((PetscInt)i)) continue;
    left.push_back((PetscInt)i);
    rest.push_back(own.rows[i]);
  }
  n = (PetscInt)left.size();
  PetscCallMPI(MPI_Scan(&n, &end, 1, MPIU_INT, MPI_SUM, comm));
  PetscCall(MPIU_Allreduce(&n, &total, 1, MPIU_INT, MPI_SUM, comm));
  PetscCall(GatherRows(C, rest, columns, shared.rows));
  Compress(shared.rows, all);
  shared.free.assign(all.size(), 1);
  order.resize(shared.rows.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](PetscInt i, PetscInt j) { return shared.rows[i].column.size() < shared.rows[j].column.size(); });
  shared.run(order, distance, false);
  found.assign(total, 0);
  for (size_t i = 0; i < shared.rows.size(); i++) found[i] = !shared.taken((PetscInt)i);
  PetscCall(PetscMPIIntCast(total, &count));
  PetscCallMPI(MPI_Bcast(found.data(), count, MPI_CHAR, 0, comm));
  for (PetscInt i = 0; i < n; i++) dependent[left[i]] = found[end - n + i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   rows of C that are combinations of other rows, found where the rows are placed

   Collective

   Input Parameters:
+  proj     - C and S in their places
.  N        - placed; NULL where it is zero
.  weight   - diagonal of W, NULL for the identity
-  distance - a row counts as dependent if its distance from the span of others, in the norm of W, is about this part of its length, or less

   Output Parameters:
+  n         - their number
-  dependent - their global numbers in S, rising, the same on all ranks; to be freed with PetscFree()

   Rows of C are eliminated, not those of S, where distances are squares: what is told apart is far more than rounding can hide. Rows that are far from
   those already kept are kept first, the others by falling distance, so that every row left out is a combination of rows that are kept.
*/
static PetscErrorCode FindDependentRows(const AinsworthProjector *proj, Mat N, Vec weight, PetscReal distance, PetscInt *n, PetscInt **dependent)
{
  const AinsworthGram  *gram = &proj->gram;
  const Mat             C    = proj->C;
  AinsworthElimination  own;
  std::vector<PetscInt> columns, order, places, numbers, all;
  std::vector<char>     flags;
  PetscInt              first;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Dependent, C, 0, 0, 0));
  PetscCall(LoadRows(C, weight, N, own.rows));
  Compress(own.rows, columns);
  own.free.assign(columns.size(), 1);
  if (gram->placement.split) PetscCall(FindShared(C, columns, own.free));
  PetscCall(OrderRows(gram, &order));
  own.run(order, distance, gram->placement.split);
  flags.assign(own.rows.size(), 0);
  for (size_t i = 0; i < flags.size(); i++) flags[i] = !own.taken((PetscInt)i);
  if (gram->placement.split) PetscCall(FindAmongShared(C, distance, own, columns, flags));

  PetscCall(MatGetOwnershipRange(C, &first, NULL));
  if (gram->placement.rows) PetscCall(AinsworthISToList(gram->placement.rows, &places));
  for (size_t i = 0; i < flags.size(); i++)
    if (flags[i]) numbers.push_back(gram->placement.rows ? places[i] : first + (PetscInt)i);
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)C), numbers, &all));
  std::sort(all.begin(), all.end());
  *n = (PetscInt)all.size();
  PetscCall(PetscMalloc1(*n, dependent));
  PetscCall(PetscArraycpy(*dependent, all.data(), *n));
  PetscCall(PetscLogEventEnd(AINSWORTH_Dependent, C, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthProjectorFindNear - the rows that make solves with the Gram matrix inexact, as above */
PetscErrorCode AinsworthProjectorFindNear(const AinsworthProjector *proj, Vec weight, PetscInt *n, PetscInt **rows)
{
  Mat N;

  PetscFunctionBegin;
  PetscCall(AinsworthProjectorPlaceMat(proj, proj->compliance.N, &N));
  PetscCall(FindDependentRows(proj, N, weight, nearly, n, rows));
  PetscCall(MatDestroy(&N));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthProjectorDiagnose - are solves with the Gram matrix good enough? If not: rows of C that are linear combinations of others

   Input Parameters:
+  weight - diagonal of W, NULL for the identity
-  pass   - 0, and after rows were left out or another weight was taken what came back

   Output Parameters:
+  pass      - for the next call
.  n         - number of dependent rows, the same on all ranks
.  dependent - their numbers, on every rank; to be freed
.  reason    - why no solve with the Gram matrix is possible, where none is and no row depends on others
.  hidden    - of these rows some are not dependent without W: take the identity, and call again
-  doubtful  - solves are not accurate: they are to be refined
*/
PetscErrorCode AinsworthProjectorDiagnose(AinsworthProjector *proj, Vec weight, PetscInt *pass, PetscInt *n, PetscInt **dependent, PCFailedReason *reason,
                                          PetscBool *hidden, bool *doubtful)
{
  AinsworthGram *gram  = &proj->gram;
  PetscReal      error = PETSC_INFINITY, regular;
  PetscInt       m, others, *unweighted;
  Mat            N = NULL;

  PetscFunctionBegin;
  *n         = 0;
  *dependent = NULL;
  *hidden    = PETSC_FALSE;
  PetscCall(AinsworthGramGetFailedReason(gram, reason));
  if (!*reason) PetscCall(Probe(gram, &error));
  PetscCall(MatGetSize(gram->S, &m, NULL));
  regular = suspicious / PetscSqrtReal((PetscReal)PetscMax(m, 1));
  if (!(error <= regular)) PetscCall(AinsworthProjectorPlaceMat(proj, proj->compliance.N, &N));
  for (; *pass < passes && !*n && !(error <= (*pass ? unusable : regular)); ++*pass) {
    PetscCall(PetscFree(*dependent));
    PetscCall(PetscInfo(gram->S, "Solves with the Gram matrix have a relative error of %g: looking for linearly dependent rows of C\n", (double)error));
    PetscCall(FindDependentRows(proj, N, weight, distances[*pass], n, dependent));
    if (!*n || !weight) continue;
    PetscCall(FindDependentRows(proj, N, NULL, distances[*pass], &others, &unweighted));
    PetscCall(PetscFree(unweighted));
    *hidden = (PetscBool)(others < *n);
    if (*hidden) break;
  }
  PetscCall(MatDestroy(&N));
  if (!*reason && !*n && !*hidden && proj->B != proj->C) {
    PetscReal other = PETSC_INFINITY;

    PetscCall(AinsworthGramGetFailedReason(&proj->gramB, reason));
    if (!*reason) PetscCall(Probe(&proj->gramB, &other));
    error = PetscMax(error, other);
  }
  if (!*reason && !(error <= unusable)) *reason = PC_FACTOR_NUMERIC_ZEROPIVOT;
  *doubtful = !(error <= inexact);
  if (*doubtful && !*reason && !*n) PetscCall(PetscInfo(gram->S, "Solves with the Gram matrix have a relative error of %g: they are refined\n", (double)error));
  PetscFunctionReturn(PETSC_SUCCESS);
}
