#include "together.h"
#include "columns.h"
#include "../multigrid/blocksa.h"
#include "../projection/inkernel.h"
#include <petsc/private/kspimpl.h> /* monitors */

/* More iterations suggest another rung of the ladder, which the solve for one right-hand side decides */
static const PetscInt most = 100;

PetscErrorCode AinsworthTogether::can(const AinsworthSolver *solver, PetscBool *can)
{
  const KSP      ksp = solver->inner.ksp;
  PC             inner;
  Mat            operation;
  MatNullSpace   null = NULL;
  KSPNormType    norm;
  PetscBool      cg, once, guess, usual, aij;
  PetscInt       n;
  Mat_Ainsworth *ctx = NULL;

  PetscFunctionBegin;
  *can = PETSC_FALSE;
  if (!solver->saddle || !solver->reduced || solver->settings.viewer ||
      solver->settings.stop != AINSWORTH_STOP_RESIDUAL || solver->saddle->sign || !solver->saddle->symmetric)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetSize(solver->reduced->rhs, &n));
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PCBlockSAIsUsual_Private(inner, &usual));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPPROJECTEDCG, KSPCG, ""));
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPPREONLY, &once));
  if (!usual || (!cg && !once) || solver->saddle->constraints() == n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetNormType(ksp, &norm));
  PetscCall(KSPGetInitialGuessNonzero(ksp, &guess));
  PetscCall(KSPGetOperators(ksp, &operation, NULL));
  if (solver->saddle->constraints() && !once) {
    PetscCall(MatAinsworthGetContext_Private(solver->reduced->mat, &ctx));
    operation = solver->inner.operation;
    if (!operation || ctx->doubtful || ctx->proj.polynomial || ctx->proj.B != ctx->proj.C) /* or not in Ker C */
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetNullSpace(operation, &null));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)solver->saddle->A, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  *can = (PetscBool)((once || norm == KSP_NORM_NATURAL) && !guess && !null && aij && !solver->saddle->kept.D &&
                     ksp->converged == KSPConvergedDefault && !ksp->numbermonitors);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up what the preconditioner corrects, as the first solve for one right-hand side does */
