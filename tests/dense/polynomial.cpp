static char help[] = "A right inverse without a factorization of the Gram matrix: its polynomial, projectors and "
                     "solutions, against dense linear algebra.\n\n";

#include "run.h"
#include <projection/matainsworth.h>
#include <algorithm>
#include <cmath>

/*
   Why |Q v|_D^2 <= (1 + theta) |v|_D^2 (docs/scaling.md): R - W C' S^{-1} = (R_p - W C' S^{-1})(I - S P), R_p = W_p C'
   S_p^{-1}. R_p y and W C' S^{-1} y have the squared norms y' S_p^{-1} y and y' S^{-1} y, and the latter is the least
   of all x with C x = y: their difference has y' (S_p^{-1} - S^{-1}) y. In an eigenvector of S_p^{-1} S that is (s - 1)
   times y' S^{-1} y, and the polynomial multiplies it by q(s)^2. Q v is the full projection minus (R - W C' S^{-1}) C
   v, orthogonal to it, and (C v)' S^{-1} C v <= |v|_D^2.
*/
/*
   A surface of m / bs slaves on a line: the rows of a node tie its bs unknowns, turned, to those of three masters,
   which neighbors share. The slaves' stiffness is `ratio`, that of masters and of the unknowns behind both is 1.
*/
static DenseSystem Surface(PetscInt nodes, PetscInt bs, PetscReal ratio)
{
  const PetscInt masters = nodes / 2 + 2, n = (2 * nodes + 2 * masters) * bs, m = nodes * bs, first = nodes * bs;
  DenseSystem    d;

  d.A               = Dense::Zero(n, n);
  d.C               = Dense::Zero(m, n);
  const auto spring = [&](PetscInt i, PetscInt j, PetscReal k) {
    d.A(i, i) += k;
    if (j < 0) return;
    d.A(j, j) += k;
    d.A(i, j) -= k;
    d.A(j, i) -= k;
  };
  const PetscInt slaves = nodes * bs, behind = first + masters * bs, below = behind + nodes * bs;
  for (PetscInt i = 0; i < slaves; i++) {
    spring(i, behind + i, ratio * (1.5 + Uniform(3, i, 0)));
    if (i + bs < slaves) spring(i, i + bs, ratio);
    spring(behind + i, -1, ratio);
  }
  for (PetscInt i = 0; i < masters * bs; i++) {
    spring(first + i, below + i, 1.5 + Uniform(4, i, 0));
    spring(below + i, -1, 1.0);
  }
  /* clang-format off */
  const Dense turned = Eigen::HouseholderQR<Dense>(Dense::NullaryExpr(bs, bs, [](Eigen::Index i, Eigen::Index j) {
                         return (PetscScalar)Uniform(5, (PetscInt)i, (PetscInt)j);
                       })).householderQ();
  /* clang-format on */
  for (PetscInt node = 0; node < nodes; node++) {
    d.C.block(node * bs, node * bs, bs, bs) = turned;
    const PetscReal parts[]                 = {0.5, 0.3, 0.2};
    for (PetscInt k = 0; k < 3; k++) d.C.block(node * bs, first + (node / 2 + k) * bs, bs, bs) -= parts[k] * turned;
  }
  d.f = Column::NullaryExpr(n, [](Eigen::Index i) { return (PetscScalar)Uniform(6, (PetscInt)i, 0); });
  d.g = Column::NullaryExpr(m, [](Eigen::Index i) { return (PetscScalar)Uniform(7, (PetscInt)i, 0); });
  d.w = Column::Ones(n);
  return d;
}

/* The residual q of the polynomial by its recurrence at s: z += d, q = 1 - s z */
static double Residual(const std::vector<AinsworthPolynomialStep> &steps, double s)
{
  double z = 0.0, d = 0.0;

  for (const auto &step : steps) {
    d = step.momentum * d + step.factor * (1.0 - s * z);
    z += d;
  }
  return 1.0 - s * z;
}

