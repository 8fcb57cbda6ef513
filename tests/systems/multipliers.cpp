/* The layouts in which programs keep rows that are not active, double multipliers, and signs of their own */
#include "contact.h"

/*
   The textbook's primal-dual active set: rows of inactive nodes say lambda_i = value, and their columns stay in B'.
   plus: the entry on the diagonal is +1, as the textbook has it, otherwise -1
*/
static void ActiveSet(Saddle &s, double active, double value, bool plus)
{
  Random             r = SaddleRandom(s.name);
  const Eigen::Index m = s.C.rows();

  s.D = Matrix::Zero(m, m);
  for (Eigen::Index i = 0; i < m; i++) {
    if ((7 * i + 3) % 10 < 10 * active) continue;
    s.C.row(i).setZero();
    s.D(i, i) = plus ? -1.0 : 1.0;
    s.g[i]    = value * (double)r.Real(-1.0, 1.0);
  }
}

/* Prescribed unknowns as rows of an identity whose columns stay in place, as a PETSc program gets from MatZeroRows() */
static void ZeroRows(Saddle &s, int count, double value)
{
  const Eigen::Index n = s.A.rows();

  for (int k = 0; k < count; k++) { /* the last unknowns, of the top of the upper block */
    const Eigen::Index i = n - 1 - k;

    s.A.row(i).setZero();
    s.B.col(i).setZero();
    s.A(i, i) = 1.0;
    s.f[i]    = value * (k + 1);
  }
}

/*
   Two multipliers for each row of C, lambda_1 + lambda_2, tied to each other by a: [[-a, a], [a, -a]] and rows a C, as
   code_aster has them
*/
static void Double(Saddle &s, double a, bool interleaved)
{
  const Eigen::Index m = s.C.rows();
  Matrix             C(2 * m, s.C.cols()), D = Matrix::Zero(2 * m, 2 * m);
  Vector             g(2 * m);

  for (Eigen::Index i = 0; i < m; i++) {
    const Eigen::Index one = interleaved ? 2 * i : i, two = interleaved ? 2 * i + 1 : m + i;

    C.row(one) = C.row(two) = a * s.C.row(i);
    g[one] = g[two] = a * s.g[i];
    D(one, one) = D(two, two) = a;
    D(one, two) = D(two, one) = -a;
  }
  s.B = s.C = C;
  s.D       = D;
  s.g       = g;
}

void AddMultipliers(Entries &all)
{
  auto add = [&](const char *family, const std::string &name, const std::function<void(Saddle &)> &change) {
    all.push_back({family, name, [=](Saddle &s) {
                     ContactMake(s, BlocksMake(10, 8, 10.0));
                     change(s);
                   }});
  };

  add("active set", "active_90", [](Saddle &s) { ActiveSet(s, 0.9, 0.0, true); });
  add("active set", "active_50", [](Saddle &s) { ActiveSet(s, 0.5, 0.0, true); });
  add("active set", "active_50_minus", [](Saddle &s) { ActiveSet(s, 0.5, 0.0, false); });
  add("active set", "active_50_values", [](Saddle &s) { ActiveSet(s, 0.5, 0.02, true); });
  add("active set", "active_30_compliant", [](Saddle &s) {
    ActiveSet(s, 0.3, 0.0, false);
    for (Eigen::Index i = 0; i < s.D.rows(); i++)
      if (s.D(i, i) == 0.0) s.D(i, i) = 1e-6;
    s.C.row(0) = s.B.row(0); /* one is active for sure */
    s.D(0, 0)  = 1e-6;
  });
  add("active set", "active_none", [](Saddle &s) {
    s.A.diagonal().array() += 1e-3; /* nothing else holds the upper block */
    ActiveSet(s, 0.0, 0.0, true);
  });
  add("active set", "dirichlet_columns", [](Saddle &s) { ZeroRows(s, 3, 1e-3); });
  add("active set", "dirichlet_columns_active", [](Saddle &s) {
    ActiveSet(s, 0.6, 0.01, true);
    ZeroRows(s, 5, 1e-3);
  });
  add("active set", "dirichlet_columns_homogeneous", [](Saddle &s) { ZeroRows(s, 4, 0.0); });

  add("double multipliers", "double_1", [](Saddle &s) { Double(s, 1.0, true); });
  add("double multipliers", "double_stacked", [](Saddle &s) { Double(s, 20.0, false); });
  add("double multipliers", "double_pascal", [](Saddle &s) {
    s.A *= 210e9;
    s.f *= 210e9;
    Double(s, 1e11, true);
  });
  add("double multipliers", "double_dependent", [](Saddle &s) {
    const Eigen::Index m = s.C.rows();

    s.C.conservativeResize(m + 1, Eigen::NoChange);
    s.g.conservativeResize(m + 1);
    s.C.row(m) = s.C.row(2);
    s.g[m]     = s.g[2];
    Double(s, 4.0, true);
  });

  for (double stiff : {1e3, 1e-3}) /* D = -1 on most rows: definite on Ker C where A is stiff enough, otherwise not */
    add("signs", stiff > 1.0 ? "signs_identity" : "signs_identity_indefinite", [=](Saddle &s) {
      s.A *= stiff;
      s.f *= stiff;
      s.A.diagonal().array() += stiff;
      s.D       = -Matrix::Identity(s.C.rows(), s.C.rows());
      s.D(3, 3) = 0.0;
    });

  const struct {
    const char *name;
    Convention  convention;
    bool        first;
  } conventions[] = {
    {"negated",       NEGATED,  false},
    {"flipped",       FLIPPED,  false},
    {"opposite",      OPPOSITE, false},
    {"first",         PLAIN,    true },
    {"negated_first", NEGATED,  true },
    {"flipped_first", FLIPPED,  true }
  };
  for (const auto &c : conventions) {
    add("signs", std::string("signs_") + c.name, [=](Saddle &s) {
      s.convention = c.convention;
      s.first      = c.first;
    });
    add("signs", std::string("signs_") + c.name + "_D", [=](Saddle &s) {
      s.convention = c.convention;
      s.first      = c.first;
      s.D          = Matrix::Identity(s.C.rows(), s.C.rows()) * 1e-3;
    });
  }

  /* nodes against every segment: more rows than unknowns, nearly all inactive */
  add("many rows", "rows_inactive", [](Saddle &s) {
    const Eigen::Index n = s.A.rows(), m = s.C.rows(), all = n + 40;
    Random             r = SaddleRandom(s.name);
    Matrix             B = Matrix::Zero(all, n), C = Matrix::Zero(all, n), D = Matrix::Identity(all, all);
    Vector             g = Vector::Zero(all);

    B.topRows(m) = C.topRows(m) = s.C;
    g.head(m)                   = s.g;
    D.topLeftCorner(m, m).setZero();
    for (Eigen::Index i = m; i < all; i++) B.row(i) = SparseRows(r, 1, (int)n, 3);
    s.B = B;
    s.C = C;
    s.D = -D;
    s.g = g;
  });
  add("many rows", "rows_compliant", [](Saddle &s) { /* compliance everywhere: every row may stay */
                                                     const Eigen::Index n = s.A.rows(), m = s.C.rows();
                                                     Random             r = SaddleRandom(s.name);
                                                     Matrix             C(n + 30, n);

                                                     C.topRows(m)             = s.C;
                                                     C.bottomRows(n + 30 - m) = SparseRows(r, (int)(n + 30 - m), (int)n,
                                                                                           2);
                                                     s.B = s.C = C;
                                                     s.D       = Logs(r, (int)C.rows(), -2.0, 6.0);
                                                     s.g       = Vector::Zero(C.rows());
  });
}
