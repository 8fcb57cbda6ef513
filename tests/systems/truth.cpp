/* What is stored of a system, and what is true of it, in long double */
#include "systems.h"

using Long       = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using LongColumn = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

/* Pivots, and residuals, between these two are of a system that nobody can decide. Data is exact in double precision */
static const long double dependent = 1e-17L, independent = 3e-15L, consistent = 1e-12L, contradictory = 1e-8L,
                         negligible = 1e-9L;
static const double unknown         = 1e-3; /* rounding the system changes x by this part: nobody can say what x is */

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

void SaddleUnits::Take(int i, int j, long double entry)
{
  if (j < n) row[(size_t)i] = std::max(row[(size_t)i], std::abs(entry));
  if (i < n) column[(size_t)j] = std::max(column[(size_t)j], std::abs(entry));
}

void SaddleUnits::Find()
{
  long double sum   = 0.0L;
  int         count = 0;

  for (size_t i = 0; i < (size_t)n; i++) {
    if (row[i] == 0.0L) continue;
    sum += std::log2(row[i]);
    count++;
  }
  const long double x = std::exp2(-std::round(0.5L * sum / std::max(count, 1)));

  for (std::vector<long double> *largest : {&row, &column}) {
    std::fill(largest->begin(), largest->begin() + n, x);
    for (size_t i = (size_t)n; i < largest->size(); i++)
      (*largest)[i] = (*largest)[i] > 0.0L ? std::exp2(-std::round(std::log2((*largest)[i] * x))) : 1.0L;
  }
}

