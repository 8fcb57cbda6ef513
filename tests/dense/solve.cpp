static char help[] = "x and lambda of PCAINSWORTH against a dense LU of the full system.\n\n";

#include "dense.h"

/* How the program passes its system */
struct Layout {
  enum { EXPLICIT, TRANSPOSE, HERMITIAN, ABSENT } ct = TRANSPOSE;
  bool c = true, empty = false, first = false, nestedVectors = false;
};

static PetscErrorCode BlocksCreate(const System &sys, const Layout &layout, Mat *nest)
{
  Mat      Ct = NULL, D = NULL;
  PetscInt m;

  PetscFunctionBeginUser;
  if (layout.ct == Layout::EXPLICIT) PetscCall(MatHermitianTranspose(sys.C, MAT_INITIAL_MATRIX, &Ct));
  if (layout.ct == Layout::TRANSPOSE) PetscCall(MatCreateTranspose(sys.C, &Ct));
  if (layout.ct == Layout::HERMITIAN) PetscCall(MatCreateHermitianTranspose(sys.C, &Ct));
  if (layout.empty) {
    PetscCall(MatGetLocalSize(sys.C, &m, NULL));
    PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 0, NULL, 0, NULL, &D));
    PetscCall(MatAssemblyBegin(D, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(D, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(NestCreate(sys.A, Ct, layout.c ? sys.C : NULL, D, layout.first, nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatDestroy(&D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The vectors of the fields into a vector of the whole, and back */
static PetscErrorCode Fields(Mat nest, bool first, Vec whole, Vec primal, Vec multiplier, bool into)
{
  const Vec fields[2] = {first ? multiplier : primal, first ? primal : multiplier};
  IS        is[2];

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(nest, is, NULL));
  for (int k = 0; k < 2; k++) {
    Vec sub;
    PetscCall(VecGetSubVector(whole, is[k], &sub));
    PetscCall(VecCopy(into ? fields[k] : sub, into ? sub : fields[k]));
    PetscCall(VecRestoreSubVector(whole, is[k], &sub));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MatCreateVecs() would need a block in every row and column */
static PetscErrorCode WholeCreate(Mat nest, const System &sys, bool first, bool nestedVectors, Vec *whole)
{
  Vec      fields[2];
  IS       is[2];
  PetscInt n;

  PetscFunctionBeginUser;
  if (nestedVectors) {
    PetscCall(MatNestGetISs(nest, is, NULL));
    for (int k = 0; k < 2; k++) PetscCall(VecDuplicate(first == (k == 0) ? sys.g : sys.f, &fields[k]));
    PetscCall(VecCreateNest(PETSC_COMM_WORLD, 2, is, fields, whole));
    for (int k = 0; k < 2; k++) PetscCall(VecDestroy(&fields[k]));
  } else {
    PetscCall(MatGetLocalSize(nest, &n, NULL));
    PetscCall(VecCreateMPI(PETSC_COMM_WORLD, n, PETSC_DECIDE, whole));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves with what is set in ksp; x and lambda as dense columns */
static PetscErrorCode Solve(KSP ksp, const System &sys, bool first, bool nestedVectors, Column &x, Column &lambda)
{
  Vec b, y, px, pl;
  Mat nest;

  PetscFunctionBeginUser;
  PetscCall(KSPGetOperators(ksp, &nest, NULL));
  PetscCall(WholeCreate(nest, sys, first, nestedVectors, &b));
  PetscCall(WholeCreate(nest, sys, first, nestedVectors, &y));
  PetscCall(Fields(nest, first, b, sys.f, sys.g, true));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(VecDuplicate(sys.f, &px));
  PetscCall(VecDuplicate(sys.g, &pl));
  PetscCall(Fields(nest, first, y, px, pl, false));
  PetscCall(Gather(px, x));
  PetscCall(Gather(pl, lambda));
  for (Vec v : {b, y, px, pl}) PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckSolution(KSP ksp, const System &sys, const DenseSystem &d, bool first, bool nestedVectors, PetscReal tolerance)
{
  const Eigen::Index m = d.C.rows();
  const Column       norms = d.C.rowwise().norm().cast<PetscScalar>();
  Column             x, lambda, expectedX, expectedLambda;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(Solve(ksp, sys, first, nestedVectors, x, lambda));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  SolveSaddle(d, expectedX, expectedLambda);
  PetscCall(CheckEqual("x", x, expectedX, tolerance));
  if (m) {
    PetscReal worst = 0.0;
    for (Eigen::Index i = 0; i < m; i++) worst = PetscMax(worst, PetscAbsScalar((d.C.row(i) * x)[0] - d.g[i]) / (PetscRealPart(norms[i]) * x.norm() + PetscAbsScalar(d.g[i])));
    PetscCall(CheckEqual("lambda", norms.cwiseProduct(lambda), norms.cwiseProduct(expectedLambda), tolerance));
    PetscCall(Check("C x - g", worst, 1e-14));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Layouts()
{
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  Spec        spec;
  System      sys;
  DenseSystem d;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (int ct = 0; ct < 4; ct++) {
    for (int bits = 0; bits < 16; bits++) {
      Layout layout;
      Mat    nest;
      KSP    ksp;

      layout.ct            = (decltype(layout.ct))ct;
      layout.c             = bits & 1;
      layout.empty         = bits & 2;
      layout.first         = bits & 4;
      layout.nestedVectors = bits & 8;
      if (!layout.c && (ct == Layout::ABSENT || (PetscDefined(USE_COMPLEX) && ct == Layout::TRANSPOSE))) continue;
      Case("C' %d, C %d, (1,1) %d, first %d, VecNest %d", ct, layout.c, layout.empty, layout.first, layout.nestedVectors);
      PetscCall(BlocksCreate(sys, layout, &nest));
      PetscCall(SolverCreate(nest, &ksp));
      PetscCall(CheckSolution(ksp, sys, d, layout.first, layout.nestedVectors, 1e-10));
      PetscCall(KSPDestroy(&ksp));
      PetscCall(MatDestroy(&nest));
    }
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every variant and preconditioning matrix, with g and without */
static PetscErrorCode Pmats(const Spec &spec)
{
  System          sys;
  DenseSystem     d;
  const PetscReal tolerance = spec.jump == 1.0 && spec.rowscale == 0.0 ? 1e-10 : 1e-6;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (int variant = 0; variant < 2; variant++) {
    for (int type = 0; type < 6; type++) {
      Options options(std::string("-ainsworth_pc_type redundant -ainsworth_ksp_rtol 1e-12 -pc_ainsworth_variant ") + PCAinsworthVariants[variant] + " -pc_ainsworth_pmat " + PCAinsworthPmatTypes[type] + (spec.symmetric ? "" : " -ainsworth_ksp_type gmres"));
      Mat     nest;
      KSP     ksp;

      Case("%s, %s, %s", spec.name, PCAinsworthVariants[variant], PCAinsworthPmatTypes[type]);
      PetscCall(BlocksCreate(sys, Layout(), &nest));
      PetscCall(SolverCreate(nest, &ksp));
      PetscCall(CheckSolution(ksp, sys, d, false, type % 2, tolerance));
      if (type < 2) {
        System      zero = sys;
        DenseSystem dzero = d;

        PetscCall(VecDuplicate(sys.g, &zero.g));
        PetscCall(VecSet(zero.g, 0.0));
        dzero.g.setZero();
        Case("%s, %s, %s, g = 0", spec.name, PCAinsworthVariants[variant], PCAinsworthPmatTypes[type]);
        PetscCall(CheckSolution(ksp, zero, dzero, false, false, tolerance));
        PetscCall(VecDestroy(&zero.g));
      }
      PetscCall(KSPDestroy(&ksp));
      PetscCall(MatDestroy(&nest));
    }
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C x = g to rounding whatever the inner tolerance, and FGMRES makes a solution of it; many right-hand sides at once */
static PetscErrorCode Loose(const Spec &spec)
{
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-2");
  System      sys;
  DenseSystem d;
  Mat         nest, X, Y;
  KSP         ksp, inner;
  PC          pc;
  Column      x, lambda;
  PetscInt    n, N;
  Dense       dense, columns;

  PetscFunctionBeginUser;
  Case("%s, inner tolerance 1e-2", spec.name);
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(BlocksCreate(sys, Layout(), &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(Solve(ksp, sys, false, false, x, lambda));
  PetscCall(Check("C x - g", (d.C * x - d.g).norm() / d.g.norm(), 1e-13));
  Case("%s, FGMRES around an inner tolerance of 1e-2", spec.name);
  PetscCall(KSPSetType(ksp, KSPFGMRES));
  PetscCall(KSPSetTolerances(ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(CheckSolution(ksp, sys, d, false, true, 1e-9));
  PetscCall(CheckSolution(ksp, sys, d, false, false, 1e-9));

  Case("%s, PCMatApply()", spec.name);
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPSetTolerances(inner, 1e-13, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(MatGetLocalSize(nest, &n, NULL));
  PetscCall(MatGetSize(nest, &N, NULL));
  PetscCall(MatCreateDense(PETSC_COMM_WORLD, n, PETSC_DECIDE, N, 3, NULL, &X));
  for (PetscInt j = 0; j < 3; j++) {
    Vec v;
    PetscCall(MatDenseGetColumnVecWrite(X, j, &v));
    PetscCall(SetRandom(v, 30 + j));
    PetscCall(MatDenseRestoreColumnVecWrite(X, j, &v));
  }
  PetscCall(MatDuplicate(X, MAT_DO_NOT_COPY_VALUES, &Y));
  PetscCall(PCMatApply(pc, X, Y));
  PetscCall(Gather(nest, dense));
  PetscCall(Gather(X, columns));
  const Dense expected = dense.fullPivLu().solve(columns);
  PetscCall(Gather(Y, columns));
  PetscCall(CheckEqual("three solutions", columns, expected, 1e-10));
  PetscCall(MatDestroy(&X));
  PetscCall(MatDestroy(&Y));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No constraints at all, with both variants */
static PetscErrorCode Unconstrained()
{
  PetscFunctionBeginUser;
  for (int variant = 0; variant < 2; variant++) {
    for (bool uneven : {false, true}) {
      Options     options(std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -pc_ainsworth_variant ") + PCAinsworthVariants[variant]);
      Spec        spec;
      System      sys;
      DenseSystem d;
      Mat         nest;
      KSP         ksp;

      spec.m      = 0;
      spec.uneven = uneven;
      Case("m = 0, %s, uneven %d", PCAinsworthVariants[variant], uneven);
      PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
      PetscCall(Gather(sys, d));
      PetscCall(BlocksCreate(sys, Layout(), &nest));
      PetscCall(SolverCreate(nest, &ksp));
      PetscCall(CheckSolution(ksp, sys, d, false, false, 1e-10));
      PetscCall(CheckSolution(ksp, sys, d, false, true, 1e-10));
      PetscCall(KSPDestroy(&ksp));
      PetscCall(MatDestroy(&nest));
      PetscCall(SystemDestroy(&sys));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of C that are zero: lambda = 0 there, and no solution where g is not */
static PetscErrorCode ZeroRows(bool uneven)
{
  Options               options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  Spec                  spec;
  System                sys;
  DenseSystem           d, reduced;
  Mat                   nest;
  KSP                   ksp;
  PC                    pc;
  Column                x, lambda, expectedX, expectedLambda;
  KSPConvergedReason    reason;
  PCFailedReason        failure;
  std::vector<PetscInt> kept;

  PetscFunctionBeginUser;
  spec.zeroRows = true;
  spec.uneven   = uneven;
  Case("zero rows of C, uneven %d", uneven);
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (PetscInt i = 0; i < spec.m; i++)
    if (d.C.row(i).norm() > 0.0) kept.push_back(i);
    else d.g[i] = 0.0;
  PetscCall(CheckTrue("some rows are zero", (PetscInt)kept.size() < spec.m));
  reduced   = d;
  reduced.C = d.C(kept, Eigen::all);
  reduced.g = d.g(kept);
  PetscCall(BlocksCreate(sys, Layout(), &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(Solve(ksp, sys, false, false, x, lambda));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckInt("reason with g on a zero row", reason, KSP_DIVERGED_PC_FAILED));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetFailedReason(pc, &failure));
  PetscCall(CheckInt("failure with g on a zero row", failure, PC_INCONSISTENT_RHS));
  PetscCall(Scatter(d.g, sys.g));
  PetscCall(Solve(ksp, sys, false, true, x, lambda));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue("solved with g = 0 on the zero rows", reason > 0));
  SolveSaddle(reduced, expectedX, expectedLambda);
  PetscCall(CheckEqual("x", x, expectedX, 1e-10));
  PetscCall(CheckEqual("lambda", lambda(kept), expectedLambda, 1e-10));
  PetscCall(CheckTrue("lambda = 0 on the zero rows", lambda.norm() == lambda(kept).norm()));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(Layouts());
  for (const Spec &spec : UsualSpecs()) PetscCall(Pmats(spec));
  for (int k : {0, 4}) PetscCall(Loose(UsualSpecs()[k]));
  PetscCall(Unconstrained());
  for (bool uneven : {false, true}) PetscCall(ZeroRows(uneven));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
