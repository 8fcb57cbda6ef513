/* The constraints of each model */
#include "model.h"
#include <algorithm>
#include <array>
#include <cmath>

namespace
{
typedef std::array<PetscReal, 3>                    Point;
typedef std::vector<std::pair<PetscInt, PetscReal>> Entries; /* a linear form in the unknowns */

/* A rigid motion t + r x (x - center), its translation and rotation linear forms in the unknowns */
struct Motion {
  Point   center;
  Entries t[3], r[3];
};

/* Adds rows until there are as many slaves as were asked for; only those of this rank are kept */
class Builder {
public:
  explicit Builder(Model *m) : model(m), mesh(m->mesh), upper(mesh.body[1]), lower(mesh.body[0]) { }
  PetscErrorCode build();

private:
  Model           *model;
  const CubesMesh &mesh;
  const CubesBody &upper, &lower;

  bool     full() const { return model->options.slaves && model->slaves >= model->options.slaves; }
  PetscInt column(PetscInt node, int c) const { return 3 * mesh.number[node] + c; }
  PetscInt extraColumn(PetscInt k, int c) const { return 3 * (mesh.nodes + k) + c; }
  PetscInt partner(PetscInt i, PetscInt j) const { return lower.Node(i, j, lower.n[2]); }
  Point    position(PetscInt node) const
  {
    PetscReal x[3];
    Point     y;

    mesh.Position(node, x);
    mesh.Rotate(x, y.data());
    return y;
  }
  PetscInt addExtra(const Point &x)
  {
    model->extra.insert(model->extra.end(), x.begin(), x.end());
    return (PetscInt)model->extra.size() / 3 - 1;
  }
  /* The row is on the rank of a node */
  void add(PetscInt node, Entries entries, PetscReal g = 0.0, bool dependent = false);

  void tie(PetscInt i, PetscInt j, const PetscReal R[3][3]);
  void chain(PetscInt i, PetscInt j);
  void sumOfTies(PetscInt i, PetscInt j);
  void mortar(PetscInt i, PetscInt j);
  void mean();
  void spider(PetscInt i, PetscInt j, PetscInt size);
  void follow(PetscInt node, const Motion &);
  void eliminate(const std::vector<PetscInt> &);
  void average(const std::vector<PetscInt> &, const Motion &);
  void periodic(int body);
  void fiber(PetscInt i, PetscInt k);

