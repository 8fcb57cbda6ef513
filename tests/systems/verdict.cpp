/* Is what a refusal says true? Each phrase that may be said, and of which systems it holds */
#include "systems.h"

static const double nearly = 1e-6; /* the singular values of rows that may be called nearly dependent, relative to the largest */

/* The rows of [C L], D = L L', scaled to size 1; those that are zero are left out */
static Matrix Rows(const Saddle &s)
{
  const bool       any = s.D.size() > 0 && s.D.norm() > 0.0;
  Matrix           all = s.C * s.A.diagonal().cwiseAbs().cwiseMax(1e-12 * s.A.diagonal().cwiseAbs().maxCoeff()).cwiseSqrt().cwiseInverse().asDiagonal();
  std::vector<int> kept;

  if (any) {
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen(s.D);
    const Matrix                                L = eigen.eigenvectors() * eigen.eigenvalues().cwiseAbs().cwiseSqrt().asDiagonal();
    Matrix                                      both(all.rows(), all.cols() + L.cols());

    both << all, L;
    all = both;
  }
  for (Eigen::Index i = 0; i < all.rows(); i++)
    if (all.row(i).norm() > 0.0) kept.push_back((int)i);
  all = Matrix(all(kept, Eigen::all));
  for (Eigen::Index i = 0; i < all.rows(); i++) all.row(i).normalize();
  return all;
}

static bool NearlyDependent(const Saddle &s)
{
  const Matrix rows = Rows(s);

  if (rows.rows() > rows.cols()) return true;
  const Vector values = Eigen::JacobiSVD<Matrix>(rows).singularValues();
  return values.size() && values[values.size() - 1] < nearly * values[0];
}

/*
   Of A on Ker C, where D is not 0 of diag(A, I) on Ker [C L], -I where D is negative: if it is definite, the whole has as many negative eigenvalues as
   rows, less those of D that are negative
*/
bool SaddleIndefinite(const Saddle &s)
{
  const Eigen::Index n = s.A.rows(), m = s.C.rows();
  Matrix             K        = Matrix::Zero(n + m, n + m);
  Eigen::Index       negative = 0, other = 0;

  if (s.B != s.C || s.A != s.A.transpose()) return true; /* the word says nothing wrong there */
  K.topLeftCorner(n, n)    = s.A;
  K.bottomLeftCorner(m, n) = s.C;
  K.topRightCorner(n, m)   = s.C.transpose();
  if (s.D.size()) {
    K.bottomRightCorner(m, m) = -s.D;
    for (double v : Vector(Eigen::SelfAdjointEigenSolver<Matrix>(s.D, Eigen::EigenvaluesOnly).eigenvalues())) other += v < -1e-12 * s.D.norm();
  }
  for (int sweep = 0; sweep < 10; sweep++) {
    Vector d = K.cwiseAbs().rowwise().maxCoeff();
    for (double &v : d) v = v > 0.0 ? 1.0 / std::sqrt(v) : 1.0;
    K = d.asDiagonal() * K * d.asDiagonal();
  }
  const Vector values = Eigen::SelfAdjointEigenSolver<Matrix>(K, Eigen::EigenvaluesOnly).eigenvalues();
  for (double v : values) negative += v < -1e-12 * values.cwiseAbs().maxCoeff();
  return negative > m - other;
}

static const struct {
  const char *said;
  bool (*holds)(const Saddle &, const Facts &);
} phrases[] = {
  {"no solution exists",         [](const Saddle &,  const Facts &f) { return !f.solvable; }                                                  },
  {"contradict",                 [](const Saddle &,  const Facts &f) { return !f.solvable; }                                                  },
  {"not that of the other rows", [](const Saddle &,  const Facts &f) { return !f.solvable; }                                                  },
  {"body floats",                [](const Saddle &,  const Facts &f) { return !f.unique; }                                                    },
  {"singular on Ker C",          [](const Saddle &,  const Facts &f) { return !f.unique; }                                                    },
  {"is indefinite",              [](const Saddle &s, const Facts &) { return SaddleIndefinite(s); }                                           },
  {"is not symmetric",           [](const Saddle &s, const Facts &) { return s.A != s.A.transpose(); }                                        },
  {"linearly dependent",         [](const Saddle &s, const Facts &) { return NearlyDependent(s); }                                            },
  {"linear combinations",        [](const Saddle &s, const Facts &) { return NearlyDependent(s); }                                            },
  {"seems to be -A",             [](const Saddle &s, const Facts &) { return s.convention == NEGATED; }                                       },
  {"is not the transpose of C",  [](const Saddle &s, const Facts &) { return s.B != s.C; }                                                    },
  {"is not the adjoint of C",    [](const Saddle &s, const Facts &) { return s.B != s.C; }                                                    },
  {"is not diagonal",            [](const Saddle &s, const Facts &) { return !Matrix(s.D - Matrix(s.D.diagonal().asDiagonal())).isZero(0.0); }},
  {"whose row of C is not zero", [](const Saddle &s, const Facts &) { return s.convention != PLAIN || (s.D.size() && s.D.minCoeff() < 0.0); } },
 /* a failure to do what can be done, said as what it is */
  {"without convergence",        [](const Saddle &,  const Facts &) { return true; }                                                          },
  {"stagnates",                  [](const Saddle &,  const Facts &) { return true; }                                                          },
  {"is not positive definite",   [](const Saddle &,  const Facts &) { return true; }                                                          },
  {"do not converge",            [](const Saddle &,  const Facts &) { return true; }                                                          },
  {"is not met",                 [](const Saddle &,  const Facts &) { return true; }                                                          },
  {"does not see this",          [](const Saddle &,  const Facts &) { return true; }                                                          }
};

bool SaddleSaysTrue(const Saddle &s, const Facts &facts, const std::string &text)
{
  bool any = false;

  for (const auto &phrase : phrases) {
    if (text.find(phrase.said) == std::string::npos) continue;
    if (!phrase.holds(s, facts)) return false;
    any = true;
  }
  return any; /* what says nothing that is known says nothing true */
}
