#include "structured.h"

double Between(Random &r, double low, double high)
{
  return (double)r.Real((PetscReal)low, (PetscReal)high);
}

double Decade(Random &r, double low, double high)
{
  return std::pow(10.0, Between(r, low, high));
}

int Model::Unknowns(int count)
{
  const int first = n;

  n += count;
  touched.resize((size_t)n, false);
  return first;
}

bool Model::Tie(const Row &row)
{
  if (Touched(row.entries.front().first)) return false;
  for (const auto &e : row.entries) touched[(size_t)e.first] = true;
  rows.push_back(row);
  return true;
}

static Sparse FromTriplets(int rows, int columns, const Triplets &entries)
{
  Sparse M(rows, columns);

  M.setFromTriplets(entries.begin(), entries.end());
  return M;
}

/* One kind after the other, as often as its share says */
static const struct {
  const char *name;
  double      share;
  void (*draw)(Random &, Model &, Structured &);
} kinds[] = {
  {"mesh",       0.52, DrawMesh      },
  {"flow",       0.10, DrawFlow      },
  {"network",    0.15, DrawNetwork   },
  {"interior",   0.10, DrawInterior  },
  {"fold",       0.06, DrawFold      },
  {"firstorder", 0.07, DrawFirstOrder}
};

Structured::Structured(Random &r)
{
  Model    model;
  Triplets c, more;
  double   left = Between(r, 0.0, 1.0);
  size_t   k    = 0;

  for (; k + 1 < sizeof(kinds) / sizeof(kinds[0]) && left >= kinds[k].share; k++) left -= kinds[k].share;
  kind = kinds[k].name;
  kinds[k].draw(r, model, *this);
  for (size_t i = 0; i < model.rows.size(); i++) {
    for (const auto &e : model.rows[i].entries) c.emplace_back((int)i, e.first, e.second);
    for (const auto &e : model.rows[i].friction) more.emplace_back((int)i, e.first, e.second);
  }
  const int n = model.n, m = (int)model.rows.size();

  A = FromTriplets(n, n, model.A);
  C = FromTriplets(m, n, c);
  B = C;
  if (!more.empty()) {
    B         = C + FromTriplets(m, n, more);
    symmetric = false;
  }
  if (model.blockD) D = FromTriplets(m, m, model.D);
  text = kind + " n=" + std::to_string(n) + " m=" + std::to_string(m) + text;
  RightHandSide(r, model.fixed);
  Layout(r);
  Options(r);
}

/* Dependent rows get what their combination asks for, or something else */
void Structured::Contradict(Random &r)
{
  for (const Dependence &d : dependent) {
    double sum = 0.0, size = 0.0, own = 0.0;

    for (const auto &e : d.rows) {
      if (e.first == d.drop) own = e.second;
      else {
        sum += e.second * g[e.first];
        size += std::abs(e.second * g[e.first]);
      }
    }
    g[d.drop] = -sum / own;
    if (!solvable && unique) g[d.drop] += (size > 0.0 ? size : 1.0) / own * Between(r, 0.5, 1.0);
  }
}

void Structured::RightHandSide(Random &r, const std::vector<std::pair<int, double>> &fixed)
{
  const int n = (int)A.rows(), m = (int)C.rows(), mode = unique ? r.Int(0, 9) : solvable ? 4 : 0;
  Vector    lambda = Uniform(r, m), size(m), loads = Uniform(r, n), values(m);

  for (int i = 0; i < m; i++) {
    const double b = B.row(i).norm(), c = C.row(i).norm(), d = D.size() ? D.coeff(i, i) : 0.0;

    size[i] = c;
    if (d > 0.0) lambda[i] *= std::min(1.0, (c > 0.0 ? c : 1.0) / d); /* so that D lambda is not all that there is */
    if (b > 1.0) lambda[i] /= b;
  }
  values = size.cwiseProduct(Uniform(r, m)) * Decade(r, -3.0, 0.0);
  if (mode < 4) { /* loads, and distances */
    f = loads;
    if (!unique) f = f.cwiseAbs() + Vector::Constant(n, 0.1); /* nothing balances that */
    g = !unique || r.Chance(0.4) ? Vector(Vector::Zero(m)) : values;
    for (const auto &e : fixed) f[e.first] = A.coeff(e.first, e.first) * e.second;
    text += " loads";
  } else if (mode < 6) { /* of a given answer */
    f = A * loads + B.transpose() * lambda;
    g = C * loads;
    if (D.size()) g -= D * lambda;
    text += " given";
  } else if (mode < 8) {
    /* nothing but reactions, as of a network whose sources have one pressure, with demands or at rest */
    lambda = r.Chance(0.5) ? Vector(lambda * 100.0) : Vector(Vector::Constant(m, r.Chance(0.5) ? 1.0 : 100.0));
    f      = B.transpose() * lambda;
    g      = D.size() ? Vector(-(D * lambda)) : Vector(Vector::Zero(m));
    rest   = solvable && (kind != "network" || r.Chance(0.3));
    if (!rest) g += values;
    text += rest ? " rest" : " reactions";
  } else {
    f = Vector::Zero(n);
    g = values;
    text += " g";
  }
  Contradict(r);
  if (!unique) text += solvable ? " balanced" : " unbalanced";
  else if (!solvable) text += " contradictory";
}

