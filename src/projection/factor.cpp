#include "factor.h"
#include "../base/defaults.h"
#include "../base/objects.h"
#include <new>
#include <unistd.h>

/*
   The package for factorizations of at least `crossover` operations; below, PETSc's own factorization and its solves
   are faster (docs/cost.md)

   In complex arithmetic, solves with CHOLMOD's factor of a Hermitian matrix are wrong (PETSc 3.18.5).
*/
#if defined(PETSC_HAVE_SUITESPARSE) && !defined(PETSC_USE_COMPLEX)
static const char *const supernodal = MATSOLVERCHOLMOD;
static const PetscReal   crossover  = 1e7;
#elif defined(PETSC_HAVE_MUMPS)
static const char *const supernodal = MATSOLVERMUMPS;
static const PetscReal   crossover  = 2e9;
#else
static const char *const supernodal = NULL;
static const PetscReal   crossover  = PETSC_INFINITY;
#endif

/* Operations per entry of the factor above which nested dissection pays off; the same value as in CHOLMOD */
static const PetscReal dissect = 500.0;

/*
   The package for a Gram matrix that is not Hermitian, which needs pivoting; PETSc's own factorization does not pivot
*/
#if defined(PETSC_HAVE_MUMPS)
static const char *const pivoting = MATSOLVERMUMPS;
#elif defined(PETSC_HAVE_SUITESPARSE)
static const char *const pivoting   = MATSOLVERUMFPACK;
#else
static const char *const pivoting   = MATSOLVERPETSC;
#endif

