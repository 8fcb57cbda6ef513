/* A x = f with near null space and exact x, from files, for peers without constraints */
#include "petscfile.h"
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <string>

typedef std::vector<double> Doubles;

/* The vectors of a file, one after the other */
static Doubles readVectors(const char *name, size_t vectors)
{
  std::ifstream in(name, std::ios::binary);
  Doubles       all;

  for (size_t k = 0; k < vectors; k++) {
    const auto header = read<int32_t>(in, 2);

    if (header[0] != VECTOR) throw std::runtime_error(std::string(name) + " holds no vector");
    const Doubles values = read<double>(in, (size_t)header[1]);
    all.insert(all.end(), values.begin(), values.end());
  }
  return all;
}

struct Matrix {
  ptrdiff_t              n = 0;
  std::vector<ptrdiff_t> ptr, col;
  Doubles                val;

  explicit Matrix(const char *name)
  {
    std::ifstream in(name, std::ios::binary);
    const auto    header = read<int32_t>(in, 4);

    if (header[0] != MATRIX) throw std::runtime_error(std::string(name) + " holds no matrix");
    n = header[1];
    ptr.push_back(0);
    for (int32_t row : read<int32_t>(in, (size_t)n)) ptr.push_back(ptr.back() + row);
    const auto columns = read<int32_t>(in, (size_t)header[3]);
    col.assign(columns.begin(), columns.end());
    val = read<double>(in, (size_t)header[3]);
  }
};

struct Problem {
  Matrix  A;
  Doubles f, exact, modes; /* modes: one after the other */
  int     columns;
  double  most; /* error in the energy norm, relative to the exact x */
};

/* Arguments: A.dat f.dat modes.dat x.dat [columns of modes] [error] */
static Problem readProblem(int argc, char **argv)
{
  if (argc < 5) {
    fprintf(stderr, "%s A.dat f.dat modes.dat x.dat [columns of modes] [error]\n", argv[0]);
    exit(2);
  }
  const int columns = argc > 5 ? atoi(argv[5]) : 6;

  return {
    Matrix(argv[1]), readVectors(argv[2], 1),        readVectors(argv[4], 1), readVectors(argv[3], (size_t)columns),
    columns,         argc > 6 ? atof(argv[6]) : 1e-8};
}

/* A x */
static Doubles product(const Matrix &A, const Doubles &x)
{
  Doubles y((size_t)A.n);

  for (ptrdiff_t i = 0; i < A.n; i++)
    for (ptrdiff_t k = A.ptr[(size_t)i]; k < A.ptr[(size_t)i + 1]; k++)
      y[(size_t)i] += A.val[(size_t)k] * x[(size_t)A.col[(size_t)k]];
  return y;
}

static double dot(const Doubles &x, const Doubles &y)
{
  return std::inner_product(x.begin(), x.end(), y.begin(), 0.0);
}

static Doubles difference(Doubles x, const Doubles &y)
{
  for (size_t i = 0; i < x.size(); i++) x[i] -= y[i];
  return x;
}

static double residual(const Problem &p, const Doubles &x)
{
  const Doubles r = difference(product(p.A, x), p.f);

  return std::sqrt(dot(r, r) / dot(p.f, p.f));
}

static double energyError(const Problem &p, const Doubles &x)
{
  const Doubles e = difference(x, p.exact);

  return std::sqrt(dot(e, product(p.A, e)) / dot(p.exact, product(p.A, p.exact)));
}

static double now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/* A set-up and a solve */
struct Run {
  Doubles x;
  size_t  iterations = 0;
  double  setup = 0.0, solve = 0.0;

  double seconds() const { return setup + solve; }
};

/*
   Runs a variant, and prints the quickest of three set-ups and solves as one JSON line, as memory that is used again is
   quicker. They stop at the residual at which the error is at most the one asked for: first solves look for it from
   above, so that no variant takes more iterations than it must.

   attempt: sets up and solves from zero to a tolerance of the residual relative to f, sets the time between these, and
   returns the iterations
*/
template <class Attempt>
static void measure(const Problem &p, const std::string &variant, Attempt attempt)
{
  static double best = 1e30; /* seconds of the quickest variant so far */
  const auto    once = [&](double tolerance) {
    Run          run;
    const double start = now();
    double       ready = start;

    run.x.assign((size_t)p.A.n, 0.0);
    run.iterations = attempt(run.x, tolerance, &ready);
    run.solve      = now() - ready;
    run.setup      = ready - start;
    return run;
  };
  double tolerance = 1e-5;
  Run    least     = once(tolerance);
  double error     = energyError(p, least.x);

  const auto slow = [&] { return least.seconds() >= 2 * best; }; /* it will not be the quickest */

  while (error > p.most && !slow()) {
    tolerance *= std::max(0.7 * p.most / error, 1e-3);
    const Run    next    = once(tolerance);
    const double reached = energyError(p, next.x);

    if (!(reached < error)) break; /* it cannot do better */
    least = next;
    error = reached;
  }
  for (int k = 0; k < 3 && error <= p.most && !slow(); k++) {
    const Run again = once(tolerance);

    if (again.seconds() < least.seconds()) least = again;
  }
  if (error <= p.most) best = std::min(best, least.seconds());
  printf("{\"variant\": \"%s\", \"iterations\": %zu, \"setup\": %.4f, \"solve\": %.4f, \"residual\": %.2e, "
         "\"error\": %.2e}\n",
         variant.c_str(), least.iterations, least.setup, least.solve, residual(p, least.x), error);
  fflush(stdout);
}
