#include "dependent.h"
#include "graph.h"
#include "symbolic.h"
#include <algorithm>

/* Relative errors of solves with S, about its condition number times the machine precision, above which ... */
static const PetscReal inexact    = 1e6 * PETSC_MACHINE_EPSILON; /* ... they are refined: below, they do not come near the tolerances of what is verified */
static const PetscReal suspicious = PETSC_SQRT_MACHINE_EPSILON;  /* ... dependent rows are looked for: rounding and dependence are half of the digits apart */
static const PetscReal unusable   = 1e-3;                        /* ... more rows have to go, or the set-up fails: refinement would not converge */
/* A row is dependent if its squared distance from the others' span, in the norm of W, is at most this part of its own square: in each pass ... */
static const PetscReal dependentSquare[] = {
  1e-13, /* ... some hundred roundings */
  1e-11, /* ... more, only if solves are unusable without those rows, too */
  1e-9   /* ... the last before rows would go that are merely close: 3e-5 of their length */
};
static const PetscInt passes = sizeof(dependentSquare) / sizeof(dependentSquare[0]);

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
    PetscRandom        rand;
    PetscMPIInt        rank;
    Vec                v, y;

    PetscCall(VecDuplicate(gram->b, &v));
    PetscCall(VecDuplicate(gram->b, &y));
    PetscCall(PetscRandomCreate(PetscObjectComm((PetscObject)gram->b), &rand));
    PetscCall(VecSetRandom(v, rand));
    PetscCall(PetscRandomDestroy(&rand));
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

/* A sequential S, scaled to a unit diagonal; a diagonal of 0 where it had none */
static PetscErrorCode ScaleToUnitDiagonal(Mat S)
{
  Vec scale;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(S, &scale, NULL));
  PetscCall(MatGetDiagonal(S, scale));
  PetscCall(VecSqrtAbs(scale));
  PetscCall(VecReciprocal(scale));
  PetscCall(MatDiagonalScale(S, scale, scale));
  PetscCall(VecDestroy(&scale));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns in which a row of the factor has entries, in an order in which each comes after those it needs; mark[] holds the last row that saw it */
static void RowPattern(const AinsworthTriangle &S, const std::vector<PetscInt> &parent, PetscInt row, std::vector<PetscInt> &mark,
                       std::vector<PetscInt> &pattern)
{
  std::vector<PetscInt> path;

  pattern.clear();
  mark[row] = row;
  for (size_t k = S.start[row]; k < S.start[row + 1]; k++) {
    path.clear();
    for (PetscInt i = S.column[k]; i != -1 && mark[i] != row; i = parent[i]) {
      path.push_back(i);
      mark[i] = row;
    }
    pattern.insert(pattern.end(), path.rbegin(), path.rend());
  }
  std::reverse(pattern.begin(), pattern.end()); /* later paths end in earlier ones */
}

/*
   Row by row Cholesky factorisation in which a row whose pivot is at most tol is left out

   The pivot is the squared distance of the row of C, of length 1, from the span of the rows before it.
*/
static void Eliminate(const AinsworthTriangle &S, PetscReal tol, std::vector<char> &dependent)
{
  const std::vector<PetscInt> parent = S.eliminationTree();
  std::vector<PetscInt>       mark(S.m, -1), pattern;
  std::vector<size_t>         start(S.m + 1, 0), end;
  std::vector<PetscInt>       row; /* the factor by columns, below the diagonal */
  std::vector<PetscScalar>    value, x(S.m, 0.0);
  std::vector<PetscReal>      pivot(S.m, 0.0);

  for (PetscInt i = 0; i < S.m; i++) {
    RowPattern(S, parent, i, mark, pattern);
    for (PetscInt j : pattern) start[j + 1]++;
  }
  for (PetscInt i = 0; i < S.m; i++) start[i + 1] += start[i];
  end.assign(start.begin(), start.end() - 1);
  row.resize(start[S.m]);
  value.resize(start[S.m]);
  mark.assign(S.m, -1);
  dependent.assign(S.m, 0);
  for (PetscInt i = 0; i < S.m; i++) {
    PetscReal d = S.diagonal[i];

    RowPattern(S, parent, i, mark, pattern);
    for (size_t k = S.start[i]; k < S.start[i + 1]; k++) x[S.column[k]] = S.value[k];
    for (PetscInt j : pattern) {
      const PetscScalar lij = dependent[j] ? 0.0 : x[j] / pivot[j];

      x[j] = 0.0;
      if (lij == 0.0) continue;
      for (size_t k = start[j]; k < end[j]; k++) x[row[k]] -= PetscConj(value[k]) * lij;
      d -= PetscSqr(PetscAbsScalar(lij));
      row[end[j]]     = i;
      value[end[j]++] = lij;
    }
    dependent[i] = !(d > tol); /* not a number: a row whose square overflowed */
    pivot[i]     = dependent[i] ? 0.0 : PetscSqrtReal(d);
  }
}

