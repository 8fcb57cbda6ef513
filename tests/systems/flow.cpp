/* Networks, mixed forms of flow, incompressible media */
#include "systems.h"

/*
   Kirchhoff: resistances and the incidence matrix of `parts` connected graphs, a row of each of which depends on the
   others; ideal: some edges of the tree have no resistance
*/
static void Network(Saddle &s, int nodes, int extra, int parts, double decades, double stored, bool balanced,
                    bool ideal)
{
  Random                           r = SaddleRandom(s.name);
  std::vector<std::pair<int, int>> edges;
  const int                        m = nodes * parts;

  for (int p = 0; p < parts; p++) {
    /* a tree */
    for (int i = 1; i < nodes; i++) edges.push_back({p * nodes + r.Int(std::max(0, i - 4), i - 1), p * nodes + i});
    for (int k = 0; k < extra; k++) {
      const int i = r.Int(0, nodes - 1), j = r.Int(0, nodes - 1);
      if (i != j) edges.push_back({p * nodes + i, p * nodes + j});
    }
  }
  const int n = (int)edges.size();

  s.A = Logs(r, n, -decades / 2, decades / 2);
  for (int e = 0; ideal && e + 1 < nodes; e += 2) s.A(e, e) = 0.0;
  s.C = Matrix::Zero(m, n);
  for (int e = 0; e < n; e++) {
    s.C(edges[e].first, e)  = -1.0;
    s.C(edges[e].second, e) = 1.0;
  }
  s.B = s.C;
  s.f = Vector::Zero(n);
  s.g = Vector(m);
  for (int i = 0; i < m; i++) s.g[i] = (double)r.Int(-8, 8);
  for (int p = 0; p < parts && balanced; p++) s.g[p * nodes] -= s.g.segment(p * nodes, nodes).sum();
  if (stored > 0.0) { /* some nodes store */
    s.D = Matrix::Zero(m, m);
    for (int i = 0; i < m; i += 5) s.D(i, i) = stored * std::pow(10.0, (double)r.Real(-2.0, 2.0));
  }
  s.solvable = balanced || stored > 0.0;
}

/*
   Fluxes through the faces of nx x ny cells; pressure: given on the left and right, otherwise no flux through any
   boundary
*/
static void Darcy(Saddle &s, int nx, int ny, double decades, bool pressure, double storage)
{
  Random           r     = SaddleRandom(s.name);
  const int        faces = (nx + 1) * ny + nx * (ny + 1);
  Matrix           A = Matrix::Zero(faces, faces), C = Matrix::Zero(nx * ny, faces);
  std::vector<int> kept;

  for (int j = 0; j < ny; j++)
    for (int i = 0; i < nx; i++) {
      const double resistance = std::pow(10.0, (double)r.Real(-decades / 2, decades / 2));
      const int    left = j * (nx + 1) + i, below = (nx + 1) * ny + j * nx + i,
                face[4] = {left, left + 1, below, below + nx};

      for (int d = 0; d < 4; d += 2) { /* the lowest mixed element of a rectangle */
        A(face[d], face[d]) += resistance / 3;
        A(face[d + 1], face[d + 1]) += resistance / 3;
        A(face[d], face[d + 1]) += resistance / 6;
        A(face[d + 1], face[d]) += resistance / 6;
        C(j * nx + i, face[d])     = -1.0;
        C(j * nx + i, face[d + 1]) = 1.0;
      }
    }
  for (int k = 0; k < faces; k++) {
    const bool vertical = k < (nx + 1) * ny, boundary = C.col(k).cwiseAbs().sum() < 1.5;
    if (!boundary || (vertical && pressure)) kept.push_back(k);
  }
  s.A = A(kept, kept);
  s.C = C(Eigen::seqN(0, C.rows()), kept);
  s.B = s.C;
  s.f = Vector::Zero(s.A.rows());
  for (Eigen::Index k = 0; pressure && k < s.f.size(); k++)
    if (s.C.col(k).cwiseAbs().sum() < 1.5) s.f[k] = s.C.col(k).sum() < 0.0 ? 1.0 : -1.0;
  s.g              = Vector::Zero(nx * ny);
  s.g[0]           = 1.0; /* a well in one corner, another in the opposite one */
  s.g[nx * ny - 1] = -1.0;
  if (storage > 0.0) s.D = Matrix::Identity(nx * ny, nx * ny) * storage;
}

