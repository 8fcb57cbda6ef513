/* Explanations of failed set-ups and solves: the cause first, then what to do */
#include "diagnose.h"
#include "../projection/projectedcg.h"
#include "../base/eigen.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../projection/matainsworth.h"

/* Copies a small matrix to each rank, column by column; collective */
static PetscErrorCode Gather(Mat M, PetscInt n, PetscScalar values[])
{
  Mat aij;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(values, n * n));
  PetscCall(AinsworthGetAIJ(M, &aij));
  PetscCall(AinsworthForRows(aij, [=](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n; k++) values[row.number + row.j[k] * n] = row.a[k];
  }));
  PetscCall(MatDestroy(&aij));
  PetscCall(
    MPIU_Allreduce(MPI_IN_PLACE, values, (PetscMPIInt)(n * n), MPIU_SCALAR, MPIU_SUM, PetscObjectComm((PetscObject)M)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes the entries that belong to unknowns which only the levels have: they come last on each rank. Collective */
static PetscErrorCode OwnUnknowns(const AinsworthSolver *solver, Vec *y)
{
  Vec                own;
  PetscInt           n;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(solver->reduced->inverseDiagonal, &own));
  PetscCall(VecGetLocalSize(own, &n));
  PetscCall(VecGetArrayRead(*y, &from));
  PetscCall(VecGetArrayWrite(own, &to));
  std::copy(from, from + n, to);
  PetscCall(VecRestoreArrayWrite(own, &to));
  PetscCall(VecRestoreArrayRead(*y, &from));
  PetscCall(VecDestroy(y));
  *y = own;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the softest motion on the coarsest level of multigrid, interpolated to the finest: if a body floats, it is one
   of its rigid motions

   y is NULL if the preconditioner has no levels. BoomerAMG is not asked: it gives its levels away, and crashes when it
   is applied, or asked, without them.
*/
static PetscErrorCode SoftestCoarseMotion(AinsworthSolver *solver, PC inner, Vec *y)
{
  static const PetscInt largest = 2000;
  PetscInt              n, levels;
  PetscBool             hypre, made;
  Mat                  *P, *M;
  Vec                   fine, coarse;
  PetscErrorCode (*has)(PC, PetscInt *, Mat *[]);

  PetscFunctionBegin;
  *y = NULL;
  PetscCall(PetscObjectQueryFunction((PetscObject)inner, "PCGetCoarseOperators_C", &has));
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, PCHYPRE, &hypre));
  PetscCall(PCGetOperatorsSet(inner, NULL, &made));
  if (!has || hypre || !made) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCGetCoarseOperators(inner, &levels, &M));
  PetscCall(PCGetInterpolations(inner, &levels, &P));
  levels = PetscMax(levels, 1) - 1; /* there is one less of each than of levels */
  n      = largest + 1;
  if (levels) PetscCall(MatGetSize(M[0], &n, NULL));
  if (n <= largest) {
    std::vector<PetscScalar> a((size_t)n * n);
    std::vector<PetscReal>   values(n), scale(n);
    PetscBLASInt             info;
    PetscInt                 start;

    PetscCall(Gather(M[0], n, a.data()));
    for (PetscInt i = 0; i < n; i++)
      scale[i] = 1.0 / PetscSqrtReal(PetscMax(PetscAbsScalar(a[i + i * n]), PETSC_SMALL));
    for (PetscInt j = 0; j < n; j++)
      for (PetscInt i = 0; i < n; i++) a[i + j * n] *= scale[i] * scale[j];
    PetscCall(AinsworthHermitianEigen(n, a.data(), values.data(), &info));
    PetscCall(AinsworthCreateVecs(P[0], &coarse, NULL));
    PetscCall(VecGetOwnershipRange(coarse, &start, NULL));
    /* eigenvalues ascend */
    PetscCall(AinsworthUpdate(
      coarse, [&](PetscInt i, PetscScalar &value) { value = info ? 0.0 : a[start + i] * scale[start + i]; }));
    for (PetscInt l = 0; l < levels; l++) {
      PetscCall(AinsworthCreateVecs(P[l], NULL, &fine));
      PetscCall(MatMult(P[l], coarse, fine));
      PetscCall(VecDestroy(&coarse));
      coarse = fine;
    }
    PetscCall(OwnUnknowns(solver, &coarse));
    *y = coarse;
  }
  for (PetscInt l = 0; l < levels; l++) {
    PetscCall(MatDestroy(&M[l]));
    PetscCall(MatDestroy(&P[l]));
  }
  PetscCall(PetscFree(M));
  PetscCall(PetscFree(P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the unit vector of the unknown with the smallest diagonal entry of A */
static PetscErrorCode SmallestDiagonal(Mat A, Vec *y)
{
  Vec       diagonal;
  PetscReal smallest;
  PetscInt  where;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateDiagonal(A, &diagonal));
  PetscCall(VecDuplicate(diagonal, y));
  if (PetscDefined(USE_COMPLEX)) PetscCall(VecRealPart(diagonal));
  PetscCall(VecMin(diagonal, &where, &smallest));
  PetscCall(VecSetValue(*y, where, 1.0, INSERT_VALUES)); /* all ranks set the same value */
  PetscCall(VecAssemblyBegin(*y));
  PetscCall(VecAssemblyEnd(*y));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Looks for a motion in Ker C that has no energy, or a negative one; *quotient: the smallest energy found

   Tries the iterate x, which grows in its direction, the softest motion that multigrid knows, the unknown with the
   smallest diagonal entry, and the direction in which conjugate gradients met no positive energy
*/
static PetscErrorCode LookForMotion(AinsworthSolver *solver, KSP ksp, Vec x, PetscReal *quotient)
{
  Vec                direction, tried[4] = {NULL, NULL, NULL, NULL};
  PetscReal          found;
  PC                 inner;
  KSPConvergedReason ended;

  PetscFunctionBegin;
  *quotient = 1.0;
  if (!solver->saddle->symmetric) PetscFunctionReturn(PETSC_SUCCESS);
  if (x) PetscCall(AinsworthVecClone(x, &tried[0]));
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(SoftestCoarseMotion(solver, inner, &tried[1]));
  PetscCall(SmallestDiagonal(solver->saddle->A, &tried[2]));
  PetscCall(KSPProjectedCGGetDirection_Private(ksp, &direction));
  PetscCall(KSPGetConvergedReason(ksp, &ended));
  if (x && direction && ended == KSP_DIVERGED_INDEFINITE_MAT) PetscCall(AinsworthVecClone(direction, &tried[3]));
  for (Vec &y : tried) {
    if (!y) continue;
    PetscCall(AinsworthSolverRayleighQuotient(solver, y, &found));
    *quotient = PetscMin(*quotient, found);
    PetscCall(VecDestroy(&y));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names options of the outer KSP that the program may have meant for the reduced solve */
static PetscErrorCode MisplacedOptions(PC pc, const AinsworthSolver *solver, char text[], size_t len)
{
  const char *const names[] = {"-ksp_rtol", "-ksp_max_it", "-ksp_atol"};
  const char       *prefix;
  PetscOptions      options;

  PetscFunctionBegin;
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PetscObjectGetOptions((PetscObject)pc, &options));
  text[0] = 0;
  for (const char *name : names) {
    PetscBool outside, inside;

    PetscCall(PetscOptionsHasName(options, prefix, name, &outside));
    PetscCall(PetscOptionsHasName(options, AinsworthSolverPrefix(solver), name, &inside));
    if (!outside || inside || text[0]) continue;
    PetscCall(PetscSNPrintf(text, len, "; -%s%s is that of the outer solver, the reduced solve has -%s%s",
                            prefix ? prefix : "", name + 1, AinsworthSolverPrefix(solver), name + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the reason of the last solve with the Gram matrix, the worst of all ranks; not negative if there was none;
   collective
*/
static PetscErrorCode GramReason(const AinsworthSolver *solver, KSPConvergedReason *reason)
{
  const AinsworthGram *gram;
  KSP                  ksp   = NULL;
  PetscMPIInt          worst = 0;

  PetscFunctionBegin;
  if (AinsworthSolverReducedMat(solver)) {
    PetscCall(MatAinsworthGetGram_Private(solver->reduced->mat, &gram));
    ksp = AinsworthGramGetKSP(gram);
  }
  if (ksp) PetscCall(KSPGetConvergedReason(ksp, reason));
  if (ksp) worst = (PetscMPIInt)*reason;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_INT, MPI_MIN, PetscObjectComm((PetscObject)solver->inner.ksp)));
  *reason = (KSPConvergedReason)worst;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Explains a reduced solve that ended with `reason`, as far as possible; a positive reason failed the verification

   x: the last iterate or NULL
*/
PetscErrorCode AinsworthExplain(PC pc, AinsworthSolver *solver, KSP ksp, Vec x, KSPConvergedReason reason, char why[],
                                size_t len)
{
  PetscInt           iterations;
  PetscReal          quotient, residual;
  PetscBool          definite;
  char               misplaced[256];
  const char        *prefix = AinsworthSolverPrefix(solver);
  PC                 inner;
  PCType             type;
  PCFailedReason     failed;
  KSPConvergedReason gram;

  PetscFunctionBegin;
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PCGetType(inner, &type));
  PetscCall(PCGetFailedReason(inner, &failed));
  PetscCall(KSPGetIterationNumber(ksp, &iterations));
  PetscCall(KSPGetResidualNorm(ksp, &residual));
  PetscCall(AinsworthSolverIsConjugateGradients(AinsworthTypeName((PetscObject)solver->inner.ksp), &definite));
  PetscCall(GramReason(solver, &gram));
  if (gram < 0) {
    PetscCall(PetscSNPrintf(
      why, len,
      "Solves with the Gram matrix S = C W C' do not converge (%s): change the options -%sgram_ksp and -%sgram_pc",
      KSPConvergedReasons[gram], prefix, prefix));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(LookForMotion(solver, ksp, x, &quotient));
  PetscCall(MisplacedOptions(pc, solver, misplaced, sizeof(misplaced)));
  if (PetscAbsReal(quotient) <= AinsworthNoEnergy)
    PetscCall(PetscSNPrintf(why, len,
                            "A body floats that no constraint holds: A is singular on Ker C, y' A y is %g of y' "
                            "diag(A) y for a y with C y = 0; hold it, or attach "
                            "its motions to the matrix with MatSetNullSpace() (%s)",
                            (double)quotient, KSPConvergedReasons[reason]));
  else if (reason == KSP_DIVERGED_INDEFINITE_MAT && !(quotient < AinsworthNegative))
    PetscCall(PetscSNPrintf(why, len,
                            "The reduced operator is not positive definite, or not beyond rounding (%s): conjugate "
                            "gradients need it to be; -%sksp_type gmres "
                            "does not",
                            KSPConvergedReasons[reason], prefix));
  else if (quotient < AinsworthNegative)
    PetscCall(PetscSNPrintf(why, len,
                            "A is indefinite on Ker C (%s): conjugate gradients need it to be positive definite there; "
                            "-%sksp_type gmres does not",
                            KSPConvergedReasons[reason], prefix));
  else if (reason >= 0) PetscFunctionReturn(PETSC_SUCCESS); /* the verification has set the text */
  else if (reason == KSP_DIVERGED_PC_FAILED)
    PetscCall(PetscSNPrintf(why, len, "The inner preconditioner, of type %s, failed (%s): try another -%spc_type", type,
                            PCFailedReasons[failed], prefix));
  else if (!solver->saddle->symmetric && definite)
    PetscCall(PetscSNPrintf(
      why, len, "A is not symmetric, and the reduced solve failed (%s): -%sksp_type gmres does not need it to be%s",
      KSPConvergedReasons[reason], prefix, misplaced));
  else if (reason == KSP_DIVERGED_INDEFINITE_PC)
    PetscCall(PetscSNPrintf(why, len,
                            "The inner preconditioner, of type %s, is not positive definite (%s): try another "
                            "-%spc_type, or -%sksp_type gmres",
                            type, KSPConvergedReasons[reason], prefix, prefix));
  else if (reason == KSP_DIVERGED_BREAKDOWN)
    PetscCall(PetscSNPrintf(why, len,
                            "The reduced solve stagnates (%s) after %" PetscInt_FMT
                            " iterations, at a residual of %g: try another -%spc_type, or a "
                            "tolerance that rounding allows",
                            KSPConvergedReasons[reason], iterations, (double)residual, prefix));
  else
    PetscCall(PetscSNPrintf(why, len,
                            "The reduced solve ended without convergence (%s) after %" PetscInt_FMT
                            " iterations, with a residual of %g%s",
                            KSPConvergedReasons[reason], iterations, (double)residual, misplaced));
  PetscFunctionReturn(PETSC_SUCCESS);
}