/* (s - 1) q(s)^2 reaches the excess as often as its degree allows, and is not above */
static PetscErrorCode CheckPolynomial(double bound, int steps)
{
  const auto   list     = AinsworthPolynomialCreateSteps(bound, steps);
  const double excess   = AinsworthPolynomialExcess(bound, steps);
  const double rounding = 1e-30;
  double       most     = 0.0;
  int          signs = 0, last = 0;

  PetscFunctionBeginUser;
  Case("bound %g, %d steps", bound, steps);
  for (int k = 0; k <= 20000; k++) {
    const double s = 1.0 + (bound - 1.0) * k / 20000, e = std::sqrt(s - 1.0) * Residual(list, s);

    most = std::max(most, e * e);
    if (e * e < 0.99 * excess || (e > 0.0 ? 1 : -1) == last) continue;
    last = e > 0.0 ? 1 : -1;
    signs++;
  }
  PetscCall(CheckInt("steps", (PetscInt)list.size(), steps));
  PetscCall(Check("q(0) - 1", std::abs(Residual(list, 0.0) - 1.0), 1e-15));
  PetscCall(Check("(s - 1) q^2", most, excess * (1.0 + 1e-9) + rounding));
  if (excess > 1e3 * rounding) PetscCall(CheckInt("alternations", signs, steps + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckDegree()
{
  PetscFunctionBeginUser;
  Case("degree");
  PetscCall(CheckInt("no shared unknowns", AinsworthPolynomialDegree(1.0, 0.1), 0));
  for (double bound : {1.05, 1.5, 2.0, 17.0, 2500.0}) {
    const int steps = AinsworthPolynomialDegree(bound, 0.1);

    PetscCall(Check("excess", AinsworthPolynomialExcess(bound, steps), 0.1));
    if (steps) PetscCall(Check("steps are needed", 0.1, AinsworthPolynomialExcess(bound, steps - 1)));
  }
  PetscCall(CheckInt("too stiff", AinsworthPolynomialDegree(1e9, 0.1), AinsworthPolynomialMostSteps + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Surfaces of a size: few steps are quicker than a factor, many are not, and more ranks are for them */
static PetscErrorCode CheckPrices()
{
  const AinsworthGramFacts one  = {20000.0, 180000.0, 20000.0, 1.0, 1.0, {}},
                           many = {20000.0, 180000.0, 400.0, 64.0, 1.0, {}};

  PetscFunctionBeginUser;
  Case("prices");
  PetscCall(CheckTrue("few steps", AinsworthPolynomialSeconds(one, 2) < AinsworthFactoredSeconds(one)));
  PetscCall(CheckTrue("many steps", AinsworthPolynomialSeconds(one, 50) > AinsworthFactoredSeconds(one)));
  PetscCall(CheckTrue("many ranks", AinsworthPolynomialSeconds(many, 50) < AinsworthFactoredSeconds(many)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The operator of the solver by its columns */
static PetscErrorCode Operator(Mat S, PetscErrorCode (*apply)(Mat, Vec, Vec), Vec in, Vec out, Dense &dense)
{
  PetscFunctionBeginUser;
  PetscCall(GatherOperator(
    in, out, [=](Vec v, Vec w) { return (*apply)(S, v, w); }, dense));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   C R = I, Q is a projector onto Ker C that makes no vector much longer in the norm of W^{-1}, Q' and R' are their
   adjoints
*/
static PetscErrorCode CheckProjectors(const Run &run, const DenseSystem &d)
{
  PC           pc;
  KSP          inner;
  Vec          work;
  Mat          S;
  Dense        Q, Qt, R, Rt;
  const Column W = DiagonalWeight(d.A), root = W.cwiseSqrt();
  const auto   m = d.C.rows(), n = d.C.cols();

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetOperators(inner, &S, NULL));
  PetscCall(VecDuplicate(run.sys.f, &work));
  PetscCall(Operator(S, MatAinsworthMultProjector, run.sys.f, work, Q));
  PetscCall(Operator(S, MatAinsworthMultTransposeProjector, run.sys.f, work, Qt));
  PetscCall(Operator(S, MatAinsworthMultRightInverse, run.sys.g, run.sys.f, R));
  PetscCall(Operator(S, MatAinsworthMultTransposeRightInverse, run.sys.f, run.sys.g, Rt));
  PetscCall(VecDestroy(&work));
  PetscCall(CheckEqual("C R", d.C * R, Dense::Identity(m, m), 1e-12));
  PetscCall(CheckEqual("Q", Q, Dense::Identity(n, n) - R * d.C, 1e-12));
  PetscCall(CheckEqual("Q'", Qt, Q.adjoint(), 1e-12));
  PetscCall(CheckEqual("R'", Rt, R.adjoint(), 1e-12));
  const Dense     scaled = root.cwiseInverse().asDiagonal() * Q * root.asDiagonal();
  const PetscReal norm   = Eigen::JacobiSVD<Dense>(scaled).singularValues()(0);
  PetscCall(Check("squared norm of Q", norm * norm, 1.0 + AinsworthPolynomialMostExcess));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* words: of the view, about the Gram matrix */
static PetscErrorCode CheckSurface(PetscInt bs, PetscReal ratio, const char *options,
                                   const std::vector<std::string> &words)
{
  const DenseSystem d = Surface(40, bs, ratio);
  Options           set(std::string("-ainsworth_ksp_rtol 1e-12 ") + options);
  Run               run;
  std::string       view;

  PetscFunctionBeginUser;
  Case("blocks of %d, ratio %g%s", (int)bs, (double)ratio, options);
  PetscCall(RunCreate(d, false, &run));
  PetscCall(RunSolve(&run));
  PetscCall(CheckSolved(&run, d));
  PetscCall(CheckResiduals(run, d, 1e-9, 1e-13));
  PetscCall(ViewText(run.ksp, view));
  PetscCall(CheckText("view", view, words));
  PetscCall(CheckProjectors(run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same C with other stiffnesses: a polynomial until it would have too many steps, then a factor for good */
static PetscErrorCode CheckSequence()
{
  const DenseSystem soft = Surface(40, 1, 0.1), stiff = Surface(40, 1, 1e9);
  DenseSystem       d = soft;
  Options           set("-ainsworth_ksp_rtol 1e-12 -ainsworth_pc_type jacobi -pc_ainsworth_gram polynomial");
  Run               run;

  PetscFunctionBeginUser;
  PetscCall(RunCreate(d, false, &run));
  for (int step = 0; step < 5; step++) {
    const bool  factored = step >= 2;
    std::string view;

    Case("step %d of a sequence", step);
    d.A = step == 2 ? stiff.A : soft.A;
    PetscCall(WriteDense(d.A, run.sys.A));
    PetscCall(RunSolve(&run));
    PetscCall(CheckSolved(&run, d));
    PetscCall(ViewText(run.ksp, view));
    PetscCall(CheckText("view", view,
                        {factored ? "S = C W C': 1 connected component, the largest of 40 rows" : "a polynomial of "}));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const char *const jacobi = " -ainsworth_pc_type jacobi";
  int               exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (double bound : {1.01, 1.3, 4.0, 100.0})
    for (int steps : {0, 1, 2, 5, 12}) PetscCall(CheckPolynomial(bound, steps));
  PetscCall(CheckDegree());
  PetscCall(CheckPrices());
  for (PetscInt bs : {1, 3})
    for (PetscReal ratio : {1e-2, 1.0, 1e3}) {
      PetscCall(CheckSurface(bs, ratio, (std::string(" -pc_ainsworth_gram polynomial") + jacobi).c_str(),
                             {"no factorization, a polynomial of ", ": 40 connected components"}));
      PetscCall(
        CheckSurface(bs, ratio, (std::string(" -pc_ainsworth_gram factor") + jacobi).c_str(), {"connected component"}));
    }
  PetscCall(CheckSurface(2, 0.1,
                         " -pc_ainsworth_gram polynomial -ainsworth_pc_type blocksa -pc_ainsworth_ladder multigrid",
                         {"no factorization, a polynomial of 1 step"}));
  PetscCall(CheckSequence());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
