/* What is left of both equations of the program's own system, row by row */
#include "saddle.h"
#include <memory>
#include <vector>

/*
   Of what a row of C x = g holds, |C_i| |x| + |g_i|, `consistent` is the rounding of a right inverse through a Gram matrix with a condition number of 1e8;
   `own` is that of the terms of a row of A x + C' lambda = f, through the same solves;
   `combined` is that which a row gets from the others through S, relative to the largest |x|, and a zero row of A, whose multipliers may be small among others;
   `noise` is that of the right-hand side of a zero row of C, relative to the largest |g|, and that of f - C' lambda, relative to both;
   `rounding` is that of an entry of x among larger ones
*/
static const PetscReal consistent = 1e-8;
static const PetscReal own        = 1e-6;
static const PetscReal combined   = 1e5 * PETSC_MACHINE_EPSILON;
static const PetscReal noise      = 1000 * PETSC_MACHINE_EPSILON;
static const PetscReal rounding   = 10 * PETSC_MACHINE_EPSILON;

/* primal = f - op(A) x - B' lambda, dual = g - C x + D lambda, of the matrix as the program passed it; Ax becomes op(A) x, unless it is that already */
PetscErrorCode AinsworthSaddleResidual(const AinsworthSaddle *sp, PetscBool transpose, PetscBool known, Vec f, Vec g, Vec x, Vec lambda, Vec Ax, Vec primal,
                                       Vec dual)
{
  PetscFunctionBegin;
  if (transpose && !known) PetscCall(MatMultTranspose(sp->block[0], x, Ax));
  else if (!known) PetscCall(MatMult(sp->block[0], x, Ax));
  PetscCall(MatMultHermitianTranspose(sp->rowsB, lambda, primal));
  PetscCall(VecAXPBYPCZ(primal, 1.0, -1.0, -1.0, f, Ax));
  PetscCall(MatMult(sp->givenC, x, dual));
  PetscCall(VecAYPX(dual, -1.0, g));
  if (sp->rowsD) PetscCall(MatMultAdd(sp->rowsD, lambda, dual, dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleEnergy - (x' A x + lambda' D lambda)^{1/2}, from a product with A

   The energy of both equations: D is the compliance of springs that the multipliers load.
*/
PetscErrorCode AinsworthSaddleEnergy(const AinsworthSaddle *sp, Vec x, Vec lambda, Vec Ax, PetscReal *energy)
{
  PetscScalar product;
  PetscReal   springs = 0.0;

  PetscFunctionBegin;
  PetscCall(VecDot(Ax, x, &product));
  if (sp->rowsD) PetscCall(AinsworthFormValue(sp->rowsD, lambda, &springs));
  *energy = PetscSqrtReal(PetscAbsScalar(product) + springs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DuplicateAbs(Vec x, Vec *absolute)
{
  PetscFunctionBegin;
  PetscCall(VecDuplicate(x, absolute));
  PetscCall(VecCopy(x, *absolute));
  PetscCall(VecAbs(*absolute));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* size = |op(A)| |x| + |B|' |lambda| + |f|, what the terms of each row of the first equation amount to */
static PetscErrorCode PrimalSizes(const AinsworthSaddle *sp, PetscBool transpose, Vec f, Vec x, Vec lambda, Vec Ax, Vec size)
{
  Vec       absolute, part;
  Mat       A, M;
  PetscBool rows;

  PetscFunctionBegin;
  PetscCall(DuplicateAbs(f, &part));
  PetscCall(MatHasOperation(sp->block[0], MATOP_GET_ROW, &rows));
  if (rows) {
    PetscCall(AinsworthGetAIJ(sp->block[0], &A));
    PetscCall(AinsworthAbsoluteAIJ(A, &M));
    PetscCall(DuplicateAbs(x, &absolute));
    if (transpose) PetscCall(MatMultTransposeAdd(M, absolute, part, size));
    else PetscCall(MatMultAdd(M, absolute, part, size));
    PetscCall(VecDestroy(&absolute));
    PetscCall(MatDestroy(&M));
    PetscCall(MatDestroy(&A));
  } else { /* a shell tells its products only */
    PetscCall(VecCopy(Ax, size));
    PetscCall(VecAbs(size));
    PetscCall(VecAXPY(size, 1.0, part));
  }
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsB, &M));
  PetscCall(DuplicateAbs(lambda, &absolute));
  PetscCall(MatMultTransposeAdd(M, absolute, size, part));
  PetscCall(VecCopy(part, size));
  PetscCall(VecDestroy(&absolute));
  PetscCall(VecDestroy(&part));
  PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: the worst of all ranks, and its row on all of them */
static PetscErrorCode AgreeOnWorst(MPI_Comm comm, AinsworthUnmet *worst)
{
  struct {
    double quotient;
    int    rank;
  } mine;
  PetscMPIInt rank;
  PetscReal   values[2] = {worst->residual, worst->size};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  mine = {(double)worst->quotient, rank};
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &mine, 1, MPI_DOUBLE_INT, MPI_MAXLOC, comm));
  worst->quotient = (PetscReal)mine.quotient;
  PetscCallMPI(MPI_Bcast(&worst->row, 1, MPIU_INT, mine.rank, comm));
  PetscCallMPI(MPI_Bcast(values, 2, MPIU_REAL, mine.rank, comm));
  worst->residual = values[0];
  worst->size     = values[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* quotient of a residual and its bound, infinite where either is not a number: a bound that overflows allows nothing */
static PetscReal Quotient(PetscReal residual, PetscReal bound)
{
  if (residual == 0.0) return 0.0;
  const PetscReal quotient = residual / bound;
  return quotient >= 0.0 && !PetscIsInfOrNanReal(bound) ? PetscMin(quotient, PETSC_MAX_REAL) : PETSC_MAX_REAL;
}

/*
   The square root of what each unknown sees of A through its rows of C, sum_i |B_ij| / (C diag(A)^{-1} C')_ii^{1/2}: how stiff a row of zeros of A is where
   those that it is tied to follow it
*/
static PetscErrorCode StiffnessThroughRows(const AinsworthSaddle *sp, Vec diagonal, PetscReal stiffest, Vec *stiffness)
{
  Vec          weight, sums;
  Mat          M;
  PetscInt     n;
  PetscScalar *w;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(diagonal, &weight));
  PetscCall(VecDuplicate(diagonal, stiffness));
  PetscCall(MatCreateVecs(sp->rowsC, NULL, &sums));
  PetscCall(VecCopy(diagonal, weight));
  PetscCall(VecGetLocalSize(weight, &n));
  PetscCall(VecGetArray(weight, &w));
  for (PetscInt i = 0; i < n; i++) w[i] = 1 / PetscSqrtReal(PetscRealPart(w[i]) > 0.0 ? PetscRealPart(w[i]) : stiffest);
  PetscCall(VecRestoreArray(weight, &w));
  PetscCall(AinsworthRowSquares(sp->rowsC, weight, sums));
  PetscCall(VecSqrtAbs(sums));
  PetscCall(VecReciprocal(sums)); /* leaves zeros */
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsB, &M));
  PetscCall(MatMultTranspose(M, sums, *stiffness));
  PetscCall(MatDestroy(&M));
  PetscCall(VecDestroy(&weight));
  PetscCall(VecDestroy(&sums));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the diagonal of A has a zero, or a negative entry, the largest of its row tells how stiff it is; rows of zeros stay what they are */
static PetscErrorCode LookAtRows(const AinsworthSaddle *sp, Vec diagonal)
{
  Mat          A;
  PetscInt     first, n;
  PetscBool    look = PETSC_FALSE, has;
  PetscScalar *d;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(sp->block[0], MATOP_GET_ROW, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetOwnershipRange(diagonal, &first, NULL));
  PetscCall(VecGetLocalSize(diagonal, &n));
  PetscCall(VecGetArray(diagonal, &d));
  for (PetscInt i = 0; i < n; i++)
    if (!(PetscRealPart(d[i]) > 0.0)) look = PETSC_TRUE;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &look, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)diagonal)));
  if (look) PetscCall(AinsworthGetAIJ(sp->block[0], &A));
  for (PetscInt i = 0; i < n && look; i++) {
    PetscInt           entries;
    const PetscScalar *a;
    PetscReal          most = 0.0;

    if (PetscRealPart(d[i]) > 0.0) continue;
    PetscCall(MatGetRow(A, first + i, &entries, NULL, &a));
    for (PetscInt k = 0; k < entries; k++) most = PetscMax(most, PetscAbsScalar(a[k]));
    PetscCall(MatRestoreRow(A, first + i, &entries, NULL, &a));
    d[i] = most;
  }
  if (look) PetscCall(MatDestroy(&A));
  PetscCall(VecRestoreArray(diagonal, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleCheckPrimal - the row of f - op(A) x - B' lambda that is largest against what is allowed

   An error e with ||e||_A <= tol ||x||_A has residuals of at most tol ||x||_A A_ii^{1/2}, by Cauchy's and Schwarz's inequality; the rounding of f - C' lambda
   counts in the norm of diag(A)^{-1}, that of x relative to the largest. Where a row has more, as it may where A is indefinite or x a rigid motion, tol of the
   row's own terms, 1e-6 at least, is allowed. A row of zeros of A is as stiff as its rows of C see it. energy: AinsworthSaddleEnergy()
*/
PetscErrorCode AinsworthSaddleCheckPrimal(const AinsworthSaddle *sp, PetscBool transpose, PetscReal tol, PetscReal energy, Vec f, Vec x, Vec lambda, Vec Ax,
                                          Vec residual, AinsworthUnmet *worst)
{
  MPI_Comm           comm = PetscObjectComm((PetscObject)x);
  Vec                diagonal, size, through;
  PetscInt           first, n, suspicious = 0;
  PetscReal          displacement, load = 0.0, largest = 0.0, stiffest = 0.0;
  const PetscScalar *d, *r, *s, *t, *b, *a;

  PetscFunctionBegin;
  *worst = AinsworthUnmet();
  PetscCall(VecDuplicate(x, &diagonal));
  PetscCall(AinsworthGetDiagonal(sp->block[0], diagonal));
  PetscCall(LookAtRows(sp, diagonal));
  PetscCall(VecGetOwnershipRange(residual, &first, NULL));
  PetscCall(VecGetLocalSize(residual, &n));
  PetscCall(VecGetArrayRead(diagonal, &d));
  PetscCall(VecGetArrayRead(residual, &r));
  PetscCall(VecGetArrayRead(f, &b));
  PetscCall(VecGetArrayRead(Ax, &a));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal force = PetscAbsScalar(b[i]) + PetscAbsScalar(b[i] - a[i] - r[i]);

    if (PetscRealPart(d[i]) > 0.0) load += PetscSqr(force / PetscSqrtReal(PetscRealPart(d[i])));
    largest  = PetscMax(largest, force + PetscAbsScalar(a[i]));
    stiffest = PetscMax(stiffest, PetscRealPart(d[i]));
  }
  PetscCall(VecRestoreArrayRead(f, &b));
  PetscCall(VecRestoreArrayRead(Ax, &a));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &load, 1, MPIU_REAL, MPIU_SUM, comm));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_REAL, MPIU_MAX, comm));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &stiffest, 1, MPIU_REAL, MPIU_MAX, comm));
  load = PetscSqrtReal(load);
  PetscCall(VecNorm(x, NORM_INFINITY, &displacement));
  auto allowed = [&](PetscInt i) {
    const PetscReal stiffness = PetscRealPart(d[i]);
    const PetscReal bound     = stiffness > 0.0 ? (tol * energy + noise * load) * PetscSqrtReal(stiffness) + rounding * displacement * stiffness
                                                : combined * largest + rounding * displacement * stiffest;

    return PetscIsInfOrNanReal(bound) ? 0.0 : bound; /* it overflows: a row has its own terms */
  };
  for (PetscInt i = 0; i < n && !suspicious; i++) suspicious = !(PetscAbsScalar(r[i]) <= allowed(i));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &suspicious, 1, MPIU_INT, MPI_MAX, comm));
  if (suspicious) {
    PetscCall(VecDuplicate(x, &size));
    PetscCall(PrimalSizes(sp, transpose, f, x, lambda, Ax, size));
    PetscCall(StiffnessThroughRows(sp, diagonal, stiffest, &through));
    PetscCall(VecGetArrayRead(size, &s));
    PetscCall(VecGetArrayRead(through, &t));
    for (PetscInt i = 0; i < n; i++) {
      const PetscReal terms = PetscRealPart(s[i]), tied = d[i] == 0.0 ? tol * energy * PetscRealPart(t[i]) : 0.0;
      const PetscReal quotient = Quotient(PetscAbsScalar(r[i]), PetscMax(allowed(i) + (PetscIsInfOrNanReal(tied) ? 0.0 : tied), PetscMax(tol, own) * terms));

      if (quotient <= worst->quotient) continue;
      worst->quotient = quotient;
      worst->row      = first + i;
      worst->residual = PetscAbsScalar(r[i]);
      worst->size     = terms;
    }
    PetscCall(VecRestoreArrayRead(size, &s));
    PetscCall(VecRestoreArrayRead(through, &t));
    PetscCall(VecDestroy(&size));
    PetscCall(VecDestroy(&through));
    PetscCall(AgreeOnWorst(comm, worst));
  }
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  PetscCall(VecRestoreArrayRead(residual, &r));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* terms += |D| |lambda|, and slack = allowed times the square root of the sums of the rows of |D| */
static PetscErrorCode AddCompliance(const AinsworthSaddle *sp, PetscReal allowed, Vec lambda, Vec terms, Vec slack)
{
  Mat M;
  Vec absolute;

  PetscFunctionBegin;
  PetscCall(DuplicateAbs(lambda, &absolute));
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsD, &M));
  PetscCall(MatMultAdd(M, absolute, terms, terms));
  PetscCall(AinsworthRowSums(M, 1, slack));
  PetscCall(VecSqrtAbs(slack));
  PetscCall(VecScale(slack, allowed));
  PetscCall(MatDestroy(&M));
  PetscCall(VecDestroy(&absolute));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The terms of each row of the second equation, |C| |x| + |D| |lambda| + |g|, and the rounding that it gets from others; slack: what AddCompliance() allows, or NULL */
