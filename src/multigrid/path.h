/* The ranks of each level by the time of a cycle on the busiest of them (docs/scaling.md) */
#ifndef AINSWORTH_PATH_H
#define AINSWORTH_PATH_H

#include "../base/machine.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

struct AinsworthPathModel {
  AinsworthMachine machine;
  double           bs         = 6.0;   /* unknowns of a node */
  double           coarseSize = 600.0; /* unknowns of a level that is factored */
};

/* Blocks of a row of a coarse level (25 to 100 were seen), and neighbors of a rank in space */
static const double AinsworthPathBlocks = 50.0, AinsworthPathNeighbors = 14.0;
/*
   Nodes of an aggregate, and how many more aggregates a rank has because they stay inside of it: 59, 82, 586 and 2236
   nodes a rank became 6.0, 7.4, 37.5 and 111
*/
static const double AinsworthPathShrink = 20.0, AinsworthPathBorder = 3.0;
/*
   Fewest nodes of a rank, as aggregates stay inside of it: with 26 two cubes with stiff balls take 30 iterations in
   place of 15, with 50 15
*/
static const double AinsworthPathFewest = 50.0;
/* Products of a visit: two steps of smoothing before and after, the residual, and interpolation both ways */
static const double AinsworthPathProducts = 6.0;

/* AinsworthPathProduct - returns the seconds of a product with a level of so many entries on the busiest rank */
inline double AinsworthPathProduct(const AinsworthMachine &machine, double entries, double ranks)
{
  return entries / (double)machine.rate + std::min(ranks - 1.0, AinsworthPathNeighbors) * (double)machine.message;
}

/*
   AinsworthPath - returns the seconds of a visit of a level and of all below it, on the busiest rank, if its nodes are
   spread over the best number of groups of so many ranks, each of which gives its nodes to one

   group: the size of the groups; may be NULL
*/
inline double AinsworthPath(const AinsworthPathModel &m, double nodes, int ranks, int *group)
{
  const double row  = AinsworthPathBlocks * m.bs * m.bs;
  double       best = std::numeric_limits<double>::max();

  if (nodes * m.bs <= m.coarseSize) {
    if (group) *group = std::max(1, ranks);
    return nodes * m.bs * nodes * m.bs / (double)m.machine.rate;
  }
  for (int g = 1;; g += std::max(1, g / 2)) {
    const int    owners = (ranks + g - 1) / g;
    const double busy = std::ceil(nodes / owners), border = owners > 1 ? AinsworthPathBorder : 0.0;
    const double below   = owners * std::ceil(busy / AinsworthPathShrink + border);
    double       seconds = AinsworthPathProducts * AinsworthPathProduct(m.machine, busy * row, owners);

    if (owners > 1 && busy < AinsworthPathFewest) seconds = std::numeric_limits<double>::max();
    else if (below < nodes) seconds += AinsworthPath(m, below, owners, NULL);
    if (seconds < best) {
      best = seconds;
      if (group) *group = g;
    }
    if (owners == 1) return best;
  }
}

/* A level as it was made */
struct AinsworthPathLevel {
  double entries = 0.0, ranks = 1.0; /* on all ranks; the coarsest level: those of its inverse */
};

/*
   AinsworthPathCycle - returns the seconds of a cycle that visits the first coarser level twice, and each one below it
   `below` times as often as the one above it, but the coarsest one as often
*/
inline double AinsworthPathCycle(const AinsworthMachine &machine, const std::vector<AinsworthPathLevel> &levels,
                                 double below)
{
  double seconds = 0.0, visits = 1.0;

  for (size_t l = 0; l < levels.size(); l++) {
    const bool coarsest = l + 1 == levels.size();

    if (l && !coarsest) visits *= l == 1 ? 2.0 : below;
    seconds += visits * (coarsest ? 1.0 : AinsworthPathProducts) *
               AinsworthPathProduct(machine, levels[l].entries / levels[l].ranks, levels[l].ranks);
  }
  return seconds;
}

/*
   How much longer a W-cycle may take than two visits of all coarser levels: parts of a mesher take up to a fifth fewer
   iterations (140 910 and 149 475 unknowns: 15, 19), bodies of hexahedra as many
*/
static const double AinsworthPathMostOfW = 1.1;

/* AinsworthPathPrefersW - checks whether a W-cycle takes hardly longer than one that visits all coarser levels twice */
inline bool AinsworthPathPrefersW(const AinsworthMachine &machine, const std::vector<AinsworthPathLevel> &levels)
{
  return AinsworthPathCycle(machine, levels, 2.0) <= AinsworthPathMostOfW * AinsworthPathCycle(machine, levels, 1.0);
}

#endif
