static char help[] = "Generated systems of many kinds, with constraints or without, solved by whatever solver the "
                     "options choose.\n\n";

#include "alone.h"
#include "report.h"
#include "scenes/scene.h"

/* What the common line of the tutorials does not have */
static PetscErrorCode ReportScene(const Scene &scene, Mat A, const SaddleSolution &solution, double assembly)
{
  PetscMPIInt size;
  MatInfo     info;
  MatType     type;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(scene.comm, &size));
  PetscCall(MatGetInfo(A, MAT_GLOBAL_SUM, &info));
  PetscCall(MatGetType(A, &type));
  PetscCall(PetscPrintf(
    scene.comm,
    "scene: %s n=%" PetscInt_FMT
    " ranks=%d operator=%s bs=%d nonzeros=%.0f assembly_s=%.3f processor_s=%.4f iterations=%" PetscInt_FMT
    " reason=%s\n",
    scene.name, scene.options.n, (int)size, type, scene.bs, (double)info.nz_used, assembly,
    solution.setupProcessor + solution.solveProcessor, solution.iterations, KSPConvergedReasons[solution.reason]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char           prefix[PETSC_MAX_PATH_LEN];
  PetscBool      write, verify = PETSC_FALSE, coordinates = PETSC_FALSE, solve = PETSC_TRUE;
  PetscReal      start, end;
  Scene          scene;
  SaddleSolution solution;
  bool           converged = true;
  Mat            A, C;
  Vec            f, g, X = NULL;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AloneNow(PETSC_COMM_WORLD, &start));
  PetscCall(SceneCreate(PETSC_COMM_WORLD, &scene));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "What is done with the scene", NULL);
  PetscCall(PetscOptionsString(
    "-write_system", "Write A, C, f, g and the coordinates X in PETSc's binary format to <prefix>_A.dat and so on",
    NULL, "", prefix, sizeof(prefix), &write));
  PetscCall(PetscOptionsBool("-verify",
                             "Print what must hold of A and C, and what must not depend on the number of ranks", NULL,
                             verify, &verify, NULL));
  PetscCall(PetscOptionsBool("-coordinates", "Give the preconditioner of A alone the coordinates of the nodes", NULL,
                             coordinates, &coordinates, NULL));
  PetscCall(PetscOptionsBool("-solve", "Solve the system", NULL, solve, &solve, NULL));
  PetscOptionsEnd();
  PetscCall(SceneAssembleConstraints(scene, &C, &g));
  PetscCall(SceneAssemble(scene, &A, &f));
  PetscCall(AloneNow(PETSC_COMM_WORLD, &end));
  if (verify) PetscCall(SceneVerify(scene, A, C, f, g));
  if (write) {
    Vec X;

    PetscCall(SceneGetCoordinates(scene, &X));
    PetscCall(SaddleWrite(A, C, f, g, X, prefix));
    PetscCall(VecDestroy(&X));
  }
  if (solve) {
    if (coordinates) PetscCall(SceneGetCoordinates(scene, &X));
    if (scene.Constrained()) PetscCall(SaddleSolve({A, C}, f, g, &solution));
    else PetscCall(AloneSolve(A, C, f, X, &solution));
    PetscCall(SceneVerifySolution(scene, solution.x));
    PetscCall(ReportScene(scene, A, solution, end - start));
    PetscCall(ReportSolution({A, C}, f, g, solution));
    converged = solution.reason > 0;
    PetscCall(SaddleSolutionDestroy(&solution));
  }
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&C));
  PetscCall(VecDestroy(&f));
  PetscCall(VecDestroy(&g));
  PetscCall(VecDestroy(&X));
  PetscCall(PetscFinalize());
  return converged ? 0 : 1;
}