/* Staggered grid: Laplacians of both velocities, divergence of each cell; outflow: velocities on the right are free */
static void Staggered(Saddle &s, int nx, int ny, bool outflow, double compressible)
{
  const int        faces = (nx + 1) * ny + nx * (ny + 1);
  Matrix           A = Matrix::Zero(faces, faces), C = Matrix::Zero(nx * ny, faces);
  Random           r = SaddleRandom(s.name);
  std::vector<int> kept;
  auto             u      = [=](int i, int j) { return j * (nx + 1) + i; };
  auto             v      = [=](int i, int j) { return (nx + 1) * ny + j * nx + i; };
  auto             spring = [&](int a, int b) {
    A(a, a) += 1.0;
    A(b, b) += 1.0;
    A(a, b) -= 1.0;
    A(b, a) -= 1.0;
  };

  for (int j = 0; j < ny; j++)
    for (int i = 0; i <= nx; i++) {
      if (i < nx) spring(u(i, j), u(i + 1, j));
      if (j + 1 < ny) spring(u(i, j), u(i, j + 1));
      else A(u(i, j), u(i, j)) += 2.0;
      if (!j) A(u(i, j), u(i, j)) += 2.0;
    }
  for (int j = 0; j <= ny; j++)
    for (int i = 0; i < nx; i++) {
      if (j < ny) spring(v(i, j), v(i, j + 1));
      if (i + 1 < nx) spring(v(i, j), v(i + 1, j));
      if (!i || (i + 1 == nx && !outflow)) A(v(i, j), v(i, j)) += 2.0;
    }
  for (int j = 0; j < ny; j++)
    for (int i = 0; i < nx; i++) {
      const int cell = j * nx + i;

      C(cell, u(i, j)) = C(cell, v(i, j)) = -1.0;
      C(cell, u(i + 1, j)) = C(cell, v(i, j + 1)) = 1.0;
    }
  for (int k = 0; k < faces; k++)
    if (C.col(k).cwiseAbs().sum() > 1.5) kept.push_back(k); /* no flux through walls */
  for (int j = 0; outflow && j < ny; j++) kept.push_back(u(nx, j));
  s.A = A(kept, kept);
  s.C = C(Eigen::seqN(0, C.rows()), kept);
  s.B = s.C;
  s.f = Uniform(r, (int)s.A.rows());
  s.g = Vector::Zero(nx * ny);
  if (compressible > 0.0) s.D = Matrix::Identity(nx * ny, nx * ny) * compressible;
}

/*
   Elements of equal order for velocity and pressure, or constant pressures (constant), on the unit square; D as what
   stabilises them
*/
static void Elements(Saddle &s, int cells, bool constant, bool outflow, double nu,
                     const std::function<Matrix(const Grid &)> &D)
{
  const Grid   grid = {cells, cells};
  const double h    = 1.0 / cells;
  const int    N = grid.Nodes(), m = constant ? cells * cells : N;
  Random       r = SaddleRandom(s.name);

  s.A = PlaneStrain(
    grid, [](int, int) { return 1.0; }, nu);
  s.f = Uniform(r, 2 * N) * h;
  s.C = Matrix::Zero(m, 2 * N);
  for (int j = 0; j < cells; j++)
    for (int i = 0; i < cells; i++)
      for (int b = 0; b < 4; b++) { /* int q div v of the element, q constant or spread evenly over its nodes */
        const int    node = grid.Node(i + b % 2, j + b / 2);
        const double dx = (b % 2 ? 0.5 : -0.5), dy = (b / 2 ? 0.5 : -0.5);

        for (int a = 0; a < (constant ? 1 : 4); a++) {
          const int row = constant ? j * cells + i : grid.Node(i + a % 2, j + a / 2);

          s.C(row, 2 * node) += dx * (constant ? 1.0 : 0.25);
          s.C(row, 2 * node + 1) += dy * (constant ? 1.0 : 0.25);
        }
      }
  for (int j = 0; j <= cells; j++)
    for (int i = 0; i <= cells; i++)
      if (i == 0 || j == 0 || j == cells || (i == cells && !outflow))
        for (int c = 0; c < 2; c++) {
          Clamp(s.A, s.f, 2 * grid.Node(i, j) + c);
          s.C.col(2 * grid.Node(i, j) + c).setZero();
        }
  s.B  = s.C;
  s.g  = Vector::Zero(m);
  s.bs = 2;
  if (D) s.D = D(grid);
}