static PetscErrorCode DualSizes(AinsworthSaddle *sp, PetscReal allowed, Vec g, Vec x, Vec lambda, Vec size, Vec *slack)
{
  Vec       absolute;
  PetscReal largest;

  PetscFunctionBegin;
  if (!sp->absolute) PetscCall(AinsworthAbsoluteAIJ(sp->givenC, &sp->absolute));
  PetscCall(VecNorm(x, NORM_INFINITY, &largest));
  PetscCall(DuplicateAbs(x, &absolute));
  PetscCall(VecShift(absolute, combined / consistent * largest));
  PetscCall(MatMult(sp->absolute, absolute, size));
  PetscCall(VecDestroy(&absolute));
  *slack = NULL;
  if (sp->rowsD) {
    PetscCall(VecDuplicate(g, slack));
    PetscCall(AddCompliance(sp, allowed, lambda, size, *slack));
  }
  PetscCall(DuplicateAbs(g, &absolute));
  PetscCall(VecAXPY(size, 1.0, absolute));
  PetscCall(VecDestroy(&absolute));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest |r_i| / s_i of rows that are kept, all where kind is NULL; size becomes 1 / s, 0 on other rows */
static PetscErrorCode LargestQuotient(Vec residual, Vec size, const AinsworthRowKind *kind, PetscReal *largest)
{
  PetscInt           n;
  const PetscScalar *r;
  PetscScalar       *s;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(residual, &n));
  PetscCall(VecGetArrayRead(residual, &r));
  PetscCall(VecGetArray(size, &s));
  for (PetscInt i = 0; i < n; i++) {
    const bool kept = !kind || (kind[i] != AINSWORTH_ROW_ZERO && kind[i] != AINSWORTH_ROW_DEPENDENT);

    if (kept) *largest = PetscMax(*largest, Quotient(PetscAbsScalar(r[i]), PetscRealPart(s[i])));
    s[i] = kept && PetscRealPart(s[i]) > 0.0 ? 1.0 / PetscRealPart(s[i]) : 0.0;
  }
  PetscCall(VecRestoreArrayRead(residual, &r));
  PetscCall(VecRestoreArray(size, &s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |B|' t, with t_k the lambda_k that has the energy 1, of A under C_k' or of D_kk: the scale of a row of A that is zero */
static PetscErrorCode UnitForces(AinsworthSaddle *sp, Vec diagonal, Vec forces)
{
  Vec          root, rows, lengths;
  Mat          M;
  PetscInt     n, m;
  PetscReal    stiffest;
  PetscScalar *r, *t;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(diagonal, &root));
  PetscCall(VecCopy(diagonal, root));
  if (PetscDefined(USE_COMPLEX)) PetscCall(VecRealPart(root));
  PetscCall(VecMax(root, NULL, &stiffest));
  PetscCall(VecGetLocalSize(root, &n));
  PetscCall(VecGetArray(root, &r));
  for (PetscInt i = 0; i < n; i++) r[i] = 1.0 / PetscSqrtReal(PetscRealPart(r[i]) > 0.0 ? PetscRealPart(r[i]) : stiffest);
  PetscCall(VecRestoreArray(root, &r));
  PetscCall(MatCreateVecs(sp->rowsC, NULL, &rows));
  PetscCall(VecDuplicate(rows, &lengths));
  PetscCall(AinsworthRowSquares(sp->rowsC, root, lengths));
  if (sp->rowsD) {
    PetscCall(MatGetDiagonal(sp->rowsD, rows));
    PetscCall(VecAbs(rows));
    PetscCall(VecAXPY(lengths, 1.0, rows));
  }
  PetscCall(VecGetLocalSize(lengths, &m));
  PetscCall(VecGetArray(lengths, &t));
  for (PetscInt k = 0; k < m; k++) t[k] = PetscRealPart(t[k]) > 0.0 ? 1.0 / PetscSqrtReal(PetscRealPart(t[k])) : 0.0;
  PetscCall(VecRestoreArray(lengths, &t));
  PetscCall(AinsworthAbsoluteAIJ(sp->rowsB, &M));
  PetscCall(MatMultTranspose(M, lengths, forces));
  PetscCall(MatDestroy(&M));
  PetscCall(VecDestroy(&root));
  PetscCall(VecDestroy(&rows));
  PetscCall(VecDestroy(&lengths));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* size_i at least `little` of the largest of all, in the norm of diag(A)^{-1}: the row of a body that nothing moves has only rounding to show */
static PetscErrorCode RaiseSmallTerms(AinsworthSaddle *sp, Vec size)
{
  static const PetscReal little = 1e-3;
  Vec                    diagonal, forces;
  PetscScalar           *s;
  const PetscScalar     *d, *b;
  PetscReal              most = 0.0;
  PetscInt               n;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(size, &diagonal));
  PetscCall(VecDuplicate(size, &forces));
  PetscCall(MatGetDiagonal(sp->block[0], diagonal));
  PetscCall(UnitForces(sp, diagonal, forces));
  PetscCall(VecGetLocalSize(size, &n));
  PetscCall(VecGetArrayRead(diagonal, &d));
  PetscCall(VecGetArray(size, &s));
  for (PetscInt i = 0; i < n; i++) {
    if (PetscRealPart(d[i]) > 0.0) most = PetscMax(most, PetscRealPart(s[i]) / PetscSqrtReal(PetscRealPart(d[i])));
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)size)));
  PetscCall(VecGetArrayRead(forces, &b));
  for (PetscInt i = 0; i < n; i++)
    s[i] = PetscMax(PetscRealPart(s[i]), little * most * (PetscRealPart(d[i]) > 0.0 ? PetscSqrtReal(PetscRealPart(d[i])) : PetscRealPart(b[i])));
  PetscCall(VecRestoreArrayRead(forces, &b));
  PetscCall(VecDestroy(&forces));
  PetscCall(VecRestoreArray(size, &s));
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleBackwardError - the largest residual of a row of both equations, relative to its terms

   primal and dual: AinsworthSaddleResidual(). rows, of both: one over these terms, 0 where no x can do anything
