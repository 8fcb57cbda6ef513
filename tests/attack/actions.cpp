/* What a program may do between two solves */
#include "attack.h"

/* KSPReset() leaves freed vectors behind in a KSPDGMRES of PETSc 3.18: a program has to set the type anew */
static PetscErrorCode ResetSolver(Attack &a)
{
  PetscBool fragile;
  KSPType   type;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)a.ksp, KSPDGMRES, &fragile));
  PetscCall(KSPGetType(a.ksp, &type));
  const std::string name = type;

  if (fragile) PetscCall(KSPSetType(a.ksp, KSPPREONLY));
  PetscCall(KSPReset(a.ksp));
  if (fragile) PetscCall(KSPSetType(a.ksp, name.c_str()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* New matrices for the present system; another size goes through KSPReset() */
static PetscErrorCode Rebuild(Attack &a, bool sameTotal)
{
  PetscFunctionBeginUser;
  if (!sameTotal) PetscCall(ResetSolver(a));
  PetscCall(AttackBuild(a, sameTotal));
  PetscCall(AttackOperators(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A right-hand side with a solution, unless chance adds something else */
static void RightHandSide(Attack &a)
{
  const Eigen::Index n = a.s.A.rows(), m = a.s.C.rows();
  Column             x(n), lambda(m);

  for (Eigen::Index i = 0; i < n; i++) x[i] = a.r.Real(-1.0, 1.0);
  for (Eigen::Index i = 0; i < m; i++)
    lambda[i] = a.s.C.row(i).norm() > 0.0 ? a.s.A.cwiseAbs().maxCoeff() * a.r.Real(-1.0, 1.0) / a.s.C.row(i).norm()
                                          : 0.0;
  a.s.f = a.s.A * x + a.s.Ct * lambda;
  a.s.g = a.s.C * x + a.s.D * lambda;
}

/* Where values changed the solution does, and contradictions would only hide errors */
static void Changed(Attack &a)
{
  a.s.Ct        = a.s.C.adjoint();
  a.otherB      = false;
  a.s.symmetric = a.s.A == a.s.A.adjoint(); /* exact: squares of 1e-200 are zero */
  if (a.r.Chance(0.9)) RightHandSide(a);
}

/* Writes into the matrices that the program holds, or makes new ones; the nest is told or not */
static PetscErrorCode Store(Attack &a, bool stiffness, bool rows)
{
  PetscFunctionBeginUser;
  rows = rows || a.otherB;
  Changed(a);
  if (a.storage == STORE_SBAIJ && !a.s.symmetric) a.storage = STORE_BAIJ;
  else if (a.r.Chance(0.8)) {
    PetscCall(AttackWrite(a, stiffness, rows));
    a.story += " in place";
    if (!a.r.Chance(0.3) || a.whole) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(MatAssemblyBegin(a.nest, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(a.nest, MAT_FINAL_ASSEMBLY));
    a.story += ", nest told";
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  a.story += " in new matrices";
  PetscCall(Rebuild(a, true));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Values(Attack &a)
{
  const int what = a.r.Int(1, 3);

  PetscFunctionBeginUser;
  a.story += std::string("; other values of ") + (what == 1 ? "A" : what == 2 ? "C" : "A and C");
  if (what & 1) {
    Column d(a.s.A.rows());
    for (Eigen::Index i = 0; i < d.size(); i++) d[i] = a.r.Real(0.5, 2.0);
    a.s.A = Dense(d.asDiagonal() * a.s.A * d.asDiagonal());
    if (a.s.symmetric) a.s.A = Dense((a.s.A + Dense(a.s.A.adjoint())) / 2.0); /* rounding is none of the matter */
  }
  if (what & 2) {
    for (Eigen::Index j = 0; j < a.s.C.cols(); j++) a.s.C.col(j) *= a.r.Real(0.5, 2.0);
  }
  PetscCall(Store(a, what & 1, what & 2));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Pattern(Attack &a)
{
  const int m = (int)a.s.C.rows(), n = (int)a.s.A.rows();

  PetscFunctionBeginUser;
  if (!m) PetscFunctionReturn(PETSC_SUCCESS);
  const int i = a.r.Int(0, m - 1), j = a.r.Int(0, n - 1);

  a.story += "; another pattern of row " + std::to_string(i) + " of C";
  if (a.s.C(i, j) == 0.0 && !a.s.C.row(i).isZero(0.0))
    a.s.C(i, j) = a.s.C.row(i).cwiseAbs().maxCoeff() * a.r.Real(0.5, 1.0);
  else if (a.s.C.row(i).cwiseAbs().sum() > PetscAbsScalar(a.s.C(i, j))) a.s.C(i, j) = 0.0;
  PetscCall(Store(a, false, true));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode OneRow(Attack &a)
{
  const int m = (int)a.s.C.rows();

  PetscFunctionBeginUser;
  if (!m) PetscFunctionReturn(PETSC_SUCCESS);
  const int i = a.r.Int(0, m - 1), other = a.r.Int(0, m - 1);

  switch (a.r.Int(0, 3)) {
  case 0:
    a.s.C.row(i).setZero();
    a.story += "; zero row " + std::to_string(i);
    break;
  case 1:
    if (a.s.D(i, i) == 0.0) a.s.C.row(i) = a.s.C.row(other) * a.r.Real(0.5, 2.0);
    a.story += "; row " + std::to_string(i) + " like row " + std::to_string(other);
    break;
  case 2:
    a.s.C.row(i) *= PetscPowReal(10.0, a.r.Real(-6.0, 6.0));
    a.s.uneven = true;
    a.story += "; scaled row " + std::to_string(i);
    break;
  default:
    if (a.s.D(i, i) != 0.0) break;
    a.s.C.row(i).setZero();
    a.s.C(i, a.r.Int(0, (int)a.s.A.rows() - 1)) = 1.0;
    a.story += "; unit row " + std::to_string(i);
  }
  PetscCall(Store(a, false, true));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same blocks in another nest: other index sets, other positions */
static PetscErrorCode Renumber(Attack &a)
{
  static const char *const names[] = {"after", "before", "between"};

  PetscFunctionBeginUser;
  a.order = (Order)a.r.Int(0, ORDERS - 1);
  if (a.r.Chance(0.3) && !(!a.s.D.isZero(0.0) && a.s.C.rows() >= a.s.A.rows())) a.s.first = !a.s.first;
  a.story += std::string("; the same blocks, multipliers ") + names[a.order] + (a.s.first ? ", first block" : "");
  PetscCall(AttackNest(a));
  PetscCall(AttackOperators(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Restore(Attack &a)
{
  static const char *const names[] = {"aij", "baij", "sbaij", "dense", "shell", "nest"};

  PetscFunctionBeginUser;
  a.storage = (Storage)a.r.Int(0, STORAGES - 1);
  a.split   = a.r.Chance(0.3);
  PetscCall(Rebuild(a, true));
  a.story += std::string("; A as ") + names[a.storage] + (a.split ? ", C in two blocks of rows" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Another system, perhaps of another split of the same total size, which needs no KSPReset() */
static PetscErrorCode Replace(Attack &a)
{
  const bool same = a.r.Chance(0.6);

  PetscFunctionBeginUser;
  for (int k = 0; k < 200; k++) {
    RandomSystem       s(a.r, false);
    const Eigen::Index total = a.s.A.rows() + a.s.C.rows();

    if (same && (s.bs > 1 || s.A.rows() + s.C.rows() != total)) continue;
    s.form   = a.s.form;
    s.nested = a.s.nested;
    a.s      = s;
    a.story += (same ? "; another system of the same size: " : "; KSPReset() and another system: ") + s.text;
    PetscCall(Rebuild(a, same));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inactive contact: many rows that are zero, more than there are unknowns */
static PetscErrorCode Inactive(Attack &a)
{
  const Eigen::Index n = a.s.A.rows(), m = a.s.C.rows(), more = n + a.r.Int(0, 4);
  Dense              C = Dense::Zero(m + more, n), D = Dense::Zero(m + more, m + more);

  PetscFunctionBeginUser;
  if (m > n) PetscFunctionReturn(PETSC_SUCCESS);
  C.topRows(m)          = a.s.C;
  D.topLeftCorner(m, m) = a.s.D;
  a.s.C                 = C;
  a.s.D                 = D;
  a.s.first             = false;
  a.s.g.conservativeResize(m + more);
  a.s.g.tail(more).setZero();
  Changed(a);
  a.story += "; KSPReset() and " + std::to_string(more) + " zero rows more";
  PetscCall(Rebuild(a, false));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Reset(Attack &a)
{
  PetscFunctionBeginUser;
  PetscCall(ResetSolver(a));
  PetscCall(AttackOperators(a));
  a.story += "; KSPReset()";
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode OtherRightHandSide(Attack &a)
{
  const int what = a.r.Int(0, 5);

  PetscFunctionBeginUser;
  RightHandSide(a);
  a.story += "; another right-hand side";
  if (what == 0) {
    const int decades = a.r.Chance(0.5) ? 60 : a.r.Int(20, 60), sign = a.r.Chance(0.5) ? 1 : -1;
    a.s.f *= PetscPowReal(10.0, sign * decades);
    a.s.g *= PetscPowReal(10.0, sign * decades);
    a.story += " times 1e" + std::to_string(sign * decades);
  } else if (what == 1) {
    a.s.f.setZero();
    if (a.s.D.isZero(0.0)) a.story += ", f = 0";
  } else if (what == 2) {
    for (Eigen::Index i = 0; i < a.s.g.size(); i++) a.s.g[i] = 0.0;
    a.story += ", g = 0";
  } else if (what == 3) {
    for (Eigen::Index i = 0; i < a.s.g.size(); i++) a.s.g[i] = a.r.Real(-1.0, 1.0);
    a.story += ", any g";
  } else if (what == 4 && a.s.g.size()) {
    a.s.f.setZero();
    a.s.g.setZero();
    a.story += ", zero";
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A, f and lambda in other units */
static PetscErrorCode Scale(Attack &a)
{
  const int       decades[] = {-200, -100, -30, 30, 60};
  const int       k         = decades[a.r.Int(0, 4)];
  const PetscReal size      = a.s.A.cwiseAbs().maxCoeff();

  PetscFunctionBeginUser;
  if (size < 1e-20 || size > 1e20) { /* back again */
    a.s.A /= size;
    a.s.D *= size;
    a.story += "; A scaled back";
  } else {
    a.s.A *= PetscPowReal(10.0, k);
    a.s.D *= PetscPowReal(10.0, -k);
    a.story += "; A times 1e" + std::to_string(k);
  }
  RightHandSide(a);
  a.s.symmetric = a.s.A == a.s.A.adjoint(); /* exact: squares of 1e-200 are zero */
  if (!a.s.D.isZero(0.0)) PetscCall(Rebuild(a, true));
  else PetscCall(AttackWrite(a, true, false));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Another compliance of the multipliers, a diagonal or one that couples some of them; the block may not have been there
*/
static PetscErrorCode Compliance(Attack &a)
{
  const int m = (int)a.s.C.rows(), kind = a.r.Int(0, 3);

  PetscFunctionBeginUser;
  if (!m) PetscFunctionReturn(PETSC_SUCCESS);
  const bool      there = a.s.blockD, first = a.s.first;
  Dense           D       = Dense::Zero(m, m);
  const PetscReal largest = a.s.A.cwiseAbs().maxCoeff(), stiffest = largest > 0.0 ? largest : 1.0; /* 1e-200, too */

  for (int i = 0; i < m && kind; i++) {
    const PetscReal s = a.s.C.row(i).squaredNorm() / stiffest;

    if (a.r.Chance(0.5)) D(i, i) = s == 0.0 ? a.r.Real(-2.0, -0.5) : -s * PetscPowReal(10.0, a.r.Real(-6.0, 6.0));
  }
  for (int i = 1; i < m && kind == 2; i++) { /* -L L' */
    const PetscScalar off = 0.5 * PetscSqrtReal(PetscAbsScalar(D(i, i))) *
                            PetscSqrtReal(PetscAbsScalar(D(i - 1, i - 1)));

    D(i, i - 1) = D(i - 1, i) = off;
  }
  if (kind == 3 && a.r.Chance(0.3)) {
    D(0, 0)       = 1.0; /* of the other sign */
    a.s.difficult = true;
  }
  a.s.D      = D;
  a.s.blockD = there || !D.isZero(0.0);
  if (a.s.blockD && m >= (int)a.s.A.rows()) a.s.first = false;
  a.story += std::string("; ") + (kind ? kind == 2 ? "a D that couples" : "a diagonal D" : "D zero");
  RightHandSide(a);
  if (there && a.s.first == first && a.r.Chance(0.7)) {
    PetscCall(AttackWrite(a, false, true));
    a.story += ", in place";
  } else PetscCall(Rebuild(a, true));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One AIJ for all, its fields named or not; or the nest again */
static PetscErrorCode Reshape(Attack &a)
{
  static const char *const names[] = {"a nest", "one AIJ with named fields", "one AIJ"};

  PetscFunctionBeginUser;
  const Shape shape = (Shape)a.r.Int(0, SHAPES - 1);

  /* vectors are nests; no block for B */
  if (a.s.nested || (a.otherB && a.s.form != 0 && shape == SHAPE_NEST)) PetscFunctionReturn(PETSC_SUCCESS);
  a.shape = shape;
  a.story += std::string("; the whole as ") + names[a.shape];
  PetscCall(AttackNest(a));
  PetscCall(AttackOperators(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode OtherB(Attack &a)
{
  PetscFunctionBeginUser;
  PetscCall(AttackBrokenAdjoint(a, true));
  a.otherB = !(a.s.Ct == a.s.C.adjoint());
  RightHandSide(a);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BrokenAdjoint(Attack &a)
{
  PetscFunctionBeginUser;
  PetscCall(AttackBrokenAdjoint(a, false));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Indefinite(Attack &a)
{
  const int i = a.r.Int(0, (int)a.s.A.rows() - 1);

  PetscFunctionBeginUser;
  if (a.r.Chance(0.5)) {
    a.s.A(i, i) = -a.s.A(i, i);
    a.story += "; A indefinite";
  } else { /* the body floats: constants are in the null space */
    for (Eigen::Index k = 0; k < a.s.A.rows(); k++) a.s.A(k, k) -= a.s.A.row(k).sum();
    a.story += "; the body floats";
  }
  if (a.s.A.cwiseAbs().maxCoeff() == 0.0) a.s.A(0, 0) = 1.0;
  a.s.difficult = true;
  PetscCall(Store(a, true, false));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackMatrix(Attack &a)
{
  PetscErrorCode (*const actions[])(Attack &) = {Values,   Pattern, OneRow,     Renumber,   Restore, Replace,
                                                 Inactive, Scale,   Indefinite, Compliance, Reshape, OtherB};

  PetscFunctionBeginUser;
  PetscCall(actions[a.r.Int(0, 11)](a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackAct(Attack &a)
{
  static const struct {
    PetscErrorCode (*act)(Attack &);
    int weight;
  } actions[] = {
    {Values,                    14},
    {Pattern,                   6 },
    {OneRow,                    8 },
    {Renumber,                  6 },
    {Restore,                   6 },
    {Replace,                   8 },
    {Inactive,                  3 },
    {Reset,                     4 },
    {OtherRightHandSide,        10},
    {Scale,                     4 },
    {Indefinite,                4 },
    {AttackChangeOptions,       16},
    {AttackSetters,             5 },
    {AttackNullSpace,           4 },
    {AttackTranspose,           5 },
    {AttackReuse,               8 },
    {AttackNested,              4 },
    {AttackSame,                3 },
    {AttackPoison,              8 },
    {AttackWrongMatrix,         4 },
    {AttackWrongOption,         3 },
    {BrokenAdjoint,             3 },
    {OtherB,                    4 },
    {Compliance,                8 },
    {Reshape,                   8 },
    {AttackErrorInside,         3 },
    {AttackErrorIfNotConverged, 3 }
  };
  int total = 0, drawn;

  PetscFunctionBeginUser;
  for (const auto &action : actions) total += action.weight;
  drawn = a.r.Int(0, total - 1);
  for (const auto &action : actions) {
    drawn -= action.weight;
    if (drawn >= 0) continue;
    PetscCall(action.act(a));
    break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
