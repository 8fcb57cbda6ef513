/* What combinations of rows mean, against systems whose dependence is known: there is no solver, and y is arbitrary */
#include "system.h"

static const PetscInt row = 9;

/*
   A combination of rows [C -D], which is zero or not; fixed: entries of y that the system tells by itself, so that they
   may be in the combination
*/
struct Certificate {
  const char                                 *name;
  int                                         compliance;
  std::function<void(Blocks &)>               change;
  std::vector<std::pair<PetscInt, PetscReal>> w; /* rows and factors; that of `row` is 1 */
  bool                                        zero;
  std::vector<PetscInt>                       fixed = {};
};

/* Makes `row` of [C D] the combination of others that w says; D stays symmetric and positive semidefinite */
static std::function<void(Blocks &)> Combined(std::vector<std::pair<PetscInt, PetscReal>> parts)
{
  return [=](Blocks &b) {
    Dense L = Dense::Identity(b.m(), b.m());

    L.row(row).setZero();
    for (auto part : parts) L(row, part.first) = part.second;
    b.C = L * b.C;
    b.D = L * b.D * L.transpose();
    b.B = b.C;
  };
}

static std::function<void(Blocks &)> Sum()
{
  return Combined({
    {2, 1.0},
    {6, 1.0}
  });
}

/* Two rows whose difference is 1 / factor of `row` */
static std::function<void(Blocks &)> Close(PetscReal factor)
{
  return [=](Blocks &b) {
    b.C.row(6) = b.C.row(2) + b.C.row(row) / factor;
    b.B        = b.C;
  };
}

/* The sum, but for one of its entries */
static std::function<void(Blocks &)> Apart(PetscReal distance)
{
  return [=](Blocks &b) {
    Sum()(b);
    b.C(row, 5) *= 1.0 + distance;
    b.B = b.C;
  };
}

static std::function<void(Blocks &)> ApartInD(PetscReal distance)
{
  return [=](Blocks &b) {
    Sum()(b);
    b.D(row, row) += distance * PetscAbsScalar(b.D(row, row));
  };
}

static void Springs(Blocks &b)
{
  Sum()(b);
  b.D = Dense::Identity(b.m(), b.m());
}

/* The sum, but for the multiplier 4, whose own row has only D_ii, or has a row of C, too */
static std::function<void(Blocks &)> Beside(bool decoupled)
{
  return [=](Blocks &b) {
    Sum()(b);
    b.B.row(5) *= 2.0; /* D is not symmetric, either */
    if (decoupled) b.C.row(4).setZero();
    b.D.row(4).setZero();
    b.D(4, 4)   = 2.0;
    b.D(row, 4) = b.D(2, 4) + b.D(6, 4) + 1.0;
  };
}

/*
   The sum, but for one of its entries, and compliances to a multiplier that is known, which say nothing about rows,
   however large
*/
static std::function<void(Blocks &)> ApartBeside(PetscReal compliance)
{
  return [=](Blocks &b) {
    Beside(true)(b);
    b.C(row, 5) *= 1.0 + 1e-9;
    b.D(2, 4) = b.D(row, 4) = compliance;
  };
}

/* The sum, but for the unknown 5, whose own row has only A_ii, or has another unknown, too */
static std::function<void(Blocks &)> BesideUnknown(bool known)
{
  return [=](Blocks &b) {
    Sum()(b);
    b.B.col(5).setZero();
    b.A.row(5).setZero();
    b.A(5, 5) = 8.0;
    if (!known) b.A(5, 8) = 1.0;
    b.C(row, 5) += 1.0;
  };
}