void Structured::Layout(Random &r)
{
  first = r.Chance(0.3);
  if (r.Chance(0.2)) convention = (Convention)r.Int(NEGATED, OPPOSITE);
  if (convention != PLAIN) text += " convention " + std::to_string(convention);
  if (A.rows() % bs || r.Chance(0.2)) bs = 1;
  if (symmetric && (convention == PLAIN || convention == NEGATED) && r.Chance(0.5)) form = r.Int(1, 3);
  diagonal = diagonal && r.Chance(0.6);
  if (diagonal && r.Chance(0.1)) type = symmetric && !PetscDefined(USE_COMPLEX) && r.Chance(0.5) ? MATSBAIJ : MATBAIJ;
  text += std::string(" bs=") + std::to_string(bs) + (first ? " first" : "") + (diagonal ? "" : " no zeros stored");
  if (std::string(type) != MATAIJ) text += std::string(" ") + type;
}

void Structured::Options(Random &r)
{
  static const char *const pmats[] = {"jcb", "id", "cc", "cg", "bj_cc", "bj_cg"};
  PetscMPIInt              ranks;
  const int                precision = r.Int(0, 9), method = r.Chance(0.7) ? -1 : r.Int(0, 5);

  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  if (precision > 5) options += " -ainsworth_ksp_rtol 1e-12";
  else if (precision == 5) options += " -ainsworth_ksp_rtol 1e-10";
  if (D.size() && (convention != PLAIN || A.rows() == C.rows()))
    options += std::string(" -pc_ainsworth_multiplier_fields ") + (first ? "0" : "1");
  if (r.Chance(0.1)) options += std::string(" -pc_ainsworth_pmat ") + pmats[r.Int(0, 5)];
  if (r.Chance(0.3)) options += " -pc_ainsworth_gram polynomial";
  if (r.Chance(0.1)) options += " -pc_ainsworth_rows_per_rank " + std::to_string(r.Int(1, 400));
  switch (method) {
  case 0:
    options += " -ainsworth_pc_type jacobi";
    tame = tame && decades <= 2.0 && kind != "fold" && kind != "firstorder" && kind != "interior";
    break;
  case 1:
    /* LU, which takes small pivots for zero, whatever the scale */
    options += " -ainsworth_pc_type redundant -ainsworth_redundant_pc_factor_zeropivot 1e-300";
    break;
  case 2:
    if (ranks > 1 || !symmetric || kind == "fold") break; /* on several ranks GAMG's errors are on one of them alone */
    options += " -ainsworth_pc_type gamg";
    tame = false;
    break;
  case 3:
    options += " -ainsworth_ksp_type gmres -ainsworth_ksp_gmres_restart 200";
    break;
  case 4:
    if (!symmetric) break;
    options += " -ainsworth_ksp_type minres";
    tame = false;
    break;
  case 5:
    options += " -ksp_type fgmres -ksp_rtol 1e-10 -ksp_max_it 100";
    outer = true;
    form  = form > 1 ? 0 : form; /* it multiplies by the whole matrix */
    break;
  default:
    break;
  }
  text += " form=" + std::to_string(form);
}
