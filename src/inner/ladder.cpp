#include "ladder.h"

const char *const AinsworthLadderTypes[] = {"multigrid",     "factor",          "gmres", "whole",
                                            "AinsworthRung", "AINSWORTH_RUNG_", nullptr};

/*
   The prediction does not count what a package needs besides the factor, and is a lower bound where pivots are delayed;
   half of the memory is the program's
*/
static const double extra = 2.0, half = 0.5;

/* Returns the words for -ksp_view and -info: "the whole system factored, because ..." */
const char *AinsworthRungName(AinsworthRung rung)
{
  static const char *const names[] = {"multigrid in Ker C", "the preconditioning matrix factored, in Ker C",
                                      "GMRES in Ker C", "the whole system factored", "no other solver"};
  return names[rung];
}

static const char *Words(AinsworthEnd end)
{
  static const char *const words[AINSWORTH_ENDS] = {
    "the answer meets all rows",
    "the preconditioner could not be set up",
    "solves with the Gram matrix fail, or are too inaccurate to tell rows of C apart",
    "the levels do not fit A",
    "that of an earlier matrix takes more iterations than a set-up costs",
    "the iterations ran out",
    "a factorization is faster than the iterations that were left",
    "the iterations broke down",
    "conjugate gradients met a direction of negative energy, or of none",
    "the answer did not meet all rows",
    "the system is singular: no solver can choose among its solutions",
    "the system contradicts itself: no solver can meet all rows"};
  return words[end];
}

/*
   Returns the lowest rung that can do better than the last one

   Negative energy ends conjugate gradients with any preconditioner, so their method changes. An M_* that cannot be
   factored may be as singular as the system is: iterations with multigrid find one of its solutions, which no factor
   does. An answer that does not meet its rows although M_* is factored is a matter of S or M_*, which GMRES shares, so
   that only the whole system remains.
*/
static AinsworthRung Wanted(AinsworthRung now, AinsworthEnd end)
{
  if (end == AINSWORTH_END_GRAM && now != AINSWORTH_RUNG_WHOLE) return AINSWORTH_RUNG_WHOLE;
  switch (now) {
  case AINSWORTH_RUNG_MULTIGRID:
    return end == AINSWORTH_END_INDEFINITE ? AINSWORTH_RUNG_GMRES : AINSWORTH_RUNG_FACTOR;
  case AINSWORTH_RUNG_FACTOR:
    return end == AINSWORTH_END_SETUP        ? AINSWORTH_RUNG_MULTIGRID
           : end == AINSWORTH_END_INACCURATE ? AINSWORTH_RUNG_WHOLE
                                             : AINSWORTH_RUNG_GMRES;
  case AINSWORTH_RUNG_GMRES:
    return AINSWORTH_RUNG_WHOLE;
  default:
    return AINSWORTH_RUNG_NONE;
  }
}

/*
   AinsworthLadderFits - tells whether a factor of so many bytes, and what else a package needs, fits in half of the
   memory; 0: unknown
*/
bool AinsworthLadderFits(double bytes, double memory)
{
  return !(memory > 0.0) || extra * bytes <= half * memory;
}

/* AinsworthLadderNext - chooses the rung after the last one, or the first one if there was none */
AinsworthLadderStep AinsworthLadderNext(const AinsworthLadderFacts &facts)
{
  const auto    none = [](const char *why) { return AinsworthLadderStep{AINSWORTH_RUNG_NONE, why}; };
  const char   *why  = Words(facts.end);
  AinsworthRung next;

  if (facts.now == AINSWORTH_RUNG_NONE) {
    if (facts.small && facts.own && facts.factors && facts.regular && facts.cap >= AINSWORTH_RUNG_FACTOR)
      return {AINSWORTH_RUNG_FACTOR, "multigrid is not worth its set-up"};
    return {AINSWORTH_RUNG_MULTIGRID, facts.own ? "it is the cheapest" : "the program chose the inner solver"};
  }
  if (facts.end == AINSWORTH_END_ANSWER || facts.end == AINSWORTH_END_SINGULAR ||
      facts.end == AINSWORTH_END_CONTRADICTORY)
    return none(why);
  /* another solver on the same rung */
  if (facts.end == AINSWORTH_END_OLD || facts.end == AINSWORTH_END_UNFIT) return {facts.now, why};
  next = Wanted(facts.now, facts.end);
  if (next == AINSWORTH_RUNG_NONE)
    return none(facts.end == AINSWORTH_END_SETUP ? "the whole system cannot be factored" : why);
  if (next == AINSWORTH_RUNG_GMRES && facts.gmres)
    next = facts.now == AINSWORTH_RUNG_MULTIGRID ? AINSWORTH_RUNG_FACTOR : AINSWORTH_RUNG_WHOLE;
  if (next == AINSWORTH_RUNG_FACTOR && (!facts.own || !facts.factors || !facts.regular)) next = AINSWORTH_RUNG_WHOLE;
  if (next == AINSWORTH_RUNG_GMRES && !facts.own) next = AINSWORTH_RUNG_WHOLE;
  if (next > facts.cap) return none("-pc_ainsworth_ladder allows no higher rung");
  if (next < AINSWORTH_RUNG_WHOLE) return {next, why};
  /* a price is no failure */
  if (facts.end == AINSWORTH_END_DEAR) return none("no factorization may take the place of the iterations");
  if (!facts.regular)
    return none("the whole system cannot be factored, because it has the null space that the program attached");
  if (!facts.entries)
    return none("the whole system cannot be factored, because its entries are not known: pass assembled matrices");
  if (!AinsworthLadderFits(facts.bytes, facts.memory))
    return none("the factor of the whole system would not fit in memory");
  return {next, why};
}
