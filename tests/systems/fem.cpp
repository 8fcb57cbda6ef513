/* Bilinear elements on rectangles, and small matrices that many generators need */
#include "systems.h"

/*
   calls each Gauss point of the reference element with the shape functions and their gradients, both times the root of
   its weight
*/
static void ForGauss(const Grid                                                                              &g,
                     const std::function<void(const Eigen::Vector4d &, const Eigen::Matrix<double, 4, 2> &)> &visit)
{
  const double hx = g.lx / g.nx, hy = g.ly / g.ny, root = std::sqrt(hx * hy / 4.0),
               at[2] = {0.5 - std::sqrt(1.0 / 12.0), 0.5 + std::sqrt(1.0 / 12.0)};

  for (double s : at)
    for (double t : at) {
      const Eigen::Vector4d       shape((1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t);
      Eigen::Matrix<double, 4, 2> gradient;

      gradient << -(1 - t) / hx, -(1 - s) / hy, (1 - t) / hx, -s / hy, -t / hx, (1 - s) / hy, t / hx, s / hy;
      visit(shape * root, gradient * root);
    }
}

/* adds an element matrix of `components` unknowns per node, for each element */
static Matrix Assemble(const Grid &g, int components, const Matrix &element, const Coefficient &factor)
{
  Matrix A = Matrix::Zero(components * g.Nodes(), components * g.Nodes());

  for (int j = 0; j < g.ny; j++)
    for (int i = 0; i < g.nx; i++) {
      const int nodes[4] = {g.Node(i, j), g.Node(i + 1, j), g.Node(i, j + 1), g.Node(i + 1, j + 1)};

      for (int a = 0; a < 4 * components; a++)
        for (int b = 0; b < 4 * components; b++)
          A(components * nodes[a / components] + a % components,
            components * nodes[b / components] + b % components) += factor(i, j) * (element(a, b) + element(b, a)) /
                                                                    2.0;
    }
  return A;
}

/* Rounded so that its rows sum up to 0 exactly, in whatever order: a domain that floats is singular, not nearly */
Matrix Laplacian(const Grid &g, const Coefficient &k)
{
  Matrix element = Matrix::Zero(4, 4);

  ForGauss(g, [&](const Eigen::Vector4d &, const Eigen::Matrix<double, 4, 2> &G) { element += G * G.transpose(); });
  Matrix       A    = Assemble(g, 1, element, k);
  const double unit = std::exp2(std::ceil(std::log2(A.maxCoeff())) - 40.0);

  A = (A / unit).array().round() * unit;
  A.diagonal().setZero();
  A.diagonal() = -A.rowwise().sum();
  return A;
}

Matrix Mass(const Grid &g)
{
  Matrix element = Matrix::Zero(4, 4);

  ForGauss(g, [&](const Eigen::Vector4d &N, const Eigen::Matrix<double, 4, 2> &) { element += N * N.transpose(); });
  return Assemble(g, 1, element, [](int, int) { return 1.0; });
}

Matrix PlaneStrain(const Grid &g, const Coefficient &E, double nu)
{
  Matrix          element = Matrix::Zero(8, 8);
  Eigen::Matrix3d H;

  H << 1 - nu, nu, 0, nu, 1 - nu, 0, 0, 0, 0.5 - nu;
  H /= (1 + nu) * (1 - 2 * nu);
  ForGauss(g, [&](const Eigen::Vector4d &, const Eigen::Matrix<double, 4, 2> &G) {
    Eigen::Matrix<double, 3, 8> strain = Eigen::Matrix<double, 3, 8>::Zero();

    for (int a = 0; a < 4; a++) {
      strain(0, 2 * a) = strain(2, 2 * a + 1) = G(a, 0);
      strain(1, 2 * a + 1) = strain(2, 2 * a) = G(a, 1);
    }
    element += strain.transpose() * H * strain;
  });
  return Assemble(g, 2, element, E);
}

void Clamp(Matrix &A, Vector &f, int unknown)
{
  const double d = A(unknown, unknown);

  A.row(unknown).setZero();
  A.col(unknown).setZero();
  A(unknown, unknown) = d;
  f[unknown]          = 0.0;
}

Matrix Diagonal(const std::vector<Matrix> &parts)
{
  Eigen::Index n = 0;

  for (const Matrix &M : parts) n += M.rows();
  Matrix all = Matrix::Zero(n, n);
  n          = 0;
  for (const Matrix &M : parts) {
    all.block(n, n, M.rows(), M.rows()) = M;
    n += M.rows();
  }
  return all;
}

Matrix Logs(Random &r, int n, double low, double high)
{
  Vector d(n);

  for (int i = 0; i < n; i++) d[i] = std::pow(10.0, (double)r.Real(low, high));
  return d.asDiagonal();
}

Matrix SparseRows(Random &r, int m, int n, int entries)
{
  Matrix C = Matrix::Zero(m, n);

  for (int i = 0; i < m; i++)
    for (int k = 0; k < entries; k++)
      C(i, k ? r.Int(0, n - 1) : i % n) += (double)r.Real(0.2, 1.0) * (r.Chance(0.5) ? 1.0 : -1.0);
  return C;
}

Vector Uniform(Random &r, int n)
{
  Vector v(n);

  for (int i = 0; i < n; i++) v[i] = (double)r.Real(-1.0, 1.0);
  return v;
}
