/* Interior points, optimal control */
#include "systems.h"

/*
   min q(x) with equations and inequalities: A = Q + diag(z / x), D = 0 for equations and slack / multiplier for
   inequalities. Near the end half of either is tiny and half is huge
*/
struct InteriorPoint {
  int    n, equations, inequalities;
  bool   quadratic; /* Q of rank n / 2; otherwise 0 */
  double decades;   /* of diag(z / x) and of D */
  bool   end;       /* all at the ends of that range */
  double regular;   /* added to all of D */
  /* unknowns far from their bounds, at the end: fewer than rows at a degenerate vertex; otherwise about half */
  int    basic    = -1;
  double scales   = 0.0; /* rows times 10^u, u between -scales and scales */
  int    free     = 0;   /* unknowns without bounds and without Q: zero rows of A */
  int    repeated = 0;   /* equations that are sums of others */
};

static Matrix Barrier(Random &r, int n, double decades, bool end)
{
  Matrix d = Logs(r, n, -decades / 2, decades / 2);

  for (int i = 0; end && i < n; i++)
    d(i, i) = std::pow(10.0, (r.Chance(0.5) ? 0.5 : -0.5) * decades + (double)r.Real(-1.0, 1.0));
  return d;
}

/* As Logs(), by powers of 2 */
static Matrix Logs2(Random &r, int n, double decades)
{
  Vector d(n);

  for (int i = 0; i < n; i++) d[i] = std::exp2(std::round((double)r.Real(-decades, decades) * std::log2(10.0)));
  return d.asDiagonal();
}

static void InteriorPointMake(Saddle &s, const InteriorPoint &p)
{
  Random    r = SaddleRandom(s.name);
  const int m = p.equations + p.inequalities;

  s.A = Barrier(r, p.n, p.decades, p.end);
  for (int i = 0; p.basic >= 0 && i < p.n; i++)
    s.A(i, i) = std::pow(10.0, (i % (p.n / p.basic) ? 0.5 : -0.5) * p.decades + (double)r.Real(-1.0, 1.0));
  if (p.quadratic) {
    const Matrix G = SparseRows(r, p.n / 2, p.n, 3);
    s.A += G.transpose() * G;
  }
  for (int i = 0; i < p.free; i++) { /* each has an equation of its own */
    s.A.row(i).setZero();
    s.A.col(i).setZero();
  }
  s.C = (SparseRows(r, m, p.n, 4) * 1024.0).array().round() / 1024.0; /* sums of rows are exact */
  s.C = Logs2(r, m, p.scales) * s.C;
  for (int i = 0; i < p.repeated; i++) s.C.row(i) = s.C.row(p.repeated + 2 * i) - s.C.row(p.repeated + 2 * i + 1);
  s.B = s.C;
  s.D = Matrix::Zero(m, m);
  if (p.inequalities)
    s.D.bottomRightCorner(p.inequalities, p.inequalities) = Barrier(r, p.inequalities, p.decades, p.end);
  s.D.diagonal().array() += p.regular;
  /* what a Newton step has: residuals in units of their rows */
  const Vector unit = s.A.diagonal().cwiseMax(1e-3).cwiseSqrt();
  s.f               = unit.cwiseProduct(Uniform(r, p.n));
  s.g               = s.C * unit.cwiseInverse().cwiseProduct(Uniform(r, p.n));
  for (int i = 0; i < p.repeated; i++) {
    for (int k = 1; k <= 2; k++)
      s.g[p.repeated + 2 * i + k - 1] = std::round(s.g[p.repeated + 2 * i + k - 1] * 1024.0) / 1024.0;
    s.g[i] = s.g[p.repeated + 2 * i] - s.g[p.repeated + 2 * i + 1];
  }
}

