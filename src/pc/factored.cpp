/* Factorization of M_*, by our choice or by options: package and matrix format */
#include "pcainsworth.h"
#include "../projector/factor.h"
#include <petsc/private/pcimpl.h>

/* Returns the type of a factorization for M_*, NULL if there is none, and its package; a complex Hermitian matrix is a general one for all of them */
PCType PCAinsworthFactorType_Private(const PC_Ainsworth *data, MatSolverType *package)
{
  PetscMPIInt size;
  const bool  definite = data->symmetric && !PetscDefined(USE_COMPLEX);

  (void)MPI_Comm_size(PetscObjectComm((PetscObject)data->ksp), &size);
  *package = NULL;
#if defined(PETSC_HAVE_MUMPS)
  *package = MATSOLVERMUMPS;
#elif defined(PETSC_HAVE_SUPERLU_DIST)
  if (!definite) *package = MATSOLVERSUPERLU_DIST;
#endif
#if defined(PETSC_HAVE_SUITESPARSE)
  if (size == 1 && definite) *package = MATSOLVERCHOLMOD;
  else if (size == 1 && !*package) *package = MATSOLVERUMFPACK;
#endif
  if (size == 1 && !*package) *package = MATSOLVERPETSC;
  return *package ? definite ? PCCHOLESKY : PCLU : NULL;
}

/* PCAinsworthChoosePackage_Private - sets the package of a factorization unless the program has; options may still change it */
PetscErrorCode PCAinsworthChoosePackage_Private(const PC_Ainsworth *data, PC inner)
{
  MatSolverType package, given = NULL;
  PCType        type    = PCAinsworthFactorType_Private(data, &package);
  PetscBool     factors = PETSC_FALSE;

  PetscFunctionBegin;
  if (type) PetscCall(PetscObjectTypeCompare((PetscObject)inner, type, &factors));
  if (factors) PetscCall(PCFactorGetMatSolverType(inner, &given));
  if (factors && !given) PetscCall(PCFactorSetMatSolverType(inner, package));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthConvertPmat_Private - converts M_*, or A without constraints, to the format of its factorization */
PetscErrorCode PCAinsworthConvertPmat_Private(PC_Ainsworth *data)
{
  PC        inner;
  PetscBool cholmod;
  Mat       aij;

  PetscFunctionBegin;
  if (data->format != AINSWORTH_PMAT_FACTOR) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(AinsworthFactorIsPackage(inner, MATSOLVERCHOLMOD, &cholmod));
  aij = data->M;
  if (!aij) PetscCall(AinsworthGetAIJ(data->saddle.A, &aij));
  data->M = aij;
  if (!cholmod) PetscFunctionReturn(PETSC_SUCCESS);
  if (aij == data->saddle.A) { /* its block size must not change */
    PetscCall(MatDuplicate(aij, MAT_COPY_VALUES, &data->M));
    PetscCall(MatDestroy(&aij));
  }
  PetscCall(MatSetBlockSize(data->M, 1)); /* the interface to CHOLMOD wraps this type in place, but only with block size 1 */
  PetscCall(MatSetOption(data->M, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatConvert(data->M, MATSEQSBAIJ, MAT_INPLACE_MATRIX, &data->M));
  PetscCall(MatSetOption(data->M, MAT_SPD, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthSetUpPreconditioner_Private - calls PCSetUp() without the error that CHOLMOD raises if M_* is not positive definite */
PetscErrorCode PCAinsworthSetUpPreconditioner_Private(PC inner, PetscBool *definite)
{
  PetscBool cholmod, indefinite = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(AinsworthFactorIsPackage(inner, MATSOLVERCHOLMOD, &cholmod));
  if (cholmod) PetscCall(AinsworthFactorTryCholmod((PetscObject)inner, false, [=] { return PCSetUp(inner); }, &indefinite));
  else PetscCall(PCSetUp(inner));
  if (indefinite) PetscCall(PCReset(inner));
  *definite = (PetscBool)!indefinite;
  PetscFunctionReturn(PETSC_SUCCESS);
}
