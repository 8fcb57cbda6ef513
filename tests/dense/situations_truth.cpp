/* What says to have converged is right, whatever inner method, side, norm and preconditioner; what failed says why */
#include "situations.h"

enum Kind {
  DEFINITE,
  INDEFINITE_ON_RANGE,
  INDEFINITE_ON_KERNEL,
  NOT_SYMMETRIC,
  NEGATIVE,
  FLOATING
};
static const Parts kinds = {"definite", "indefinite on the range", "indefinite on Ker C", "not symmetric", "negative"};
static const std::string jacobi = "-ainsworth_pc_type jacobi ";

/* Two chains of springs, one of them stiff, and rows that tie them; of each kind A is what its name says */
static DenseSystem TwoChains(Kind kind)
{
  const PetscInt n = 24, m = 5;
  DenseSystem    d = Chain(n, m, 0.0);

  d.C.setZero();
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal left = i > 12 ? 100.0 : 1.0, right = i > 11 ? 100.0 : 1.0;
    const bool      first = i == 0 || i == 12, last = i == 11 || i == n - 1; /* of its chain */

    d.A(i, i) = (first ? 1.0 : left) + (last ? 0.0 : right);
    if (i) d.A(i, i - 1) = d.A(i - 1, i) = first ? 0.0 : -left;
  }
  for (PetscInt i = 0; i < m; i++) {
    d.C(i, 2 * i)      = 1.0;
    d.C(i, 12 + 2 * i) = -1.0;
  }
  d.f = Column::LinSpaced(n, -1.0, 2.0);
  d.g = Column::LinSpaced(m, 0.5, 1.0);
  if (kind == INDEFINITE_ON_RANGE) d.A -= 50.0 * d.C.transpose() * d.C;
  if (kind == INDEFINITE_ON_KERNEL)
    for (int i : {1, 5, 9, 11}) d.A(i, i) -= 8.0;
  if (kind == NEGATIVE) d.A = -d.A;
  if (kind == NOT_SYMMETRIC)
    for (PetscInt i = 1; i < n; i++) d.A(i, i - 1) *= 0.7;
  if (kind == FLOATING) {
    d.A(12, 12) -= 1.0;
    d.C.setZero();
    for (PetscInt i = 0; i < m; i++) {
      d.C(i, 12 + 2 * i) = 1.0;
      d.C(i, 13 + 2 * i) = -1.0;
    }
  }
  return d;
}

/* Heat conduction in a cell of 5 x 4 nodes: opposite edges differ by a given gradient, the mean value is given */
static DenseSystem Cell(Kind kind)
{
  const PetscInt nx = 5, ny = 4, n = nx * ny, m = nx + ny - 1;
  DenseSystem    d;

  d.A = Dense::Zero(n, n);
  d.C = Dense::Zero(m, n);
  d.g = Column::Zero(m);
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j : {i + 1, i + nx}) {
      const PetscReal k = 1.0 + 9.0 * (i % 3 == 0);

      if (j >= n || (j == i + 1 && j % nx == 0)) continue;
      d.A(i, i) += k;
      d.A(j, j) += k;
      d.A(i, j) = -k;
      d.A(j, i) = kind == NOT_SYMMETRIC ? -0.5 * k : -k; /* carried along by a flow */
    }
  for (PetscInt i = 0; i < m - 1; i++) {
    d.C(i, i < ny ? nx * i : i - ny)                   = -1.0;
    d.C(i, i < ny ? nx * i + nx - 1 : n - nx + i - ny) = 1.0;
    d.g[i]                                             = i < ny ? 0.5 : -0.2;
  }
  if (kind != FLOATING) d.C.row(m - 1).setConstant(1.0 / n);
  else d.C.row(m - 1) = d.C.row(0) + 0.5 * d.C.row(ny); /* its mean value is not held, another row is there */
  if (kind == FLOATING) d.g[m - 1] = d.g[0] + 0.5 * d.g[ny];
  d.f = Column::LinSpaced(n, -1.0, 2.0);
  if (kind == INDEFINITE_ON_KERNEL) d.A -= 3.0 * Dense::Identity(n, n); /* a vibration above the first frequency */
  if (kind == NEGATIVE) d.A = -d.A;
  return d;
}

/* Two unknowns more, too soft for the norm of a residual; where they rest the row without a diagonal is not met */
static DenseSystem SoftPair()
{
  DenseSystem    d = TwoChains(DEFINITE);
  const PetscInt n = d.A.rows();

  d.A.conservativeResizeLike(Dense::Zero(n + 2, n + 2));
  d.C.conservativeResizeLike(Dense::Zero(d.C.rows(), n + 2));
  d.f.conservativeResizeLike(Column::Zero(n + 2));
  d.A(n, n + 1) = d.A(n + 1, n) = d.A(n + 1, n + 1) = d.f[n] = 1e-11;
  return d;
}

