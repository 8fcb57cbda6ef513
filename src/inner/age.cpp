#include "age.h"
#include <algorithm>
#include <cmath>

/*
   A solve with an old preconditioner ends after this many times the iterations of the first solve, plus those of a
   set-up
*/
static const double growth = 1.3;

AinsworthAge::AinsworthAge()
{
  std::fill(took, took + decades, -1);
}

/*
   AinsworthAgeDecades - returns the requested reduction in decades: solves are compared with those of about the same
   tolerance
*/
int AinsworthAgeDecades(double rtol)
{
  const double wanted = rtol > 0.0 ? 0.5 - std::log10(rtol) : AinsworthAge::decades;

  return std::min(std::max((int)wanted, 1), AinsworthAge::decades - 1);
}

/*
   AinsworthAgeFirst - returns the iterations of the first solve for so many decades, scaled from the nearest number of
   decades; negative before it
*/
double AinsworthAgeFirst(const AinsworthAge &age, int decades)
{
  for (int k = 0; k < AinsworthAge::decades; k++) {
    for (int d : {decades - k, decades + k})
      if (d > 0 && d < AinsworthAge::decades && age.took[d] >= 0) return (double)age.took[d] * decades / d;
  }
  return -1.0;
}

/*
   AinsworthAgeCount - counts the iterations of a solve that converged; old: its preconditioner is that of an earlier
   matrix, in whole or in part
*/
void AinsworthAgeCount(AinsworthAge *age, int iterations, int decades, bool old)
{
  const double first = AinsworthAgeFirst(*age, decades);

  age->last = iterations;
  if (age->took[decades] < 0 && (!old || first < 0.0)) age->took[decades] = iterations;
  else if (old) {
    age->extra = std::max(0.0, iterations - first);
    age->more += age->extra;
    age->solves++;
  }
}

/*
   AinsworthAgeKeeps - tells before a set-up, whose price is given in iterations, whether the preconditioner is kept

   By replacement theory, it is kept until the next solve would cost more than the mean so far, including the set-up.
   The extra iterations of the next solve are extrapolated as if they grew in equal steps.
*/
bool AinsworthAgeKeeps(const AinsworthAge &age, double price)
{
  const double next = age.solves ? age.extra * (age.solves + 1) / age.solves : 0.0;

  return next <= (price + age.more) / (age.solves + 1);
}

/*
   AinsworthAgeLimit - returns the iterations after which an old preconditioner is rebuilt, and the solve begun again
*/
double AinsworthAgeLimit(const AinsworthAge &age, int decades, double price)
{
  return growth * AinsworthAgeFirst(age, decades) + price;
}
