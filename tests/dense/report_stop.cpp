static char help[] = "Tolerances refer to the energy norm of x, against dense linear algebra, where R g strains "
                     "springs that x leaves alone.\n\n";

#include "run.h"
#include <cmath>

/*
   A stiff chain and a soft one, of n nodes each, all nodes held by soft springs; the ends of the chains are displaced
   by C x = g, that of the stiff one as a whole. The preconditioner is the inverse of the same with springs 1 to 10
   times as stiff: quotients of its norm and the energy norm are 1 to sqrt(10)
*/
struct Springs {
  DenseSystem d;
  Dense       inverse;
  Column      x, lambda;
};

static const PetscInt  nodes  = 40;
static const PetscReal spread = 10.0;

static PetscReal Energy(const Springs &s, const Column &x)
{
  return std::sqrt(std::abs(x.dot(s.d.A * x)));
}

static void Create(PetscReal contrast, PetscReal ground, PetscReal load, PetscReal displacement, Springs *s)
{
  const PetscInt n = 2 * nodes;
  Dense          M = Dense::Zero(n, n);

  s->d.A = Dense::Zero(n, n);
  s->d.C = Dense::Zero(2, n);
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal k       = i < nodes ? contrast : 1.0,
                    more[2] = {spread * (1 + Uniform(7, i, 0)) / 2 + 1, spread * (1 + Uniform(7, i, 1)) / 2 + 1};
    const PetscReal held    = (i < nodes ? ground : 1.0) * (1.5 + Uniform(7, i, 2));

    s->d.A(i, i) += held;
    /* regular, too, without the ground */
    M(i, i) += PetscMin(more[0], spread) * held + (ground > 0.0 || i ? 0.0 : contrast);
    if (i % nodes == 0) continue;
    for (PetscInt a = 0; a < 2; a++) {
      for (PetscInt b = 0; b < 2; b++) {
        s->d.A(i - a, i - b) += a == b ? k : -k;
        M(i - a, i - b) += PetscMin(more[1], spread) * (a == b ? k : -k);
      }
    }
  }
  s->d.C(0, 0)         = 1.0;
  s->d.C(1, nodes)     = 1.0;
  s->d.C(1, 3 * n / 4) = -2.0;
  s->d.f               = Column::Zero(n);
  for (PetscInt i = 0; i < n; i++) s->d.f[i] = load * Uniform(8, i, 0);
  s->d.g = displacement * Column::Ones(2);
  M += 1e3 * contrast * s->d.C.adjoint() * s->d.C; /* Ker C all but alone */
  s->inverse = M.inverse();
  SolveSaddle(s->d, s->x, s->lambda);
}

