/* The ranks of each level by the time of a cycle on the busiest of them (docs/scaling.md) */
#ifndef AINSWORTH_PATH_H
#define AINSWORTH_PATH_H

#include "../base/machine.h"
#include <algorithm>
#include <cmath>
#include <limits>

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
    const double below    = owners * std::ceil(busy / AinsworthPathShrink + border);
    const double messages = std::min(owners - 1.0, AinsworthPathNeighbors);
    double       seconds  = AinsworthPathProducts *
                     (busy * row / (double)m.machine.rate + messages * (double)m.machine.message);

    if (owners > 1 && busy < AinsworthPathFewest) seconds = std::numeric_limits<double>::max();
    else if (below < nodes) seconds += AinsworthPath(m, below, owners, NULL);
    if (seconds < best) {
      best = seconds;
      if (group) *group = g;
    }
    if (owners == 1) return best;
  }
}

#endif
