/*
   A right inverse of C without a factorization of S = C W C' (docs/scaling.md)

       R = W C' P + W_p C' S_p^{-1} (I - S P),     S_p = C W_p C'

   W_p is W on private unknowns and 0 on others, so that S_p has small blocks. P is a polynomial in S_p^{-1} S times
   S_p^{-1}. C R = I for each P; with P = S^{-1} R is W C' S^{-1}
*/
#ifndef AINSWORTH_POLYNOMIAL_H
#define AINSWORTH_POLYNOMIAL_H

#include "gram.h"
#include "../base/machine.h"
#include "../base/objects.h"
#include <algorithm>
#include <cmath>
#include <vector>

/* One step of the polynomial: d = momentum d + factor S_p^{-1} r, z += d, r -= S d */
struct AinsworthPolynomialStep {
  double momentum = 0.0, factor = 0.0;
};

/*
   AinsworthPolynomialExcess - returns the largest eigenvalue of C (R - W C' S^{-1})' W^{-1} (R - W C' S^{-1}) C
   relative to W^{-1} after some steps, where the eigenvalues of S_p^{-1} S are in [1, bound]: Q = I - R C makes no
   vector longer than (1 + excess)^{1/2} times in the norm of W^{-1}
*/
inline double AinsworthPolynomialExcess(double bound, int steps)
{
  const double c = bound > 1.0 ? std::sinh((2 * steps + 1) * std::asinh(1.0 / std::sqrt(bound - 1.0))) : INFINITY;

  return 1.0 / (c * c);
}

/*
   The most excess: bounds of smoothers grow by it, and iterations by half of it at most. Two cubes, the private side
   stiffer by 1, 10, 1000: the same iterations with .01, .1 and .5, four more with 2
*/
static const double AinsworthPolynomialMostExcess = 0.1;
/* The most steps: reached where private unknowns are 1e5 times as stiff as others */
static const int AinsworthPolynomialMostSteps = 300;

/* AinsworthPolynomialDegree - returns the fewest steps after which the excess is at most that, or one more than most */
inline int AinsworthPolynomialDegree(double bound, double excess)
{
  int steps = 0;

  while (steps <= AinsworthPolynomialMostSteps && AinsworthPolynomialExcess(bound, steps) > excess) steps++;
  return steps;
}

struct AinsworthGramFacts {
  double rows = 0.0, entries = 0.0; /* of S */
  double blocks  = 0.0;             /* entries of the blocks of S_p on the rank that has most of them */
  double ranks   = 1.0;             /* that have rows of S where their private unknowns are */
  double solvers = 1.0;             /* that would factor */

  AinsworthMachine machine;
};

/*
   Seconds that a row of S takes in a factorization (docs/gram.csv); and projections in the set-up and 15 iterations,
   which are half as many where Q W = W Q'
*/
static const double AinsworthSecondsPerRow = 2e-6, AinsworthProjectionsFactored = 120.0,
                    AinsworthProjectionsPolynomial = 180.0;

/* AinsworthPolynomialSeconds - predicts the time of all projections of a solve with so many steps */
inline double AinsworthPolynomialSeconds(const AinsworthGramFacts &f, int steps)
{
  const double messages = f.ranks > 1.0 ? 4.0 * (steps + 1) : 0.0; /* with a neighbor */

  return AinsworthProjectionsPolynomial *
         ((steps + 1) * (f.entries / f.ranks + f.blocks) / f.machine.rate + messages * f.machine.message);
}

/*
   AinsworthFactoredSeconds - predicts the same with a factor of S, for which all ranks wait, and its factorization

   Factors of surfaces of 1200 to 20000 rows have 2, 2.6, 3.3 and 4.8 times the entries of S (1225, 3321, 7381, 20301)
*/
inline double AinsworthFactoredSeconds(const AinsworthGramFacts &f)
{
  const double entries  = 0.75 * std::cbrt(f.rows / 70.0) * f.entries;
  const double messages = f.ranks > 1.0 ? 2.0 * std::max(1.0, f.ranks / f.solvers) : 0.0;

  return f.rows / f.solvers * AinsworthSecondsPerRow +
         AinsworthProjectionsFactored * (2.0 * entries / f.solvers / f.machine.rate + messages * f.machine.message);
}

/*
   AinsworthPolynomialCreateSteps - returns the coefficients of the polynomial whose residual q, q(0) = 1, has the least
   maximum of (s - 1)^{1/2} |q(s)| on [1, bound], a Chebyshev polynomial of the third kind
*/
inline std::vector<AinsworthPolynomialStep> AinsworthPolynomialCreateSteps(double bound, int steps)
{
  std::vector<AinsworthPolynomialStep> list;
  const double                         scale = 2.0 / (bound - 1.0), origin = -1.0 - scale;
  double                               ratio = 0.0; /* V_k / V_{k+1} at the origin; V_{-1} = V_0 stands for 2s - 1 */

  for (int k = 0; k < steps; k++) {
    const double before = ratio;

    ratio = 1.0 / (k ? 2.0 * origin - before : 2.0 * origin - 1.0);
    list.push_back({before * ratio, -2.0 * scale * ratio});
  }
  return list;
}

/* The largest block of S_p: an unknown without stiffness, such as a reference node, ties up to 100 rows (shared.cpp) */
static const PetscInt AinsworthLargestBlock = 128;

struct AinsworthPolynomial {
  AinsworthRef<Mat>                    S;            /* C W C', m x m, placed */
  AinsworthRef<Mat>                    WCt;          /* W C', placed, until MatAinsworthGetPlaced_Private() */
  AinsworthRef<Vec>                    weight;       /* W_p, n */
  PetscReal                            bound  = 1.0; /* at least the largest eigenvalue of S_p^{-1} S */
  PetscReal                            excess = 0.0; /* AinsworthPolynomialExcess() */
  std::vector<AinsworthPolynomialStep> steps;
  AinsworthRef<Vec>                    rest, direction, solution, last; /* work vectors, m, placed */
};

PetscErrorCode AinsworthPrivateWeight(Mat, Vec, Vec, Vec *);
PetscErrorCode AinsworthPolynomialBound(Mat, const AinsworthGram *, PetscReal *, PetscReal *);
PetscErrorCode AinsworthPolynomialSolve(const AinsworthPolynomial *, AinsworthGram *, Vec, Vec, Vec);
PetscErrorCode AinsworthPolynomialSolveAdjoint(const AinsworthPolynomial *, AinsworthGram *, Vec, Vec, Vec);

#endif
