static char help[] = "METIS and LAPACK that fail, a machine without memory, and a PETSc of another version: their "
                     "functions are interposed here, and fail on demand.\n\n";

#include "run.h"
#include <dlfcn.h>
#include <metis.h>
#include <petscblaslapack.h>
#include <unistd.h>

#define TEXT(name)  #name
#define VALUE(name) TEXT(name) /* of a name that is a macro */

static bool failing = false;
static long pages   = 1;

/* The library's own function, which the one of this name below hides */
template <class Function>
static Function *Hidden(Function *, const char name[])
{
  return (Function *)dlsym(RTLD_NEXT, name);
}

int METIS_PartGraphKway(idx_t *n, idx_t *ncon, idx_t *xadj, idx_t *adjncy, idx_t *vwgt, idx_t *vsize, idx_t *adjwgt,
                        idx_t *nparts, real_t *tpwgts, real_t *ubvec, idx_t *options, idx_t *cut, idx_t *part)
{
  if (failing) return METIS_ERROR_MEMORY;
  return Hidden(METIS_PartGraphKway, "METIS_PartGraphKway")(n, ncon, xadj, adjncy, vwgt, vsize, adjwgt, nparts, tpwgts,
                                                            ubvec, options, cut, part);
}

int METIS_NodeND(idx_t *n, idx_t *xadj, idx_t *adjncy, idx_t *vwgt, idx_t *options, idx_t *perm, idx_t *iperm)
{
  if (failing) return METIS_ERROR_MEMORY;
  return Hidden(METIS_NodeND, "METIS_NodeND")(n, xadj, adjncy, vwgt, options, perm, iperm);
}

/* A machine of few pages */
long sysconf(int name) noexcept
{
  return failing && name == _SC_PHYS_PAGES ? pages : Hidden(sysconf, "sysconf")(name);
}

void LAPACKpotrf_(const char *uplo, const PetscBLASInt *n, PetscScalar *a, const PetscBLASInt *lda, PetscBLASInt *info)
{
  if (failing) *info = 1;
  else Hidden(LAPACKpotrf_, VALUE(LAPACKpotrf_))(uplo, n, a, lda, info);
}