PetscErrorCode AinsworthTogether::findDeflation()
{
  const KSP                 ksp = solver->inner.ksp;
  const AinsworthDeflation *found;
  PetscErrorCode            error;

  PetscFunctionBegin;
  PetscCall(AinsworthSolverEnter(solver, ksp, NULL)); /* there is no guess */
  error = PCPreSolve(solver->inner.around, ksp);      /* checked when everything is restored */
  if (!error) error = PCPostSolve(solver->inner.around, ksp);
  PetscCall(AinsworthSolverLeave(solver, ksp));
  PetscCall(error);
  PetscCall(AinsworthInKernelGetDeflation(solver->inner.around, &found));
  if (found->empty()) PetscFunctionReturn(PETSC_SUCCESS);
  deflation = found;
  PetscCall(VecDuplicate(r, rest.out()));
  PetscCall(VecDuplicate(solver->reduced->rhs, v.out()));
  PetscCall(VecDuplicate(solver->reduced->rhs, w.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthTogether::create(AinsworthSolver *of, PetscInt vectors)
{
  PC        inner;
  Mat       op;
  PetscBool once;

  PetscFunctionBegin;
  solver   = of;
  width    = vectors;
  projects = solver->saddle->constraints() && solver->inner.operation;
  PetscCall(PetscObjectTypeCompare((PetscObject)solver->inner.ksp, KSPPREONLY, &once));
  if (projects) {
    Mat_Ainsworth *ctx;

    PetscCall(MatAinsworthGetContext_Private(solver->reduced->mat, &ctx));
    op = ctx->product ? ctx->product : ctx->A;
    PetscCall(projector.create(&ctx->proj, width));
  } else PetscCall(KSPGetOperators(solver->inner.ksp, &op, NULL));
  if (!once) PetscCall(AinsworthWidenMat(op, width, A.out()));
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PCBlockSAWiden_Private(inner, width, cycle.out()));
  PetscCall(AinsworthMultivectorCreate(solver->reduced->rhs, width, r.out()));
  PetscCall(VecDuplicate(r, x.out()));
  if (projects) PetscCall(findDeflation());
  PetscCall(PetscObjectGetId((PetscObject)(PC)solver->inner.around, &around));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthTogether::again(PetscInt vectors, PetscBool *can)
{
  PetscObjectId now;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)(PC)solver->inner.around, &now));
  *can = (PetscBool)(now == around && vectors == width);
  if (!*can) PetscFunctionReturn(PETSC_SUCCESS);
  columns.assign(width, AinsworthTogetherColumn());
  PetscCall(VecZeroEntries(r));
  f.reset();
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthTogether::set(PetscInt k, Vec rhs, AinsworthSaddleVec fields, bool homogeneous,
                                      PetscReal energy)
{
  PetscReal norm;

  PetscFunctionBegin;
  PetscCall(VecNorm(rhs, NORM_2, &norm));
  columns[k].scale = AinsworthInversePower(norm, 1); /* single precision has one scale for all */
  PetscCall(VecScale(rhs, columns[k].scale));
  PetscCall(VecStrideScatter(rhs, k, r, INSERT_VALUES));
  if (homogeneous) PetscFunctionReturn(PETSC_SUCCESS);
  if (!f) {
    PetscCall(VecDuplicate(r, f.out()));
    PetscCall(VecZeroEntries(f));
  }
  PetscCall(VecStrideScatter(fields.primal, k, f, INSERT_VALUES));
  PetscCall(AinsworthVecClone(fields.dual, columns[k].g.out()));
  columns[k].energy = energy * columns[k].scale * columns[k].scale;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthTogether::get(PetscInt k, Vec v) const
{
  PetscFunctionBegin;
  PetscCall(VecStrideGather(x, k, v, INSERT_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthTogether::getProduct(PetscInt k, Vec Ax) const
{
  PetscFunctionBegin;
  PetscCall(VecStrideGather(z, k, Ax, INSERT_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets x of a right-hand side from its present iterate in Ker C */
PetscErrorCode AinsworthTogether::complete(PetscInt k, Vec to) const
{
  Vec g = columns[k].g;

  PetscFunctionBegin;
  PetscCall(VecStrideGather(x, k, to, INSERT_VALUES));
  PetscCall(VecScale(to, 1.0 / columns[k].scale));
  if (!solver->saddle->constraints()) PetscFunctionReturn(PETSC_SUCCESS);
  if (g) PetscCall(MatAinsworthComplete_Private(solver->reduced->mat, g, to));
  else PetscCall(MatAinsworthProject_Private(solver->reduced->mat, to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the scaled energy of x, and of its rounding */
PetscErrorCode AinsworthTogether::energyOf(PetscInt k, PetscReal *energy, PetscReal *rounding)
{
  Vec v = NULL, work[2] = {};

  PetscFunctionBegin;
  for (Vec *made : {&v, &work[0], &work[1]}) PetscCall(VecDuplicate(solver->reduced->rhs, made));
  PetscCall(complete(k, v));
  PetscCall(AinsworthEnergy(solver->saddle->A, solver->reduced->inverseDiagonal, v, work, energy, rounding));
  for (PetscReal *value : {energy, rounding}) *value *= columns[k].scale * columns[k].scale;
  for (Vec *made : {&v, &work[0], &work[1]}) PetscCall(VecDestroy(made));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y = Q' A x for an x in Ker C */
PetscErrorCode AinsworthTogether::multiply(Vec from, Vec to) const
{
  PetscFunctionBegin;
  PetscCall(MatMult(A, from, to));
  if (projects) PetscCall(projector.project(true, to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes z = Q M^{-1} r with the corrections */
PetscErrorCode AinsworthTogether::preconditionAndCorrect(Vec from, Vec to) const
{
  std::vector<std::vector<PetscScalar>> parts(width);

  PetscFunctionBegin;
  for (PetscInt k = 0; k < width; k++) {
    PetscCall(VecStrideGather(from, k, v, INSERT_VALUES));
    PetscCall(deflation->before(v, &parts[k], w));
    PetscCall(VecStrideScatter(w, k, rest, INSERT_VALUES));
  }
  PetscCall(PCApply(cycle, rest, to));
  for (PetscInt k = 0; k < width; k++) {
    PetscCall(VecStrideGather(rest, k, v, INSERT_VALUES));
    PetscCall(VecStrideGather(to, k, w, INSERT_VALUES));
    PetscCall(deflation->after(solver->reduced->mat, v, parts[k], w));
    PetscCall(VecStrideScatter(w, k, to, INSERT_VALUES));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes z = Q M^{-1} r */
PetscErrorCode AinsworthTogether::precondition(Vec from, Vec to) const
{
  PetscFunctionBegin;
  if (deflation) {
    PetscCall(preconditionAndCorrect(from, to));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PCApply(cycle, from, to));
  if (projects) PetscCall(projector.project(false, to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Conjugate gradients for each right-hand side, as KSPCG with the natural norm, with PETSc's test and then that
   relative to x (report/stop.cpp). One that breaks down is left for a solve by itself
*/
template <int W>
PetscErrorCode AinsworthTogether::iterate()
{
  const KSP                       ksp = solver->inner.ksp;
  AinsworthValues<W>              rz, next, pAp, xf;
  std::array<PetscReal, W>        first, bound, energy = {}; /* x' A x, which grows by alpha r' z in each step */
  std::array<AinsworthLanczos, W> lanczos;
  std::array<char, W>             active;
  int                             left = W;

  PetscFunctionBegin;
  active.fill(1);
  auto end = [&](int k, KSPConvergedReason reason, PetscInt step) {
    columns[k].reason     = reason;
    columns[k].iterations = step;
    active[k]             = 0;
    left--;
  };
  for (AinsworthRef<Vec> *made : {&p, &z})
    if (!*made) PetscCall(VecDuplicate(r, made->out()));
  PetscCall(VecZeroEntries(x));
  PetscCall(precondition(r, z));
  PetscCall(AinsworthDots<W>(z, r, &rz));
  for (int k = 0; k < W; k++) {
    first[k] = columns[k].norm = PetscSqrtReal(PetscAbsScalar(rz[k]));
    bound[k]                   = PetscMax(ksp->rtol * first[k], ksp->abstol * columns[k].scale);
    if (!(PetscRealPart(rz[k]) >= 0.0)) end(k, KSP_CONVERGED_ITERATING, 0);
    else if (first[k] <= ksp->abstol * columns[k].scale) end(k, KSP_CONVERGED_ATOL, 0);
  }
  PetscCall(VecCopy(z, p));
  for (PetscInt step = 1; left && step <= PetscMin(most, ksp->max_it); step++) {
    AinsworthValues<W> alpha = AinsworthAll<W>(0.0), beta = AinsworthAll<W>(0.0), minus;
    bool               reached = false;

    PetscCall(multiply(p, z));
    PetscCall(AinsworthDots<W>(z, p, &pAp));
    for (int k = 0; k < W; k++)
      if (active[k] && !(PetscRealPart(pAp[k]) > 0.0)) end(k, KSP_CONVERGED_ITERATING, step);
      else if (active[k]) alpha[k] = PetscRealPart(rz[k]) / PetscRealPart(pAp[k]);
    for (int k = 0; k < W; k++) minus[k] = -alpha[k];
    PetscCall(AinsworthCombine<W>(alpha, p, AinsworthAll<W>(1.0), x));
    PetscCall(AinsworthCombine<W>(minus, z, AinsworthAll<W>(1.0), r));
    PetscCall(precondition(r, z));
    PetscCall(AinsworthDots<W>(z, r, &next));
    for (int k = 0; k < W; k++) {
      if (!active[k]) continue;
      if (!(PetscRealPart(next[k]) >= 0.0)) {
        end(k, KSP_CONVERGED_ITERATING, step);
        continue;
      }
      columns[k].norm = PetscSqrtReal(PetscRealPart(next[k]));
      beta[k]         = PetscRealPart(next[k]) / PetscRealPart(rz[k]);
      energy[k] += PetscRealPart(alpha[k]) * PetscRealPart(rz[k]);
      lanczos[k].alpha.push_back(PetscRealPart(alpha[k]));
      lanczos[k].beta.push_back(PetscRealPart(beta[k]));
      if (columns[k].norm <= bound[k]) reached = true;
    }
    if (reached && f) PetscCall(AinsworthDots<W>(x, f, &xf));
    for (int k = 0; k < W && reached; k++) {
      PetscReal ritz = 0.0;

      if (!active[k] || columns[k].norm > bound[k]) continue;
      if (projects && energy[k] > 0.0) {
        PetscReal own = energy[k], rounding = 0.0;

        if (columns[k].g && !AinsworthIsLarge(columns[k].energy, columns[k].scale * PetscRealPart(xf[k]), energy[k]))
          PetscCall(energyOf(k, &own, &rounding));
        PetscCall(lanczos[k].smallest(&ritz));
        const PetscReal relative = AinsworthResidualBound(ksp->rtol, energy[k], own, rounding, first[k], ritz);
        if (columns[k].norm > relative) {
          bound[k] = PetscMax(relative, ksp->abstol * columns[k].scale);
          continue;
        }
      }
      end(k, KSP_CONVERGED_RTOL, step);
    }
    for (int k = 0; k < W; k++)
      if (active[k]) rz[k] = next[k];
    PetscCall(AinsworthCombine<W>(AinsworthAll<W>(1.0), z, beta, p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the solutions by x, with C x = g, and multiplies them by the program's A */
PetscErrorCode AinsworthTogether::finish()
{
  const Vec v = solver->reduced->rhs;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < width; k++) {
    if (!columns[k].reason) continue;
    PetscCall(complete(k, v));
    PetscCall(VecStrideScatter(v, k, x, INSERT_VALUES));
    columns[k].norm /= columns[k].scale;
  }
  if (!solver->saddle->constraints()) PetscFunctionReturn(PETSC_SUCCESS);
  if (!program) PetscCall(AinsworthWidenMat(solver->saddle->A, width, program.out()));
  if (!z) PetscCall(VecDuplicate(r, z.out()));
  PetscCall(MatMult(program, x, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthTogether::solve()
{
  PetscBool once;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)solver->inner.ksp, KSPPREONLY, &once));
  if (once) {
    PetscCall(precondition(r, x));
    for (AinsworthTogetherColumn &column : columns) {
      column.reason     = KSP_CONVERGED_ITS;
      column.iterations = 1;
    }
  } else if (width == AinsworthNarrow) PetscCall(iterate<AinsworthNarrow>());
  else PetscCall(iterate<AinsworthWidest>());
  PetscCall(finish());
  PetscFunctionReturn(PETSC_SUCCESS);
}
