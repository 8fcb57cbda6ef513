/* A x = f with near null space, from files, for peers without constraints */
#include "petscfile.h"
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <fstream>
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
  Doubles f, modes; /* modes: one after the other */
  int     columns;
  double  tolerance;
};

/* Arguments: A.dat f.dat modes.dat [columns of modes] [tolerance] */
static Problem readProblem(int argc, char **argv)
{
  if (argc < 4) {
    fprintf(stderr, "%s A.dat f.dat modes.dat [columns of modes] [tolerance]\n", argv[0]);
    exit(2);
  }
  const int columns = argc > 4 ? atoi(argv[4]) : 6;

  return {Matrix(argv[1]), readVectors(argv[2], 1), readVectors(argv[3], (size_t)columns), columns,
          argc > 5 ? atof(argv[5]) : 1e-8};
}

static double residual(const Problem &p, const Doubles &x)
{
  double r = 0.0, f = 0.0;

  for (ptrdiff_t i = 0; i < p.A.n; i++) {
    double sum = p.f[(size_t)i];

    for (ptrdiff_t k = p.A.ptr[(size_t)i]; k < p.A.ptr[(size_t)i + 1]; k++)
      sum -= p.A.val[(size_t)k] * x[(size_t)p.A.col[(size_t)k]];
    r += sum * sum;
    f += p.f[(size_t)i] * p.f[(size_t)i];
  }
  return std::sqrt(r / f);
}

static double now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

static double best = 1e30; /* seconds of the quickest variant so far */

/*
   Prints the quickest of three set-ups and solves as one JSON line, as memory that is used again is quicker

   attempt: sets up and solves, sets the time between these, and returns the iterations
*/
template <class Attempt>
static void measure(const Problem &p, const std::string &variant, Attempt attempt)
{
  double  least[2]   = {1e30, 0.0};
  size_t  iterations = 0;
  Doubles x;

  for (int repeat = 0; repeat < 3; repeat++) {
    const double start = now();
    double       ready = start;

    x.assign((size_t)p.A.n, 0.0);
    iterations       = attempt(x, &ready);
    const double end = now();
    if (end - start < least[0] + least[1]) {
      least[0] = ready - start;
      least[1] = end - ready;
    }
    best = std::min(best, end - start);
    if (end - start > 2 * best) break; /* it will not be the quickest */
  }
  printf("{\"variant\": \"%s\", \"iterations\": %zu, \"setup\": %.4f, \"solve\": %.4f, \"residual\": %.2e}\n",
         variant.c_str(), iterations, least[0], least[1], residual(p, x));
  fflush(stdout);
}
