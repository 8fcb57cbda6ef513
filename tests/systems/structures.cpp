/* Periodic cells, boundaries held by multipliers, torn domains, nodes without stiffness */
#include "systems.h"

/*
   Opposite sides of a cell move alike but for the strain that is asked for: f = 0, g != 0; redundant: corners are tied
   twice
*/
static void Cell(Saddle &s, int cells, bool elastic, double contrast, bool redundant)
{
  const Grid grid = {cells, cells};
  const int  c    = elastic ? 2 : 1;
  /* fibers, some cut by the sides */
  const auto          k    = [=](int i, int j) { return (i + 2) % 4 < 2 && (j + 2) % 4 < 2 ? contrast : 1.0; };
  Vector              none = Vector::Zero(c * grid.Nodes());
  std::vector<Vector> rows;
  std::vector<double> jumps;
  auto                tie = [&](int slave, int master, double jump[2]) {
    for (int d = 0; d < c; d++) {
      Vector row          = Vector::Zero(c * grid.Nodes());
      row[c * slave + d]  = 1.0;
      row[c * master + d] = -1.0;
      rows.push_back(row);
      jumps.push_back(jump[d]);
    }
  };
  double x[2] = {0.015625, 0.0}, y[2] = {0.00390625, -0.0078125}; /* powers of 2: corners agree exactly */

  s.A = elastic ? PlaneStrain(grid, k, 0.3) : Laplacian(grid, k);
  for (int d = 0; d < c; d++) Clamp(s.A, none, d);
  for (int j = 0; j <= cells; j++) tie(grid.Node(cells, j), grid.Node(0, j), x);
  for (int i = 0; i <= cells - (redundant ? 0 : 1); i++) tie(grid.Node(i, cells), grid.Node(i, 0), y);
  s.C = Matrix(rows.size(), s.A.rows());
  s.g = Vector(rows.size());
  for (size_t i = 0; i < rows.size(); i++) {
    s.C.row((Eigen::Index)i) = rows[i].transpose();
    s.g[(Eigen::Index)i]     = jumps[i];
  }
  s.B  = s.C;
  s.f  = none;
  s.bs = c;
}

/*
   Poisson's equation whose boundary on the left is held by multipliers on a mesh of their own, finer or not. Entries
   are whole numbers, so that rows depend exactly; noise: of each entry
*/
static void Boundary(Saddle &s, int cells, int finer, bool constant, double noise, bool agree)
{
  const Grid grid = {cells, cells};
  Random     r    = SaddleRandom(s.name);
  const int  m    = constant ? cells * finer : cells * finer + 1;
  Vector     trace(cells + 1);

  s.A = Laplacian(grid, [](int, int) { return 1.0; });
  s.f = Uniform(r, grid.Nodes()) / (cells * cells);
  s.B = Matrix::Zero(m, grid.Nodes());
  /* piece e of the multipliers' mesh, on element e / finer; integrals times a whole number */
  for (int e = 0; e < cells * finer; e++) {
    const int j = e / finer, a = e % finer, up = grid.Node(0, j + 1), down = grid.Node(0, j);

    if (constant) {
      s.B(e, up) += 2 * a + 1;
      s.B(e, down) += 2 * (finer - a) - 1;
    } else {
      s.B(e, up) += 3 * a + 1;
      s.B(e, down) += 3 * (finer - a) - 1;
      s.B(e + 1, up) += 3 * a + 2;
      s.B(e + 1, down) += 3 * (finer - a) - 2;
    }
  }
  for (int i = 0; i < m; i++)
    for (int j = 0; j < grid.Nodes() && noise > 0.0; j++) s.B(i, j) *= 1.0 + noise * (double)r.Real(-1.0, 1.0);
  s.C = s.B;
  for (int j = 0; j <= cells; j++) trace[j] = 0.125 * ((j * j) % 5 - 2);
  s.g = Vector::Zero(m);
  for (int j = 0; j <= cells; j++) s.g += s.C.col(grid.Node(0, j)) * trace[j];
  if (!agree) {
    s.g[m / 2] += 1.0;
    s.solvable = false;
  }
}

