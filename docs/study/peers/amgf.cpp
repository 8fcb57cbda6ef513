/*
   [A C'; C -D] [x; l] = [f; g] by AMGF, the AMG with filtering of MFEM: conjugate gradients for the condensed system
   (A + C' D^-1 C) x = f + C' D^-1 g, preconditioned with BoomerAMG, an exact solve in the unknowns that C touches (the
   filter), and BoomerAMG once more; prints one JSON line for each variant of BoomerAMG

       amgf A.dat C.dat D.dat f.dat g.dat modes.dat [tolerance] [file for the solutions x]

   The files have PETSc's binary format. D: a diagonal matrix without zeros. modes.dat: six rigid-body modes, the
   rotations last. The solutions get zeros at the end where the unknowns are no multiple of three. The set-up includes
   the condensed matrix. residual: that of the condensed system, relative to its right-hand side; primal: the same,
   relative to f; contact: |C x - D l - g| / (|g| + |C x|), which is rounding alone, as l = D^-1 (C x - g).

   With MFEM 4.9 and hypre, whose options and classes are those of MFEM's miniapps/contact, and CHOLMOD in the place of
   the miniapp's MUMPS, which Debian's MFEM lacks (Debian's unstable: libmfem-dev, libhypre-dev, libsuitesparse-dev):

       mpicxx -O3 -march=native -DNDEBUG -std=c++17 -isystem /usr/include/hypre -isystem /usr/include/suitesparse \
         docs/study/peers/amgf.cpp -o amgf -lmfem -lHYPRE -lcholmod

   It runs on one rank; OPENBLAS_NUM_THREADS=1 keeps the exact solves to one thread, too.
*/
#include "petscfile.h"
#include <algorithm>
#include <chrono>
#include <cholmod.h>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <list>
#include <memory>
#include <mfem.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using mfem::HypreParMatrix, mfem::SparseMatrix, mfem::Vector;

template <class T>
void write(std::ostream &out, T value)
{
  std::reverse((char *)&value, (char *)(&value + 1));
  out.write((const char *)&value, sizeof(T));
}

/*
   BoomerAMG for systems wants whole nodes, and extra unknowns may come one by one: all lengths are multiples of three
*/
int whole(int n)
{
  return (n + 2) / 3 * 3;
}

/* The next vector of a file */
Vector readVector(std::istream &in)
{
  const auto header = read<int32_t>(in, 2);

  if (header[0] != VECTOR) throw std::runtime_error("a file holds no vector");
  const auto values = read<double>(in, (size_t)header[1]);
  Vector     v(whole(header[1]));

  v = 0.0;
  std::copy(values.begin(), values.end(), v.begin());
  return v;
}

Vector readVector(const char *name)
{
  std::ifstream in(name, std::ios::binary);

  return readVector(in);
}

/* A square one gets all of its diagonal, as hypre wants it, and that of the identity in added rows */
SparseMatrix readMatrix(const char *name)
{
  std::ifstream in(name, std::ios::binary);
  const auto    header = read<int32_t>(in, 4);

  if (header[0] != MATRIX) throw std::runtime_error(std::string(name) + " holds no matrix");
  const bool   square  = header[1] == header[2];
  const auto   lengths = read<int32_t>(in, (size_t)header[1]);
  const auto   columns = read<int32_t>(in, (size_t)header[3]);
  const auto   values  = read<double>(in, (size_t)header[3]);
  SparseMatrix M(whole(header[1]), whole(header[2]));
  size_t       k = 0;

  for (int i = 0; i < M.Height(); i++) {
    if (square) M.Add(i, i, i < header[1] ? 0.0 : 1.0);
    if (i >= header[1]) continue;
    for (const size_t end = k + (size_t)lengths[(size_t)i]; k < end; k++) M.Add(i, columns[k], values[k]);
  }
  M.Finalize(0); /* keeps the zeros */
  return M;
}

double now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/* Of rows that are all on this rank */
std::unique_ptr<HypreParMatrix> parallel(SparseMatrix &M)
{
  HYPRE_BigInt rows[2] = {0, M.Height()}, columns[2] = {0, M.Width()};

  if (M.Height() == M.Width()) return std::make_unique<HypreParMatrix>(MPI_COMM_WORLD, M.Height(), rows, &M);
  return std::make_unique<HypreParMatrix>(MPI_COMM_WORLD, M.Height(), M.Width(), rows, columns, &M);
}

struct Problem {
  SparseMatrix        A, C, D, springs, filter; /* springs: D^-1; filter: unknowns of the subspace to all unknowns */
  Vector              d, f, g, b;               /* b: f + C' D^-1 g */
  std::vector<Vector> rotations;
  double              tolerance;

