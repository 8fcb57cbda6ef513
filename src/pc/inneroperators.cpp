/* Operators of the inner solver, reuse of its preconditioner, and workarounds for PETSc's own types */
#include "pcainsworth.h"
#include "../ksp/inkernel.h"
#include "../multigrid/blocksa.h"
#include "../operator/matainsworth.h"
#include <petsc/private/pcmgimpl.h>

/* Takes the products with A from PCBLOCKSA, which stores half of the blocks, in place of those with the program's matrix */
PetscErrorCode PCAinsworthUseProduct_Private(PC_Ainsworth *data)
{
  PC  inner;
  Mat product, first = data->saddle.A;

  PetscFunctionBegin;
  if (!data->saddle.symmetric) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthGetInnerPC_Private(data, &inner));
  if (data->saddle.constraints() && data->inner.format == AINSWORTH_PMAT_SUM) PetscCall(MatCompositeGetMat(data->inner.M, 0, &first));
  PetscCall(PCBlockSAGetProduct_Private(inner, &product));
  if (!product || first != data->saddle.A) { /* its levels are not those of A: they are of Pmat's block, or of a sum */
    if (data->reduced.mat) PetscCall(MatAinsworthSetProduct_Private(data->reduced.mat, NULL));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (data->saddle.constraints()) PetscCall(MatAinsworthSetProduct_Private(data->reduced.mat, product));
  else PetscCall(KSPSetOperators(data->inner.ksp, product, data->saddle.A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks by some steps of conjugate gradients whether M looks positive definite

   hypre takes as many steps to estimate the largest eigenvalue for Chebyshev smoothing, and does not return if they give a NaN
*/
PetscErrorCode PCAinsworthLooksDefinite_Private(const PC_Ainsworth *data, Mat M, PetscBool *definite)
{
  enum {
    steps = 10
  };
  static const PetscReal solved = PETSC_MACHINE_EPSILON;
  PetscInt               n;
  PetscReal              smallest, first = 0.0;
  PetscScalar            rz, pMp, next;
  Vec                    diagonal, r, z, p, Mp;

  PetscFunctionBegin;
  *definite = PETSC_TRUE;
  PetscCall(MatGetSize(M, &n, NULL));
  if (data->inner.format != AINSWORTH_PMAT_HYPRE || data->saddle.constraints() == n) PetscFunctionReturn(PETSC_SUCCESS); /* Ker C = 0 needs no inner solve */
  PetscCall(MatCreateVecs(M, &diagonal, &r));
  PetscCall(MatGetDiagonal(M, diagonal));
  for (Vec *v : {&z, &p, &Mp}) PetscCall(VecDuplicate(r, v));
  PetscCall(VecCopy(diagonal, z));
  if (PetscDefined(USE_COMPLEX)) PetscCall(VecRealPart(z));
  PetscCall(VecMin(z, NULL, &smallest));
  if (!(smallest > 0.0)) *definite = PETSC_FALSE;
  PetscCall(VecSetRandom(r, NULL));
  PetscCall(VecPointwiseDivide(z, r, diagonal));
  PetscCall(VecCopy(z, p));
  PetscCall(VecDot(z, r, &rz));
  for (int k = 0; k < steps && *definite && data->saddle.symmetric; k++) { /* steps of conjugate gradients mean nothing for other matrices */
    if (!k) first = PetscRealPart(rz);
    if (PetscRealPart(rz) <= solved * first) break;
    PetscCall(MatMult(M, p, Mp));
    PetscCall(VecDot(Mp, p, &pMp));
    if (!(PetscRealPart(pMp) > 0.0)) *definite = PETSC_FALSE;
    PetscCall(VecAXPY(r, -rz / pMp, Mp));
    PetscCall(VecPointwiseDivide(z, r, diagonal));
    PetscCall(VecDot(z, r, &next));
    PetscCall(VecAYPX(p, next / rz, z));
    rz = next;
  }
  for (Vec *v : {&diagonal, &r, &z, &p, &Mp}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets whether the inner preconditioner is kept whatever its matrix, and remembers the program's own setting */
PetscErrorCode PCAinsworthReuseInner_Private(PC_Ainsworth *data, PetscBool keep)
{
  PCAinsworthAge *age = &data->age;
  PC              inner;

  PetscFunctionBegin;
  if (!keep && age->type != PC_AINSWORTH_AGE_WHOLE) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthGetInnerPC_Private(data, &inner));
  if (age->type != PC_AINSWORTH_AGE_WHOLE) PetscCall(PCGetReusePreconditioner(inner, &age->ownReuse));
  PetscCall(PCSetReusePreconditioner(inner, (PetscBool)(keep || age->ownReuse)));
  age->type = keep ? PC_AINSWORTH_AGE_WHOLE : PC_AINSWORTH_AGE_FRESH;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Repairs PCMG after an error in its cycle: it still holds the right-hand side of its caller in place of its own, and would destroy it */
PetscErrorCode PCAinsworthAfterError_Private(PC_Ainsworth *data)
{
  PC        inner;
  PetscBool multigrid;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetInnerPC_Private(data, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &multigrid, PCMG, PCGAMG, PCML, PCBLOCKSA, ""));
  if (!multigrid) PetscFunctionReturn(PETSC_SUCCESS);
  PC_MG_Levels **levels = ((PC_MG *)inner->data)->levels;

  if (levels) levels[levels[0]->levels - 1]->b = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Resets the inner KSP; some of PETSc's types keep freed vectors, or vectors of other sizes, after KSPReset(), and are created anew */
PetscErrorCode PCAinsworthResetKSP_Private(PC_Ainsworth *data)
{
  KSP       ksp = data->inner.ksp;
  PetscBool keeps;
  char      type[64];

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &keeps, KSPPIPEFCG, KSPLGMRES, KSPDGMRES, KSPPIPEGCR, AINSWORTH_FCG_OLD, ""));
  if (keeps) {
    PetscCall(PetscStrncpy(type, ((PetscObject)ksp)->type_name, sizeof(type)));
    PetscCall(KSPSetType(ksp, KSPPREONLY));
  }
  PetscCall(KSPReset(ksp));
  PetscCall(PCAinsworthReuseInner_Private(data, PETSC_FALSE));
  if (keeps) {
    PetscCall(KSPSetType(ksp, type));
    data->inner.configured = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthIteratesInKernel_Private - checks whether conjugate gradients iterate in Ker C; the paper's variant keeps C' B C in its operator */
PetscErrorCode PCAinsworthIteratesInKernel_Private(PC_Ainsworth *data, PetscBool *inKernel)
{
  KSPType   type;
  PetscBool projected, definite;

  PetscFunctionBegin;
  PetscCall(KSPGetType(data->inner.ksp, &type));
  PetscCall(PCAinsworthIsConjugateGradients_Private(type, &definite));
  PetscCall(PetscStrcmp(type, KSPPROJECTEDCG, &projected));
  *inKernel = (PetscBool)(data->saddle.constraints() && !data->saddle.D && data->saddle.adjoint &&
                          (projected || (definite && data->choices.variant == PC_AINSWORTH_WEIGHTED)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Attaches null space and near null space to the operator, for hypre, and to the preconditioning matrix, for GAMG, unless that is an earlier one */
static PetscErrorCode ForwardNullSpaces(PC_Ainsworth *data)
{
  MatNullSpace near, common;
  Mat          S = data->saddle.constraints() ? data->reduced.mat : data->saddle.A, M = data->age.type == PC_AINSWORTH_AGE_WHOLE ? S
                                                                                        : data->saddle.constraints()             ? data->inner.M
                                                                                                                                 : data->saddle.A;

  PetscFunctionBegin;
  if (S == data->saddle.block[AINSWORTH_BLOCK_A]) PetscFunctionReturn(PETSC_SUCCESS); /* the program's A has its own */
  PetscCall(AinsworthSaddleGetNearNullSpace(&data->saddle, &near));
  PetscCall(MatSetNearNullSpace(S, near));
  PetscCall(MatSetNearNullSpace(M, near));
  PetscCall(AinsworthSaddleCreateNullSpace(&data->saddle, &common));
  PetscCall(MatSetNullSpace(S, common));
  PetscCall(MatSetNullSpace(M, common));
  PetscCall(MatSetTransposeNullSpace(S, data->saddle.symmetric ? common : NULL));
  PetscCall(MatNullSpaceDestroy(&common));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthForgetOperators_Private - destroys what the method iterates with */
PetscErrorCode PCAinsworthForgetOperators_Private(PCAinsworthInner *inner)
{
  PetscFunctionBegin;
  PetscCall(PCDestroy(&inner->around));
  PetscCall(MatDestroy(&inner->operation));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes what the method iterates with: in Ker C an operator of its own; a preconditioner that has what M_* does not */
static PetscErrorCode Surround(PC_Ainsworth *data)
{
  PCAinsworthInner *in = &data->inner;
  PetscBool         inKernel;
  PC                inner;

  PetscFunctionBegin;
  PetscCall(PCAinsworthForgetOperators_Private(in));
  PetscCall(KSPGetPC(in->ksp, &inner));
  PetscCall(PCAinsworthIteratesInKernel_Private(data, &inKernel));
  if (inKernel) {
    PetscCall(AinsworthInKernelCreateOperator(data->reduced.mat, &in->operation));
    PetscCall(AinsworthInKernelCreatePC(data->reduced.mat, in->operation, inner, in->left, &in->around));
  } else if (data->saddle.D && !in->springs) PetscCall(AinsworthSpringsCreatePC(data->reduced.mat, inner, data->saddle.symmetric, &in->around));
  else PetscCall(AinsworthPlainCreatePC(inner, data->saddle.symmetric, &in->around));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthSetKSPOperators_Private - sets the operators of the inner solver: the reduced operator with M_*, or A alone */
PetscErrorCode PCAinsworthSetKSPOperators_Private(PC_Ainsworth *data)
{
  KSP       ksp = data->inner.ksp;
  PCSide    side;
  PetscBool inKernel;

  PetscFunctionBegin;
  if (data->saddle.constraints()) PetscCall(KSPSetOperators(ksp, data->reduced.mat, data->inner.M));
  else PetscCall(KSPSetOperators(ksp, data->saddle.A, data->inner.M ? data->inner.M : data->saddle.A));
  PetscCall(ForwardNullSpaces(data));
  if (data->reduced.mat) {
    PetscCall(KSPGetPCSide(ksp, &side));
    PetscCall(PCAinsworthIteratesInKernel_Private(data, &inKernel));
    PetscCall(MatAinsworthOmitPenalty_Private(data->reduced.mat, (PetscBool)((inKernel || side == PC_RIGHT) && !data->saddle.D)));
  }
  PetscCall(Surround(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthGetInnerPC_Private - gets the preconditioner that the program sees in the inner KSP, also during a solve */
PetscErrorCode PCAinsworthGetInnerPC_Private(const PC_Ainsworth *data, PC *inner)
{
  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->inner.ksp, inner));
  PetscCall(AinsworthGetInnermostPC(*inner, inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthEnter_Private - before a solve gives a KSP the operator and the preconditioner of the method; x: of a guess only the part in Ker C counts */
PetscErrorCode PCAinsworthEnter_Private(PC_Ainsworth *data, KSP ksp, Vec x)
{
  PetscBool fits, guess;
  PC        inner;
  Mat       operation, M;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetInnerPC_Private(data, &inner));
  PetscCall(AinsworthSurrounds(data->inner.around, inner, &fits));
  if (!fits) PetscCall(Surround(data)); /* the program has chosen another one since */
  PetscCall(PCGetOperators(inner, &operation, &M));
  PetscCall(PCSetOperators(data->inner.around, data->inner.operation ? data->inner.operation : operation, M));
  PetscCall(PCSetUp(data->inner.around));
  PetscCall(KSPGetInitialGuessNonzero(ksp, &guess));
  if (guess && data->inner.operation) PetscCall(MatAinsworthProject_Private(data->reduced.mat, x));
  PetscCall(KSPSetPC(ksp, data->inner.around));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthLeave_Private - after a solve gives the KSP its own preconditioner back */
PetscErrorCode PCAinsworthLeave_Private(const PC_Ainsworth *data, KSP ksp)
{
  PC inner;

  PetscFunctionBegin;
  PetscCall(AinsworthGetInnermostPC(data->inner.around, &inner));
  PetscCall(KSPSetPC(ksp, inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}
