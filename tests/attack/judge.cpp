/* The verdict on an answer, by dense linear algebra on the system in units of its own */
#include "attack.h"

/*
   Each equation i holds if its residual is at most residualBound (|K| |y| + |b|)_i, or that of the rounding of the
   largest in the scaled system. The error in x, relative to x and lambda, is at most errorBound times the condition
   number, where this is below the third figure. A solution is promised where condition numbers are below the fourth and
   the smallest eigenvalue on Ker C, in units of the largest, is above its inverse.
*/
static const PetscReal residualBound = 1e-5, errorBound = 1e-6, trusted = 1e6, good = 1e4, local = 1e-3,
                       zeroRow = 1000 * PETSC_MACHINE_EPSILON, rounding = 1e-14;

/* A = a A', (f, g) = (a b f', b g'): then x = b x', lambda = a b lambda', D = D' / a */
struct Units {
  PetscReal a, b;
};

static Units FindUnits(const RandomSystem &s)
{
  Units u = {s.A.cwiseAbs().maxCoeff(), 0.0};

  if (u.a == 0.0) u.a = 1.0;
  u.b = s.f.cwiseAbs().maxCoeff() / u.a;
  for (Eigen::Index i = 0; i < s.g.size(); i++) {
    const PetscReal row = s.C.row(i).cwiseAbs().maxCoeff(), entry = PetscAbsScalar(s.g[i]);

    u.b = PetscMax(u.b, row > 0.0 ? entry / row : entry);
  }
  if (u.b == 0.0) u.b = 1.0;
  return u;
}

static RandomSystem Normalised(const RandomSystem &s, const Units &u)
{
  RandomSystem t = s;

  t.A /= u.a;
  t.D *= u.a;
  t.f = s.f / u.a / u.b;
  t.g = s.g / u.b;
  return t;
}

bool AttackAdjoint(const RandomSystem &s)
{
  return s.Ct == s.C.adjoint() && s.D == s.D.adjoint();
}

static bool Finite(const RandomSystem &s)
{
  return s.A.allFinite() && s.C.allFinite() && s.f.allFinite() && s.g.allFinite();
}