/*
   rows of C that are combinations of other rows, from S = C W C'

   Collective

   Input Parameters:
+  S   - m x m, AIJ
-  tol - a row of C counts as dependent if its squared distance from the span of others is at most this part of its own square

   Output Parameters:
+  n         - their number
-  dependent - their global numbers, rising, the same on all ranks; to be freed with PetscFree()

   S is solved on rank 0: it is sparse and as small as the contact surface. The factorisation has the backward error of Cholesky's, some machine
   precisions relative to the unit diagonal that S is scaled to, so that tol must stay well above 1e-15; what it cannot tell apart, distances
   below sqrt(tol), the check of the right-hand sides of the rows that are left out does.
*/
static PetscErrorCode FindDependentRows(Mat S, PetscReal tol, PetscInt *n, PetscInt **dependent)
{
  MPI_Comm    comm = PetscObjectComm((PetscObject)S);
  PetscMPIInt rank, count;
  Mat        *local;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(AinsworthGraphGather(S, rank == 0, &local));
  *n         = 0;
  *dependent = NULL;
  if (!rank) {
    std::vector<char> flags;
    AinsworthTriangle triangle;

    PetscCall(ScaleToUnitDiagonal(local[0]));
    PetscCall(triangle.create(local[0]));
    Eliminate(triangle, tol, flags);
    PetscCall(PetscMalloc1(triangle.m, dependent));
    for (PetscInt i = 0; i < triangle.m; i++)
      if (flags[triangle.number[i]]) (*dependent)[(*n)++] = i;
  }
  PetscCall(MatDestroySubMatrices(1, &local));
  PetscCallMPI(MPI_Bcast(n, 1, MPIU_INT, 0, comm));
  if (rank) PetscCall(PetscMalloc1(*n, dependent));
  PetscCall(PetscMPIIntCast(*n, &count));
  PetscCallMPI(MPI_Bcast(*dependent, count, MPIU_INT, 0, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGramDiagnose - are solves with the Gram matrix good enough? If not: rows of C that are linear combinations of others

   Input Parameter:
.  pass - 0, and after rows were left out what came back

   Output Parameters:
+  pass      - for the next call
.  n         - number of dependent rows, the same on all ranks
.  dependent - their numbers, on every rank; to be freed
.  reason    - why no solve with the Gram matrix is possible, where none is and no row depends on others
-  doubtful  - solves are not accurate: they are to be refined
*/
PetscErrorCode AinsworthGramDiagnose(AinsworthGram *gram, PetscInt *pass, PetscInt *n, PetscInt **dependent, PCFailedReason *reason, bool *doubtful)
{
  PetscReal error = PETSC_INFINITY;

  PetscFunctionBegin;
  *n         = 0;
  *dependent = NULL;
  PetscCall(AinsworthGramGetFailedReason(gram, reason));
  if (!*reason) PetscCall(Probe(gram, &error));
  for (; gram->hermitian && *pass < passes && !*n && !(error <= (*pass ? unusable : suspicious)); ++*pass) {
    PetscCall(PetscFree(*dependent));
    PetscCall(PetscInfo(gram->S, "Solves with the Gram matrix have a relative error of %g: looking for linearly dependent rows of C\n", (double)error));
    PetscCall(FindDependentRows(gram->S, dependentSquare[*pass], n, dependent));
  }
  if (!*reason && !(error <= unusable)) *reason = PC_FACTOR_NUMERIC_ZEROPIVOT;
  *doubtful = !(error <= inexact);
  if (*doubtful && !*reason && !*n)
    PetscCall(PetscInfo(gram->S, "Solves with the Gram matrix have a relative error of %g: rows of C are nearly linearly dependent, and solves refined\n",
                        (double)error));
  PetscFunctionReturn(PETSC_SUCCESS);
}
