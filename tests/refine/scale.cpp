/*
   The scale of a system against its definition: powers of 2 that bring the largest entry of each row and column to
   about 1
*/
#include "system.h"
#include <cmath>

struct Scaled {
  const char                   *name;
  std::function<void(Kind &)>   kind;
  std::function<void(Blocks &)> change;
  /* after a sweep no row is 38 decades below those that it shares entries with: each sweep halves them */
  bool about1 = true;
};

static PetscReal Power(PetscReal decades, PetscInt seed, PetscInt i)
{
  return PetscPowReal(10.0, decades * Uniform(seed, i, 0));
}

static void Same(Blocks &) { }

static void RowsOfC(Blocks &b)
{
  for (PetscInt i = 0; i < b.m(); i++) b.C.row(i) *= Power(12.0, 61, i);
  b.B = b.C;
}

/* The largest compliance is 1e15, the least 1e-15 */
static void Compliances(Blocks &b)
{
  for (PetscInt i = 0; i < b.m(); i++) b.D(i, i) = PetscPowReal(10.0, -15.0 + 30.0 * i / (b.m() - 1));
}

/* Unknowns without stiffness, one of which is in no equation at all */
static void Loose(Blocks &b)
{
  for (PetscInt i = 1; i < b.n(); i += 3) {
    b.A.row(i).setZero();
    b.A.col(i).setZero();
  }
  b.C.col(4).setZero();
  b.B = b.C;
}

/* Rows of B and C have sizes of their own */
static void Unlike(Blocks &b)
{
  for (PetscInt i = 0; i < b.m(); i++) {
    b.B.row(i) *= Power(6.0, 62, i);
    b.C.row(i) *= Power(6.0, 63, i);
  }
}

static void EmptyRows(Blocks &b)
{
  for (PetscInt i : {0, 5, 13}) b.C.row(i).setZero();
  b.B = b.C;
}

/* A row of C that has nothing but the stiffest of all unknowns */
static void OnStiff(Blocks &b)
{
  b.A(9, 9) = 1e300;
  b.C.row(4).setZero();
  b.C(4, 9) = 1.0;
  b.B       = b.C;
}

/* clang-format off */
static const std::vector<Scaled> &Systems()
{
  static const std::vector<Scaled> systems = {
    {"plain",                   [](Kind &) {},                                                Same},
    {"indefinite",              [](Kind &k) { k.definite = false; },                          Same},
    {"no diagonal",             [](Kind &k) { k.definite = k.diagonal = false; },             Same},
    {"unsymmetric",             [](Kind &k) { k.symmetric = false; },                         Same},
    {"badly scaled",            [](Kind &k) { k.decades = 8.0, k.compliance = COUPLED; },     Same},
    {"rows of C",               [](Kind &) {},                                                RowsOfC},
    {"rows of C and D",         [](Kind &k) { k.compliance = DIAGONAL; },                     RowsOfC},
    {"D over 30 decades",       [](Kind &) {},                                                Compliances},
    {"coupled D",               [](Kind &k) { k.compliance = COUPLED; },                      Compliances},
    {"loose",                   [](Kind &) {},                                                Loose},
    {"loose, rows of C",        [](Kind &) {}, [](Blocks &b) { Loose(b), RowsOfC(b); }},
    {"B is not C",              [](Kind &k) { k.symmetric = false; },                         Unlike},
    {"B is not C, D",           [](Kind &k) { k.symmetric = false, k.compliance = COUPLED; }, Unlike},
    {"empty rows",              [](Kind &) {},                                                EmptyRows},
    {"empty rows with D",       [](Kind &) {}, [](Blocks &b) { EmptyRows(b), Compliances(b); }},
    {"A of 1e-300",             [](Kind &) {}, [](Blocks &b) { b.A *= 1e-301; }},
    {"one A_ii of 1e-300",      [](Kind &) {}, [](Blocks &b) { b.A(3, 3) = 1e-300; }},
    {"D of 1e300",              [](Kind &) {}, [](Blocks &b) { b.D(2, 2) = 1e300; }},
    {"A of 1e-300, D of 1e300", [](Kind &) {}, [](Blocks &b) { b.A *= 1e-301, b.D(2, 2) = 1e300; }},
    {"other units of A",        [](Kind &) {}, [](Blocks &b) { b.A *= 3e11; }},
    {"other units of C",        [](Kind &k) { k.decades = 4.0; }, [](Blocks &b) { b.B = b.C *= 5e-13; }},
    {"a row on 1e300",          [](Kind &) {},                                                OnStiff, false}
  };

  return systems;
}
/* clang-format on */

/* The largest entry in the row and column of each unknown and multiplier, scaled, with the stiffness in place of A */
static Column Largest(const Blocks &b, const Column &s)
{
  Dense K = b.K();

  for (PetscInt i = 0; i < b.n(); i++) {
    const PetscReal d = PetscRealPart(b.A(i, i));

    K.row(i).head(b.n()).setZero();
    K(i, i) = d > 0.0 ? d : b.A.row(i).cwiseAbs().maxCoeff();
  }
  K = s.asDiagonal() * K * s.asDiagonal();
  return K.cwiseAbs().rowwise().maxCoeff().cwiseMax(K.cwiseAbs().colwise().maxCoeff().transpose());
}

