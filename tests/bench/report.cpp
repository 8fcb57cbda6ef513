/* The line that every tutorial ends with: size, time, and the residuals of the original blocks */
#include "report.h"
#include <sys/resource.h>

/* ||f - A x - B' lambda||_2 / ||f||_2, absolute where f = 0 */
static PetscErrorCode PrimalResidual(const SaddleBlocks &s, Vec f, Vec x, Vec lambda, PetscReal *residual)
{
  PetscReal norm;
  Vec       r, t;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(f, &r));
  PetscCall(VecDuplicate(f, &t));
  PetscCall(MatMult(s.A, x, r));
  PetscCall(MatMultHermitianTranspose(s.B ? s.B : s.C, lambda, t));
  PetscCall(VecAXPY(r, 1.0, t));
  PetscCall(VecAYPX(r, -1.0, f));
  PetscCall(VecNorm(r, NORM_2, residual));
  PetscCall(VecNorm(f, NORM_2, &norm));
  if (norm > 0) *residual /= norm;
  PetscCall(VecDestroy(&r));
  PetscCall(VecDestroy(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ||C x - D lambda - g||_inf / (1 + ||g||_inf) */
static PetscErrorCode ConstraintResidual(const SaddleBlocks &s, Vec g, Vec x, Vec lambda, PetscReal *residual)
{
  PetscReal norm;
  PetscInt  rows;
  Vec       r;

  PetscFunctionBeginUser;
  *residual = 0;
  PetscCall(VecGetSize(g, &rows));
  if (!rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(g, &r));
  PetscCall(MatMult(s.C, x, r));
  PetscCall(VecAXPY(r, -1.0, g));
  if (s.D) {
    Vec compliance;

    PetscCall(VecDuplicate(g, &compliance));
    PetscCall(MatMult(s.D, lambda, compliance));
    PetscCall(VecAXPY(r, -1.0, compliance));
    PetscCall(VecDestroy(&compliance));
  }
  PetscCall(VecNorm(r, NORM_INFINITY, residual));
  PetscCall(VecNorm(g, NORM_INFINITY, &norm));
  *residual /= 1 + norm;
  PetscCall(VecDestroy(&r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "nan" whatever the sign and the kind */
static PetscErrorCode Print(PetscReal value, char text[], size_t length)
{
  PetscFunctionBeginUser;
  if (PetscIsInfOrNanReal(value)) PetscCall(PetscStrncpy(text, "nan", length));
  else PetscCall(PetscSNPrintf(text, length, "%.3e", (double)value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReportResiduals(const SaddleBlocks &s, Vec f, Vec g, Vec x, Vec lambda, PetscReal residuals[2])
{
  PetscFunctionBeginUser;
  PetscCall(PrimalResidual(s, f, x, lambda, &residuals[0]));
  PetscCall(ConstraintResidual(s, g, x, lambda, &residuals[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

ReportUsage ReportGetUsage()
{
  struct rusage usage;

  getrusage(RUSAGE_SELF, &usage);
  return {(double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
            1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec),
          (double)usage.ru_minflt, 1024.0 * (double)usage.ru_maxrss};
}

/* With -memory: what set-up and solve took on all ranks, beside the bytes of A */
static PetscErrorCode ReportMemory(Mat A, const SaddleSolution &s)
{
  double    all[3] = {s.setupPages, s.solvePages, s.peak};
  PetscBool wanted = PETSC_FALSE;
  MatInfo   info;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-memory", &wanted, NULL));
  if (!wanted) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, all, 3, MPI_DOUBLE, MPI_SUM, PetscObjectComm((PetscObject)A)));
  PetscCall(MatGetInfo(A, MAT_GLOBAL_SUM, &info));
  PetscCall(PetscPrintf(PetscObjectComm((PetscObject)A),
                        "memory: matrix_MiB=%.1f setup_pages_MiB=%.1f solve_pages_MiB=%.1f peak_MiB=%.1f\n",
                        info.nz_used * (sizeof(PetscScalar) + sizeof(PetscInt)) / 1048576, all[0] * 4096 / 1048576,
                        all[1] * 4096 / 1048576, all[2] / 1048576));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReportSolution(const SaddleBlocks &blocks, Vec f, Vec g, const SaddleSolution &s)
{
  MPI_Comm  comm = PetscObjectComm((PetscObject)blocks.A);
  PetscReal primal, constraint, error = 0;
  PetscInt  n, m;
  char      text[2][32];

  PetscFunctionBeginUser;
  PetscCall(MatGetSize(blocks.C, &m, &n));
  PetscCall(PrimalResidual(blocks, f, s.x, s.lambda, &primal));
  PetscCall(ConstraintResidual(blocks, g, s.x, s.lambda, &constraint));
  /* the infinity norm may lose a nan */
  PetscCall(VecNorm(s.x, NORM_2, &error));
  if (PetscIsInfOrNanReal(error)) constraint = error;
  PetscCall(Print(primal, text[0], sizeof(text[0])));
  PetscCall(Print(constraint, text[1], sizeof(text[1])));
  if (s.reason <= 0)
    PetscCall(PetscPrintf(comm, "not converged: %s after %" PetscInt_FMT " iterations\n", KSPConvergedReasons[s.reason],
                          s.iterations));
  PetscCall(PetscPrintf(comm,
                        "result: unknowns=%" PetscInt_FMT " constraints=%" PetscInt_FMT
                        " setup_s=%.3f solve_s=%.3f primal_residual=%s constraint_residual=%s\n",
                        n, m, (double)s.setupSeconds, (double)s.solveSeconds, text[0], text[1]));
  PetscCall(ReportMemory(blocks.A, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Of the inner solver where there is one: the plugin is not linked, but if it is loaded PETSc knows where its functions
   are
*/
PetscErrorCode ReportIterations(KSP ksp, PetscInt *iterations)
{
  PetscErrorCode (*getInner)(PC, KSP *) = NULL;
  PetscBool ours;
  PC        pc;
  KSP       inner = ksp;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, "ainsworth", &ours));
  if (ours)
    PetscCall(PetscDLLibrarySym(PetscObjectComm((PetscObject)ksp), &PetscDLLibrariesLoaded, NULL, "PCAinsworthGetKSP",
                                (void **)&getInner));
  if (getInner) PetscCall((*getInner)(pc, &inner));
  PetscCall(KSPGetIterationNumber(inner, iterations));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReportCount(SNES snes, PetscInt step, PetscReal, void *ctx)
{
  PetscInt iterations = 0;
  KSP      ksp;

  PetscFunctionBeginUser;
  PetscCall(SNESGetKSP(snes, &ksp));
  if (step) PetscCall(ReportIterations(ksp, &iterations));
  *(PetscInt *)ctx += iterations;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReportForget(SNES snes, PetscInt)
{
  KSP ksp;
  PC  pc;

  PetscFunctionBeginUser;
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPReset(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCNONE));
  PetscCall(KSPSetFromOptions(ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}
