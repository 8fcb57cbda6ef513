/* What is left of both equations of the program's own system, row by row */
#include "terms.h"
#include "../loops.h"

/*
   `own` is the rounding of the terms of a row of A x + C' lambda = f, through solves with a Gram matrix whose condition number is a million, and 1e8 where it is
   `doubtful`; `most` is the part of the largest other term that the rounding of multipliers may be which cancel each other;
   `noise` is that of the right-hand side of a zero row of C, relative to the largest |g|, and that of f - C' lambda, by way of the rows of C;
   `rounding` is that of an entry of x among larger ones;
   `coupled` is what a row may be left with that D couples to others, relative to what was asked for;
   `given` is what a force on an unknown without stiffness may be missed by, relative to tol;
   `told` is that of a row that depends on others nearly; `before` that of one that depends on others, of the largest terms of earlier solves;
   `shown` is how much more of the rounding of other unknowns a dependent row may have than the rows that are kept have
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
static const PetscReal shown    = 1e3;

/* left = b - K y of the matrix as the program passed it: f - op(A) x - B' lambda and g - C x + D lambda; Ax becomes op(A) x, unless it is that already */
PetscErrorCode AinsworthSaddleResidual(const AinsworthSaddle *sp, PetscBool transpose, PetscBool known, AinsworthSaddleVec b, AinsworthSaddleVec y, Vec Ax,
                                       AinsworthSaddleVec left)
{
  PetscFunctionBegin;
  if (!known) PetscCall((transpose ? MatMultTranspose : MatMult)(sp->block[0], y.primal, Ax));
  PetscCall(MatMultHermitianTranspose(sp->rowsB, y.dual, left.primal));
  PetscCall(VecAXPBYPCZ(left.primal, 1.0, -1.0, -1.0, b.primal, Ax));
  PetscCall(MatMult(sp->givenC, y.primal, left.dual));
  PetscCall(VecAYPX(left.dual, -1.0, b.dual));
  if (sp->rowsD) { /* added up by itself: what cancels in D lambda would take the rest along */
    Vec work;

    PetscCall(VecDuplicate(left.dual, &work));
    PetscCall(MatMult(sp->rowsD, y.dual, work));
    PetscCall(VecAXPY(left.dual, 1.0, work));
    PetscCall(VecDestroy(&work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleEnergy - (x' A x + lambda' D lambda)^{1/2}, from a product with A

   The energy of both equations: D is the compliance of springs that the multipliers load. A huge lambda that a singular D takes to nothing has none: what is
   left of its terms is their rounding.
*/
PetscErrorCode AinsworthSaddleEnergy(const AinsworthSaddle *sp, AinsworthSaddleVec y, Vec Ax, PetscReal *energy)
{
  static const PetscReal cancelled = 100 * PETSC_MACHINE_EPSILON;
  PetscScalar            product;
  PetscReal              springs = 0.0, terms;
  Mat                    M;
  Vec                    absolute;

  PetscFunctionBegin;
  PetscCall(VecDot(Ax, y.primal, &product));
  if (sp->rowsD) {
    PetscCall(AinsworthFormValue(sp->rowsD, y.dual, &springs));
    PetscCall(AinsworthAbsoluteAIJ(sp->rowsD, &M));
    PetscCall(AinsworthDuplicateAbs(y.dual, &absolute));
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
PetscErrorCode AinsworthSaddleCheckPrimal(const AinsworthSaddle *sp, PetscBool transpose, PetscBool doubtful, PetscReal tol, PetscReal energy, Vec f,
                                          AinsworthSaddleVec y, Vec Ax, Vec residual, AinsworthUnmet *worst)
{
  const PetscReal excused = PetscMax(tol, doubtful ? doubted : own);
  Vec             diagonal, size, through, forces;
  PetscInt        first, suspicious = 0;
  PetscReal       displacement;

  PetscFunctionBegin;
  *worst = AinsworthUnmet();
  PetscCall(AinsworthTermsStiffness(sp, &diagonal));
  PetscCall(AinsworthTermsDisplacement(diagonal, y.primal, &displacement, NULL));
  PetscCall(VecGetOwnershipRange(residual, &first, NULL));
  auto allowed = [&](PetscReal stiffness, PetscScalar force, PetscReal through, PetscReal spread) {
    const PetscReal cap   = force == 0.0 ? PETSC_MAX_REAL : given * tol * PetscAbsScalar(force);
    const PetscReal bound = (stiffness > 0.0 ? tol * energy * PetscSqrtReal(stiffness) : PetscMin(tol * energy * through, cap)) +
                            rounding * displacement * stiffness + noise * spread;

    return PetscIsInfOrNanReal(bound) ? 0.0 : bound; /* it overflows: a row has its own terms */
  };
  PetscCall(AinsworthForEntries({diagonal, residual}, [&](PetscInt, PetscScalar d, PetscScalar r) {
    if (!(PetscAbsScalar(r) <= allowed(PetscRealPart(d), 0.0, 0.0, 0.0))) suspicious = 1;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &suspicious, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)f)));
  if (suspicious) {
    for (Vec *v : {&size, &forces}) PetscCall(VecDuplicate(f, v));
    PetscCall(AinsworthTermsPrimal(sp, transpose, most / excused, f, y, Ax, size));
    PetscCall(MatMultHermitianTranspose(sp->rowsB, y.dual, forces));
    PetscCall(VecAbs(forces));
    PetscCall(AinsworthDuplicateAbs(f, &through));
    PetscCall(VecAXPY(forces, 1.0, through));
    PetscCall(AinsworthTermsSpread(sp, diagonal, forces));
    PetscCall(AinsworthTermsThroughRows(sp, diagonal, 1.0, NULL, through));
    auto look = [&](PetscInt i, PetscScalar d, PetscScalar r, PetscScalar force, PetscScalar s, PetscScalar t, PetscScalar p) {
      const PetscReal terms    = PetscRealPart(s);
      const PetscReal bound    = PetscMax(allowed(PetscRealPart(d), force, PetscRealPart(t), PetscRealPart(p)), excused * terms);
      const PetscReal quotient = AinsworthQuotient(PetscAbsScalar(r), bound);

      if (quotient > worst->quotient) *worst = {quotient, PetscAbsScalar(r), terms, first + i};
    };
    PetscCall(AinsworthForEntries({diagonal, residual, f, size, through, forces}, look));
    for (Vec *v : {&size, &through, &forces}) PetscCall(VecDestroy(v));
    PetscCall(AgreeOnWorst(PetscObjectComm((PetscObject)f), worst));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleCheckDual - the rows of g - C x + D lambda that are not met: zero and dependent rows, whose right-hand side no x can have, and others

   contradiction names the former, or is empty. tol: what was asked for; a row that depends on others nearly tells what they do not, and has to be met to
   ten times that. allowed is the error in the energy norm that may be left: a row with a D_ii has its part of it, by Cauchy's and Schwarz's inequality, where
   the others are met to rounding. earlier: the terms of each row in earlier solves, whose rounding may be all that g is, or NULL; terms: those of this one, to
   be destroyed.
*/
PetscErrorCode AinsworthSaddleCheckDual(AinsworthSaddle *sp, PetscReal tol, PetscReal allowed, Vec earlier, Vec g, AinsworthSaddleVec y, Vec residual,
                                        AinsworthUnmet *worst, char contradiction[], size_t len, Vec *terms)
{
  static const struct {
    AinsworthRowKind kind;
    const char      *text;
  } contradictions[] = {
    {AINSWORTH_ROW_ZERO,      "nonzero on a row of C that is zero (rows %s of the multiplier field): no solution exists"                 },
    {AINSWORTH_ROW_DEPENDENT, "not that of the other rows of C on which it depends (rows %s of the multiplier field): no solution exists"}
  };
  static const char near[] = "not met on rows of C that were left out, as the Gram matrix C W C' does not tell them from others (rows %s of the multiplier "
                             "field): no solution is found where rows are so near each other in the norm of W";
  Vec               slack, stiffness;
  PetscReal         rhs, softest;
  AinsworthUnmet    close;
  std::vector<bool> unmet(sp->local);

  PetscFunctionBegin;
  *worst           = AinsworthUnmet();
  contradiction[0] = 0;
  PetscCall(VecNorm(g, NORM_INFINITY, &rhs));
  PetscCall(VecDuplicate(residual, terms));
  PetscCall(AinsworthTermsDual(sp, 1.0, allowed, g, y, *terms, &slack));
  bool dependents = false; /* rows of this kind, or all others */
  auto look       = [&](PetscInt i, PetscScalar r, PetscScalar s, PetscScalar b, PetscScalar l, PetscScalar e) {
    if ((sp->kind[i] == AINSWORTH_ROW_DEPENDENT) != dependents) return;
    const PetscReal size     = PetscRealPart(s);
    const bool      empty    = size <= PetscAbsScalar(b); /* other zero rows had columns of unknowns that are known */
    const PetscReal own      = !slack ? 0.0 : PetscRealPart(l) > 0.0 ? PetscRealPart(l) : PetscMin(coupled * tol, 1.0) * size;
    const PetscReal rest     = PetscAbsScalar(r);
    const bool      zero     = sp->kind[i] == AINSWORTH_ROW_ZERO;
    const PetscReal noted    = dependents && earlier ? before * PetscRealPart(e) : 0.0;
    const PetscReal quotient = AinsworthQuotient(rest, zero && empty ? noise * rhs : AinsworthConsistent * size + own + noted);
    AinsworthUnmet *where    = dependents ? &close : worst;
    const PetscReal part     = sp->nearly ? PetscMin(AinsworthConsistent, PetscMax(10 * tol, told)) : AinsworthConsistent;
    const PetscReal found    = dependents ? AinsworthQuotient(rest, part * size + noted) : quotient;

    unmet[i] = quotient > 1.0;
    if (!zero && found > where->quotient) *where = {found, rest, size, sp->first + i};
  };
  PetscCall(AinsworthForEntries({residual, *terms, g, slack ? slack : g, earlier ? earlier : g}, look));
  PetscCall(AgreeOnWorst(PetscObjectComm((PetscObject)g), worst));
  PetscCall(VecDestroy(&slack));
  if (sp->count[AINSWORTH_ROW_DEPENDENT]) {
    Vec narrow;

    PetscCall(VecDuplicate(residual, &narrow));
    PetscCall(AinsworthTermsDual(sp, PetscMin(PetscMax(shown * worst->quotient, AinsworthCombinedLeast), 1.0), allowed, g, y, narrow, &slack));
    dependents = true;
    PetscCall(AinsworthForEntries({residual, narrow, g, slack ? slack : g, earlier ? earlier : g}, look));
    PetscCall(AgreeOnWorst(PetscObjectComm((PetscObject)g), &close));
    PetscCall(VecDestroy(&slack));
    PetscCall(VecDestroy(&narrow));
  }
  for (const auto &c : contradictions) {
    char              names[128];
    std::vector<bool> marked(unmet);

    if (!sp->count[c.kind] || contradiction[0]) continue;
    for (PetscInt i = 0; i < sp->local; i++) marked[i] = marked[i] && sp->kind[i] == c.kind;
    PetscCall(AinsworthSaddleNameRows(sp, marked, names, sizeof(names)));
    if (!names[0]) continue;
    PetscCall(AinsworthTermsStiffness(sp, &stiffness));
    PetscCall(VecMin(stiffness, NULL, &softest)); /* 0: an unknown without stiffness, whose weight is made up */
    PetscCall(PetscSNPrintf(contradiction, len, c.kind == AINSWORTH_ROW_DEPENDENT && (sp->nearly || softest == 0.0) ? near : c.text, names));
  }
  if (!contradiction[0] && close.quotient > worst->quotient) *worst = close;
  PetscFunctionReturn(PETSC_SUCCESS);
}
