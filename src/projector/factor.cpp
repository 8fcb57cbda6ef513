#include "factor.h"
#include "../objects.h"
#include <petsc/private/petscimpl.h>
#include <string>
#include <vector>
#include <unistd.h>

/*
   The package for many operations, and how many those are: below, PETSc's own factorisation and its solves take less time (docs/gram.md). In complex
   arithmetic, solves with CHOLMOD's factor of a Hermitian matrix are wrong (PETSc 3.18.5)
*/
#if defined(PETSC_HAVE_SUITESPARSE) && !defined(PETSC_USE_COMPLEX)
static const char *const supernodal = MATSOLVERCHOLMOD;
static const PetscReal   many       = 1e7;
#elif defined(PETSC_HAVE_MUMPS)
static const char *const supernodal = MATSOLVERMUMPS;
static const PetscReal   many       = 2e9;
#else
static const char *const supernodal = NULL;
static const PetscReal   many       = PETSC_INFINITY;
#endif

/* So many operations for each entry of the factor that nested dissection is worth its time; as in CHOLMOD */
static const PetscReal dissect = 500.0;

/* The package for a Gram matrix that is not Hermitian, where B is not C: one that pivots, which PETSc's own does not */
#if defined(PETSC_HAVE_MUMPS)
static const char *const pivoting = MATSOLVERMUMPS;
#elif defined(PETSC_HAVE_SUITESPARSE)
static const char *const pivoting   = MATSOLVERUMFPACK;
#else
static const char *const pivoting   = MATSOLVERPETSC;
#endif