/*
   parts x parts pieces of cells x cells elements, each with nodes of its own; only those at the bottom are held, by
   their own rows or by C (held)
*/
static void Torn(Saddle &s, int parts, int cells, bool elastic, double contrast, bool redundant, bool held)
{
  const Grid          grid = {cells, cells};
  const int           c = elastic ? 2 : 1, each = c * grid.Nodes();
  std::vector<Matrix> pieces;
  std::vector<Vector> rows;
  const int           n = each * parts * parts;
  auto unknown = [=](int p, int q, int i, int j, int d) { return (q * parts + p) * each + c * grid.Node(i, j) + d; };
  auto tie     = [&](int a, int b) {
    Vector row = Vector::Zero(n);
    row[a]     = 1.0;
    if (b >= 0) row[b] = -1.0;
    rows.push_back(row);
  };

  for (int k = 0; k < parts * parts; k++) {
    const auto E = [=](int, int) { return (k + k / parts) % 2 ? contrast : 1.0; };
    pieces.push_back(elastic ? PlaneStrain(grid, E, 0.3) : Laplacian(grid, E));
  }
  s.A = Diagonal(pieces);
  s.f = Vector::Zero(n);
  for (int i = 0; i <= cells; i++) s.f[unknown(parts - 1, parts - 1, i, cells, c - 1)] = -0.01;
  for (int p = 0; p < parts; p++)
    for (int i = 0; i <= cells; i++)
      for (int d = 0; d < c; d++) {
        if (!held) Clamp(s.A, s.f, unknown(p, 0, i, 0, d));
        else if (i < cells || p + 1 == parts) tie(unknown(p, 0, i, 0, d), -1);
      }
  for (int q = 0; q < parts; q++)
    for (int p = 0; p < parts; p++)
      for (int i = 0; i <= cells; i++)
        for (int d = 0; d < c; d++) {
          /* at a cross-point three ties hold four pieces; a fourth is redundant */
          if (p + 1 < parts && (held || q || i)) tie(unknown(p, q, cells, i, d), unknown(p + 1, q, 0, i, d));
          if (q + 1 < parts && (redundant || !p || i)) tie(unknown(p, q, i, cells, d), unknown(p, q + 1, i, 0, d));
        }
  s.C = Matrix(rows.size(), n);
  for (size_t i = 0; i < rows.size(); i++) s.C.row((Eigen::Index)i) = rows[i].transpose();
  s.B  = s.C;
  s.g  = Vector::Zero(s.C.rows());
  s.bs = c;
}

/*
   Reference nodes without stiffness, each the mean of some nodes of a block, or tied rigidly to them; forces act on
   them
*/
static void Reference(Saddle &s, int count, bool rigid)
{
  const Grid          grid = {10, 6};
  const int           n = 2 * grid.Nodes(), each = rigid ? 3 : 2, all = n + each * count, per = 10 / count;
  Random              r = SaddleRandom(s.name);
  std::vector<Vector> rows;

  s.A                     = Matrix::Zero(all, all);
  s.A.topLeftCorner(n, n) = PlaneStrain(
    grid, [](int, int) { return 1.0; }, 0.3);
  s.f = Vector::Zero(all);
  for (int i = 0; i <= grid.nx; i++)
    for (int d = 0; d < 2; d++) Clamp(s.A, s.f, 2 * grid.Node(i, 0) + d);
  for (int k = 0; k < count; k++) {
    const int at = n + each * k;

    for (int d = 0; d < each; d++) s.f[at + d] = 0.01 * (double)r.Real(-1.0, 1.0);
    if (rigid) {
      for (int i = k * per; i <= (k + 1) * per - 1; i++)
        for (int d = 0; d < 2; d++) { /* u - u_ref - theta x (X - X_ref) */
          Vector row                         = Vector::Zero(all);
          row[2 * grid.Node(i, grid.ny) + d] = 1.0;
          row[at + d]                        = -1.0;
          if (d) row[at + 2] = -0.1 * (i - (k + 0.5) * per);
          rows.push_back(row);
        }
    } else {
      for (int d = 0; d < 2; d++) {
        Vector row  = Vector::Zero(all);
        row[at + d] = -1.0;
        for (int i = k * per; i < (k + 1) * per; i++) row[2 * grid.Node(i, grid.ny) + d] = 1.0 / per;
        rows.push_back(row);
      }
    }
  }
  s.C = Matrix(rows.size(), all);
  for (size_t i = 0; i < rows.size(); i++) s.C.row((Eigen::Index)i) = rows[i].transpose();
  s.B = s.C;
  s.g = Vector::Zero(s.C.rows());
}

