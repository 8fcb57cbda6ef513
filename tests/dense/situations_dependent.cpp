/* Rows of C that are linear combinations of others: left out, checked against g, or refused */
#include "situations.h"

/* 0: rows 2 and 7 repeat rows 0 and 5, scaled; 1: row 8 = row 1 + row 3 - row 6; 2: a ring; 3: row 7 is near row 5 */
static Action Combined(int kind, bool consistent = true)
{
  const Action edit = Edit([=](Saddle &s) {
    Dense &C = s.C;

    if (kind == 0) C.row(2) = 1e3 * C.row(0), C.row(7) = -C.row(5);
    if (kind == 1) C.row(8) = C.row(1) + C.row(3) - C.row(6);
    for (int i = 0; i < 9 && kind == 2; i++) {
      C.row(i).setZero();
      C(i, i)           = 1.0;
      C(i, (i + 1) % 9) = -1.0;
    }
    if (kind == 3) C.row(7) = C.row(5), C(7, 3) += 1.5e-7 * C.row(5).norm();
    if (consistent) s.g = C * Column::NullaryExpr(24, [](Eigen::Index i) { return Uniform(5, (PetscInt)i, 0); });
  });

  return Both(edit, WithoutZeros);
}

static std::string LeftOut(PetscInt count)
{
  return Text("constraints: %d, %d dependent rows left out", (int)(9 - count), (int)count);
}

