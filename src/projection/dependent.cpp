#include "dependent.h"
#include "elimination.h"
#include "../base/events.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "graph.h"
#include "symbolic.h"
#include <petscsf.h>
#include <algorithm>
#include <numeric>

/* Bounds on the relative error of solves with S, which is about its condition number times the machine precision */
/* larger: solves are refined; smaller: far below the tolerances of the verification */
static const PetscReal inexact = 1e6 * PETSC_MACHINE_EPSILON;
static const PetscReal
  /*
     larger than this times m^{-1/2}: dependent rows are looked for, as S v loses the part of v in Ker S, about m^{-1/2}
     of a random v
  */
  suspicious = 1e-3;
/* larger: more rows have to be dropped, or the set-up fails, because refinement would not converge */
static const PetscReal unusable = 1e-3;
/*
   In each pass, a row is dependent if its distance from the span of the others, in the norm of W, is at most this
   fraction of its length
*/
static const PetscReal distances[] = {1e-12, /* some thousand times the machine precision */
                                      /*
     its square, which is what S contains, is some hundred thousand times that; only if solves are unusable with such
     rows
  */
                                      1e-5};
/*
   Rows within this distance are nearly dependent: the square root of the condition number at which solves become
   inaccurate
*/
static const PetscReal nearly = 1e-3;
static const PetscInt  passes = sizeof(distances) / sizeof(distances[0]);

