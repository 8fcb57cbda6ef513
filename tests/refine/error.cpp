/* Residuals, terms and the worst rows against dense formulas in long double */
#include "system.h"
#include <cmath>

enum {
  LOOSE     = 1, /* every third unknown has no stiffness; a force acts on half of these */
  EMPTY     = 2, /* a row of C is zero */
  DEPENDENT = 4, /* a row of C is the sum of others */
  TRANSPOSE = 8
};

struct Given {
  const char *name;
  int         compliance, flags;
  bool        symmetric = true;
  PetscReal   decades   = 0.0;
};

/* clang-format off */
static const Given systems[] = {
  {"plain",           NO_D,     0                                             },
  {"D",               COUPLED,  0                                             },
  {"badly scaled",    COUPLED,  0,                                 true,  4.0 },
  {"unsymmetric",     DIAGONAL, 0,                                 false      },
  {"transpose",       NO_D,     TRANSPOSE,                         false      },
  {"loose",           NO_D,     LOOSE                                         },
  {"empty row",       NO_D,     EMPTY                                         },
  {"dependent row",   NO_D,     DEPENDENT                                     },
  {"all, bad scale",  NO_D,     LOOSE | EMPTY | DEPENDENT,         true,  4.0 },
  {"all, transposed", NO_D,     LOOSE | EMPTY | DEPENDENT | TRANSPOSE, false, 2.0}
};
/* clang-format on */

static Blocks DrawGiven(const Given &given, PetscInt seed)
{
  Kind kind{given.name};

  kind.symmetric  = given.symmetric;
  kind.compliance = given.compliance;
  kind.decades    = given.decades;
  Blocks b        = Draw(kind, seed);

  for (PetscInt i = 1; i < b.n() && given.flags & LOOSE; i += 3) {
    b.A.row(i).setZero();
    b.A.col(i).setZero();
  }
  for (Dense *M : {&b.C, &b.B}) {
    if (given.flags & EMPTY) M->row(4).setZero();
    if (given.flags & DEPENDENT) M->row(9) = M->row(2) + M->row(6);
  }
  return b;
}

