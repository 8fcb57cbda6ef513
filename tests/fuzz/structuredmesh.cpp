/* Bodies of bilinear elements with what programs tie to them */
#include "structured.h"

struct Body {
  Grid   grid;
  int    first;
  double bottom; /* of the box [0, 1] x [bottom, bottom + 1] */
  double stiffness;
};

static int Unknown(const Model &m, const Body &b, int i, int j, int component)
{
  return b.first + m.components * b.grid.Node(i, j) + component;
}

/* Coefficients of elements over some decades; powers of two, where what floats has to be singular, not nearly */
static void Assemble(Random &r, Model &m, const Body &b, double decades, bool exact)
{
  const Grid   one{1, 1, b.grid.lx / b.grid.nx, b.grid.ly / b.grid.ny};
  const auto   unit    = [](int, int) { return 1.0; };
  const Matrix element = m.components == 1 ? Laplacian(one, unit) : PlaneStrain(one, unit, 0.3);

  for (int j = 0; j < b.grid.ny; j++)
    for (int i = 0; i < b.grid.nx; i++) {
      const int nodes[4] = {b.grid.Node(i, j), b.grid.Node(i + 1, j), b.grid.Node(i, j + 1), b.grid.Node(i + 1, j + 1)},
                k        = m.components;
      const double value = b.stiffness * Decade(r, -decades, 0.0),
                   k0    = exact ? std::exp2(std::round(std::log2(value))) : value;

      for (int p = 0; p < 4 * k; p++)
        for (int q = 0; q < 4 * k; q++)
          m.A.emplace_back(b.first + k * nodes[p / k] + p % k, b.first + k * nodes[q / k] + q % k, k0 * element(p, q));
    }
}

/* Nodes of the bottom of a body to the edge below them, whether or not nodes match */
static void TieBodies(Model &m, const Body &lower, const Body &upper)
{
  const int nx = lower.grid.nx;

  for (int i = 0; i <= upper.grid.nx; i++)
    for (int c = 0; c < m.components; c++) {
      const double at = (double)i * nx / upper.grid.nx;
      const int    e  = std::min(nx - 1, (int)at);
      Model::Row   row;

      row.entries.emplace_back(Unknown(m, upper, i, 0, c), 1.0);
      if (at - e < 1.0) row.entries.emplace_back(Unknown(m, lower, e, lower.grid.ny, c), -(1.0 - (at - e)));
      if (at - e > 0.0) row.entries.emplace_back(Unknown(m, lower, e + 1, lower.grid.ny, c), -(at - e));
      m.Tie(row);
    }
}

/*
   A reference unknown without stiffness for each component of a node, that an edge follows; with a rotation, as of a
   spider
*/
static void Follow(Random &r, Model &m, const Body &b, bool penalty, std::string &text)
{
  const bool spider = m.components == 2 && r.Chance(0.5), prescribed = r.Chance(0.4), face = !spider && r.Chance(0.3);
  int        free = 0;

  if (penalty && (prescribed || face)) return; /* two values for one unknown */
  for (int i = 0; i <= b.grid.nx; i++)
    free += !m.Touched(Unknown(m, b, i, b.grid.ny, 0)) && !m.Touched(Unknown(m, b, i, b.grid.ny, m.components - 1));
  if (free < 2) return; /* nothing would hold it */
  const int ref = m.Unknowns(spider ? 3 : m.components);

  for (int c = 0; prescribed && c < (spider ? 3 : m.components); c++) m.Tie({{{ref + c, 1.0}}, {}});
  for (int j = face ? 1 : b.grid.ny; j <= b.grid.ny; j++)
    for (int i = 0; i <= b.grid.nx; i++)
      for (int c = 0; c < m.components; c++) {
        Model::Row row{
          {{Unknown(m, b, i, j, c), 1.0}, {ref + c, -1.0}},
          {                             }
        };
        const double arm = (double)i / b.grid.nx - 0.5;

        if (spider && c == 1 && arm != 0.0) row.entries.emplace_back(ref + 2, -arm);
        m.Tie(row);
      }
  text += spider ? " spider" : face ? " rigid part" : " reference";
  text += prescribed ? " prescribed" : "";
}

static void Periodic(Model &m, const Body &b)
{
  for (int j = 0; j <= b.grid.ny; j++)
    for (int c = 0; c < m.components; c++)
      m.Tie({
        {{Unknown(m, b, b.grid.nx, j, c), 1.0}, {Unknown(m, b, 0, j, c), -1.0}},
        {                                     }
      });
}

/* Nodes along a line, each tied to the next */
static void Chain(Random &r, Model &m, const Body &b)
{
  const int j = b.grid.ny / 2, length = r.Int(1, b.grid.nx);

  for (int i = 0; i < length; i++)
    m.Tie({
      {{Unknown(m, b, i + 1, j, 0), 1.0}, {Unknown(m, b, i, j, 0), -1.0}},
      {                                 }
    });
}

