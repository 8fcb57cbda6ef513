static char help[] = "Two elastic cubes in contact, solved as a saddle-point system by whatever solver the options choose.\n\n";

#include "cubes.h"
#include "report.h"

/* How the rows of A and C are spread over the ranks (table 2 of the paper) */
static PetscErrorCode ViewDistribution(const CubesSystem &s)
{
  const Mat         matrix[2] = {s.A, s.C};
  const char *const name[2]   = {"A", "C"};
  PetscMPIInt       size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(s.mesh.comm, &size));
  for (int i = 0; i < 2; i++) {
    PetscInt rows, local[3], least, sum[2];

    PetscCall(MatGetLocalSize(matrix[i], &rows, NULL));
    local[0] = rows ? rows : PETSC_MAX_INT;
    local[1] = rows;
    local[2] = rows > 0;
    PetscCallMPI(MPI_Allreduce(&local[0], &least, 1, MPIU_INT, MPI_MIN, s.mesh.comm));
    PetscCallMPI(MPI_Allreduce(&local[1], &sum[0], 1, MPIU_INT, MPI_MAX, s.mesh.comm));
    PetscCallMPI(MPI_Allreduce(&local[2], &sum[1], 1, MPIU_INT, MPI_SUM, s.mesh.comm));
    PetscCall(PetscPrintf(s.mesh.comm, "distribution: %s has %" PetscInt_FMT " to %" PetscInt_FMT " rows on %" PetscInt_FMT " of %d ranks\n", name[i],
                          sum[1] ? least : 0, sum[0], sum[1], (int)size));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  PetscBool      write, view, distribution = PETSC_FALSE;
  CubesOptions   options;
  CubesSystem    system;
  SaddleSolution solution;
  bool           converged;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(CubesOptionsGet(PETSC_COMM_WORLD, &options));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "Output of the two-cube problem", NULL);
  PetscCall(PetscOptionsString("-write_system", "Write A, C, f, g and the coordinates X in PETSc's binary format to <prefix>_A.dat and so on", NULL, "", prefix,
                               sizeof(prefix), &write));
  PetscCall(PetscOptionsString("-view_vtu", "Write the deformed bodies for ParaView to this file (.vtu)", NULL, "", vtu, sizeof(vtu), &view));
  PetscCall(PetscOptionsBool("-view_distribution", "Print how the rows of A and C are spread over the ranks", NULL, distribution, &distribution, NULL));
  PetscOptionsEnd();
  PetscCall(CubesSystemCreate(PETSC_COMM_WORLD, options, &system));
  if (distribution) PetscCall(ViewDistribution(system));
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
