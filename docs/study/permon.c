static char help[] = "Hertz' sphere at one approach by PERMON: the least energy of all displacements with C u <= g, by "
                     "its dual, minimized by MPGP.\n\n";

/*
   Reads what `build/tutorials/peers -write file` wrote, and prints a line as that program does. PERMON v3.18.0 with
   PETSc 3.18, built with one rule of its makefile, clean, renamed:

     git clone -b v3.18.0 https://github.com/permon/permon && make -C permon PERMON_DIR=$PWD/permon
     mpicc -I permon/include $(pkg-config --cflags PETSc) docs/study/permon.c -o permon_peer \
       -L permon/lib -lpermon $(pkg-config --libs PETSc) -Wl,-rpath,$PWD/permon/lib
     ./permon_peer -file hertz.dat -dual_mat_inv_pc_factor_mat_solver_type mumps -qps_rtol 1e-8 -qps_max_it 10000
*/
#include <permonqps.h>
#include <sys/resource.h>

static double Processor(void)
{
  struct rusage use;

  getrusage(RUSAGE_SELF, &use);
  return (double)use.ru_utime.tv_sec + (double)use.ru_stime.tv_sec +
         1e-6 * (double)(use.ru_utime.tv_usec + use.ru_stime.tv_usec);
}

/* v' A v */
static PetscErrorCode Energy(Mat A, Vec v, PetscReal *energy)
{
  Vec         Av;
  PetscScalar dot;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(v, &Av));
  PetscCall(MatMult(A, v, Av));
  PetscCall(VecDot(Av, v, &dot));
  *energy = PetscRealPart(dot);
  PetscCall(VecDestroy(&Av));
  PetscFunctionReturn(0);
}

/* The solution by PERMON, iterations of the dual method, and whether it says that this is one */
static PetscErrorCode Solve(Mat A, Mat C, Vec g, Vec u, PetscInt *iterations, PetscBool *converged)
{
  Vec none;
  QP  qp;
  QPS qps;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(u, &none));
  PetscCall(VecSet(none, 0.0));
  PetscCall(VecSet(u, 0.0));
  PetscCall(MatSetOption(A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(A, MAT_SPD, PETSC_TRUE));
  PetscCall(QPCreate(PetscObjectComm((PetscObject)A), &qp));
  PetscCall(QPSetOperator(qp, A));
  PetscCall(QPSetRhs(qp, none));
  PetscCall(QPSetInitialVector(qp, u));
  PetscCall(QPSetIneq(qp, C, g));
  PetscCall(QPTDualize(qp, MAT_INV_MONOLITHIC, MAT_REG_NONE));
  PetscCall(QPSetFromOptions(qp));
  PetscCall(QPSCreate(PetscObjectComm((PetscObject)A), &qps));
  PetscCall(QPSSetQP(qps, qp));
  PetscCall(QPSSetFromOptions(qps));
  PetscCall(QPSSolve(qps));
  PetscCall(QPIsSolved(qp, converged));
  PetscCall(QPSGetIterationNumber(qps, iterations));
  PetscCall(QPSDestroy(&qps));
  PetscCall(QPDestroy(&qp));
  PetscCall(VecDestroy(&none));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  char        file[PETSC_MAX_PATH_LEN] = "";
  Mat         A, C;
  Vec         g, exact, u, gap;
  PetscInt    iterations, n;
  PetscReal   error[2], depth;
  PetscBool   converged;
  PetscViewer viewer;
  double      cpu;

  PetscFunctionBeginUser;
  PetscCall(PermonInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-file", file, sizeof(file), NULL));
  PetscCall(PetscViewerCreate(PETSC_COMM_WORLD, &viewer));
  PetscCall(PetscViewerSetType(viewer, PETSCVIEWERBINARY));
  PetscCall(PetscViewerBinarySetSkipInfo(viewer, PETSC_TRUE)); /* one block size for all of them */
  PetscCall(PetscViewerFileSetMode(viewer, FILE_MODE_READ));
  PetscCall(PetscViewerFileSetName(viewer, file));
  PetscCall(MatCreate(PETSC_COMM_WORLD, &A));
  PetscCall(MatLoad(A, viewer));
  PetscCall(MatCreate(PETSC_COMM_WORLD, &C));
  PetscCall(MatLoad(C, viewer));
  PetscCall(VecCreate(PETSC_COMM_WORLD, &g));
  PetscCall(VecLoad(g, viewer));
  PetscCall(VecCreate(PETSC_COMM_WORLD, &exact));
  PetscCall(VecLoad(exact, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(VecDuplicate(exact, &u));
  PetscCall(VecDuplicate(g, &gap));
  cpu = Processor();
  PetscCall(Solve(A, C, g, u, &iterations, &converged));
  cpu = Processor() - cpu;
  PetscCall(MatMult(C, u, gap));
  PetscCall(VecAYPX(gap, -1.0, g));
  PetscCall(VecMin(gap, NULL, &depth));
  PetscCall(Energy(A, exact, &error[1]));
  PetscCall(VecAXPY(u, -1.0, exact));
  PetscCall(Energy(A, u, &error[0]));
  PetscCall(MatGetSize(A, &n, NULL));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "peer: method=permon unknowns=%" PetscInt_FMT " converged=%d iterations=%" PetscInt_FMT
                        " error=%.2e overlap=%.2e cpu_s=%.3f\n",
                        n, (int)converged, iterations, (double)PetscSqrtReal(PetscMax(0.0, error[0]) / error[1]),
                        (double)PetscMax(0.0, -depth), cpu));
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&C));
  PetscCall(VecDestroy(&g));
  PetscCall(VecDestroy(&exact));
  PetscCall(VecDestroy(&u));
  PetscCall(VecDestroy(&gap));
  PetscCall(PermonFinalize());
  return 0;
}
