/* Iterative refinement with handmade solvers: dense inverses with errors, single directions, garbage */
#include "steps.h"
#include <cmath>

/* Refines y and checks what is true of any outcome: A y is known, and the residual is that of y */
PetscErrorCode Refine(Setup *setup, const AinsworthRequest &request, const Column &b, const Column &y,
                      const Answer &answer, Run *run)
{
  PetscBool              known  = PETSC_FALSE;
  const AinsworthSolveFn solver = [&](AinsworthSaddleVec r, PetscReal loose, AinsworthSaddleVec p) {
    Column all;

    PetscFunctionBeginUser;
    PetscCall(CheckTrue("a tolerance", loose > 0.0 && loose <= (request.energetic ? 0.9 : 0.5)));
    PetscCall(GatherBoth(r, all));
    PetscCall(SetBoth(answer(all, run->calls++), p));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  Blocks d = setup->dense;
  Column Ax;

  PetscFunctionBeginUser;
  *run = Run();
  if (request.transpose) d.A = Dense(d.A.transpose());
  PetscCall(SetBoth(b, setup->b));
  PetscCall(SetBoth(y, setup->y));
  PetscCall(AinsworthRefine(setup->sp.get(), &request, solver, setup->b, setup->y, setup->Ax, setup->left, &known,
                            &run->outcome));
  PetscCall(GatherBoth(setup->y, run->y));
  PetscCall(GatherBoth(setup->left, run->left));
  PetscCall(Gather(setup->Ax, Ax));
  PetscCall(CheckTrue("A x is known", known));
  PetscCall(CheckInt("calls of the solver", run->calls, run->outcome.steps + (run->outcome.rounding > 0.0)));
  PetscCall(CheckEqual("A x", Ax, Times(d.A, run->y.head(d.n())), 1e-13));
  const Column s = setup->s, exact = Column(b - Times(d.K(), run->y)).cwiseProduct(s),
               size = Times(d.K().cwiseAbs(), run->y.cwiseAbs()).cwiseProduct(s);
  const Column left = run->left.cwiseProduct(s);

  PetscCall(
    Check("difference of the residual", (left - exact).norm(), 1e-13 * (size.norm() + b.cwiseProduct(s).norm())));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solution of the scaled system, K' z = s r, in the program's units */
Answer Inverse(const Setup &setup, PetscReal error, bool transpose)
{
  Blocks d = setup.dense;

  if (transpose) d.A = Dense(d.A.transpose());
  const Column                  s = setup.s;
  const Dense                   K = s.asDiagonal() * d.K() * s.asDiagonal();
  const Eigen::FullPivLU<Dense> lu(K);

  return [=](const Column &r, int call) {
    const Column scaled = s.cwiseProduct(r);
    Column       z      = lu.solve(scaled);

    z += lu.solve(scaled - Times(K, z));
    for (Eigen::Index i = 0; i < z.size(); i++) z[i] *= s[i] * (1.0 + error * Uniform(71 + call, (PetscInt)i, 0));
    return z;
  };
}

static Answer Garbage(Eigen::Index n)
{
  return [=](const Column &, int call) {
    Column z(n);

    for (Eigen::Index i = 0; i < n; i++) z[i] = Uniform(91 + call, (PetscInt)i, 0);
    return z;
  };
}

static Answer NotANumber(Eigen::Index n)
{
  return [=](const Column &, int) { return Column(Column::Constant(n, std::nan(""))); };
}

struct Line {
  const char           *name;
  PetscReal             tol, error; /* of the solver */
  bool                  energetic;
  AinsworthOutcomeState state;
  int                   least, most; /* steps */
};

/* clang-format off */
static const Line lines[] = {
  {"exact enough, by the energy",     1e-8,  1e-9,  true,  AINSWORTH_OUTCOME_SOLVED, 0, 0},
  {"exact, by the energy",            1e-8,  0.0,   true,  AINSWORTH_OUTCOME_SOLVED, 0, 0},
  {"exact, not by the energy",        1e-8,  0.0,   false, AINSWORTH_OUTCOME_SOLVED, 1, 1},
  {"two digits at once",              1e-8,  1e-3,  false, AINSWORTH_OUTCOME_SOLVED, 2, 3},
  {"two digits at once, energy",      1e-8,  1e-3,  true,  AINSWORTH_OUTCOME_SOLVED, 2, 3},
  {"all digits",                      1e-14, 1e-3,  false, AINSWORTH_OUTCOME_SOLVED, 3, 6},
  {"nine digits, of five",            1e-5,  1e-9,  false, AINSWORTH_OUTCOME_SOLVED, 1, 1},
  {"no tolerance",                    -1.0,  1e-12, false, AINSWORTH_OUTCOME_SOLVED, 0, 0}
};
/* clang-format on */

static PetscErrorCode Refined(const Kind &kind, PetscInt seed, bool transpose)
{
  const Blocks     d = Draw(kind, seed);
  const PetscInt   N = d.n() + d.m();
  Setup            setup;
  AinsworthRequest request;
  Column           x(N), b;
  Run              run;

  PetscFunctionBeginUser;
  Case("%s, seed %d%s", kind.name, (int)seed, transpose ? ", transposed" : "");
  PetscCall(SetupCreate(d, &setup));
  Blocks op = d;

  if (transpose) op.A = Dense(d.A.transpose());
  for (PetscInt i = 0; i < N; i++) x[i] = setup.s[i] * Entry(seed + 30, i, 0);
  b                 = Times(op.K(), x);
  request.transpose = (PetscBool)transpose;
  for (const Line &line : lines) {
    const Answer solver = Inverse(setup, line.error, transpose);
    /* with D the energy is not that of all of the system */
    const int shown = line.energetic && kind.compliance != NO_D;

    Case("refine, %s, seed %d%s, %s", kind.name, (int)seed, transpose ? ", transposed" : "", line.name);
    request.tol       = line.tol;
    request.energetic = (PetscBool)line.energetic;
    PetscCall(Refine(&setup, request, b, solver(b, 100), solver, &run));
    PetscCall(CheckInt("the outcome", run.outcome.state, line.state));
    PetscCall(Check("the steps", run.outcome.steps, PetscMax(line.most, shown)));
    PetscCall(Check("the least steps", PetscMax(line.least, shown), run.outcome.steps));
    PetscCall(CheckEqual("the solution", run.y.cwiseQuotient(setup.s), x.cwiseQuotient(setup.s),
                         line.tol < 0.0 ? 1e-9 : PetscMax(1e4 * line.tol, 1e-9)));
  }
  request.tol       = 1e-8;
  request.energetic = PETSC_FALSE;
  for (bool number : {true, false}) {
    const Column start = Inverse(setup, 1e-3, transpose)(b, 100);

    Case("refine, %s, seed %d, a solver that answers %s", kind.name, (int)seed, number ? "garbage" : "NaN");
    PetscCall(Refine(&setup, request, b, start, number ? Garbage(N) : NotANumber(N), &run));
    PetscCall(CheckInt("the outcome", run.outcome.state, AINSWORTH_OUTCOME_UNMET));
    PetscCall(CheckInt("the steps", run.outcome.steps, 1));
    PetscCall(
      CheckEqual("y is no worse", run.y.cwiseQuotient(setup.s), start.cwiseQuotient(setup.s), number ? 1e-1 : 0.0));
  }
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Column Unit(Eigen::Index n, Eigen::Index i)
{
  return Column::Unit(n, i);
}

/* A step that leaves less in a large row, but too much in a small one, is taken back */
static PetscErrorCode TakenBack(bool met)
{
  Setup            setup;
  AinsworthRequest request;
  Run              run;
  const PetscReal  left = met ? 5e-8 : 1e-6, enough = 1e-7;
  Column           b = Unit(4, 0) + 1e-6 * Unit(4, 1), y = b;

  PetscFunctionBeginUser;
  Case("a step is taken back, %s before", met ? "met" : "unmet");
  PetscCall(SetupCreate(Handmade(Column::Ones(3), Unit(3, 2).transpose()), &setup));
  y[0] -= left; /* allowed: 2e-7 in row 0, 2e-13 and rounding in row 1 */
  request.tol = 0.1 * enough;
  PetscCall(Refine(
    &setup, request, b, y, [&](const Column &, int) { return Column(Unit(4, 0) + 0.1 * Unit(4, 1)); }, &run));
  PetscCall(CheckTrue("y is the same", run.y == y));
  PetscCall(CheckInt("the steps", run.outcome.steps, 1));
  PetscCall(Check("difference of the move", PetscAbsReal(run.outcome.moved - left / 1.01), 1e-6 * left));
  PetscCall(CheckInt("the outcome", run.outcome.state, met ? AINSWORTH_OUTCOME_SOLVED : AINSWORTH_OUTCOME_UNMET));
  PetscCall(CheckInt("the worst row", run.outcome.error.primal.row, 0));
  PetscCall(Check("difference of the quotient",
                  PetscAbsReal(run.outcome.error.primal.omega - left / (2.0 - left) / enough), 1e-5 * left / enough));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One row a step, each with 0.4 of what the one before had: progress, but not within ten steps */
static PetscErrorCode Slow(int rows)
{
  const int        n = 14;
  Setup            setup;
  AinsworthRequest request;
  Run              run;
  Column           b = Column::Ones(n + 1), y = b;

  PetscFunctionBeginUser;
  Case("%d slow steps", rows);
  b[n] = b[n - 1] = y[n - 1] = 1.0; /* C x = g is met */
  y[n]                       = 0.0;
  PetscCall(SetupCreate(Handmade(Column::Ones(n), Unit(n, n - 1).transpose()), &setup));
  for (int i = 0; i < rows; i++) y[i] -= 0.1 * std::pow(0.4, i);
  request.tol       = 1e-9;
  request.energetic = PETSC_TRUE;
  PetscCall(Refine(
    &setup, request, b, y, [&](const Column &, int call) { return Unit(n + 1, call); }, &run));
  PetscCall(CheckInt("the steps", run.outcome.steps, PetscMin(rows, 10)));
  PetscCall(CheckInt("the outcome", run.outcome.state, rows > 10 ? AINSWORTH_OUTCOME_UNMET : AINSWORTH_OUTCOME_SOLVED));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two directions that are not orthogonal reach all of what both span */
static PetscErrorCode Oblique()
{
  Setup            setup;
  AinsworthRequest request;
  Run              run;
  Column           b = Column::Ones(4), x = b, y;

  PetscFunctionBeginUser;
  Case("oblique directions");
  PetscCall(SetupCreate(Handmade(Column::Ones(3), Unit(3, 2).transpose()), &setup));
  x[3]              = 0.0;
  y                 = x - 1e-3 * Unit(4, 0) - 3e-3 * Unit(4, 1);
  request.tol       = 1e-13;
  request.energetic = PETSC_TRUE;
  PetscCall(Refine(
    &setup, request, b, y,
    [](const Column &, int call) { return Column(Unit(4, 0) + (call ? 0.0 : 1.0) * Unit(4, 1)); }, &run));
  PetscCall(CheckInt("the outcome", run.outcome.state, AINSWORTH_OUTCOME_SOLVED));
  PetscCall(CheckInt("the steps", run.outcome.steps, 2));
  PetscCall(CheckEqual("the solution", run.y, x, 1e-15));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Half of a small row is left: nothing to the energy of all of x, but too much for the row */
static PetscErrorCode SmallRow(bool strained, bool energetic)
{
  const bool       excused = strained && energetic;
  Setup            setup;
  AinsworthRequest request;
  Run              run;
  Blocks           d = Handmade(Column::Ones(4), Unit(4, 3).transpose());
  Column           x = Unit(5, 0) + Unit(5, 2) + 1e-8 * Unit(5, 1), y = x;

  PetscFunctionBeginUser;
  Case("a small row beside %s, %s", strained ? "strain" : "unknowns that their own entry holds",
       energetic ? "the energy decides" : "each row decides");
  if (strained) d.A(0, 2) = d.A(2, 0) = -0.5;
  PetscCall(SetupCreate(d, &setup));
  y[1] *= 0.5;
  request.tol       = 1e-8;
  request.energetic = (PetscBool)energetic;
  PetscCall(Refine(&setup, request, Times(d.K(), x), y, Inverse(setup, 0.0), &run));
  PetscCall(CheckInt("the outcome", run.outcome.state, AINSWORTH_OUTCOME_SOLVED));
  PetscCall(CheckInt("the steps", run.outcome.steps, excused ? 0 : 1));
  PetscCall(CheckTrue("y", excused ? run.y == y : PetscAbsScalar(run.y[1] - x[1]) <= 1e-16));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A force on an unknown without stiffness is no rounding, however small: what a multiplier leaves there is. It is
   nothing to the energy, which may decide
*/
static PetscErrorCode SmallForce(bool force, bool energetic)
{
  Setup            setup;
  AinsworthRequest request;
  Run              run;
  Dense            C(2, 4);
  Column           diagonal = Column::Unit(4, 0) + Column::Unit(4, 3), b = Unit(6, 0) + Unit(6, 4), y = Unit(6, 0);

  PetscFunctionBeginUser;
  Case("1e-20 %s on an unknown without stiffness%s", force ? "of a force" : "of a multiplier",
       energetic ? ", the energy decides" : "");
  C << 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0;
  PetscCall(SetupCreate(Handmade(diagonal, C), &setup));
  if (force) b[1] = 1e-20;
  else y[4] = 1e-20;
  request.tol       = 1e-8;
  request.energetic = (PetscBool)energetic;
  PetscCall(Refine(&setup, request, b, y, Inverse(setup, 0.0), &run));
  PetscCall(CheckInt("the outcome", run.outcome.state, AINSWORTH_OUTCOME_SOLVED));
  PetscCall(CheckInt("the steps", run.outcome.steps, !energetic));
  if (energetic) PetscCall(CheckTrue("y is the same", run.y == y));
  else PetscCall(Check("difference of the multiplier", PetscAbsScalar(run.y[4] - (force ? 1e-20 : 0.0)), 1e-27));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pairs of unknowns whose difference has next to no stiffness: each solve moves another pair as far as the last */
static PetscErrorCode Unsettled(bool energetic)
{
  const int        pairs = 6, n = 2 * pairs;
  Setup            setup;
  AinsworthRequest request;
  Run              run;
  Blocks           d = Handmade(Column::Ones(n + 1), Unit(n + 1, n).transpose());
  Column           x = Column::Ones(n + 2), y, b;

  PetscFunctionBeginUser;
  Case("unsettled, %s", energetic ? "but the energy decides" : "and nothing else decides");
  for (int i = 0; i < n; i += 2) d.A(i, i + 1) = d.A(i + 1, i) = 1.0 - 0x1p-47;
  PetscCall(SetupCreate(d, &setup));
  b = Times(d.K(), x);
  y = x;
  for (int i = 0; i < n; i++) y[i] += i % 2 ? -0.125 : 0.125;
  request.tol       = 1e-8;
  request.energetic = (PetscBool)energetic;
  PetscCall(Refine(
    &setup, request, b, y,
    [&](const Column &, int call) { return Column(Unit(n + 2, 2 * call) - Unit(n + 2, 2 * call + 1)); }, &run));
  PetscCall(
    CheckInt("the outcome", run.outcome.state, energetic ? AINSWORTH_OUTCOME_SOLVED : AINSWORTH_OUTCOME_UNSETTLED));
  PetscCall(CheckInt("the steps", run.outcome.steps, energetic ? 0 : 2));
  PetscCall(Check("difference of the move", PetscAbsReal(run.outcome.moved - (energetic ? 0.0 : 0.125 / 1.125)), 2e-2));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A pair of unknowns of which nothing resists the sum, or next to nothing: the solver moves x along it */
static PetscErrorCode Null(PetscReal stiffness, bool two)
{
  Setup            setup;
  AinsworthRequest request;
  Run              run;
  Blocks           d = Handmade(Column::Ones(4), Unit(4, 3).transpose());
  Column           b, y = Column::Zero(5);

  PetscFunctionBeginUser;
  Case("a step along a stiffness of %g%s", (double)stiffness, two ? ", beside rounding" : "");
  d.A(0, 1) = d.A(1, 0) = -1.0 + stiffness;
  PetscCall(SetupCreate(d, &setup));
  y[0] = 1.0;
  y[2] = 1e-3;
  b    = Times(d.K(), y);
  for (int k : {0, 1}) y[k] += 0.125;
  b[2] *= 1.0 + 1e-9; /* so that there is a residual */
  request.tol = 1e-8;
  PetscCall(Refine(
    &setup, request, b, y,
    [&](const Column &r, int) {
      /* a solver of a regular system leaves no row */
      const PetscScalar along = stiffness > 0.0 ? (r[0] + r[1]) / (2.0 * stiffness) : 1.0,
                        row   = stiffness > 0.0 ? r[2] : two ? 1e-12 : 0.0;

      return Column(along * (Unit(5, 0) + Unit(5, 1)) + row * Unit(5, 2));
    },
    &run));
  PetscCall(CheckInt("the outcome", run.outcome.state, AINSWORTH_OUTCOME_SOLVED));
  if (stiffness == 0.0) PetscCall(CheckTrue("x is the same", run.y == y && run.outcome.steps == 1));
  else PetscCall(Check("error of x", PetscAbsScalar(run.y[1]), 1e-2));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The same pair, with a force that moves it far: rounding of A, eps diag(A), moves it by eps / stiffness of that, if
   the solver finds it, but for `left` of it
*/
static PetscErrorCode Rounding(PetscReal stiffness, PetscReal left, bool tolerance)
{
  Setup            setup;
  AinsworthRequest request;
  Run              run;
  Blocks           d = Handmade(Column::Ones(4), Unit(4, 3).transpose());
  Column           b = Column::Zero(5), y = Column::Zero(5);
  const PetscReal  moved = (1 - left) * PETSC_MACHINE_EPSILON / stiffness;

  PetscFunctionBeginUser;
  Case("rounding, stiffness %g, the solver leaves %g%s", (double)stiffness, (double)left,
       tolerance ? "" : ", no tolerance");
  d.A(0, 1) = d.A(1, 0) = -1.0 + stiffness;
  PetscCall(SetupCreate(d, &setup));
  b[0] = b[1] = stiffness;
  y[0] = y[1]          = 1.0;
  request.energetic    = (PetscBool)(left == 0.0);
  request.tol          = tolerance ? 1e-8 : -1.0;
  const Answer inverse = Inverse(setup, 0.0);
  PetscCall(Refine(
    &setup, request, b, y, [&](const Column &r, int call) { return Column((1 - left) * inverse(r, call)); }, &run));
  PetscCall(CheckInt("the outcome", run.outcome.state, AINSWORTH_OUTCOME_SOLVED));
  if (stiffness > 1e-7) PetscCall(CheckTrue("no further solve", run.calls == 0 && run.outcome.rounding == 0.0));
  else if (left > 0.5 && tolerance)
    PetscCall(CheckTrue("rounding moves x without bound", run.outcome.rounding >= PETSC_INFINITY));
  else PetscCall(Check("difference of what rounding moves", PetscAbsReal(run.outcome.rounding / moved - 1.0), 1e-2));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A pair that hardly anything holds, beside an unknown with a large force, which hides its growth: its energy shows it.
   What g moves has none, either
*/
static PetscErrorCode Hidden()
{
  const PetscReal  stiffness = 0x1p-50;
  Setup            setup, moved;
  AinsworthRequest request;
  Run              run;
  Blocks           d = Handmade(Column::Ones(4), Unit(4, 3).transpose()),
         free        = Handmade(Column::Ones(2), Unit(2, 0).transpose());
  Column y = Column::Zero(5), given = Column::Ones(3);

  PetscFunctionBeginUser;
  Case("a pair beside a large force");
  d.A(0, 1) = d.A(1, 0) = -1.0 + stiffness;
  PetscCall(SetupCreate(d, &setup));
  y[0] = y[1]       = 0x1p33;
  y[2]              = 1e3;
  request.energetic = PETSC_TRUE;
  request.tol       = 1e-8;
  PetscCall(Refine(&setup, request, Times(d.K(), y), y, Inverse(setup, 0.0), &run));
  PetscCall(CheckInt("the outcome", run.outcome.state, AINSWORTH_OUTCOME_SOLVED));
  PetscCall(CheckTrue("the growth is moderate", run.outcome.growth < 1e8));
  PetscCall(Check("difference of what rounding moves", PetscAbsReal(run.outcome.rounding / 0.25 - 1.0), 1e-2));
  PetscCall(SetupDestroy(&setup));
  Case("a pair that g moves");
  free.A(0, 1) = free.A(1, 0) = -1.0;
  PetscCall(SetupCreate(free, &moved));
  given[2] = 0.0;
  PetscCall(Refine(&moved, request, Times(free.K(), given), given, Inverse(moved, 0.0), &run));
  PetscCall(CheckInt("the outcome", run.outcome.state, AINSWORTH_OUTCOME_SOLVED));
  PetscCall(CheckTrue("no further solve", run.calls == 0 && run.outcome.rounding == 0.0));
  PetscCall(SetupDestroy(&moved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without a tolerance any x that meets C x = g is a solution */
static PetscErrorCode NoTolerance()
{
  Setup            setup;
  AinsworthRequest request;
  Run              run;
  Column           b = Column::Ones(4), x = Column::Ones(4), y = x;

  PetscFunctionBeginUser;
  PetscCall(SetupCreate(Handmade(Column::Ones(3), Unit(3, 2).transpose()), &setup));
  x[3] = y[3] = 0.0;
  for (bool met : {true, false}) {
    Case("no tolerance, C x = g is %s", met ? "met" : "not met");
    y[met ? 0 : 2] = 0.5;
    PetscCall(Refine(&setup, request, b, y, Inverse(setup, 0.0), &run));
    PetscCall(CheckInt("the outcome", run.outcome.state, AINSWORTH_OUTCOME_SOLVED));
    PetscCall(CheckInt("the steps", run.outcome.steps, met ? 0 : 1));
    if (met) PetscCall(CheckTrue("y is the same", run.y == y));
    else PetscCall(CheckEqual("y is right", run.y, x, 1e-14));
  }
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestRefine()
{
  Kind plain{"plain"}, compliant{"D"}, scaled{"badly scaled"}, unsymmetric{"unsymmetric"};

  PetscFunctionBeginUser;
  compliant.compliance  = COUPLED;
  scaled.decades        = 4.0;
  unsymmetric.symmetric = false;
  for (const Kind &kind : {plain, compliant, scaled, unsymmetric})
    for (PetscInt seed : {1, 1001}) PetscCall(Refined(kind, seed, false));
  PetscCall(Refined(unsymmetric, 1, true));
  for (bool met : {false, true}) PetscCall(TakenBack(met));
  for (int rows : {3, 10, 11, 13}) PetscCall(Slow(rows));
  PetscCall(Oblique());
  PetscCall(Null(0x1p-47, false)); /* this is a stiffness */
  for (bool one : {false, true}) {
    for (bool strained : {true, false}) PetscCall(SmallRow(strained, one));
    PetscCall(Unsettled(one));
    PetscCall(Null(0.0, one));
    for (bool energetic : {false, true}) PetscCall(SmallForce(one, energetic));
  }
  for (PetscReal stiffness : {0x1p-20, 0x1p-30, 0x1p-40})
    for (PetscReal left : {0.0, 0.1, 0.9})
      for (bool tolerance : {true, false}) PetscCall(Rounding(stiffness, left, tolerance));
  PetscCall(Hidden());
  PetscCall(NoTolerance());
  PetscFunctionReturn(PETSC_SUCCESS);
}
