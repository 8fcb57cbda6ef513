/* Systems that are no meshes of bodies: flow, a path behind a fold, pipes, optimization, lines */
#include "structured.h"

/*
   Velocities of bilinear elements that are known on the boundary, but for an outlet, and pressures of single elements
   or of four
*/
void DrawFlow(Random &r, Model &m, Structured &s)
{
  const double target     = Decade(r, std::log10(50.0), std::log10(3000.0));
  const bool   stabilized = r.Chance(0.5), penalized = !stabilized && r.Chance(0.3), outlet = r.Chance(0.4);
  const int    nx = 2 * std::max(1, (int)(std::sqrt(target / 2.0) * Decade(r, -0.15, 0.15) / 2.0)),
            ny = 2 * std::max(1, (int)(target / 2.0 / nx / 2.0)), size = stabilized ? 1 : 2;
  const double     hx = 1.0 / nx, hy = 1.0 / ny, weight = Decade(r, -2.0, 0.0);
  const Grid       grid{nx, ny}, cells{nx / size - 1, ny / size - 1};
  const Matrix     element = Laplacian(Grid{1, 1, hx, hy}, [](int, int) { return 1.0; });
  std::vector<int> node((size_t)grid.Nodes(), -1);

  m.components = s.bs = 2;
  s.decades           = r.Chance(0.5) ? 0.0 : Between(r, 0.0, 4.0);
  for (int j = 1; j < ny; j++)
    for (int i = 1; i <= nx - !outlet; i++) node[(size_t)grid.Node(i, j)] = m.Unknowns(2);
  m.rows.resize((size_t)cells.Nodes());
  for (int j = 0; j < ny; j++)
    for (int i = 0; i < nx; i++) {
      const int    at[4]     = {node[(size_t)grid.Node(i, j)], node[(size_t)grid.Node(i + 1, j)],
                                node[(size_t)grid.Node(i, j + 1)], node[(size_t)grid.Node(i + 1, j + 1)]};
      const double viscosity = Decade(r, -s.decades, 0.0);
      auto        &row       = m.rows[(size_t)cells.Node(i / size, j / size)].entries;

      for (int p = 0; p < 4; p++) {
        if (at[p] < 0) continue;
        for (int q = 0; q < 4; q++)
          for (int c = 0; c < 2 && at[q] >= 0; c++) m.A.emplace_back(at[p] + c, at[q] + c, viscosity * element(p, q));
        row.emplace_back(at[p], p % 2 ? hy / 2.0 : -hy / 2.0);
        row.emplace_back(at[p] + 1, p / 2 ? hx / 2.0 : -hx / 2.0);
      }
    }
  for (int j = 0; j <= cells.ny && stabilized; j++)
    for (int i = 0; i <= cells.nx; i++)
      for (int k = 0; k < 2; k++) { /* jumps of the pressure to the right, and above */
        if (k ? j == cells.ny : i == cells.nx) continue;
        const int p = cells.Node(i, j), q = k ? cells.Node(i, j + 1) : cells.Node(i + 1, j);

        for (int a : {p, q})
          for (int b : {p, q}) m.D.emplace_back(a, b, (a == b ? weight : -weight) * hx * hy);
      }
  for (int i = 0; i < cells.Nodes() && penalized; i++) m.D.emplace_back(i, i, 1e-3 * weight * hx * hy);
  m.blockD = stabilized || penalized;
  if (!outlet && !penalized) { /* a constant pressure does nothing */
    Dependence d;

    for (int i = 0; i < cells.Nodes(); i++) d.rows.emplace_back(i, 1.0);
    d.drop = r.Int(0, cells.Nodes() - 1);
    s.dependent.push_back(d);
    s.solvable = r.Chance(0.85);
  }
  s.text += std::string(stabilized  ? " stabilized"
                        : penalized ? " penalized"
                                    : "") +
            (outlet ? " outlet" : " enclosed") + " decades=" + std::to_string((int)s.decades);
}