  Problem(char **files, double tolerance_)
    : A(readMatrix(files[0])), C(readMatrix(files[1])), D(readMatrix(files[2])), springs(D.Height(), D.Height()),
      f(readVector(files[3])), g(readVector(files[4])), tolerance(tolerance_)
  {
    std::ifstream modes(files[5], std::ios::binary);

    for (int k = 0; k < 6; k++) {
      const Vector mode = readVector(modes);

      if (k >= 3) rotations.push_back(mode);
    }
    if (f.Size() != A.Height() || C.Width() != A.Height() || g.Size() != C.Height() || D.Height() != C.Height() ||
        rotations[0].Size() != A.Height()) {
      throw std::runtime_error("the sizes of the files differ");
    }
    D.GetDiag(d);
    if (D.NumNonZeroElems() > D.Height()) throw std::runtime_error("D is not diagonal");
    for (int i = 0; i < d.Size(); i++) {
      if (d(i) == 0.0) throw std::runtime_error("D has a zero: there is no condensed system");
      springs.Add(i, i, 1 / d(i));
    }
    springs.Finalize();

    std::vector<bool> touched((size_t)C.Width());

    for (int k = 0; k < C.NumNonZeroElems(); k++) touched[(size_t)C.GetJ()[k]] = true;
    filter = SparseMatrix(C.Width(), (int)std::count(touched.begin(), touched.end(), true));
    for (int i = 0, k = 0; i < C.Width(); i++) {
      if (touched[(size_t)i]) filter.Add(i, k++, 1.0);
    }
    filter.Finalize();

    Vector scaled(g);

    scaled /= d;
    b = f;
    C.AddMultTranspose(scaled, b);
  }
};

/* MFEM takes any solver for the subspace */
class Cholesky : public mfem::Solver {
public:
  Cholesky() { cholmod_start(&common); }
  ~Cholesky() override
  {
    cholmod_free_factor(&L, &common);
    cholmod_finish(&common);
  }
  Cholesky(const Cholesky &)            = delete;
  Cholesky &operator=(const Cholesky &) = delete;

  void SetOperator(const mfem::Operator &K) override
  {
    SparseMatrix   rows;
    cholmod_sparse A = {};

    dynamic_cast<const HypreParMatrix &>(K).GetDiag(rows);
    height = width = rows.Height();
    A.nrow = A.ncol = (size_t)height;
    A.nzmax         = (size_t)rows.NumNonZeroElems();
    A.p             = rows.GetI();
    A.i             = rows.GetJ();
    A.x             = rows.GetData();
    A.stype         = 1; /* symmetric: one triangle is read, and rows are columns */
    A.itype         = CHOLMOD_INT;
    A.xtype         = CHOLMOD_REAL;
    A.dtype         = CHOLMOD_DOUBLE;
    A.packed        = 1;
    cholmod_free_factor(&L, &common);
    L = cholmod_analyze(&A, &common);
    if (!cholmod_factorize(&A, L, &common) || common.status != CHOLMOD_OK) throw std::runtime_error("no factor");
  }

  void Mult(const Vector &b, Vector &x) const override
  {
    cholmod_dense B = {};

    B.nrow = B.d = B.nzmax = (size_t)height;
    B.ncol                 = 1;
    B.x                    = const_cast<double *>(b.GetData());
    B.xtype                = CHOLMOD_REAL;
    B.dtype                = CHOLMOD_DOUBLE;
    cholmod_dense *X       = cholmod_solve(CHOLMOD_A, L, &B, &common);

    if (!X) throw std::runtime_error("no solution in the subspace");
    memcpy(x.GetData(), X->x, (size_t)height * sizeof(double));
    cholmod_free_dense(&X, &common);
  }

private:
  mutable cholmod_common common = {};
  cholmod_factor        *L      = nullptr;
};

struct Variant {
  const char *name;
  bool        filtered;
  int         relaxation, aggressive; /* hypre's number, levels */
  double      strength;
  bool        rotations; /* interpolated exactly, as MFEM's SetElasticityOptions() has it */
};

/* As the miniapp does, but for what a variant changes; modes: the rotations, which live as long as amg */
void options(mfem::HypreBoomerAMG &amg, const Variant &v, const std::vector<HYPRE_ParVector> &modes)
{
  amg.SetSystemsOptions(3);
  amg.SetPrintLevel(0);
  amg.SetRelaxType(v.relaxation);
  amg.SetAggressiveCoarsening(v.aggressive);
  amg.SetStrengthThresh(v.strength);
  if (!v.rotations) return;
  /* That function takes a mesh */
  HYPRE_BoomerAMGSetNodal(amg, 4);
  HYPRE_BoomerAMGSetNodalDiag(amg, 1);
  HYPRE_BoomerAMGSetCycleRelaxType(amg, 8, 3);
  HYPRE_BoomerAMGSetInterpVecVariant(amg, 2);
  HYPRE_BoomerAMGSetInterpVecQMax(amg, 4);
  HYPRE_BoomerAMGSetSmoothInterpVectors(amg, 1);
  HYPRE_BoomerAMGSetInterpRefine(amg, 1);
  HYPRE_BoomerAMGSetInterpVectors(amg, (HYPRE_Int)modes.size(), const_cast<HYPRE_ParVector *>(modes.data()));
  amg.SetErrorMode(mfem::HypreSolver::IGNORE_HYPRE_ERRORS); /* of singular coarse matrices, as there */
}

