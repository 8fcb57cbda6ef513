/* The plan of the inner solver and the age of its preconditioner, as tables. Needs neither MPI nor PETSc */
#include "inner/age.h"
#include "inner/plan.h"
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>

using Facts = AinsworthPlanFacts;

static const AinsworthMethod theirs = AINSWORTH_METHOD_GIVEN, projected = AINSWORTH_METHOD_PROJECTED,
                             cg = AINSWORTH_METHOD_CG, gmres = AINSWORTH_METHOD_GMRES;
static const AinsworthPreconditioner given = AINSWORTH_INNER_GIVEN, blocks = AINSWORTH_INNER_BLOCKS,
                                     amg = AINSWORTH_INNER_AMG, factor = AINSWORTH_INNER_FACTOR;

struct Line {
  const char                  *what;
  std::function<void(Facts &)> but; /* what is unusual */
  AinsworthMethod              method;
  AinsworthPreconditioner      preconditioner;
  const char                  *why[2];
};

/* clang-format off */
static const Line table[] = {
  {"displacements",            [](Facts &) { },
                               projected, blocks, {"A and C", "couples nodes"}},
  {"no constraints",           [](Facts &f) { f.constraints = false; },
                               cg,        blocks, {"no constraints", "couples nodes"}},
  {"temperatures",             [](Facts &f) { f.nodes = false; },
                               projected, amg,    {"A and C", "two to five"}},
  {"flow",                     [](Facts &f) { f.symmetric = false; },
                               gmres,     amg,    {"not symmetric", "not symmetric"}},
  {"flow, no constraints",     [](Facts &f) { f.symmetric = f.constraints = false; },
                               gmres,     amg,    {"not symmetric", "not symmetric"}},
  {"B is not C",               [](Facts &f) { f.adjoint = false; },
                               gmres,     blocks, {"not adjoint", "couples nodes"}},
  {"tiny",                     [](Facts &f) { f.tiny = true; },
                               projected, factor, {"A and C", "not worth"}},
  /* what the program chose */
  {"its own CG",               [](Facts &f) { f.projected = f.open = false; },
                               theirs,    blocks, {"the program", "couples nodes"}},
  {"its own GMRES",            [](Facts &f) { f.projected = f.open = f.conjugate = false; },
                               theirs,    amg,    {"the program", "transpose"}},
  {"its own GMRES, flow",      [](Facts &f) { f.projected = f.open = f.conjugate = f.symmetric = false; },
                               theirs,    amg,    {"the program", "not symmetric"}},
  {"KSPPROJECTEDCG by name",   [](Facts &f) { f.open = false; },
                               projected, blocks, {"A and C", "couples nodes"}},
  {"by name, no constraints",  [](Facts &f) { f.open = f.constraints = false; },
                               cg,        blocks, {"no constraints", "couples nodes"}},
  {"by name, flow",            [](Facts &f) { f.open = f.symmetric = false; },
                               projected, amg,    {"A and C", "not symmetric"}},
  {"its own preconditioner",   [](Facts &f) { f.own = false; },
                               projected, given,  {"A and C", "the program"}},
  {"its own, tiny",            [](Facts &f) { f.own = false; f.tiny = true; },
                               projected, given,  {"A and C", "the program"}},
  {"its own, old escape",      [](Facts &f) { f.own = false; f.history.factor = AINSWORTH_TAKEN; },
                               projected, given,  {"A and C", "the program"}},
  {"the paper",                [](Facts &f) { f.rows = f.open = f.projected = false; },
                               theirs,    amg,    {"the program", "the paper"}},
  /* what was tried */
  {"escaped",                  [](Facts &f) { f.history.factor = AINSWORTH_TAKEN; },
                               projected, factor, {"A and C", "took the place"}},
  {"no factorization",         [](Facts &f) { f.history.factor = AINSWORTH_FAILED; },
                               projected, blocks, {"A and C", "couples nodes"}},
  {"tiny, no factorization",   [](Facts &f) { f.tiny = true; f.history.factor = AINSWORTH_FAILED; },
                               projected, blocks, {"A and C", "couples nodes"}},
  {"unfit levels",             [](Facts &f) { f.history.blocks = AINSWORTH_FAILED; },
                               projected, amg,    {"A and C", "does not fit"}},
  {"indefinite",               [](Facts &f) { f.history.gmres = AINSWORTH_TAKEN; },
                               gmres,     blocks, {"gave no answer", "couples nodes"}},
  {"indefinite, factored",     [](Facts &f) { f.history.gmres = f.history.factor = AINSWORTH_TAKEN; },
                               gmres,     factor, {"gave no answer", "took the place"}},
  {"indefinite, but by name",  [](Facts &f) { f.open = false; f.history.gmres = AINSWORTH_TAKEN; },
                               projected, blocks, {"A and C", "couples nodes"}}
};
/* clang-format on */

