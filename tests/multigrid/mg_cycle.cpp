static char help[] = "The cycle of PCBLOCKSA against a PCMG of PETSc's own parts: symmetric, positive, linear, and "
                     "Galerkin's products on all levels.\n\n";

#include "internal.h"

/* What the PC made, as matrices that PETSc knows; the finest level first */
struct Levels {
  std::vector<Mat>       op, P;
  std::vector<PetscReal> largest; /* estimated eigenvalues */
};

static PetscErrorCode LevelsCreate(PC pc, Mat finest, Levels *levels)
{
  Mat     *P, *op;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(PCGetInterpolations(pc, &n, &P));
  PetscCall(PCGetCoarseOperators(pc, &n, &op));
  PetscCall(CheckTrue("three levels or more", n > 2));
  PetscCall(PetscObjectReference((PetscObject)finest));
  levels->op.push_back(finest);
  for (PetscInt l = n - 2; l >= 0; l--) {
    Mat             mat, level;
    KSP             ksp;
    AinsworthLevel *data;

    PetscCall(MatConvert(op[l], MATAIJ, MAT_INITIAL_MATRIX, &mat));
    levels->op.push_back(mat);
    PetscCall(MatConvert(P[l], MATAIJ, MAT_INITIAL_MATRIX, &mat));
    levels->P.push_back(mat);
    PetscCall(PCMGGetSmoother(pc, l + 1, &ksp));
    PetscCall(KSPGetOperators(ksp, &level, NULL));
    PetscCall(AinsworthLevelMatGet(level, &data));
    levels->largest.push_back(data->largest);
    PetscCall(MatDestroy(&op[l]));
    PetscCall(MatDestroy(&P[l]));
  }
  PetscCall(PetscFree(op));
  PetscCall(PetscFree(P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LevelsDestroy(Levels *levels)
{
  PetscFunctionBeginUser;
  for (Mat &mat : levels->op) PetscCall(MatDestroy(&mat));
  for (Mat &mat : levels->P) PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A_c = P' A P, but for unknowns that no mode reaches, and a shift of the coarsest */
static PetscErrorCode CheckProducts(const Levels &levels)
{
  PetscFunctionBeginUser;
  for (size_t l = 0; l + 1 < levels.op.size(); l++) {
    Mat          product;
    Vec          reached;
    PetscScalar *r;
    PetscInt     n;
    PetscReal    norm, difference;

    PetscCall(MatPtAP(levels.op[l], levels.P[l], MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
    PetscCall(MatNorm(product, NORM_FROBENIUS, &norm));
    PetscCall(MatCreateVecs(product, &reached, NULL));
    PetscCall(MatGetDiagonal(product, reached));
    PetscCall(VecGetLocalSize(reached, &n));
    PetscCall(VecGetArray(reached, &r));
    for (PetscInt i = 0; i < n; i++) r[i] = r[i] == 0.0 ? 0.0 : 1.0;
    PetscCall(VecRestoreArray(reached, &r));
    PetscCall(MatAYPX(product, -1.0, levels.op[l + 1], DIFFERENT_NONZERO_PATTERN));
    PetscCall(MatDiagonalScale(product, reached, NULL));
    PetscCall(MatNorm(product, NORM_FROBENIUS, &difference));
    PetscCall(Check("A_c - P' A P", difference / norm, l + 2 < levels.op.size() ? 1e-12 : 2e-9));
    PetscCall(VecDestroy(&reached));
    PetscCall(MatDestroy(&product));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ConfigureChebyshev(KSP ksp, Mat op, PetscReal largest, PetscInt steps)
{
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(KSPSetOperators(ksp, op, op));
  PetscCall(KSPSetType(ksp, KSPCHEBYSHEV));
  PetscCall(KSPChebyshevSetEigenvalues(ksp, 1.1 * largest, 0.11 * largest));
  PetscCall(KSPSetNormType(ksp, KSP_NORM_NONE));
  PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, steps));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCJACOBI));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Configures the reference for level l and those below it, by PETSc's own parts: a PCMG of two levels, where the solver
   of the coarser one has such a PCMG as its preconditioner; twice: Chebyshev's iteration of two steps, between .5 and 1
*/
static PetscErrorCode ReferenceSet(const Levels &levels, size_t l, bool twice, PC pc)
{
  const bool coarsest = l + 1 == levels.op.size();
  KSP        ksp;
  PC         inner;

  PetscFunctionBeginUser;
  PetscCall(PCSetOperators(pc, levels.op[l], levels.op[l]));
  if (coarsest) {
    PetscCall(PCSetType(pc, PCREDUNDANT));
    PetscCall(PCRedundantGetKSP(pc, &ksp));
    PetscCall(KSPGetPC(ksp, &inner));
    PetscCall(PCSetType(inner, PCLU));
    PetscCall(PCFactorSetZeroPivot(inner, 1e-300));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PCSetType(pc, PCMG));
  PetscCall(PCMGSetLevels(pc, 2, NULL));
  PetscCall(PCMGSetGalerkin(pc, PC_MG_GALERKIN_EXTERNAL));
  PetscCall(PCMGSetInterpolation(pc, 1, levels.P[l]));
  PetscCall(PCMGGetSmoother(pc, 1, &ksp));
  PetscCall(ConfigureChebyshev(ksp, levels.op[l], levels.largest[l], 2));
  PetscCall(PCMGGetCoarseSolve(pc, &ksp));
  PetscCall(KSPSetOperators(ksp, levels.op[l + 1], levels.op[l + 1]));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  if (twice && l + 2 < levels.op.size()) {
    PetscCall(KSPSetType(ksp, KSPCHEBYSHEV));
    PetscCall(KSPChebyshevSetEigenvalues(ksp, 1.0, 0.5));
    PetscCall(KSPSetNormType(ksp, KSP_NORM_NONE));
    PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, 2));
  }
  PetscCall(KSPGetPC(ksp, &inner));
  PetscCall(ReferenceSet(levels, l + 1, twice, inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReferenceCreate(const Levels &levels, PCMGCycleType cycle, PC *pc)
{
  PetscFunctionBeginUser;
  PetscCall(PCCreate(PETSC_COMM_WORLD, pc));
  PetscCall(PCSetOptionsPrefix(*pc, "reference_"));
  PetscCall(ReferenceSet(levels, 0, cycle == PC_MG_CYCLE_W, *pc));
  PetscCall(PCSetUp(*pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |D^{1/2} (x - y)| / |D^{1/2} y|: soft and stiff unknowns count alike */
static PetscErrorCode Distance(Mat A, Vec x, Vec y, PetscReal *distance)
{
  Column d, a, b;

  PetscFunctionBeginUser;
  Vec diagonal;
  PetscCall(VecDuplicate(x, &diagonal));
  PetscCall(MatGetDiagonal(A, diagonal));
  PetscCall(Gather(diagonal, d));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(Gather(x, a));
  PetscCall(Gather(y, b));
  d         = d.cwiseAbs().cwiseSqrt().cast<PetscScalar>();
  *distance = (d.asDiagonal() * (a - b)).norm() / (d.asDiagonal() * b).norm();
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckApply(PC pc, const Levels &levels, PCMGCycleType cycle, PetscReal rounding,
                                 PetscReal tolerance)
{
  Mat         A = levels.op[0];
  PC          reference;
  Vec         x[3], z[3], y;
  PetscScalar xx, yy, xy, yx;
  PetscReal   distance;

  PetscFunctionBeginUser;
  PetscCall(ReferenceCreate(levels, cycle, &reference));
  for (int k = 0; k < 3; k++) {
    PetscCall(MatCreateVecs(A, &x[k], &z[k]));
    PetscCall(SetRandom(x[k], 70 + k));
  }
  PetscCall(VecDuplicate(z[0], &y));
  PetscCall(VecCopy(x[0], x[2])); /* 2 x_0 - 3 x_1 */
  PetscCall(VecAXPBY(x[2], -3.0, 2.0, x[1]));
  for (int k = 0; k < 3; k++) {
    PetscCall(PCApply(pc, x[k], z[k]));
    PetscCall(PCApply(reference, x[k], y));
    PetscCall(Distance(A, z[k], y, &distance));
    PetscCall(Check("distance from PETSc's own multigrid", distance, tolerance));
  }
  PetscCall(PCApplyTranspose(pc, x[1], y));
  PetscCall(Distance(A, y, z[1], &distance));
  PetscCall(Check("transpose", distance, rounding));
  PetscCall(VecCopy(z[0], y));
  PetscCall(VecAXPBY(y, -3.0, 2.0, z[1]));
  PetscCall(Distance(A, z[2], y, &distance));
  PetscCall(Check("linear", distance, rounding));
  PetscCall(VecDot(z[0], x[0], &xx));
  PetscCall(VecDot(z[1], x[1], &yy));
  PetscCall(VecDot(z[0], x[1], &xy));
  PetscCall(VecDot(z[1], x[0], &yx));
  PetscCall(CheckTrue("positive", PetscRealPart(xx) > 0.0 && PetscRealPart(yy) > 0.0));
  PetscCall(Check("symmetric",
                  PetscAbsScalar(xy - PetscConj(yx)) / PetscSqrtReal(PetscRealPart(xx) * PetscRealPart(yy)), rounding));
  for (int k = 0; k < 3; k++) {
    PetscCall(VecDestroy(&x[k]));
    PetscCall(VecDestroy(&z[k]));
  }
  PetscCall(VecDestroy(&y));
  PetscCall(PCDestroy(&reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The finest smoother, none to five steps from zero and from elsewhere, and the residual that it leaves */
static PetscErrorCode CheckSmoother(PC pc, const Levels &levels)
{
  Mat       A = levels.op[0], op;
  KSP       ksp, reference;
  Vec       b, x, y, r;
  PetscReal distance, norm;
  PetscBool single;

  PetscFunctionBeginUser;
  PetscCall(PCMGGetSmoother(pc, (PetscInt)levels.op.size() - 1, &ksp));
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPCHEBYSHEVSINGLE, &single));
  PetscCall(CheckTrue("smoother in single precision", single));
  PetscCall(KSPGetOperators(ksp, &op, NULL));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &reference));
  PetscCall(MatCreateVecs(A, &b, &x));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecDuplicate(x, &r));
  for (PetscBool guess : {PETSC_FALSE, PETSC_TRUE}) {
    PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, 0));
    PetscCall(SetRandom(b, 81));
    PetscCall(SetRandom(x, 91));
    PetscCall(VecCopy(x, y));
    if (!guess) PetscCall(VecZeroEntries(y));
    PetscCall(KSPSetInitialGuessNonzero(ksp, guess));
    PetscCall(KSPSolve(ksp, b, x));
    PetscCall(VecAXPY(x, -1.0, y));
    PetscCall(VecNorm(x, NORM_2, &norm));
    PetscCall(Check("change by no steps", norm, 0.0));
  }
  for (PetscInt steps : {1, 2, 3, 5})
    for (PetscBool guess : {PETSC_FALSE, PETSC_TRUE}) {
      PetscCall(ConfigureChebyshev(reference, A, levels.largest[0], steps));
      PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, steps));
      PetscCall(SetRandom(b, 80 + steps));
      PetscCall(SetRandom(x, 90 + steps));
      PetscCall(VecCopy(x, y));
      PetscCall(KSPSetInitialGuessNonzero(ksp, guess));
      PetscCall(KSPSetInitialGuessNonzero(reference, guess));
      PetscCall(KSPSolve(ksp, b, x));
      PetscCall(KSPSolve(reference, b, y));
      PetscCall(Distance(A, x, y, &distance));
      PetscCall(Check("distance from KSPCHEBYSHEV", distance, 1e-5));
      for (PetscReal factor : {1.0, 0.5}) { /* straight after the smoother, and of a vector that was changed since */
        if (factor != 1.0) {
          PetscCall(KSPSolve(ksp, b, x));
          PetscCall(VecScale(x, factor));
        }
        PetscCall(MatResidual(op, b, x, r));
        PetscCall(MatResidual(A, b, x, y));
        PetscCall(VecNorm(y, NORM_2, &norm));
        PetscCall(VecAXPY(y, -1.0, r));
        PetscCall(VecNorm(y, NORM_2, &distance));
        PetscCall(Check("residual", distance / norm, 1e-5));
      }
    }
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&r));
  PetscCall(KSPDestroy(&reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Cycle(const Lattice &l, bool sum, bool single, PCMGCycleType cycle)
{
  Options options(
    std::string("-pc_blocksa_coarse_eq_limit 40 -pc_blocksa_process_eq_limit 100 -pc_blocksa_precision ") +
    (single ? "single" : "double") + " -pc_mg_cycle_type " + (cycle == PC_MG_CYCLE_W ? "w" : "v"));
  Mat         A, D, M, finest;
  KSP         ksp;
  PC          pc;
  Levels      levels;
  const char *layout;

  PetscFunctionBeginUser;
  PetscCall(LayoutName(l, &layout));
  Case("blocks of %d, %s, contrast %g, %s, %s precision, cycle %s", (int)l.bs, layout, (double)l.contrast,
       sum ? "sum" : "A", single ? "single" : "double", cycle == PC_MG_CYCLE_W ? "W" : "V");
  PetscCall(LatticeCreate(l, &A));
  PetscCall(SurfaceCreate(l, A, 0.5, 6, &D));
  PetscCall(LatticeSetNearNullSpace(l, A));
  PetscCall(SumCreate(A, D, &M));
  PetscCall(MultigridCreate(sum ? M : A, &ksp));
  PetscCall(KSPSetUp(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(MatDuplicate(A, MAT_COPY_VALUES, &finest));
  if (sum) PetscCall(MatAXPY(finest, 1.0, D, DIFFERENT_NONZERO_PATTERN));
  PetscCall(LevelsCreate(pc, finest, &levels));
  PetscCall(MatDestroy(&finest));
  PetscCall(CheckProducts(levels));
  PetscCall(CheckApply(pc, levels, cycle, single ? 1e-5 : 1e-12, single ? 1e-5 : 1e-10));
  if (single) PetscCall(CheckSmoother(pc, levels));
  PetscCall(LevelsDestroy(&levels));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&M));
  PetscCall(MatDestroy(&D));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the smoother in single precision cannot do */
static PetscErrorCode Refusals()
{
  Lattice l;
  Mat     A;
  KSP     ksp;
  PC      pc;

  PetscFunctionBeginUser;
  Case("refusals");
  PetscCall(LatticeCreate(l, &A));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(KSPSetType(ksp, KSPCHEBYSHEVSINGLE));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCJACOBI));
  PetscCall(CheckError("another matrix", [ksp] { return KSPSetUp(ksp); }, PETSC_ERR_SUP,
                       {KSPCHEBYSHEVSINGLE, PCBLOCKSA, "-mg_levels_ksp_type chebyshev"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(Refusals());
  for (bool single : {false, true}) {
    Lattice l;

    l.layers = 12;
    for (bool sum : {false, true})
      for (PCMGCycleType cycle : {PC_MG_CYCLE_V, PC_MG_CYCLE_W}) PetscCall(Cycle(l, sum, single, cycle));
    for (auto layout : {Lattice::HOLE, Lattice::SMALL, Lattice::LAST}) {
      l.layout = layout;
      PetscCall(Cycle(l, true, single, PC_MG_CYCLE_W));
    }
    l.layout = Lattice::EVEN;
    l.apart = l.alone = true;
    l.contrast        = 1e4;
    PetscCall(Cycle(l, true, single, PC_MG_CYCLE_W));
    l        = Lattice();
    l.bs     = 2;
    l.n      = 10;
    l.layers = 20;
    PetscCall(Cycle(l, true, single, PC_MG_CYCLE_W));
    l.bs     = 4;
    l.n      = 4;
    l.layers = 14;
    PetscCall(Cycle(l, true, single, PC_MG_CYCLE_W));
    l.bs     = 1;
    l.n      = 8;
    l.layers = 24;
    PetscCall(Cycle(l, true, single, PC_MG_CYCLE_W));
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