void AddFlow(Entries &all)
{
  auto network = [&](const char *name, int nodes, int extra, int parts, double decades, double stored, bool balanced,
                     bool ideal) {
    all.push_back({"network", std::string("network_") + name,
                   [=](Saddle &s) { Network(s, nodes, extra, parts, decades, stored, balanced, ideal); }});
  };
  auto pspg = [](double tau) {
    return [=](const Grid &g) { return Matrix(tau / g.nx / g.nx * Laplacian(g, [](int, int) { return 1.0; })); };
  };
  auto bulk = [](double modulus) {
    return [=](const Grid &g) { return Matrix(Matrix::Identity(g.nx * g.ny, g.nx * g.ny) / (modulus * g.nx * g.ny)); };
  };

  network("one", 60, 40, 1, 2.0, 0.0, true, false);
  network("five", 20, 12, 5, 4.0, 0.0, true, false);
  network("tree", 80, 3, 1, 6.0, 0.0, true, false);
  network("wide", 50, 60, 2, 12.0, 0.0, true, false);
  network("stored", 60, 40, 2, 4.0, 1e-3, false, false);
  network("unbalanced", 40, 20, 2, 2.0, 0.0, false, false);
  network("ideal", 60, 40, 1, 2.0, 0.0, true, true);
  network("large", 200, 150, 1, 6.0, 0.0, true, false);

  all.push_back({"mixed Poisson", "darcy_pressure", [](Saddle &s) { Darcy(s, 10, 8, 0.0, true, 0.0); }});
  all.push_back({"mixed Poisson", "darcy_contrast", [](Saddle &s) { Darcy(s, 10, 8, 8.0, true, 0.0); }});
  all.push_back({"mixed Poisson", "darcy_closed", [](Saddle &s) { Darcy(s, 9, 9, 6.0, false, 0.0); }});
  all.push_back({"mixed Poisson", "darcy_storage", [](Saddle &s) { Darcy(s, 9, 9, 6.0, false, 1e-8); }});
  all.push_back({"mixed Poisson", "darcy_storage_large", [](Saddle &s) { Darcy(s, 9, 9, 2.0, false, 1e3); }});

  all.push_back({"incompressible", "staggered_closed", [](Saddle &s) { Staggered(s, 9, 8, false, 0.0); }});
  all.push_back({"incompressible", "staggered_open", [](Saddle &s) { Staggered(s, 9, 8, true, 0.0); }});
  all.push_back({"incompressible", "staggered_nearly", [](Saddle &s) { Staggered(s, 9, 8, false, 1e-10); }});
  all.push_back({"incompressible", "checkerboard", [](Saddle &s) { Elements(s, 8, true, false, 0.0, nullptr); }});
  all.push_back({"incompressible", "constant_open", [](Saddle &s) { Elements(s, 8, true, true, 0.0, nullptr); }});
  all.push_back({"incompressible", "pspg_closed", [=](Saddle &s) { Elements(s, 8, false, false, 0.0, pspg(0.125)); }});
  all.push_back({"incompressible", "pspg_open", [=](Saddle &s) { Elements(s, 8, false, true, 0.0, pspg(0.125)); }});
  all.push_back(
    {"incompressible", "pspg_weak", [=](Saddle &s) { Elements(s, 8, false, true, 0.0, pspg(std::exp2(-13))); }});
  all.push_back({"incompressible", "rubber_4999", [=](Saddle &s) { Elements(s, 8, true, true, 0.0, bulk(1e4)); }});
  all.push_back({"incompressible", "rubber_499999999", [=](Saddle &s) { Elements(s, 8, true, true, 0.0, bulk(1e9)); }});
}
