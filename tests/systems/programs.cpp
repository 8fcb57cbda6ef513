/* Quadratic programs and discretizations that were written after the method was, to see what it makes of them */
#include "systems.h"

/*
   min x'(F F' + diag) x / 2 - r'x with a budget, bounds on sectors, and the factors as unknowns of their own, y = F'x:
   massless rows where factors have no variance
*/
static void Portfolio(Saddle &s, int assets, int factors, double smallest, bool barrier)
{
  Random       r       = SaddleRandom(s.name);
  const int    sectors = 5, n = assets + factors, m = factors + 1 + sectors;
  const Matrix F = SparseRows(r, factors, assets, assets / 2) * 0.1;

  s.A = Matrix::Zero(n, n);
  for (int i = 0; i < assets; i++)
    s.A(i, i) = smallest * (1.0 + (double)r.Real(0.0, 9.0)) +
                (barrier ? std::pow(10.0, (double)r.Real(-8.0, 8.0)) : 0.0);
  for (int k = 0; k < factors; k++) s.A(assets + k, assets + k) = k % 4 ? (double)r.Real(0.5, 2.0) : 0.0;
  s.C                                = Matrix::Zero(m, n);
  s.C.topLeftCorner(factors, assets) = F;
  for (int k = 0; k < factors; k++) s.C(k, assets + k) = -1.0;
  s.C.row(factors).head(assets).setOnes();
  for (int i = 0; i < assets; i++) s.C(factors + 1 + i % sectors, i) = 1.0;
  s.B = s.C;
  s.D = Matrix::Zero(m, m);
  /* slack over multiplier */
  for (int k = 0; k < sectors; k++)
    s.D(factors + 1 + k, factors + 1 + k) = barrier ? std::pow(10.0, (double)r.Real(-6.0, 6.0)) : 0.1;
  s.f          = 0.1 * Uniform(r, n);
  s.g          = Vector::Zero(m);
  s.g[factors] = 1.0;
}

/*
   Interior point of a QP with fixed and free unknowns, as CUTEst's have: fixed ones as rows x_i = value among the
   constraints, free ones without any bound
*/
static void FixedAndFree(Saddle &s, int n, int fixed, int free, double decades)
{
  Random       r         = SaddleRandom(s.name);
  const int    equations = n / 4, inequalities = n / 3, m = equations + inequalities + fixed;
  const Matrix G = SparseRows(r, n / 3, n, 3);

  s.A = G.transpose() * G;
  for (int i = free; i < n; i++) s.A(i, i) += std::pow(10.0, (double)r.Real(-decades, decades));
  for (int i = 0; i < free; i++) s.A(i, i) += 1e-8; /* the method's own */
  s.C                                   = Matrix::Zero(m, n);
  s.C.topRows(equations + inequalities) = SparseRows(r, equations + inequalities, n, 4);
  for (int k = 0; k < fixed; k++) s.C(equations + inequalities + k, n - 1 - 2 * k) = 1.0;
  s.B = s.C;
  s.D = Matrix::Zero(m, m);
  for (int k = 0; k < inequalities; k++)
    s.D(equations + k, equations + k) = std::pow(10.0, (double)r.Real(-decades, decades));
  s.f = s.A.diagonal().cwiseSqrt().cwiseProduct(Uniform(r, n));
  s.g = s.C * s.A.diagonal().cwiseMax(1e-3).cwiseSqrt().cwiseInverse().cwiseProduct(Uniform(r, n));
}

/*
   Stokes with Q1 for both, stabilized by the differences of pressures of neighbors: a sparse D with the constants in
   its kernel
*/
static void Stabilized(Saddle &s, int cells, double viscosity, double weight)
{
  const Grid   grid = {cells, cells};
  const Matrix K    = Laplacian(grid, [=](int i, int) { return i < cells / 2 ? 1.0 : viscosity; });
  const int    N    = grid.Nodes();
  const double h    = 1.0 / cells;
  Random       r    = SaddleRandom(s.name);

  s.A = Diagonal({K, K});
  s.f = Uniform(r, 2 * N);
  s.C = Matrix::Zero(N, 2 * N);
  for (int j = 0; j < cells; j++) /* one point in each element */
    for (int i = 0; i < cells; i++) {
      const int    node[4] = {grid.Node(i, j), grid.Node(i + 1, j), grid.Node(i, j + 1), grid.Node(i + 1, j + 1)};
      const double dx[4] = {-1.0, 1.0, -1.0, 1.0}, dy[4] = {-1.0, -1.0, 1.0, 1.0};

      for (int p : node)
        for (int k = 0; k < 4; k++) {
          s.C(p, node[k]) -= 0.125 * h * dx[k];
          s.C(p, N + node[k]) -= 0.125 * h * dy[k];
        }
    }
  for (int j = 0; j <= cells; j++)
    for (int i = 0; i <= cells; i++) {
      if (i && j && i < cells && j < cells) continue;
      if (i == cells && j && j < cells) continue; /* an outflow */
      for (int c = 0; c < 2; c++) {
        Clamp(s.A, s.f, grid.Node(i, j) + c * N);
        s.C.col(grid.Node(i, j) + c * N).setZero();
        s.f[grid.Node(i, j) + c * N] = 0.0;
      }
    }
  s.B = s.C;
  s.D = weight * h * h * Laplacian(grid, [](int, int) { return 1.0; });
  s.g = Vector::Zero(N);
}