/* K - c lambda_1 M, with the one row that keeps away from the first mode, in which it is negative */
void DrawFold(Random &r, Model &m, Structured &s)
{
  const double target = Decade(r, std::log10(50.0), std::log10(3000.0)), beyond = Between(r, 1.05, 1.9),
               pi = 3.14159265358979323846;
  const int    k = (int)std::sqrt(target), nodes = k + 1;
  const Matrix element = Laplacian(Grid{1, 1, 1.0 / nodes, 1.0 / nodes}, [](int, int) { return 1.0; });
  const double mass    = 1.0 / nodes / nodes;
  double       energy = 0.0, norm = 0.0;
  Vector       mode(k * k);
  Triplets     K;
  Model::Row   row;

  m.Unknowns(k * k);
  for (int j = 0; j < k; j++)
    for (int i = 0; i < k; i++) mode[j * k + i] = std::sin(pi * (i + 1) / nodes) * std::sin(pi * (j + 1) / nodes);
  for (int j = 0; j < nodes; j++)
    for (int i = 0; i < nodes; i++)
      for (int p = 0; p < 4; p++)
        for (int q = 0; q < 4; q++) {
          const int pi_ = i + p % 2 - 1, pj = j + p / 2 - 1, qi = i + q % 2 - 1, qj = j + q / 2 - 1;

          if (std::min({pi_, pj, qi, qj}) < 0 || std::max({pi_, pj, qi, qj}) >= k) continue;
          K.emplace_back(pj * k + pi_, qj * k + qi, element(p, q));
        }
  for (const auto &t : K) energy += mode[t.row()] * t.value() * mode[t.col()];
  norm = mass * mode.squaredNorm();
  for (int i = 0; i < k * k; i++) {
    row.entries.emplace_back(i, mass * mode[i]);
    K.emplace_back(i, i, -beyond * energy / norm * mass);
  }
  m.A = K;
  m.rows.push_back(row);
  for (int more = r.Chance(0.3) ? r.Int(1, 3) : 0; more > 0; more--)
    m.rows.push_back({{{r.Int(0, k * k - 1), 1.0}}, {}});
  for (size_t a = 1; a < m.rows.size(); a++) /* not twice the same */
    for (size_t b = a + 1; b < m.rows.size(); b++)
      if (m.rows[a].entries.front().first == m.rows[b].entries.front().first) m.rows.resize(b--);
  s.text += " beyond=" + std::to_string(beyond);
}

/* Each row is a node, and the sum of what flows from it; a node of each component may be left out, or has a store */
void DrawNetwork(Random &r, Model &m, Structured &s)
{
  static const char *const shapes[] = {" tree", " grid", " ring", " hanging"};
  const double             target   = Decade(r, std::log10(50.0), std::log10(3000.0));
  const int                shape = r.Int(0, 3), components = r.Chance(0.7) ? 1 : r.Int(2, 4), grounded = r.Int(0, 3);
  const bool               stored = grounded == 3;

  s.decades = r.Chance(0.5) ? 0.3 : Between(r, 0.0, 4.0);
  for (int k = 0; k < components; k++) {
    const int side  = std::max(2, (int)std::sqrt(target / 2.0 / components)),
              nodes = shape == 1 || shape == 3 ? side * side : std::max(3, (int)target / components);
    std::vector<std::pair<int, int>> pipes;
    const int first = (int)m.rows.size(), ground = grounded ? r.Int(0, nodes - 1) : -1, left = stored ? -1 : ground;
    auto      place = [&](int i) { return i == left ? -1 : first + i - (left >= 0 && i > left); };

    for (int i = 1; i < nodes; i++) {
      if (shape == 0) pipes.emplace_back(r.Int(std::max(0, i - 5), i - 1), i);
      if (shape == 2) pipes.emplace_back(i - 1, i);
      if ((shape == 1 || shape == 3) && i % side) pipes.emplace_back(i - 1, i);
      if ((shape == 1 || (shape == 3 && (i % 3 == 0 || i % side == 0))) && i >= side) pipes.emplace_back(i - side, i);
    }
    if (shape == 2) pipes.emplace_back(nodes - 1, 0);
    m.rows.resize((size_t)(first + nodes - (left >= 0)));
    for (const auto &p : pipes) {
      const int u = m.Unknowns(1);

      m.A.emplace_back(u, u, Decade(r, 0.0, s.decades));
      if (place(p.first) >= 0) m.rows[(size_t)place(p.first)].entries.emplace_back(u, -1.0);
      if (place(p.second) >= 0) m.rows[(size_t)place(p.second)].entries.emplace_back(u, 1.0);
    }
    if (stored) m.D.emplace_back(place(ground), place(ground), Decade(r, -3.0, 3.0));
    if (!grounded) {
      Dependence d;

      for (int i = 0; i < nodes; i++) d.rows.emplace_back(place(i), 1.0);
      d.drop = place(r.Int(0, nodes - 1));
      s.dependent.push_back(d);
    }
  }
  m.blockD = stored;
  if (!grounded) s.solvable = r.Chance(0.75);
  s.text += std::string(shapes[shape]) + " components=" + std::to_string(components) +
            (stored     ? " stored"
             : grounded ? ""
                        : " not grounded") +
            " decades=" + std::to_string((int)s.decades);
}