/* Rows and columns to largest entries of about 1, by powers of 2, which round nothing. n: unknowns x */
static void Equilibrate(Eigen::Index n, Long &K, LongColumn &rows, LongColumn &columns)
{
  auto power = [](long double largest) {
    return largest > 0.0L ? std::exp2(-std::round(0.5L * std::log2(largest))) : 1.0L;
  };

  SaddleUnits units((int)n, (int)K.rows());

  for (int j = 0; j < (int)K.cols(); j++)
    for (int i = 0; i < (int)K.rows(); i++)
      if (K(i, j) != 0.0L) units.Take(i, j, K(i, j));
  units.Find();
  rows    = Eigen::Map<LongColumn>(units.row.data(), K.rows());
  columns = Eigen::Map<LongColumn>(units.column.data(), K.rows());
  K       = rows.asDiagonal() * K * columns.asDiagonal();
  for (int sweep = 0; sweep < 20; sweep++) {
    const LongColumn r = K.cwiseAbs().rowwise().maxCoeff().unaryExpr(power),
                     c = K.cwiseAbs().colwise().maxCoeff().transpose().unaryExpr(power);

    if (r.isOnes(0.0L) && c.isOnes(0.0L)) break;
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

/* Vectors of a kernel without the rounding of what is zero in them */
static Long Clean(Long kernel)
{
  for (Eigen::Index j = 0; j < kernel.cols(); j++) {
    const long double trace = 1e-12L * kernel.col(j).cwiseAbs().maxCoeff();

    for (long double &v : kernel.col(j))
      if (std::abs(v) <= trace) v = 0.0L;
  }
  return kernel;
}

/*
   Do entries too small for LU to see, of a D of hundreds of decades, couple its kernels? Then K is singular to rounding
   only, and x as large as they are small
*/
static bool Hides(const Long &K, const Long &kernel)
{
  Eigen::FullPivLU<Long> transposed(Long(K.transpose()));
  Long                   small(K);

  transposed.setThreshold(independent);
  for (Eigen::Index i = 0; i < K.size(); i++)
    if (std::abs(K.data()[i]) > dependent) small.data()[i] = 0.0L;
  return !(Clean(transposed.kernel()).transpose() * small * Clean(kernel)).isZero(0.0L);
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

  Equilibrate(n, scaled, rows, columns);
  Eigen::FullPivLU<Long> lu(scaled);
  lu.setThreshold(independent);
  facts.unique = facts.decided = true;
  if (Rank(lu, &facts.decided) < N) {
    const Long kernel = lu.kernel();

    facts.unique = kernel.topRows(n).cwiseAbs().maxCoeff() < 1e-10L * kernel.cwiseAbs().maxCoeff();
    if (Hides(scaled, kernel)) facts.decided = false;
  }
  const LongColumn y     = lu.solve(rows.cwiseProduct(b)); /* scaled */
  const LongColumn size  = scaled.cwiseAbs() * y.cwiseAbs() + rows.cwiseProduct(b).cwiseAbs();
  const LongColumn lost  = (scaled * y - rows.cwiseProduct(b)).cwiseAbs();
  long double      worst = 0.0L;

  for (Eigen::Index i = 0; i < N; i++) /* 0 = b is no rounding */
    if (lost[i] > 0.0L)
      worst = std::max(worst, scaled.row(i).isZero(0.0L) ? 1.0L : lost[i] / (size[i] + 1e-3L * size.maxCoeff()));
  if (worst > consistent && worst < contradictory) facts.decided = false;
  facts.solvable = worst < consistent;
  facts.left     = (double)worst;
  facts.scale    = columns.head(n).cast<double>();
  facts.x        = columns.head(n).cwiseProduct(y.head(n)).cast<double>();
  facts.size     = (double)std::max(y.head(n).norm(), negligible * y.norm());
  facts.reach    = 0.0;
  for (int draw = 0; draw < 3; draw++) {
    LongColumn noise(N);

    for (Eigen::Index i = 0; i < N; i++)
      noise[i] = size[i] * (long double)PETSC_MACHINE_EPSILON * (long double)r.Real(-1.0, 1.0);
    facts.reach = std::max(facts.reach,
                           (double)(LongColumn(lu.solve(noise)).head(n).norm() /
                                    std::max((long double)facts.size, std::numeric_limits<long double>::min())));
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

  Equilibrate(x.size(), K, rows, columns);
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

#if defined(__SIZEOF_FLOAT128__)
__extension__ typedef __float128 Quad;
#else
typedef long double Quad; /* which has as many digits where there is no other */
#endif
using QuadColumn = std::vector<Quad>;

static Quad Absolute(Quad a)
{
  return a < 0 ? -a : a;
}

/*
   Gauss' elimination with complete pivoting and 113 binary digits: what is a zero by cancellation is told from D of
   hundreds of decades
*/
struct QuadLU {
  std::vector<QuadColumn> rows;
  std::vector<size_t>     row, column; /* of the pivots, then of the rest */
  size_t                  rank = 0;

  explicit QuadLU(const Long &K);
  QuadColumn solve(QuadColumn b, long double *lost) const; /* a basic solution, and what it leaves of b */
  bool       determined(size_t n) const;                   /* the first n unknowns, by the equations */
};

QuadLU::QuadLU(const Long &K) : rows((size_t)K.rows()), row((size_t)K.rows()), column((size_t)K.rows())
{
  static const Quad       zero = 1e-28L; /* relative to the terms that it is the sum of */
  const size_t            N    = rows.size();
  std::vector<QuadColumn> size;

  for (size_t i = 0; i < N; i++) {
    row[i] = column[i] = i;
    for (size_t j = 0; j < N; j++) rows[i].push_back(K((Eigen::Index)i, (Eigen::Index)j));
    size.push_back(rows[i]);
    for (Quad &v : size[i]) v = Absolute(v);
  }
  for (; rank < N; rank++) {
    size_t p = rank, q = rank;

    for (size_t i = rank; i < N; i++)
      for (size_t j = rank; j < N; j++)
        if (Absolute(rows[row[i]][column[j]]) > Absolute(rows[row[p]][column[q]])) p = i, q = j;
    std::swap(row[rank], row[p]);
    std::swap(column[rank], column[q]);
    const QuadColumn &pivot = rows[row[rank]];
    const size_t      c     = column[rank];

    if (pivot[c] == 0) break;
    for (size_t i = rank + 1; i < N; i++) {
      QuadColumn &other = rows[row[i]], &terms = size[row[i]];
      const Quad  factor = other[c] /= pivot[c];

      for (size_t j = rank + 1; j < N && factor != 0; j++) {
        const size_t k    = column[j];
        const Quad   term = factor * pivot[k];

        other[k] -= term;
        terms[k] = std::max(terms[k], Absolute(term));
        if (Absolute(other[k]) <= zero * terms[k]) other[k] = 0;
      }
    }
  }
}

QuadColumn QuadLU::solve(QuadColumn b, long double *lost) const
{
  const size_t N = rows.size();
  QuadColumn   y(N, 0), size(b);

  for (Quad &v : size) v = Absolute(v);
  for (size_t k = 0; k < rank; k++)
    for (size_t i = k + 1; i < N; i++) {
      const Quad term = rows[row[i]][column[k]] * b[row[k]];

      b[row[i]] -= term;
      size[row[i]] = std::max(size[row[i]], Absolute(term));
    }
  *lost = 0.0L;
  for (size_t i = rank; i < N; i++)
    if (b[row[i]] != 0) *lost = std::max(*lost, (long double)(Absolute(b[row[i]]) / size[row[i]]));
  for (size_t k = rank; k-- > 0;) {
    Quad sum = b[row[k]];

    for (size_t j = k + 1; j < rank; j++) sum -= rows[row[k]][column[j]] * y[column[j]];
    y[column[k]] = sum / rows[row[k]][column[k]];
  }
  return y;
}

bool QuadLU::determined(size_t n) const
{
  for (size_t f = rank; f < rows.size(); f++) { /* the free unknowns, one after the other */
    QuadColumn y(rows.size(), 0);
    Quad       most = 1, moved = column[f] < n ? 1 : 0;

    y[column[f]] = 1;
    for (size_t k = rank; k-- > 0;) {
      Quad sum = -rows[row[k]][column[f]];

      for (size_t j = k + 1; j < rank; j++) sum -= rows[row[k]][column[j]] * y[column[j]];
      y[column[k]] = sum / rows[row[k]][column[k]];
      most         = std::max(most, Absolute(y[column[k]]));
      if (column[k] < n) moved = std::max(moved, Absolute(y[column[k]]));
    }
    if (moved > (Quad)1e-10L * most) return false;
  }
  return true;
}

bool SaddleConfirms(const Saddle &s, const Vector &x, double bound, double beyond)
{
  const Eigen::Index n = x.size();
  Long               K = Whole(s);
  LongColumn         rows, columns, b = RightHandSide(s), y(K.rows());
  QuadColumn         rhs;
  LongColumn         moved = LongColumn::Zero(n);
  long double        lost, none;

  Equilibrate(n, K, rows, columns);
  b = rows.cwiseProduct(b);
  const QuadLU lu(K);

  for (long double v : b) rhs.push_back(v);
  const QuadColumn exact = lu.solve(rhs, &lost);
  if (lost > consistent) return false;
  if (!lu.determined((size_t)n)) return true; /* both equations are met */
  for (Eigen::Index i = 0; i < y.size(); i++) y[i] = (long double)exact[(size_t)i];
  const long double size  = std::max(y.head(n).norm(), negligible * y.norm());
  const LongColumn  terms = K.cwiseAbs() * y.cwiseAbs() + b.cwiseAbs();
  const LongColumn  error = x.cast<long double>().cwiseQuotient(columns.head(n)) - y.head(n);
  /* the most that residuals of one rounding of each row can do, of whatever signs */
  for (size_t k = 0; k < rhs.size(); k++) {
    std::fill(rhs.begin(), rhs.end(), 0);
    rhs[k]                  = terms[(Eigen::Index)k] * (long double)PETSC_MACHINE_EPSILON;
    const QuadColumn change = lu.solve(rhs, &none);
    for (size_t i = 0; i < (size_t)n; i++) moved[(Eigen::Index)i] += (long double)Absolute(change[i]);
  }
  return error.isZero(0.0L) || error.norm() <= std::max((long double)bound * size, (long double)beyond * moved.norm());
}
