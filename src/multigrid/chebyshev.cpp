#include "blocksa.h"
#include <petsc/private/kspimpl.h>

struct KSP_ChebyshevSingle {
  PetscReal least = 0.0, largest = 0.0;
};

/* Sets the part of the spectrum to damp; does nothing for other types, which find their own bounds */
PetscErrorCode KSPChebyshevSingleSetEigenvalues_Private(KSP ksp, PetscReal largest, PetscReal least)
{
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPCHEBYSHEVSINGLE, &same));
  if (same) *(KSP_ChebyshevSingle *)ksp->data = {least, largest};
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetLevel(KSP ksp, AinsworthLevel **level)
{
  Mat Amat;

  PetscFunctionBegin;
  PetscCall(KSPGetOperators(ksp, &Amat, NULL));
  PetscCall(AinsworthLevelMatGet(Amat, level));
  PetscCheck(*level && (*level)->single, PetscObjectComm((PetscObject)ksp), PETSC_ERR_SUP,
             "KSP type %s works only on levels of PC type %s in single precision: use -mg_levels_ksp_type chebyshev",
             KSPCHEBYSHEVSINGLE, PCBLOCKSA);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode KSPSetUp_ChebyshevSingle(KSP ksp)
{
  AinsworthLevel *level;
  PetscBool       jacobi;

  PetscFunctionBegin;
  PetscCall(GetLevel(ksp, &level));
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp->pc, PCJACOBI, &jacobi));
  PetscCheck(jacobi, PetscObjectComm((PetscObject)ksp), PETSC_ERR_SUP,
             "KSP type %s works only with PC type %s, not with %s: use -pc_blocksa_precision double",
             KSPCHEBYSHEVSINGLE, PCJACOBI,
             ((PetscObject)ksp->pc)->type_name ? ((PetscObject)ksp->pc)->type_name : "(not set)");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode KSPSolve_ChebyshevSingle(KSP ksp)
{
  AinsworthLevel      *level;
  KSP_ChebyshevSingle *data = (KSP_ChebyshevSingle *)ksp->data;
  PetscBool            known, zero = ksp->guess_zero;
  PetscReal            norm;

  PetscFunctionBegin;
  PetscCall(GetLevel(ksp, &level));
  if (!zero) { /* PCMG does not say that it starts from zero, but VecSet() caches the norm */
    PetscCall(VecNormAvailable(ksp->vec_sol, NORM_2, &known, &norm));
    zero = (PetscBool)(known && norm == 0.0);
  }
  if (ksp->max_it)
    PetscCall(level->single->smooth(ksp->max_it, data->least, data->largest, zero, level->subspace.get(), ksp->vec_rhs,
                                    ksp->vec_sol));
  ksp->its    = ksp->max_it;
  ksp->reason = KSP_CONVERGED_ITS;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode KSPView_ChebyshevSingle(KSP ksp, PetscViewer viewer)
{
  KSP_ChebyshevSingle *data = (KSP_ChebyshevSingle *)ksp->data;
  PetscBool            ascii;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (ascii)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  single precision, eigenvalues used: min %g, max %g\n",
                                     (double)data->least, (double)data->largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
   KSPCHEBYSHEVSINGLE - Chebyshev's iteration with Jacobi in single precision, the smoother of the levels of `PCBLOCKSA`
   above the coarsest

   Level: developer

   Notes:
   The method works on operators of `PCBLOCKSA` that are stored in single precision, scaled to a unit diagonal by powers
   of two. `-mg_levels_ksp_max_it` sets the degree of the polynomial. A step and its product with the matrix are one
   pass over the entries. Where the level has an incomplete factor (`-pc_blocksa_smoother`), that takes the place of
   Jacobi.

   `-mg_levels_ksp_type chebyshev` selects PETSc's own method. `-pc_blocksa_precision
   double` selects double precision.

.seealso: `PCBLOCKSA`, `KSPCHEBYSHEV`
M*/
PetscErrorCode KSPCreate_ChebyshevSingle(KSP ksp)
{
  KSP_ChebyshevSingle *data;

  PetscFunctionBegin;
  PetscCall(PetscNew(&data));
  ksp->data = (void *)data;
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_NONE, PC_LEFT, 3));
  ksp->ops->setup         = KSPSetUp_ChebyshevSingle;
  ksp->ops->solve         = KSPSolve_ChebyshevSingle;
  ksp->ops->view          = KSPView_ChebyshevSingle;
  ksp->ops->destroy       = KSPDestroyDefault;
  ksp->ops->buildsolution = KSPBuildSolutionDefault;
  ksp->ops->buildresidual = KSPBuildResidualDefault;
  PetscFunctionReturn(PETSC_SUCCESS);
}
