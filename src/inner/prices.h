/* Prices of solvers in products with A, and when one is given up for another. No clock decides: all runs and ranks choose alike. Plain C++, without MPI and PETSc */
#ifndef AINSWORTH_PRICES_H
#define AINSWORTH_PRICES_H

#include <vector>

/* What factors M_* */
typedef enum {
  AINSWORTH_PACKAGE_CHOLMOD,
  AINSWORTH_PACKAGE_MUMPS,
  AINSWORTH_PACKAGE_OTHER
} AinsworthPackage;

double AinsworthPriceIteration(double complexity);
double AinsworthPriceFactorization(double operations, double entries, AinsworthPackage);

/* A solve that may be given up: its residual norms, from the first one on, and the one that ends it */
struct AinsworthSeries {
  std::vector<double> norms;
  double              goal = 0.0;
};

double AinsworthForecast(const AinsworthSeries &);
bool   AinsworthMayGiveUp(const AinsworthSeries &, double price);
bool   AinsworthGivesUp(const AinsworthSeries &, double price);

#endif
