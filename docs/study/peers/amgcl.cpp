/*
   A x = f of files in PETSc's binary format by AMGCL, smoothed aggregation with given modes, conjugate gradients, to an
   error in the energy norm; prints one JSON line for each variant of its documented options

       amgcl A.dat f.dat modes.dat x.dat [columns of modes] [error]

   With the headers of AMGCL 1.4.8 (libamgcl-dev in Debian's unstable) and of Boost:

       g++ -O3 -march=native -DNDEBUG -std=c++17 -I <headers> docs/study/peers/amgcl.cpp -o amgcl
*/
#include "problem.h"
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

namespace
{
/* Sets up and solves with a type of solver; K: A in its types */
template <class Solver, class Operator, class Solve>
void run(const Problem &p, const char *name, double strong, const Operator &K, Solve apply)
{
  typename Solver::params options;
  char                    variant[80];
  Doubles                 modes(p.modes.size()); /* by rows */
  const size_t            n = (size_t)p.A.n, columns = (size_t)p.columns;

  for (size_t k = 0; k < columns; k++)
    for (size_t i = 0; i < n; i++) modes[i * columns + k] = p.modes[k * n + i];
  options.precond.coarsening.aggr.eps_strong = (float)strong;
  options.precond.coarsening.aggr.block_size = 3;
  options.precond.coarsening.nullspace.cols  = p.columns;
  options.precond.coarsening.nullspace.B     = modes;
  options.solver.maxiter                     = 500;
  snprintf(variant, sizeof(variant), "%s, eps_strong %g", name, strong);
  measure(p, variant, [&](Doubles &x, double tolerance, double *ready) {
    options.solver.tol = tolerance;
    Solver solver(K, options);

    *ready = now();
    return (size_t)apply(solver, x);
  });
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

  run<Solver>(p, name, strong, K, [&](Solver &solver, Doubles &x) { return std::get<0>(solver(K, p.f, x)); });
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

  run<Solver>(p, name, strong, K, [&](Solver &solver, Doubles &x) {
    const auto b = amgcl::backend::reinterpret_as_rhs<Block>(p.f);
    auto       y = amgcl::backend::reinterpret_as_rhs<Block>(x);

    return std::get<0>(solver(K, b, y));
  });
}
} // namespace

int main(int argc, char **argv)
{
  const Problem p = readProblem(argc, argv);

  /* those that are often the quickest first, as slower ones are then left early */
  for (double strong : {0.0, 0.08}) {
    blocks<amgcl::relaxation::ilu0>(p, "blocks, ILU(0)", strong);
    blocks<amgcl::relaxation::gauss_seidel>(p, "blocks, Gauss-Seidel", strong);
    blocks<amgcl::relaxation::spai0>(p, "blocks, SPAI(0)", strong);
    scalar<amgcl::relaxation::gauss_seidel>(p, "scalar, Gauss-Seidel", strong);
  }
  return 0;
}
