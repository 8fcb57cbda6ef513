/*
   What refinement says of rows that were left out because they depend on others, with combinations by dense least
   squares
*/
#include "steps.h"
#include "base/loops.h"
#include <algorithm>

using Parts = std::vector<std::pair<PetscInt, PetscReal>>;

/* Rows of [C D] that depend on others, what is added to b in some rows, and what that is to be called */
struct Judgement {
  const char                   *name;
  std::function<void(Blocks &)> change;
  std::vector<PetscInt>         dropped;
  Parts                         off;
  AinsworthOutcomeState         state;
  std::vector<PetscInt>         marked; /* as contradictory */

  int       compliance = NO_D;
  bool      nearly     = false;
  PetscReal tol        = 1e-13;
  PetscReal accuracy   = 1e-10; /* of x; of lambda too, unless kept rows are close to each other */
};

static void Combine(Blocks &b, PetscInt row, const Parts &parts)
{
  Dense L = Dense::Identity(b.m(), b.m());

  L.row(row).setZero();
  for (auto part : parts) L(row, part.first) = part.second;
  b.C = L * b.C;
  b.D = L * b.D * L.transpose();
  b.B = b.C;
}

static void Sum(Blocks &b)
{
  Combine(b, 9,
          {
            {2, 1.0},
            {6, 1.0}
  });
}

static void SumOfC(Blocks &b)
{
  const Dense D = b.D;

  Sum(b);
  b.D = D;
}

static void Zero(Blocks &b)
{
  Combine(b, 9, {});
}

/* Row 9 is a million times the difference of two others */
static void Close(Blocks &b)
{
  b.C.row(6) = b.C.row(2) + 1e-6 * b.C.row(9);
  b.B        = b.C;
}

static void Two(Blocks &b)
{
  Sum(b);
  Combine(b, 11,
          {
            {3, 2.0},
            {5, 1.0}
  });
}

/* Rows that are sums but for a part of 1e-9 in one entry */
static std::function<void(Blocks &)> Apart(std::vector<PetscInt> rows)
{
  return [=](Blocks &b) {
    Two(b);
    for (PetscInt row : rows) b.C(row, row == 9 ? 5 : 7) *= 1.0 + 1e-9;
    b.B = b.C;
  };
}

/* Row 9 is a sum but for a part of 1e-9, row 11 a million times the difference of two others */
static void ApartAndClose(Blocks &b)
{
  Sum(b);
  b.C(9, 5) *= 1.0 + 1e-9;
  b.C.row(5) = b.C.row(3) + 1e-6 * b.C.row(11);
  b.B        = b.C;
}