/* clang-format off */
static std::vector<Certificate> Certificates()
{
  const std::vector<std::pair<PetscInt, PetscReal>> sum  = {{2, -1.0}, {6, -1.0}},
                                                    many = {{0, 3.0},  {1, -0.25}, {4, 1.5},
                                                            {8, -1.0}, {12, 7.0},  {13, 1.0}};
  std::vector<std::pair<PetscInt, PetscReal>>       minus;

  for (auto part : many) minus.push_back({part.first, -part.second});
  return {
    {"a sum",                              NO_D,    Sum(),                  sum,                    true},
    {"many rows",                          NO_D,    Combined(many),         minus,                  true},
    {"1e2 times another",                  NO_D,    Combined({{2, 1e2}}),   {{2, -1e2}},            true},
    {"1e6 times another",                  NO_D,    Combined({{2, 1e6}}),   {{2, -1e6}},            true},
    {"1e-6 times another",                 NO_D,    Combined({{2, 1e-6}}),  {{2, -1e-6}},           true},
    {"1e2 times the difference of two",    NO_D,    Close(1e2),             {{2, 1e2}, {6, -1e2}},  true},
    {"1e6 times the difference of two",    NO_D,    Close(1e6),             {{2, 1e6}, {6, -1e6}},  true},
    {"a row of zeros",                     NO_D,    Combined({}),           {},                     true},
    {"a row of zeros beside D",            COUPLED, Combined({}),           {},                     true},
    {"a sum, D couples",                   COUPLED, Sum(),                  sum,                    true},
    {"many rows, D couples",               COUPLED, Combined(many),         minus,                  true},
    {"a sum, D tells",                     COUPLED, ApartInD(1.0),          sum,                    false},
    {"a sum, D tells by 1e-9",             COUPLED, ApartInD(1e-9),         sum,                    false},
    {"a sum, D tells by 1e-14",            COUPLED, ApartInD(1e-14),        sum,                    true},
    {"a sum, each row has a spring",       COUPLED, Springs,                sum,                    false},
    {"a multiplier that is known tells",   COUPLED, Beside(true),           sum,                    true,  {40 + 4}},
    {"a multiplier tells",                 COUPLED, Beside(false),          sum,                    false},
    {"1e-9 apart, 1 beside",               COUPLED, ApartBeside(1.0),       sum,                    false, {40 + 4}},
    {"1e-9 apart, 1e6 beside",             COUPLED, ApartBeside(1e6),       sum,                    false, {40 + 4}},
    {"an unknown that is known tells",     NO_D,    BesideUnknown(true),    sum,                    true,  {5}},
    {"an unknown tells",                   NO_D,    BesideUnknown(false),   sum,                    false},
    {"a row of its own",                   NO_D,    [](Blocks &) {},        {},                     false},
    {"a sum of others",                    NO_D,    Sum(),                  {{2, -1.0}, {5, -1.0}}, false},
    {"a sum at a distance of 1e-9",        NO_D,    Apart(1e-9),            sum,                    false},
    {"a sum at a distance of 1e-14",       NO_D,    Apart(1e-14),           sum,                    true}
  };
}
/* clang-format on */

/* Other units of each unknown and each row, up and down; factor: of rows of the multiplier field */
static void Rescale(PetscReal decades, PetscInt seed, Blocks *b, Column *factor)
{
  Column x(b->n());

  for (PetscInt i = 0; i < b->n(); i++) x[i] = PetscPowReal(10.0, decades * Uniform(seed, i, 0));
  factor->resize(b->m());
  for (PetscInt i = 0; i < b->m(); i++) (*factor)[i] = PetscPowReal(10.0, decades * Uniform(seed + 1, i, 0));
  b->A = x.asDiagonal() * b->A * x.asDiagonal();
  for (Dense *M : {&b->B, &b->C}) *M = factor->asDiagonal() * *M * x.asDiagonal();
  b->D = factor->asDiagonal() * b->D * factor->asDiagonal();
}

