static char help
  [] = "Many loads on one of the models, or the two cubes: all at once by KSPMatSolve(), and one after the other.\n\n";

#include "models/model.h"
#include "compat.h"
#include <petsctime.h>

/* [A C'; C 0] of a model, and its loads as the columns of a dense matrix */
struct Loads {
  Model model;
  Mat   K, B;
};

/* Random forces, and the constraint values of the model times random factors */
static PetscErrorCode CreateLoads(PetscInt loads, Loads *s)
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
    PetscCall(VecAXPBY(parts[1], factor, 0.0, s->model.g));
    PetscCall(MatDenseGetColumnVecWrite(s->B, j, &whole));
    PetscCall(VecGetArrayWrite(whole, &to));
    for (int k = 0; k < 2; k++) {
      PetscCall(VecGetArrayRead(parts[k], &from));
      PetscCall(PetscArraycpy(to + (k ? n : 0), from, k ? m : n));
      PetscCall(VecRestoreArrayRead(parts[k], &from));
    }
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
  for (PetscInt j = 0; j < loads; j++) *worst = PetscMax(*worst, norms[0][j] / norms[1][j]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscInt       loads = 6, repeat = 1;
  PetscReal      worst = 0.0;
  PetscBool      each  = PETSC_TRUE;
  PetscLogDouble start, end, least[2] = {PETSC_MAX_REAL, PETSC_MAX_REAL};
  Loads          s;
  KSP            ksp;
  Mat            X, Y;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "Loads", NULL);
  PetscCall(PetscOptionsInt("-loads", "How many", NULL, loads, &loads, NULL));
  PetscCall(PetscOptionsInt("-repeat", "How often both are timed, in turns", NULL, repeat, &repeat, NULL));
  PetscCall(PetscOptionsBool("-each", "Solve one after the other, too, and compare", NULL, each, &each, NULL));
  PetscOptionsEnd();
  PetscCall(ModelCreate(PETSC_COMM_WORLD, &s.model));
  PetscCall(CreateLoads(loads, &s));
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
  if (each) PetscCall(Compare(X, Y, &worst));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "loads: %s loads=%" PetscInt_FMT " each_s=%.3f all_s=%.3f ratio=%.2f difference=%.1e\n",
                        s.model.name, loads, least[0], least[1], least[1] / least[0], (double)worst));
  PetscCall(KSPDestroy(&ksp));
  for (Mat *M : {&s.K, &s.B, &X, &Y}) PetscCall(MatDestroy(M));
  PetscCall(ModelDestroy(&s.model));
  PetscCall(PetscFinalize());
  return 0;
}
