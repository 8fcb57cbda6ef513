static char help
  [] = "Many loads on one of the models, or the two cubes: all at once by KSPMatSolve(), and one after the other.\n\n";

#include "models/model.h"
#include "compat.h"
#include "reference.h"
#include <cmath>
#include <petsctime.h>

/* [A C'; C 0] of a model, and its loads as the columns of a dense matrix */
struct Loads {
  Model                    model;
  Mat                      K, B;
  std::vector<PetscScalar> factors; /* of g of the model */
};

/*
   Random forces, and the constraint values of the model times random factors; each load is `spread` times the one
   before it, the last is zero if asked for, and load `nan` holds NaN, or holds NaN
*/
static PetscErrorCode CreateLoads(PetscInt loads, PetscReal spread, PetscBool zero, PetscInt nan, Loads *s)
{
  Mat         blocks[4] = {s->model.A, NULL, s->model.C, NULL};
  PetscInt    n, m;
  PetscScalar factor;
  PetscRandom random;
  Vec         parts[2], whole;

  PetscFunctionBeginUser;
  PetscCall(MatCreateHermitianTranspose(s->model.C, &blocks[1]));
  PetscCall(MatCreateNest(s->model.mesh.comm, 2, NULL, 2, NULL, blocks, &s->K));
  PetscCall(MatDestroy(&blocks[1]));
  PetscCall(VecGetLocalSize(s->model.f, &n));
  PetscCall(VecGetLocalSize(s->model.g, &m));
  PetscCall(MatCreateDense(s->model.mesh.comm, n + m, PETSC_DECIDE, PETSC_DETERMINE, loads, NULL, &s->B));
  PetscCall(PetscRandomCreate(s->model.mesh.comm, &random));
  PetscCall(PetscRandomSetInterval(random, -1.0, 1.0));
  PetscCall(VecDuplicate(s->model.f, &parts[0]));
  PetscCall(VecDuplicate(s->model.g, &parts[1]));
  for (PetscInt j = 0; j < loads; j++) {
    const PetscScalar *from;
    PetscScalar       *to;

    PetscCall(VecSetRandom(parts[0], random));
    PetscCall(PetscRandomGetValue(random, &factor));
    PetscCallMPI(MPI_Bcast(&factor, 1, MPIU_SCALAR, 0, s->model.mesh.comm));
    for (PetscInt k = 0; k < j; k++) factor *= spread;
    if (zero && j == loads - 1) factor = 0.0;
    s->factors.push_back(factor);
    PetscCall(VecScale(parts[0], factor));
    PetscCall(VecAXPBY(parts[1], factor, 0.0, s->model.g));
    PetscCall(MatDenseGetColumnVecWrite(s->B, j, &whole));
    PetscCall(VecGetArrayWrite(whole, &to));
    for (int k = 0; k < 2; k++) {
      PetscCall(VecGetArrayRead(parts[k], &from));
      PetscCall(PetscArraycpy(to + (k ? n : 0), from, k ? m : n));
      PetscCall(VecRestoreArrayRead(parts[k], &from));
    }
    if (j == nan && n) to[0] = NAN;
    PetscCall(VecRestoreArrayWrite(whole, &to));
    PetscCall(MatDenseRestoreColumnVecWrite(s->B, j, &whole));
  }
  for (Vec &v : parts) PetscCall(VecDestroy(&v));
  PetscCall(PetscRandomDestroy(&random));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SolveEach(KSP ksp, Mat B, Mat X)
{
  PetscInt           loads;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(MatGetSize(B, NULL, &loads));
  for (PetscInt j = 0; j < loads; j++) {
    Vec b, x;

    PetscCall(MatDenseGetColumnVecRead(B, j, &b));
    PetscCall(MatDenseGetColumnVecWrite(X, j, &x));
    PetscCall(KSPSolve(ksp, b, x));
    PetscCall(MatDenseRestoreColumnVecWrite(X, j, &x));
    PetscCall(MatDenseRestoreColumnVecRead(B, j, &b));
    PetscCall(KSPGetConvergedReason(ksp, &reason));
    PetscCheck(reason > 0, PetscObjectComm((PetscObject)ksp), PETSC_ERR_NOT_CONVERGED, "Column %" PetscInt_FMT ": %s",
               j, KSPConvergedReasons[reason]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the largest difference of columns, relative to the column of Y */
static PetscErrorCode Compare(Mat X, Mat Y, PetscReal *worst)
{
  PetscInt               loads;
  std::vector<PetscReal> norms[2];

  PetscFunctionBeginUser;
  *worst = 0.0;
  PetscCall(MatGetSize(X, NULL, &loads));
  for (auto &n : norms) n.resize(loads);
  PetscCall(MatGetColumnNorms(Y, NORM_2, norms[1].data()));
  PetscCall(MatAXPY(X, -1.0, Y, SAME_NONZERO_PATTERN));
  PetscCall(MatGetColumnNorms(X, NORM_2, norms[0].data()));
  for (PetscInt j = 0; j < loads; j++)
    *worst = PetscMax(*worst, norms[1][j] > 0.0 ? norms[0][j] / norms[1][j] : norms[0][j]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the largest error of x of all columns, relative to x, by a direct solver that gets the independent rows of C */
static PetscErrorCode Check(const Loads &s, Mat X, PetscReal *worst)
{
  Mat      C;
  Vec      f, g, scaled, x, lambda, difference;
  PetscInt n;

  PetscFunctionBeginUser;
  *worst = 0.0;
  PetscCall(ModelAssembleRows(s.model, true, &C, &g));
  PetscCall(MatCreateVecs(C, &x, &lambda));
  PetscCall(VecDuplicate(g, &scaled));
  for (Vec *v : {&f, &difference}) PetscCall(VecDuplicate(x, v));
  PetscCall(VecGetLocalSize(x, &n));
  for (size_t j = 0; j < s.factors.size(); j++) {
    PetscReal norm, error;

    for (Mat from : {s.B, X}) { /* their first rows */
      const PetscScalar *a;
      PetscScalar       *to;
      Vec                whole;

      PetscCall(MatDenseGetColumnVecRead(from, (PetscInt)j, &whole));
      PetscCall(VecGetArrayRead(whole, &a));
      PetscCall(VecGetArrayWrite(from == X ? difference : f, &to));
      PetscCall(PetscArraycpy(to, a, n));
      PetscCall(VecRestoreArrayWrite(from == X ? difference : f, &to));
      PetscCall(VecRestoreArrayRead(whole, &a));
      PetscCall(MatDenseRestoreColumnVecRead(from, (PetscInt)j, &whole));
    }
    PetscCall(VecAXPBY(scaled, s.factors[j], 0.0, g));
    PetscCall(ReferenceCompute({s.model.A, C}, f, scaled, x, lambda));
    PetscCall(VecNorm(x, NORM_2, &norm));
    PetscCall(VecAXPY(difference, -1.0, x));
    PetscCall(VecNorm(difference, NORM_2, &error));
    *worst = PetscMax(*worst, norm > 0.0 ? error / norm : error);
  }
  for (Vec *v : {&f, &g, &scaled, &x, &lambda, &difference}) PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscInt       loads = 6, repeat = 1, nan = -1, unknowns;
  PetscReal      worst = 0.0, spread = 1.0;
  PetscBool      each = PETSC_TRUE, check = PETSC_FALSE, zero = PETSC_FALSE;
  PetscLogDouble start, end, least[2]                         = {PETSC_MAX_REAL, PETSC_MAX_REAL};
  Loads          s;
  KSP            ksp;
  Mat            X, Y;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "Loads", NULL);
  PetscCall(PetscOptionsInt("-loads", "How many", NULL, loads, &loads, NULL));
  PetscCall(PetscOptionsInt("-repeat", "How often both are timed, in turns", NULL, repeat, &repeat, NULL));
  PetscCall(PetscOptionsBool("-each", "Solve one after the other, too, and compare", NULL, each, &each, NULL));
  PetscCall(
    PetscOptionsBool("-check", "Compare with a direct solver (options: -reference_)", NULL, check, &check, NULL));
  PetscCall(PetscOptionsReal("-spread", "Each load over the one before it", NULL, spread, &spread, NULL));
  PetscCall(PetscOptionsBool("-last_zero", "The last load is zero", NULL, zero, &zero, NULL));
  PetscCall(PetscOptionsInt("-bad_load", "A load that holds NaN", NULL, nan, &nan, NULL));
  PetscOptionsEnd();
  PetscCall(ModelCreate(PETSC_COMM_WORLD, &s.model));
  PetscCall(CreateLoads(loads, spread, zero, nan, &s));
  PetscCall(MatDuplicate(s.B, MAT_DO_NOT_COPY_VALUES, &X));
  PetscCall(MatDuplicate(s.B, MAT_DO_NOT_COPY_VALUES, &Y));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, s.K, s.K));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSetUp(ksp));
  for (PetscInt k = 0; k < repeat; k++) {
    PetscCall(PetscTime(&start));
    if (each) PetscCall(SolveEach(ksp, s.B, Y));
    PetscCall(PetscTime(&end));
    least[0] = PetscMin(least[0], end - start);
    PetscCall(PetscTime(&start));
    PetscCall(KSPMatSolve(ksp, s.B, X));
    PetscCall(PetscTime(&end));
    least[1] = PetscMin(least[1], end - start);
  }
  if (check) {
    PetscCall(Check(s, X, &worst));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "check: error=%.1e\n", (double)worst));
  }
  if (each) PetscCall(Compare(X, Y, &worst));
  PetscCall(VecGetSize(s.model.f, &unknowns));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "loads: %s unknowns=%" PetscInt_FMT " loads=%" PetscInt_FMT
                        " each_s=%.3f all_s=%.3f ratio=%.2f difference=%.1e\n",
                        s.model.name, unknowns, loads, least[0], least[1], least[1] / least[0], (double)worst));
  PetscCall(KSPDestroy(&ksp));
  for (Mat *M : {&s.K, &s.B, &X, &Y}) PetscCall(MatDestroy(M));
  PetscCall(ModelDestroy(&s.model));
  PetscCall(PetscFinalize());
  return 0;
}