static int failed = 0;

static void Check(bool good, const char *what)
{
  if (good) return;
  printf("FAILED: %s\n", what);
  failed++;
}

/*
   Whatever the facts are, there are words, what the program chose stays, and conjugate gradients are ours only where
   they may be
*/
static void CheckAll()
{
  for (int bits = 0; bits < 1 << 10; bits++) {
    for (int tried = 0; tried < 27; tried++) {
      Facts f;
      bool *is[] = {&f.constraints, &f.symmetric, &f.adjoint, &f.nodes,     &f.rows,
                    &f.tiny,        &f.projected, &f.open,    &f.conjugate, &f.own};

      for (int k = 0; k < 10; k++) *is[k] = bits >> k & 1;
      f.history.factor         = (AinsworthTried)(tried % 3);
      f.history.gmres          = (AinsworthTried)(tried / 3 % 3);
      f.history.blocks         = (AinsworthTried)(tried / 9);
      const AinsworthPlan plan = AinsworthPlanInner(f);

      Check(*plan.why[0] && *plan.why[1], "no reason");
      Check((plan.method == theirs) == !f.projected, "the method of the program");
      Check((plan.preconditioner == given) == !f.own, "the preconditioner of the program");
      Check(plan.method != gmres || f.open, "GMRES though the program chose");
      Check(plan.preconditioner != blocks || (f.symmetric && f.nodes && f.rows), "blocks for other systems");
      Check(f.open && f.projected && !(f.symmetric && f.adjoint) ? plan.method == gmres : true,
            "conjugate gradients for a system that is not symmetric");
    }
  }
}

static void CheckRungs()
{
  AinsworthHistory h;

  Check(AinsworthPlanRung(h) == AINSWORTH_RUNG_MULTIGRID, "first rung");
  h.factor = AINSWORTH_FAILED;
  Check(AinsworthPlanRung(h) == AINSWORTH_RUNG_MULTIGRID, "back to multigrid");
  h.factor = AINSWORTH_TAKEN;
  Check(AinsworthPlanRung(h) == AINSWORTH_RUNG_FACTOR, "factor");
  h.gmres = AINSWORTH_TAKEN;
  Check(AinsworthPlanRung(h) == AINSWORTH_RUNG_GMRES, "GMRES");
  h.whole = AINSWORTH_FAILED;
  Check(AinsworthPlanRung(h) == AINSWORTH_RUNG_WHOLE, "the whole system, tried in vain");
}

/* A preconditioner that costs k iterations more in its k-th solve after the first one */
static void CheckAge()
{
  const double price = 10.0;
  AinsworthAge age;
  int          kept = 0;

  Check(AinsworthAgeDecades(1e-8) == 8 && AinsworthAgeDecades(0.0) == 16 && AinsworthAgeDecades(0.9) == 1 &&
          AinsworthAgeDecades(1e-30) == 16,
        "decades");
  Check(AinsworthAgeFirst(age, 8) < 0.0, "nothing was solved");
  AinsworthAgeCount(&age, 20, 8, false);
  Check(AinsworthAgeFirst(age, 8) == 20.0 && AinsworthAgeFirst(age, 4) == 10.0 && AinsworthAgeFirst(age, 16) == 40.0,
        "scaled by decades");
  Check(AinsworthAgeKeeps(age, price), "kept after the first solve");
  Check(AinsworthAgeLimit(age, 8, price) == 36.0, "limit of an old one");
  for (int k = 1; AinsworthAgeKeeps(age, price) && k < 100; k++) {
    AinsworthAgeCount(&age, 20 + k, 8, true);
    kept = k;
  }
  /* the next solve costs kept + 1; the mean so far (10 + kept (kept + 1) / 2) / (kept + 1) */
  Check(kept == 4 && age.more == 10.0 && age.last == 24, "replaced when the next solve costs more than the mean");
  AinsworthAgeCount(&age, 5, 8, true);
  Check(age.extra == 0.0, "fewer iterations are no gain to count");
}

int main()
{
  int count = 0;

  for (const Line &line : table) {
    Facts f;

    line.but(f);
    const AinsworthPlan plan = AinsworthPlanInner(f);

    Check(plan.method == line.method && plan.preconditioner == line.preconditioner, line.what);
    for (int k = 0; k < 2; k++) Check(strstr(plan.why[k], line.why[k]), plan.why[k]);
    count++;
  }
  CheckAll();
  CheckRungs();
  CheckAge();
  printf("%d lines, %d failed\n", count, failed);
  return failed != 0;
}