/* AinsworthFactorIsPackage - checks whether a PC factors with the package of this name */
PetscErrorCode AinsworthFactorIsPackage(PC pc, const char name[], PetscBool *is)
{
  PetscBool     factors;
  MatSolverType type = NULL;

  PetscFunctionBegin;
  *is = PETSC_FALSE;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &factors, PCCHOLESKY, PCLU, ""));
  if (factors) PetscCall(PCFactorGetMatSolverType(pc, &type));
  if (type) PetscCall(PetscStrcmp(type, name, is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFactorPredictBest - finds the ordering with the fewest operations, of those worth their own time, and its
   cost

   M has one row for each node of bs unknowns. order: of these rows, to be destroyed by the caller.
*/
PetscErrorCode AinsworthFactorPredictBest(Mat M, PetscInt bs, AinsworthCost *cost, MatOrderingType *ordering, IS *order)
{
  AinsworthCost dissected;
  IS            other;

  PetscFunctionBegin;
  *ordering = AinsworthOrdering;
  PetscCall(AinsworthFactorPredict(M, *ordering, bs, cost, order));
  if (*ordering == AinsworthDissection || cost->operations < dissect * cost->entries)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthFactorPredict(M, AinsworthDissection, bs, &dissected, &other));
  if (dissected.operations < cost->operations) {
    *ordering = AinsworthDissection;
    *cost     = dissected;
    std::swap(*order, other);
  }
  PetscCall(ISDestroy(&other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFactorChoose - chooses the factorization of M unless the options do: PETSc's own or, for many operations,
   that of a package

   To be called before ksp reads its options and gets its operators. In complex arithmetic PETSc's own Cholesky
   factorization computes L L^T, so LU is used.
*/
PetscErrorCode AinsworthFactorChoose(AinsworthFactor *factor, Mat M, PetscBool hermitian, KSP ksp)
{
  const char *const given[] = {"-pc_type", "-pc_factor_mat_solver_type", "-pc_factor_mat_ordering_type"};
  const char       *prefix;
  PetscBool         has, sequential, cholmod;
  MatOrderingType   ordering;
  IS                order;
  PC                pc;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PetscDefined(USE_COMPLEX) || !hermitian ? PCLU : PCCHOLESKY));
  PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
  for (const char *name : given) {
    PetscCall(PetscOptionsHasName(NULL, prefix, name, &has));
    if (has) PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)M, MATSEQAIJ, &sequential));
  if (!hermitian) factor->package = pivoting;
  else if (sequential) {
    PetscCall(AinsworthFactorPredictBest(M, 1, &factor->cost, &ordering, &order));
    factor->package = factor->cost.operations < crossover ? MATSOLVERPETSC : supernodal;
    PetscCall(PetscStrcmp(factor->package, MATSOLVERCHOLMOD, &cholmod));
    if (cholmod) {
      ordering = AinsworthPredicted;
      PetscCall(AinsworthShare(order, &factor->order));
    }
    if (cholmod || factor->cost.operations < crossover) PetscCall(PCFactorSetMatOrderingType(pc, ordering));
    PetscCall(ISDestroy(&order));
  }
#if defined(PETSC_HAVE_MUMPS)
  else
    factor->package = MATSOLVERMUMPS;
#endif
  if (factor->package) PetscCall(PCFactorSetMatSolverType(pc, factor->package));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFactorCheckMemory - raises an error on all ranks of comm if the factors of a machine are predicted to exceed
   its memory. Collective on comm
*/
PetscErrorCode AinsworthFactorCheckMemory(const AinsworthFactor *factor, MPI_Comm comm)
{
  const PetscReal memory = (PetscReal)sysconf(_SC_PHYS_PAGES) * (PetscReal)sysconf(_SC_PAGESIZE);
  PetscReal       bytes  = factor->cost.entries * (PetscReal)sizeof(PetscScalar), all, least, worst;
  MPI_Comm        machine;

  PetscFunctionBegin;
  PetscCall(MPIU_Allreduce(&bytes, &all, 1, MPIU_REAL, MPIU_SUM, comm));
  PetscCall(MPIU_Allreduce(&memory, &least, 1, MPIU_REAL, MPIU_MIN, comm));
  if (all <= least) PetscFunctionReturn(PETSC_SUCCESS); /* as a rule: the communicator is not split */
  PetscCallMPI(MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &bytes, 1, MPIU_REAL, MPIU_SUM, machine));
  PetscCallMPI(MPI_Comm_free(&machine));
  worst = memory > 0.0 && bytes > memory ? bytes : 0.0;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &worst, 1, MPIU_REAL, MPIU_MAX, comm));
  PetscCheck(worst == 0.0, comm, PETSC_ERR_MEM,
             "The factor of the Gram matrix C W C' is predicted to take %.3g GiB, of %.3g that the machine has: rows "
             "of C share too many unknowns; use an "
             "iterative solver, -ainsworth_gram_ksp_type cg -ainsworth_gram_pc_type icc, or write the constraints so "
             "that few rows share an unknown",
             (double)(worst / 1073741824.0), (double)(least / 1073741824.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   An error handler that keeps the message of the initial error, unless there is no memory for it: an exception must not
   cross PETSc's frames
*/
static PetscErrorCode KeepMessage(MPI_Comm, int, const char *, const char *, PetscErrorCode code, PetscErrorType type,
                                  const char *message, void *ctx)
{
  try {
    if (type == PETSC_ERROR_INITIAL && message) *(std::string *)ctx = message;
  } catch (const std::bad_alloc &) {
  }
  return code;
}

/*
   Deactivates the current log stage if it is active, or with `on` reactivates it: an error leaves events open, which
   the log does not tolerate
*/
static PetscErrorCode SwitchLog(bool on, PetscBool *off)
{
  PetscFunctionBegin;
#if defined(PETSC_USE_LOG)
  PetscBool     active;
  PetscLogStage stage;

  PetscCall(PetscLogIsActive(&active));
  if (!active) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthLogGetStage(&stage));
  if (!on) PetscCall(PetscLogStageGetActive(stage, off));
  if (*off) PetscCall(PetscLogStageSetActive(stage, on ? PETSC_TRUE : PETSC_FALSE));
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthFactorTry - calls setUp() and catches the error that it raises, if any */
PetscErrorCode AinsworthFactorTry(const std::function<PetscErrorCode()> &setUp, PetscErrorCode *code,
                                  std::string *message)
{
  PetscFunctionBegin;
#if defined(PETSC_USE_DEBUG)
  const PetscStack stack = petscstack; /* an error does not pop it */
#endif
  PetscCall(PetscPushErrorHandler(KeepMessage, message));
  *code = setUp();
#if defined(PETSC_USE_DEBUG)
  petscstack = stack;
#endif
  PetscCall(PetscPopErrorHandler());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFactorTryUnlogged - calls setUp(), which may raise an error in the middle of an event, and catches the error
*/
PetscErrorCode AinsworthFactorTryUnlogged(const std::function<PetscErrorCode()> &setUp, PetscErrorCode *code,
                                          std::string *message)
{
  PetscBool off = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(SwitchLog(false, &off));
  PetscCall(AinsworthFactorTry(setUp, code, message));
  PetscCall(SwitchLog(true, &off));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFactorTryCholmod - calls setUp() of a solver that factors with CHOLMOD, and catches the error that it raises
   if the matrix is not positive definite

   Then *indefinite is true, and the caller has to discard the factorization. ordered: use the ordering of the solver;
   otherwise CHOLMOD finds one.
*/
PetscErrorCode AinsworthFactorTryCholmod(PetscObject solver, bool ordered, const std::function<PetscErrorCode()> &setUp,
                                         PetscBool *indefinite)
{
  std::string       message;
  PetscErrorCode    code;
  AinsworthDefaults defaults{solver, {}};

  PetscFunctionBegin;
  /* otherwise CHOLMOD prints a line if the matrix is not positive definite */
  PetscCall(defaults.set("mat_cholmod_print", "0"));
  /* otherwise CHOLMOD tries its own orderings as well */
  if (ordered) PetscCall(defaults.set("mat_cholmod_nmethods", "1"));
  PetscCall(AinsworthFactorTryUnlogged(setUp, &code, &message));
  PetscCall(defaults.clear());
  *indefinite = (PetscBool)(code == PETSC_ERR_MAT_CH_ZRPVT);
  PetscCheck(code == PETSC_SUCCESS || *indefinite, PetscObjectComm(solver), code, "%s", message.c_str());
  if (*indefinite) PetscCall(PetscInfo(solver, "The matrix is not factored: %s\n", message.c_str()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthFactorSetUp - factors M, whose pattern has not changed since the last call, if there was one */
PetscErrorCode AinsworthFactorSetUp(AinsworthFactor *factor, Mat M, KSP ksp)
{
  PetscBool   cholmod, indefinite;
  const char *prefix;
  PC          pc;

  PetscFunctionBegin;
  factor->failed = PC_NOERROR;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(AinsworthFactorIsPackage(pc, MATSOLVERCHOLMOD, &cholmod));
  if (cholmod) {
    /*
       PETSc's interface to CHOLMOD wraps SBAIJ in place; AIJ would be copied, and the copy leaks if the factorization
       fails
    */
    PetscCall(MatConvert(M, MATSEQSBAIJ, factor->upper ? MAT_REUSE_MATRIX : MAT_INITIAL_MATRIX, &factor->upper));
    PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
    PetscCall(MatSetOptionsPrefix(factor->upper, prefix)); /* for -mat_cholmod_* */
    PetscCall(MatSetOption(factor->upper, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SPD, PETSC_TRUE));
    PetscCall(KSPSetOperators(ksp, M, factor->upper));
    if (factor->order) PetscCall(AinsworthOrderingAttach(factor->order, factor->upper));
    PetscCall(
      AinsworthFactorTryCholmod((PetscObject)ksp, factor->order != NULL, [=] { return KSPSetUp(ksp); }, &indefinite));
    if (indefinite) {
      factor->failed = PC_FACTOR_NUMERIC_ZEROPIVOT;
      PetscCall(KSPReset(ksp));
    }
  } else {
    PetscCall(KSPSetOperators(ksp, M, M));
    PetscCall(KSPSetUp(ksp));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFactorGetFailedReason - gets the reason of a failure, the same for all packages if a pivot is not positive.
   Not collective
*/
PetscErrorCode AinsworthFactorGetFailedReason(const AinsworthFactor *factor, KSP ksp, PCFailedReason *reason)
{
  PC        pc;
  PetscBool mumps;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetFailedReason(pc, reason));
  if (factor->failed) *reason = factor->failed;
  PetscCall(AinsworthFactorIsPackage(pc, MATSOLVERMUMPS, &mumps));
#if defined(PETSC_HAVE_MUMPS)
  if (mumps && *reason == PC_FACTOR_OTHER) {
    Mat      F;
    PetscInt info;

    PetscCall(PCFactorGetMatrix(pc, &F));
    PetscCall(MatMumpsGetInfog(F, 1, &info));
    if (info == -40) *reason = PC_FACTOR_NUMERIC_ZEROPIVOT; /* MUMPS met a negative pivot */
  }
#endif
  /* PC_SETUP_ERROR: ranks take the maximum, which a negative reason would lose */
  if (*reason < 0) *reason = PC_FACTOR_OTHER;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthFactorReset(AinsworthFactor *factor)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&factor->upper));
  PetscCall(ISDestroy(&factor->order));
  *factor = AinsworthFactor();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthFactorView - prints the package and the predicted cost that led to it */
PetscErrorCode AinsworthFactorView(const AinsworthFactor *factor, PetscViewer viewer)
{
  PetscFunctionBegin;
  if (factor->cost.operations > 0.0) {
    char other[64] = "";

    if (supernodal)
      PetscCall(PetscSNPrintf(other, sizeof(other), ", from %g on it would be %s", (double)crossover, supernodal));
    PetscCall(PetscViewerASCIIPrintf(viewer, "factored by %s, for %.2g operations predicted%s\n", factor->package,
                                     (double)factor->cost.operations,
                                     factor->cost.operations < crossover ? other : ""));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
