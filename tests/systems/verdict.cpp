/* Is what a refusal says true? Each phrase that may be said, and of which systems it holds */
#include "systems.h"

/* the singular values of rows that may be called nearly dependent, relative to the largest */
static const double nearly = 1e-6;

/*
   The rows of [C L], D = L L', scaled to size 1; those that are zero are left out, and the columns of unknowns that
   their own row determines
*/
static Matrix Rows(const Saddle &s)
{
  const bool any = s.D.size() > 0 && s.D.norm() > 0.0;
  Matrix     all = s.C * s.A.diagonal()
                       .cwiseAbs()
                       .cwiseMax(1e-12 * s.A.diagonal().cwiseAbs().maxCoeff())
                       .cwiseSqrt()
                       .cwiseInverse()
                       .asDiagonal();
  std::vector<int> kept;

  for (Eigen::Index j = 0; j < s.A.rows(); j++)
    if (s.A(j, j) != 0.0 && (s.A.row(j).array() != 0.0).count() == 1 && s.B.col(j).isZero(0.0)) all.col(j).setZero();

  if (any) {
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen(s.D);
    const Vector                                values = eigen.eigenvalues().cwiseAbs();
    /* what is an eigenvalue by rounding alone would come out as its root, and tell apart rows that D does not */
    const Matrix L = eigen.eigenvectors() *
                     (values.array() > 1e-13 * values.maxCoeff()).select(values, 0.0).cwiseSqrt().asDiagonal();
    Matrix both(all.rows(), all.cols() + L.cols());

    both << all, L;
    all = both;
  }
  for (Eigen::Index i = 0; i < all.rows(); i++)
    if (all.row(i).norm() > 0.0) kept.push_back((int)i);
  all = Matrix(all(kept, Eigen::seqN(0, all.cols())));
  for (Eigen::Index i = 0; i < all.rows(); i++) all.row(i).normalize();
  return all;
}

static bool RowsNearlyDependent(const Saddle &s)
{
  const Matrix rows = Rows(s);

  if (rows.rows() > rows.cols()) return true;
  const Vector values = Eigen::JacobiSVD<Matrix>(rows).singularValues();
  return values.size() && values[values.size() - 1] < nearly * values[0];
}

/*
   Where all is stored with the other sign, and fields are not named, D is the block with a positive diagonal: it is A
   then, and the rows are those of B'
*/
static bool NearlyDependent(const Saddle &s)
{
  if (RowsNearlyDependent(s)) return true;
  if (s.convention != NEGATED || !s.D.size() || s.D.diagonal().maxCoeff() <= 0.0) return false;
  Saddle other;

  other.A = s.D;
  other.C = s.B.transpose();
  other.B = s.C.transpose();
  other.D = s.A;
  return RowsNearlyDependent(other);
}

bool SaddleSymmetric(const Saddle &s)
{
  return s.B == s.C && s.A == s.A.transpose() && s.D == s.D.transpose();
}

/* How many eigenvalues of a symmetric matrix are negative, once it is scaled to entries of about 1 */
static Eigen::Index Negative(const Matrix &M)
{
  using Long          = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  Long         scaled = M.cast<long double>();
  Eigen::Index count  = 0;

  if (!M.size()) return 0;
  for (int sweep = 0; sweep < 20; sweep++) {
    Eigen::Matrix<long double, Eigen::Dynamic, 1> d = scaled.cwiseAbs().rowwise().maxCoeff();

    for (long double &v : d) v = v > 0.0L ? 1.0L / std::sqrt(v) : 1.0L;
    scaled = d.asDiagonal() * scaled * d.asDiagonal();
  }
  const auto values = Eigen::SelfAdjointEigenSolver<Long>(scaled, Eigen::EigenvaluesOnly).eigenvalues().eval();
  for (long double v : values) count += v < -1e-15L * values.cwiseAbs().maxCoeff();
  return count;
}

/* The rank of the rows of [C D], scaled to entries of about 1 */
static Eigen::Index RowRank(const Saddle &s)
{
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  Long rows(s.C.rows(), s.C.cols() + s.D.cols());

  if (!rows.size()) return 0;
  if (s.D.size()) rows << s.C.cast<long double>(), s.D.cast<long double>();
  else rows = s.C.cast<long double>();
  for (int sweep = 0; sweep < 20; sweep++) {
    for (auto row : rows.rowwise())
      if (row.cwiseAbs().maxCoeff() > 0.0L) row /= std::sqrt(row.cwiseAbs().maxCoeff());
    for (auto column : rows.colwise())
      if (column.cwiseAbs().maxCoeff() > 0.0L) column /= std::sqrt(column.cwiseAbs().maxCoeff());
  }
  Eigen::FullPivLU<Long> lu(rows);
  lu.setThreshold(3e-15L);
  return lu.rank();
}

