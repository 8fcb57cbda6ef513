/* What is stored of a system, and what is true of it, in long double */
#include "systems.h"

using Long       = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using LongColumn = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

/* Pivots, and residuals, between these two are of a system that nobody can decide. Data is exact in double precision */
static const long double dependent = 1e-17L, independent = 3e-15L, consistent = 1e-12L, contradictory = 1e-8L, negligible = 1e-9L;
static const double      unknown = 1e-3; /* rounding the system changes x by this part: nobody can say what x is */

Random SaddleRandom(const std::string &name)
{
  uint64_t hash = 1469598103934665603u; /* FNV-1a */

  for (char c : name) hash = (hash ^ (uint64_t)(unsigned char)c) * 1099511628211u;
  return Random((PetscInt64)(hash >> 1));
}

void SaddleStore(Saddle &s)
{
  const double whole = s.convention == NEGATED ? -1.0 : 1.0, second = s.convention == FLIPPED ? -1.0 : whole;

  s.block[0][0] = whole * s.A;
  s.block[0][1] = (s.convention == OPPOSITE ? -1.0 : whole) * s.B.transpose();
  s.block[1][0] = second * s.C;
  s.block[1][1] = (s.convention == OPPOSITE ? 1.0 : -second) * s.D;
  s.rhs[0]      = whole * s.f;
  s.rhs[1]      = second * s.g;
}

static Long Whole(const Saddle &s)
{
  const Eigen::Index n = s.A.rows(), m = s.C.rows();
  Long               K = Long::Zero(n + m, n + m);

  K.topLeftCorner(n, n)    = s.block[0][0].cast<long double>();
  K.topRightCorner(n, m)   = s.block[0][1].cast<long double>();
  K.bottomLeftCorner(m, n) = s.block[1][0].cast<long double>();
  if (s.block[1][1].size()) K.bottomRightCorner(m, m) = s.block[1][1].cast<long double>();
  return K;
}

static LongColumn RightHandSide(const Saddle &s)
{
  LongColumn b(s.rhs[0].size() + s.rhs[1].size());

  b << s.rhs[0].cast<long double>(), s.rhs[1].cast<long double>();
  return b;
}

/* Rows and columns to largest entries of about 1, by powers of 2, which round nothing */
static void Equilibrate(Long &K, LongColumn &rows, LongColumn &columns)
{
  auto power = [](long double largest) { return largest > 0.0L ? std::exp2(-std::round(0.5L * std::log2(largest))) : 1.0L; };

  rows    = LongColumn::Ones(K.rows());
  columns = LongColumn::Ones(K.rows());
  for (int sweep = 0; sweep < 20; sweep++) {
    LongColumn r(K.rows()), c(K.rows());

    for (Eigen::Index i = 0; i < K.rows(); i++) {
      r[i] = power(K.row(i).cwiseAbs().maxCoeff());
      c[i] = power(K.col(i).cwiseAbs().maxCoeff());
    }
    K       = r.asDiagonal() * K * c.asDiagonal();
    rows    = rows.cwiseProduct(r);
    columns = columns.cwiseProduct(c);
  }
}

static Eigen::Index Rank(const Eigen::FullPivLU<Long> &lu, bool *decided)
{
  const LongColumn pivots = lu.matrixLU().diagonal().cwiseAbs();
  Eigen::Index     rank   = 0;

  for (long double pivot : pivots) {
    const long double relative = pivot / lu.maxPivot();

    if (relative > dependent && relative < independent) *decided = false;
    rank += relative > independent;
  }
  return rank;
}

