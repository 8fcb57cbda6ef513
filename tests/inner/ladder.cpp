/* The ladder, as a table: facts, the next rung, and words of the reason. Needs neither MPI nor PETSc */
#include "inner/ladder.h"
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>

enum {
  multigrid = AINSWORTH_RUNG_MULTIGRID,
  factor    = AINSWORTH_RUNG_FACTOR,
  gmres     = AINSWORTH_RUNG_GMRES,
  whole     = AINSWORTH_RUNG_WHOLE,
  none      = AINSWORTH_RUNG_NONE
};

using Facts = AinsworthLadderFacts;

struct Line {
  int                          now;
  AinsworthEnd                 end;
  std::function<void(Facts &)> but; /* what is unusual */
  int                          next;
  const char                  *why;
};

static void Usual(Facts &) { }
static void Own(Facts &f)
{
  f.own = false;
}
static void Small(Facts &f)
{
  f.small = true;
}
static void Unsymmetric(Facts &f)
{
  f.gmres = true;
}
static void NoFactor(Facts &f)
{
  f.factors = false;
}
static void NullSpace(Facts &f)
{
  f.regular = false;
}
static void NoEntries(Facts &f)
{
  f.entries = false;
}
static void Fits(Facts &f)
{
  f.bytes  = 1e9;
  f.memory = 4e9;
}
static void Large(Facts &f)
{
  f.bytes  = 1.01e9;
  f.memory = 4e9;
}
static void Endless(Facts &f)
{
  f.bytes  = HUGE_VAL;
  f.memory = 4e9;
}
static void NotANumber(Facts &f)
{
  f.bytes  = NAN;
  f.memory = 4e9;
}
static std::function<void(Facts &)> Cap(int rung, void (*also)(Facts &) = Usual)
{
  return [=](Facts &f) {
    also(f);
    f.cap = (AinsworthRung)rung;
  };
}

static const AinsworthEnd answer = AINSWORTH_END_ANSWER, setup = AINSWORTH_END_SETUP, gram = AINSWORTH_END_GRAM,
                          limit = AINSWORTH_END_LIMIT, dear = AINSWORTH_END_DEAR, old = AINSWORTH_END_OLD,
                          unfit = AINSWORTH_END_UNFIT, breakdown = AINSWORTH_END_BREAKDOWN,
                          indefinite = AINSWORTH_END_INDEFINITE, inaccurate = AINSWORTH_END_INACCURATE,
                          singular = AINSWORTH_END_SINGULAR, contradictory = AINSWORTH_END_CONTRADICTORY;

/* clang-format off */
static const Line table[] = {
  /* the first rung */
  {none,      answer,        Usual,             multigrid, "cheapest"},
  {none,      answer,        Small,             factor,    "not worth its set-up"},
  {none,      answer,        Cap(multigrid, Small), multigrid, "cheapest"},
  {none,      answer,        [](Facts &f) { f.small = true; f.factors = false; }, multigrid, "cheapest"},
  {none,      answer,        [](Facts &f) { f.small = true; f.own = false; }, multigrid, "the program chose"},
  /* one by one */
  {multigrid, limit,         Usual,             factor,    "ran out"},
  {multigrid, dear,          Usual,             factor,    "faster"},
  {multigrid, breakdown,     Usual,             factor,    "broke down"},
  {multigrid, inaccurate,    Usual,             factor,    "did not meet"},
  {multigrid, setup,         Usual,             factor,    "set up"},
  {multigrid, indefinite,    Usual,             gmres,     "negative energy"},
  {factor,    limit,         Usual,             gmres,     "ran out"},
  {factor,    breakdown,     Usual,             gmres,     "broke down"},
  {factor,    indefinite,    Usual,             gmres,     "negative energy"},
  {factor,    inaccurate,    Usual,             whole,     "did not meet"},
  {factor,    setup,         Usual,             multigrid, "set up"},
  {gmres,     limit,         Usual,             whole,     "ran out"},
  {gmres,     breakdown,     Usual,             whole,     "broke down"},
  {gmres,     inaccurate,    Usual,             whole,     "did not meet"},
  {gmres,     setup,         Usual,             whole,     "set up"},
  /* another solver on the same rung */
  {multigrid, old,           Usual,             multigrid, "earlier matrix"},
  {factor,    old,           Usual,             factor,    "earlier matrix"},
  {gmres,     old,           Cap(multigrid),    gmres,     "earlier matrix"},
  {multigrid, unfit,         Usual,             multigrid, "do not fit"},
  /* no higher one */
  {whole,     setup,         Usual,             none,      "cannot be factored"},
  {whole,     inaccurate,    Usual,             none,      "did not meet"},
  {whole,     breakdown,     Usual,             none,      "broke down"},
  /* no rung helps, or none is needed */
  {multigrid, answer,        Usual,             none,      "meets all rows"},
  {whole,     answer,        Usual,             none,      "meets all rows"},
  {multigrid, singular,      Usual,             none,      "singular"},
  {gmres,     singular,      Usual,             none,      "singular"},
  {multigrid, contradictory, Usual,             none,      "contradicts itself"},
  {factor,    contradictory, Own,               none,      "contradicts itself"},
  /* GMRES is the method anyway */
  {multigrid, limit,         Unsymmetric,       factor,    "ran out"},
  {multigrid, indefinite,    Unsymmetric,       factor,    "negative energy"},
  {factor,    limit,         Unsymmetric,       whole,     "ran out"},
  /* M_* cannot be factored */
  {multigrid, limit,         NoFactor,          whole,     "ran out"},
  {multigrid, indefinite,    NoFactor,          gmres,     "negative energy"},
  {multigrid, dear,          NoFactor,          none,      "take the place"},
  /* the program chose the inner solver */
  {multigrid, limit,         Own,               whole,     "ran out"},
  {multigrid, indefinite,    Own,               whole,     "negative energy"},
  {factor,    breakdown,     Own,               whole,     "broke down"},
  {multigrid, limit,         Cap(gmres, Own),   none,      "-pc_ainsworth_ladder"},
  /* the cap */
  {multigrid, limit,         Cap(multigrid),    none,      "-pc_ainsworth_ladder"},
  {multigrid, limit,         Cap(factor),       factor,    "ran out"},
  {multigrid, indefinite,    Cap(factor),       none,      "-pc_ainsworth_ladder"},
  {factor,    limit,         Cap(factor),       none,      "-pc_ainsworth_ladder"},
  {factor,    limit,         Cap(gmres),        gmres,     "ran out"},
  {factor,    inaccurate,    Cap(gmres),        none,      "-pc_ainsworth_ladder"},
  {gmres,     limit,         Cap(gmres),        none,      "-pc_ainsworth_ladder"},
  {gmres,     limit,         Cap(whole),        whole,     "ran out"},
  /* solves with the Gram matrix fail, which all rungs but the last need */
  {multigrid, gram,          Usual,             whole,     "Gram"},
  {factor,    gram,          Usual,             whole,     "Gram"},
  {gmres,     gram,          Own,               whole,     "Gram"},
  {whole,     gram,          Usual,             none,      "Gram"},
  {multigrid, gram,          Cap(gmres),        none,      "-pc_ainsworth_ladder"},
  {multigrid, gram,          NullSpace,         none,      "null space"},
  /* the whole system cannot be factored */
  {none,      answer,        [](Facts &f) { f.small = true; f.regular = false; }, multigrid, "cheapest"},
  {multigrid, dear,          NullSpace,         none,      "take the place"},
  {multigrid, indefinite,    NullSpace,         gmres,     "negative energy"},
  {gmres,     limit,         NullSpace,         none,      "null space"},
  {gmres,     limit,         NoEntries,         none,      "entries are not known"},
  {multigrid, limit,         NoEntries,         factor,    "ran out"},
  {gmres,     limit,         Fits,              whole,     "ran out"},
  {gmres,     limit,         Large,             none,      "fit in memory"},
  {gmres,     limit,         Endless,           none,      "fit in memory"},
  {gmres,     limit,         NotANumber,        none,      "fit in memory"},
  {multigrid, limit,         Large,             factor,    "ran out"}
};
/* clang-format on */

