#include "projectedcg.h"
#include <petscainsworth.h>
#include <petsc/private/kspimpl.h>

/*
   KSPProjectedCGGetDirection_Private - gets the search direction of KSPCG and KSPPROJECTEDCG; NULL for other types, and
   before their set-up
*/
PetscErrorCode KSPProjectedCGGetDirection_Private(KSP ksp, Vec *direction)
{
  static const int place = 2; /* among the work vectors */
  PetscBool        cg;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPPROJECTEDCG, KSPCG, ""));
  *direction = cg && ksp->work && ksp->nwork > place ? /* KSPReset() leaves their number */ ksp->work[place] : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   KSPPROJECTEDCG - conjugate gradients in Ker C, as the method of the reduced solve of `PCAINSWORTH` (Gould, Hribar,
   Nocedal 2001)

   Options Database Key:
.  -ksp_cg_single_reduction - one reduction per iteration, see `KSPCGUseSingleReduction()`

   Level: intermediate

   Notes:
   This is `KSPCG` with the natural norm by default. `PCAINSWORTH` gives it the operator Q' A in Ker C and the
   preconditioner Q M^{-1}, in every variant: the iterates have C x = 0 to rounding, the penalty B is not applied, and R
   g is added afterwards. An iteration costs one product with A, one application of the preconditioner and two solves
   with the Gram matrix. If rows of C are nearly dependent, each projection is refined.

   Options, functions and convergence reasons are those of `KSPCG`. The preconditioner must be symmetric positive
   definite, and A must be so on Ker C. The relative tolerance refers to Q' (f - A R g), also with an initial guess.

   `KSPCG`, `KSPFCG`, `KSPPIPEFCG`, `KSPPIPECG`, `KSPGROPPCG`, `KSPPIPEPRCG` and `KSPPIPECG2` iterate in Ker C in the
   same way if they are the inner method of `PCAINSWORTH`, except in the variant of the paper.

   References:
   N. I. M. Gould, M. E. Hribar, J. Nocedal, On the solution of equality constrained quadratic programming problems
   arising in optimization, SIAM J. Sci. Comput. 23 (2001), 1376-1395.

.seealso: `MATAINSWORTH`, `PCAINSWORTH`, `KSPCG`
M*/
PetscErrorCode KSPCreate_ProjectedCG(KSP ksp)
{
  PetscErrorCode (*create)(KSP);

  PetscFunctionBegin;
  PetscCall(PetscFunctionListFind(KSPList, KSPCG, &create));
  PetscCall((*create)(ksp));
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_NATURAL, PC_LEFT, 4));
  PetscFunctionReturn(PETSC_SUCCESS);
}
