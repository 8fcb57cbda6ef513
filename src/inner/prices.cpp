#include "prices.h"
#include <algorithm>
#include <cmath>
#include <limits>

/*
   Orderings, copies and solves of a factorization take as long as so many products with A; while a product handles one entry, a package does so many operations.
   Measured with matrices of 3 000 to 150 000 unknowns (docs/models.md); between half and twice as many operations few choices differ
*/
static const double overhead = 320.0, operationsOf[] = {60.0, 30.0, 3.0};
/*
   A solve is watched in vain for this part of the price, because forecasts of its first steps mislead: the residual stays where it is until conjugate gradients
   have found the bending of a body. The price of waiting is at most this part; of 63 series none is given up in vain or kept for more than 1.3 times the better
   choice, with .1 six, with .5 ten (docs/models.md)
*/
static const double patience = 0.28;

/* AinsworthPriceIteration - returns the price of an iteration: a product, and a cycle that visits levels with so many times the entries of A */
double AinsworthPriceIteration(double complexity)
{
  return 1.0 + complexity;
}

/* AinsworthPriceFactorization - returns the price of a factorization of so many operations, where A has so many entries; on several ranks both are shared out */
double AinsworthPriceFactorization(double operations, double entries, AinsworthPackage package)
{
  return overhead + operations / (operationsOf[package] * std::max(entries, 1.0));
}

/*
   AinsworthForecast - forecasts the iterations until the norm reaches the goal, at the faster of the rates of the last half and of the last quarter of the steps

   The rate of all steps misleads, because multigrid first removes what it is good at. Norms oscillate with long rows: the least so far counts
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

/* AinsworthMayGiveUp - tells whether the solve has been watched long enough for this price, in iterations, which may be a lower bound */
bool AinsworthMayGiveUp(const AinsworthSeries &s, double price)
{
  return (double)(s.norms.size() - 1) >= patience * price;
}

/* AinsworthGivesUp - tells whether the rest of the solve would take longer than another solver, whose price is given in iterations */
bool AinsworthGivesUp(const AinsworthSeries &s, double price)
{
  return AinsworthMayGiveUp(s, price) && AinsworthForecast(s) > price;
}
