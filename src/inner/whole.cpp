/* The whole system, factored: package, its defaults, its failures, and solves with the factor */
#include "whole.h"
#include "../base/defaults.h"
#include "../base/layouts.h"
#include "../projection/factor.h"
#include <algorithm>
#include <cstring>

/*
   K is kept with its factor: the interfaces to MUMPS and UMFPACK read its arrays in their solves, and options may ask
   for iterations
*/
struct AinsworthWhole {
  KSP  ksp       = NULL; /* has S K S and its factor */
  Vec  scale     = NULL; /* S, with the layout of K */
  Vec  rhs       = NULL; /* work vectors */
  Vec  solution  = NULL;
  bool symmetric = false; /* K = K' */
  bool forward   = false; /* solves with the transpose are wrong */
};

namespace
{
/* What factors K: a PC, its package, and whether each rank gathers all of K and does the same as the others */
struct Choice {
  char      type[64] = PCLU, package[64] = MATSOLVERPETSC;
  PetscBool redundant = PETSC_FALSE;

  bool           is(const char name[]) const { return !strcmp(package, name); }
  PetscErrorCode make(KSP, bool);
  PetscErrorCode setDefaults(PetscInt, AinsworthDefaults *) const;
};

/*
   Chooses what pivots, as K is indefinite; options come first. In complex arithmetic no package has L D L^H with
   pivoting
*/
PetscErrorCode Choice::make(KSP ksp, bool symmetric)
{
  PetscOptions options;
  const char  *prefix;
  PetscMPIInt  size;
  PetscBool    given, typed, sequential = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetOptions((PetscObject)ksp, &options));
  PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)ksp), &size));
#if defined(PETSC_HAVE_MUMPS)
  PetscCall(PetscStrncpy(package, MATSOLVERMUMPS, sizeof(package)));
#else
  #if defined(PETSC_HAVE_SUITESPARSE)
  PetscCall(PetscStrncpy(package, MATSOLVERUMFPACK, sizeof(package)));
  #endif
  #if defined(PETSC_HAVE_SUPERLU_DIST)
  if (size > 1) PetscCall(PetscStrncpy(package, MATSOLVERSUPERLU_DIST, sizeof(package)));
  #else
  sequential = (PetscBool)(size > 1);
  #endif