static PetscErrorCode Certify(const Setup &setup, const Column &w, const Column &left, PetscReal size,
                              const Column &allowed, AinsworthDependence expected)
{
  Vec v[3];

  PetscFunctionBeginUser;
  for (Vec &u : v) PetscCall(VecDuplicate(setup.b.dual, &u));
  PetscCall(Scatter(left, v[1]));
  PetscCall(Scatter(allowed, v[2]));
  for (PetscReal factor : {1.0, -1e-30, 1e30}) { /* a multiple of w says the same */
    AinsworthDependence what;

    PetscCall(Scatter(Column(factor * w), v[0]));
    PetscCall(AinsworthCertify(setup.sp.get(), v[0], v[1], size, v[2], &what));
    PetscCall(CheckInt("what it means", what, expected));
  }
  for (Vec &u : v) PetscCall(VecDestroy(&u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A vector of all rows, zero in those of the primal field */
static Column Append(PetscInt n, const Column &w)
{
  Column all = Column::Zero(n + w.size());

  all.tail(w.size()) = w;
  return all;
}

/* b has a solution, or is off by a part of what the rows in w are allowed together; y is wrong in all rows */
static PetscErrorCode CheckCertificate(const Certificate &c, PetscReal decades, PetscInt seed)
{
  Kind           kind{c.name};
  Setup          setup;
  Column         factor, w;
  const PetscInt start = seed + 40;

  PetscFunctionBeginUser;
  Case("certify, %s, %g decades, seed %d", c.name, (double)decades, (int)seed);
  kind.compliance = c.compliance;
  Blocks d        = Draw(kind, seed);
  if (c.compliance != NO_D) { /* semidefinite */
    const Dense R = d.D;

    d.D = R * R.adjoint();
  }
  w      = Column::Zero(d.m());
  w[row] = 1.0;
  for (auto part : c.w) w[part.first] = part.second;
  c.change(d);
  Rescale(decades, start, &d, &factor);
  w = w.cwiseQuotient(factor);
  PetscCall(SetupCreate(d, &setup));
  const PetscInt n = d.n(), N = n + d.m();
  Column         x(N), y(N), b;

  for (PetscInt i = 0; i < N; i++) {
    x[i] = setup.s[i] * Entry(start, i, 2);
    y[i] = setup.s[i] * Entry(start, i, 3);
  }
  for (PetscInt i : c.fixed) y[i] = x[i];
  b                  = Times(d.K(), x);
  const Column terms = Times(d.K().cwiseAbs(), y.cwiseAbs()).cwiseAbs() + b.cwiseAbs();
  /* of a row of zeros, the latter alone */
  const Column    allowed = 1e-8 * terms.tail(d.m()) + 1e-10 * setup.s.tail(d.m()).cwiseInverse();
  const PetscReal bound   = w.cwiseAbs().cwiseProduct(allowed.cwiseAbs()).sum();

  const PetscReal size    = y.cwiseAbs().cwiseQuotient(setup.s.cwiseAbs()).maxCoeff();
  Column          product = Times(d.K().adjoint(), Append(n, w)).cwiseProduct(setup.s),
         whole            = Times(d.K().cwiseAbs().transpose(), Append(n, w.cwiseAbs()));

  for (PetscInt k : c.fixed) product[k] = 0.0;
  const PetscReal rest = product.cwiseAbs().maxCoeff();
  if (c.zero && rest > 1e-15 * whole.cwiseProduct(setup.s).cwiseAbs().maxCoeff()) { /* a large y may make up for that */
    Column off = b;

    off[n + row] += 1.1 * bound / w[row];
    const Column left = off - Times(d.K(), y);

    PetscCall(Certify(setup, w, left.tail(d.m()), 0.05 * bound / rest, allowed, AINSWORTH_DEPENDENCE_CONTRADICTION));
    PetscCall(Certify(setup, w, left.tail(d.m()), 0.2 * bound / rest, allowed, AINSWORTH_DEPENDENCE_NONE));
  }
  for (PetscReal part : {0.0, 0.9, -0.9, 1.1, -1.1, 1e6}) {
    Column off = b;

    Case("certify, %s, %g decades, seed %d, off by %g of what is allowed", c.name, (double)decades, (int)seed,
         (double)part);
    off[n + row] += part * bound / w[row];
    const Column left = off - Times(d.K(), y);

    PetscCall(Certify(setup, w, left.tail(d.m()), size, allowed,
                      !c.zero                     ? AINSWORTH_DEPENDENCE_NONE
                      : PetscAbsReal(part) <= 1.0 ? AINSWORTH_DEPENDENCE_CONSISTENT
                                                  : AINSWORTH_DEPENDENCE_CONTRADICTION));
  }
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestCertify()
{
  PetscFunctionBeginUser;
  for (const Certificate &c : Certificates())
    for (PetscReal decades : {0.0, 4.0, 8.0})
      for (PetscInt seed : {1, 1001}) PetscCall(CheckCertificate(c, decades, seed));
  PetscFunctionReturn(PETSC_SUCCESS);
}