/* clang-format off */
static std::vector<Judgement> Lines()
{
  const AinsworthOutcomeState solved = AINSWORTH_OUTCOME_SOLVED, unmet = AINSWORTH_OUTCOME_UNMET,
                              contradiction = AINSWORTH_OUTCOME_CONTRADICTION;

  return {
    {"a sum",
     Sum,            {9},     {},                       solved,        {}},
    {"a sum, 1 off",
     Sum,            {9},     {{9, 1.0}},               contradiction, {9}},
    {"a sum, 1e-6 off",
     Sum,            {9},     {{9, 1e-6}},              contradiction, {9}},
    {"a sum, off by what rows are allowed",
     Sum,            {9},     {{9, 1e-10}},             solved,        {},     NO_D, false, 1e-10},
    {"nearly a sum",
     Sum,            {9},     {},                       solved,        {},     NO_D, true},
    {"nearly a sum, which rows are allowed less",
     Sum,            {9},     {{9, 1e-10}},             contradiction, {9},    NO_D, true},
    {"nearly a sum, off by what is asked for",
     Sum,            {9},     {{9, 1e-10}},             solved,        {},     NO_D, true, 1e-10},
    {"zero",
     Zero,           {},      {},                       solved,        {}},
    {"zero, 1e-6 off",
     Zero,           {},      {{9, 1e-6}},              contradiction, {9}},
    {"zero, off by the rounding of the largest terms",
     Zero,           {},      {{9, 1e-17}},             solved,        {}},
    {"a millionfold difference",
     Close,          {9},     {},                       solved,        {},     NO_D, false, 1e-13, 1e-8},
    {"a millionfold difference, as its rows may be",
     Close,          {9},     {{9, 1e-3}},              solved,        {},     NO_D, false, 1e-9, 1e-8},
    {"a millionfold difference, off by more",
     Close,          {9},     {{9, 1e2}},               contradiction, {9},    NO_D, false, 1e-13, 1e-8},
    {"two rows",
     Two,            {9, 11}, {},                       solved,        {}},
    {"two rows, the first is off",
     Two,            {9, 11}, {{9, 1.0}},               contradiction, {9}},
    {"two rows, the second is off",
     Two,            {9, 11}, {{11, 1.0}},              contradiction, {11}},
    {"two rows, both are off",
     Two,            {9, 11}, {{9, 1.0}, {11, 1.0}},    contradiction, {9, 11}},
    {"a sum but for 1e-9",
     Apart({9}),     {9, 11}, {},                       solved,        {},     NO_D, true},
    {"a sum but for 1e-9, off",
     Apart({9}),     {9, 11}, {{9, 1e-6}},              unmet,         {},     NO_D, true},
    {"two sums but for 1e-9, off",
     Apart({9, 11}), {9, 11}, {{9, 1e-6}, {11, 1e-6}},  unmet,         {},     NO_D, true},
    {"a sum but for 1e-9, and one that is off",
     Apart({9}),     {9, 11}, {{9, 1e-6}, {11, 1e-6}},  contradiction, {11},   NO_D, true},
    {"one that is off, and a sum but for 1e-9",
     Apart({11}),    {9, 11}, {{9, 1e-6}, {11, 1e-6}},  contradiction, {9},    NO_D, true},
    {"a sum but for 1e-9, which is met, and another",
     ApartAndClose,  {9, 11}, {{11, 1e-3}},             solved,        {},     NO_D, false, 1e-9, 1e-8},
    {"a sum with D",
     Sum,            {9},     {},                       solved,        {},     COUPLED},
    {"a sum with D, 1e-6 off",
     Sum,            {9},     {{9, 1e-6}},              contradiction, {9},    COUPLED},
    {"a sum with D, off by what is asked for",
     Sum,            {9},     {{9, 1e-10}},             solved,        {},     COUPLED, false, 1e-10},
    {"a sum, but not of D",
     SumOfC,         {9},     {{9, 1e-6}},              unmet,         {},     COUPLED}
  };
}
/* clang-format on */

/* The rows that are kept, as the set-up has it */
static PetscErrorCode KeptRows(const Setup &setup, std::vector<PetscInt> *kept)
{
  Vec    kinds;
  Column all;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(setup.b.dual, &kinds));
  PetscCall(
    AinsworthUpdate(kinds, [&](PetscInt i, PetscScalar &v) { v = setup.sp->kind[i] == AINSWORTH_ROW_CONSTRAINT; }));
  PetscCall(Gather(kinds, all));
  PetscCall(VecDestroy(&kinds));
  for (PetscInt i = 0; i < (PetscInt)all.size(); i++)
    if (all[i] != 0.0) kept->push_back(i);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Subtracts the combination of kept rows of [C D] that is next in the units of the scale; the second pass is for its
   rounding
