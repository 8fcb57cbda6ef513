/*
   A x = f of two files in PETSc's binary format by AMGCL, smoothed aggregation with given modes, conjugate gradients;
   prints one JSON line for each variant of its documented options

       amgcl A.dat f.dat modes.dat [columns of modes] [tolerance]

   With the headers of AMGCL 1.4.8 (libamgcl-dev in Debian's testing) and of Boost:

       g++ -O3 -march=native -DNDEBUG -std=c++17 -I <headers> docs/study/peers/amgcl.cpp -o amgcl
*/
#include "petscfile.h"
#include <algorithm>
#include <amgcl/adapter/block_matrix.hpp>
#include <amgcl/adapter/crs_tuple.hpp>
#include <amgcl/amg.hpp>
#include <amgcl/backend/builtin.hpp>
#include <amgcl/coarsening/as_scalar.hpp>
#include <amgcl/coarsening/smoothed_aggregation.hpp>
#include <amgcl/make_solver.hpp>
#include <amgcl/relaxation/gauss_seidel.hpp>
#include <amgcl/relaxation/ilu0.hpp>
#include <amgcl/relaxation/spai0.hpp>
#include <amgcl/solver/cg.hpp>
#include <amgcl/value_type/static_matrix.hpp>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace
{
typedef std::vector<double> Doubles;

/* The vectors of a file, one after the other */
Doubles readVectors(const char *name, size_t vectors)
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

double now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Problem {
  Matrix  A;
  Doubles f, modes; /* by rows */
  int     columns;
  double  tolerance;
};

double residual(const Problem &p, const Doubles &x)
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

/* The quickest of several set-ups and solves, as memory that is used again is quicker; K: A in the types of Solver */
template <class Solver, class Operator, class Solve>
void measure(const Problem &p, const char *name, double strong, const Operator &K, Solve apply)
{
  typename Solver::params options;
  static double           best       = 1e30; /* of all variants */
  double                  least[2]   = {1e30, 0.0};
  size_t                  iterations = 0;
  Doubles                 x;

  options.precond.coarsening.aggr.eps_strong = (float)strong;
  options.precond.coarsening.aggr.block_size = 3;
  options.precond.coarsening.nullspace.cols  = p.columns;
  options.precond.coarsening.nullspace.B     = p.modes;
  options.solver.tol                         = p.tolerance;
  options.solver.maxiter                     = 500;
  for (int repeat = 0; repeat < 3; repeat++) {
    const double start = now();
    Solver       solver(K, options);
    const double ready = now();

    x.assign((size_t)p.A.n, 0.0);
    iterations       = apply(solver, x);
    const double end = now();
    if (end - start < least[0] + least[1]) {
      least[0] = ready - start;
      least[1] = end - ready;
    }
    best = std::min(best, end - start);
    if (end - start > 2 * best) break; /* it will not be the quickest */
  }
  printf(
    "{\"variant\": \"%s, eps_strong %g\", \"iterations\": %zu, \"setup\": %.4f, \"solve\": %.4f, \"residual\": %.2e}\n",
    name, strong, iterations, least[0], least[1], residual(p, x));
  fflush(stdout);
}

typedef amgcl::static_matrix<double, 3, 3> Block;
typedef amgcl::static_matrix<float, 3, 3>  SingleBlock;

template <template <class> class Relaxation>
void scalar(const Problem &p, const char *name, double strong)
{
  typedef amgcl::make_solver<
    amgcl::amg<amgcl::backend::builtin<float>, amgcl::coarsening::smoothed_aggregation, Relaxation>,
    amgcl::solver::cg<amgcl::backend::builtin<double>>>
    Solver;
  const auto K = std::tie(p.A.n, p.A.ptr, p.A.col, p.A.val);

  measure<Solver>(p, name, strong, K, [&](Solver &solver, Doubles &x) { return std::get<0>(solver(K, p.f, x)); });
}

template <template <class> class Relaxation>
void blocks(const Problem &p, const char *name, double strong)
{
  typedef amgcl::make_solver<
    amgcl::amg<amgcl::backend::builtin<SingleBlock>,
               amgcl::coarsening::as_scalar<amgcl::coarsening::smoothed_aggregation>::type, Relaxation>,
    amgcl::solver::cg<amgcl::backend::builtin<Block>>>
    Solver;
  const auto whole = std::tie(p.A.n, p.A.ptr, p.A.col, p.A.val);
  const auto K     = amgcl::adapter::block_matrix<Block>(whole);

  measure<Solver>(p, name, strong, K, [&](Solver &solver, Doubles &x) {
    const auto b = amgcl::backend::reinterpret_as_rhs<Block>(p.f);
    auto       y = amgcl::backend::reinterpret_as_rhs<Block>(x);

    return std::get<0>(solver(K, b, y));
  });
}
} // namespace

int main(int argc, char **argv)
{
  if (argc < 4) {
    fprintf(stderr, "amgcl A.dat f.dat modes.dat [columns of modes] [tolerance]\n");
    return 2;
  }
  Problem      p = {Matrix(argv[1]), readVectors(argv[2], 1), {}, argc > 4 ? atoi(argv[4]) : 6,
                    argc > 5 ? atof(argv[5]) : 1e-8};
  const auto   modes = readVectors(argv[3], (size_t)p.columns);
  const size_t n = (size_t)p.A.n, columns = (size_t)p.columns;

  p.modes.resize(modes.size());
  for (size_t k = 0; k < columns; k++)
    for (size_t i = 0; i < n; i++) p.modes[i * columns + k] = modes[k * n + i];
  for (double strong : {0.08, 0.0}) {
    scalar<amgcl::relaxation::gauss_seidel>(p, "scalar, Gauss-Seidel", strong);
    blocks<amgcl::relaxation::gauss_seidel>(p, "blocks, Gauss-Seidel", strong);
    blocks<amgcl::relaxation::spai0>(p, "blocks, SPAI(0)", strong);
    blocks<amgcl::relaxation::ilu0>(p, "blocks, ILU(0)", strong);
  }
  return 0;
}
