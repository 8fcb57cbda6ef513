#include "prices.h"
#include <algorithm>
#include <cmath>
#include <limits>

/*
   The unit of all prices is the time in which a product with A handles an entry, about a nanosecond. Fits to 63 solves
   of 3 000 to 150 000 unknowns, by hexahedra and tetrahedra, with few constraints and many (docs/extremes.md)

   An iteration, measured between .62 and 1.28 times: products with the finest level in single precision for each entry
   of A, vectors for each unknown, the first coarser level for each of its entries, and eight projections for each entry
   of the factors of S; of other multigrids only A is known. With an incomplete factor 1.3 to 1.7 times as much
*/
static const double perEntry = 0.2, perUnknown = 57.0, perCoarse = 0.85, perGram = 7.3, other = 3.0, incomplete = 1.5;
/*
   A factorization, .77 to 1.29 times: orderings and copies for each unknown, solves for each entry of the factor;
   operations that a package does in a unit
*/
static const double perRow = 3100.0, perFill = 34.0, operationsOf[] = {97.0, 48.0, 5.0};
/*
   A solve is watched in vain for the first part of the price, because forecasts of its first steps mislead: the
   residual stays where it is until conjugate gradients have found the bending of a body. It is given up if the rest is
   forecast to take more than the second part, because forecasts tend to be optimistic. By both the solves take at most
   1.81 times as long as by the better choice, 1.14 times in the mean; with .1 and .8 2.57 times, with .25 and .8 1.91
   times (docs/extremes.md)
*/
static const double patience = 0.15, part = 0.8;

/* AinsworthPriceIteration - returns the price of an iteration with multigrid */
double AinsworthPriceIteration(const AinsworthPriceFacts &f)
{
  if (!f.own) return other * f.entries;
  return (perEntry * f.entries * (f.single ? 1.0 : 2.0) + perUnknown * f.unknowns) * (f.factor ? incomplete : 1.0) +
         perCoarse * f.coarse + perGram * f.gram;
}

/*
   AinsworthPriceFactorization - returns the price of a factorization of M_* with its solves; on several ranks all is
   shared out, iterations as well
*/
double AinsworthPriceFactorization(const AinsworthPriceFacts &f, AinsworthPackage package)
{
  return perRow * f.unknowns + perFill * std::max(f.fill, 0.5 * f.entries) + f.operations / operationsOf[package];
}

/*
   Measured price of a set-up in iterations: BoomerAMG 8 to 10, PCGAMG 15, PCBLOCKSA 14 to 20; a factorization of 3 000
   to 28 000 unknowns 30 to 45 with CHOLMOD and 28 to 35 with MUMPS, because the analysis is repeated; if columns of the
   factor are long, `column` times their mean length
*/
static const double setUp[] = {15.0, 9.0, 30.0}, column = 0.04;

/*
   AinsworthPriceSetUp - returns the price of another set-up in iterations with what it makes; columns: mean length of
   those of a factor, 0 if unknown
*/
double AinsworthPriceSetUp(AinsworthSetUpKind kind, double columns)
{
  return kind == AINSWORTH_SETUP_FACTOR ? std::max(setUp[kind], column * columns) : setUp[kind];
}

/*
   AinsworthForecast - forecasts the iterations until the norm reaches the goal, at the faster of the rates of the last
   half and of the last quarter of the steps

   The rate of all steps misleads, because multigrid first removes what it is good at. Norms oscillate with long rows:
   the least so far counts
*/
double AinsworthForecast(const AinsworthSeries &s)
{
  std::vector<double> least(s.norms);
  const size_t        last = least.size() - 1;
  double              rate = 0.0;

  for (size_t k = 1; k <= last; k++) least[k] = std::min(least[k], least[k - 1]);
  if (least[last] <= s.goal) return 0.0;
  for (size_t from : {last / 2, 3 * last / 4})
    if (from < last) rate = std::max(rate, std::log(least[from] / least[last]) / (double)(last - from));
  return rate > 0.0 ? std::log(least[last] / s.goal) / rate : std::numeric_limits<double>::infinity();
}

/*
   AinsworthGivesUp - tells whether the solve has been watched long enough, and the rest of it would take longer than
   another solver, whose price is given in iterations; that may be a lower bound, or infinity
*/
bool AinsworthGivesUp(const AinsworthSeries &s, double price)
{
  return (double)(s.norms.size() - 1) >= patience * price && AinsworthForecast(s) > part * price;
}