/*
   Darcy, fluxes through the faces of a grid of cells; Robin conditions are a pressure of the boundary with a leak: D on
   those rows
*/
static void Leaky(Saddle &s, int cells, double decades, double leak)
{
  Random    r     = SaddleRandom(s.name);
  const int faces = 2 * cells * (cells + 1), N = cells * cells, boundary = 4 * cells;

  s.A   = Logs(r, faces, -decades, decades);
  s.C   = Matrix::Zero(N + boundary, faces);
  int b = N;
  for (int j = 0; j < cells; j++)
    for (int i = 0; i <= cells; i++) {
      const int x = j * (cells + 1) + i, y = faces / 2 + x; /* of the other direction, with i and j exchanged */

      if (i < cells) s.C(j * cells + i, x) = s.C(i * cells + j, y) = -1.0;
      if (i) s.C(j * cells + i - 1, x) = s.C((i - 1) * cells + j, y) = 1.0;
      if (i && i < cells) continue;
      s.C(b++, x) = i ? -1.0 : 1.0;
      s.C(b++, y) = i ? -1.0 : 1.0;
    }
  s.B = s.C;
  s.D = Matrix::Zero(N + boundary, N + boundary);
  for (int k = 0; k < boundary; k++) s.D(N + k, N + k) = leak * (k % 3 ? 1.0 : 1e-4);
  s.f         = Vector::Zero(faces);
  s.g         = Vector::Zero(N + boundary);
  s.g.head(N) = Uniform(r, N);
}

/*
   Optimal control with bounds on the control, whose multipliers are unknowns, too: rows u = bound where active, mu = 0
   elsewhere
*/
static void BoundedControl(Saddle &s, int cells, double beta, double share)
{
  const Grid   grid = {cells, cells};
  Random       r    = SaddleRandom(s.name);
  Matrix       K    = Laplacian(grid, [](int, int) { return 1.0; });
  const Matrix M    = Mass(grid);
  const int    N    = grid.Nodes();
  Vector       none = Vector::Zero(N);

  for (int j = 0; j <= cells; j++)
    for (int i = 0; i <= cells; i++)
      if (i == 0 || j == 0 || i == cells || j == cells) Clamp(K, none, grid.Node(i, j));
  s.A = Diagonal({M, beta * M});
  s.B = s.C = s.D          = Matrix::Zero(2 * N, 2 * N);
  s.C.topLeftCorner(N, N)  = K;
  s.C.topRightCorner(N, N) = -M;
  s.C.bottomRightCorner(N, N).setIdentity();
  s.B         = s.C;
  s.f         = Vector::Zero(2 * N);
  s.f.head(N) = M * Uniform(r, N);
  s.g         = Vector::Zero(2 * N);
  for (int i = 0; i < N; i++) {
    if (r.Chance(share)) s.g[N + i] = 0.1;
    else {
      s.C.row(N + i).setZero();
      s.D(N + i, N + i) = -1.0;
    }
  }
}

/*
   A step of sequential quadratic programming with more linearized constraints than unknowns, most of them with a slack;
   elastic: all are softened by 1 / rho
*/
static void Sequential(Saddle &s, int n, int m, int active, double rho, double asymmetry)
{
  Random r = SaddleRandom(s.name);

  s.A = Matrix::Identity(n, n) + 0.2 * SparseRows(r, n, n, 2);
  s.A = s.A.transpose() * s.A;
  s.C = SparseRows(r, m, n, 3);
  s.B = s.C;
  for (int i = 0; asymmetry > 0.0 && i < m; i++)
    for (int j = 0; j < n; j++) s.B(i, j) *= 1.0 + asymmetry * (double)r.Real(-1.0, 1.0);
  s.D = Matrix::Identity(m, m) / rho;
  for (int i = active; i < m; i++) s.D(i, i) = std::pow(10.0, (double)r.Real(2.0, 9.0));
  s.f = Uniform(r, n);
  s.g = Uniform(r, m);
}

