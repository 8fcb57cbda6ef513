static char help[] = "CG with PCBLOCKSA where scales, contrasts, layouts, sizes and types of the matrix are unusual, "
                     "and what options do.\n\n";

#include "lattice.h"

/*
   Solves to rtol from a random right-hand side times a factor, within so many iterations; the residual is weighted by
   D^{-1/2}
*/
static PetscErrorCode Solve(KSP ksp, PetscReal rtol, PetscReal factor, PetscInt most, PetscInt *iterations)
{
  Mat                M;
  MatNullSpace       null;
  Vec                b, x, r;
  PetscReal          norm, residual;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(KSPGetOperators(ksp, &M, NULL));
  PetscCall(MatCreateVecs(M, &x, &b));
  PetscCall(VecDuplicate(b, &r));
  PetscCall(SetRandom(b, 7));
  PetscCall(MatGetNullSpace(M, &null));
  if (null) PetscCall(MatNullSpaceRemove(null, b));
  PetscCall(VecScale(b, factor));
  PetscCall(KSPSetTolerances(ksp, rtol, 1e-300, PETSC_DEFAULT, 300));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(KSPGetIterationNumber(ksp, iterations));
  PetscCall(Check("iterations", (PetscReal)*iterations, (PetscReal)most));
  PetscCall(MatResidual(M, b, x, r));
  PetscCall(MatGetDiagonal(M, x));
  PetscCall(VecSqrtAbs(x));
  PetscCall(VecPointwiseDivide(r, r, x));
  PetscCall(VecPointwiseDivide(b, b, x));
  PetscCall(VecNorm(b, NORM_2, &norm));
  PetscCall(VecNorm(r, NORM_2, &residual));
  PetscCall(Check("residual", residual / norm, 1000.0 * rtol));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solver for A times a factor, set up, solved, and seen; both may be NULL */
static PetscErrorCode Once(const Lattice &l, PetscReal factor, PetscReal rtol, PetscReal rhs, PetscInt most,
                           PetscInt *iterations, std::string *view)
{
  Mat A;
  KSP ksp;

  PetscFunctionBeginUser;
  PetscCall(LatticeCreate(l, &A));
  PetscCall(MatScale(A, factor));
  PetscCall(LatticeSetNearNullSpace(l, A));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(Solve(ksp, rtol, rhs, most, iterations));
  if (view) PetscCall(ViewText(ksp, *view));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Lattice Usual()
{
  Lattice l;

  l.n      = 5;
  l.layers = 12;
  return l;
}

/* The units of the program do not matter, nor does the precision of the finest level */
static PetscErrorCode Scales()
{
  PetscInt first = 0, its;

  PetscFunctionBeginUser;
  for (PetscReal rtol : {1e-8, 1e-12}) {
    Case("scales, rtol %g", (double)rtol);
    PetscCall(Once(Usual(), 1.0, rtol, 1.0, rtol < 1e-10 ? 16 : 11, &first, NULL));
    for (PetscReal factor : {1e-36, 1e36, 1e40})
      for (PetscReal rhs : {1.0, 1e-60, 1e60, factor}) {
        Case("A times %g, right-hand side times %g, rtol %g", (double)factor, (double)rhs, (double)rtol);
        PetscCall(Once(Usual(), factor, rtol, rhs, 30, &its, NULL));
        PetscCall(CheckInt("iterations", its, first));
      }
    Options choice("-pc_blocksa_precision double");
    Case("double precision, rtol %g", (double)rtol);
    PetscCall(Once(Usual(), 1.0, rtol, 1.0, 16, &its, NULL));
    PetscCall(Check("iterations in double against single", PetscAbsReal((PetscReal)(its - first)), 1.0));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stiff and soft bodies, and parts of a body */
static PetscErrorCode Contrasts()
{
  Lattice     l = Usual();
  PetscInt    its;
  std::string view;

  PetscFunctionBeginUser;
  for (PetscReal contrast : {1e-12, 1e-4, 1e4, 1e12}) {
    Case("two bodies, contrast %g", (double)contrast);
    l.apart    = true;
    l.contrast = contrast;
    PetscCall(Once(l, 1.0, 1e-8, 1.0, 13, &its, &view));
    PetscCall(CheckText("KSPView()", view, {"levels in single precision;"}));
  }
  l.apart = false;
  for (PetscReal contrast : {1e-4, 1e4, 1e6}) {
    Case("one body, contrast %g", (double)contrast);
    l.contrast = contrast;
    PetscCall(Once(l, 1.0, 1e-8, 1.0, 25, &its, &view));
    PetscCall(CheckText("KSPView()", view, {"levels in single precision;"}));
  }
  Case("one body, contrast 1e10");
  l.contrast = 1e10;
  l.layout   = Lattice::LAST;
  PetscCall(Once(l, 1.0, 1e-8, 1.0, 30, &its, &view));
  PetscCall(CheckText("KSPView()", view,
                      {"levels in double precision, as values jump too far", "type: chebyshev\n"}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whatever the ranks own, and however small the matrix is */
static PetscErrorCode Layouts()
{
  PetscInt its, first = 0;

  PetscFunctionBeginUser;
  for (PetscInt bs : {1, 2, 3, 4}) {
    Lattice     l = Usual();
    const char *name;

    l.bs = bs;
    if (bs == 1) l.n = 8;
    if (bs == 2) l.n = l.layers = 20;
    for (auto layout : {Lattice::EVEN, Lattice::HOLE, Lattice::SMALL, Lattice::LAST}) {
      l.layout = layout;
      PetscCall(LayoutName(l, &name));
      Case("blocks of %d, %s", (int)bs, name);
      PetscCall(Once(l, 1.0, 1e-8, 1.0, bs == 2 ? 16 : 12, &its, NULL));
      if (layout == Lattice::EVEN) first = its;
      PetscCall(Check("difference to usual ranks", PetscAbsReal((PetscReal)(its - first)), 2.0));
    }
    for (PetscInt n : {1, 2})
      for (PetscInt layers : {1, 2, 5})
        for (auto layout : {Lattice::EVEN, Lattice::HOLE, Lattice::LAST}) {
          Lattice tiny;

          Case("blocks of %d, %d x %d nodes, layout %d", (int)bs, (int)n, (int)layers, (int)layout);
          tiny.bs     = bs;
          tiny.n      = n;
          tiny.layers = layers;
          tiny.layout = layout;
          if (bs < 4 && bs > 1 && n == 1 && layers > 1) continue; /* a line of bars gives way to the side */
          PetscCall(Once(tiny, 1.0, 1e-8, 1.0, 2, &its, NULL));
        }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No node is coupled to another */
static PetscErrorCode Diagonal()
{
  for (PetscInt bs : {1, 3}) {
    Mat      A;
    KSP      ksp;
    PetscInt its, start, end, local = 1200;

    PetscFunctionBeginUser;
    Case("diagonal, blocks of %d", (int)bs);
    PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, local, local, PETSC_DECIDE, PETSC_DECIDE, 1, NULL, 0, NULL, &A));
    PetscCall(MatSetBlockSize(A, bs));
    PetscCall(MatGetOwnershipRange(A, &start, &end));
    for (PetscInt i = start; i < end; i++) PetscCall(MatSetValue(A, i, i, 1.0 + (PetscReal)(i % 7), INSERT_VALUES));
    PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MultigridCreate(A, &ksp));
    PetscCall(Solve(ksp, 1e-8, 1.0, 2, &its));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&A));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing holds the body, and the program says so or not: the right-hand side is in the range anyway */
static PetscErrorCode Floating(PetscInt bs, PetscInt coarse, PetscReal factor)
{
  Options      options("-pc_blocksa_coarse_eq_limit " + std::to_string(coarse));
  Lattice      l = Usual();
  Mat          A;
  KSP          ksp;
  MatNullSpace space, null;
  PetscInt     its, nvec;
  const Vec   *vec;

  PetscFunctionBeginUser;
  Case("floating, blocks of %d, coarse_eq_limit %d, A times %g", (int)bs, (int)coarse, (double)factor);
  l.bs       = bs;
  l.n        = bs == 2 ? 15 : 5;
  l.layers   = bs == 2 ? 25 : 12;
  l.floating = true;
  PetscCall(LatticeCreate(l, &A));
  PetscCall(MatScale(A, factor));
  PetscCall(LatticeSetNearNullSpace(l, A));
  PetscCall(MatGetNearNullSpace(A, &space));
  PetscCall(MatNullSpaceGetVecs(space, NULL, &nvec, &vec));
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, nvec, vec, &null));
  PetscCall(MatSetNullSpace(A, null));
  PetscCall(MatNullSpaceDestroy(&null));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(Solve(ksp, 1e-8, 1.0, bs == 2 ? 18 : 13, &its));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Modes from coordinates are as good as a near null space; without either it takes longer, and KSPView() says so */
static PetscErrorCode ModesFrom(PetscInt bs)
{
  Lattice                l = Usual();
  Mat                    A;
  KSP                    ksp;
  PC                     pc;
  std::vector<PetscReal> x;
  PetscInt               its[3];
  std::string            view;
  const char *const      source[] = {"modes: the near null space of the matrix\n",
                                     "modes: rigid-body modes from coordinates\n",
                                     "modes: one constant per component; rigid-body modes"};

  PetscFunctionBeginUser;
  l.bs     = bs;
  l.n      = 4;
  l.layers = bs == 2 ? 100 : 40; /* slender */
  for (int k = 0; k < 3; k++) {
    Case("modes %d, blocks of %d", k, (int)bs);
    PetscCall(LatticeCreate(l, &A));
    if (k == 0) PetscCall(LatticeSetNearNullSpace(l, A));
    PetscCall(MultigridCreate(A, &ksp));
    PetscCall(LatticeCoordinates(l, A, x));
    PetscCall(KSPGetPC(ksp, &pc));
    if (k == 1) PetscCall(PCSetCoordinates(pc, bs, (PetscInt)x.size() / bs, x.data()));
    PetscCall(Solve(ksp, 1e-8, 1.0, k < 2 ? 15 : 200, &its[k]));
    PetscCall(ViewText(ksp, view));
    PetscCall(CheckText("KSPView()", view, {source[k]}));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&A));
  }
  PetscCall(CheckInt("iterations with coordinates", its[1], its[0]));
  PetscCall(CheckTrue("more iterations with translations alone", its[2] > its[0] + 5));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every type that becomes AIJ */
static PetscErrorCode Types()
{
  Mat      A, B;
  KSP      ksp;
  PetscInt first = 0, its;

  PetscFunctionBeginUser;
  PetscCall(LatticeCreate(Usual(), &A));
  for (MatType type : {MATAIJ, MATBAIJ, MATSBAIJ}) {
    PetscBool same;

    Case("%s", type);
    PetscCall(PetscStrcmp(type, MATSBAIJ, &same));
    if (same && PetscDefined(USE_COMPLEX)) continue; /* PETSc has no Hermitian one with blocks */
    if (same) PetscCall(MatSetOption(A, MAT_SYMMETRIC, PETSC_TRUE));
    PetscCall(MatConvert(A, type, MAT_INITIAL_MATRIX, &B));
    PetscCall(LatticeSetNearNullSpace(Usual(), B));
    PetscCall(MultigridCreate(B, &ksp));
    PetscCall(Solve(ksp, 1e-8, 1.0, 11, &its));
    PetscCall(PetscStrcmp(type, MATAIJ, &same));
    if (same) first = its;
    PetscCall(CheckInt("iterations", its, first));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&B));
  }
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What an option must leave in the view */
static PetscErrorCode Choice(const char *option, PetscInt most, const std::vector<std::string> &parts)
{
  Options     options(option);
  std::string view;
  PetscInt    its;

  PetscFunctionBeginUser;
  Case("%s", option);
  PetscCall(Once(Usual(), 1.0, 1e-8, 1.0, most, &its, &view));
  PetscCall(CheckText("KSPView()", view, parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Choices()
{
  const std::string everywhere = std::to_string(PetscGlobalSize) + (PetscGlobalSize == 1 ? " rank\n" : " ranks\n");
  Mat               A;
  KSP               ksp;
  std::string       view;

  PetscFunctionBeginUser;
  Case("before the set-up");
  PetscCall(LatticeCreate(Usual(), &A));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(ViewText(ksp, view));
  PetscCall(CheckText("KSPView()", view, {"block smoothed aggregation, threshold 0.03\n", "not set up yet"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscCall(Choice("", 11,
                   {"type: blocksa", "block smoothed aggregation, threshold 0.03\n", "cycles=w",
                    "level: 900 unknowns, blocks of 3,", "type: chebyshevsingle\n",
                    "single precision, eigenvalues used: min", "type: jacobi", "maximum iterations=2,",
                    "operator complexity 1.", "package used to perform factorization: petsc", "type: seqdense"}));
  PetscCall(Choice("-pc_blocksa_threshold 0.1", 14, {"threshold 0.1\n"}));
  PetscCall(Choice("-pc_blocksa_process_eq_limit 0", 12, {" rows a rank, on " + everywhere + "  Coarse grid solver"}));
  PetscCall(Choice("-pc_blocksa_process_eq_limit 1000000", 12, {" rows a rank, on 1 rank\n  Coarse grid solver"}));
  PetscCall(Choice("-pc_blocksa_coarse_eq_limit 1000", 2,
                   {"levels=1", "levels in double precision, as values jump too far or there is only one"}));
  PetscCall(Choice("-pc_blocksa_precision double", 11, {"levels in double precision;", "type: chebyshev\n"}));
  PetscCall(Choice("-pc_mg_cycle_type v", 12, {"cycles=v"}));
  PetscCall(Choice("-pc_mg_multiplicative_cycles 2", 11, {"Cycles per PCApply=2"}));
  PetscCall(Choice("-mg_levels_ksp_type chebyshev", 11, {"type: chebyshev\n", "levels in single precision;"}));
  PetscCall(Choice("-mg_levels_ksp_type richardson -mg_levels_ksp_richardson_scale 0.4", 25, {"type: richardson"}));
  PetscCall(Choice("-mg_levels_ksp_max_it 3", 10, {"maximum iterations=3,"}));
  PetscCall(Choice("-mg_levels_ksp_type chebyshev -mg_levels_ksp_chebyshev_esteig 0,0.2,0,1.05", 13,
                   {"eigenvalue targets used: min", "[0. 0.2; 0. 1.05]"}));
  PetscCall(
    Choice("-mg_levels_ksp_type chebyshev -mg_levels_ksp_chebyshev_eigenvalues 0.5,4.5", 15, {"min 0.5, max 4.5"}));
#if defined(PETSC_HAVE_MUMPS)
  PetscCall(Choice(PetscGlobalSize > 1 ? "-mg_coarse_sub_pc_factor_mat_solver_type mumps"
                                       : "-mg_coarse_pc_factor_mat_solver_type mumps",
                   11, {"package used to perform factorization: mumps"}));
#endif
  PetscCall(Choice("-mg_coarse_ksp_type cg -mg_coarse_pc_type jacobi -mg_coarse_ksp_rtol 1e-10", 11, {"type: cg"}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(Scales());
  PetscCall(Contrasts());
  PetscCall(Layouts());
  PetscCall(Diagonal());
  for (PetscInt bs : {1, 2, 3})
    for (PetscInt coarse : {60, 2000})
      for (PetscReal factor : {1.0, 1e-36, 1e36}) PetscCall(Floating(bs, coarse, factor));
  for (PetscInt bs : {2, 3}) PetscCall(ModesFrom(bs));
  PetscCall(Types());
  PetscCall(Choices());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
