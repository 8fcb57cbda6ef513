static char help[] = "What the error monitor and the error as stopping criterion refuse: each message names the option.\n\n";

#include "dense.h"

static System sys;
static Mat    nest;

/* Options that are refused when they are read, or at the solve */
static PetscErrorCode Refused(const std::string &line, PetscInt reference, PetscErrorCode code, const std::vector<std::string> &parts)
{
  Options options(line);
  KSP     ksp;
  PC      pc;
  Vec     b, y, v;

  PetscFunctionBeginUser;
  Case("%s", line.c_str());
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(KSPSetOperators(ksp, nest, nest));
  PetscCall(MatCreateVecs(nest, &y, &b));
  PetscCall(SetRandom(b, 3));
  if (reference) {
    PetscCall(VecCreateMPI(PETSC_COMM_WORLD, PETSC_DECIDE, reference, &v));
    PetscCall(PCAinsworthSetReference(pc, v));
    PetscCall(VecDestroy(&v));
  }
  PetscCall(CheckError(
    "refused",
    [ksp, b, y]() {
      PetscFunctionBeginUser;
      PetscCall(KSPSetFromOptions(ksp));
      PetscCall(KSPSolve(ksp, b, y));
      PetscFunctionReturn(PETSC_SUCCESS);
    },
    code, parts));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solve that is too short has no estimate */
static PetscErrorCode TooShort()
{
  Options  options("-ainsworth_pc_type jacobi -pc_ainsworth_stop energy_error -ainsworth_ksp_max_it 1");
  KSP      ksp;
  PC       pc;
  Vec      b, y;
  PetscInt iteration;

  PetscFunctionBeginUser;
  Case("a short solve");
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(MatCreateVecs(nest, &y, &b));
  PetscCall(SetRandom(b, 3));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(CheckError("a short solve", [pc, &iteration]() { return PCAinsworthGetErrorEstimate(pc, &iteration, NULL, NULL); }, PETSC_ERR_ARG_WRONGSTATE,
                       {"too short"}));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const Spec        spec;
  const std::string stop = "-ainsworth_pc_type jacobi -pc_ainsworth_stop energy_error ";
  Mat               T;
  int               exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(MatHermitianTranspose(sys.C, MAT_INITIAL_MATRIX, &T));
  PetscCall(NestCreate(sys.A, T, sys.C, NULL, false, &nest));
  for (const char *value : {"0", "1", "-1e-6"})
    PetscCall(Refused(std::string("-pc_ainsworth_error_rtol ") + value, 0, PETSC_ERR_ARG_OUTOFRANGE,
                      {"-pc_ainsworth_error_rtol", *value == '1' ? "less than 1" : "positive"}));
  for (const char *value : {"0", "-2"})
    PetscCall(
      Refused(std::string("-pc_ainsworth_error_eigenvalue ") + value, 0, PETSC_ERR_ARG_OUTOFRANGE, {"-pc_ainsworth_error_eigenvalue", "positive", value}));
  for (const char *value : {"foo", "csvfile", "binary:file"})
    PetscCall(Refused(std::string("-pc_ainsworth_monitor_error ") + value, 0, PETSC_ERR_ARG_WRONG, {"-pc_ainsworth_monitor_error", value, "csv[:file]"}));
  PetscCall(Refused("-ainsworth_pc_type jacobi -pc_ainsworth_monitor_error csv:refused.csv", 7, PETSC_ERR_ARG_SIZ,
                    {"has 7 entries", "29", "24", "-pc_ainsworth_reference"}));
  PetscCall(Refused(stop + "-ainsworth_ksp_type gmres", 0, PETSC_ERR_SUP, {"energy_error", "gmres", "projectedcg"}));
  PetscCall(Refused(stop + "-pc_ainsworth_variant paper -ainsworth_ksp_norm_type unpreconditioned", 0, PETSC_ERR_SUP,
                    {"energy_error", "UNPRECONDITIONED", "-ksp_norm_type natural"}));
  PetscCall(Refused(stop + "-pc_ainsworth_variant paper -ainsworth_ksp_cg_single_reduction", 0, PETSC_ERR_SUP, {"-ksp_cg_single_reduction"}));
  PetscCall(TooShort());
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&T));
  PetscCall(SystemDestroy(&sys));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