/* The quickest of several set-ups and solves, as memory that is used again is quicker */
void measure(Problem &p, const Variant &v, std::ostream *out)
{
  const auto    A = parallel(p.A), C = parallel(p.C), springs = parallel(p.springs), filter = parallel(p.filter);
  static double best       = 1e30; /* of all variants */
  double        least[2]   = {1e30, 0.0};
  int           iterations = 0;
  Vector        x(p.b.Size()), r(p.b.Size());
  HYPRE_BigInt  starts[2] = {0, p.b.Size()};

  for (int repeat = 0; repeat < 3; repeat++) {
    std::list<mfem::HypreParVector> kept; /* hypre smooths them, and they must stay where they are */
    std::vector<HYPRE_ParVector>    modes;

    for (const Vector &rotation : p.rotations) {
      kept.emplace_back(MPI_COMM_WORLD, starts[1], starts);
      std::copy(rotation.begin(), rotation.end(), kept.back().begin());
      modes.push_back(kept.back());
    }
    const double                          start = now();
    const std::unique_ptr<HypreParMatrix> product(mfem::RAP(springs.get(), C.get()));
    const std::unique_ptr<HypreParMatrix> K(mfem::ParAdd(A.get(), product.get()));
    Cholesky                              exact;
    mfem::AMGFSolver                      amgf;
    mfem::CGSolver                        cg(MPI_COMM_WORLD);
    mfem::Solver                         &preconditioner = v.filtered ? (mfem::Solver &)amgf : amgf.GetAMG();

    options(amgf.GetAMG(), v, modes);
    amgf.SetFilteredSubspaceTransferOperator(*filter);
    amgf.SetFilteredSubspaceSolver(exact);
    cg.SetPreconditioner(preconditioner);
    cg.SetOperator(*K);
    cg.SetRelTol(p.tolerance); /* in the preconditioner's norm */
    cg.SetMaxIter(500);
    cg.SetPrintLevel(-1);
    preconditioner.Mult(p.b, r); /* the first application sets up; the seconds of later ones do not count */
    const double once        = now();
    double       application = once - start;

    for (int k = 0; k < 3; k++) {
      const double before = now();

      preconditioner.Mult(p.b, r);
      application = std::min(application, now() - before);
    }
    x                  = 0.0;
    const double ready = now();

    cg.Mult(p.b, x);
    const double solve = now() - ready, setup = once - start - application, total = setup + solve;

    iterations = cg.GetNumIterations();
    if (total < least[0] + least[1]) {
      least[0] = setup;
      least[1] = solve;
    }
    best = std::min(best, total);
    if (total > 2 * best) break; /* it will not be the quickest */
  }

  Vector Cx(p.g.Size()), l(p.g.Size()), s(p.g.Size());

  p.C.Mult(x, Cx);
  l = Cx;
  l -= p.g;
  s = l;
  l /= p.d;
  for (int i = 0; i < s.Size(); i++) s(i) -= p.d(i) * l(i);
  r = p.f;
  p.A.AddMult(x, r, -1.0);
  p.C.AddMultTranspose(l, r, -1.0);
  const double f = p.f.Norml2(), scale = p.g.Norml2() + Cx.Norml2();

  printf(
    "{\"variant\": \"%s\", \"iterations\": %d, \"setup\": %.4f, \"solve\": %.4f, \"residual\": %.2e, \"primal\": %.2e, "
    "\"contact\": %.2e, \"filter\": %d}\n",
    v.name, iterations, least[0], least[1], r.Norml2() / p.b.Norml2(), r.Norml2() / (f > 0.0 ? f : 1.0),
    s.Norml2() / (scale > 0.0 ? scale : 1.0), v.filtered ? p.filter.Width() : 0);
  fflush(stdout);
  if (!out) return;
  write(*out, VECTOR);
  write(*out, (int32_t)x.Size());
  for (const double value : x) write(*out, value);
}
} // namespace

int main(int argc, char **argv)
{
  if (argc < 7) {
    fprintf(stderr, "amgf A.dat C.dat D.dat f.dat g.dat modes.dat [tolerance] [file for the solutions x]\n");
    return 2;
  }
  mfem::Mpi::Init(argc, argv);
  mfem::Hypre::Init();
  Problem       p(argv + 1, argc > 7 ? atof(argv[7]) : 1e-8);
  std::ofstream out;

  if (argc > 8) out.open(argv[8], std::ios::binary);
  /* 88: symmetric Gauss-Seidel, l1; 16: Chebyshev. The first one ends the repeats of those that are much slower */
  const Variant variants[] = {
    {"AMGF, as MFEM's contact miniapp",                            true,  88, 0, 0.5,  false},
    {"AMGF, MFEM's defaults: one aggressive level, strength 0.25", true,  88, 1, 0.25, false},
    {"AMGF, interpolation of rotations",                           true,  88, 0, 0.5,  true },
    {"AMGF, one aggressive level, Chebyshev",                      true,  16, 1, 0.5,  false},
    {"BoomerAMG alone, as MFEM's contact miniapp",                 false, 88, 0, 0.5,  false},
  };
  for (const Variant &v : variants) measure(p, v, argc > 8 ? &out : nullptr);
  return 0;
}