static void MeanValue(Model &m, const Body &b)
{
  Model::Row row;

  for (int j = 0; j <= b.grid.ny; j++)
    for (int i = 0; i <= b.grid.nx; i++)
      row.entries.emplace_back(Unknown(m, b, i, j, 0),
                               (i % b.grid.nx ? 1.0 : 0.5) * (j % b.grid.ny ? 1.0 : 0.5) / (b.grid.nx * b.grid.ny));
  m.rows.push_back(row);
}

enum Hold {
  HOLD_ROWS,
  HOLD_SCALED, /* rows of 1e30 or 1e-30 */
  HOLD_CLAMPED,
  HOLD_PENALTY,
  HOLD_MEAN,
  HOLD_NOT
};

/* The left edge, or all the boundary, of the first body */
static void HoldBody(Random &r, Model &m, const Body &b, Hold hold, std::string &text)
{
  static const char *const names[] = {" held by rows", " held by scaled rows", " clamped",
                                      " penalty",      " mean value",          " floats"};
  /* alone: not tied to others, whose values would be other ones */
  const bool   all = r.Chance(0.3), alone = all || r.Chance(0.6);
  const double size    = hold == HOLD_SCALED ? (r.Chance(0.5) ? 1e30 : 1e-30)
                         : r.Chance(0.2)     ? Decade(r, -3.0, 3.0)
                                             : 1.0,
               penalty = r.Chance(0.5) ? 1e30 : Decade(r, 4.0, 12.0);

  text += names[hold];
  if (hold >= HOLD_MEAN) return;
  for (int j = 0; j <= b.grid.ny; j++)
    for (int i = 0; i <= b.grid.nx; i++) {
      if (i && !(all && (i == b.grid.nx || !j || j == b.grid.ny))) continue;
      for (int c = 0; c < m.components; c++) {
        const int u = Unknown(m, b, i, j, c);

        if (hold <= HOLD_SCALED) m.Tie({{{u, size}}, {}});
        else m.fixed.emplace_back(u, r.Chance(0.5) ? 0.0 : Between(r, -1.0, 1.0));
        if (hold == HOLD_PENALTY) m.A.emplace_back(u, u, penalty);
        if (hold == HOLD_PENALTY && alone) m.Keep(u);
      }
    }
  if (hold != HOLD_CLAMPED) return;
  std::vector<bool>   clamped((size_t)m.n, false);
  std::vector<double> stiffness((size_t)m.n, 0.0);
  Triplets            rest;

  for (const auto &e : m.fixed) clamped[(size_t)e.first] = true;
  for (const auto &t : m.A) {
    if (t.row() == t.col()) stiffness[(size_t)t.row()] += t.value();
    if (!clamped[(size_t)t.row()] && !clamped[(size_t)t.col()]) rest.push_back(t);
  }
  for (auto &e : m.fixed) {
    rest.emplace_back(e.first, e.first, stiffness[(size_t)e.first]);
    e.second = 0.0; /* their columns were moved to the right-hand side */
  }
  m.A = rest;
}

/* Of each row as a spring, times 1e-8 to 1e8 of what the body itself gives way */
static void Compliance(Random &r, Model &m, std::string &text)
{
  const bool          each   = r.Chance(0.3);
  const double        factor = Decade(r, -8.0, 8.0), some = r.Chance(0.6) ? 1.0 : 0.5;
  std::vector<double> stiffness((size_t)m.n, 0.0);

  for (const auto &t : m.A)
    if (t.row() == t.col()) stiffness[(size_t)t.row()] += t.value();
  for (size_t i = 0; i < m.rows.size(); i++) {
    double flexibility = 0.0;

    for (const auto &e : m.rows[i].entries)
      flexibility += stiffness[(size_t)e.first] > 0.0 ? e.second * e.second / stiffness[(size_t)e.first] : 0.0;
    if (flexibility > 0.0 && r.Chance(some))
      m.D.emplace_back((int)i, (int)i, flexibility * (each ? Decade(r, -8.0, 8.0) : factor));
  }
  m.blockD = true;
  text += each ? " D=each" : " D=1e" + std::to_string((int)std::round(std::log10(factor)));
}

/* Sums of rows, and copies times a factor */
static void Combine(Random &r, Model &m, Structured &s)
{
  const int rows = (int)m.rows.size();

  for (int k = r.Int(1, 5); k > 0; k--) {
    const int  one = r.Int(0, rows - 1), other = r.Int(0, rows - 1);
    const auto factor = r.Chance(0.5) ? 1.0 : Between(r, 0.5, 2.0);
    Model::Row row;
    Dependence d{
      {{(int)m.rows.size(), -1.0}, {one, factor}},
      (int)m.rows.size()
    };

    for (const auto &e : m.rows[(size_t)one].entries) row.entries.emplace_back(e.first, factor * e.second);
    if (other != one && r.Chance(0.4)) {
      for (const auto &e : m.rows[(size_t)other].entries) row.entries.push_back(e);
      d.rows.emplace_back(other, 1.0);
    }
    m.rows.push_back(row);
    s.dependent.push_back(d);
  }
  s.solvable = r.Chance(0.7);
  s.text += " dependent";
}