*/
static AinsworthCombination LeastSquares(const Setup &setup, const std::vector<PetscInt> &kept)
{
  const PetscInt n = setup.dense.n(), m = setup.dense.m();
  const Column   s = setup.s.tail(m);
  Dense          rows(m, n + m);

  rows << setup.dense.C, setup.dense.D;
  rows                                         = s.asDiagonal() * rows * setup.s.asDiagonal();
  const Dense                             mine = rows(kept, Eigen::seqN(0, rows.cols())).adjoint();
  const Eigen::ColPivHouseholderQR<Dense> qr(mine);

  return [=](Vec v) {
    Column w;

    PetscFunctionBeginUser;
    PetscCall(Gather(v, w));
    w = w.cwiseQuotient(s);
    for (int pass = 0; pass < 2; pass++) w(kept) -= qr.solve(Column(rows.adjoint() * w));
    PetscCall(Scatter(Column(w.cwiseProduct(s)), v));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/* The system of the kept rows alone */
static Blocks Only(const Blocks &d, const std::vector<PetscInt> &kept)
{
  Blocks b;

  b.A = d.A;
  b.C = d.C(kept, Eigen::seqN(0, d.C.cols()));
  b.B = b.C;
  b.D = d.D(kept, kept);
  return b;
}

static PetscErrorCode Judged(const Judgement &line)
{
  Kind                  kind{line.name};
  Blocks                d = Draw(kind, 3);
  const PetscInt        n = d.n(), m = d.m(), N = n + m;
  std::vector<PetscInt> kept, all(n);
  Setup                 setup, regular;
  AinsworthRequest      request;
  Run                   run;
  Column                x(N), b;

  PetscFunctionBeginUser;
  Case("%s", line.name);
  if (line.compliance != NO_D)
    for (PetscInt i = 0; i < m; i++) d.D(i, i) = 1.0 + Uniform(8, i, i);
  line.change(d);
  PetscCall(SetupCreate(d, &setup));
  if (line.dropped.size())
    PetscCall(AinsworthSaddleDropDependent(&setup.sp, (PetscInt)line.dropped.size(), line.dropped.data(),
                                           line.nearly ? AINSWORTH_ROW_NEAR : AINSWORTH_ROW_DEPENDENT));
  PetscCall(KeptRows(setup, &kept));
  PetscCall(SetupCreate(Only(d, kept), &regular));
  for (PetscInt i = 0; i < n; i++) all[i] = i;
  for (PetscInt i : kept) all.push_back(n + i);
  const Answer inverse = Inverse(regular, 0.0), solve = [=](const Column &r, int call) {
    Column z = Column::Zero(N);

    z(all) = inverse(Column(r(all)), call);
    return z;
  };
  for (PetscInt i = 0; i < N; i++) x[i] = i < n || std::count(kept.begin(), kept.end(), i - n) ? Entry(40, i, 0) : 0.0;
  b = Times(d.K(), x);
  for (auto off : line.off) b[n + off.first] += off.second;
  request.tol = line.tol;
  for (bool judged : {true, false}) {
    const bool marks = judged && line.state != AINSWORTH_OUTCOME_SOLVED;
    bool       right = true;

    Case("%s, %s", line.name, judged ? "judged" : "not judged");
    request.combination = judged ? LeastSquares(setup, kept) : AinsworthCombination();
    PetscCall(Refine(&setup, request, b, Column(1.001 * solve(b, 0)), solve, &run));
    PetscCall(CheckInt("the outcome", run.outcome.state, judged ? line.state : AINSWORTH_OUTCOME_SOLVED));
    PetscCall(CheckEqual("x", run.y.head(n), x.head(n), line.accuracy));
    if (line.accuracy <= 1e-10) PetscCall(CheckEqual("lambda", run.y, x, line.accuracy));
    for (PetscInt i = 0; i < setup.sp->local(); i++) {
      const bool marked = i < (PetscInt)run.outcome.contradictory.size() && run.outcome.contradictory[i];

      right = right &&
              marked == (judged && std::count(line.marked.begin(), line.marked.end(), setup.sp->first + i) > 0);
    }
    PetscCall(CheckTrue("the rows that contradict others are marked, and no others", right));
    PetscCall(
      CheckTrue("a mark for each row", !marks || (PetscInt)run.outcome.contradictory.size() == setup.sp->local()));
  }
  /* a solution that leaves too much in kept rows shows nothing about others */
  Case("%s, others are unmet", line.name);
  request.combination = [](Vec) {
    PetscFunctionBeginUser;
    PetscCall(CheckTrue("no combination is asked for", false));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  PetscCall(Refine(
    &setup, request, b, Column(1.001 * solve(b, 0)), [=](const Column &, int) { return Column(Column::Unit(N, 0)); },
    &run));
  PetscCall(CheckInt("the outcome", run.outcome.state, AINSWORTH_OUTCOME_UNMET));
  PetscCall(CheckTrue("no marks", run.outcome.contradictory.empty()));
  PetscCall(SetupDestroy(&setup));
  PetscCall(SetupDestroy(&regular));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestDepend()
{
  PetscFunctionBeginUser;
  for (const Judgement &line : Lines()) PetscCall(Judged(line));
  PetscFunctionReturn(PETSC_SUCCESS);
}
