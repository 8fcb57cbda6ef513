/*
   What is true of a sparse system, by construction and by LU refined with residuals in long double, and the verdict on
   an answer
*/
#include "structured.h"
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>

using LongColumn = Eigen::Matrix<long double, Eigen::Dynamic, 1>;
template <typename Scalar>
using Columns = Eigen::SparseMatrix<Scalar>;

/* As in truth.cpp and solve.cpp of the collection, which judge what is small enough for dense matrices */
static const long double consistent = 1e-12L, contradictory = 1e-8L, negligible = 1e-9L;
static const double      unknown = 1e-3, residualBound = 1e-5, errorBound = 1e-5, asked = 1e-11;
static const int         dense = 120;

void StructuredBlocks(const Structured &s, Sparse block[2][2], Vector rhs[2])
{
  const double whole = s.convention == NEGATED ? -1.0 : 1.0, second = s.convention == FLIPPED ? -1.0 : whole;

  block[0][0] = whole * s.A;
  block[0][1] = (s.convention == OPPOSITE ? -1.0 : whole) * Sparse(s.B.transpose());
  block[1][0] = second * s.C;
  block[1][1] = (s.convention == OPPOSITE ? 1.0 : -second) * s.D;
  rhs[0]      = whole * s.f;
  rhs[1]      = second * s.g;
}

static Saddle DenseTwin(const Structured &s)
{
  Saddle twin;

  twin.name       = "structured";
  twin.A          = Matrix(s.A);
  twin.B          = Matrix(s.B);
  twin.C          = Matrix(s.C);
  twin.D          = Matrix(s.D);
  twin.f          = s.f;
  twin.g          = s.g;
  twin.convention = s.convention;
  SaddleStore(twin);
  return twin;
}

/* [A B'; C -D] with rows and columns times powers of 2, which round nothing */
struct Whole {
  Triplets   entries;
  LongColumn rows, columns, b;
  int        n, N;

  explicit Whole(const Structured &);
  template <typename Scalar>
  Columns<Scalar> Assemble(const std::vector<Dependence> &) const;
  LongColumn      Residual(const LongColumn &y, LongColumn *size) const; /* size: of the terms of each row */
};

Whole::Whole(const Structured &s) : n((int)s.A.rows()), N((int)(s.A.rows() + s.C.rows()))
{
  auto power = [](double largest) { return largest > 0.0 ? std::exp2(-std::round(0.5 * std::log2(largest))) : 1.0; };
  auto take  = [this](const Sparse &M, int row, int column, double sign, bool transpose) {
    for (int k = 0; k < M.outerSize(); k++)
      for (Sparse::InnerIterator it(M, k); it; ++it)
        if (it.value() != 0.0)
          entries.emplace_back(row + (int)(transpose ? it.col() : it.row()),
                                column + (int)(transpose ? it.row() : it.col()), sign * it.value());
  };

  take(s.A, 0, 0, 1.0, false);
  take(s.B, 0, n, 1.0, true);
  take(s.C, n, 0, 1.0, false);
  take(s.D, n, n, -1.0, false);
  SaddleUnits units(n, N);

  for (const auto &t : entries) units.Take(t.row(), t.col(), t.value());
  units.Find();
  rows    = Eigen::Map<LongColumn>(units.row.data(), N);
  columns = Eigen::Map<LongColumn>(units.column.data(), N);
  for (auto &t : entries) t = {t.row(), t.col(), t.value() * (double)(rows[t.row()] * columns[t.col()])};
  for (int sweep = 0; sweep < 20; sweep++) {
    Vector r = Vector::Zero(N), c = Vector::Zero(N);

    for (const auto &t : entries) {
      r[t.row()] = std::max(r[t.row()], std::abs(t.value()));
      c[t.col()] = std::max(c[t.col()], std::abs(t.value()));
    }
    for (int i = 0; i < N; i++) {
      r[i] = power(r[i]);
      c[i] = power(c[i]);
    }
    for (auto &t : entries) t = {t.row(), t.col(), t.value() * r[t.row()] * c[t.col()]};
    rows    = rows.cwiseProduct(r.cast<long double>());
    columns = columns.cwiseProduct(c.cast<long double>());
  }
  b = LongColumn(N);
  b << s.f.cast<long double>(), s.g.cast<long double>();
  b = rows.cwiseProduct(b);
}

