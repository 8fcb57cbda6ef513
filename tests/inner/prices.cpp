/*
   Prices, and solves that are given up, replayed: of recorded solves with multigrid, none takes much longer than by the
   better choice. Needs neither MPI nor PETSc

   usage: test_prices <file of series>
*/
#include "inner/prices.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

static int checks = 0, failed = 0;

static void Check(bool ok, const char *what, double number)
{
  checks++;
  if (ok) return;
  failed++;
  printf("FAILED: %s: %g\n", what, number);
}

/* norms fall by a constant factor in each step */
static AinsworthSeries Falling(double rate, int steps)
{
  AinsworthSeries s;

  s.goal = std::pow(10.0, -8);
  for (int k = 0; k <= steps; k++) s.norms.push_back(std::pow(rate, k));
  return s;
}

static double Factor(const AinsworthPriceFacts &f)
{
  return AinsworthPriceFactorization(f, AINSWORTH_PACKAGE_CHOLMOD);
}

static void Prices()
{
  AinsworthPriceFacts one, more;

  one.entries            = 1e6;
  one.unknowns           = 2e4;
  const double iteration = AinsworthPriceIteration(one), least = Factor(one);
  Check(iteration > 0.0 && least > 10.0 * iteration, "a factorization costs more than ten iterations",
        least / iteration);
  for (double AinsworthPriceFacts::*fact : {&AinsworthPriceFacts::entries, &AinsworthPriceFacts::unknowns,
                                            &AinsworthPriceFacts::coarse, &AinsworthPriceFacts::gram}) {
    more = one;
    more.*fact += 1e5;
    Check(AinsworthPriceIteration(more) > iteration, "more entries or unknowns cost more",
          AinsworthPriceIteration(more));
  }
  more        = one;
  more.single = false;
  Check(AinsworthPriceIteration(more) > iteration, "double precision costs more", AinsworthPriceIteration(more));
  more        = one;
  more.factor = true;
  Check(AinsworthPriceIteration(more) > iteration, "an incomplete factor costs more", AinsworthPriceIteration(more));
  more.own = false;
  Check(AinsworthPriceIteration(more) > iteration, "so does another multigrid", AinsworthPriceIteration(more));
  one.operations          = 1e9;
  const double operations = Factor(one) - least;
  one.operations          = 2e9;
  Check(operations > 0.0 && std::abs(Factor(one) - least - 2.0 * operations) < 1e-9 * least, "twice the operations",
        operations);
  Check(AinsworthPriceFactorization(one, AINSWORTH_PACKAGE_MUMPS) > Factor(one), "MUMPS is slower", Factor(one));
  Check(AinsworthPriceFactorization(one, AINSWORTH_PACKAGE_OTHER) >
          AinsworthPriceFactorization(one, AINSWORTH_PACKAGE_MUMPS),
        "others are slower yet", 0.0);
}

static void Forecasts()
{
  AinsworthSeries s    = Falling(0.9, 40);
  const double    left = std::log(1e-8) / std::log(0.9) - 40.0;

  Check(std::abs(AinsworthForecast(s) - left) < 1e-9, "iterations left at a constant rate", AinsworthForecast(s));
  s.norms.back() *= 5.0; /* an oscillation */
  Check(std::abs(AinsworthForecast(s) - left) < 10.0, "iterations left after an oscillation", AinsworthForecast(s));
  Check(AinsworthForecast(Falling(1.0, 40)) == std::numeric_limits<double>::infinity(), "no progress", 0.0);
  Check(AinsworthForecast(Falling(0.5, 40)) == 0.0, "the goal is reached", AinsworthForecast(Falling(0.5, 40)));
  Check(AinsworthForecast(Falling(0.5, 0)) > 0.0, "one norm", 0.0);
  Check(!AinsworthGivesUp(Falling(1.0, 10), 100.0), "not after 10 steps for the price of 100", 0.0);
  Check(AinsworthGivesUp(Falling(1.0, 50), 100.0), "after 50 steps without progress for the price of 100", 0.0);
  Check(!AinsworthGivesUp(Falling(0.8, 50), 100.0), "not if few steps are left", 0.0);
  Check(!AinsworthGivesUp(Falling(1.0, 50), std::numeric_limits<double>::infinity()),
        "never for what does not fit in memory", 0.0);
}

/* The iterations that a solve takes, or those until it is given up and the price */
static double Replayed(const AinsworthSeries &all, double iterations, double price)
{
  AinsworthSeries s;

  s.goal = all.goal;
  for (size_t k = 0; k < all.norms.size(); k++) {
    s.norms.push_back(all.norms[k]);
    if (k && all.norms[k] > all.goal && AinsworthGivesUp(s, price)) return (double)k + price;
  }
  return iterations;
}

static void Replay(const char file[])
{
  std::ifstream in(file);
  std::string   line, name, word;
  double        worst = 0.0, sum = 0.0;
  int           series = 0, given = 0;

  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream  fields(line);
    double              number[7];
    AinsworthSeries     s;
    AinsworthPriceFacts f;

    std::getline(fields, name, ';');
    for (double &x : number) {
      std::getline(fields, word, ';');
      x = std::stod(word);
    }
    s.goal = 1.0;
    for (double decades; fields >> decades;) s.norms.push_back(std::pow(10.0, decades));
    f.entries          = number[0];
    f.unknowns         = number[1];
    f.coarse           = number[2];
    f.own              = f.coarse > 0.0;
    f.gram             = number[3];
    f.fill             = number[4];
    f.operations       = number[5];
    const double all   = number[6];
    const double price = Factor(f) / AinsworthPriceIteration(f), took = Replayed(s, all, price),
                 ratio = took / std::min(all, price);

    Check(ratio <= 1.6, name.c_str(), ratio);
    worst = std::max(worst, ratio);
    sum += ratio;
    series++;
    given += took != all;
  }
  Check(series >= 20, "series", series);
  Check(given > 3 && given < series - 3, "some are given up, others not", given);
  Check(sum <= 1.15 * series, "mean of the ratios", sum / series);
  printf("%d series, %d given up: at most %.2f times the better choice, %.2f in the mean\n", series, given, worst,
         sum / series);
}

int main(int argc, char **argv)
{
  if (argc != 2) return 2;
  Prices();
  Forecasts();
  Replay(argv[1]);
  printf("%d checks, %d failed\n", checks, failed);
  return failed > 0;
}
