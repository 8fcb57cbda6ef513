#include "randomsaddle.h"

/* A, and most rows of C, are those of a random system of constraints alone */
RandomSaddle::RandomSaddle(Random &r)
{
  const RandomSystem base(r, false);

  s.name = "fuzz";
  s.A    = base.A.real();
  s.B = s.C = base.C.real();
  s.bs      = base.bs;
  s.first   = r.Chance(0.3);
  symmetric = base.symmetric;
  tame      = !base.difficult && base.decades <= 6.0;
  text      = base.text;
  Rows(r);
  Massless(r);
  Compliance(r);
  OneSided(r);
  Asymmetry(r);
  Fixed(r);
  RightHandSide(r);
  if (r.Chance(0.3)) s.convention = (Convention)r.Int(NEGATED, OPPOSITE);
  if (s.convention != PLAIN) text += " convention " + std::to_string(s.convention);
  SaddleStore(s);
  Options(r);
}

/* Now and then more rows than unknowns */
void RandomSaddle::Rows(Random &r)
{
  const int n = (int)s.A.rows(), m = (int)s.C.rows();

  if (!r.Chance(0.2)) return;
  const int more = r.Int(1, 2 * n);

  s.C.conservativeResize(m + more, n);
  for (int i = m; i < m + more; i++) {
    s.C.row(i).setZero();
    for (int k = r.Int(1, 3); k > 0; k--) s.C(i, r.Int(0, n - 1)) = r.Int(0, 1) ? (double)r.Real(-1.0, 1.0) : 1.0;
  }
  s.B = s.C;
  text += " rows=" + std::to_string(m + more);
}

/* Zero rows of A, some of whose unknowns are in no row of C, either */
void RandomSaddle::Massless(Random &r)
{
  const int n = (int)s.A.rows(), m = (int)s.C.rows();
  int       count = 0;

  if (!m || !r.Chance(0.2)) return;
  for (int i = 0; i < n; i++) {
    if (!r.Chance(0.2) || count > n / 2) continue;
    s.A.row(i).setZero();
    s.A.col(i).setZero();
    s.C(count % m, i) = s.B(count % m, i) = 1.0;
    count++;
  }
  if (s.A.isZero(0.0)) s.A(0, 0) = 1.0; /* no A at all is an error of its own */
  text += " massless=" + std::to_string(count);
}

/*
   D over some decades, one in ten over 60, with zeros mixed in, or sparse and semidefinite; seldom an entry of the
   other sign
*/
void RandomSaddle::Compliance(Random &r)
{
  const int    m     = (int)s.C.rows();
  const double wide  = !r.Chance(0.5)   ? (double)r.Real(0.0, 20.0)
                       : s.A.rows() % 5 ? 8.0
                                        : 30.0,
               zeros = r.Chance(0.5) ? 0.0 : (double)r.Real(0.0, 1.0);

  if (!m || r.Chance(0.25)) return;
  s.D = Matrix::Zero(m, m);
  if (r.Chance(0.25)) {
    const double size = std::pow(10.0, (double)r.Real(-wide, wide) / 2.0);

    for (int k = r.Int(1, m); k > 0; k--) {
      Vector l = Vector::Zero(m);

      for (int j = r.Int(1, 3); j > 0; j--) l[r.Int(0, m - 1)] = (double)r.Int(-4, 4) / 4.0;
      s.D += l * l.transpose();
    }
    s.D *= size * size;
    text += " D=sparse";
  } else {
    for (int i = 0; i < m; i++)
      if (!r.Chance(zeros)) s.D(i, i) = std::pow(10.0, (double)r.Real(-wide, wide));
    text += " D=1e" + std::to_string((int)wide);
  }
  if (r.Chance(0.05)) {
    const int i = r.Int(0, m - 1);

    s.D(i, i) = -s.D(i, i);
    tame      = tame && s.D(i, i) == 0.0;
    text += " D<0";
  }
}

/* Rows of C that say lambda = value, with their columns left in B' */
void RandomSaddle::OneSided(Random &r)
{
  const int    m     = (int)s.C.rows();
  const double share = (double)r.Real(0.0, 1.0);

  if (!m || !r.Chance(0.2)) return;
  if (!s.D.size()) s.D = Matrix::Zero(m, m);
  for (int i = 0; i < m; i++) {
    if (!r.Chance(share)) continue;
    s.C.row(i).setZero();
    s.D.row(i).setZero();
    s.D.col(i).setZero();
    s.D(i, i) = r.Chance(0.5) ? -1.0 : (double)r.Real(0.1, 10.0);
  }
  text += " one-sided";
}

/* B off by a share of each value, or with the rows of a friction of its own */
void RandomSaddle::Asymmetry(Random &r)
{
  const double share    = (double)r.Real(0.0, 1.0);
  const bool   friction = r.Chance(0.5);

  if (!r.Chance(0.25)) return;
  for (Eigen::Index i = 0; i < s.B.rows(); i++) {
    if (friction) {
      if (!s.C.row(i).isZero(0.0))
        s.B(i, r.Int(0, (int)s.B.cols() - 1)) += share * s.C.row(i).norm() * (double)r.Real(-1.0, 1.0);
    } else
      for (Eigen::Index j = 0; j < s.B.cols(); j++) s.B(i, j) *= 1.0 + share * (double)r.Real(-1.0, 1.0);
  }
  symmetric = symmetric && s.B == s.C;
  text += friction ? " friction" : " asymmetric";
  text += "=" + std::to_string(share);
}