/* Rows that depend on others say that their multiplier is 0 */
template <typename Scalar>
Columns<Scalar> Whole::Assemble(const std::vector<Dependence> &dependent) const
{
  std::vector<Eigen::Triplet<Scalar>> kept;
  std::vector<bool>                   drop((size_t)N, false);
  Columns<Scalar>                     K(N, N);

  for (const Dependence &d : dependent) {
    drop[(size_t)(n + d.drop)] = true;
    kept.emplace_back(n + d.drop, n + d.drop, (Scalar)1.0);
  }
  for (const auto &t : entries)
    if (!drop[(size_t)t.row()]) kept.emplace_back(t.row(), t.col(), (Scalar)t.value());
  K.setFromTriplets(kept.begin(), kept.end());
  return K;
}

LongColumn Whole::Residual(const LongColumn &y, LongColumn *size) const
{
  LongColumn residual = b;

  if (size) *size = b.cwiseAbs();
  for (const auto &t : entries) {
    const long double term = (long double)t.value() * y[t.col()];

    residual[t.row()] -= term;
    if (size) (*size)[t.row()] += std::abs(term);
  }
  return residual;
}

/* The largest row relative to its terms, a thousandth of the largest terms at least */
static double Worst(const LongColumn &residual, const LongColumn &size)
{
  const long double most  = size.maxCoeff();
  long double       worst = 0.0L;

  for (Eigen::Index i = 0; i < size.size(); i++) {
    const long double relative = residual[i] == 0.0L ? 0.0L : std::abs(residual[i]) / (size[i] + 1e-3L * most);

    if (!(relative <= worst)) worst = relative; /* not a number, too */
  }
  return (double)worst;
}

/* Refined until it gets no better; *last: the last correction of x, relative to the size of x */
template <typename Scalar, typename Ordering>
static bool Refine(const Structured &s, const Whole &w, Eigen::SparseLU<Columns<Scalar>, Ordering> &lu, LongColumn &y,
                   long double *size, long double *last)
{
  using Own       = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  LongColumn best = y = LongColumn::Zero(w.N);

  lu.compute(w.Assemble<Scalar>(s.dependent));
  if (lu.info() != Eigen::Success) return false;
  *last = std::numeric_limits<long double>::max();
  for (int step = 0; step < 12; step++) {
    LongColumn residual = w.Residual(y, NULL);

    for (const Dependence &d : s.dependent) residual[w.n + d.drop] = 0.0L;
    const long double scale = residual.cwiseAbs().maxCoeff();
    if (scale == 0.0L) {
      *last = 0.0L;
      break;
    }
    const LongColumn correction = Own(lu.solve(Own((residual / scale).template cast<Scalar>())))
                                    .template cast<long double>() *
                                  scale;
    y += correction;
    *size                    = std::max(y.head(w.n).norm(), negligible * y.norm());
    const long double change = correction.head(w.n).norm() / *size;
    if (!(change < 0.5L * *last)) break;
    *last = change;
    best  = y;
    if (change < 1e-18L) break;
  }
  y     = best;
  *size = std::max(y.head(w.n).norm(), negligible * y.norm());
  return *last < 1e-12L;
}

/* Noise of one rounding in each row, and how far x moves */
template <typename Solver>
static double Reach(const Structured &s, const Whole &w, const Solver &lu, const LongColumn &terms, long double size,
                    Random &r)
{
  const long double most  = terms.maxCoeff();
  double            reach = 0.0;

  for (int draw = 0; draw < 3; draw++) {
    Vector noise(w.N);

    for (int i = 0; i < w.N; i++) noise[i] = (double)(terms[i] / most) * Between(r, -1.0, 1.0);
    for (const Dependence &d : s.dependent) noise[w.n + d.drop] = 0.0;
    const Vector moved = lu.solve(noise);
    reach = std::max(reach, (double)(moved.head(w.n).norm() * (long double)PETSC_MACHINE_EPSILON * most / size));
  }
  return reach;
}