/*
   Is A, with the rows that are eliminated, semidefinite, and definite enough on Ker C for a failure to be none of its
   fault?
*/
static bool Definite(const RandomSystem &s, const Truth &truth)
{
  const Eigen::Index n = s.A.rows(), m = s.C.rows();
  const Column       scale = truth.scale.head(n);
  Dense              A     = scale.asDiagonal() * s.A * scale.asDiagonal(),
        C                  = truth.scale.tail(m).asDiagonal() * s.C * scale.asDiagonal();

  for (Eigen::Index i = 0; i < m; i++) {
    if (PetscRealPart(s.D(i, i)) > 0.0 && C.row(i).norm() > 0.0) return false;
    if (PetscRealPart(s.D(i, i)) < 0.0 && C.row(i).norm() > 0.0) {
      const PetscReal d = -PetscRealPart(s.D(i, i)) * PetscSqr(PetscRealPart(truth.scale[n + i]));

      A += C.row(i).adjoint() * C.row(i) / d;
      C.row(i).setZero();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Dense> whole(A);

  if (whole.eigenvalues()[0] < -1e-10 * whole.eigenvalues()[n - 1]) return false;
  if (!m || C.norm() == 0.0) return whole.eigenvalues()[0] > whole.eigenvalues()[n - 1] / good;
  Eigen::JacobiSVD<Dense> svd(C, Eigen::ComputeFullV);

  svd.setThreshold(1e-11);
  if (svd.rank() == n) return true;
  const Dense                                Z = svd.matrixV().rightCols(n - svd.rank());
  const Eigen::SelfAdjointEigenSolver<Dense> kernel(Z.adjoint() * A * Z);
  return kernel.eigenvalues()[0] > whole.eigenvalues()[n - 1] / good;
}

/* Row i of C is zero: does its right-hand side contradict it, or is that rounding? */
static bool IsZeroRow(const RandomSystem &s, Eigen::Index i, bool contradicts)
{
  return s.C.row(i).isZero(0.0) && s.D(i, i) == 0.0 &&
         (PetscAbsScalar(s.g[i]) > zeroRow * s.g.cwiseAbs().maxCoeff()) == contradicts;
}

/*
   The worst row of both equations; a zero row has no scale of its own: what rounding of the other rows makes of its
   right-hand side is allowed
*/
static PetscReal WorstRow(const RandomSystem &s, const Truth &truth, const Column &x, const Column &lambda)
{
  const Eigen::Index n = s.A.rows(), m = s.C.rows();
  Column             r(n + m), size(n + m);
  PetscReal          worst = 0.0;

  r << s.A * x + s.Ct * lambda - s.f, s.C * x + s.D * lambda - s.g;
  size << s.A.cwiseAbs() * x.cwiseAbs() + s.Ct.cwiseAbs() * lambda.cwiseAbs() + s.f.cwiseAbs(),
    s.C.cwiseAbs() * x.cwiseAbs() + s.D.cwiseAbs() * lambda.cwiseAbs() + s.g.cwiseAbs();
  r                       = truth.scale.asDiagonal() * r;
  size                    = truth.scale.asDiagonal() * size;
  const PetscReal largest = size.cwiseAbs().maxCoeff();

  for (Eigen::Index i = 0; i < n + m; i++) {
    if (i >= n && IsZeroRow(s, i - n, false)) continue;
    const PetscReal relative = PetscAbsScalar(r[i]) / (PetscRealPart(size[i]) + local * largest + PETSC_SMALL);

    if (!(relative <= worst)) worst = relative; /* not a number, too */
  }
  return worst;
}

/* ||b - K y|| / ||b||, what an outer method promises */
static PetscReal WholeResidual(const RandomSystem &s, const Column &x, const Column &lambda)
{
  const Column f = s.A * x + s.Ct * lambda - s.f, g = s.C * x + s.D * lambda - s.g;

  return std::hypot(f.stableNorm(), g.stableNorm()) / std::hypot(s.f.stableNorm(), s.g.stableNorm());
}

Verdict AttackJudge(const RandomSystem &s, bool tame, bool must, bool tested, KSPConvergedReason reason,
                    const Column &x, const Column &lambda, std::string &why)
{
  char text[256];

  if (!tested && reason > 0 && s.f.isZero(0.0) && s.g.isZero(0.0) && x.isZero(0.0) && lambda.isZero(0.0)) {
    why = "nothing was asked for, and an outer method asked nobody else";
    return REFUSED;
  }
  if (!Finite(s)) {
    why = std::string("not finite, ") + KSPConvergedReasons[reason];
    return reason > 0 ? WRONG : REFUSED;
  }
  const Units        u = FindUnits(s);
  const RandomSystem t = Normalised(s, u);
  const Truth        truth(t);
  bool               usual = true; /* elimination loses digits where D is far from 1 / A: that has a reason */
  for (Eigen::Index i = 0; i < t.D.rows(); i++)
    usual = usual && (t.D(i, i) == 0.0 || (PetscAbsScalar(t.D(i, i)) > 1e-8 && PetscAbsScalar(t.D(i, i)) < 1e8));
  /* it may be small beside rows of other units */
  for (Eigen::Index i = 0; i < t.g.size(); i++) usual = usual && !IsZeroRow(t, i, true);
  usual               = usual && u.a > 1e-30 && u.a < 1e30;
  usual               = usual && s.D.isDiagonal(0.0); /* Definite() eliminates row by row */
  const bool adjoint  = AttackAdjoint(s);             /* otherwise the condition is that of another system */
  const bool promised = adjoint && usual && tame && !must && t.symmetric && truth.consistent && truth.unique &&
                        truth.condition < good && truth.gram < good && t.decades <= 6.0 && Definite(t, truth);
  PetscReal residual = 0.0, error = 0.0;

  if (reason > 0) {
    const Column px = x / u.b, pl = lambda / u.b / u.a;

    residual = WorstRow(t, truth, px, pl);
    error    = truth.Error(px);
  }
  (void)PetscSNPrintf(text, sizeof(text), "%s, worst row %g, error %g, condition %g, Gram %g, %s, %s",
                      KSPConvergedReasons[reason], (double)residual, (double)error, (double)truth.condition,
                      (double)truth.gram,
                      truth.contradictory ? "contradictory"
                      : truth.consistent  ? "consistent"
                                          : "nearly consistent",
                      truth.unique ? "unique" : "not unique");
  why = text;
  if (reason <= 0) return promised ? UNSOLVED : REFUSED;
  const bool wrong = must || (adjoint && truth.contradictory) || !(residual <= residualBound) ||
                     (adjoint && truth.unique && truth.consistent && truth.condition < trusted &&
                      !(error <= errorBound * truth.condition));
  if (!wrong) return RIGHT;
  const PetscReal load = PetscMax(s.f.size() ? s.f.cwiseAbs().maxCoeff() : 0.0,
                                  s.g.size() ? s.g.cwiseAbs().maxCoeff() : 0.0);
  /* an outer method squares its residual */
  const bool representable = load == 0.0 || (load > 1e-150 && load < 1e150);
  /* MINRES' bound of x */
  const bool promises = reason != KSP_CONVERGED_ITS && reason != KSP_CONVERGED_ATOL &&
                        reason != KSP_CONVERGED_STEP_LENGTH;
  const bool excused = !representable || !promises || residual <= residualBound || WholeResidual(s, x, lambda) <= 1e-3;
  return !tested && excused ? REFUSED : WRONG; /* another's promise */
}

bool AttackInternal(PetscErrorCode code, const std::string &message)
{
  /* what it calls an internal error is a matrix of zeros, or nearly */
  if (message.find("[PCGAMG") != std::string::npos) return false;
  switch (code) {
  case PETSC_ERR_ARG_NULL:
  case PETSC_ERR_ARG_CORRUPT:
  case PETSC_ERR_PLIB:
  case PETSC_ERR_SIG:
  case PETSC_ERR_MEM:
  case PETSC_ERR_MEMC:
  case PETSC_ERR_POINTER:
  case PETSC_ERR_ARG_NOTSAMECOMM:
    return true;
  default:
    return message.empty();
  }
}

/* Orthonormal columns that span the null space of [A C'; C D] */
Dense AttackNullSpace(const RandomSystem &s)
{
  const Eigen::Index n = s.A.rows(), m = s.C.rows();
  const Units        u = FindUnits(s);
  const RandomSystem t = Normalised(s, u);
  const Truth        truth(t);
  Dense              K(n + m, n + m);

  K << t.A, t.Ct, t.C, t.D;
  K = truth.scale.asDiagonal() * K * truth.scale.asDiagonal();
  if (!K.allFinite()) return Dense(n + m, 0);
  Eigen::JacobiSVD<Dense> svd(K, Eigen::ComputeFullV);

  svd.setThreshold(1e-11);
  const Eigen::Index dim = n + m - svd.rank();
  Dense              null(n + m, dim);

  for (Eigen::Index k = 0; k < dim; k++) {
    Column v = truth.scale.asDiagonal() * svd.matrixV().col(svd.rank() + k);

    v = v.unaryExpr([&v](PetscScalar entry) {
           return PetscAbsScalar(entry) < rounding * v.cwiseAbs().maxCoeff() ? PetscScalar(0.0) : entry;
         })
          .eval();
    v.tail(m) *= u.a;
    null.col(k) = v.stableNormalized();
  }
  if (!dim) return null;
  null = Eigen::HouseholderQR<Dense>(null).householderQ() * Dense::Identity(n + m, dim);
  /* traps.cpp has what it does to a soft A */
  return null.unaryExpr([](PetscScalar v) { return PetscAbsScalar(v) < rounding ? PetscScalar(0.0) : v; });
}