PetscErrorCode PetscGetVersionNumber(PetscInt *major, PetscInt *minor, PetscInt *subminor, PetscInt *release)
{
  PetscFunctionBeginUser;
  PetscCall(Hidden(PetscGetVersionNumber, "PetscGetVersionNumber")(major, minor, subminor, release));
  if (failing) ++*minor;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up PCAINSWORTH while a library fails, and expects an error, or none */
static PetscErrorCode SetUp(const System &sys, const std::string &line, PetscErrorCode code,
                            const std::vector<std::string> &parts)
{
  Options options(line);
  Mat     Ct, nest;
  KSP     ksp;

  PetscFunctionBeginUser;
  Case("%s", line.c_str());
  PetscCall(MatHermitianTranspose(sys.C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(NestCreate(sys.A, Ct, sys.C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  failing = true;
  PetscCall(CheckError(
    "set-up", [=]() { return KSPSetUp(ksp); }, code, parts));
  failing = false;
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&Ct));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#if defined(PETSC_HAVE_HYPRE)
static PetscErrorCode NotToBeMade(PC pc)
{
  PetscFunctionBeginUser;
  SETERRQ(PetscObjectComm((PetscObject)pc), PETSC_ERR_PLIB, "PCHYPRE was made");
}

/* PCHYPRE, which starts hypre, is made only where it is used, though it would be the default */
static PetscErrorCode OtherChosen(const System &sys)
{
  Options options("-pc_ainsworth_penalty norm -ainsworth_pc_type jacobi");
  PetscErrorCode (*create)(PC);
  Mat nest;
  KSP ksp;

  PetscFunctionBeginUser;
  Case("another PC than hypre");
  PetscCall(PetscFunctionListFind(PCList, PCHYPRE, &create));
  PetscCall(PCRegister(PCHYPRE, NotToBeMade));
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(CheckError("set-up", [=]() { return KSPSetUp(ksp); }, PETSC_SUCCESS, {}));
  PetscCall(PCRegister(PCHYPRE, create));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#endif

/* Blocks of S that LAPACK calls indefinite: their 1-norms do, and the solve converges */
static PetscErrorCode NotFactored()
{
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -pc_ainsworth_pmat cc");
  Spec        spec;
  System      sys;
  DenseSystem d;
  Mat         nest;
  KSP         ksp;

  PetscFunctionBeginUser;
  Case("a block that is not positive definite");
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(LayoutCreate(sys, Layout(), &nest));
  PetscCall(SolverCreate(nest, &ksp));
  failing = true;
  PetscCall(KSPSetUp(ksp));
  failing = false;
  PetscCall(CheckSolution(ksp, sys, d, false, false, 1e-10));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Two dense components of S, on two ranks where there are as many: the machine has memory for the factor of one of them
*/
static PetscErrorCode TwoFactors()
{
  const int   rows = 60;
  DenseSystem d;
  System      sys;

  PetscFunctionBeginUser;
  d.A = Dense::Identity(2 * rows + 2, 2 * rows + 2);
  d.C = Dense::Zero(2 * rows, 2 * rows + 2);
  d.C.leftCols(2 * rows).setIdentity();
  for (int i = 0; i < 2 * rows; i++) d.C(i, 2 * rows + i / rows) = -1.0;
  d.f = Column::Zero(2 * rows + 2);
  d.g = Column::Zero(2 * rows);
  PetscCall(SystemFromDense(d, false, &sys));
  pages = PetscDefined(USE_COMPLEX) ? 10 : 5;
  PetscCall(SetUp(sys,
                  "-ainsworth_pc_type jacobi -pc_ainsworth_pmat id -pc_ainsworth_rows_per_rank " + std::to_string(rows),
                  PETSC_ERR_MEM, {"is predicted to take"}));
  pages = 1;
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Spec        spec, wide;
  System      sys, sparse;
  PetscMPIInt size;
  int         exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  failing = true;
  Case("another PETSc");
  PetscCall(CheckError(
    "initialization", []() { return AinsworthInitializePackage(); }, PETSC_ERR_SUP_SYS,
    {"compiled for PETSc " + std::to_string(PETSC_VERSION_MAJOR) + "." + std::to_string(PETSC_VERSION_MINOR),
     "runs with PETSc " + std::to_string(PETSC_VERSION_MAJOR) + "." + std::to_string(PETSC_VERSION_MINOR + 1),
     "compile ainsworth again"}));
  failing = false;
  PetscCall(AinsworthInitializePackage());
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(SetUp(sys, "-ainsworth_pc_type jacobi -pc_ainsworth_pmat bj_cc -pc_ainsworth_blocks 2", PETSC_ERR_LIB,
                  {"METIS_PartGraphKway() returned -3"}));
#if defined(PETSC_HAVE_HYPRE)
  PetscCall(OtherChosen(sys));
#endif
  wide.n = 400;
  wide.m = 250;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, wide, &sparse));
  PetscCall(SetUp(sparse, "-ainsworth_pc_type jacobi", PETSC_ERR_MEM,
                  {"is predicted to take", "share too many unknowns", "-ainsworth_gram_ksp_type cg"}));
  if (size == 1)
    PetscCall(SetUp(
      sparse,
      PetscDefined(USE_COMPLEX)
        ? "-ainsworth_pc_type jacobi -ainsworth_gram_pc_type lu -ainsworth_gram_pc_factor_mat_ordering_type ainsworthnd"
        : "-ainsworth_pc_type jacobi -ainsworth_gram_pc_type cholesky -ainsworth_gram_pc_factor_mat_ordering_type "
          "ainsworthnd",
      PETSC_SUCCESS, {})); /* by PETSc's nested dissection */
  PetscCall(SystemDestroy(&sparse));
  PetscCall(TwoFactors());
  PetscCall(NotFactored());
  PetscCall(SystemDestroy(&sys));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
