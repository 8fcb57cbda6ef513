/* Operators of the inner solver, reuse of its preconditioner, and workarounds for PETSc's own types */
#include "solver.h"
#include "../base/layouts.h"
#include "../projection/inkernel.h"
#include "../multigrid/blocksa.h"
#include "../projection/matainsworth.h"
#include <petsc/private/pcmgimpl.h>

/*
   Takes the products with A from PCBLOCKSA, which stores half of the blocks, in place of those with the program's
   matrix; vectors of a device stay there, with the program's
*/
PetscErrorCode AinsworthSolverUseProduct(AinsworthSolver *solver)
{
  PC        inner;
  Mat       product, first = solver->saddle->P;
  PetscBool host;

  PetscFunctionBegin;
  PetscCall(AinsworthVecsOnHost(solver->saddle->A, &host));
  if (!solver->saddle->symmetric || !host) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  if (solver->saddle->constraints() && solver->inner.format == AINSWORTH_PMAT_SUM)
    PetscCall(MatCompositeGetMat(solver->inner.M, 0, &first));
  PetscCall(PCBlockSAGetProduct_Private(inner, &product));
  /* its levels are not those of A: they are of Pmat's block, or of a sum */
  if (!product || first != solver->saddle->A) {
    if (AinsworthSolverReducedMat(solver)) PetscCall(MatAinsworthSetProduct_Private(solver->reduced->mat, NULL));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (solver->saddle->constraints()) PetscCall(MatAinsworthSetProduct_Private(solver->reduced->mat, product));
  else PetscCall(KSPSetOperators(solver->inner.ksp, product, solver->saddle->A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks by some steps of conjugate gradients whether M looks positive definite

   hypre takes as many steps to estimate the largest eigenvalue for Chebyshev smoothing, and does not return if they
   give a NaN
*/
PetscErrorCode AinsworthSolverLooksDefinite(const AinsworthSolver *solver, Mat M, PetscBool *definite)
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
  /* Ker C = 0 needs no inner solve */
  if (solver->inner.format != AINSWORTH_PMAT_HYPRE || solver->saddle->constraints() == n)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateVecs(M, &diagonal, &r));
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
  /* steps of conjugate gradients mean nothing for other matrices */
  for (int k = 0; k < steps && *definite && solver->saddle->symmetric; k++) {
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
PetscErrorCode AinsworthSolverReuseInner(AinsworthSolver *solver, PetscBool keep)
{
  AinsworthSolverAge *age = &solver->age;
  PC                  inner;

  PetscFunctionBegin;
  if (!keep && age->type != PC_AINSWORTH_AGE_WHOLE) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  if (age->type != PC_AINSWORTH_AGE_WHOLE) PetscCall(PCGetReusePreconditioner(inner, &age->ownReuse));
  PetscCall(PCSetReusePreconditioner(inner, (PetscBool)(keep || age->ownReuse)));
  age->type = keep ? PC_AINSWORTH_AGE_WHOLE : PC_AINSWORTH_AGE_FRESH;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Repairs PCMG after an error in its cycle: it still holds the right-hand side of its caller in place of its own, and
   would destroy it
*/
PetscErrorCode AinsworthSolverAfterError(AinsworthSolver *solver)
{
  PC        inner;
  PetscBool multigrid;

  PetscFunctionBegin;
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &multigrid, PCMG, PCGAMG, PCML, PCBLOCKSA, ""));
  if (!multigrid) PetscFunctionReturn(PETSC_SUCCESS);
  PC_MG_Levels **levels = ((PC_MG *)inner->data)->levels;

  if (levels) levels[levels[0]->levels - 1]->b = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Resets the inner KSP, and its PC where another one is around that; some of PETSc's types keep freed vectors, or
   vectors of other sizes, after KSPReset(), and are created again
*/
PetscErrorCode AinsworthSolverResetKSP(AinsworthSolver *solver)
{
  KSP       ksp = solver->inner.ksp;
  PC        inner;
  PetscBool keeps;
  char      type[64];

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &keeps, KSPPIPEFCG, KSPLGMRES, KSPDGMRES, KSPPIPEGCR,
                                      AINSWORTH_FCG_OLD, ""));
  if (keeps) {
    PetscCall(PetscStrncpy(type, ((PetscObject)ksp)->type_name, sizeof(type)));
    PetscCall(KSPSetType(ksp, KSPPREONLY));
  }
  PetscCall(KSPReset(ksp));
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PCReset(inner));
  PetscCall(AinsworthSolverReuseInner(solver, PETSC_FALSE));
  if (keeps) {
    PetscCall(KSPSetType(ksp, type));
    solver->inner.configured = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverIteratesInKernel - checks whether conjugate gradients iterate in Ker C; the paper's variant keeps C' B
   C in its operator
*/
PetscErrorCode AinsworthSolverIteratesInKernel(AinsworthSolver *solver, PetscBool *inKernel)
{
  KSPType   type;
  PetscBool projected, definite;

  PetscFunctionBegin;
  PetscCall(KSPGetType(solver->inner.ksp, &type));
  PetscCall(AinsworthSolverIsConjugateGradients(type, &definite));
  PetscCall(PetscStrcmp(type, KSPPROJECTEDCG, &projected));
  *inKernel = (PetscBool)(solver->saddle->constraints() && !solver->saddle->kept.D && solver->saddle->adjoint &&
                          (projected || (definite && solver->choices.variant == PC_AINSWORTH_WEIGHTED)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Attaches null space and near null space to the operator, for hypre, and to the preconditioning matrix, for GAMG,
   unless that is an earlier one
*/
static PetscErrorCode ForwardNullSpaces(AinsworthSolver *solver)
{
  MatNullSpace near, common;
  Mat          S, M;

  PetscFunctionBegin;
  PetscCall(KSPGetOperators(solver->inner.ksp, &S, &M));
  if (solver->age.type == PC_AINSWORTH_AGE_WHOLE) M = S;
  PetscCall(AinsworthSaddleGetNearNullSpace(solver->saddle.get(), &near));
  PetscCall(AinsworthSaddleCreateNullSpace(solver->saddle.get(), &common));
  for (Mat mat : {S, M}) {
    /* those of the program have their own */
    if (mat == solver->saddle->block[AINSWORTH_BLOCK_A] || mat == solver->saddle->block[AINSWORTH_BLOCK_P]) continue;
    PetscCall(MatSetNearNullSpace(mat, near));
    PetscCall(MatSetNullSpace(mat, common));
    if (mat == S) PetscCall(MatSetTransposeNullSpace(S, solver->saddle->symmetric ? common : NULL));
  }
  PetscCall(MatNullSpaceDestroy(&common));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverForgetOperators - destroys what the method iterates with */
PetscErrorCode AinsworthSolverForgetOperators(AinsworthInner *inner)
{
  PetscFunctionBegin;
  inner->around.reset();
  inner->operation.reset();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes what the method iterates with: in Ker C an operator of its own; a preconditioner that has what M_* does not */
static PetscErrorCode Surround(AinsworthSolver *solver)
{
  AinsworthInner *in = &solver->inner;
  PetscBool       inKernel;
  PC              inner;

  PetscFunctionBegin;
  PetscCall(AinsworthSolverForgetOperators(in));
  PetscCall(KSPGetPC(in->ksp, &inner));
  PetscCall(AinsworthSolverIteratesInKernel(solver, &inKernel));
  if (inKernel) {
    PetscCall(AinsworthInKernelCreateOperator(solver->reduced->mat, in->operation.out()));
    PetscCall(AinsworthInKernelCreatePC(solver->reduced->mat, in->operation, inner, in->left, in->around.out()));
  } else if (solver->saddle->kept.D && !in->springs)
    PetscCall(AinsworthSpringsCreatePC(solver->reduced->mat, inner, solver->saddle->symmetric, in->around.out()));
  else PetscCall(AinsworthPlainCreatePC(inner, solver->saddle->symmetric, in->around.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverSetKSPOperators - sets the operators of the inner solver: the reduced operator with M_*, or A alone */
PetscErrorCode AinsworthSolverSetKSPOperators(AinsworthSolver *solver)
{
  KSP       ksp = solver->inner.ksp;
  PCSide    side;
  PetscBool inKernel;

  PetscFunctionBegin;
  if (solver->saddle->constraints()) PetscCall(KSPSetOperators(ksp, solver->reduced->mat, solver->inner.M));
  else PetscCall(KSPSetOperators(ksp, solver->saddle->A, solver->inner.M ? solver->inner.M : solver->saddle->P));
  PetscCall(ForwardNullSpaces(solver));
  if (AinsworthSolverReducedMat(solver)) {
    PetscCall(KSPGetPCSide(ksp, &side));
    PetscCall(AinsworthSolverIteratesInKernel(solver, &inKernel));
    PetscCall(MatAinsworthOmitPenalty_Private(solver->reduced->mat,
                                              (PetscBool)((inKernel || side == PC_RIGHT) && !solver->saddle->kept.D)));
  }
  PetscCall(Surround(solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverGetInnerPC - gets the preconditioner that the program sees in the inner KSP, also during a solve */
PetscErrorCode AinsworthSolverGetInnerPC(const AinsworthSolver *solver, PC *inner)
{
  PetscFunctionBegin;
  PetscCall(KSPGetPC(solver->inner.ksp, inner));
  PetscCall(AinsworthGetInnermostPC(*inner, inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverEnter - before a solve gives a KSP the operator and the preconditioner of the method; x: of a guess
   only the part in Ker C counts
*/
PetscErrorCode AinsworthSolverEnter(AinsworthSolver *solver, KSP ksp, Vec x)
{
  PetscBool fits, guess;
  PC        inner;
  Mat       operation, M;

  PetscFunctionBegin;
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(AinsworthSurrounds(solver->inner.around, inner, &fits));
  if (!fits) PetscCall(Surround(solver)); /* the program has chosen another one since */
  PetscCall(PCGetOperators(inner, &operation, &M));
  PetscCall(
    PCSetOperators(solver->inner.around, solver->inner.operation ? (Mat)solver->inner.operation : operation, M));
  PetscCall(PCSetUp(solver->inner.around));
  PetscCall(KSPGetInitialGuessNonzero(ksp, &guess));
  if (guess && solver->inner.operation) PetscCall(MatAinsworthProject_Private(solver->reduced->mat, x));
  PetscCall(KSPSetPC(ksp, solver->inner.around));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverLeave - after a solve gives the KSP its own preconditioner back */
PetscErrorCode AinsworthSolverLeave(const AinsworthSolver *solver, KSP ksp)
{
  PC inner;

  PetscFunctionBegin;
  PetscCall(AinsworthGetInnermostPC(solver->inner.around, &inner));
  PetscCall(KSPSetPC(ksp, inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}
