static char help[] = "Vibration modes of constraints of engineering models, by whatever eigensolver the options "
                     "choose.\n\n";

#include "modes/pencil.h"
#include <cmath>
#include <petsctime.h>
#include <slepceps.h>

/* Shift-and-invert with a factorization of the bordered matrix; the shift is below all eigenvalues */
static PetscErrorCode Reference(const ModesPencil &pencil, PetscInt n, PetscReal shift, std::vector<PetscReal> *values)
{
  Mat            K, M;
  EPS            eps;
  ST             st;
  KSP            ksp;
  PC             pc;
  PetscInt       rows, found;
  PetscLogDouble start, end, memory;

  PetscFunctionBeginUser;
  PetscCall(ModesPencilAssemble(pencil, &K, &M, &rows));
  PetscCall(MatSetOption(K, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(PetscTime(&start));
  PetscCall(EPSCreate(PetscObjectComm((PetscObject)K), &eps));
  PetscCall(EPSSetOptionsPrefix(eps, "reference_"));
  PetscCall(EPSSetOperators(eps, K, M));
  PetscCall(EPSSetProblemType(eps, EPS_GHEP));
  PetscCall(EPSSetDimensions(eps, n, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(EPSSetTarget(eps, shift));
  PetscCall(EPSSetWhichEigenpairs(eps, EPS_TARGET_MAGNITUDE));
  PetscCall(EPSGetST(eps, &st));
  PetscCall(STSetType(st, STSINVERT));
  PetscCall(STGetKSP(st, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscCall(EPSSetFromOptions(eps));
  PetscCall(EPSSolve(eps));
  PetscCall(PetscTime(&end));
  PetscCall(EPSGetConverged(eps, &found));
  for (PetscInt i = 0; i < PetscMin(n, found); i++) {
    PetscScalar lambda;

    PetscCall(EPSGetEigenvalue(eps, i, &lambda, NULL));
    values->push_back(PetscRealPart(lambda));
  }
  PetscCall(PetscMemoryGetMaximumUsage(&memory));
  PetscCall(PetscPrintf(PetscObjectComm((PetscObject)eps),
                        "reference: converged=%" PetscInt_FMT " seconds=%.2f peak_mib=%.0f\n", found, end - start,
                        memory / 1048576));
  PetscCall(EPSDestroy(&eps));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The number of eigenvalues below a value: K - value M has as many negative ones, and one more for each row of C
   (Sylvester's law; Gould 1985)
*/
static PetscErrorCode CountBelow(const ModesPencil &pencil, PetscReal value, PetscInt *below)
{
  Mat      K, M, factor;
  KSP      ksp;
  PC       pc;
  PetscInt rows, count[3];

  PetscFunctionBeginUser;
  PetscCall(ModesPencilAssemble(pencil, &K, &M, &rows));
  PetscCall(MatAXPY(K, -value, M, SUBSET_NONZERO_PATTERN));
  PetscCall(MatSetOption(K, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)K), &ksp));
  PetscCall(KSPSetOptionsPrefix(ksp, "count_"));
  PetscCall(KSPSetOperators(ksp, K, K));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscCall(PCFactorSetUpMatSolverType(pc));
  PetscCall(PCFactorGetMatrix(pc, &factor));
  PetscCall(MatMumpsSetIcntl(factor, 13, 1)); /* no root on many ranks, whose inertia is not known */
  PetscCall(MatMumpsSetIcntl(factor, 24, 1)); /* PETSc asks for null pivots */
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSetUp(ksp));
  PetscCall(MatGetInertia(factor, &count[0], &count[1], &count[2]));
  *below = count[0] - rows;
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest |C x| over |x| of n modes */
static PetscErrorCode Violation(const ModesPencil &pencil, EPS eps, PetscInt n, PetscReal *worst)
{
  Vec v, x, Cx;

  PetscFunctionBeginUser;
  *worst = 0.0;
  PetscCall(MatCreateVecs(pencil.K, &v, NULL));
  PetscCall(MatCreateVecs(pencil.model.C, NULL, &Cx));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal size, violation;

    PetscCall(EPSGetEigenvector(eps, i, v, NULL));
    PetscCall(VecGetSubVector(v, pencil.primal, &x));
    PetscCall(VecNorm(x, NORM_2, &size));
    PetscCall(MatMult(pencil.model.C, x, Cx));
    PetscCall(VecNorm(Cx, NORM_2, &violation));
    PetscCall(VecRestoreSubVector(v, pencil.primal, &x));
    *worst = PetscMax(*worst, violation / size);
  }
  PetscCall(VecDestroy(&v));
  PetscCall(VecDestroy(&Cx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  ModesPencil            pencil;
  EPS                    eps;
  PetscInt               rows, dual, converged, wanted, its;
  PetscBool              check = PETSC_FALSE, count = PETSC_FALSE;
  PetscReal              shift = -1e-2, violation;
  PetscLogDouble         start, end, memory;
  std::vector<PetscReal> values, reference;

  PetscFunctionBeginUser;
  PetscCall(SlepcInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscMemorySetGetMaximumUsage());
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "What is done with the modes", NULL);
  PetscCall(
    PetscOptionsBool("-check", "Compare with shift-and-invert (options: -reference_)", NULL, check, &check, NULL));
  PetscCall(
    PetscOptionsReal("-check_shift", "Shift of the comparison, below all eigenvalues", NULL, shift, &shift, NULL));
  PetscCall(PetscOptionsBool("-count", "Count the modes below a value by the inertia of a factorization", NULL, count,
                             &count, NULL));
  PetscOptionsEnd();
  PetscCall(ModesPencilCreate(PETSC_COMM_WORLD, &pencil));
  PetscCall(MatGetSize(pencil.K, &rows, NULL));
  PetscCall(ISGetSize(pencil.dual, &dual));
  PetscCall(PetscTime(&start));
  PetscCall(EPSCreate(PETSC_COMM_WORLD, &eps));
  PetscCall(ModesPencilSetOperators(pencil, eps));
  PetscCall(EPSSetFromOptions(eps));
  PetscCall(EPSSolve(eps));
  PetscCall(PetscTime(&end));
  PetscCall(EPSGetConverged(eps, &converged));
  PetscCall(EPSGetDimensions(eps, &wanted, NULL, NULL));
  PetscCall(EPSGetIterationNumber(eps, &its));
  PetscCall(PetscMemoryGetMaximumUsage(&memory));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "modes: unknowns=%" PetscInt_FMT " constraints=%" PetscInt_FMT " converged=%" PetscInt_FMT
                        " iterations=%" PetscInt_FMT " seconds=%.2f peak_mib=%.0f\n",
                        rows - dual, dual, converged, its, end - start, memory / 1048576));
  for (PetscInt i = 0; i < PetscMin(converged, wanted); i++) {
    PetscScalar lambda;
    PetscReal   error;

    PetscCall(EPSGetEigenvalue(eps, i, &lambda, NULL));
    PetscCall(EPSComputeError(eps, i, EPS_ERROR_ABSOLUTE, &error));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %.15g  residual %.2e\n", (double)PetscRealPart(lambda), (double)error));
    values.push_back(PetscRealPart(lambda));
  }
  PetscCall(Violation(pencil, eps, (PetscInt)values.size(), &violation));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "constraints: violation=%.1e\n", (double)violation));
  PetscCheck(!pencil.swapped || !(check || count), PETSC_COMM_WORLD, PETSC_ERR_SUP, "-check and -count need (K, M)");
  if (check) {
    PetscReal worst = 0.0;

    PetscCall(Reference(pencil, (PetscInt)values.size(), shift, &reference));
    for (size_t i = 0; i < values.size(); i++) {
      if (i >= reference.size() || PetscAbsReal(values[i] - reference[i]) > 1e-6 * (PetscAbsReal(reference[i]) - shift))
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, "check: mode %d is %.12g, the reference's %.12g\n", (int)i,
                              (double)values[i], (double)(i < reference.size() ? reference[i] : NAN)));
      if (i >= reference.size()) break;
      worst = PetscMax(worst, PetscAbsReal(values[i] - reference[i]) / (PetscAbsReal(reference[i]) - shift));
    }
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "check: difference=%.2e, relative to the eigenvalue minus the shift\n",
                          (double)worst));
  }
  for (size_t gap = values.size() > 1 ? values.size() - 1 : 0; count && gap > 0;
       gap--) { /* the last one that is clear */
    const PetscReal middle = (values[gap - 1] + values[gap]) / 2;
    PetscInt        below  = 0;

    if (values[gap] - values[gap - 1] <= 1e-5 * middle) continue;
    PetscCall(CountBelow(pencil, middle, &below));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "count: below %g found=%d inertia=%" PetscInt_FMT " %s\n", (double)middle,
                          (int)gap, below, below == (PetscInt)gap ? "none missing" : "WRONG"));
    break;
  }
  PetscCall(EPSDestroy(&eps));
  PetscCall(ModesPencilDestroy(&pencil));
  PetscCall(SlepcFinalize());
  return converged >= wanted ? 0 : 1;
}