/* Rows of A that say x = value, with their columns left in A */
void RandomSaddle::Fixed(Random &r)
{
  if (!r.Chance(0.08)) return;
  for (int k = r.Int(1, 3); k > 0; k--) {
    const int i = r.Int(0, (int)s.A.rows() - 1);

    s.A.row(i).setZero();
    s.B.col(i).setZero();
    s.A(i, i) = 1.0;
  }
  symmetric = false;
  text += " fixed";
}

void RandomSaddle::RightHandSide(Random &r)
{
  const int    n = (int)s.A.rows(), m = (int)s.C.rows();
  const Vector x = Uniform(r, n);
  Vector       lambda(m);

  for (int i = 0; i < m; i++) { /* so that neither B' lambda nor D lambda is all that there is */
    const double b = s.B.row(i).norm(), c = s.C.row(i).norm(), d = s.D.size() ? s.D.row(i).cwiseAbs().maxCoeff() : 0.0;

    lambda[i] = (double)r.Real(-1.0, 1.0);
    if (d > 0.0) lambda[i] *= std::min(1.0, (c > 0.0 ? c : 1.0) / d);
    if (b > 1.0) lambda[i] /= b;
  }
  s.f = s.A * x + s.B.transpose() * lambda;
  s.g = s.C * x;
  if (s.D.size()) s.g -= s.D * lambda;
  if (r.Chance(0.15)) s.g.setZero();
  if (r.Chance(0.15)) s.f = Uniform(r, n).cwiseProduct(s.A.diagonal().cwiseAbs());
  if (r.Chance(0.05))
    for (int i = 0; i < m; i++) s.g[i] = s.C.row(i).norm() * (double)r.Real(-1.0, 1.0);
}

/* Methods with the norms that they have; tame are those that solve what conjugate gradients or GMRES do */
static const struct {
  const char *type, *more;
  bool        asymmetric, tame;
} methods[] = {
  {"cg",         "",                                                              false, true },
  {"cg",         "-ainsworth_ksp_norm_type natural",                              false, true },
  {"cg",         "-ainsworth_ksp_norm_type unpreconditioned",                     false, true },
  {"fcg",        "-ainsworth_ksp_norm_type natural",                              false, true },
  {"minres",     "",                                                              false, false},
  {"symmlq",     "",                                                              false, false},
  {"cr",         "",                                                              false, false},
  {"gmres",      "-ainsworth_ksp_gmres_restart 200",                              true,  true },
  {"gmres",      "-ainsworth_ksp_gmres_restart 200 -ainsworth_ksp_pc_side right", true,  true },
  {"fgmres",     "-ainsworth_ksp_gmres_restart 200",                              true,  true },
  {"lgmres",     "",                                                              true,  false},
  {"gcr",        "",                                                              true,  false},
  {"bcgs",       "",                                                              true,  false},
  {"bcgs",       "-ainsworth_ksp_pc_side right",                                  true,  false},
  {"ibcgs",      "",                                                              true,  false},
  {"tfqmr",      "",                                                              true,  false},
  {"richardson", "-ainsworth_ksp_max_it 100",                                     true,  false}
};

void RandomSaddle::Options(Random &r)
{
  static const char *const pmats[] = {"jcb", "id", "cc", "cg", "bj_cc", "bj_cg"};

  options = "-ainsworth_ksp_rtol 1e-12";
  /* with D on its other side A is as good a D itself, unless an entry has the other sign, or squares of it overflow */
  if (s.D.size() && (s.D.minCoeff() < 0.0 || (s.convention != PLAIN && (r.Chance(0.5) || s.D.maxCoeff() > 1e20 ||
                                                                        s.D.diagonal().minCoeff() < 1e-20))))
    options += std::string(" -pc_ainsworth_multiplier_fields ") + (s.first ? "0" : "1");
  if (r.Chance(0.3)) options += std::string(" -pc_ainsworth_pmat ") + pmats[r.Int(0, 5)];
  if (r.Chance(0.1)) {
    options += " -pc_ainsworth_weight identity";
    tame = false;
  }
  if (r.Chance(0.2)) options += " -pc_ainsworth_rows_per_rank " + std::to_string(r.Int(1, 4));
  switch (r.Int(0, 5)) {
  case 0:
    options += " -ainsworth_pc_type jacobi";
    break;
  case 1:
    /* LU, which takes small pivots for zero, whatever the scale */
    options += " -ainsworth_pc_type redundant -ainsworth_redundant_pc_factor_zeropivot 1e-300";
    break;
  default:
    break;
  }
  if (r.Chance(0.4)) {
    const auto &method = methods[r.Int(0, (int)(sizeof(methods) / sizeof(methods[0])) - 1)];

    options += std::string(" -ainsworth_ksp_type ") + method.type + " " + method.more;
    tame = tame && method.tame && (symmetric || method.asymmetric);
  }
}

bool RandomSaddlePromised(const RandomSaddle &p, const Facts &facts)
{
  static const double good = 1e-10; /* error in x that rounding the system may cause */

  return p.tame && facts.decided && facts.solvable && facts.unique && facts.reach < good &&
         (!p.symmetric || !SaddleIndefinite(p.s));
}
