/* How far x moves and how large it grows, for small vectors with known answers */
#include "system.h"
#include <cmath>

static Column Numbers(std::initializer_list<PetscReal> values)
{
  Column column((Eigen::Index)values.size());

  Eigen::Index i = 0;
  for (PetscReal v : values) column[i++] = v;
  return column;
}

struct Change {
  const char *name;
  Column      b, x, p;
  PetscReal   change, growth;
};

/* The scale is given, 1/2, 1, 1/4 and, of the row of C, 1: how it is found is not what these numbers depend on */
PetscErrorCode TestChange()
{
  const PetscReal infinite = PETSC_MAX_REAL, nan = std::nan("");
  const Column    f = Numbers({8.0, 0.0, 0.0, 0.0}), zero = Numbers({0.0, 0.0, 0.0, 0.0});
  /* clang-format off */
  const std::vector<Change> changes = {
    {"no change",                f,    Numbers({1.0, 2.0, 3.0}),   Numbers({0.0, 0.0, 0.0}),   0.0,      3.0},
    {"in units of the program",  f,    Numbers({1.0, 2.0, 3.0}),   Numbers({0.0, 0.3, 0.0}),   0.1,      3.0},
    {"in units of the scale",    f,    Numbers({12.0, 0.0, 1.0}),  Numbers({0.0, 0.0, -3.0}),  0.5,      6.0},
    {"in both",                  f,    Numbers({0.0, 0.0, 3.0}),   Numbers({0.0, 0.0, 0.3}),   0.1,      3.0},
    {"of the right-hand side g",
     Numbers({0.0, 0.0, 0.0, -2.0}),   Numbers({0.0, 2.0, 0.0}),   Numbers({0.0, 1.0, 0.0}),   0.5,      1.0},
    {"of the force with the largest scale",
     Numbers({2.0, 3.0, 8.0, 0.0}),    Numbers({0.0, 6.0, 0.0}),   Numbers({0.0, 3.0, 0.0}),   0.5,      2.0},
    {"at rest",                  f,    Numbers({1e-12, 0.0, 0.0}), Numbers({1e-8, 0.0, 0.0}),  0.5,      5e-13},
    {"nearly at rest",           f,    Numbers({3e-8, 0.0, 0.0}),  Numbers({3e-8, 0.0, 0.0}),  1.0,      1.5e-8},
    {"x = 0",                    f,    Numbers({0.0, 0.0, 0.0}),   Numbers({0.0, 4e-8, 0.0}),  1.0,      0.0},
    {"b = 0",                    zero, Numbers({1.0, 0.0, 0.0}),   Numbers({0.0, 0.1, 0.0}),   0.1,      0.0},
    {"b = 0 and x = 0",          zero, Numbers({0.0, 0.0, 0.0}),   Numbers({0.0, 1e-30, 0.0}), infinite, 0.0},
    {"all is zero",              zero, Numbers({0.0, 0.0, 0.0}),   Numbers({0.0, 0.0, 0.0}),   0.0,      0.0},
    {"p is not a number",        f,    Numbers({1.0, 0.0, 0.0}),   Numbers({0.0, nan, 0.0}),   infinite, 0.5},
    {"b is tiny",
     Numbers({1e-308, 0.0, 0.0, 0.0}), Numbers({1e10, 0.0, 0.0}),  Numbers({1e9, 0.0, 0.0}),   0.1,      infinite}
  };
  /* clang-format on */
  Setup setup;

  PetscFunctionBeginUser;
  PetscCall(SetupCreate(Handmade(Numbers({4.0, 1.0, 16.0}), Numbers({0.0, 1.0, 0.0}).transpose()), &setup));
  PetscCall(SetBoth(Numbers({0.5, 1.0, 0.25, 1.0}), setup.sp->scale));
  for (const Change &c : changes) {
    Vec       p;
    PetscReal got;
    auto      same = [&got](PetscReal expected) {
      return expected == PETSC_MAX_REAL || expected == 0.0 ? got == expected
                                                                : PetscAbsReal(got - expected) <= 1e-14 * expected;
    };

    Case("change, %s", c.name);
    PetscCall(SetBoth(c.b, setup.b));
    PetscCall(Scatter(c.x, setup.y.primal));
    PetscCall(VecDuplicate(setup.y.primal, &p));
    PetscCall(Scatter(c.p, p));
    PetscCall(AinsworthChange(setup.sp.get(), setup.b, setup.y.primal, p, &got));
    PetscCall(CheckTrue(("the change " + std::to_string(got)).c_str(), same(c.change)));
    PetscCall(AinsworthGrowth(setup.sp.get(), setup.b, setup.y.primal, &got));
    PetscCall(CheckTrue(("the growth " + std::to_string(got)).c_str(), same(c.growth)));
    PetscCall(VecDestroy(&p));
  }
  PetscCall(SetupDestroy(&setup));
  PetscFunctionReturn(PETSC_SUCCESS);
}
