#include "epsainsworth.h"
#include "../base/guard.h"
#include <slepcainsworth.h>
#include <slepc/private/epsimpl.h>

/* STPRECOND, whose preconditioner is one cycle of multigrid between two projections */
static PetscErrorCode EPSSetDefaultST_Ainsworth(EPS eps)
{
  KSP    ksp;
  PC     pc;
  PCType type;

  PetscFunctionBegin;
  if (!((PetscObject)eps->st)->type_name) PetscCall(STSetType(eps->st, STPRECOND));
  PetscCall(STGetKSP(eps->st, &ksp));
  if (!((PetscObject)ksp)->type_name) { /* one application, which its method does not take for an answer */
    PetscCall(KSPSetType(ksp, KSPRICHARDSON));
    PetscCall(KSPSetNormType(ksp, KSP_NORM_NONE));
    PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, 1));
  }
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetType(pc, &type));
  if (!type) PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscFunctionReturn(PETSC_SUCCESS);
}

bool EPSAinsworthIsSwapped_Private(EPS eps)
{
  return eps->which == EPS_LARGEST_REAL;
}

PetscErrorCode EPSAinsworthGetMatrices_Private(EPS eps, Mat *K, Mat *M)
{
  PetscFunctionBegin;
  if (EPSAinsworthIsSwapped_Private(eps)) PetscCall(EPSGetOperators(eps, M, K));
  else PetscCall(EPSGetOperators(eps, K, M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses what the method cannot find */
static PetscErrorCode CheckWhich(EPS eps)
{
  const PetscReal shift = ((EPS_Ainsworth *)eps->data)->shift;

  PetscFunctionBegin;
  if (!eps->which) eps->which = EPS_SMALLEST_REAL;
  switch (eps->which) {
  case EPS_SMALLEST_REAL:
  case EPS_SMALLEST_MAGNITUDE:
    break;
  case EPS_LARGEST_REAL:
    PetscCheck(shift <= 0.0, PetscObjectComm((PetscObject)eps), PETSC_ERR_SUP,
               "EPS type %s has no shift for the largest eigenvalues of (M, K): remove -eps_ainsworth_shift, or pass K "
               "first and ask for the smallest",
               EPSAINSWORTH);
    break;
  case EPS_TARGET_MAGNITUDE:
  case EPS_TARGET_REAL:
    PetscCheck(PetscRealPart(eps->target) <= 0.0, PetscObjectComm((PetscObject)eps), PETSC_ERR_SUP,
               "EPS type %s finds the smallest eigenvalues, not those near %g: use -eps_target 0, or factor the matrix "
               "with -eps_type krylovschur -st_type sinvert",
               EPSAINSWORTH, (double)PetscRealPart(eps->target));
    break;
  default:
    SETERRQ(PetscObjectComm((PetscObject)eps), PETSC_ERR_SUP,
            "EPS type %s finds the smallest eigenvalues of (K, M) and the largest of (M, K): use -eps_smallest_real or "
            "-eps_largest_real, or another -eps_type",
            EPSAINSWORTH);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes the vectors of EPSSetInitialSpace(): SLEPc 3.18 would orthonormalize them, and cannot with nested ones */
static PetscErrorCode TakeInitialSpace(EPS eps)
{
  EPS_Ainsworth *ctx = (EPS_Ainsworth *)eps->data;

  PetscFunctionBegin;
  ctx->initial.clear();
  for (; eps->nini < 0; eps->nini++) ctx->initial.push_back(AinsworthOwn(eps->IS[-eps->nini - 1]));
  PetscCall(PetscFree(eps->IS));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode HasNestedVectors(Mat K, PetscBool *nest)
{
  Vec v;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(K, &v, NULL));
  PetscCall(PetscObjectTypeCompare((PetscObject)v, VECNEST, nest));
  PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode EPSSetUp_Ainsworth(EPS eps)
{
  MPI_Comm  comm = PetscObjectComm((PetscObject)eps);
  Mat       K, M;
  KSP       ksp;
  PC        pc;
  PetscBool match, nest;

  PetscFunctionBegin;
  PetscCall(EPSGetOperators(eps, NULL, &M));
  PetscCheck(M && eps->isgeneralized && eps->ishermitian && eps->ispositive, comm, PETSC_ERR_ARG_WRONGSTATE,
             "EPS type %s solves K x = lambda M x with a Hermitian K and a positive semidefinite M: pass both with "
             "EPSSetOperators(eps, K, M), and call EPSSetProblemType(eps, EPS_GHEP), or use -eps_gen_hermitian",
             EPSAINSWORTH);
  PetscCheck(!eps->nds, comm, PETSC_ERR_SUP,
             "EPS type %s takes no deflation space: ask for more modes, as rigid ones are found and counted",
             EPSAINSWORTH);
  PetscCheck(!AinsworthStopsByThreshold(eps), comm, PETSC_ERR_SUP,
             "EPS type %s has no threshold: give a number of modes with -eps_nev", EPSAINSWORTH);
  PetscCall(CheckWhich(eps));
  PetscCall(EPSAinsworthGetMatrices_Private(eps, &K, &M));
  EPSCheckUnsupported(eps, EPS_FEATURE_BALANCE | EPS_FEATURE_ARBITRARY | EPS_FEATURE_REGION | EPS_FEATURE_EXTRACTION |
                             EPS_FEATURE_TWOSIDED);
  PetscCall(STSetPreconditionerMat(eps->st, K)); /* or SLEPc would form K - target M, which we do not use */
  PetscCall(STGetKSP(eps->st, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCAINSWORTH, &match));
  PetscCheck(match, comm, PETSC_ERR_SUP,
             "EPS type %s needs a preconditioner that meets the constraints: -st_pc_type %s", EPSAINSWORTH,
             PCAINSWORTH);
  if (eps->nev <= 0) eps->nev = 1;
  if (eps->ncv <= 0) eps->ncv = PetscMin(eps->n, eps->nev + PetscMax(4, (eps->nev + 3) / 4));
  PetscCheck(eps->ncv >= eps->nev, comm, PETSC_ERR_USER_INPUT,
             "-eps_ncv %" PetscInt_FMT " is less than -eps_nev %" PetscInt_FMT
             ": vectors are iterated together, a few more than modes are wanted",
             eps->ncv, eps->nev);
  eps->mpd = 3 * eps->ncv;
  if (eps->max_it <= 0) eps->max_it = PetscMax(100, 2 * eps->n / eps->ncv); /* as SLEPc's own block method */
  PetscCall(HasNestedVectors(K, &nest));
  PetscCheck(!nest || AinsworthBVTakesNests, comm, PETSC_ERR_SUP,
             "This SLEPc has no room for eigenvectors of type VECNEST: leave MatNestSetVecType() out");
  if (!eps->V) PetscCall(EPSGetBV(eps, &eps->V));
  if (nest) PetscCall(BVSetType(eps->V, BVVECS)); /* the only one that takes nested vectors */
  PetscCall(EPSAllocateSolution(eps, 0));
  PetscCall(BVSetMatrix(eps->V, NULL, PETSC_FALSE));
  PetscCall(TakeInitialSpace(eps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode EPSSetUpSort_Ainsworth(EPS eps)
{
  PetscFunctionBegin;
  eps->sc->comparison    = EPSAinsworthIsSwapped_Private(eps) ? SlepcCompareLargestReal : SlepcCompareSmallestReal;
  eps->sc->comparisonctx = NULL;
  eps->sc->map           = NULL;
  eps->sc->mapobj        = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode EPSReset_Ainsworth(EPS eps)
{
  PetscFunctionBegin;
  ((EPS_Ainsworth *)eps->data)->pencil = AinsworthPencil();
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode EPSAinsworthSetShift_Ainsworth(EPS eps, PetscReal shift)
{
  EPS_Ainsworth *ctx = (EPS_Ainsworth *)eps->data;

  PetscFunctionBegin;
  PetscCheck(shift >= 0.0 || shift == (PetscReal)PETSC_DECIDE, PetscObjectComm((PetscObject)eps),
             PETSC_ERR_ARG_OUTOFRANGE, "The shift must not be negative, not %g: the matrix is K + shift M",
             (double)shift);
  ctx->shift = shift;
  eps->state = EPS_STATE_INITIAL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode EPSAinsworthGetShift_Ainsworth(EPS eps, PetscReal *shift)
{
  EPS_Ainsworth *ctx = (EPS_Ainsworth *)eps->data;

  PetscFunctionBegin;
  *shift = eps->state >= EPS_STATE_SOLVED ? ctx->pencil.sigma() : ctx->shift;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode EPSDestroy_Ainsworth(EPS eps)
{
  PetscFunctionBegin;
  delete (EPS_Ainsworth *)eps->data;
  eps->data = NULL;
  PetscCall(PetscObjectComposeFunction((PetscObject)eps, "EPSAinsworthSetShift_C", NULL));
  PetscCall(PetscObjectComposeFunction((PetscObject)eps, "EPSAinsworthGetShift_C", NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode EPSSetFromOptions_Ainsworth(EPS eps, AinsworthOptionItems PetscOptionsObject)
{
  PetscReal shift;
  PetscBool set;

  PetscFunctionBegin;
  PetscOptionsHeadBegin(PetscOptionsObject, "EPS ainsworth options");
  shift = ((EPS_Ainsworth *)eps->data)->shift;
  PetscCall(PetscOptionsReal("-eps_ainsworth_shift", "sigma of the preconditioned matrix K + sigma M",
                             "EPSAinsworthSetShift", shift, &shift, &set));
  if (set) PetscCall(EPSAinsworthSetShift(eps, shift));
  PetscOptionsHeadEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode EPSView_Ainsworth(EPS eps, PetscViewer viewer)
{
  EPS_Ainsworth *ctx = (EPS_Ainsworth *)eps->data;
  PetscBool      ascii;
  PetscReal      shift;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(EPSAinsworthGetShift(eps, &shift));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %" PetscInt_FMT " vectors iterated together\n", eps->ncv));
  if (EPSAinsworthIsSwapped_Private(eps))
    PetscCall(PetscViewerASCIIPrintf(viewer, "  preconditioner of K, the second matrix\n"));
  else if (shift < 0.0)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  preconditioner of K + sigma M, sigma not chosen yet\n"));
  else
    PetscCall(PetscViewerASCIIPrintf(viewer, "  preconditioner of K + %g M, sigma %s\n", (double)shift,
                                     ctx->shift < 0.0 ? "chosen by Ritz values" : "given"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   EPSAINSWORTH - vibration modes of constrained models by multigrid, the smallest eigenvalues of [A C'; C 0] x = lambda
   [M 0; 0 0] x, and buckling loads

   Options Database Keys:
+  -eps_nev <1>                     - modes that are wanted, rigid ones included
.  -eps_ncv <nev + max(4, nev / 4)> - vectors that are iterated together; more of them converge in fewer iterations
.  -eps_tol <1e-8>                  - tolerance of the error estimates
.  -eps_ainsworth_shift <decided>   - sigma of K + sigma M, see `EPSAinsworthSetShift()`
-  -st_ainsworth_pc_type <blocksa>  - the preconditioner of A + sigma M; all options of `PCAINSWORTH` have the prefix
                                      `st_` here

   Level: beginner

   Notes:
   This type is in libainsworthslepc.so, which `-dll_append` loads, with or without libainsworth.so before it.

   `EPSSetOperators()` gets K and M in any layout of `PCAINSWORTH`: as `MATNEST`, both with the same blocks, or
   assembled, with multipliers that are found, or named by index sets or by the options of `PCAINSWORTH`. The
   `PC` is that of the
   `KSP` of the `ST`. The problem type is `EPS_GHEP`. M has no entries for multipliers; it may be singular. The matrices
   are not changed; K + sigma M is a copy of the blocks where M has entries.

   Eigenvectors have all rows of K: x, with x' M x = 1, and the multipliers, which are the forces of the constraints in
   the mode. C x = 0 holds to rounding.

   With `EPSSetOperators(eps, M, K)` and `EPS_LARGEST_REAL` the largest eigenvalues are found, 1/lambda, without a
   shift: no body may be free. M may be indefinite then. With minus the geometric stiffness for M, these are the
   inverses of the smallest factors of a load at which the model buckles. x' K x is 1.

   Rigid modes are eigenvalues 0 to rounding. They are found and counted like others, and need not be known. Null spaces
   attached to A are taken for near null spaces.

   A target below 0 is minus the shift.

   `EPSSetInitialSpace()` takes vectors like those, up to -eps_ncv; they need not meet the constraints.

   Errors. Let z be the correction of a mode by the preconditioner. The error estimate is its size (z' (K + sigma M)
   z)^(1/2) relative to that of the mode, which bounds the error of lambda relative to lambda + sigma, up to the quality
   of the preconditioner; the error of lambda itself is about the square of it. It does not depend on units. With
   `-eps_conv_abs`, `-eps_conv_norm` or a test of the program, that gets the estimate times lambda + sigma for the norm
   of the residual. `EPSComputeError()` has the residual of the whole system with multipliers; relative to lambda it
   says nothing about rigid modes; use `-eps_error_absolute`.

   The method is that of Knyazev, with the orthogonalization of Hetmaniuk and Lehoucq, in the inner product of K + sigma
   M. The preconditioner is one cycle of multigrid in the kernel of C, up to 600 rows a solve to 1e-2;
   -st_ainsworth_ksp_type and -st_ksp_type choose others.

   Errors:
   At `EPSSolve()`: `PETSC_ERR_ARG_WRONGSTATE` for another problem type, `PETSC_ERR_SUP` for other eigenvalues than
   these, `PETSC_ERR_ARG_WRONG` for an M with entries for multipliers, `PETSC_ERR_ARG_INCOMP` for blocks that do not
   match, `PETSC_ERR_ARG_OUTOFRANGE` if K + sigma M is indefinite where C x = 0, or if M is and comes second.

   References:
   A. V. Knyazev, SIAM J. Sci. Comput. 23 (2001), 517-541; U. Hetmaniuk, R. Lehoucq, J. Comput. Phys. 218 (2006),
   324-332; A. Stathopoulos, K. Wu, SIAM J. Sci. Comput. 23 (2002), 2165-2182.

.seealso: `PCAINSWORTH`, `EPSAinsworthSetShift()`, `PCAinsworthGetFields()`
M*/
PetscErrorCode EPSCreate_Ainsworth(EPS eps)
{
  PetscFunctionBegin;
  eps->data  = (void *)new EPS_Ainsworth();
  eps->categ = EPS_CATEGORY_PRECOND;

  eps->ops->solve          = AinsworthGuarded<EPSSolve_Ainsworth>;
  eps->ops->setup          = AinsworthGuarded<EPSSetUp_Ainsworth>;
  eps->ops->setupsort      = EPSSetUpSort_Ainsworth;
  eps->ops->setfromoptions = EPSSetFromOptions_Ainsworth;
  eps->ops->destroy        = EPSDestroy_Ainsworth;
  eps->ops->reset          = EPSReset_Ainsworth;
  eps->ops->view           = EPSView_Ainsworth;
  eps->ops->setdefaultst   = EPSSetDefaultST_Ainsworth;
  PetscCall(PetscObjectComposeFunction((PetscObject)eps, "EPSAinsworthSetShift_C", EPSAinsworthSetShift_Ainsworth));
  PetscCall(PetscObjectComposeFunction((PetscObject)eps, "EPSAinsworthGetShift_C", EPSAinsworthGetShift_Ainsworth));
  PetscFunctionReturn(PETSC_SUCCESS);
}