static PetscErrorCode Precondition(PC pc, Vec r, Vec z)
{
  Springs *s;
  Column   column;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, (void **)&s));
  PetscCall(Gather(r, column));
  PetscCall(Scatter(s->inverse * column, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A test of the user's own, which is left as it is */
static PetscErrorCode OwnTest(KSP ksp, PetscInt step, PetscReal norm, KSPConvergedReason *reason, void *ctx)
{
  PetscFunctionBeginUser;
  PetscCall(KSPConvergedDefault(ksp, step, norm, reason, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

struct Result {
  Column             x;
  KSPConvergedReason reason;
  PetscInt           steps;
  PetscReal          error; /* relative to x */
};

/* own: with OwnTest() */
static PetscErrorCode Solve(Springs *s, const std::string &line, bool own, Result *result)
{
  Options options((line.find("max_it") == std::string::npos ? "-ainsworth_ksp_max_it 2000 " : "") + line);
  void   *test;
  Run     run;
  KSP     inner;
  PC      pc;

  PetscFunctionBeginUser;
  PetscCall(SystemFromDense(s->d, false, &run.sys));
  PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, NULL, false, &run.nest));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &run.ksp));
  PetscCall(KSPSetOperators(run.ksp, run.nest, run.nest));
  PetscCall(KSPSetType(run.ksp, KSPPREONLY));
  PetscCall(KSPGetPC(run.ksp, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetPC(inner, &pc));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetApply(pc, Precondition));
  PetscCall(PCShellSetContext(pc, s));
  PetscCall(KSPSetFromOptions(run.ksp));
  if (own) {
    PetscCall(KSPConvergedDefaultCreate(&test));
    PetscCall(KSPSetConvergenceTest(inner, OwnTest, test, KSPConvergedDefaultDestroy));
  }
  PetscCall(RunSolve(&run));
  PetscCall(KSPGetConvergedReason(inner, &result->reason));
  PetscCall(KSPGetIterationNumber(inner, &result->steps));
  result->x     = run.x;
  result->error = Energy(*s, run.x - s->x) / Energy(*s, s->x);
  if (!own) {
    PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);

    PetscCall(KSPGetConvergenceTest(inner, &converged, NULL, NULL));
    PetscCall(CheckTrue("the KSP has its own test again", converged == KSPConvergedDefault));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The residual that ends the solve, by default: as small as x, not as x - R g; without R g nothing is other than
   PETSc's test has it
*/
static PetscErrorCode Residual(PetscReal contrast, PetscReal load, PetscReal displacement, const std::string &method)
{
  Springs s;
  Result  ours, plain;

  PetscFunctionBeginUser;
  Case("residual, contrast %g, f %g, g %g, %s", (double)contrast, (double)load, (double)displacement, method.c_str());
  Create(contrast, 1.0, load, displacement, &s);
  const DenseProjector proj(s.d.C, DiagonalWeight(s.d.A));
  const PetscReal      larger = Energy(s, s.x - proj.R * s.d.g) / Energy(s, s.x);
  PetscCall(Solve(&s, method, true, &plain));
  PetscCall(Solve(&s, method, false, &ours));
  PetscCall(CheckTrue(KSPConvergedReasons[ours.reason], ours.reason == KSP_CONVERGED_RTOL));
  PetscCall(Check("error relative to x", ours.error, 1.1e-8 * std::sqrt(spread)));
  PetscCall(Check("error of PETSc's test", plain.error, 1.1e-8 * std::sqrt(spread) * PetscMax(larger, 1.0)));
  if (larger <= 1.0) PetscCall(CheckInt("steps as PETSc's test has them", ours.steps, plain.steps));
  else if (larger > 10.0)
    PetscCall(CheckTrue("more steps, not many more", ours.steps > plain.steps && ours.steps < 3 * plain.steps));
  if (contrast > 1e5 && load == 0.0 && displacement != 0.0) PetscCall(CheckTrue("R g is far from x", larger > 100.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A weak preconditioner, that of single springs: the residual is small long before the error is. What was asked for is
   that of x, at the price of more steps
*/
static PetscErrorCode Weak(PetscReal contrast)
{
  Springs s;
  Result  ours, plain;

  PetscFunctionBeginUser;
  Case("a weak preconditioner, contrast %g", (double)contrast);
  Create(contrast, 1.0, 1.0, 0.0, &s);
  s.inverse = Column(s.d.A.diagonal().cwiseInverse()).asDiagonal();
  for (PetscInt i = 0; i < 2 * nodes; i++) /* rough, which makes the first residual large */
    s.d.f[i] = (i % 2 ? 1.0 : -1.0) * std::sqrt(PetscAbsScalar(s.d.A(i, i)));
  SolveSaddle(s.d, s.x, s.lambda);
  PetscCall(Solve(&s, "-ainsworth_ksp_rtol 1e-4", true, &plain));
  PetscCall(Solve(&s, "-ainsworth_ksp_rtol 1e-4", false, &ours));
  PetscCall(CheckTrue("PETSc's test ends with a larger error", plain.error > 1.5e-4));
  PetscCall(Check("error relative to x", ours.error, 1e-4));
  PetscCall(CheckTrue("more steps, not many more", ours.steps > plain.steps && ours.steps < 2 * plain.steps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A method that cannot come down to the tolerance ends by itself, and does not say that it has */
static PetscErrorCode Stagnation()
{
  Springs s;
  Result  result;

  PetscFunctionBeginUser;
  Case("stagnation");
  Create(1e6, 1.0, 0.0, 1.0, &s);
  PetscCall(Solve(&s, "-ainsworth_ksp_type pipecg -ainsworth_ksp_rtol 1e-9", false, &result));
  PetscCall(CheckTrue(KSPConvergedReasons[result.reason], result.reason < 0 || result.error < 1e-8));
  PetscCall(Check("steps", (PetscReal)result.steps, 300.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the user says of tolerances and norms counts */
static PetscErrorCode Settings()
{
  Springs s;
  Result  first, second;

  PetscFunctionBeginUser;
  Create(1e6, 1.0, 0.0, 1.0, &s);
  Case("absolute tolerance");
  PetscCall(Solve(&s, "-ainsworth_ksp_atol 1", false, &first));
  PetscCall(CheckTrue(KSPConvergedReasons[first.reason], first.reason == KSP_CONVERGED_ATOL));
  Case("relative tolerance");
  PetscCall(Solve(&s, "-ainsworth_ksp_rtol 1e-4", false, &first));
  PetscCall(Check("error relative to x", first.error, 1.1e-4 * std::sqrt(spread)));
  PetscCall(Solve(&s, "-ainsworth_ksp_rtol 1e-8", false, &second));
  PetscCall(CheckTrue("fewer steps", first.steps < second.steps));
  Case("another norm");
  PetscCall(Solve(&s, "-ainsworth_ksp_norm_type unpreconditioned -ainsworth_ksp_rtol 1e-4", false, &second));
  PetscCall(CheckTrue("PETSc's test as it is", second.steps < first.steps && second.reason == KSP_CONVERGED_RTOL));
  Case("limit of iterations");
  PetscCall(Solve(&s, "-ainsworth_ksp_max_it 7", false, &first));
  PetscCall(CheckTrue(KSPConvergedReasons[first.reason], first.reason == KSP_DIVERGED_ITS && first.steps == 7));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the energy norm of x is nothing but rounding, or too small for the digits of x, the solve ends all the same */
static PetscErrorCode Rounding(PetscReal contrast, PetscReal ground, const std::string &stop)
{
  Springs s;
  Result  result;

  PetscFunctionBeginUser;
  Case("rounding, contrast %g, ground %g, %s", (double)contrast, (double)ground, stop.c_str());
  Create(contrast, ground, 0.0, 1.0, &s);
  if (ground == 0.0) { /* the chain moves as a whole; the soft one is not there */
    s.d.g[1] = 0.0;
    s.x      = Column::Zero(2 * nodes);
    s.x.head(nodes).setOnes();
  }
  PetscCall(Solve(&s, stop, false, &result));
  PetscCall(CheckTrue(KSPConvergedReasons[result.reason], result.reason > 0));
  PetscCall(Check("steps", (PetscReal)result.steps, 200.0));
  if (ground == 0.0) PetscCall(CheckEqual("x", result.x, s.x, 1e-11));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The error that ends the solve */
static PetscErrorCode Error(PetscReal contrast, PetscReal load, PetscReal displacement, bool paper)
{
  Springs s;
  Result  result;

  PetscFunctionBeginUser;
  Case("error, contrast %g, f %g, g %g%s", (double)contrast, (double)load, (double)displacement,
       paper ? ", paper" : "");
  Create(contrast, 1.0, load, displacement, &s);
  for (const char *rtol : {"0.5", "1e-3", "1e-6"}) {
    PetscCall(Solve(&s,
                    std::string("-pc_ainsworth_stop energy_error -pc_ainsworth_error_rtol ") + rtol +
                      (paper ? " -pc_ainsworth_variant paper" : ""),
                    false, &result));
    PetscCall(CheckTrue(KSPConvergedReasons[result.reason], result.reason == KSP_CONVERGED_RTOL));
    PetscCall(Check("error relative to x", result.error, std::stod(rtol)));
    if (!paper && std::stod(rtol) > 1e-4)
      PetscCall(CheckTrue("no more steps than needed, but for the delay", result.error > 1e-5 * std::stod(rtol)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A mode v that the preconditioner all but misses, and of which x has five times what it may be wrong by: no
   coefficient knows of it when the rest has converged. With the smallest eigenvalue given the solve goes on; without,
   it ends on the plateau unless the coefficients, or rows that are not met, show it
*/
static PetscErrorCode Plateau()
{
  const PetscReal missed = 1e-8, rtol = 1e-6;
  Springs         s;
  Result          given;
  char            line[256];

  PetscFunctionBeginUser;
  Case("plateau");
  Create(1.0, 1.0, 1.0, 0.0, &s);
  const DenseProjector proj(s.d.C, DiagonalWeight(s.d.A));
  const PetscInt       dim = 2 * nodes - (PetscInt)s.d.C.rows();
  const Dense          Z   = Eigen::FullPivLU<Dense>(s.d.C).kernel().householderQr().householderQ() *
                  Dense::Identity(2 * nodes, dim);
  /* the preconditioner in Ker C */
  const Dense                                T = Z.adjoint() * proj.Q * s.inverse * proj.Q.adjoint() * Z;
  const Dense                                L = (Z.adjoint() * s.d.A * Z).llt().matrixL();
  const Eigen::SelfAdjointEigenSolver<Dense> spectrum(L.adjoint() * T * L);
  const Column v = L.adjoint().triangularView<Eigen::Upper>().solve(spectrum.eigenvectors().col(0)), y = Z * v;

  s.inverse = Z * (T + (missed - spectrum.eigenvalues()[0]) * v * v.adjoint()) * Z.adjoint();
  s.x += (5 * rtol * Energy(s, s.x) - y.dot(s.d.A * s.x)) * y;
  s.d.f = s.d.A * s.x + s.d.C.adjoint() * s.lambda;
  (void)snprintf(line, sizeof(line),
                 "-pc_ainsworth_stop energy_error -pc_ainsworth_error_rtol %g -pc_ainsworth_error_eigenvalue %g",
                 (double)rtol, (double)(0.9 * missed));
  PetscCall(Solve(&s, line, false, &given));
  PetscCall(CheckTrue(KSPConvergedReasons[given.reason], given.reason == KSP_CONVERGED_RTOL));
  PetscCall(Check("error with the eigenvalue given", given.error, rtol));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (PetscReal contrast : {1.0, 1e3, 1e6}) {
    PetscCall(Residual(contrast, 0.0, 1.0, ""));
    PetscCall(Residual(contrast, 1.0, 1.0, ""));
    PetscCall(Residual(contrast, 1.0, 0.0, ""));
    for (bool paper : {false, true}) {
      PetscCall(Error(contrast, 0.0, 1.0, paper));
      PetscCall(Error(contrast, 1.0, 1.0, paper));
      PetscCall(Error(contrast, 1.0, 0.0, paper));
    }
  }
  for (const char *method : {"cg", "fcg", "groppcg"})
    PetscCall(Residual(1e6, 0.0, 1.0, std::string("-ainsworth_ksp_type ") + method));
  for (PetscReal contrast : {10.0, 100.0, 1e3}) PetscCall(Weak(contrast));
  PetscCall(Stagnation());
  PetscCall(Plateau());
  PetscCall(Settings());
  for (const char *stop : {"-pc_ainsworth_stop residual", "-pc_ainsworth_stop energy_error"}) {
    PetscCall(Rounding(1e10, 1.0, stop));
    PetscCall(
      Rounding(1e8, 1.0,
               std::string(stop) + " -ainsworth_ksp_rtol 1e-14" +
                 (std::string(stop).find("energy") != std::string::npos ? " -pc_ainsworth_error_rtol 1e-14" : "")));
    PetscCall(Rounding(1e6, 0.0, stop));
    PetscCall(Rounding(1.0, 0.0, stop));
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