static PetscErrorCode CheckScale(const Scaled &system, PetscInt seed)
{
  Kind      kind{system.name};
  Setup     setup, alone;
  bool      power = true, loose = true, sprung = true;
  PetscReal range[2] = {1.0, 1.0};

  PetscFunctionBeginUser;
  Case("scale, %s, seed %d", system.name, (int)seed);
  system.kind(kind);
  Blocks b = Draw(kind, seed);

  system.change(b);
  PetscCall(SetupCreate(b, &setup));
  PetscCall(SetupCreate(b, &alone, true));
  const Column most = Largest(b, setup.s);
  PetscInt     first;

  for (Eigen::Index i = 0; i < setup.s.size(); i++) {
    int             exponent;
    const PetscReal size = PetscRealPart(most[i]);

    power = power && std::frexp((double)PetscRealPart(setup.s[i]), &exponent) == 0.5 &&
            !PetscIsInfOrNanScalar(setup.s[i]);
    if (system.about1 && size > 0.0) range[0] = PetscMin(range[0], size);
    range[1] = size <= range[1] ? range[1] : size;
  }
  PetscCall(CheckTrue("positive powers of 2", power));
  PetscCall(Check("1 over the least of the largest entries", 1.0 / range[0], 2.0));
  PetscCall(Check("the largest entry", range[1], 2.0));
  PetscCall(CheckTrue("the same on one rank", setup.s == alone.s));
  PetscCall(VecGetOwnershipRange(setup.sp->scale.primal, &first, NULL));
  for (size_t i = 0; i < setup.sp->loose.size(); i++)
    loose = loose && setup.sp->loose[i] == (b.A.row(first + (PetscInt)i).cwiseAbs().maxCoeff() == 0.0);
  PetscCall(CheckTrue("the unknowns without stiffness", loose));
  for (PetscInt i = 0; i < setup.sp->local(); i++)
    sprung = sprung && setup.sp->sprung[i] == (b.D.row(setup.sp->first + i).cwiseAbs().maxCoeff() > 0.0);
  PetscCall(CheckTrue("the rows with springs", sprung && (PetscInt)setup.sp->sprung.size() == setup.sp->local()));
  PetscCall(SetupDestroy(&alone));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   In other units of forces and constraints, by powers of 4 that cause no rounding, each number of the scale is the same
   multiple
*/
static PetscErrorCode CheckUnits(const Scaled &system, PetscReal force, PetscReal constraint)
{
  Kind   kind{system.name};
  Setup  setup, other;
  Column factor;

  PetscFunctionBeginUser;
  Case("scale, %s, forces times %g, constraints times %g", system.name, (double)force, (double)constraint);
  system.kind(kind);
  Blocks b = Draw(kind, 1);

  system.change(b);
  b.B *= 1.25; /* rows of C with 2, twice a power of 4, would be where rounding of their mean chooses the power */
  b.C *= 1.25;
  PetscCall(SetupCreate(b, &setup));
  b.A *= force;
  b.B *= constraint;
  b.C *= constraint;
  b.D *= constraint * constraint / force;
  PetscCall(SetupCreate(b, &other));
  factor = Column::Constant(b.n() + b.m(), PetscSqrtReal(force) / constraint);
  factor.head(b.n()).setConstant(1.0 / PetscSqrtReal(force));
  PetscCall(CheckTrue("the scale has the units of the system", other.s == setup.s.cwiseProduct(factor)));
  PetscCall(SetupDestroy(&other));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In other units of each constraint the numbers of the multipliers are other ones, those of the unknowns the same */
static PetscErrorCode CheckRowUnits(const Scaled &system)
{
  Kind   kind{system.name};
  Setup  setup, other;
  Column unit, factor;

  PetscFunctionBeginUser;
  Case("scale, %s, units of each constraint", system.name);
  system.kind(kind);
  Blocks b = Draw(kind, 1);

  system.change(b);
  b.B *= 1.25;
  b.C *= 1.25;
  PetscCall(SetupCreate(b, &setup));
  unit = Column::Ones(b.m());
  for (PetscInt i = 0; i < b.m(); i++) unit[i] = std::ldexp(1.0, (int)(26 * (i % 7) - 78));
  b.B                = unit.asDiagonal() * b.B;
  b.C                = unit.asDiagonal() * b.C;
  b.D                = unit.asDiagonal() * b.D * unit.asDiagonal();
  factor             = Column::Ones(b.n() + b.m());
  factor.tail(b.m()) = unit.cwiseInverse();
  PetscCall(SetupCreate(b, &other));
  PetscCall(CheckTrue("the scale has the units of the constraints", other.s == setup.s.cwiseProduct(factor)));
  PetscCall(SetupDestroy(&other));
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestScale()
{
  PetscFunctionBeginUser;
  for (const Scaled &system : Systems())
    for (PetscInt seed : {1, 1001}) PetscCall(CheckScale(system, seed));
  for (const Scaled &system : Systems()) /* rows of zeros have no units of their own */
    if (std::string(system.name).find("empty") == std::string::npos &&
        std::string(system.name).find("1e") == std::string::npos)
      PetscCall(CheckRowUnits(system));
  for (const Scaled &system : Systems()) /* what is near the ends of the range of numbers may overflow */
    if (system.about1 && std::string(system.name).find("1e") == std::string::npos)
      for (PetscReal force : {0x1p-40, 1.0, 0x1p40})
        for (PetscReal constraint : {0x1p-44, 0x1p44}) PetscCall(CheckUnits(system, force, constraint));
  PetscFunctionReturn(PETSC_SUCCESS);
}