/* Of a contact, along the face: B is C and a small other row */
static void Friction(Random &r, Model &m, int first, std::string &text)
{
  const double coefficient = Between(r, 0.05, 0.4);

  for (size_t i = (size_t)first; i < m.rows.size(); i++) {
    const int u = m.rows[i].entries.front().first, along = m.components == 2 ? (u % 2 ? u - 1 : u + 1) : u + 1;

    if (along < m.n) m.rows[i].friction.emplace_back(along, coefficient * std::abs(m.rows[i].entries.front().second));
  }
  text += " friction";
}

static void Shuffle(Random &r, Model &m)
{
  for (size_t i = m.rows.size(); i > 1; i--) std::swap(m.rows[i - 1], m.rows[(size_t)r.Int(0, (int)i - 1)]);
}

static Hold DrawHold(Random &r, int components)
{
  const double u = Between(r, 0.0, 1.0);

  if (u < 0.04) return HOLD_NOT;
  if (u < 0.09) return HOLD_SCALED;
  if (u < 0.50) return HOLD_ROWS;
  if (u < 0.70) return HOLD_CLAMPED;
  return u < 0.80 || components == 2 ? HOLD_PENALTY : HOLD_MEAN;
}

static void Loose(Random &r, Model &m, Structured &s)
{
  const int more = r.Int(1, 5);

  m.Unknowns(more);
  s.unique          = false;
  s.refuse          = true;
  s.motion          = Vector::Zero(m.n);
  s.motion[m.n - 1] = 1.0;
  s.solvable        = r.Chance(0.8);
  s.text += " loose=" + std::to_string(more);
}

void DrawMesh(Random &r, Model &m, Structured &s)
{
  const int    target = (int)Decade(r, std::log10(50.0), std::log10(3000.0)), bodies = r.Int(1, 2);
  std::string &text = s.text;
  Body         body[2];

  m.components = s.bs = r.Chance(0.35) ? 2 : 1;
  const Hold   hold   = DrawHold(r, m.components);
  const bool   floats = hold == HOLD_NOT;
  const double nodes = (double)target / (bodies * m.components), side = std::sqrt(nodes) * Decade(r, -0.2, 0.2);

  s.decades = r.Chance(0.4) ? 0.0 : Between(r, 0.0, 6.0);
  for (int b = 0; b < bodies; b++) {
    const int nx = b && r.Chance(0.5) ? body[0].grid.nx : std::max(2, (int)(side * (b ? Between(r, 0.6, 1.5) : 1.0)));

    body[b] = {
      Grid{nx, std::max(1, (int)(nodes / nx) - 1)},
      0, (double)b, b ? Decade(r, -3.0, 3.0) : 1.0
    };
    body[b].first = m.Unknowns(m.components * body[b].grid.Nodes());
    if (floats) body[b].stiffness = std::exp2(std::round(std::log2(body[b].stiffness)));
    Assemble(r, m, body[b], s.decades, floats);
  }
  text += std::string(m.components == 2 ? " elastic" : " Laplace") + " bodies=" + std::to_string(bodies) +
          " decades=" + std::to_string((int)s.decades);
  HoldBody(r, m, body[0], hold, text);
  const int tied = (int)m.rows.size();

  if (bodies == 2) TieBodies(m, body[0], body[1]);
  const bool friction = bodies == 2 && !floats && r.Chance(0.15);

  if (friction) Friction(r, m, tied, text);
  if (!floats && r.Chance(0.3)) Follow(r, m, body[bodies - 1], bodies == 1 && hold == HOLD_PENALTY, text);
  if (r.Chance(0.2)) {
    Periodic(m, body[bodies - 1]);
    text += " periodic";
  }
  if (r.Chance(0.15)) {
    Chain(r, m, body[0]);
    text += " chain";
  }
  if (hold == HOLD_MEAN || (!floats && r.Chance(0.1))) {
    MeanValue(m, body[0]);
    text += hold == HOLD_MEAN ? "" : " mean value";
  }
  if (floats) {
    s.unique = false;
    s.motion = Vector::Zero(m.n);
    for (int i = 0; i < m.n; i += m.components) s.motion[i] = 1.0;
    s.solvable = r.Chance(0.4);
  } else if (r.Chance(0.04)) {
    Loose(r, m, s);
  }
  /* no constraints at all is an error of its own */
  if (m.rows.empty()) floats ? Chain(r, m, body[0]) : MeanValue(m, body[0]);
  if (r.Chance(0.3)) Shuffle(r, m);
  if (r.Chance(0.2) && hold != HOLD_SCALED) Compliance(r, m, text);
  else if (r.Chance(0.12) && s.unique && !friction) Combine(r, m, s);
}