  std::vector<PetscInt> patch(int body, PetscInt i, PetscInt j, PetscInt size) const;
  Point                 centroid(const std::vector<PetscInt> &) const;
};

void Append(Entries &to, const Entries &from, PetscReal factor)
{
  if (factor == 0.0) return;
  for (const auto &e : from) to.emplace_back(e.first, factor * e.second);
}

/* Component c of r x d */
void AppendCross(Entries &to, const Entries r[3], const Point &d, int c, PetscReal factor)
{
  const int a = (c + 1) % 3, b = (c + 2) % 3;

  Append(to, r[a], factor * d[b]);
  Append(to, r[b], -factor * d[a]);
}

Point Difference(const Point &x, const Point &y)
{
  return Point{x[0] - y[0], x[1] - y[1], x[2] - y[2]};
}

void Builder::add(PetscInt node, Entries entries, PetscReal g, bool dependent)
{
  ModelRow row = {Entries(), g, dependent};

  if (!mesh.Owns(node)) return;
  std::sort(entries.begin(), entries.end());
  for (const auto &e : entries) {
    if (row.entries.size() && row.entries.back().first == e.first) row.entries.back().second += e.second;
    else row.entries.push_back(e);
  }
  model->rows.push_back(row);
}

void Builder::tie(PetscInt i, PetscInt j, const PetscReal R[3][3])
{
  const PetscInt slave = upper.Node(i, j, 0), master = partner(i, j);

  for (int c = 0; c < 3; c++) {
    Entries e = {
      {column(slave, c), 1.0}
    };
    for (int d = 0; d < 3; d++)
      if (R[c][d] != 0.0) e.emplace_back(column(master, d), -R[c][d]);
    add(slave, e);
  }
  model->slaves += 3;
}

void Builder::chain(PetscInt i, PetscInt j)
{
  const PetscInt slave = upper.Node(i, j, 0), links = model->options.links;
  PetscInt       first = 0;

  for (PetscInt l = 0; l < links; l++) {
    const PetscInt k = addExtra(position(slave));
    if (!l) first = k;
  }
  for (PetscInt l = 0; l <= links; l++)
    for (int c = 0; c < 3; c++)
      add(slave, {
                   {l ? extraColumn(first + l - 1, c) : column(slave, c), 1.0 },
                   { l < links ? extraColumn(first + l,        c) : column(partner(i,                j), c), -1.0}
      });
  model->slaves += 3;
}

/* The mean of a tie and the one before it */
void Builder::sumOfTies(PetscInt i, PetscInt j)
{
  const PetscInt slave = upper.Node(i, j, 0);

  for (int c = 0; c < 3; c++)
    add(slave,
        {
          {column(slave,         c), 0.5},
          {     column(upper.Node(i - 1,                   j, 0),  c), 0.5},
          {  column(partner(i,     j), c),  -0.5},
          {column(partner(i - 1, j), c),  -0.5}
    },
        0.0, true);
}

void Builder::mortar(PetscInt i, PetscInt j)
{
  const PetscInt  n         = upper.n[0];
  const PetscReal weight[3] = {3.0, 2.0, 1.0};

  for (int c = 0; c < 3; c++) {
    Entries   e;
    PetscReal sum = 0.0;
    for (PetscInt b = PetscMax(0, j - 2); b <= PetscMin(n, j + 2); b++)
      for (PetscInt a = PetscMax(0, i - 2); a <= PetscMin(n, i + 2); a++) {
        const PetscReal w = weight[PetscAbsInt(a - i)] * weight[PetscAbsInt(b - j)];
        e.emplace_back(column(upper.Node(a, b, 0), c), w);
        e.emplace_back(column(partner(a, b), c), -w);
        sum += w;
      }
    for (auto &entry : e) entry.second /= sum;
    add(upper.Node(i, j, 0), e);
  }
  model->slaves += 3;
}

/*
   t - mean(u) = 0 and r - the rotation that fits u best = 0; without a motion (t and r empty) mean and moments of u are
   zero
*/
void Builder::average(const std::vector<PetscInt> &nodes, const Motion &m)
{
  Point     x       = centroid(nodes);
  PetscReal J[3][3] = {
    {0, 0, 0},
    {0, 0, 0},
    {0, 0, 0}
  };
  Entries moment[3];

  for (PetscInt node : nodes) {
    const Point d = Difference(position(node), x);
    for (int a = 0; a < 3; a++) {
      J[a][a] += d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
      for (int b = 0; b < 3; b++) J[a][b] -= d[a] * d[b];
      const int p = (a + 1) % 3, q = (a + 2) % 3; /* component a of d x u */
      moment[a].emplace_back(column(node, q), d[p]);
      moment[a].emplace_back(column(node, p), -d[q]);
    }
  }
  for (int c = 0; c < 3; c++) {
    Entries e;
    Append(e, m.t[c], 1.0);
    for (PetscInt node : nodes) e.emplace_back(column(node, c), -1.0 / (PetscReal)nodes.size());
    add(nodes[0], e);
  }
  for (int c = 0; c < 3; c++) { /* J r = sum d x u, over the trace of J */
    const PetscReal size = J[0][0] + J[1][1] + J[2][2];
    Entries         e;
    for (int b = 0; b < 3; b++) Append(e, m.r[b], J[c][b] / size);
    Append(e, moment[c], -1.0 / size);
    add(nodes[0], e);
  }
}

void Builder::mean()
{
  std::vector<PetscInt> nodes;

  for (PetscInt s = 0; s < upper.Nodes() && !full(); s++) {
    if (mesh.Fixed(upper.node + s)) continue;
    nodes.push_back(upper.node + s);
    model->slaves += 3;
  }
  average(nodes, Motion());
}

std::vector<PetscInt> Builder::patch(int body, PetscInt i, PetscInt j, PetscInt size) const
{
  std::vector<PetscInt> nodes;

  for (PetscInt b = j; b < j + size; b++)
    for (PetscInt a = i; a < i + size; a++) nodes.push_back(body ? upper.Node(a, b, 0) : partner(a, b));
  return nodes;
}

Point Builder::centroid(const std::vector<PetscInt> &nodes) const
{
  Point x = {0, 0, 0};

  for (PetscInt node : nodes)
    for (int c = 0; c < 3; c++) x[c] += position(node)[c] / (PetscReal)nodes.size();
  return x;
}

/* u = t + r x d */
void Builder::follow(PetscInt node, const Motion &m)
{
  for (int c = 0; c < 3; c++) {
    Entries e = {
      {column(node, c), 1.0}
    };
    Append(e, m.t[c], -1.0);
    AppendCross(e, m.r, Difference(position(node), m.center), c, -1.0);
    add(node, e);
  }
}

/*
   The nodes move as a rigid body, by three that are not on a line: the motion of these is that body's, and they keep
   their distances
*/
void Builder::eliminate(const std::vector<PetscInt> &nodes)
{
  const PetscInt  n        = (PetscInt)std::lround(std::sqrt((PetscReal)nodes.size() / 2));
  const PetscInt  three[3] = {nodes[0], nodes[n - 1], nodes[n * (n - 1)]};
  const Point     x = position(three[0]), a = Difference(position(three[1]), x), b = Difference(position(three[2]), x);
  const PetscReal aa = a[0] * a[0] + a[1] * a[1] + a[2] * a[2], bb = b[0] * b[0] + b[1] * b[1] + b[2] * b[2];
  const Point     normal = {(a[1] * b[2] - a[2] * b[1]) / std::sqrt(aa * bb),
                            (a[2] * b[0] - a[0] * b[2]) / std::sqrt(aa * bb),
                            (a[0] * b[1] - a[1] * b[0]) / std::sqrt(aa * bb)};
  Motion          m;
  Entries         da[3], db[3]; /* displacements of the second and the third node relative to the first */

  m.center = x;
  for (int c = 0; c < 3; c++) {
    m.t[c] = {
      {column(three[0], c), 1.0}
    };
    da[c] = {
      {column(three[1], c), 1.0 },
      {column(three[0], c), -1.0}
    };
    db[c] = {
      {column(three[2], c), 1.0 },
      {column(three[0], c), -1.0}
    };
  }
  /* a and b are orthogonal: r = (a x da) / aa has all but the part along a, which is that of db along the normal */
  for (int c = 0; c < 3; c++) {
    const int p = (c + 1) % 3, q = (c + 2) % 3;
    Append(m.r[c], da[q], a[p] / aa);
    Append(m.r[c], da[p], -a[q] / aa);
    for (int k = 0; k < 3; k++) Append(m.r[c], db[k], a[c] / std::sqrt(aa) * normal[k] / std::sqrt(bb));
  }
  Entries along[3]; /* lengths of a and b, and the angle between them */
  for (int k = 0; k < 3; k++) {
    Append(along[0], da[k], a[k] / aa);
    Append(along[1], db[k], b[k] / bb);
    Append(along[2], da[k], b[k] / bb);
    Append(along[2], db[k], a[k] / aa * std::sqrt(aa / bb));
  }
  for (const Entries &e : along) add(three[1], e);
  for (PetscInt node : nodes)
    if (node != three[0] && node != three[1] && node != three[2]) follow(node, m);
}

void Builder::spider(PetscInt i, PetscInt j, PetscInt size)
{
  std::vector<PetscInt> nodes = patch(1, i, j, size), below = patch(0, i, j, size);
  Motion                m;

  m.center = centroid(nodes);
  if (model->options.type == MODEL_RIGID) {
    nodes.insert(nodes.end(), below.begin(), below.end());
    eliminate(nodes);
    model->slaves += 3 * (PetscInt)nodes.size() - 6;
    return;
  }
  const PetscInt k = addExtra(m.center);
  (void)addExtra(m.center);
  for (int c = 0; c < 3; c++) {
    m.t[c] = {
      {extraColumn(k, c), 1.0}
    };
    m.r[c] = {
      {extraColumn(k + 1, c), 1.0}
    };
  }
  for (const auto *side : {&nodes, &below}) {
    if (model->options.type == MODEL_RBE3) average(*side, m);
    else
      for (PetscInt node : *side) follow(node, m);
    model->slaves += 3 * (PetscInt)side->size();
  }
}

/* u at x = 1 is u at x = 0 plus the strain's part, and so for y; the strain is (xx, yy, xy) */
void Builder::periodic(int body)
{
  const CubesBody &b    = mesh.body[body];
  const PetscInt   n    = b.n[0];
  const PetscReal  E[3] = {mesh.options.gamma, 0, mesh.options.gamma / 2};

  for (PetscInt k = 0; k <= b.n[2]; k++)
    for (PetscInt j = 0; j <= n; j++)
      for (PetscInt i = 0; i <= n && !full(); i++) {
        const PetscReal jump[2] = {i == n ? 1.0 : 0.0, j == n ? 1.0 : 0.0};
        const PetscInt  slave = b.Node(i, j, k), master = b.Node(i % n, j % n, k);

        if (slave == master || mesh.Fixed(slave)) continue;
        for (int c = 0; c < 3; c++) {
          Entries e = {
            {column(slave,  c), 1.0 },
            {column(master, c), -1.0}
          };
          PetscReal g = 0.0;
          for (int d = 0; d < 2 && c < 2; d++) {
            const int which = c == d ? c : 2;
            if (jump[d] == 0.0) continue;
            if (model->options.type == MODEL_PERIODIC) e.emplace_back(extraColumn(0, which), -jump[d]);
            g += jump[d] * E[which];
          }
          add(slave, e, model->options.type == MODEL_STRAIN ? g : 0.0);
        }
        model->slaves += 3;
      }
}

/* The line through the centers of the elements (i, ., k) */
void Builder::fiber(PetscInt i, PetscInt k)
{
  const PetscInt n = upper.n[1];

  for (PetscInt j = 0; j < n; j++) {
    std::vector<PetscInt> corners;
    for (int c = 0; c < 8; c++) corners.push_back(upper.Node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)));
    const PetscInt extra = addExtra(centroid(corners));
    for (int c = 0; c < 3; c++) {
      Entries e = {
        {extraColumn(extra, c), 1.0}
      };
      for (PetscInt node : corners) e.emplace_back(column(node, c), -0.125);
      add(corners[0], e);
    }
    /* as stiff as a bar with the section of an element and -contrast times its modulus */
    if (j)
      model->bars.push_back({
        {extra - 1, extra},
        model->options.contrast * mesh.options.E[1] * mesh.options.height / (PetscReal)upper.n[2]
      });
    model->slaves += 3;
  }
}

