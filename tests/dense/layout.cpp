#include "layout.h"

PetscErrorCode LayoutCreate(const System &sys, const Layout &layout, Mat *nest)
{
  Mat      C = NULL, Ct = NULL, D = NULL;
  PetscInt m;

  PetscFunctionBeginUser;
  if (layout.ct == Layout::EXPLICIT) PetscCall(MatHermitianTranspose(sys.C, MAT_INITIAL_MATRIX, &Ct));
  if (layout.ct == Layout::TRANSPOSE) PetscCall(MatCreateTranspose(sys.C, &Ct));
  if (layout.ct == Layout::HERMITIAN) PetscCall(MatCreateHermitianTranspose(sys.C, &Ct));
  if (layout.view) {
    Mat T;
    PetscCall(MatTranspose(sys.C, MAT_INITIAL_MATRIX, &T));
    PetscCall(MatCreateTranspose(T, &C));
    PetscCall(MatDestroy(&T));
  }
  if (layout.empty) {
    PetscCall(MatGetLocalSize(sys.C, &m, NULL));
    PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 0, NULL, 0, NULL, &D));
    PetscCall(MatAssemblyBegin(D, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(D, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(NestCreate(sys.A, Ct, layout.view ? C : (layout.c ? sys.C : NULL), D, layout.first, nest));
  for (Mat *mat : {&C, &Ct, &D}) PetscCall(MatDestroy(mat));
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
PetscErrorCode SolveFields(KSP ksp, const System &sys, bool first, bool nestedVectors, Column &x, Column &lambda,
                           bool transposed)
{
  Vec b, y, px, pl;
  Mat nest;

  PetscFunctionBeginUser;
  PetscCall(KSPGetOperators(ksp, &nest, NULL));
  PetscCall(WholeCreate(nest, sys, first, nestedVectors, &b));
  PetscCall(WholeCreate(nest, sys, first, nestedVectors, &y));
  PetscCall(Fields(nest, first, b, sys.f, sys.g, true));
  PetscCall(transposed ? KSPSolveTranspose(ksp, b, y) : KSPSolve(ksp, b, y));
  PetscCall(VecDuplicate(sys.f, &px));
  PetscCall(VecDuplicate(sys.g, &pl));
  PetscCall(Fields(nest, first, y, px, pl, false));
  PetscCall(Gather(px, x));
  PetscCall(Gather(pl, lambda));
  for (Vec v : {b, y, px, pl}) PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckSolution(KSP ksp, const System &sys, const DenseSystem &d, bool first, bool nestedVectors,
                             PetscReal tolerance, PetscReal rounding)
{
  const Eigen::Index m     = d.C.rows();
  const Column       norms = d.C.rowwise().norm().cast<PetscScalar>();
  Column             x, lambda, expectedX, expectedLambda;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(SolveFields(ksp, sys, first, nestedVectors, x, lambda));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  SolveSaddle(d, expectedX, expectedLambda);
  PetscCall(CheckEqual("x", x, expectedX, tolerance));
  if (m) {
    PetscReal worst = 0.0;
    for (Eigen::Index i = 0; i < m; i++)
      worst = PetscMax(worst, PetscAbsScalar((d.C.row(i) * x)[0] - d.g[i]) /
                                (PetscRealPart(norms[i]) * x.norm() + PetscAbsScalar(d.g[i])));
    PetscCall(CheckEqual("lambda", norms.cwiseProduct(lambda), norms.cwiseProduct(expectedLambda), tolerance));
    PetscCall(Check("C x - g", worst, rounding));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