/* AinsworthFactorIsPackage - does a PC factor by the package of this name? */
PetscErrorCode AinsworthFactorIsPackage(PC pc, const char name[], PetscBool *is)
{
  PetscBool     factors;
  MatSolverType type = NULL;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &factors, PCCHOLESKY, PCLU, ""));
  if (factors) PetscCall(PCFactorGetMatSolverType(pc, &type));
  *is = PETSC_FALSE;
  if (type) PetscCall(PetscStrcmp(type, name, is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFactorPredictBest - the ordering with the fewest operations of those worth their own time, and its cost; M has a row for each node of bs unknowns

   order: of these rows, to be destroyed
*/
PetscErrorCode AinsworthFactorPredictBest(Mat M, PetscInt bs, AinsworthCost *cost, MatOrderingType *ordering, IS *order)
{
  AinsworthCost dissected;
  IS            other;

  PetscFunctionBegin;
  *ordering = AinsworthOrdering;
  PetscCall(AinsworthFactorPredict(M, *ordering, bs, cost, order));
  if (*ordering == AinsworthDissection || cost->operations < dissect * cost->entries) PetscFunctionReturn(PETSC_SUCCESS);
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
   AinsworthFactorChoose - the factorisation of M, unless the options choose: PETSc's own or, for many operations, that of a package

   Before the options of ksp are read and before it has operators. PETSc's own Cholesky factorisation knows L L^T only: in complex arithmetic it is LU.
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
    factor->package = factor->cost.operations < many ? MATSOLVERPETSC : supernodal;
    PetscCall(PetscStrcmp(factor->package, MATSOLVERCHOLMOD, &cholmod));
    if (cholmod) {
      ordering = AinsworthPredicted;
      PetscCall(AinsworthShare(order, &factor->order));
    }
    if (cholmod || factor->cost.operations < many) PetscCall(PCFactorSetMatOrderingType(pc, ordering));
    PetscCall(ISDestroy(&order));
  }
#if defined(PETSC_HAVE_MUMPS)
  else
    factor->package = MATSOLVERMUMPS;
#endif
  if (factor->package) PetscCall(PCFactorSetMatSolverType(pc, factor->package));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthFactorCheckMemory - collective on comm: refuses, on all ranks, a factor that is predicted to be larger than the memory of the machine */
PetscErrorCode AinsworthFactorCheckMemory(const AinsworthFactor *factor, MPI_Comm comm)
{
  const PetscReal memory   = (PetscReal)sysconf(_SC_PHYS_PAGES) * (PetscReal)sysconf(_SC_PAGESIZE);
  const PetscReal bytes    = factor->cost.entries * (PetscReal)sizeof(PetscScalar);
  PetscReal       worst[2] = {memory > 0.0 && bytes > memory ? bytes : 0.0, -memory};

  PetscFunctionBegin;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, worst, 2, MPIU_REAL, MPIU_MAX, comm));
  PetscCheck(worst[0] == 0.0, comm, PETSC_ERR_MEM,
             "The factor of the Gram matrix C W C' is predicted to take %.3g GiB, of %.3g that the machine has: rows of C share too many unknowns; use an "
             "iterative solver, -ainsworth_gram_ksp_type cg -ainsworth_gram_pc_type icc, or write the constraints so that few rows share an unknown",
             (double)(worst[0] / 1073741824.0), (double)(-worst[1] / 1073741824.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* Options that hold for a while, where they are not given */
struct Defaults {
  PetscObject              object;
  std::vector<std::string> names;

  PetscErrorCode set(const char name[], const char value[])
  {
    PetscBool given;

    PetscFunctionBegin;
    PetscCall(PetscOptionsHasName(object->options, object->prefix, (std::string("-") + name).c_str(), &given));
    if (given) PetscFunctionReturn(PETSC_SUCCESS);
    names.push_back(std::string("-") + (object->prefix ? object->prefix : "") + name);
    PetscCall(PetscOptionsSetValue(object->options, names.back().c_str(), value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscErrorCode clear()
  {
    PetscFunctionBegin;
    for (const std::string &name : names) PetscCall(PetscOptionsClearValue(object->options, name.c_str()));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};
} // namespace

/* Keeps the message of an error that a package raises */
static PetscErrorCode KeepMessage(MPI_Comm, int, const char *, const char *, PetscErrorCode code, PetscErrorType type, const char *message, void *ctx)
{
  if (type == PETSC_ERROR_INITIAL && message) *(std::string *)ctx = message;
  return code;
}

/* Switches the current stage of the log off, if it is on, and with `on` on again: an error leaves events open, which no logger forgives */
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

/*
   AinsworthFactorTryCholmod - setUp() of a solver, with its prefix, that factors by CHOLMOD, whose interface raises an error where the matrix is not
   positive definite: then the solver has to forget the factorisation

   ordered: in the solver's ordering, otherwise CHOLMOD looks for one
*/
PetscErrorCode AinsworthFactorTryCholmod(PetscObject solver, bool ordered, const std::function<PetscErrorCode()> &setUp, PetscBool *indefinite)
{
  std::string    message;
  PetscErrorCode code;
  PetscBool      off = PETSC_FALSE;
  Defaults       defaults{solver, {}};

  PetscFunctionBegin;
  PetscCall(defaults.set("mat_cholmod_print", "0"));                 /* otherwise a line on the standard output where the matrix is not positive definite */
  if (ordered) PetscCall(defaults.set("mat_cholmod_nmethods", "1")); /* it would try its own orderings as well */
  PetscCall(SwitchLog(false, &off));
#if defined(PETSC_USE_DEBUG)
  const PetscStack stack = petscstack; /* which an error leaves as deep as it was */
#endif
  PetscCall(PetscPushErrorHandler(KeepMessage, &message));
  code = setUp();
#if defined(PETSC_USE_DEBUG)
  petscstack = stack;
#endif
  PetscCall(PetscPopErrorHandler());
  PetscCall(SwitchLog(true, &off));
  PetscCall(defaults.clear());
  *indefinite = (PetscBool)(code == PETSC_ERR_MAT_CH_ZRPVT);
  PetscCheck(code == PETSC_SUCCESS || *indefinite, solver->comm, code, "%s", message.c_str());
  if (*indefinite) PetscCall(PetscInfo(solver, "The matrix is not factored: %s\n", message.c_str()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthFactorSetUp - factors M, whose pattern is that of the last time, if there was one */
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
    /* its interface wraps this type in place; of AIJ it makes a copy, which it loses where the factorisation fails */
    PetscCall(MatConvert(M, MATSEQSBAIJ, factor->upper ? MAT_REUSE_MATRIX : MAT_INITIAL_MATRIX, &factor->upper));
    PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
    PetscCall(MatSetOptionsPrefix(factor->upper, prefix)); /* of -mat_cholmod_* */
    PetscCall(MatSetOption(factor->upper, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SPD, PETSC_TRUE));
    PetscCall(KSPSetOperators(ksp, M, factor->upper));
    if (factor->order) PetscCall(AinsworthOrderingAttach(factor->order, factor->upper));
    PetscCall(AinsworthFactorTryCholmod((PetscObject)ksp, factor->order != NULL, [=] { return KSPSetUp(ksp); }, &indefinite));
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

/* AinsworthFactorGetFailedReason - not collective; the same whichever package met the pivot that is not positive */
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
    if (info == -40) *reason = PC_FACTOR_NUMERIC_ZEROPIVOT; /* a negative pivot */
  }
#endif
  if (*reason < 0) *reason = PC_FACTOR_OTHER; /* PC_SETUP_ERROR: ranks agree on the largest */
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

/* AinsworthFactorView - which package and why */
PetscErrorCode AinsworthFactorView(const AinsworthFactor *factor, PetscViewer viewer)
{
  PetscFunctionBegin;
  if (factor->cost.operations > 0.0) {
    char other[64] = "";

    if (supernodal) PetscCall(PetscSNPrintf(other, sizeof(other), ", from %g on it would be %s", (double)many, supernodal));
    PetscCall(PetscViewerASCIIPrintf(viewer, "factored by %s, for %.2g operations predicted%s\n", factor->package, (double)factor->cost.operations,
                                     factor->cost.operations < many ? other : ""));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