/* min |y - y0|^2 + beta |u|^2 with K y = M u on the unit square */
static void Control(Saddle &s, int cells, double beta, bool reduced, double states)
{
  const Grid grid = {cells, cells};
  Random     r    = SaddleRandom(s.name);
  Matrix     K = Laplacian(grid, [](int, int) { return 1.0; }), M = Mass(grid);
  const int  N    = grid.Nodes();
  Vector     none = Vector::Zero(N);

  for (int j = 0; j <= cells; j++)
    for (int i = 0; i <= cells; i++)
      if (i == 0 || j == 0 || i == cells || j == cells) Clamp(K, none, grid.Node(i, j));
  Matrix Q = M; /* of the state; with the penalty of Moreau and Yosida where a bound is active */
  for (int i = 0; i < N; i++)
    if (r.Chance(states)) Q(i, i) += 1e6 * M(i, i);
  if (reduced) { /* u = M^{-1} M' lambda / beta: [Q K; K -M / beta] */
    s.A = Q;
    s.B = s.C = K;
    s.D       = M / beta;
  } else {
    s.A = Diagonal({Q, beta * M});
    s.C = Matrix(N, 2 * N);
    s.C << K, -M;
    s.B = s.C;
  }
  s.f         = Vector::Zero(s.A.rows());
  s.f.head(N) = M * Uniform(r, N);
  s.g         = M * Vector::Ones(N);
}

void AddOptimization(Entries &all)
{
  const struct {
    const char   *name;
    InteriorPoint p;
  } points[] = {
    {"lp_mid",            {120, 50, 0, false, 6.0, false, 0.0}              },
    {"lp_end",            {120, 50, 0, false, 12.0, true, 0.0}              },
    {"lp_end_regular",    {120, 60, 0, false, 12.0, true, 1e-8}             },
    {"qp_mid",            {120, 20, 40, true, 6.0, false, 0.0}              },
    {"qp_end",            {120, 20, 40, true, 12.0, true, 0.0}              },
    {"qp_end_wide",       {120, 0, 60, true, 12.0, true, 0.0}               },
    {"qp_spread",         {150, 10, 60, true, 12.0, false, 0.0}             },
    {"qp_equations",      {150, 60, 0, true, 8.0, true, 0.0}                },
    {"qp_regular",        {100, 30, 30, true, 10.0, true, 1e-8}             },
    {"qp_large",          {400, 60, 120, true, 10.0, true, 0.0}             },
    {"lp_degenerate",     {120, 50, 0, false, 8.0, true, 0.0, 30}           },
    {"lp_degenerate_end", {120, 50, 0, false, 12.0, true, 1e-8, 30}         },
    {"qp_scaled",         {120, 20, 40, true, 8.0, true, 0.0, -1, 3.0}      },
    {"qp_free",           {120, 50, 20, true, 6.0, true, 0.0, -1, 0.0, 30}  },
    {"qp_repeated",       {120, 40, 20, true, 6.0, true, 0.0, -1, 0.0, 0, 6}},
    {"inequalities",      {40, 0, 120, true, 6.0, false, 0.0}               }, /* m > n */
    {"inequalities_end",  {50, 5, 100, true, 12.0, true, 0.0}               }
  };
  for (const auto &point : points) {
    const InteriorPoint p = point.p;
    all.push_back({p.inequalities + p.equations > p.n ? "many rows" : "interior point", point.name,
                   [=](Saddle &s) { InteriorPointMake(s, p); }});
  }
  for (int e : {-2, -6, -10}) {
    const double beta = std::pow(10.0, e);

    all.push_back(
      {"optimal control", "control_1e" + std::to_string(e), [=](Saddle &s) { Control(s, 8, beta, false, 0.0); }});
    all.push_back({"optimal control", "control_reduced_1e" + std::to_string(e),
                   [=](Saddle &s) { Control(s, 9, beta, true, 0.0); }});
  }
  all.push_back({"optimal control", "control_states", [](Saddle &s) { Control(s, 8, 1e-4, false, 0.3); }});
}
