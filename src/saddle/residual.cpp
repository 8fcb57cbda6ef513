/* What is left of both equations of the program's own system, row by row */
#include "terms.h"
#include <memory>
#include <vector>

/*
   `own` is the rounding of the terms of a row of A x + C' lambda = f, through solves with a Gram matrix whose condition number is a million, and 1e8 where it is
   `doubtful`; `most` is the part of the largest other term that the rounding of multipliers may be which cancel each other;
   `noise` is that of the right-hand side of a zero row of C, relative to the largest |g|, and that of f - C' lambda, by way of the rows of C;
   `rounding` is that of an entry of x among larger ones;
   `coupled` is what a row may be left with that D couples to others, relative to what was asked for;
   `given` is what a force on an unknown without stiffness may be missed by, relative to tol;
   `told` is that of a row that depends on others nearly; `before` that of one that depends on others, of the largest terms of earlier solves
*/
static const PetscReal own      = 1e-10;
static const PetscReal doubted  = 1e-6;
static const PetscReal most     = 1e-6;
static const PetscReal noise    = 1000 * PETSC_MACHINE_EPSILON;
static const PetscReal rounding = 10 * PETSC_MACHINE_EPSILON;
static const PetscReal coupled  = 100;
static const PetscReal given    = 100;
static const PetscReal told     = 1e-12;
static const PetscReal before   = 1e-10;

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
  if (sp->rowsD) { /* added up by itself: what cancels in D lambda would take the rest along */
    Vec work;

    PetscCall(VecDuplicate(dual, &work));
    PetscCall(MatMult(sp->rowsD, lambda, work));
    PetscCall(VecAXPY(dual, 1.0, work));
    PetscCall(VecDestroy(&work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleEnergy - (x' A x + lambda' D lambda)^{1/2}, from a product with A

   The energy of both equations: D is the compliance of springs that the multipliers load. A huge lambda that a singular D takes to nothing has none: what is
   left of its terms is their rounding.
*/
PetscErrorCode AinsworthSaddleEnergy(const AinsworthSaddle *sp, Vec x, Vec lambda, Vec Ax, PetscReal *energy)
{
  static const PetscReal cancelled = 100 * PETSC_MACHINE_EPSILON;
  PetscScalar            product;
  PetscReal              springs = 0.0, terms;
  Mat                    M;
  Vec                    absolute;

  PetscFunctionBegin;
  PetscCall(VecDot(Ax, x, &product));
  if (sp->rowsD) {
    PetscCall(AinsworthFormValue(sp->rowsD, lambda, &springs));
    PetscCall(AinsworthAbsoluteAIJ(sp->rowsD, &M));
    PetscCall(AinsworthDuplicateAbs(lambda, &absolute));
    PetscCall(AinsworthFormValue(M, absolute, &terms));
    PetscCall(VecDestroy(&absolute));
    PetscCall(MatDestroy(&M));
    if (springs <= cancelled * terms) springs = 0.0;
  }
  *energy = PetscSqrtReal(PetscAbsScalar(product) + springs);
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

/*
   AinsworthSaddleCheckPrimal - the row of f - op(A) x - B' lambda that is largest against what is allowed

   An error e with ||e||_A <= tol ||x||_A has residuals of at most tol ||x||_A A_ii^{1/2}, by Cauchy's and Schwarz's inequality; the rounding of x counts relative
   to the largest, that of f - C' lambda where rows of C take it. Where a row has more, as it may where A is indefinite or x a rigid motion, tol of the row's own
   terms, more where solves with the Gram matrix are doubtful, is allowed; a row of zeros of A has these and what its rows of C see, but a force on it is met to `given` times tol. energy: AinsworthSaddleEnergy()
*/
PetscErrorCode AinsworthSaddleCheckPrimal(const AinsworthSaddle *sp, PetscBool transpose, PetscBool doubtful, PetscReal tol, PetscReal energy, Vec f, Vec x,
                                          Vec lambda, Vec Ax, Vec residual, AinsworthUnmet *worst)
{
  const PetscReal    excused = PetscMax(tol, doubtful ? doubted : own);
  Vec                diagonal, size, through, forces;
  PetscInt           first, n, suspicious = 0;
  PetscReal          displacement;
  const PetscScalar *d, *r, *s, *t, *p, *force;

  PetscFunctionBegin;
  *worst = AinsworthUnmet();
  PetscCall(AinsworthTermsStiffness(sp, &diagonal));
  PetscCall(AinsworthTermsDisplacement(diagonal, x, &displacement, NULL));
  PetscCall(VecGetOwnershipRange(residual, &first, NULL));
  PetscCall(VecGetLocalSize(residual, &n));
  PetscCall(VecGetArrayRead(diagonal, &d));
  PetscCall(VecGetArrayRead(residual, &r));
  PetscCall(VecGetArrayRead(f, &force));
  auto allowed = [&](PetscInt i, PetscReal through, PetscReal spread) {
    const PetscReal stiffness = PetscRealPart(d[i]), cap = force[i] == 0.0 ? PETSC_MAX_REAL : given * tol * PetscAbsScalar(force[i]);
    const PetscReal bound = (stiffness > 0.0 ? tol * energy * PetscSqrtReal(stiffness) : PetscMin(tol * energy * through, cap)) +
                            rounding * displacement * stiffness + noise * spread;

    return PetscIsInfOrNanReal(bound) ? 0.0 : bound; /* it overflows: a row has its own terms */
  };
  for (PetscInt i = 0; i < n && !suspicious; i++) suspicious = !(PetscAbsScalar(r[i]) <= allowed(i, 0.0, 0.0));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &suspicious, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)x)));
  if (suspicious) {
    for (Vec *v : {&size, &through, &forces}) PetscCall(VecDuplicate(x, v));
    PetscCall(AinsworthTermsPrimal(sp, transpose, most / excused, f, x, lambda, Ax, size));
    PetscCall(MatMultHermitianTranspose(sp->rowsB, lambda, forces));
    PetscCall(VecAbs(forces));
    PetscCall(VecCopy(f, through));
    PetscCall(VecAbs(through));
    PetscCall(VecAXPY(forces, 1.0, through));
    PetscCall(AinsworthTermsSpread(sp, diagonal, forces));
    PetscCall(AinsworthTermsThroughRows(sp, diagonal, 1.0, NULL, through));
    PetscCall(VecGetArrayRead(size, &s));
    PetscCall(VecGetArrayRead(through, &t));
    PetscCall(VecGetArrayRead(forces, &p));
    for (PetscInt i = 0; i < n; i++) {
      const PetscReal terms    = PetscRealPart(s[i]);
      const PetscReal bound    = PetscMax(allowed(i, PetscRealPart(t[i]), PetscRealPart(p[i])), excused * terms);
      const PetscReal quotient = AinsworthQuotient(PetscAbsScalar(r[i]), bound);

      if (quotient <= worst->quotient) continue;
      worst->quotient = quotient;
      worst->row      = first + i;
      worst->residual = PetscAbsScalar(r[i]);
      worst->size     = terms;
    }
    PetscCall(VecRestoreArrayRead(size, &s));
    PetscCall(VecRestoreArrayRead(through, &t));
    PetscCall(VecRestoreArrayRead(forces, &p));
    for (Vec *v : {&size, &through, &forces}) PetscCall(VecDestroy(v));
    PetscCall(AgreeOnWorst(PetscObjectComm((PetscObject)x), worst));
  }
  PetscCall(VecRestoreArrayRead(f, &force));
  PetscCall(VecRestoreArrayRead(diagonal, &d));
  PetscCall(VecRestoreArrayRead(residual, &r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleCheckDual - the rows of g - C x + D lambda that are not met: zero and dependent rows, whose right-hand side no x can have, and others

   contradiction names the former, or is empty. tol: what was asked for; a row that depends on others nearly tells what they do not, and has to be met to
   ten times that. allowed is the error in the energy norm that may be left: a row with a D_ii has its part of it, by Cauchy's and Schwarz's inequality, where
   the others are met to rounding. earlier: the terms of each row in earlier solves, whose rounding may be all that g is, or NULL; terms: those of this one, to
   be destroyed.
*/
PetscErrorCode AinsworthSaddleCheckDual(AinsworthSaddle *sp, PetscReal tol, PetscReal allowed, Vec earlier, Vec g, Vec x, Vec lambda, Vec residual,
                                        AinsworthUnmet *worst, char contradiction[], size_t len, Vec *terms)
{
  static const struct {
    AinsworthRowKind kind;
    const char      *text;
  } contradictions[] = {
    {AINSWORTH_ROW_ZERO,      "nonzero on a row of C that is zero (rows %s of the multiplier field): no solution exists"                 },
    {AINSWORTH_ROW_DEPENDENT, "not that of the other rows of C on which it depends (rows %s of the multiplier field): no solution exists"}
  };
  static const char  near[] = "not met on rows of C that were left out, as the Gram matrix C W C' does not tell them from others (rows %s of the multiplier "
                              "field): no solution is found where rows are so near each other in the norm of W";
  Vec                slack, stiffness;
  PetscReal          rhs, least;
  AinsworthUnmet     close;
  const PetscScalar *r, *s, *b, *l = NULL, *e = NULL;
  std::vector<PetscBool> unmet(sp->local, PETSC_FALSE);

  PetscFunctionBegin;
  *worst           = AinsworthUnmet();
  contradiction[0] = 0;
  PetscCall(VecNorm(g, NORM_INFINITY, &rhs));
  PetscCall(VecDuplicate(residual, terms));
  PetscCall(AinsworthTermsDual(sp, PETSC_TRUE, allowed, g, x, lambda, *terms, &slack));
  if (slack) PetscCall(VecGetArrayRead(slack, &l));
  PetscCall(VecGetArrayRead(residual, &r));
  if (earlier) PetscCall(VecGetArrayRead(earlier, &e));
  PetscCall(VecGetArrayRead(*terms, &s));
  PetscCall(VecGetArrayRead(g, &b));
  for (PetscInt i = 0; i < sp->local; i++) {
    const PetscReal size  = PetscRealPart(s[i]);
    const bool      empty = size <= PetscAbsScalar(b[i]); /* other zero rows had columns of unknowns that are known */
    const PetscReal own   = !slack ? 0.0 : PetscRealPart(l[i]) > 0.0 ? PetscRealPart(l[i]) : PetscMin(coupled * tol, 1.0) * size;
    const PetscReal rest  = PetscAbsScalar(r[i]);
    const bool      zero = sp->kind[i] == AINSWORTH_ROW_ZERO, dependent = sp->kind[i] == AINSWORTH_ROW_DEPENDENT;
    const PetscReal noted    = dependent && e ? before * PetscRealPart(e[i]) : 0.0;
    const PetscReal quotient = AinsworthQuotient(rest, zero && empty ? noise * rhs : AinsworthConsistent * size + own + noted);
    AinsworthUnmet *where    = dependent ? &close : worst;
    const PetscReal part     = sp->nearly ? PetscMin(AinsworthConsistent, PetscMax(10 * tol, told)) : AinsworthConsistent;
    const PetscReal found    = dependent ? AinsworthQuotient(rest, part * size + noted) : quotient;

    unmet[i] = (PetscBool)(quotient > 1.0);
    if (zero || found <= where->quotient) continue;
    where->quotient = found;
    where->row      = sp->first + i;
    where->residual = rest;
    where->size     = size;
  }
  PetscCall(VecRestoreArrayRead(residual, &r));
  PetscCall(VecRestoreArrayRead(*terms, &s));
  if (earlier) PetscCall(VecRestoreArrayRead(earlier, &e));
  PetscCall(VecRestoreArrayRead(g, &b));
  if (slack) PetscCall(VecRestoreArrayRead(slack, &l));
  PetscCall(VecDestroy(&slack));
  PetscCall(AgreeOnWorst(PetscObjectComm((PetscObject)x), worst));
  PetscCall(AgreeOnWorst(PetscObjectComm((PetscObject)x), &close));
  for (const auto &c : contradictions) {
    char names[128];

    if (!sp->count[c.kind] || contradiction[0]) continue;
    std::unique_ptr<PetscBool[]> marked(new PetscBool[sp->local + 1]); /* a vector of C's bool, which PetscBool is since 3.24, has no array */
    for (PetscInt i = 0; i < sp->local; i++) marked[i] = (PetscBool)(unmet[i] && sp->kind[i] == c.kind);
    PetscCall(AinsworthSaddleNameRows(sp, marked.get(), names, sizeof(names)));
    if (!names[0]) continue;
    PetscCall(AinsworthTermsStiffness(sp, &stiffness));
    PetscCall(VecMin(stiffness, NULL, &least)); /* 0: an unknown without stiffness, whose weight is made up */
    PetscCall(PetscSNPrintf(contradiction, len, c.kind == AINSWORTH_ROW_DEPENDENT && (sp->nearly || least == 0.0) ? near : c.text, names));
  }
  if (!contradiction[0] && close.quotient > worst->quotient) *worst = close;
  PetscFunctionReturn(PETSC_SUCCESS);
}