PetscErrorCode Builder::build()
{
  const ModelOptions &o       = model->options;
  const PetscInt      n       = upper.n[0];
  const PetscReal     radians = (o.type == MODEL_CYCLIC ? o.angle : 0.0) * PETSC_PI / 180, third = 1.0 / 3.0;
  PetscReal           R[3][3]; /* about (1,1,1) */

  PetscFunctionBeginUser;
  model->slaves = 0;
  for (int a = 0; a < 3; a++)
    for (int b = 0; b < 3; b++)
      R[a][b] = (1 - std::cos(radians)) * third +
                (a == b ? std::cos(radians) : (b == (a + 1) % 3 ? -1 : 1) * std::sin(radians) / std::sqrt(3.0));
  if (o.type == MODEL_MEAN) mean();
  else if (o.type == MODEL_PERIODIC || o.type == MODEL_STRAIN) {
    if (o.type == MODEL_PERIODIC) (void)addExtra(Point{0, 0, 0});
    for (int body = 0; body < 2; body++) periodic(body);
  } else if (o.type == MODEL_FIBERS) {
    /* every other line, so that few of them share unknowns */
    for (PetscInt k = 0; k < upper.n[2]; k += 2)
      for (PetscInt i = 0; i < n && !full(); i += 2) fiber(i, k);
  } else if (o.type == MODEL_RBE2 || o.type == MODEL_RIGID || o.type == MODEL_RBE3) {
    const PetscInt size = o.patch ? o.patch : n + 1;
    for (PetscInt j = 0; j + size <= n + 1; j += size)
      for (PetscInt i = 0; i + size <= n + 1 && !full(); i += size) spider(i, j, size);
  } else {
    for (PetscInt j = 0; j <= n; j++)
      for (PetscInt i = 0; i <= n && !full(); i++) {
        if (o.type == MODEL_CHAIN) chain(i, j);
        else if (o.type == MODEL_MORTAR) mortar(i, j);
        else tie(i, j, R);
        if (o.type == MODEL_REDUNDANT && i % 2) sumOfTies(i, j);
      }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

PetscErrorCode ModelCreateRows(Model *model)
{
  PetscFunctionBeginUser;
  PetscCall(Builder(model).build());
  PetscFunctionReturn(PETSC_SUCCESS);
}
