/*
   Prices of solvers, and when one is given up for another. No clock decides: all runs and ranks choose alike. Plain
   C++, without MPI and PETSc
*/
#ifndef AINSWORTH_PRICES_H
#define AINSWORTH_PRICES_H

#include <vector>

/* What factors M_* */
typedef enum {
  AINSWORTH_PACKAGE_CHOLMOD,
  AINSWORTH_PACKAGE_MUMPS,
  AINSWORTH_PACKAGE_OTHER
} AinsworthPackage;

/* What prices depend on; of all ranks together */
struct AinsworthPriceFacts {
  double entries  = 0.0; /* of A */
  double unknowns = 0.0; /* of A */
  double coarse   = 0.0; /* entries of the first coarser level */
  /* entries of the factors of S: of the rank that has the most, times the number of ranks, as the others wait for it */
  double gram   = 0.0;
  bool   single = true;  /* the finest level is in single precision */
  bool   factor = false; /* and an incomplete factor smooths it */
  bool   own    = true;  /* the levels are those of PCBLOCKSA; of other multigrids only A is known */
  /*
     entries of a factor of M_*, infinite if it has no room; at least those of half of A, as long as it is not predicted
  */
  double fill       = 0.0;
  double operations = 0.0; /* of that factorization */
};

/* What is set up anew */
typedef enum {
  AINSWORTH_SETUP_MULTIGRID,
  AINSWORTH_SETUP_BOOMERAMG,
  AINSWORTH_SETUP_FACTOR
} AinsworthSetUpKind;

double AinsworthPriceSetUp(AinsworthSetUpKind, double columns);
double AinsworthPriceIteration(const AinsworthPriceFacts &);
double AinsworthPriceFactorization(const AinsworthPriceFacts &, AinsworthPackage);

/* A solve that may be given up: its residual norms, from the first one on, and the one that ends it */
struct AinsworthSeries {
  std::vector<double> norms;
  double              goal = 0.0;
};

double AinsworthForecast(const AinsworthSeries &);
bool   AinsworthGivesUp(const AinsworthSeries &, double price);

#endif