/*
   A step of an interior-point method: what a bound adds to A and D spans many decades, and A is zero where there is
   none
*/
void DrawInterior(Random &r, Model &m, Structured &s)
{
  const int n        = (int)Decade(r, std::log10(40.0), std::log10(2000.0)),
            rows     = std::max(1, (int)(n * Between(r, 0.1, 0.6)));
  const double zeros = r.Chance(0.5) ? 0.0 : Between(r, 0.0, 0.5), wide = 2.0 * r.Int(0, 3),
               equalities = Between(r, 0.0, 1.0);
  std::vector<int> order((size_t)n);

  m.Unknowns(n);
  m.blockD = true;
  for (int i = 0; i < n; i++) order[(size_t)i] = i;
  for (int i = n - 1; i > 0; i--) std::swap(order[(size_t)i], order[(size_t)r.Int(0, i)]);
  for (int i = 0; i < n; i++) { /* a row of its own determines each unknown without stiffness */
    if (i >= rows || !r.Chance(zeros)) m.A.emplace_back(order[(size_t)i], order[(size_t)i], Decade(r, -wide, wide));
  }
  for (int i = 0; i < rows; i++) {
    Model::Row row{{{order[(size_t)i], 1.0}}, {}};

    for (int k = r.Int(1, 5); k > 0 && i + 1 < n; k--)
      row.entries.emplace_back(order[(size_t)r.Int(i + 1, n - 1)], r.Chance(0.3) ? 1.0 : Between(r, -2.0, 2.0));
    m.rows.push_back(row);
    if (!r.Chance(equalities)) m.D.emplace_back(i, i, Decade(r, -10.0, 10.0));
  }
  for (int k = r.Int(0, 4); k > 0; k--) { /* of low rank, as of a quasi-Newton method */
    std::vector<std::pair<int, double>> v;

    for (int e = r.Int(2, 12); e > 0; e--) v.emplace_back(order[(size_t)r.Int(rows, n - 1)], Between(r, -1.0, 1.0));
    for (const auto &a : v)
      for (const auto &b : v) m.A.emplace_back(a.first, b.first, a.second * b.second);
  }
  s.decades = wide;
  s.text += " decades=" + std::to_string((int)wide) + (zeros > 0.0 ? " zeros" : "");
}

/*
   Voltages and currents along lines, by first-order equations: the first half of the rows of A has no diagonal, but at
   the ends
*/
void DrawFirstOrder(Random &r, Model &m, Structured &s)
{
  const int lines = r.Int(1, 4), n = std::max(8, (int)(Decade(r, std::log10(50.0), std::log10(3000.0)) / 2.0 / lines));
  const double inductance = Decade(r, 0.0, 2.0), capacity = Decade(r, 0.0, 2.0), load = Decade(r, -1.0, 1.0);

  for (int line = 0; line < lines; line++) {
    const int v = m.Unknowns(2 * (n + 1)), i = v + n + 1;

    for (int half = 0; half < 2; half++) /* v_x + L i = 0, i_x + C v = 0 */
      for (int k = 0; k <= n; k++) {
        const int row = (half ? i : v) + k, own = half ? i : v, other = half ? v : i;

        if (k) {
          m.A.emplace_back(row, own + k - 1, -0.5);
          m.A.emplace_back(row, other + k - 1, (half ? capacity : inductance) / 6.0 / n);
        }
        if (k < n) {
          m.A.emplace_back(row, own + k + 1, 0.5);
          m.A.emplace_back(row, other + k + 1, (half ? capacity : inductance) / 6.0 / n);
        }
        if (!k || k == n) m.A.emplace_back(row, row, k ? 0.5 : -0.5);
        m.A.emplace_back(row, other + k, (half ? capacity : inductance) * 4.0 / 6.0 / n);
      }
    m.rows.push_back({{{v, 1.0}}, {}});
    m.rows.push_back({
      {{v + n, 1.0}, {i + n, -load}},
      {            }
    });
  }
  s.symmetric = false;
  s.diagonal  = r.Chance(0.2);
  s.text += " lines=" + std::to_string(lines);
}