/* Checks the worst row of one equation; the residual has as many digits as its terms leave */
static PetscErrorCode CheckWorst(const char *what, const AinsworthWorstRow &got, const AinsworthWorstRow &expected)
{
  const std::string name = what;

  PetscFunctionBeginUser;
  PetscCall(CheckInt((name + ": the row").c_str(), got.row, expected.row));
  PetscCall(Check((name + ": difference of the quotient").c_str(), PetscAbsReal(got.omega - expected.omega),
                  1e-6 * expected.omega));
  PetscCall(Check((name + ": difference of the residual").c_str(), PetscAbsReal(got.residual - expected.residual),
                  1e-6 * expected.residual));
  PetscCall(Check((name + ": difference of the terms").c_str(), PetscAbsReal(got.terms - expected.terms),
                  1e-12 * expected.terms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks what constraints may be left with */
static PetscErrorCode CheckAllowed(const Setup &setup, const AinsworthMeasure measure[], const AinsworthBackward &error,
                                   const Truth &exact)
{
  const PetscInt n = setup.dense.n();
  Vec            allowed;
  Column         got;
  PetscReal      off = 0.0;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(setup.b.dual, &allowed));
  PetscCall(AinsworthAllowedOfConstraints(setup.sp.get(), measure, NULL, setup.b, setup.y, &error, allowed));
  PetscCall(Gather(allowed, got));
  PetscCall(VecDestroy(&allowed));
  for (Eigen::Index i = 0; i < got.size(); i++) {
    const PetscReal expected = (PetscReal)exact.allowed[n + i], far = PetscAbsScalar(got[i] - expected);

    off = PetscMax(off, expected > 0.0 ? far / expected : far);
  }
  PetscCall(Check("what constraints are allowed differs by", off, 1e-12));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Residual, terms, and the worst rows where the row `target` has a hundred times what others have */
static PetscErrorCode Compare(const Given &given, Setup *setup, const std::vector<AinsworthRowKind> &kind,
                              PetscInt target, PetscInt seed)
{
  static const AinsworthMeasure measures[][AINSWORTH_ROWS_KINDS] = {
    {{1.0, 0.0},   {1.0, 0.0},    {1.0, 0.0},   {1.0, 0.0}   },
    {{1e-8, 0.0},  {1e-9, 0.0},   {1e-10, 0.0}, {2e-9, 0.0}  },
    {{1e-8, 1e-9}, {1e-9, 1e-11}, {1e-10, 0.0}, {2e-9, 1e-11}},
    {{0.0, 1e-9},  {0.0, 1e-8},   {0.0, 1e-10}, {0.0, 2e-9}  }
  };
  const PetscBool    transpose = (PetscBool)((given.flags & TRANSPOSE) != 0);
  Blocks             d         = setup->dense;
  const PetscInt     n = d.n(), N = n + d.m();
  AinsworthSaddleVec terms;
  AinsworthBackward  error;
  Column             y(N), b, got;

  PetscFunctionBeginUser;
  if (transpose) d.A = Dense(d.A.transpose());
  for (PetscInt i = 0; i < N; i++) y[i] = setup->s[i] * Entry(seed, i, 1);
  for (PetscInt i = 1; i < n && given.flags & LOOSE; i += 6) /* no multiplier acts on these */
    for (PetscInt k = 0; k < d.m(); k++)
      if (d.C(k, i) != 0.0) y[n + k] = 0.0;
  b = Times(d.K(), y);
  for (PetscInt i = 0; i < N; i++)
    if (i >= n || b[i] != 0.0) b[i] += (i == target ? 1e-3 : 1e-5) * Entry(seed, i, 2) / setup->s[i];
  PetscCall(SetBoth(y, setup->y));
  PetscCall(SetBoth(b, setup->b));
  PetscCall(
    AinsworthSaddleResidual(setup->sp.get(), transpose, PETSC_FALSE, setup->b, setup->y, setup->Ax, setup->left));
  PetscCall(GatherBoth(setup->left, got));
  PetscCall(AinsworthSaddleVecDuplicate(setup->b, &terms));
  PetscCall(AinsworthSaddlePrimalTerms(setup->sp.get(), transpose, setup->b, setup->y, setup->Ax, terms.primal));
  PetscCall(AinsworthSaddleDualTerms(setup->sp.get(), setup->b, setup->y, terms.dual));
  const Truth truth = Exact(*setup, kind, transpose, measures[0], b, y);
  PetscReal   off = 0.0, far = 0.0;
  Column      sums;

  PetscCall(GatherBoth(terms, sums));
  for (PetscInt i = 0; i < N; i++) {
    const PetscReal size = (PetscReal)truth.terms[i];

    off = PetscMax(off, size > 0.0 ? PetscAbsScalar(got[i] - (PetscScalar)truth.residual[i]) / size
                                   : PetscAbsScalar(got[i]));
    far = PetscMax(far, size > 0.0 ? PetscAbsReal(PetscRealPart(sums[i]) - size) / size : PetscAbsScalar(sums[i]));
  }
  PetscCall(Check("the residual differs by", off, 1e-14));
  PetscCall(Check("the terms differ by", far, 1e-14));
  for (const auto &measure : measures) {
    const Truth exact = Exact(*setup, kind, transpose, measure, b, y);

    PetscCall(AinsworthBackwardError(setup->sp.get(), transpose, measure, NULL, setup->b, setup->y, setup->Ax,
                                     setup->left, &error));
    PetscCall(CheckWorst("primal", error.primal, exact.worst[0]));
    PetscCall(CheckWorst("dual", error.dual, exact.worst[1]));
    PetscCall(CheckWorst("dependent", error.dependent, exact.worst[2]));
    PetscCall(CheckAllowed(*setup, measure, error, exact));
    PetscCall(Check("difference of the size", PetscAbsReal(error.sizes[0] - (PetscReal)exact.size),
                    1e-12 * (PetscReal)exact.size));
  }
  for (PetscReal factor : {4.0, 100.0}) { /* without a pass over A: an upper bound, which is at most 1 */
    const PetscReal        floor                         = factor * 1e-3;
    const AinsworthMeasure measure[AINSWORTH_ROWS_KINDS] = {
      {1e-9, floor},
      {1e-9, floor},
      {1e-9, floor},
      {1e-9, floor}
    };
    const Truth exact = Exact(*setup, kind, transpose, measure, b, y);

    PetscCall(AinsworthBackwardError(setup->sp.get(), transpose, measure, NULL, setup->b, setup->y, setup->Ax,
                                     setup->left, &error));
    PetscCall(CheckTrue("no pass over A", error.primal.row < 0 && error.dual.row < 0 && error.dependent.row < 0));
    PetscCall(CheckTrue("one bound for all rows of an equation", error.primal.omega <= 1.0 && error.dual.omega <= 1.0 &&
                                                                   error.dependent.omega == error.dual.omega));
    PetscCall(Check("the primal quotient", exact.worst[0].omega, error.primal.omega * (1 + 1e-6)));
    PetscCall(Check("the dual quotient", exact.worst[1].omega, error.dual.omega * (1 + 1e-6)));
    PetscCall(Check("the quotient of dependent rows", exact.worst[2].omega, error.dependent.omega * (1 + 1e-6)));
  }
  PetscCall(AinsworthSaddleVecDestroy(&terms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Random(const Given &given, PetscInt seed)
{
  Setup        setup;
  const Blocks b = DrawGiven(given, seed);
  /* among the kept rows */
  const PetscInt                dropped = given.flags & EMPTY ? 8 : 9, n = b.n(), N = n + b.m();
  std::vector<AinsworthRowKind> kind(b.m(), AINSWORTH_ROW_CONSTRAINT);

  PetscFunctionBeginUser;
  Case("error, %s, seed %d", given.name, (int)seed);
  if (given.flags & EMPTY) kind[4] = AINSWORTH_ROW_ZERO;
  if (given.flags & DEPENDENT) kind[9] = AINSWORTH_ROW_DEPENDENT;
  PetscCall(SetupCreate(b, &setup));
  if (given.flags & DEPENDENT) PetscCall(AinsworthSaddleDropDependent(&setup.sp, 1, &dropped, AINSWORTH_ROW_DEPENDENT));
  bool kinds = true;

  for (PetscInt i = 0; i < setup.sp->local(); i++) kinds = kinds && setup.sp->kind[i] == kind[setup.sp->first + i];
  PetscCall(CheckTrue("the kinds of the rows", kinds));
  for (PetscInt target : {(PetscInt)0, (PetscInt)4, n - 1, n, n + 4, n + 9, N - 1}) {
    Case("error, %s, seed %d, row %d", given.name, (int)seed, (int)target);
    PetscCall(Compare(given, &setup, kind, target, seed + target));
  }
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integers have no rounding: nothing is left. One entry of y that is NaN is infinitely wrong */
static PetscErrorCode Integers(bool compliant)
{
  static const AinsworthMeasure measure[AINSWORTH_ROWS_KINDS] = {
    {1e-14, 0.0},
    {1e-14, 0.0},
    {1e-14, 0.0},
    {1e-14, 0.0}
  };
  Kind              kind{"integers"};
  Setup             setup;
  AinsworthBackward error;

  PetscFunctionBeginUser;
  Case("integers, %s D", compliant ? "with" : "without");
  if (compliant) kind.compliance = COUPLED;
  Blocks d = Draw(kind, 1);

  for (Dense *M : {&d.A, &d.C, &d.D})
    for (PetscScalar &v : M->reshaped()) v = std::round(8.0 * PetscRealPart(v));
  d.B = d.C;
  Column y(d.n() + d.m());

  for (Eigen::Index i = 0; i < y.size(); i++) y[i] = std::round(100.0 * Uniform(5, (PetscInt)i, 0));
  PetscCall(SetupCreate(d, &setup));
  PetscCall(SetBoth(y, setup.y));
  PetscCall(SetBoth(Times(d.K(), y), setup.b));
  PetscCall(AinsworthSaddleResidual(setup.sp.get(), PETSC_FALSE, PETSC_FALSE, setup.b, setup.y, setup.Ax, setup.left));
  PetscCall(
    AinsworthBackwardError(setup.sp.get(), PETSC_FALSE, measure, NULL, setup.b, setup.y, setup.Ax, setup.left, &error));
  PetscCall(
    CheckTrue("nothing is left", error.primal.omega == 0.0 && error.dual.omega == 0.0 && error.dependent.omega == 0.0));
  PetscCall(CheckTrue("no row is named", error.primal.row < 0 && error.dual.row < 0 && error.dependent.row < 0));
  for (PetscInt bad : {(PetscInt)7, d.n() + 3}) {
    Column wrong = y;

    wrong[bad] = std::nan("");
    for (const AinsworthMeasure &m : {
           AinsworthMeasure{1e-14, 0.0  },
           AinsworthMeasure{1e-8,  1e-14},
           AinsworthMeasure{0.5,   0.5  }
    }) {
      const AinsworthMeasure same[AINSWORTH_ROWS_KINDS] = {m, m, m, m, m};

      PetscCall(SetBoth(wrong, setup.y));
      PetscCall(
        AinsworthSaddleResidual(setup.sp.get(), PETSC_FALSE, PETSC_FALSE, setup.b, setup.y, setup.Ax, setup.left));
      PetscCall(AinsworthBackwardError(setup.sp.get(), PETSC_FALSE, same, NULL, setup.b, setup.y, setup.Ax, setup.left,
                                       &error));
      PetscCall(CheckTrue("infinitely wrong", error.primal.omega == PETSC_MAX_REAL &&
                                                (bad >= d.n() || error.dual.omega == PETSC_MAX_REAL)));
    }
  }
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f = C' lambda and g = 0: a body at rest, which has only rounding */
static PetscErrorCode AtRest(PetscInt seed)
{
  static const AinsworthMeasure measure[AINSWORTH_ROWS_KINDS] = {
    {1e-9, 50 * PETSC_MACHINE_EPSILON},
    {1e-8, 50 * PETSC_MACHINE_EPSILON},
    {1e-8, 0.0                       },
    {1e-8, 50 * PETSC_MACHINE_EPSILON}
  };
  Setup             setup;
  AinsworthBackward error;
  const Blocks      d = DrawGiven({"at rest", NO_D, LOOSE, true, 4.0}, seed);
  Column            y = Column::Zero(d.n() + d.m()), b;

  PetscFunctionBeginUser;
  Case("at rest, seed %d", (int)seed);
  PetscCall(SetupCreate(d, &setup));
  for (PetscInt k = 0; k < d.m(); k++) y[d.n() + k] = Entry(seed, k, 3) * setup.s[d.n() + k];
  b = Times(d.K(), y);
  for (bool wrong : {false, true}) {
    if (wrong) b[0] += 1e-6 / setup.s[0];
    PetscCall(SetBoth(y, setup.y));
    PetscCall(SetBoth(b, setup.b));
    PetscCall(
      AinsworthSaddleResidual(setup.sp.get(), PETSC_FALSE, PETSC_FALSE, setup.b, setup.y, setup.Ax, setup.left));
    PetscCall(AinsworthBackwardError(setup.sp.get(), PETSC_FALSE, measure, NULL, setup.b, setup.y, setup.Ax, setup.left,
                                     &error));
    PetscCall(CheckTrue("met unless wrong", (error.primal.omega <= 1.0) == !wrong));
    PetscCall(CheckTrue("the constraints are met", error.dual.omega == 0.0));
  }
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A soft unknown is held by C, whose entry is the largest in its column: beside its own row it is no large term */
static PetscErrorCode HeldByC()
{
  AinsworthMeasure  measure[AINSWORTH_ROWS_KINDS];
  Setup             setup;
  AinsworthBackward error;
  Column            diagonal(2), y = Column::Zero(3), b;
  Blocks            d;

  PetscFunctionBeginUser;
  Case("a soft unknown is held by C");
  for (AinsworthMeasure &m : measure) m = {1e-9, 1e-3};
  diagonal << 1e-12, 1.0;
  d    = Handmade(diagonal, Dense::Ones(1, 2));
  y[0] = 1.0;
  b    = Times(d.K(), y);
  b[0] *= 1.5;
  PetscCall(SetupCreate(d, &setup));
  PetscCall(SetBoth(y, setup.y));
  PetscCall(SetBoth(b, setup.b));
  PetscCall(AinsworthSaddleResidual(setup.sp.get(), PETSC_FALSE, PETSC_FALSE, setup.b, setup.y, setup.Ax, setup.left));
  PetscCall(
    AinsworthBackwardError(setup.sp.get(), PETSC_FALSE, measure, NULL, setup.b, setup.y, setup.Ax, setup.left, &error));
  PetscCall(
    CheckWorst("primal", error.primal, Exact(setup, {AINSWORTH_ROW_CONSTRAINT}, false, measure, b, y).worst[0]));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of zeros of A: a force that is given is no rounding, however small; a multiplier that leaves as much is */
static PetscErrorCode Forces()
{
  static const AinsworthMeasure measure[AINSWORTH_ROWS_KINDS] = {
    {1e-9, 1e-14},
    {1e-8, 1e-14},
    {1e-8, 0.0  },
    {1e-8, 1e-14}
  };
  Setup             setup;
  AinsworthBackward error;
  Column            diagonal(4), y = Column::Zero(6), b = Column::Zero(6);
  Dense             C(2, 4);

  PetscFunctionBeginUser;
  diagonal << 1.0, 0.0, 0.0, 1.0;
  C << 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0;
  PetscCall(SetupCreate(Handmade(diagonal, C), &setup));
  for (bool force : {false, true}) {
    Case("a row of zeros of A %s a force", force ? "with" : "without");
    y.setZero(), b.setZero();
    y[0] = b[0] = b[4] = 1.0; /* the first body is where it should be */
    if (force) b[1] = 1e-20;
    else y[5] = 1e-20;
    PetscCall(SetBoth(y, setup.y));
    PetscCall(SetBoth(b, setup.b));
    PetscCall(
      AinsworthSaddleResidual(setup.sp.get(), PETSC_FALSE, PETSC_FALSE, setup.b, setup.y, setup.Ax, setup.left));
    PetscCall(AinsworthBackwardError(setup.sp.get(), PETSC_FALSE, measure, NULL, setup.b, setup.y, setup.Ax, setup.left,
                                     &error));
    if (force) {
      PetscCall(CheckInt("the row", error.primal.row, 1));
      PetscCall(Check("difference to 1e8", PetscAbsReal(error.primal.omega - 1e8), 1.0));
      PetscCall(CheckTrue("the constraints are met", error.dual.omega == 0.0));
    } else PetscCall(Check("the quotient", PetscMax(error.primal.omega, error.dual.omega), 1e-5));
  }
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   An unknown without a diagonal entry, whose stiffest neighbor is much stiffer: its multiples are small terms in the
   units of the scale, and no bound for others
*/
static PetscErrorCode NoDiagonal()
{
  static const AinsworthMeasure measure[AINSWORTH_ROWS_KINDS] = {
    {1e-9, 1e-2},
    {1e-9, 1e-2},
    {1e-9, 1e-2},
    {1e-9, 1e-2}
  };
  Setup             setup;
  AinsworthBackward error;
  Blocks            d = Handmade(Column::Ones(3), Dense(Column::Unit(3, 2).transpose()));
  Column            y = Column::Unit(4, 0), b;

  PetscFunctionBeginUser;
  Case("an unknown without a diagonal entry");
  d.A(0, 0) = 0.0;
  d.A(0, 1) = d.A(1, 0) = 1.0;
  d.A(1, 1)             = 1e8;
  PetscCall(SetupCreate(d, &setup));
  b = Times(d.K(), y);
  b[2] += 1e-3;
  PetscCall(SetBoth(y, setup.y));
  PetscCall(SetBoth(b, setup.b));
  PetscCall(AinsworthSaddleResidual(setup.sp.get(), PETSC_FALSE, PETSC_FALSE, setup.b, setup.y, setup.Ax, setup.left));
  PetscCall(
    AinsworthBackwardError(setup.sp.get(), PETSC_FALSE, measure, NULL, setup.b, setup.y, setup.Ax, setup.left, &error));
  const Truth exact = Exact(setup, {AINSWORTH_ROW_CONSTRAINT}, false, measure, b, y);

  PetscCall(Check("the primal quotient", exact.worst[0].omega, error.primal.omega * (1 + 1e-6)));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Terms of earlier solves count a hundredth: the residual 1 of g = 1 beside 1e10 of an earlier one */
static PetscErrorCode Earlier()
{
  static const AinsworthMeasure measure[AINSWORTH_ROWS_KINDS] = {
    {1e-8, 0.0},
    {1e-8, 0.0},
    {1e-8, 0.0},
    {1e-8, 0.0}
  };
  Setup             setup;
  AinsworthBackward error;
  Column            b = Column::Zero(4);
  Vec               earlier;

  PetscFunctionBeginUser;
  Case("terms of earlier solves");
  b[3] = 1.0;
  PetscCall(SetupCreate(Handmade(Column::Ones(3), Dense::Ones(1, 3)), &setup));
  PetscCall(SetBoth(b, setup.b));
  PetscCall(VecDuplicate(setup.b.dual, &earlier));
  for (PetscReal terms : {0.0, 1e12}) {
    PetscCall(VecSet(earlier, terms));
    PetscCall(
      AinsworthSaddleResidual(setup.sp.get(), PETSC_FALSE, PETSC_FALSE, setup.b, setup.y, setup.Ax, setup.left));
    PetscCall(AinsworthBackwardError(setup.sp.get(), PETSC_FALSE, measure, earlier, setup.b, setup.y, setup.Ax,
                                     setup.left, &error));
    const PetscReal expected = 1.0 / (1e-8 * (1.0 + 1e-2 * terms));

    PetscCall(Check("difference of the quotient", PetscAbsReal(error.dual.omega - expected), 1e-12 * expected));
  }
  PetscCall(VecDestroy(&earlier));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestError()
{
  PetscFunctionBeginUser;
  for (const Given &given : systems)
    for (PetscInt seed : {1, 1001}) PetscCall(Random(given, seed));
  for (bool compliant : {false, true}) PetscCall(Integers(compliant));
  for (PetscInt seed : {1, 1001, 2001}) PetscCall(AtRest(seed));
  PetscCall(HeldByC());
  PetscCall(Forces());
  PetscCall(NoDiagonal());
  PetscCall(Earlier());
  PetscFunctionReturn(PETSC_SUCCESS);
}
