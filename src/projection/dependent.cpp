#include "dependent.h"
#include "elimination.h"
#include "../base/events.h"
#include "../base/layouts.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "graph.h"
#include "symbolic.h"
#include <algorithm>
#include <numeric>

/*
   Relative error of solves with S, about its condition number times the machine precision, above which they are
   refined: far below the tolerances of the verification
*/
static const PetscReal refined = 1e6 * PETSC_MACHINE_EPSILON;
/*
   Error above which refinement would not converge: more rows have to be dropped, or the set-up fails. Before a search,
   m^{-1/2} of it counts, as S v loses the part of v in Ker S, about m^{-1/2} of a random v
*/
static const PetscReal unusable = 1e-3;
/*
   In each pass, a row is dependent if its distance from the span of the others, in the norm of W, is at most this
   fraction of its length: some thousand times the machine precision; then, if solves are unusable with such rows, what
   S, which has the square of the distance, still tells apart
*/
static const PetscReal distances[] = {1e-12, 1e-5};
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
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPIU_SUM, gram->comm));
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
   Gets the matrix of a placed one whose rows are compared on this rank: its own rows or, if components are split, all
   of them on rank 0; a NULL matrix stays NULL. Collective
*/
static PetscErrorCode Gather(Mat placed, bool split, Mat *rows)
{
  PetscMPIInt rank;
  Mat        *whole;

  PetscFunctionBegin;
  if (placed && split) {
    PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)placed), &rank));
    PetscCall(AinsworthGraphGather(placed, rank == 0, &whole));
    PetscCall(AinsworthShare(whole[0], rows));
    PetscCall(MatDestroySubMatrices(1, &whole));
  } else PetscCall(AinsworthShare(placed, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Loads the rows of C W^{1/2} that this rank compares, or of C without a weight, each divided by its largest entry.
   Collective

   If N is not NULL, appends the row of N diag(N)^{-1/2} to each: S is singular if C' z = 0 and N z = 0 for some z.
*/
static PetscErrorCode LoadRows(const AinsworthProjector *proj, Vec weight, Mat N, std::vector<AinsworthRow> &rows)
{
  Mat      scaled, C, springs;
  Vec      diagonal = NULL;
  PetscInt start, end, n;

  PetscFunctionBegin;
  PetscCall(AinsworthShare(proj->C, &scaled));
  if (weight) {
    Vec root;

    PetscCall(AinsworthVecClone(weight, &root));
    PetscCall(VecSqrtAbs(root));
    PetscCall(MatDestroy(&scaled));
    PetscCall(AinsworthScaleColumns(proj->C, root, &scaled));
    PetscCall(VecDestroy(&root));
  }
  PetscCall(Gather(scaled, proj->gram.placement.split, &C));
  PetscCall(Gather(N, proj->gram.placement.split, &springs));
  PetscCall(MatDestroy(&scaled));
  if (springs) {
    PetscCall(AinsworthCreateVecs(springs, NULL, &diagonal));
    PetscCall(MatGetDiagonal(springs, diagonal));
  }
  PetscCall(MatGetSize(C, NULL, &n));
  PetscCall(MatGetOwnershipRange(C, &start, &end));
  rows.resize(end - start);
  for (PetscInt i = start; i < end; i++) {
    AinsworthRow &row = rows[i - start];

    PetscCall(AddEntries(C, i, NULL, 0, &row));
    if (springs) PetscCall(AddEntries(springs, i, diagonal, n, &row));
    const PetscReal largest = row.largest();
    for (PetscScalar &v : row.value) v /= largest;
  }
  PetscCall(VecDestroy(&diagonal));
  PetscCall(MatDestroy(&C));
  PetscCall(MatDestroy(&springs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Renumbers the columns of rows to 0, 1, ..., and returns their number */
static size_t Compress(std::vector<AinsworthRow> &rows)
{
  std::vector<PetscInt> columns;

  for (const AinsworthRow &row : rows) columns.insert(columns.end(), row.column.begin(), row.column.end());
  AinsworthSortUnique(&columns);
  for (AinsworthRow &row : rows)
    for (PetscInt &c : row.column)
      c = (PetscInt)(std::lower_bound(columns.begin(), columns.end(), c) - columns.begin());
  return columns.size();
}

/* Orders the rows that this rank compares for little fill, with the ordering of their part of S. Collective */
static PetscErrorCode OrderRows(const AinsworthProjector *proj, std::vector<PetscInt> *order)
{
  const AinsworthGram *gram = &proj->gram;
  Mat                  own;
  MatInfo              info;
  IS                   rows, columns;

  PetscFunctionBegin;
  if (gram->placement.split) PetscCall(Gather(gram->S, true, &own));
  else PetscCall(AinsworthShare(gram->placed, &own));
  PetscCall(MatGetInfo(own, MAT_LOCAL, &info));
  /* AMD rejects an empty matrix */
  PetscCall(MatGetOrdering(own, info.nz_used > 0.0 ? AinsworthOrdering : MATORDERINGNATURAL, &rows, &columns));
  PetscCall(AinsworthISToList(rows, order));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&columns));
  PetscCall(MatDestroy(&own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the numbers in S of the rows that this rank compares. Collective */
static PetscErrorCode NumberRows(const AinsworthProjector *proj, std::vector<PetscInt> *numbers)
{
  const AinsworthPlacement &placement = proj->gram.placement;
  PetscInt                  first, local;

  PetscFunctionBegin;
  if (placement.rows) PetscCall(AinsworthISToList(placement.rows, numbers));
  else {
    PetscCall(MatGetOwnershipRange(proj->C, &first, NULL));
    PetscCall(MatGetLocalSize(proj->C, &local, NULL));
    numbers->resize(local);
    std::iota(numbers->begin(), numbers->end(), first);
  }
  if (placement.split) PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)proj->C), *numbers, numbers));
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
   combination of kept rows. Each rank compares its own rows; if components are split, rank 0 compares all.
*/
static PetscErrorCode FindDependentRows(const AinsworthProjector *proj, Mat N, Vec weight, PetscReal distance,
                                        PetscInt *n, PetscInt **dependent)
{
  AinsworthElimination  own;
  std::vector<PetscInt> order, numbers, mine, all;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Dependent, proj->C, 0, 0, 0));
  PetscCall(LoadRows(proj, weight, N, own.rows));
  PetscCall(OrderRows(proj, &order));
  own.run(order, Compress(own.rows), distance);
  PetscCall(NumberRows(proj, &numbers));
  for (size_t i = 0; i < own.rows.size(); i++)
    if (!own.taken((PetscInt)i)) mine.push_back(numbers[i]);
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)proj->C), mine, &all));
  std::sort(all.begin(), all.end());
  *n = (PetscInt)all.size();
  PetscCall(PetscMalloc1(*n, dependent));
  PetscCall(PetscArraycpy(*dependent, all.data(), *n));
  PetscCall(PetscLogEventEnd(AINSWORTH_Dependent, proj->C, 0, 0, 0));
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
    PetscCall(AinsworthVecClone(compliance->inverse, &G));
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
  PetscCall(MatGetSize(proj->C, &m, NULL));
  regular = unusable / PetscSqrtReal((PetscReal)PetscMax(m, 1));
  for (; *pass < passes && !*n && !(error <= (*pass ? unusable : regular)); ++*pass) {
    PetscCall(PetscInfo(
      proj->C, "Solves with the Gram matrix have a relative error of %g: looking for linearly dependent rows of C\n",
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
  *doubtful = !(error <= refined);
  if (*doubtful && !*reason && !*n)
    PetscCall(
      PetscInfo(proj->C, "Solves with the Gram matrix have a relative error of %g: they are refined\n", (double)error));
  PetscFunctionReturn(PETSC_SUCCESS);
}
