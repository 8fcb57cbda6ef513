/* Residuals of both equations of the program's system, row by row */
#include "terms.h"
#include "../loops.h"

/* Tolerances of the checks below */
static const PetscReal own      = 1e-10; /* rounding of the terms of a row of the first equation, through a Gram matrix with a condition number of 1e6 */
static const PetscReal doubted  = 1e-6;  /* the same if solves with the Gram matrix are doubtful */
static const PetscReal most     = 1e-6;  /* rounding of multipliers that cancel each other, relative to the largest other term, at most */
static const PetscReal noise    = 1000 * PETSC_MACHINE_EPSILON; /* rounding of zero rows relative to max |g|, and of f - C' lambda through the rows of C */
static const PetscReal rounding = 10 * PETSC_MACHINE_EPSILON;   /* of an entry of x among larger ones */
static const PetscReal coupled  = 100;                          /* allowed residual of a row that D couples to others, relative to the requested tolerance */
static const PetscReal given    = 100;                          /* allowed error of a force on an unknown without stiffness, relative to tol */
static const PetscReal told     = 1e-12;                        /* smallest tolerance of nearly dependent rows */
static const PetscReal before   = 1e-10; /* rounding of earlier solves allowed in dependent rows, relative to the largest terms of these solves */
static const PetscReal shown    = 1e3;   /* how many times more of the rounding of other unknowns dependent rows may have than kept rows have */

/*
   Computes left = b - K y with the program's matrix: f - op(A) x - B' lambda and g - C x + D lambda

   known: Ax is op(A) x already; otherwise it is computed.
*/
PetscErrorCode AinsworthSaddleResidual(const AinsworthSaddle *sp, PetscBool transpose, PetscBool known, AinsworthSaddleVec b, AinsworthSaddleVec y, Vec Ax,
                                       AinsworthSaddleVec left)
{
  PetscFunctionBegin;
  if (!known) PetscCall((transpose ? MatMultTranspose : MatMult)(sp->block[0], y.primal, Ax));
  PetscCall(MatMultHermitianTranspose(sp->rowsB, y.dual, left.primal));
  PetscCall(VecAXPBYPCZ(left.primal, 1.0, -1.0, -1.0, b.primal, Ax));
  PetscCall(MatMult(sp->givenC, y.primal, left.dual));
  PetscCall(VecAYPX(left.dual, -1.0, b.dual));
  if (sp->rowsD) { /* sum D lambda separately: its cancellation would add rounding to the other terms */
    Vec work;

    PetscCall(VecDuplicate(left.dual, &work));
    PetscCall(MatMult(sp->rowsD, y.dual, work));
    PetscCall(VecAXPY(left.dual, 1.0, work));
    PetscCall(VecDestroy(&work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleEnergy - computes (x' A x + lambda' D lambda)^{1/2} from the product Ax. Collective

   D is the compliance of springs loaded by the multipliers. A huge lambda that a singular D maps to nothing has no energy: what is left of its terms is
   rounding.
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

/* Finds the worst row of all ranks and returns it on all of them. Collective */
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
   AinsworthSaddleCheckPrimal - finds the row of f - op(A) x - B' lambda with the largest ratio of its residual to the allowed one. Collective

   An error e with ||e||_A <= tol ||x||_A has residuals of at most tol ||x||_A A_ii^{1/2} by the Cauchy-Schwarz inequality. The rounding of x, relative to its
   largest entry, and that of f - C' lambda, through the rows of C, are allowed as well. A row may have more if A is indefinite or x is a rigid motion: then tol
   times the terms of the row is allowed, or more if solves with the Gram matrix are doubtful. A zero row of A is allowed its own terms and what its rows of C
   see, but a force on it must be met to `given` times tol. energy: from AinsworthSaddleEnergy().
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

    return PetscIsInfOrNanReal(bound) ? 0.0 : bound; /* overflow: rely on the terms of the row */
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
   AinsworthSaddleCheckDual - finds the rows of g - C x + D lambda that are not met. Collective

   Input Parameters:
+  tol     - requested tolerance; a nearly dependent row has information that the others do not have, and must be met to ten times this
.  allowed - error allowed in the energy norm; a row with a D_ii is allowed its share by the Cauchy-Schwarz inequality, other rows must be met to rounding
-  earlier - terms of each row in earlier solves, whose rounding may be all of g; or NULL

   Output Parameters:
+  worst         - the row with the largest ratio of its residual to the allowed one
.  contradiction - names zero and dependent rows whose right-hand side no x can satisfy; or empty
-  terms         - of each row in this solve; to be destroyed
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
  bool dependents = false; /* look at dependent rows, or at all others */
  auto look       = [&](PetscInt i, PetscScalar r, PetscScalar s, PetscScalar b, PetscScalar l, PetscScalar e) {
    if ((sp->kind[i] == AINSWORTH_ROW_DEPENDENT) != dependents) return;
    const PetscReal size     = PetscRealPart(s);
    const bool      empty    = size <= PetscAbsScalar(b); /* other zero rows had columns of known unknowns */
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
    PetscCall(VecMin(stiffness, NULL, &softest)); /* 0 if an unknown has no stiffness, so that its weight was made up */
    PetscCall(PetscSNPrintf(contradiction, len, c.kind == AINSWORTH_ROW_DEPENDENT && (sp->nearly || softest == 0.0) ? near : c.text, names));
  }
  if (!contradiction[0] && close.quotient > worst->quotient) *worst = close;
  PetscFunctionReturn(PETSC_SUCCESS);
}