/*
   Edges and nodes of a grid: mass of the edges plus, weakly, their curl; the divergence is zero by a Lagrangian on the
   nodes inside
*/
static void Divergence(Saddle &s, int cells, double mass, double ground)
{
  Random     r      = SaddleRandom(s.name);
  const int  across = cells * (cells + 1), edges = 2 * across, inside = (cells - 1) * (cells - 1);
  const auto ex   = [=](int i, int j) { return j * cells + i; };
  const auto ey   = [=](int i, int j) { return across + i * cells + j; };
  Matrix     curl = Matrix::Zero(cells * cells, edges);

  for (int j = 0; j < cells; j++)
    for (int i = 0; i < cells; i++) {
      curl(j * cells + i, ex(i, j))     = 1.0;
      curl(j * cells + i, ex(i, j + 1)) = -1.0;
      curl(j * cells + i, ey(i, j))     = -1.0;
      curl(j * cells + i, ey(i + 1, j)) = 1.0;
    }
  s.A = curl.transpose() * curl + mass * Matrix::Identity(edges, edges);
  s.C = Matrix::Zero(inside, edges);
  for (int j = 1; j < cells; j++)
    for (int i = 1; i < cells; i++) {
      const int row = (j - 1) * (cells - 1) + i - 1;

      s.C(row, ex(i, j)) = s.C(row, ey(i, j)) = 1.0;
      s.C(row, ex(i - 1, j)) = s.C(row, ey(i, j - 1)) = -1.0;
    }
  s.B = s.C;
  s.D = ground * Matrix::Identity(inside, inside);
  s.f = Uniform(r, edges);
  s.g = Vector::Zero(inside);
}

void AddPrograms(Entries &all)
{
  auto add = [&](const char *family, const std::string &name, const std::function<void(Saddle &)> &make,
                 Convention convention = PLAIN, bool first = false) {
    all.push_back({family, name, [=](Saddle &s) {
                     make(s);
                     s.convention = convention;
                     s.first      = first;
                   }});
  };

  add("portfolio", "portfolio", [](Saddle &s) { Portfolio(s, 60, 8, 1e-2, false); });
  add("portfolio", "portfolio_barrier", [](Saddle &s) { Portfolio(s, 80, 12, 1e-4, true); });
  add(
    "portfolio", "portfolio_flipped", [](Saddle &s) { Portfolio(s, 60, 8, 1e-6, true); }, FLIPPED, true);
  add("interior point", "fixed_free", [](Saddle &s) { FixedAndFree(s, 60, 6, 8, 3.0); });
  add("interior point", "fixed_free_end", [](Saddle &s) { FixedAndFree(s, 72, 8, 6, 6.0); });
  add(
    "interior point", "fixed_free_opposite", [](Saddle &s) { FixedAndFree(s, 60, 6, 0, 8.0); }, OPPOSITE);
  add("stabilized Stokes", "stabilized", [](Saddle &s) { Stabilized(s, 6, 1.0, 0.1); });
  add("stabilized Stokes", "stabilized_viscous", [](Saddle &s) { Stabilized(s, 6, 1e4, 1e-2); });
  add("mixed Poisson", "darcy_robin", [](Saddle &s) { Leaky(s, 6, 2.0, 1.0); });
  add(
    "mixed Poisson", "darcy_leaky", [](Saddle &s) { Leaky(s, 6, 4.0, 1e-8); }, NEGATED);
  add("optimal control", "control_bounded", [](Saddle &s) { BoundedControl(s, 6, 1e-4, 0.3); });
  add("optimal control", "control_bounded_most", [](Saddle &s) { BoundedControl(s, 6, 1e-6, 0.8); });
  add("many rows", "sqp", [](Saddle &s) { Sequential(s, 30, 70, 12, 1e6, 0.0); });
  add("many rows", "sqp_elastic", [](Saddle &s) { Sequential(s, 30, 70, 40, 1e10, 0.0); });
  add("many rows", "sqp_inexact", [](Saddle &s) { Sequential(s, 40, 60, 15, 1e4, 0.3); });
  add("divergence", "divergence", [](Saddle &s) { Divergence(s, 7, 1.0, 0.0); });
  add("divergence", "divergence_low", [](Saddle &s) { Divergence(s, 7, 1e-6, 0.0); });
  add("divergence", "divergence_grounded", [](Saddle &s) { Divergence(s, 7, 1e-4, 1e-8); });
}