/* Slack unknowns, which A does not know: rows [C -I]; more of them than of the others */
static void Slacks(Saddle &s, int n, int slacks)
{
  Random r = SaddleRandom(s.name);
  Matrix C = SparseRows(r, slacks, n, 3), A = Logs(r, n, -1.0, 1.0);

  for (int i = 0; i + 1 < n; i++) {
    A(i, i) += 1.0;
    A(i + 1, i + 1) += 1.0;
    A(i, i + 1) = A(i + 1, i) = -1.0;
  }
  s.A                     = Matrix::Zero(n + slacks, n + slacks);
  s.A.topLeftCorner(n, n) = A;
  s.C                     = Matrix(slacks, n + slacks);
  s.C << C, -Matrix::Identity(slacks, slacks);
  s.B = s.C;
  s.f = Uniform(r, n + slacks);
  s.g = Uniform(r, slacks);
}

void AddStructures(Entries &all)
{
  for (int e : {0, 3, 6}) {
    const double contrast = std::pow(10.0, e);

    all.push_back(
      {"periodic cell", "cell_heat_1e" + std::to_string(e), [=](Saddle &s) { Cell(s, 12, false, contrast, false); }});
    all.push_back(
      {"periodic cell", "cell_elastic_1e" + std::to_string(e), [=](Saddle &s) { Cell(s, 8, true, contrast, false); }});
  }
  all.push_back({"periodic cell", "cell_corners", [](Saddle &s) { Cell(s, 8, true, 1e4, true); }});

  all.push_back({"boundary multipliers", "boundary_matching", [](Saddle &s) { Boundary(s, 10, 1, false, 0.0, true); }});
  all.push_back({"boundary multipliers", "boundary_finer_2", [](Saddle &s) { Boundary(s, 10, 2, false, 0.0, true); }});
  all.push_back({"boundary multipliers", "boundary_finer_3", [](Saddle &s) { Boundary(s, 8, 3, false, 0.0, true); }});
  all.push_back({"boundary multipliers", "boundary_constant", [](Saddle &s) { Boundary(s, 10, 2, true, 0.0, true); }});
  all.push_back(
    {"boundary multipliers", "boundary_nearly_1e-2", [](Saddle &s) { Boundary(s, 10, 1, true, 1e-2, true); }});
  all.push_back(
    {"boundary multipliers", "boundary_contradictory", [](Saddle &s) { Boundary(s, 10, 2, false, 0.0, false); }});

  all.push_back({"torn domain", "torn_heat", [](Saddle &s) { Torn(s, 3, 3, false, 1.0, false, false); }});
  all.push_back({"torn domain", "torn_heat_redundant", [](Saddle &s) { Torn(s, 3, 3, false, 1e4, true, false); }});
  all.push_back({"torn domain", "torn_elastic", [](Saddle &s) { Torn(s, 2, 4, true, 1.0, false, false); }});
  all.push_back({"torn domain", "torn_elastic_redundant", [](Saddle &s) { Torn(s, 2, 4, true, 1e4, true, false); }});
  all.push_back({"torn domain", "torn_held_by_rows", [](Saddle &s) { Torn(s, 2, 4, true, 10.0, true, true); }});
  all.push_back({"torn domain", "torn_large", [](Saddle &s) { Torn(s, 3, 5, true, 1e3, true, false); }});
  /* one piece is held by nothing, and the force on it has no answer */
  all.push_back({"torn domain", "torn_loose", [](Saddle &s) {
                   Torn(s, 2, 3, false, 1.0, false, false);
                   const Eigen::Index last = s.A.rows() - s.A.rows() / 4;
                   std::vector<int>   kept;
                   for (Eigen::Index i = 0; i < s.C.rows(); i++)
                     if (s.C.row(i).tail(s.A.rows() - last).cwiseAbs().sum() == 0.0) kept.push_back((int)i);
                   const Matrix C = s.C(kept, Eigen::seqN(0, s.C.cols()));
                   s.B = s.C  = C;
                   s.g        = Vector::Zero(C.rows());
                   s.solvable = s.unique = false;
                 }});

  all.push_back({"massless nodes", "massless_means", [](Saddle &s) { Reference(s, 2, false); }});
  all.push_back({"massless nodes", "massless_means_many", [](Saddle &s) { Reference(s, 5, false); }});
  all.push_back({"massless nodes", "massless_rigid", [](Saddle &s) { Reference(s, 1, true); }});
  all.push_back({"massless nodes", "massless_rigid_many", [](Saddle &s) { Reference(s, 3, true); }});
  all.push_back({"massless nodes", "massless_slacks", [](Saddle &s) { Slacks(s, 80, 20); }});
  all.push_back({"massless nodes", "massless_slacks_most", [](Saddle &s) { Slacks(s, 60, 120); }});
}
