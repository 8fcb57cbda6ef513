static char help[] = "Two elastic cubes in contact, solved as a saddle-point system by whatever solver the options "
                     "choose.\n\n";

#include "cubes.h"
#include "report.h"

/* Displacement, and the force that contact puts on the nodes: -C' lambda */
static PetscErrorCode ViewDeformed(const CubesSystem &s, const SaddleSolution &solution, const char file[])
{
  Vec force;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(solution.x, &force));
  PetscCall(MatMultHermitianTranspose(s.C, solution.lambda, force));
  PetscCall(VecScale(force, -1.0));
  PetscCall(CubesViewVTU(s.mesh, solution.x, force, file));
  PetscCall(VecDestroy(&force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char           prefix[PETSC_MAX_PATH_LEN], vtu[PETSC_MAX_PATH_LEN];
  PetscBool      write, view;
  CubesOptions   options;
  CubesSystem    system;
  SaddleSolution solution;
  bool           converged;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(CubesOptionsGet(PETSC_COMM_WORLD, &options));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "Output of the two-cube problem", NULL);
  PetscCall(PetscOptionsString(
    "-write_system", "Write A, C, f, g and the coordinates X in PETSc's binary format to <prefix>_A.dat and so on",
    NULL, "", prefix, sizeof(prefix), &write));
  PetscCall(PetscOptionsString("-view_vtu", "Write the deformed bodies for ParaView to this file (.vtu)", NULL, "", vtu,
                               sizeof(vtu), &view));
  PetscOptionsEnd();
  PetscCall(CubesSystemCreate(PETSC_COMM_WORLD, options, &system));
  if (write) {
    Vec X;

    PetscCall(CubesMeshGetCoordinates(system.mesh, &X));
    PetscCall(SaddleWrite(system.A, system.C, system.f, system.g, X, prefix));
    PetscCall(VecDestroy(&X));
  }
  PetscCall(SaddleSolve({system.A, system.C}, system.f, system.g, &solution));
  if (view) PetscCall(ViewDeformed(system, solution, vtu));
  PetscCall(ReportSolution({system.A, system.C}, system.f, system.g, solution));
  converged = solution.reason > 0;
  PetscCall(SaddleSolutionDestroy(&solution));
  PetscCall(CubesSystemDestroy(&system));
  PetscCall(PetscFinalize());
  return converged ? 0 : 1;
}