/* A row of C as the last */
static DenseSystem WithRow(DenseSystem d, const Dense &row, PetscReal g)
{
  const PetscInt m = d.C.rows();

  d.C.conservativeResize(m + 1, Eigen::NoChange);
  d.C.row(m) = row;
  d.g.conservativeResize(m + 1);
  d.g[m] = g;
  return d;
}

/* Both equations hold, and x is that of dense algebra; known: a method must solve the system, others may say why not */
static Action Honest(bool known)
{
  return Either(
    [](Live &s) -> PetscErrorCode {
      PetscFunctionBeginUser;
      PetscCall(Residuals(1e-5, 1e-10)(s));
      PetscCall(EqualX(1e-4)(s));
      PetscFunctionReturn(PETSC_SUCCESS);
    },
    known ? nullptr : Fails());
}

static PetscErrorCode Methods(int crossed)
{
  const Parts       methods  = {"projectedcg", "gmres",    "cg",     "cg -ainsworth_ksp_cg_single_reduction",
                                "fcg",         "pipecg",   "minres", "cr",
                                "cgs",         "bcgs",     "bcgsl",  "tfqmr",
                                "fgmres",      "gcr",      "symmlq", "lsqr",
                                "richardson",  "chebyshev"};
  const Parts       variants = {"norm_type preconditioned",
                                "norm_type unpreconditioned",
                                "norm_type natural",
                                "norm_type none -ainsworth_ksp_max_it 60",
                                "max_it 100 -ainsworth_ksp_type gmres -ainsworth_ksp_pc_side left",
                                "max_it 100 -ainsworth_ksp_type gmres -ainsworth_ksp_pc_side right",
                                "max_it 100 -ainsworth_ksp_type bcgsl -ainsworth_ksp_pc_side left",
                                "max_it 100 -ainsworth_ksp_type bcgsl -ainsworth_ksp_pc_side right",
                                "max_it 100 -ainsworth_ksp_type fgmres -ainsworth_ksp_pc_side right"};
  const std::string layout   = crossed ? ", crossed, " : ", ";

  PetscFunctionBeginUser;
  for (size_t kind = 0; kind < kinds.size(); kind++) {
    const DenseSystem d = TwoChains((Kind)kind);

    for (size_t k = 0; k < methods.size(); k++)
      for (const std::string pc : {"jacobi", "redundant", "hypre"})
        if (pc == "jacobi" || (!crossed && (pc != "hypre" || PetscDefined(HAVE_HYPRE))))
          PetscCall(Row(kinds[kind] + layout + methods[k] + ", " + pc, d,
                        "-ainsworth_ksp_max_it 100 -ainsworth_pc_type " + pc + " -ainsworth_ksp_type " + methods[k],
                        {Honest((kind == DEFINITE || kind == NEGATIVE) && k < 2 && pc != "hypre")}, crossed));
    for (const std::string &variant : variants)
      PetscCall(Row(kinds[kind] + layout + variant, d, jacobi + "-ainsworth_ksp_" + variant, {Honest(false)}, crossed));
  }
  for (PetscReal scale : {1e-120, 1e-60, 1.0, 1e60, 1e120}) {
    DenseSystem d = TwoChains(DEFINITE);

    d.f *= scale;
    d.g *= scale;
    PetscCall(
      Row("right-hand side times " + std::to_string(std::log10(scale)) + layout, d, jacobi, {Honest(true)}, crossed));
  }
  PetscCall(Row("a soft row without a diagonal" + layout, SoftPair(),
                "-ainsworth_pc_type none -ainsworth_ksp_type gmres -ainsworth_ksp_norm_type unpreconditioned "
                "-ainsworth_ksp_rtol 1e-9",
                {Honest(false)}, crossed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The failure begins with the cause, and says in its first sentence all parts; with errors it is an error */
static PetscErrorCode Cause(const std::string &name, const DenseSystem &d, const std::string &options,
                            const std::string &outer, const Parts &parts)
{
  const Action said = [=](Live &s) -> PetscErrorCode {
    std::string why;

    PetscFunctionBeginUser;
    PetscCall(Failure(s, why));
    PetscCall(CheckText("the first sentence", why.substr(0, why.find(". ")), parts));
    PetscCall(CheckTrue(("the cause comes first: " + why).c_str(), why.compare(0, parts[0].size(), parts[0]) == 0));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  const Action raised = [](Live &s) -> PetscErrorCode {
    PetscErrorCode code;

    PetscFunctionBeginUser;
    PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
    code = s.Solve();
    PetscCall(PetscPopErrorHandler());
    PetscCall(CheckTrue("an error", code != PETSC_SUCCESS));
    PetscFunctionReturn(PETSC_SUCCESS);
  };

  PetscFunctionBeginUser;
  PetscCall(Row("cause: " + name + ", of " + std::to_string(d.A.rows()) + " unknowns, outer " + outer, d,
                options + " -ksp_type " + outer, {outer.find("error") == std::string::npos ? Failed() : raised, said},
                outer == KSPGMRES ? VIEW : 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Causes(DenseSystem (*make)(Kind), const std::string &outer)
{
  const DenseSystem good = make(DEFINITE);
  const std::string n = std::to_string(good.A.rows()), last = std::to_string(good.C.rows());
  DenseSystem       badF = good, badG = good;

  PetscFunctionBeginUser;
  badF.f[3] = badG.g[1] = NAN;
  for (const std::string &pc : {std::string(), jacobi})
    PetscCall(Cause("floating", make(FLOATING), pc, outer, {"A body floats", "MatSetNullSpace()"}));
  PetscCall(Cause("indefinite", make(INDEFINITE_ON_KERNEL), jacobi, outer,
                  {"A is indefinite on Ker C", "-ainsworth_ksp_type gmres"}));
  PetscCall(Cause("too few iterations", good, jacobi + "-ainsworth_ksp_max_it 2", outer,
                  {"The reduced solve ended without convergence", "DIVERGED_ITS", "2 iterations"}));
  PetscCall(Cause("stagnation", good, jacobi + "-ainsworth_ksp_type richardson -ainsworth_ksp_richardson_scale 1e-9",
                  outer, {"The reduced solve stagnates", "after " + n + "0 iterations", "-ainsworth_pc_type"}));
  for (const std::string key : {"ksp_atol", "ksp_rtol"})
    PetscCall(Cause("wrong prefix", good, jacobi + "-ainsworth_ksp_max_it 3 -" + key + " 1e-3", outer,
                    {"The reduced solve ended without convergence",
                     "-" + key + " is that of the outer solver, the reduced solve has -ainsworth_" + key}));
  PetscCall(Cause("not symmetric", make(NOT_SYMMETRIC), jacobi + "-ainsworth_ksp_type cg -ainsworth_ksp_max_it 4",
                  outer, {"A is not symmetric", "-ainsworth_ksp_type gmres"}));
  PetscCall(
    Cause("NaN in f", badF, jacobi, outer, {"The right-hand side holds NaN or Inf in row 3 of the primal field"}));
  PetscCall(
    Cause("NaN in g", badG, jacobi, outer, {"The right-hand side holds NaN or Inf in row 1 of the multiplier field"}));
  PetscCall(Cause("zero row", WithRow(good, Dense::Zero(1, good.A.rows()), 1.0), jacobi, outer,
                  {"The right-hand side of the constraints is nonzero on a row of C that is zero (rows " + last}));
  PetscCall(Cause("contradictory rows", WithRow(good, good.C.row(0) + good.C.row(1), 7.0), jacobi, outer,
                  {"The right-hand side of the constraints is not that of the other rows of C", "(rows "}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Truth()
{
  const DenseSystem d = TwoChains(DEFINITE);

  PetscFunctionBeginUser;
  for (int crossed : {0, (int)CROSSED}) PetscCall(Methods(crossed));
  for (auto make : {TwoChains, Cell}) {
    for (const std::string outer : {"preonly", "preonly -ksp_error_if_not_converged", "gmres"})
      PetscCall(Causes(make, outer));
    for (const std::string &pc : {std::string(), jacobi})
      PetscCall(Row("-A " + pc, make(NEGATIVE), pc, {Honest(true)}));
  }
  /* an outer method opens a reduction around its preconditioner, an inner one its own: what cannot be nested is said */
  for (const std::string outer : {"pgmres", "pipegcr", "pipefcg", "fgmres"})
    for (const std::string inner : {"projectedcg", "pipecg", "cg"})
      if (!PetscDefined(USE_COMPLEX) || outer.compare(0, 4, "pipe")) /* PETSc has them for real numbers */
        PetscCall(
          Row("outer " + outer + ", inner " + inner, d,
              "-ksp_rtol 1e-7 -ksp_max_it 40 -ksp_type " + outer +
                " -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-3 -ainsworth_ksp_type " + inner,
              {Either(EqualX(1e-4),
                      inner == "pipecg" ? Fails({"are both pipelined", "-ainsworth_ksp_type projectedcg"}) : nullptr)},
              EXPLICIT));
  /* another right-hand side after one that has no solution: methods look at the state of their preconditioner first */
  for (const std::string outer : {"preonly", "fgmres", "gmres", "bcgs"})
    PetscCall(Row("after a contradiction, outer " + outer, WithRow(d, d.C.row(0) + d.C.row(1), 7.0),
                  jacobi + "-ainsworth_ksp_rtol 1e-12 -ksp_type " + outer,
                  {Negative(), [](Live &s) { return CheckInt("failure", s.failure, PC_INCONSISTENT_RHS); },
                   Edit([](Saddle &s) { s.g[5] = s.g[0] + s.g[1]; }), Positive(),
                   [=](Live &s) {
                     s.d = d;
                     return EqualX(1e-4)(s);
                   }},
                  EXPLICIT));
  PetscFunctionReturn(PETSC_SUCCESS);
}
