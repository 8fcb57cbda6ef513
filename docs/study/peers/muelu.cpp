/*
   A x = f of files in PETSc's binary format by MueLu, smoothed aggregation with given modes, conjugate gradients, to an
   error in the energy norm; prints one JSON line for each variant of its documented options

       muelu A.dat f.dat modes.dat x.dat [columns of modes] [error]

   With Debian's libtrilinos-muelu-dev:

       mpicxx -O3 -march=native -DNDEBUG -std=c++17 -w -I /usr/include/trilinos docs/study/peers/muelu.cpp -o muelu
           -Wl,--copy-dt-needed-entries -ltrilinos_muelu-interface -ltrilinos_muelu -ltrilinos_belostpetra

   Trilinos 16 needs -std=c++20, -I /usr/include/kokkos and -lkokkoscore, and its -ltrilinos_muelu-interface is
   -ltrilinos_muelu-adapters.
*/
#include "problem.h"
#include <BelosPseudoBlockCGSolMgr.hpp>
#include <BelosTpetraAdapter.hpp>
#include <MueLu_CreateTpetraPreconditioner.hpp>
#include <Tpetra_Core.hpp>
#include <Tpetra_CrsMatrix.hpp>

namespace
{
typedef Tpetra::CrsMatrix<>   Crs;
typedef Tpetra::Map<>         Map;
typedef Tpetra::MultiVector<> Vectors;
typedef Tpetra::Operator<>    Operator;

Teuchos::RCP<Crs> createMatrix(const Matrix &A, const Teuchos::RCP<const Map> &map)
{
  const size_t                               entries = A.val.size();
  Teuchos::ArrayRCP<size_t>                  rows((size_t)A.n + 1);
  Teuchos::ArrayRCP<Map::local_ordinal_type> columns(entries);
  Teuchos::ArrayRCP<double>                  values(entries);

  std::copy(A.ptr.begin(), A.ptr.end(), rows.begin());
  std::copy(A.col.begin(), A.col.end(), columns.begin());
  std::copy(A.val.begin(), A.val.end(), values.begin());
  const auto K = Teuchos::rcp(new Crs(map, map, rows, columns, values));
  K->expertStaticFillComplete(map, map);
  return K;
}

Teuchos::RCP<Vectors> createVectors(const Doubles &v, const Teuchos::RCP<const Map> &map, size_t columns)
{
  return Teuchos::rcp(new Vectors(map, Teuchos::ArrayView<const double>(v), v.size() / columns, columns));
}

/* The options of a variant: a smoother of each level, and a threshold for weak couplings */
Teuchos::ParameterList options(const std::string &smoother, double drop)
{
  Teuchos::ParameterList list;

  list.set("verbosity", "none");
  list.set("number of equations", 3);
  list.set("multigrid algorithm", "sa");
  list.set("aggregation: drop tol", drop);
  Teuchos::ParameterList &smooth = list.sublist("smoother: params");
  if (smoother == "symmetric Gauss-Seidel") {
    list.set("smoother: type", "RELAXATION");
    smooth.set("relaxation: type", "Symmetric Gauss-Seidel");
    smooth.set("relaxation: sweeps", 1);
    smooth.set("relaxation: damping factor", 1.0);
  } else if (smoother == "Jacobi") {
    list.set("smoother: type", "RELAXATION");
    smooth.set("relaxation: type", "Jacobi");
    smooth.set("relaxation: sweeps", 1);
    smooth.set("relaxation: damping factor", 0.6);
  } else {
    list.set("smoother: type", "CHEBYSHEV");
    smooth.set("chebyshev: degree", smoother == "Chebyshev of degree 2" ? 2 : 3);
    smooth.set("chebyshev: eigenvalue max iterations", 40); /* after the usual 10 some cycles are indefinite */
  }
  return list;
}

void run(const Problem &p, const Teuchos::RCP<Crs> &K, const std::string &smoother, double drop)
{
  const auto map   = K->getRowMap();
  const auto b     = createVectors(p.f, map, 1);
  const auto modes = createVectors(p.modes, map, (size_t)p.columns);
  char       variant[80];

  snprintf(variant, sizeof(variant), "%s, drop tol %g", smoother.c_str(), drop);
  measure(p, variant, [&](Doubles &x, double tolerance, double *ready) {
    typedef Belos::LinearProblem<double, Vectors, Operator> Linear;
    Teuchos::ParameterList                                  list = options(smoother, drop);

    list.sublist("user data").set("Nullspace", modes);
    const Teuchos::RCP<Operator> A = K;
    const auto                   M = MueLu::CreateTpetraPreconditioner(A, list);
    *ready                         = now();
    const auto y                   = Teuchos::rcp(new Vectors(map, 1));
    const auto linear              = Teuchos::rcp(new Linear(A, y, b));
    const auto belos               = Teuchos::rcp(new Teuchos::ParameterList);
    linear->setLeftPrec(M);
    linear->setProblem();
    belos->set("Convergence Tolerance", tolerance);
    belos->set("Maximum Iterations", 500);
    belos->set("Verbosity", (int)Belos::Errors);
    Belos::PseudoBlockCGSolMgr<double, Vectors, Operator> solver(linear, belos);
    solver.solve();
    const auto values = y->getData(0);
    std::copy(values.begin(), values.end(), x.begin());
    return (size_t)solver.getNumIters();
  });
}
} // namespace

int main(int argc, char **argv)
{
  const Problem      p = readProblem(argc, argv);
  Tpetra::ScopeGuard scope(&argc, &argv);
  const auto         comm = Tpetra::getDefaultComm();
  const auto         map  = Teuchos::rcp(new Map((Tpetra::global_size_t)p.A.n, 0, comm));
  const auto         K    = createMatrix(p.A, map);

  for (double drop : {0.0, 0.02})
    for (const char *smoother : {"symmetric Gauss-Seidel", "Chebyshev of degree 2", "Chebyshev of degree 3", "Jacobi"})
      try {
        run(p, K, smoother, drop);
      } catch (const Belos::BelosError &error) { /* the preconditioner is not positive definite */
        fprintf(stderr, "%s, drop tol %g: %s\n", smoother, drop, error.what());
      }
  return 0;
}