/*
   Computes the relative error of S^{-1} S v for a random v, about the condition number of S times the machine precision

   S is scaled to a unit diagonal, so the scale of the rows of C does not matter. The result is NaN or Inf if the solve
   fails. Collective
*/
static PetscErrorCode Probe(AinsworthGram *gram, PetscReal *error)
{
  PetscReal sums[2] = {0.0, 0.0}; /* squared norms of the error and of v */

  PetscFunctionBegin;
  if (gram->placement.sizes.size()) {
    KSPConvergedReason reason;
    PetscMPIInt        rank;
    Vec                v, y;

    PetscCall(VecDuplicate(gram->b, &v));
    PetscCall(VecDuplicate(gram->b, &y));
    PetscCall(VecSetRandom(v, NULL));
    PetscCall(VecShift(v, -0.5)); /* entries of both signs, because duplicated rows show up in differences */
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
    /* ranks that share a component all have the same norms: count them once */
    for (PetscReal &sum : sums) sum = rank ? 0.0 : PetscSqr(sum);
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)gram->S)));
  *error = PetscSqrtReal(sums[0] / sums[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Appends the nonzero entries of row i of M to `row`, with columns shifted by `first`

   With roots (may be NULL), divides each entry by the square root of roots at its column, and skips columns of other
   ranks and those where roots is zero.
*/
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
   Loads the local rows of C W^{1/2}, or of C without a weight, each divided by its largest entry

   If N is not NULL, appends the row of N diag(N)^{-1/2} to each: S is singular if C' z = 0 and N z = 0 for some z.
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

/* Renumbers the columns of rows to 0, 1, ...; columns: the old numbers of those with entries, ascending */
static void Compress(std::vector<AinsworthRow> &rows, std::vector<PetscInt> &columns)
{
  columns.clear();
  for (const AinsworthRow &row : rows) columns.insert(columns.end(), row.column.begin(), row.column.end());
  AinsworthSortUnique(&columns);
  for (AinsworthRow &row : rows)
    for (PetscInt &c : row.column)
      c = (PetscInt)(std::lower_bound(columns.begin(), columns.end(), c) - columns.begin());
}

/* Sets own[c] to 0 for columns that several ranks have */
static PetscErrorCode FindShared(Mat C, const std::vector<PetscInt> &columns, std::vector<char> &own)
{
  std::vector<PetscInt> count(columns.size(), 1), all;
  PetscLayout           layout;
  PetscSF               sf;
  PetscInt              n, common;

  PetscFunctionBegin;
  PetscCall(MatGetLayouts(C, NULL, &layout));
  PetscCall(PetscLayoutGetSize(layout, &n));
  /* the columns of N, which belong to one row each */
  common = (PetscInt)(std::lower_bound(columns.begin(), columns.end(), n) - columns.begin());
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

/* Orders the rows of this rank for little fill, with the ordering of their part of S */
static PetscErrorCode OrderRows(const AinsworthGram *gram, std::vector<PetscInt> *order)
{
  Mat     own = gram->placed;
  MatInfo info;
  IS      rows, columns;

  PetscFunctionBegin;
  if (!gram->placement.sizes.size()) PetscFunctionReturn(PETSC_SUCCESS);
  if (gram->placement.split) PetscCall(MatGetDiagonalBlock(gram->placed, &own));
  PetscCall(MatGetInfo(own, MAT_LOCAL, &info));
  /* AMD rejects an empty matrix */
  PetscCall(MatGetOrdering(own, info.nz_used > 0.0 ? AinsworthOrdering : MATORDERINGNATURAL, &rows, &columns));
  PetscCall(AinsworthISToList(rows, order));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&columns));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers on rank 0 the remaining rows, which share columns with rows of other ranks. Collective */
static PetscErrorCode GatherRows(Mat C, const std::vector<AinsworthRow> &rows, const std::vector<PetscInt> &columns,
                                 std::vector<AinsworthRow> &all)
{
  AinsworthEntries entries;
  PetscInt         n, m;
  PetscMPIInt      rank;
  Mat              rest, *whole;

  PetscFunctionBegin;
  PetscCall(MatGetSize(C, NULL, &n));
  for (const AinsworthRow &row : rows) {
    const PetscInt start = entries.start.back();

    for (size_t k = 0; k < row.column.size(); k++) /* skip the column of N, whose entry was too small for a pivot */
      if (columns[row.column[k]] < n) entries.add(columns[row.column[k]], row.value[k]);
    PetscCall(PetscSortIntWithScalarArray((PetscInt)entries.columns.size() - start, entries.columns.data() + start,
                                          entries.values.data() + start));
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

/*
   Finds dependent rows of a component that several ranks share: after each rank has eliminated its own columns, rank 0
   eliminates the rest. Collective
*/
static PetscErrorCode FindAmongShared(Mat C, PetscReal distance, const AinsworthElimination &own,
                                      const std::vector<PetscInt> &columns, std::vector<char> &dependent)
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
  std::stable_sort(order.begin(), order.end(),
                   [&](PetscInt i, PetscInt j) { return shared.rows[i].column.size() < shared.rows[j].column.size(); });
  shared.run(order, distance, false);
  found.assign(total, 0);
  for (size_t i = 0; i < shared.rows.size(); i++) found[i] = !shared.taken((PetscInt)i);
  PetscCall(PetscMPIIntCast(total, &count));
  PetscCallMPI(MPI_Bcast(found.data(), count, MPI_CHAR, 0, comm));
  for (PetscInt i = 0; i < n; i++) dependent[left[i]] = found[end - n + i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   FindDependentRows - finds rows of C that are combinations of other rows

   Collective

   Input Parameters:
+  proj     - projector with C and S placed
.  N        - placed; NULL where it is zero
.  weight   - diagonal of W, NULL for the identity
-  distance - a row is dependent if its distance from the span of others, in the norm of W, is at most about this
              fraction of its length

   Output Parameters:
+  n         - number of dependent rows
-  dependent - their global row numbers in S, ascending, the same on all ranks; free with PetscFree()

   Eliminates rows of C rather than of S, because distances appear squared in S and drown in rounding. Keeps rows far
   from the span of those already kept first, then the others by decreasing distance, so that every dropped row is a
   combination of kept rows.
*/
static PetscErrorCode FindDependentRows(const AinsworthProjector *proj, Mat N, Vec weight, PetscReal distance,
                                        PetscInt *n, PetscInt **dependent)
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

/*
   AinsworthProjectorFindNear - finds the rows that make solves with the Gram matrix inaccurate; arguments as for
   FindDependentRows(). Collective
*/
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
   Places the springs D = N G of the program's system; NULL without D. Collective

   A combination of rows of C is zero below distances[0], as programs compute rows; a D_ii is given, so that it is
   nothing only below the rounding of that combination: it is made larger by the quotient
*/
static PetscErrorCode PlaceSprings(const AinsworthProjector *proj, Mat *springs)
{
  static const PetscReal     given      = distances[0] / (10 * PETSC_MACHINE_EPSILON);
  const AinsworthCompliance *compliance = &proj->compliance;
  Mat                        D          = NULL;
  Vec                        G;

  PetscFunctionBegin;
  if (compliance->N) {
    PetscCall(VecDuplicate(compliance->inverse, &G));
    PetscCall(VecCopy(compliance->inverse, G));
    PetscCall(VecReciprocal(G));
    PetscCall(MatDuplicate(compliance->N, MAT_COPY_VALUES, &D));
    PetscCall(MatDiagonalScale(D, NULL, G));
    PetscCall(MatScale(D, PetscSqr(given)));
    PetscCall(VecDestroy(&G));
  }
  PetscCall(AinsworthProjectorPlaceMat(proj, D, springs));
  PetscCall(MatDestroy(&D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthProjectorDiagnose - checks the accuracy of solves with the Gram matrix, and if it is poor finds dependent
   rows of C

   Collective

   Input Parameters:
+  weight - diagonal of W, NULL for the identity
-  pass   - 0 at first; the value returned by the last call after rows were dropped or the weight was changed

   Output Parameters:
+  pass      - for the next call
.  n         - number of dependent rows, the same on all ranks
.  dependent - their numbers, on every rank; free with PetscFree()
.  reason    - why solves with the Gram matrix are impossible although no row is dependent
.  hidden    - some of these rows are independent for W = I: call again with the identity
-  doubtful  - solves are inaccurate and have to be refined
*/
PetscErrorCode AinsworthProjectorDiagnose(AinsworthProjector *proj, Vec weight, PetscInt *pass, PetscInt *n,
                                          PetscInt **dependent, PCFailedReason *reason, PetscBool *hidden,
                                          bool *doubtful)
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
  for (; *pass < passes && !*n && !(error <= (*pass ? unusable : regular)); ++*pass) {
    PetscCall(PetscInfo(
      gram->S, "Solves with the Gram matrix have a relative error of %g: looking for linearly dependent rows of C\n",
      (double)error));
    PetscCall(MatDestroy(&N));
    /* what depends, and what S cannot tell */
    PetscCall(*pass ? AinsworthProjectorPlaceMat(proj, proj->compliance.N, &N) : PlaceSprings(proj, &N));
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
  if (*doubtful && !*reason && !*n)
    PetscCall(
      PetscInfo(gram->S, "Solves with the Gram matrix have a relative error of %g: they are refined\n", (double)error));
  PetscFunctionReturn(PETSC_SUCCESS);
}
