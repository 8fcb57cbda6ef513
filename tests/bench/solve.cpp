static char help[] = "The saddle-point system [A B'; C -D][x; lambda] = [f; g] of files, or A x = f of two (-alone), "
                     "solved by whatever solver the options choose.\n\n";

#include "alone.h"
#include "report.h"
#include "system.h"

int main(int argc, char **argv)
{
  SaddleSolution solution;
  char           x[PETSC_MAX_PATH_LEN], lambda[PETSC_MAX_PATH_LEN];
  PetscBool      given, hasX, hasLambda, alone = PETSC_FALSE;
  bool           converged;
  SaddleBlocks   s;
  Vec            f, g;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "Output of the solution", NULL);
  PetscCall(
    PetscOptionsString("-x_out", "Write x to this file, in PETSc's binary format", NULL, "", x, sizeof(x), &hasX));
  PetscCall(PetscOptionsString("-lambda_out", "Write lambda to this file, as -x_out", NULL, "", lambda, sizeof(lambda),
                               &hasLambda));
  PetscOptionsEnd();
  PetscCall(SystemLoad(PETSC_COMM_WORLD, &given, &s, &f, &g));
  PetscCheck(given, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "Option -A is missing: give the files of the system by -A, -C, -f and, unless they are zero, -g and -D");
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-alone", &alone, NULL));
  if (alone) {
    PetscCall(AloneSolve(s.A, s.C, f, NULL, &solution));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "alone: iterations=%" PetscInt_FMT " reason=%s\n", solution.iterations,
                          KSPConvergedReasons[solution.reason]));
  } else PetscCall(SaddleSolve(s, f, g, &solution));
  if (hasX) PetscCall(FileSaveVec(x, solution.x));
  if (hasLambda) PetscCall(FileSaveVec(lambda, solution.lambda));
  PetscCall(ReportSolution(s, f, g, solution));
  converged = solution.reason > 0;
  PetscCall(SaddleSolutionDestroy(&solution));
  PetscCall(SystemDestroy(&s));
  PetscCall(VecDestroy(&f));
  PetscCall(VecDestroy(&g));
  PetscCall(PetscFinalize());
  return converged ? 0 : 1;
}