/* x and C' lambda are those of the dense system, in which lambda is not unique; the rows left out have lambda = 0 */
static Action Consistent(PetscInt leftOut)
{
  return [=](Live &s) -> PetscErrorCode {
    Dense  K(33, 33);
    Column b(33), y;

    PetscFunctionBeginUser;
    K << s.d.A, s.d.C.adjoint(), s.d.C, s.d.D.size() ? s.d.D : Dense::Zero(9, 9);
    b << s.d.f, s.d.g;
    Eigen::JacobiSVD<Dense> svd(K, Eigen::ComputeFullU | Eigen::ComputeFullV);
    svd.setThreshold(1e-8);
    y = svd.solve(b);
    PetscCall(CheckEqual("x", s.x, y.head(24), 1e-8));
    PetscCall(CheckEqual("C' lambda", s.d.C.adjoint() * s.lambda, s.d.C.adjoint() * y.tail(9), 1e-7));
    PetscInt zeros = 0; /* but for a spring whose row the others meet: its force is none up to rounding */
    for (Eigen::Index i = 0; i < s.lambda.size(); i++)
      zeros += s.lambda(i) == 0.0 && !(s.d.D.size() && std::abs(s.d.D(i, i)) > 1e-6);
    PetscCall(CheckInt("rows left out", zeros, leftOut));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/* x is right, by a factorization of the whole system if it may be, or it fails */
static Action Near(bool whole)
{
#if defined(PETSC_USE_COMPLEX)
  using Number = std::complex<long double>;
#else
  using Number = long double;
#endif
  return [=](Live &s) -> PetscErrorCode {
    Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic> K(33, 33);
    Eigen::Matrix<Number, Eigen::Dynamic, 1>              b(33), y;
    PetscMPIInt                                           size;

    PetscFunctionBeginUser;
    PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
    K << s.d.A.cast<Number>(), s.d.C.adjoint().cast<Number>(), s.d.C.cast<Number>(), Dense::Zero(9, 9).cast<Number>();
    b << s.d.f.cast<Number>(), s.d.g.cast<Number>();
    const auto lu = K.partialPivLu();
    y             = lu.solve(b);
    for (int step = 0; step < 4; step++) y += lu.solve(b - K * y);
    PetscCall(s.Solve());
    /*
       the condition number is 2e14: factors spread over ranks, and those of MUMPS 5.9, may be too inaccurate; rounding
       of g moves x by 7e6
    */
    if (whole && size == 1 && !PetscDefined(USE_COMPLEX) && PETSC_VERSION_LT(3, 25, 0))
      PetscCall(CheckInt("reason", s.reason, KSP_CONVERGED_ITS));
    /* on some numbers of ranks the reduced solve ends with the right x */
    if (!whole && size == 1) PetscCall(CheckInt("reason", s.reason, KSP_DIVERGED_PC_FAILED));
    if (whole && size == 1) PetscCall(Viewed({"the whole system is factored"})(s));
    /* a backward error of 1e-12, as asked, moves each unknown by at most so much */
    const auto moved = (1e-12 * lu.inverse().cwiseAbs() * (K.cwiseAbs() * y.cwiseAbs() + b.cwiseAbs())).eval();
    if (s.reason > 0)
      PetscCall(CheckEqual("x", s.x, y.head(24).cast<PetscScalar>(),
                           (PetscReal)(moved.head(24).norm() / y.head(24).cwiseAbs().matrix().norm())));
    else PetscCall(Viewed({"last failure"})(s));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

static PetscErrorCode Rows(bool uneven, const std::string &package)
{
  const std::string options = "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 " + package,
                    layout  = Text(", uneven %d ", uneven) + package;
  const Action contradicted = Failed({}, PC_INCONSISTENT_RHS);
  const Action other        = Edit([](Saddle &s) { s.g = RandomColumn(9, 11); });
  Spec         spec;

  PetscFunctionBeginUser;
  spec.m      = 9;
  spec.uneven = uneven;
  for (int kind = 0; kind < 3; kind++) {
    const PetscInt leftOut = kind ? 1 : 2;

    PetscCall(Row(Text("consistent, kind %d", kind) + layout, spec, options,
                  {Positive(), Consistent(leftOut), Viewed({LeftOut(leftOut)})}, 0, Combined(kind)));
    /* a right-hand side that contradicts the rows, a consistent one, and again */
    PetscCall(Row(Text("contradicted, kind %d", kind) + layout, spec, options,
                  {contradicted, Edit([](Saddle &s) { s.g.setZero(); }), Positive(),
                   [](Live &s) { return CheckInt("failure of the PC", s.failure, PC_NOERROR); }, other, contradicted},
                  0, Combined(kind, false)));
    PetscCall(Row(Text("contradicted, kind %d, errors", kind) + layout, spec, options + " -ksp_error_if_not_converged",
                  {Raised(PETSC_ERR_ARG_INCOMP,
                          {"not that of the other rows of C", "of the multiplier field", "no solution exists"})},
                  0, Combined(kind, false)));
  }
  PetscCall(Row("a row near another, whole" + layout, spec, options, {Near(true), Near(true)}, 0, Combined(3)));
  PetscCall(Row("a row near another" + layout, spec, options + " -pc_ainsworth_ladder gmres",
                {Near(false), Near(false)}, 0, Combined(3)));
  /* of two rows that repeat each other one gives way by D: none depends on the other, unless D is too small */
  for (PetscReal compliance : {0.0, 1e-30, 1e-2, 1e4}) {
    const PetscInt leftOut = compliance > 1e-6 ? 1 : 2;
    Saddle         d(spec);

    d.D       = Dense::Zero(9, 9);
    d.D(7, 7) = -compliance;
    PetscCall(Row(Text("compliance %g", (double)compliance) + layout, d, options,
                  {Positive(), Consistent(leftOut), Viewed({LeftOut(leftOut)})}, 0, Combined(0)));
  }
  /* a change of C makes the rows independent, and dependent again */
  PetscCall(Row("mended" + layout, spec, options,
                {Positive(), Consistent(2), Viewed({"2 dependent rows"}), Edit([](Saddle &s) {
                   for (int i : {2, 7})
                     for (int j = 0; j < 24; j++)
                       if (s.C(i, j) != 0.0) {
                         s.C(i, j) *= 2.0;
                         break;
                       }
                 }),
                 Exact(1e-8), NotViewed("2 dependent rows"), Original(), Positive(), Consistent(2),
                 Viewed({"2 dependent rows"})},
                0, Combined(0)));
  PetscCall(Row("refused" + layout, spec, options + " -pc_ainsworth_redundant error",
                {SetUpRaised(PETSC_ERR_MAT_CH_ZRPVT, {"2 rows of C are linear combinations", "of the multiplier field",
                                                      "-pc_ainsworth_redundant drop"})},
                0, Combined(0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Dependent()
{
  /* PETSc's own Cholesky factorization is none of Hermitian matrices, nor is that of MUMPS */
  const std::string type   = PetscDefined(USE_COMPLEX) ? "lu" : "cholesky",
                    solver = " -ainsworth_gram_pc_factor_mat_solver_type ";
  /* the first is what is chosen for so few rows, dense inverses */
  Parts packages = {"", "-ainsworth_gram_pc_type " + type + solver + "petsc"};

  PetscFunctionBeginUser;
  if (PetscDefined(HAVE_SUITESPARSE) && !PetscDefined(USE_COMPLEX))
    packages.push_back("-ainsworth_gram_pc_type cholesky" + solver + "cholmod");
  if (PetscDefined(HAVE_MUMPS)) packages.push_back("-ainsworth_gram_pc_type " + type + solver + "mumps");
  for (const std::string &package : packages)
    for (bool uneven : {false, true}) PetscCall(Rows(uneven, package));
  PetscFunctionReturn(PETSC_SUCCESS);
}
