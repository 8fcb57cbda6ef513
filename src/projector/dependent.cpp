#include "dependent.h"
#include "symbolic.h"
#include <metis.h>
#include <algorithm>
#include <limits>
#include <vector>

/* Relative error of solves with the Gram matrix above which rows are looked at for dependence: a condition number of some 1e8 */
static const PetscReal suspicious = PETSC_SQRT_MACHINE_EPSILON;
/* A row is dependent if its squared distance from the others' span, in the norm of W, is at most this part of its own square: some hundred roundings, and more in
   turn only if solves are unusable nevertheless */
static const PetscReal dependentSquare[] = {1e-13, 1e-11, 1e-9};
/* Error of solves that are of no use */
static const PetscReal unusable = 1e-3;
/* Error up to which solves need no refinement: it does not come near the tolerances of what is verified */
static const PetscReal accurate = 1e6 * PETSC_MACHINE_EPSILON;

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

/* A Hermitian matrix on one rank, of which the lower triangle is read, scaled to a unit diagonal, rows and columns in another order */
struct Triangle : AinsworthPattern {
  std::vector<PetscScalar> value; /* below the diagonal, which is 1 or, where S had none, 0 */
  std::vector<char>        diagonal;
};

/* Nested dissection of the graph of S: new numbers of the rows; their own where there is nothing to cut, or METIS cannot */
static PetscErrorCode Dissect(PetscInt m, const PetscInt ia[], const PetscInt ja[], std::vector<PetscInt> &number)
{
  std::vector<idx_t> xadj(m + 1, 0), adjacent, perm(m), iperm(m);
  idx_t              n = (idx_t)m;

  PetscFunctionBegin;
  number.resize(m);
  for (PetscInt i = 0; i < m; i++) {
    number[i] = i;
    for (PetscInt k = ia[i]; k < ia[i + 1]; k++)
      if (ja[k] != i) adjacent.push_back((idx_t)ja[k]);
    xadj[i + 1] = (idx_t)adjacent.size();
  }
  if (adjacent.empty() || adjacent.size() > (size_t)std::numeric_limits<idx_t>::max()) PetscFunctionReturn(PETSC_SUCCESS);
  if (METIS_NodeND(&n, xadj.data(), adjacent.data(), NULL, NULL, perm.data(), iperm.data()) != METIS_OK) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < m; i++) number[i] = (PetscInt)iperm[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The lower triangle of a sequential S in the new numbers */
static PetscErrorCode TriangleCreate(Mat S, std::vector<PetscInt> &number, Triangle *t)
{
  PetscInt               m;
  const PetscInt        *ia, *ja;
  const PetscScalar     *a;
  PetscBool              done;
  std::vector<PetscReal> scale;
  std::vector<size_t>    next;

  PetscFunctionBegin;
  PetscCall(MatGetRowIJ(S, 0, PETSC_FALSE, PETSC_FALSE, &m, &ia, &ja, &done));
  PetscAssert(done, PETSC_COMM_SELF, PETSC_ERR_PLIB, "The Gram matrix is not AIJ");
  PetscCall(MatSeqAIJGetArrayRead(S, &a));
  PetscCall(Dissect(m, ia, ja, number));
  t->m = m;
  t->diagonal.assign(m, 0);
  scale.assign(m, 0.0);
  for (PetscInt i = 0; i < m; i++)
    for (PetscInt k = ia[i]; k < ia[i + 1]; k++)
      if (ja[k] == i && PetscRealPart(a[k]) > 0.0) scale[i] = 1.0 / PetscSqrtReal(PetscRealPart(a[k]));
  t->start.assign(m + 1, 0);
  for (PetscInt i = 0; i < m; i++) {
    t->diagonal[number[i]] = scale[i] > 0.0;
    for (PetscInt k = ia[i]; k < ia[i + 1]; k++)
      if (number[ja[k]] < number[i]) t->start[number[i] + 1]++;
  }
  for (PetscInt i = 0; i < m; i++) t->start[i + 1] += t->start[i];
  t->column.resize(t->start[m]);
  t->value.resize(t->start[m]);
  next.assign(t->start.begin(), t->start.end() - 1);
  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt k = ia[i]; k < ia[i + 1]; k++) {
      if (number[ja[k]] >= number[i]) continue;
      t->column[next[number[i]]]  = number[ja[k]];
      t->value[next[number[i]]++] = scale[i] * a[k] * scale[ja[k]];
    }
  }
  PetscCall(MatSeqAIJRestoreArrayRead(S, &a));
  PetscCall(MatRestoreRowIJ(S, 0, PETSC_FALSE, PETSC_FALSE, &m, &ia, &ja, &done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns in which a row of the factor has entries, in an order in which each comes after those it needs; mark[] holds the last row that saw it */
static void RowPattern(const Triangle &t, const std::vector<PetscInt> &parent, PetscInt row, std::vector<PetscInt> &mark, std::vector<PetscInt> &pattern)
{
  std::vector<PetscInt> path;

  pattern.clear();
  mark[row] = row;
  for (size_t k = t.start[row]; k < t.start[row + 1]; k++) {
    path.clear();
    for (PetscInt i = t.column[k]; i != -1 && mark[i] != row; i = parent[i]) {
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
static void Eliminate(const Triangle &t, PetscReal tol, std::vector<char> &dependent)
{
  const std::vector<PetscInt> parent = AinsworthEliminationTree(t);
  std::vector<PetscInt>       mark(t.m, -1), pattern;
  std::vector<size_t>         start(t.m + 1, 0), end;
  std::vector<PetscInt>       row; /* the factor by columns, below the diagonal */
  std::vector<PetscScalar>    value, x(t.m, 0.0);
  std::vector<PetscReal>      pivot(t.m, 0.0);

  for (PetscInt i = 0; i < t.m; i++) {
    RowPattern(t, parent, i, mark, pattern);
    for (PetscInt j : pattern) start[j + 1]++;
  }
  for (PetscInt i = 0; i < t.m; i++) start[i + 1] += start[i];
  end.assign(start.begin(), start.end() - 1);
  row.resize(start[t.m]);
  value.resize(start[t.m]);
  mark.assign(t.m, -1);
  dependent.assign(t.m, 0);
  for (PetscInt i = 0; i < t.m; i++) {
    PetscReal d = t.diagonal[i];

    RowPattern(t, parent, i, mark, pattern);
    for (size_t k = t.start[i]; k < t.start[i + 1]; k++) x[t.column[k]] = t.value[k];
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
  PetscInt    m;
  IS          all;
  Mat        *local;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(MatGetSize(S, &m, NULL));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, rank ? 0 : m, 0, 1, &all));
  PetscCall(MatCreateSubMatrices(S, 1, &all, &all, MAT_INITIAL_MATRIX, &local));
  PetscCall(ISDestroy(&all));
  *n         = 0;
  *dependent = NULL;
  if (!rank) {
    std::vector<PetscInt> number;
    std::vector<char>     flags;
    Triangle              triangle;

    PetscCall(TriangleCreate(local[0], number, &triangle));
    Eliminate(triangle, tol, flags);
    PetscCall(PetscMalloc1(m, dependent));
    for (PetscInt i = 0; i < m; i++)
      if (flags[number[i]]) (*dependent)[(*n)++] = i;
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
  for (; *pass < 3 && !*n && !(error <= (*pass ? unusable : suspicious)); ++*pass) {
    PetscCall(PetscFree(*dependent));
    PetscCall(PetscInfo(gram->S, "Solves with the Gram matrix have a relative error of %g: looking for linearly dependent rows of C\n", (double)error));
    PetscCall(FindDependentRows(gram->S, dependentSquare[*pass], n, dependent));
  }
  if (!*reason && !(error <= unusable)) *reason = PC_FACTOR_NUMERIC_ZEROPIVOT;
  *doubtful = !(error <= accurate);
  if (*doubtful && !*reason && !*n)
    PetscCall(PetscInfo(gram->S, "Solves with the Gram matrix have a relative error of %g: rows of C are nearly linearly dependent, and solves refined\n",
                        (double)error));
  PetscFunctionReturn(PETSC_SUCCESS);
}
