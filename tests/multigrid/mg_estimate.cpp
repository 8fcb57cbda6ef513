static char
  help[] = "Largest eigenvalues from moments of Chebyshev polynomials: those of quadrature and of the Lanczos "
           "process.\n\n";

#include "lattice.h"
#include "../../src/multigrid/moments.h"
#include <cmath>
#include <random>

typedef std::vector<long double> Numbers;

/* (v, T_k(X) v), X = 2 d / interval - 1, where each product has this relative error */
static std::vector<PetscReal> Moments(const Numbers &d, const Numbers &v, long double interval, int steps, double error)
{
  std::mt19937                           random(5);
  std::uniform_real_distribution<double> noise(-error, error);
  std::vector<double>                    before(v.size()), now(v.begin(), v.end()), next(v.size());
  std::vector<PetscReal>                 m(2 * steps);

  for (int k = 0; k < steps; k++) {
    double same = 0.0, other = 0.0;

    for (size_t l = 0; l < v.size(); l++) {
      const double x = (double)(2 * d[l] / interval) * now[l] * (1.0 + noise(random)) - now[l];

      next[l] = k ? 2 * x - before[l] : x;
      same += now[l] * now[l];
      other += now[l] * next[l];
    }
    m[2 * k]     = k ? 2 * same - m[0] : same;
    m[2 * k + 1] = k ? 2 * other - m[1] : other;
    before.swap(now);
    now.swap(next);
  }
  return m;
}

/* The largest Ritz value of the Lanczos process with full orthogonalization */
static double Lanczos(const Numbers &d, const Numbers &v, int steps)
{
  std::vector<Numbers> q(1, v);
  Eigen::MatrixXd      t     = Eigen::MatrixXd::Zero(steps, steps);
  auto                 inner = [](const Numbers &a, const Numbers &b) {
    long double sum = 0.0;

    for (size_t l = 0; l < a.size(); l++) sum += a[l] * b[l];
    return sum;
  };

  for (int k = 0; k < steps; k++) {
    const long double norm = std::sqrt(inner(q[k], q[k]));
    Numbers           z;

    for (size_t l = 0; l < d.size(); l++) z.push_back(d[l] * (q[k][l] /= norm));
    if (k) t(k - 1, k) = t(k, k - 1) = (double)norm;
    t(k, k) = (double)inner(z, q[k]);
    for (int twice = 0; twice < 2; twice++)
      for (const Numbers &p : q) {
        const long double part = inner(p, z);

        for (size_t l = 0; l < d.size(); l++) z[l] -= part * p[l];
      }
    q.push_back(z);
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(t, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

static std::vector<std::pair<const char *, Numbers>> Spectra()
{
  Numbers even, cube, few;

  for (int i = 0; i < 3000; i++) even.push_back((i + 0.5L) / 3000.0L);
  for (int i = 0; i < 14 * 14 * 14; i++) { /* the Laplacian of a cube */
    long double sum = 0.0;

    for (int j : {i % 14, i / 14 % 14, i / 196}) sum += 1.0L - std::cos(std::acos(-1.0L) * (j + 1) / 15.0L);
    cube.push_back(sum / 6.0L);
  }
  for (int i = 0; i < 3000; i++) few.push_back(i < 2995 ? i / 6000.0L : 0.55L + 0.09L * (i - 2994));
  return {
    {"even",      even},
    {"cube",      cube},
    {"few above", few }
  };
}

int main(int argc, char **argv)
{
  const int steps = 10;
  int       exitcode;
  PetscReal found;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  Case("quadrature of Gauss and Legendre");
  std::vector<PetscReal> even;
  for (int k = 0; k < 2 * steps; k++) even.push_back(k % 2 ? 0.0 : 2.0 / (1.0 - k * k));
  PetscCall(AinsworthMomentsFindLargest(even, &found));
  PetscCall(Check("the largest of ten points", PetscAbsReal(found - 0.973906528517171720), 1e-13));

  Case("no vector");
  PetscCall(AinsworthMomentsFindLargest(std::vector<PetscReal>(2 * steps, 0.0), &found));
  PetscCall(Check("nothing is found", PetscAbsReal(found + 1.0), 0.0));

  Case("no numbers");
  PetscCall(AinsworthMomentsFindLargest(std::vector<PetscReal>(2 * steps, std::nan("")), &found));
  PetscCall(Check("nothing is found", PetscAbsReal(found + 1.0), 0.0));

  Case("an eigenvector");
  PetscCall(AinsworthMomentsFindLargest(Moments({0.75L}, {2.0L}, 1.0L, steps, 0.0), &found));
  PetscCall(Check("its eigenvalue", PetscAbsReal(found - 0.5), 1e-14));

  for (const auto &[name, d] : Spectra()) {
    std::mt19937                           random(3);
    std::uniform_real_distribution<double> start(-1.0, 1.0);
    Numbers                                v;
    const double                           largest = (double)*std::max_element(d.begin(), d.end());

    while (v.size() < d.size()) v.push_back(start(random));
    const double lanczos = Lanczos(d, v, steps);
    for (double times : {0.3, 0.6, 1.0, 2.0, 10.0, 1e3, 1e40})
      for (double error : {0.0, 6e-8}) {
        const double interval = largest / times;
        const double least    = times >= 0.6 && times <= 2.0 ? 0.97
                                : times <= 10.0              ? 0.95
                                : times <= 1e3               ? 0.9
                                                             : 0.4; /* moments overflow */

        Case("%s, %g times the interval, products to %g", name, times, error);
        PetscCall(AinsworthMomentsFindLargest(Moments(d, v, interval, steps, error), &found));
        found = interval * (found + 1.0) / 2.0;
        PetscCall(Check("no more than the largest eigenvalue", found / largest, 1.0 + 1e-6));
        PetscCall(Check("nearly what the Lanczos process finds", lanczos / found, 1.0 / least));
      }
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