#endif
  PetscCall(PetscOptionsHasName(options, prefix, "-pc_factor_mat_solver_type", &given));
  if (sequential && !given) PetscCall(PetscStrncpy(type, PCREDUNDANT, sizeof(type)));
  PetscCall(PetscOptionsGetString(options, prefix, "-pc_type", type, sizeof(type), &typed));
  PetscCall(PetscStrcmp(type, PCREDUNDANT, &redundant));
  if (sequential && !redundant) package[0] = '\0'; /* PETSc finds one for these ranks, or says that it has none */
  PetscCall(PetscOptionsGetString(options, prefix,
                                  redundant ? "-redundant_pc_factor_mat_solver_type" : "-pc_factor_mat_solver_type",
                                  package, sizeof(package), NULL));
  if (!typed && !redundant && is(MATSOLVERMUMPS) && symmetric && !PetscDefined(USE_COMPLEX))
    PetscCall(PetscStrncpy(type, PCCHOLESKY, sizeof(type)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets our defaults for n unknowns. The others do not pivot in the process: they get nonzero diagonals, or replace tiny
   pivots

   MUMPS gets room for delayed pivots, in percent of its estimate, at once: that of a small system is a few numbers, of
   which delays may take a multiple
*/
PetscErrorCode Choice::setDefaults(PetscInt n, AinsworthDefaults *defaults) const
{
  const std::string inner = redundant ? "redundant_" : "", room = std::to_string(80 + 1000000 / PetscMax(n, 100));

  PetscFunctionBegin;
  if (package[0]) PetscCall(defaults->set((inner + "pc_factor_mat_solver_type").c_str(), package));
  PetscCall(defaults->set((inner + "mat_mumps_icntl_14").c_str(), room.c_str()));
  PetscCall(defaults->set((inner + "mat_superlu_dist_replacetinypivot").c_str(), "1"));
  if (!is(MATSOLVERPETSC)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(defaults->set((inner + "pc_factor_shift_type").c_str(), "nonzero"));
  PetscCall(defaults->set((inner + "pc_factor_mat_ordering_type").c_str(), MATORDERINGND));
  PetscCall(defaults->set((inner + "pc_factor_nonzeros_along_diagonal").c_str(), "1e-10"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

/* Factors K, and gives the reason of a failure, if any; on one rank some packages raise an error instead */
static PetscErrorCode Factor(KSP ksp, const Choice &choice, PCFailedReason *reason)
{
  const PetscErrorCode expected[] = {PETSC_ERR_MEM, PETSC_ERR_LIB, PETSC_ERR_MAT_LU_ZRPVT, PETSC_ERR_MAT_CH_ZRPVT};
  MPI_Comm             comm       = PetscObjectComm((PetscObject)ksp);
  AinsworthDefaults    defaults{(PetscObject)ksp, {}};
  PetscErrorCode       code = PETSC_SUCCESS;
  std::string          message;
  PetscMPIInt          size, worst;
  PetscInt             n;
  Mat                  K;
  PC                   pc;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(KSPGetOperators(ksp, &K, NULL));
  PetscCall(MatGetSize(K, &n, NULL));
  PetscCall(choice.setDefaults(n, &defaults));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, choice.type));
  PetscCall(KSPSetFromOptions(ksp));
  if (!choice.is(MATSOLVERMUMPS) && (size == 1 || choice.redundant))
    PetscCall(AinsworthFactorTryUnlogged([=] { return KSPSetUp(ksp); }, &code, &message));
  else PetscCall(KSPSetUp(ksp));
  PetscCall(defaults.clear());
  if (code) {
    PetscCheck(std::count(expected, expected + PETSC_STATIC_ARRAY_LENGTH(expected), code), comm, code, "%s",
               message.c_str());
    PetscCall(PetscInfo(ksp, "The whole system is not factored: %s\n", message.c_str()));
    *reason = code == PETSC_ERR_MEM ? PC_FACTOR_OUTMEMORY : PC_FACTOR_OTHER;
  } else PetscCall(PCGetFailedReason(pc, reason));
  worst = *reason < 0 ? PC_FACTOR_OTHER : (PetscMPIInt)*reason; /* a negative one would get lost in the maximum */
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_INT, MPI_MAX, comm));
  *reason = (PCFailedReason)worst;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Describes a failure: MUMPS has more reasons than PETSc has names for */
static PetscErrorCode Explain(KSP ksp, PCFailedReason reason, char why[], size_t len)
{
  PetscInt  info  = 0;
  PetscBool mumps = PETSC_FALSE;
  PC        pc;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
#if defined(PETSC_HAVE_MUMPS)
  PetscCall(AinsworthFactorIsPackage(pc, MATSOLVERMUMPS, &mumps));
  if (mumps) {
    Mat F;

    PetscCall(PCFactorGetMatrix(pc, &F));
    PetscCall(MatMumpsGetInfog(F, 1, &info));
  }
#endif
  if (mumps)
    PetscCall(PetscSNPrintf(why, len, "the whole system cannot be factored: %s, INFOG(1) of MUMPS is %" PetscInt_FMT,
                            PCFailedReasons[reason], info));
  else PetscCall(PetscSNPrintf(why, len, "the whole system cannot be factored: %s", PCFailedReasons[reason]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies both parts of a vector to one with the layout of K, or back */
static PetscErrorCode Load(AinsworthSaddleVec b, Vec v)
{
  PetscScalar *a, *to;

  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(v, &a));
  to = a;
  for (Vec part : {b.primal, b.dual}) {
    const PetscScalar *from;
    PetscInt           n;

    PetscCall(VecGetLocalSize(part, &n));
    PetscCall(VecGetArrayRead(part, &from));
    to = std::copy_n(from, n, to);
    PetscCall(VecRestoreArrayRead(part, &from));
  }
  PetscCall(VecRestoreArrayWrite(v, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Unload(Vec v, AinsworthSaddleVec y)
{
  const PetscScalar *a, *from;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(v, &a));
  from = a;
  for (Vec part : {y.primal, y.dual}) {
    PetscScalar *to;
    PetscInt     n;

    PetscCall(VecGetLocalSize(part, &n));
    PetscCall(VecGetArrayWrite(part, &to));
    std::copy_n(from, n, to);
    from += n;
    PetscCall(VecRestoreArrayWrite(part, &to));
  }
  PetscCall(VecRestoreArrayRead(v, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks by a solve whether the factor gives numbers: UMFPACK factors a singular matrix with no more than a warning.
   Collective
*/
static PetscErrorCode GivesNumbers(const AinsworthWhole *whole, PetscBool *good)
{
  PetscReal norm;

  PetscFunctionBegin;
  PetscCall(VecSet(whole->rhs, 1.0));
  PetscCall(KSPSolve(whole->ksp, whole->rhs, whole->solution));
  PetscCall(VecNorm(whole->solution, NORM_2, &norm));
  *good = (PetscBool)!PetscIsInfOrNanReal(norm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthWholeCreate - assembles, equilibrates and factors the whole system. Collective

   If it cannot be factored, *whole is NULL and `why` tells the cause, both the same on all ranks; otherwise `why` is
   empty. A matrix that is singular only to rounding is factored all the same: the caller judges its answers. prefix:
   options are those of a KSP with this prefix and "whole_".
*/
PetscErrorCode AinsworthWholeCreate(const AinsworthSaddle *sp, PetscBool symmetric, AinsworthSaddleVec scale,
                                    const char prefix[], AinsworthWhole **whole, char why[], size_t len)
{
  AinsworthWhole *w = new AinsworthWhole;
  PCFailedReason  reason;
  Choice          choice;
  PetscBool       good = PETSC_FALSE;
  PetscInt        bad, column;
  const char     *own;
  Mat             K;

  PetscFunctionBegin;
  *whole       = NULL;
  why[0]       = '\0';
  w->symmetric = symmetric;
  PetscCall(AinsworthWholeAssemble(sp, &K));
  PetscCall(AinsworthCreateVecs(K, &w->solution, &w->rhs));
  PetscCall(VecDuplicate(w->rhs, &w->scale));
  PetscCall(Load(scale, w->scale));
  PetscCall(MatDiagonalScale(K, w->scale, w->scale));
  PetscCall(AinsworthMatFindEntry(K, AinsworthIsNotFinite, &bad, &column)); /* MUMPS crashes on some */
  if (bad >= 0) {
    PetscCall(MatDestroy(&K));
    PetscCall(AinsworthWholeDestroy(&w));
    PetscCall(PetscSNPrintf(why, len,
                            "the whole system cannot be factored: an entry of row %" PetscInt_FMT " overflows", bad));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (symmetric) PetscCall(MatSetOption(K, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)K), &w->ksp));
  PetscCall(KSPSetOptionsPrefix(w->ksp, prefix));
  PetscCall(KSPAppendOptionsPrefix(w->ksp, "whole_"));
  PetscCall(KSPGetOptionsPrefix(w->ksp, &own));
  PetscCall(MatSetOptionsPrefix(K, own)); /* packages read their options at the matrix' prefix */
  PetscCall(KSPSetOperators(w->ksp, K, K));
  PetscCall(MatDestroy(&K));
  PetscCall(choice.make(w->ksp, symmetric));
  w->forward = !symmetric && choice.is(MATSOLVERSUPERLU_DIST);
  PetscCall(Factor(w->ksp, choice, &reason));
  if (reason) PetscCall(Explain(w->ksp, reason, why, len));
  else {
    PetscCall(GivesNumbers(w, &good));
    if (!good)
      PetscCall(
        PetscSNPrintf(why, len, "the whole system cannot be factored: a solve with its factor gave no numbers"));
  }
  if (why[0]) PetscCall(AinsworthWholeDestroy(&w));
  *whole = w;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthWholeSolve - computes y = K^-1 b, or K^-T b, with the factor of S K S; y may be b. Collective

   Where a solve fails y is infinite, as for the transpose with SuperLU_DIST, whose interface ignores it (PETSc 3.18.5).
   The transpose of K = K' is its conjugate.
*/
PetscErrorCode AinsworthWholeSolve(const AinsworthWhole *whole, PetscBool transpose, AinsworthSaddleVec b,
                                   AinsworthSaddleVec y)
{
  const bool         conjugate = transpose && whole->symmetric;
  KSPConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(Load(b, whole->rhs));
  PetscCall(VecPointwiseMult(whole->rhs, whole->rhs, whole->scale));
  if (conjugate) PetscCall(VecConjugate(whole->rhs));
  PetscCall((transpose && !conjugate ? KSPSolveTranspose : KSPSolve)(whole->ksp, whole->rhs, whole->solution));
  PetscCall(KSPGetConvergedReason(whole->ksp, &reason));
  if (reason < 0 || (transpose && whole->forward)) PetscCall(VecSet(whole->solution, PETSC_INFINITY));
  if (conjugate) PetscCall(VecConjugate(whole->solution));
  PetscCall(VecPointwiseMult(whole->solution, whole->solution, whole->scale));
  PetscCall(Unload(whole->solution, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthWholeView(const AinsworthWhole *whole, PetscViewer viewer)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecGetSize(whole->rhs, &n));
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "the whole system [A B'; C -D], %" PetscInt_FMT " unknowns, equilibrated and factored:\n", n));
  PetscCall(PetscViewerASCIIPushTab(viewer));
  PetscCall(KSPView(whole->ksp, viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthWholeDestroy(AinsworthWhole **whole)
{
  PetscFunctionBegin;
  if (!*whole) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPDestroy(&(*whole)->ksp));
  for (Vec *v : {&(*whole)->scale, &(*whole)->rhs, &(*whole)->solution}) PetscCall(VecDestroy(v));
  delete *whole;
  *whole = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}