*/
PetscErrorCode AinsworthSaddleBackwardError(AinsworthSaddle *sp, PetscBool transpose, Vec f, Vec g, Vec x, Vec lambda, Vec Ax, Vec primal, Vec dual,
                                            Vec rowsPrimal, Vec rowsDual, PetscReal *error)
{
  Vec slack;

  PetscFunctionBegin;
  *error = 0.0;
  PetscCall(PrimalSizes(sp, transpose, f, x, lambda, Ax, rowsPrimal));
  PetscCall(RaiseSmallTerms(sp, rowsPrimal));
  PetscCall(LargestQuotient(primal, rowsPrimal, NULL, error));
  PetscCall(DualSizes(sp, 0.0, g, x, lambda, rowsDual, &slack));
  PetscCall(LargestQuotient(dual, rowsDual, sp->kind, error));
  PetscCall(VecDestroy(&slack));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, error, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)f)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleCheckDual - the rows of g - C x + D lambda that are not met: zero and dependent rows, whose right-hand side no x can have, and others

   contradiction names the former, or is empty. allowed is the error in the energy norm that may be left: a row with a D_ii has its part of it, by Cauchy's
   and Schwarz's inequality, where the others are met to rounding.
*/
PetscErrorCode AinsworthSaddleCheckDual(AinsworthSaddle *sp, PetscReal allowed, Vec g, Vec x, Vec lambda, Vec residual, AinsworthUnmet *worst,
                                        char contradiction[], size_t len)
{
  static const struct {
    AinsworthRowKind kind;
    const char      *text;
  } contradictions[] = {
    {AINSWORTH_ROW_ZERO,      "nonzero on a row of C that is zero"                 },
    {AINSWORTH_ROW_DEPENDENT, "not that of the other rows of C on which it depends"}
  };
  Vec                    size, slack;
  PetscReal              rhs;
  const PetscScalar     *r, *s, *l = NULL;
  std::vector<PetscBool> unmet(sp->local, PETSC_FALSE);

  PetscFunctionBegin;
  *worst           = AinsworthUnmet();
  contradiction[0] = 0;
  PetscCall(VecNorm(g, NORM_INFINITY, &rhs));
  PetscCall(VecDuplicate(residual, &size));
  PetscCall(DualSizes(sp, allowed, g, x, lambda, size, &slack));
  if (slack) PetscCall(VecGetArrayRead(slack, &l));
  PetscCall(VecGetArrayRead(residual, &r));
  PetscCall(VecGetArrayRead(size, &s));
  for (PetscInt i = 0; i < sp->local; i++) {
    const PetscReal terms    = PetscRealPart(s[i]);
    const PetscReal bound    = sp->kind[i] == AINSWORTH_ROW_ZERO ? noise * rhs : consistent * terms + (slack ? PetscRealPart(l[i]) : 0.0);
    const PetscReal quotient = Quotient(PetscAbsScalar(r[i]), bound);

    unmet[i] = (PetscBool)(quotient > 1.0);
    if (sp->kind[i] == AINSWORTH_ROW_ZERO || sp->kind[i] == AINSWORTH_ROW_DEPENDENT || quotient <= worst->quotient) continue;
    worst->quotient = quotient;
    worst->row      = sp->first + i;
    worst->residual = PetscAbsScalar(r[i]);
    worst->size     = terms;
  }
  PetscCall(VecRestoreArrayRead(residual, &r));
  PetscCall(VecRestoreArrayRead(size, &s));
  if (slack) PetscCall(VecRestoreArrayRead(slack, &l));
  PetscCall(VecDestroy(&slack));
  PetscCall(VecDestroy(&size));
  PetscCall(AgreeOnWorst(PetscObjectComm((PetscObject)x), worst));
  for (const auto &c : contradictions) {
    char names[128];

    if (!sp->count[c.kind] || contradiction[0]) continue;
    std::unique_ptr<PetscBool[]> marked(new PetscBool[sp->local + 1]); /* a vector of C's bool, which PetscBool is since 3.24, has no array */
    for (PetscInt i = 0; i < sp->local; i++) marked[i] = (PetscBool)(unmet[i] && sp->kind[i] == c.kind);
    PetscCall(AinsworthSaddleNameRows(sp, marked.get(), names, sizeof(names)));
    if (names[0])
      PetscCall(PetscSNPrintf(contradiction, len, "%s%s (rows %s of the multiplier field): no solution %s", c.text,
                              sp->nearly && c.kind == AINSWORTH_ROW_DEPENDENT ? ", exactly or nearly" : "", names,
                              sp->nearly && c.kind == AINSWORTH_ROW_DEPENDENT ? "is found where rows are so near each other" : "exists"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