Facts SaddleFacts(const Saddle &s)
{
  const Eigen::Index n = s.A.rows(), N = n + s.C.rows();
  const Long         K = Whole(s);
  const LongColumn   b = RightHandSide(s);
  Long               scaled(K);
  LongColumn         rows, columns;
  Facts              facts;
  Random             r = SaddleRandom(s.name);

  Equilibrate(scaled, rows, columns);
  Eigen::FullPivLU<Long> lu(scaled);
  lu.setThreshold(independent);
  facts.unique = facts.decided = true;
  if (Rank(lu, &facts.decided) < N) {
    const Long kernel = lu.kernel();

    facts.unique = kernel.topRows(n).cwiseAbs().maxCoeff() < 1e-10L * kernel.cwiseAbs().maxCoeff();
  }
  const LongColumn bare = lu.setThreshold(0.0L).solve(rows.cwiseProduct(b));
  lu.setThreshold(independent);
  facts.graded           = columns.head(n).cwiseProduct(bare.head(n)).cast<double>();
  const LongColumn y     = lu.solve(rows.cwiseProduct(b)); /* scaled */
  const LongColumn size  = scaled.cwiseAbs() * y.cwiseAbs() + rows.cwiseProduct(b).cwiseAbs();
  const LongColumn lost  = (scaled * y - rows.cwiseProduct(b)).cwiseAbs();
  long double      worst = 0.0L;

  for (Eigen::Index i = 0; i < N; i++)
    if (lost[i] > 0.0L) worst = std::max(worst, lost[i] / (size[i] + 1e-3L * size.maxCoeff()));
  if (worst > consistent && worst < contradictory) facts.decided = false;
  facts.solvable = worst < consistent;
  facts.left     = (double)worst;
  facts.scale    = columns.head(n).cast<double>();
  facts.x        = columns.head(n).cwiseProduct(y.head(n)).cast<double>();
  facts.size     = (double)std::max(y.head(n).norm(), negligible * y.norm());
  facts.reach = facts.gradedReach = 0.0;
  for (int draw = 0; draw < 3; draw++) {
    LongColumn noise(N);

    for (Eigen::Index i = 0; i < N; i++) noise[i] = size[i] * (long double)PETSC_MACHINE_EPSILON * (long double)r.Real(-1.0, 1.0);
    facts.reach = std::max(facts.reach,
                           (double)(LongColumn(lu.solve(noise)).head(n).norm() / std::max((long double)facts.size, std::numeric_limits<long double>::min())));
    lu.setThreshold(0.0L);
    noise             = noise.cwiseQuotient(size.cwiseMax(std::numeric_limits<long double>::min())).cwiseProduct(scaled.cwiseAbs() * bare.cwiseAbs());
    facts.gradedReach = std::max(facts.gradedReach, (double)(LongColumn(lu.solve(noise)).head(n).norm() / bare.head(n).norm()));
    lu.setThreshold(independent);
  }
  if (facts.reach > unknown) facts.decided = false;
  return facts;
}

double SaddleError(const Facts &facts, const Vector &x)
{
  const Vector inverse = facts.scale.cwiseInverse();

  const double error = inverse.cwiseProduct(x - facts.x).stableNorm();

  return error == 0.0 ? 0.0 : error / facts.size;
}

double SaddleResidual(const Saddle &s, const Vector &x, const Vector &lambda)
{
  Long       K = Whole(s);
  LongColumn rows, columns, y(x.size() + lambda.size()), b = RightHandSide(s);

  Equilibrate(K, rows, columns);
  y << x.cast<long double>(), lambda.cast<long double>();
  y                     = y.cwiseQuotient(columns);
  b                     = b.cwiseProduct(rows);
  const LongColumn size = K.cwiseAbs() * y.cwiseAbs() + b.cwiseAbs(), residual = (K * y - b).cwiseAbs();
  long double      worst = 0.0L;

  for (Eigen::Index i = 0; i < y.size(); i++) {
    const long double relative = residual[i] == 0.0L ? 0.0L : residual[i] / (size[i] + 1e-3L * size.maxCoeff());

    if (!(relative <= worst)) worst = relative; /* not a number, too */
  }
  return (double)worst;
}

bool SaddleGraded(const Facts &facts, const Vector &x)
{
  const Vector inverse = facts.scale.cwiseInverse();

  return inverse.cwiseProduct(x - facts.graded).stableNorm() <= std::max(1e-5, 10.0 * facts.gradedReach) * inverse.cwiseProduct(facts.graded).stableNorm();
}