static int failed = 0;

static void Fail(const char *what, int line)
{
  printf("FAILED: %s, line %d of the table\n", what, line);
  failed++;
}

/*
   Whatever the facts are, the ladder ends: each step is higher, not above the cap, and has words; once it goes back to
   multigrid, when M_* cannot be factored
*/
static void Climb(const AinsworthLadderFacts &facts)
{
  AinsworthLadderFacts f    = facts;
  AinsworthLadderStep  step = AinsworthLadderNext(f);

  f.now = step.next;
  for (int steps = 0; f.now != AINSWORTH_RUNG_NONE; steps++) {
    step = AinsworthLadderNext(f);
    if (!step.why || !*step.why) Fail("no reason", -1);
    if (f.end == old || f.end == unfit) { /* made anew, it is neither */
      if (step.next != f.now) Fail("not the same rung", -1);
      f.end = breakdown;
      continue;
    }
    if (f.now == AINSWORTH_RUNG_FACTOR && step.next == AINSWORTH_RUNG_MULTIGRID && f.factors &&
        f.end == AINSWORTH_END_SETUP)
      f.factors = false;
    else if (step.next <= f.now) Fail("not higher", -1);
    if (step.next != AINSWORTH_RUNG_NONE && step.next > f.cap) Fail("above the cap", -1);
    if (steps > 5) return Fail("no end", -1);
    f.now = step.next;
  }
}

int main()
{
  int count = 0;

  for (const Line &line : table) {
    AinsworthLadderFacts facts;

    facts.now = (AinsworthRung)line.now;
    facts.end = line.end;
    line.but(facts);
    const AinsworthLadderStep step = AinsworthLadderNext(facts);

    if (step.next != line.next) Fail(AinsworthRungName(step.next), count);
    if (!strstr(step.why, line.why)) Fail(step.why, count);
    count++;
  }
  for (int bits = 0; bits < 64; bits++)
    for (int cap = multigrid; cap <= whole; cap++)
      for (int end = 0; end < AINSWORTH_ENDS; end++) {
        AinsworthLadderFacts facts;
        bool *const flags[] = {&facts.own, &facts.small, &facts.gmres, &facts.factors, &facts.entries, &facts.regular};

        for (int k = 0; k < 6; k++) *flags[k] = bits >> k & 1;
        facts.cap = (AinsworthRung)cap;
        facts.end = (AinsworthEnd)end;
        Climb(facts);
      }
  for (int rung = multigrid; rung <= whole; rung++)
    if (!strlen(AinsworthRungName((AinsworthRung)rung)) || !AinsworthLadderTypes[rung]) Fail("no name", rung);
  printf("%d lines, %d failed\n", count, failed);
  return failed != 0;
}