/* Where something moves freely: whether the loads are balanced, as the generator says */
static PetscErrorCode Motion(const Structured &s, const Whole &w, StructuredFacts &facts)
{
  LongColumn z = LongColumn::Zero(w.N), size;

  PetscFunctionBeginUser;
  z.head(w.n)            = s.motion.cast<long double>().cwiseQuotient(w.columns.head(w.n));
  const LongColumn moved = w.b - w.Residual(z, &size);
  const LongColumn terms = size - w.b.cwiseAbs();

  for (int i = 0; i < w.N; i++)
    PetscCheck(std::abs(moved[i]) <= 1e-13L * terms.maxCoeff(), PETSC_COMM_SELF, PETSC_ERR_PLIB,
               "%s: something holds what should move", s.text.c_str());
  const double work = std::abs(s.motion.dot(s.f)), all = s.motion.cwiseAbs().dot(s.f.cwiseAbs());

  facts.left = all > 0.0 ? work / all : 0.0;
  PetscCheck(s.solvable == (facts.left < 1e-10), PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s: loads are %sbalanced",
             s.text.c_str(), facts.left < 1e-10 ? "" : "not ");
  facts.x     = Vector::Zero(w.n);
  facts.scale = w.columns.head(w.n).cast<double>();
  facts.size  = 1.0;
  facts.reach = 0.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Solved(const Structured &s, const Whole &w, StructuredFacts &facts)
{
  Eigen::SparseLU<Columns<double>, Eigen::COLAMDOrdering<int>> lu;
  LongColumn                                                   y, terms, residual;
  long double                                                  size = 1.0L, last = 1.0L;
  Random                                                       r(w.N);

  facts.decided = Refine(s, w, lu, y, &size, &last);
  facts.x       = w.columns.head(w.n).cwiseProduct(y.head(w.n)).cast<double>();
  facts.scale   = w.columns.head(w.n).cast<double>();
  /* C x and D l balance each other: x is what is left of both */
  if (s.rest && s.D.size()) size = std::max(size, 1e-3L * y.norm());
  facts.size = (double)size;
  facts.left = facts.reach = facts.typical = 1.0;
  if (lu.info() != Eigen::Success) return;
  residual      = w.Residual(y, &terms);
  facts.left    = Worst(residual, terms);
  facts.decided = facts.decided && (s.solvable ? facts.left < consistent : facts.left > contradictory);
  facts.reach   = Reach(s, w, lu, terms, size, r);
  LongColumn any(w.N), about(w.N);

  for (int i = 0; i < w.N; i++) any[i] = Between(r, -1.0, 1.0);
  (void)w.Residual(any, &about);
  facts.typical = Reach(s, w, lu, about - w.b.cwiseAbs(), any.head(w.n).norm(), r);
  if (facts.reach > unknown) facts.decided = false;
}

StructuredFacts StructuredTruth(const Structured &s)
{
  const Whole     w(s);
  StructuredFacts facts;

  facts.solvable = s.solvable;
  facts.unique   = s.unique;
  facts.decided  = true;
  if (!s.unique) PetscCallAbort(PETSC_COMM_SELF, Motion(s, w, facts));
  else Solved(s, w, facts);
  if (w.N > dense) return facts;
  const Facts small = SaddleFacts(DenseTwin(s));

  if (small.decided && facts.decided) { /* what is known by construction has to be so */
    PetscCheckAbort(small.solvable == s.solvable, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s is %ssolvable", s.text.c_str(),
                    small.solvable ? "" : "not ");
    PetscCheckAbort(small.unique == s.unique, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s: x is %sunique", s.text.c_str(),
                    small.unique ? "" : "not ");
    if (s.unique && s.solvable)
      PetscCheckAbort(SaddleError(facts, small.x) <= 1e-9 + 1e3 * facts.reach, PETSC_COMM_SELF, PETSC_ERR_PLIB,
                      "%s: two truths, %g apart", s.text.c_str(), SaddleError(facts, small.x));
  }
  const bool   known = facts.decided;
  const double size  = facts.size;

  (Facts &)facts = small;
  facts.decided  = known && small.decided;
  if (s.rest) facts.size = std::max(size, small.size);
  return facts;
}

bool StructuredPromised(const Structured &s, const StructuredFacts &facts)
{
  static const double good = 1e-10; /* error in x that rounding the system may cause */

  return s.tame && facts.decided && facts.solvable && facts.unique && facts.typical < good &&
         (s.rest || facts.reach < good);
}

/* Rows of [C L], D = L L', scaled to size 1: has their Gram matrix an eigenvalue below 1e-12 of the largest? */
static bool NearlyDependent(const Structured &s)
{
  using LongSparse = Columns<long double>;
  const int  m     = (int)s.C.rows();
  Vector     weight(s.A.rows());
  double     most = 0.0;
  LongColumn v(m), scale(m);
  Random     r(m);

  if (!s.dependent.empty()) return true;
  for (int i = 0; i < s.A.rows(); i++) most = std::max(most, std::abs(weight[i] = s.A.coeff(i, i)));
  for (int i = 0; i < s.A.rows(); i++) weight[i] = 1.0 / std::max(std::abs(weight[i]), 1e-12 * most);
  for (int i = 0; i < s.A.rows(); i++) { /* unknowns that their own row determines */
    int count = 0;

    for (Sparse::InnerIterator it(s.A, i); it; ++it) count += it.value() != 0.0;
    if (count == 1 && s.A.coeff(i, i) != 0.0 && Sparse(s.B).col(i).norm() == 0.0) weight[i] = 0.0;
  }
  const LongSparse C = LongSparse(s.C.cast<long double>());
  LongSparse       G = C * weight.cast<long double>().asDiagonal() * LongSparse(C.transpose());

  if (s.D.size()) G += LongSparse(s.D.cast<long double>());
  for (int i = 0; i < m; i++) {
    const long double d = G.coeff(i, i);

    if (d <= 0.0L) return true;
    scale[i] = 1.0L / std::sqrt(d);
    v[i]     = Between(r, -1.0, 1.0);
  }
  G                                       = scale.asDiagonal() * G * scale.asDiagonal();
  long double                       large = 0.0L, small = 0.0L;
  const LongColumn                  start = v.normalized();
  Eigen::SimplicialLDLT<LongSparse> ldlt(G);

  if (ldlt.info() != Eigen::Success) return true;
  v = start;
  for (int k = 0; k < 30; k++) {
    v     = G * v;
    large = v.norm();
    v /= large;
  }
  v = start;
  for (int k = 0; k < 30; k++) {
    v     = LongColumn(ldlt.solve(v));
    small = 1.0L / v.norm();
    v *= small;
  }
  return !(small > 1e-12L * large);
}

SaddleVerdict StructuredJudge(const Structured &s, const StructuredFacts &facts, Answer &a)
{
  const double beyond = asked / PETSC_MACHINE_EPSILON;
  const Whole  w(s);

  if (a.agreed && a.solved && s.refuse) {
    a.said += "; nothing says what some unknowns are";
    return SADDLE_WRONG;
  }
  if (w.N <= dense) return SaddleJudge(DenseTwin(s), facts, !(a.said.empty() && s.outer), a, beyond);
  if (!a.agreed) {
    a.said += "; ranks disagree";
    return SADDLE_WRONG;
  }
  if (!a.solved) {
    const SaddleTraits traits{s.solvable,           s.unique,
                              s.symmetric,          s.convention == NEGATED,
                              [] { return false; }, [&s] { return NearlyDependent(s); }};

    if (facts.decided && !(a.said.empty() && s.outer) && !SaddleSaysTrue(traits, a.said)) return SADDLE_UNTRUE;
    return facts.decided && s.solvable && s.unique ? SADDLE_OWED : SADDLE_REFUSED;
  }
  LongColumn y(w.N), size;

  y << a.x.cast<long double>(), (s.convention == OPPOSITE ? -1.0L : 1.0L) * a.lambda.cast<long double>();
  const LongColumn residual = w.Residual(y.cwiseQuotient(w.columns), &size);

  a.residual = Worst(residual, size);
  a.error    = SaddleError(facts, a.x);
  if (!(a.residual <= residualBound)) return SADDLE_WRONG;
  if (!facts.decided) return SADDLE_RIGHT;
  if (!s.solvable) return SADDLE_WRONG;
  if (!s.unique || a.error <= std::max(errorBound, beyond * facts.reach)) return SADDLE_RIGHT;
  Eigen::SparseLU<Columns<long double>, Eigen::AMDOrdering<int>> other; /* with more digits and other pivots */
  StructuredFacts                                                again   = facts;
  long double                                                    reached = 1.0L, last = 1.0L;

  if (!Refine(s, w, other, y, &reached, &last)) return SADDLE_RIGHT;
  again.x    = w.columns.head(w.n).cwiseProduct(y.head(w.n)).cast<double>();
  again.size = (double)reached;
  return SaddleError(again, a.x) <= std::max(errorBound, beyond * facts.reach) ? SADDLE_RIGHT : SADDLE_WRONG;
}