/* Has A a negative eigenvalue on Ker C, whatever D? */
static bool NegativeOnKernel(const Saddle &s)
{
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  if (!s.C.size()) return Negative(s.A) > 0;
  Eigen::FullPivLU<Long> lu(s.C.cast<long double>());

  lu.setThreshold(3e-15L);
  if (!lu.dimensionOfKernel()) return false;
  const Long kernel = Eigen::HouseholderQR<Long>(lu.kernel()).householderQ() *
                      Long::Identity(s.C.cols(), lu.dimensionOfKernel());

  return Negative((kernel.transpose() * s.A.cast<long double>() * kernel).cast<double>()) > 0;
}

/*
   Where D is not 0, of diag(A, I) on Ker [C L], -I where D is negative: if it is definite, the whole has as many
   negative eigenvalues as independent rows, less those of D that are negative
*/
bool SaddleIndefinite(const Saddle &s)
{
  const Eigen::Index n = s.A.rows(), m = s.C.rows();
  Matrix             K = Matrix::Zero(n + m, n + m);

  K.topLeftCorner(n, n)    = s.A;
  K.bottomLeftCorner(m, n) = s.C;
  K.topRightCorner(n, m)   = s.C.transpose();
  if (s.D.size()) K.bottomRightCorner(m, m) = -s.D;
  return NegativeOnKernel(s) || Negative(K) > RowRank(s) - Negative(s.D);
}

/* What is said of the system, and when it is so; the program's A is -A where all has the other sign */
static const struct {
  const char *said;
  bool (*holds)(const SaddleTraits &);
} phrases[] = {
  {"no solution exists",        [](const SaddleTraits &t) { return !t.solvable; }                                },
  {"are in no equation",        [](const SaddleTraits &t) { return !t.unique; }                                  },
  {"have no unknown",           [](const SaddleTraits &t) { return !t.unique || !t.solvable; }                   },
  {"body floats",               [](const SaddleTraits &t) { return !t.unique; }                                  },
  {"singular on Ker C",         [](const SaddleTraits &t) { return !t.unique; }                                  },
  {"is indefinite",             [](const SaddleTraits &t) { return !t.symmetric || t.negated || t.indefinite(); }},
  {"is not symmetric",          [](const SaddleTraits &t) { return !t.symmetric; }                               },
  {"has no transpose",          [](const SaddleTraits &t) { return !t.symmetric; }                               },
  {"nearly linearly dependent", [](const SaddleTraits &t) { return t.dependent(); }                              },
  {"exactly or nearly",         [](const SaddleTraits &t) { return t.dependent(); }                              },
  {"linear combinations",       [](const SaddleTraits &t) { return t.dependent(); }                              }
};

/* What is said of the attempt, which only who made it knows */
static const char *const failures[] = {"without convergence",
                                       "stagnates",
                                       "is not positive definite",
                                       "cannot be factored",
                                       "do not converge",
                                       "is not met",
                                       "drown in the rounding",
                                       "HH(it,it) is identically zero", /* LGMRES, by an error of PETSc's own */
                                       "says that it converged",
                                       "Solves with the Gram matrix",
                                       "The inner preconditioner, of type"};

bool SaddleSaysTrue(const SaddleTraits &traits, const std::string &text)
{
  bool any = false;

  for (const auto &phrase : phrases) {
    if (text.find(phrase.said) == std::string::npos) continue;
    if (!phrase.holds(traits)) return false;
    any = true;
  }
  for (const char *failure : failures) any = any || text.find(failure) != std::string::npos;
  return any; /* what says nothing that is known says nothing true */
}

bool SaddleSaysTrue(const Saddle &s, const Facts &facts, const std::string &text)
{
  return SaddleSaysTrue({facts.solvable, facts.unique, SaddleSymmetric(s), s.convention == NEGATED,
                         [&s] { return SaddleIndefinite(s); }, [&s] { return NearlyDependent(s); }},
                        text);
}
