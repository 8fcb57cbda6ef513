/*
   The block method: Rayleigh-Ritz on [X P W], W the preconditioned residuals of X (Knyazev 2001)

   All vectors meet the constraints, because the preconditioner's solutions do. The last wanted modes converge as fast
   as the vectors beyond them allow
*/
#include "epsainsworth.h"
#include "basis.h"
#include "../base/multivector.h"
#include <petscainsworth.h>
#include <slepc/private/epsimpl.h>
#include <cmath>

/*
   The shift as a part of the highest Ritz value, and the parts below and above which it is chosen again

   It takes as much from the gaps between the eigenvalues of the preconditioned pencil, which determine the convergence.
   With shifts of 0.1, 1e-2, 1e-3, 1e-5 of the highest Ritz value, 12 modes of a model with an RBE3 spider take 23, 16,
   16, 16 iterations; with 1e-7 the cycle loses free rigid modes to rounding
*/
static const PetscReal part = 1e-2, least = 1e-4, most = 0.1;

namespace
{
struct Run {
  EPS                    eps;
  AinsworthPencil       *pencil;
  AinsworthBasis         basis;
  bool                   automatic; /* the shift is chosen here */
  bool                   swapped;   /* the EPS has (M, K): its eigenvalues are 1/mu */
  std::vector<PetscReal> error;     /* of each Ritz vector */
  std::vector<char>      active;    /* whether it is iterated */
  AinsworthRef<Vec>      r, z, primal;
  PetscInt               stored = 0; /* modes that the EPS has of the present Ritz vectors */
};
} // namespace

namespace
{
/*
   Some vectors at once: residuals, which become products with K + sigma M; preconditioned ones; their products with M
*/
struct Some {
  PetscInt          n = 0;
  AinsworthRef<Mat> all[3];

  PetscErrorCode create(const Run *run, PetscInt vectors)
  {
    PetscInt rows;

    PetscFunctionBegin;
    n = vectors;
    PetscCall(VecGetLocalSize(run->r, &rows));
    PetscCall(
      MatCreateDense(PetscObjectComm((PetscObject)run->r), rows, PETSC_DECIDE, PETSC_DETERMINE, n, NULL, all[0].out()));
    for (int i : {1, 2}) PetscCall(MatDuplicate(all[0], MAT_DO_NOT_COPY_VALUES, all[i].out()));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  template <class F>
  PetscErrorCode withColumn(int i, PetscInt k, F f)
  {
    Vec v;

    PetscFunctionBegin;
    PetscCall(MatDenseGetColumnVec(all[i], k, &v));
    PetscCall(f(v));
    PetscCall(MatDenseRestoreColumnVec(all[i], k, &v));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* Calls f(z, K z, M z) */
  template <class F>
  PetscErrorCode withColumns(PetscInt k, F f)
  {
    PetscFunctionBegin;
    PetscCall(withColumn(0, k, [&](Vec Kz) {
      return withColumn(1, k, [&](Vec z) { return withColumn(2, k, [&](Vec Mz) { return f(z, Kz, Mz); }); });
    }));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* Preconditions the residuals, and makes the products without multipliers. Collective */
  PetscErrorCode precondition(Run *run)
  {
    PetscFunctionBegin;
    PetscCall(run->pencil->precondition(all[0], all[1]));
    for (PetscInt k = 0; k < n; k++)
      PetscCall(withColumn(1, k, [=](Vec z) { return run->pencil->removeMultipliers(z); }));
    PetscCall(run->pencil->multAll(all[1], all[0], all[2]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};
} // namespace

/* Appends z without its multipliers */
static PetscErrorCode Append(Run *run, Vec z)
{
  PetscFunctionBegin;
  PetscCall(run->pencil->removeMultipliers(z));
  PetscCall(run->pencil->multShifted(z, run->r));
  PetscCall(run->pencil->multMass(z, run->primal));
  PetscCall(run->basis.append(z, run->r, run->primal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Begins with vectors of the program, as near to them as the constraints allow, and with random loads */
static PetscErrorCode Start(Run *run)
{
  EPS_Ainsworth *ctx = (EPS_Ainsworth *)run->eps->data;
  Vec            x;
  PetscRandom    random;
  PetscReal      violation;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(run->z, &x));
  for (Vec v : ctx->initial) {
    if (run->basis.all() == run->eps->ncv) break;
    PetscCall(run->pencil->copy(v, x));
    PetscCall(run->pencil->removeMultipliers(x));
    PetscCall(run->pencil->multShifted(x, run->r));
    PetscCall(run->pencil->keepMultipliers(run->r)); /* C x */
    PetscCall(VecNorm(run->r, NORM_2, &violation));
    if (violation > 0.0) {
      PetscCall(run->pencil->precondition(run->r, run->z));
      PetscCall(VecAXPY(x, -1.0, run->z));
    }
    PetscCall(Append(run, x));
  }
  ctx->initial.clear();
  PetscCall(PetscRandomCreate(PetscObjectComm((PetscObject)run->eps), &random));
  PetscCall(PetscRandomSetInterval(random, -1.0, 1.0));
  while (run->basis.all() < run->eps->ncv) {
    Some s;

    PetscCall(s.create(run, PetscMin(AinsworthNarrow, run->eps->ncv - run->basis.all())));
    for (PetscInt k = 0; k < s.n; k++) {
      PetscCall(VecSetRandom(x, random));
      PetscCall(run->pencil->removeMultipliers(x));
      PetscCall(s.withColumn(0, k, [=](Vec r) { return run->pencil->multMass(x, r); }));
    }
    PetscCall(s.precondition(run));
    for (PetscInt k = 0; k < s.n; k++)
      PetscCall(s.withColumns(k, [=](Vec z, Vec Kz, Vec Mz) { return run->basis.append(z, Kz, Mz); }));
  }
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(VecDestroy(&x));
  PetscCall(run->basis.orthonormalize());
  PetscCall(run->basis.rayleighRitz({}));
  if (run->basis.size()) {
    PetscCall(run->basis.get(0, run->r));
    PetscCall(run->pencil->checkDefinite(run->r));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives the EPS its eigenvalue of Ritz vector j */
static void SetEigenvalue(Run *run, PetscInt j)
{
  const PetscReal mu = run->basis.ritz(j);

  run->eps->eigr[j] = run->swapped ? 1.0 / mu : mu - run->pencil->sigma();
  run->eps->eigi[j] = 0.0;
}

/*
   Estimates the error of Ritz vector j from its preconditioned residual z, without multipliers

   With x' K x = 1 and K = K + sigma M, an eigenvalue mu* has |mu - mu*| <= |K^{-1} r|_K mu*, and z stands for K^{-1} r.
   That r' z is the same without rounding; but r has the forces of the constraints, which are large
*/
static PetscErrorCode Measure(Run *run, PetscInt j, Vec z, Vec Kz)
{
  EPS             eps = run->eps;
  PetscScalar     square;
  const PetscReal mu = PetscAbsReal(run->basis.ritz(j));

  PetscFunctionBegin;
  PetscCall(VecDot(Kz, z, &square));
  run->error[j] = std::sqrt(PetscAbsScalar(square));
  SetEigenvalue(run, j);
  eps->errest[j] = run->error[j]; /* relative to lambda + sigma, as lambda may be 0 */
  if (eps->conv != EPS_CONV_REL)
    PetscCall((*eps->converged)(eps, eps->eigr[j], 0.0, run->error[j] * (run->swapped ? 1.0 / mu : mu), &eps->errest[j],
                                eps->convergedctx));
  run->active[j] = !(eps->errest[j] < eps->tol);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the residual of Ritz vector j, without C x, which is rounding */
static PetscErrorCode Residual(Run *run, PetscInt j, Vec r)
{
  PetscFunctionBegin;
  PetscCall(run->basis.residual(j, r));
  PetscCall(run->pencil->removeMultipliers(r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Measures vectors, and appends the preconditioned residuals of those that have not converged */
static PetscErrorCode MeasureSome(Run *run, const std::vector<PetscInt> &some)
{
  Some s;

  PetscFunctionBegin;
  PetscCall(s.create(run, (PetscInt)some.size()));
  for (PetscInt k = 0; k < s.n; k++) PetscCall(s.withColumn(0, k, [&](Vec r) { return Residual(run, some[k], r); }));
  PetscCall(s.precondition(run));
  for (PetscInt k = 0; k < s.n; k++)
    PetscCall(s.withColumns(k, [&](Vec z, Vec Kz, Vec Mz) {
      PetscFunctionBegin;
      PetscCall(Measure(run, some[k], z, Kz));
      if (run->active[some[k]]) PetscCall(run->basis.append(z, Kz, Mz));
      PetscFunctionReturn(PETSC_SUCCESS);
    }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Measures all vectors that have not converged, as many at once as the preconditioner has the memory for */
static PetscErrorCode Expand(Run *run)
{
  std::vector<PetscInt> some;

  PetscFunctionBegin;
  for (PetscInt j = 0, n = run->basis.size(); j < n; j++) {
    if (!run->basis.moves(j)) run->active[j] = 0;
    if (run->active[j]) some.push_back(j);
    else SetEigenvalue(run, j);
    if (some.size() < AinsworthNarrow && j + 1 < n) continue;
    if (some.size()) PetscCall(MeasureSome(run, some));
    some.clear();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the number of modes before the first that has not converged, and of all that there are */
static void Count(const Run *run, PetscInt *converged, PetscInt *all)
{
  *converged = *all = 0;
  while (*all < run->basis.size() && run->basis.moves(*all)) (*all)++;
  while (*converged < *all && !run->active[*converged]) (*converged)++;
}

/*
   Computes the first modes anew, and gives those that have converged to the EPS, with x' M x = 1, or x' K x = 1 for
   (M, K), and their multipliers; the others are iterated again
*/
static PetscErrorCode Store(Run *run, PetscInt n)
{
  Vec v, x;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(run->z, &x));
  for (PetscInt j = 0; j < n; j++) {
    PetscCall(run->basis.refresh(j));
    PetscCall(Residual(run, j, run->r));
    PetscCall(run->pencil->precondition(run->r, run->z));
    PetscCall(VecCopy(run->z, run->primal));
    PetscCall(run->pencil->removeMultipliers(run->primal));
    PetscCall(run->pencil->multShifted(run->primal, run->r));
    PetscCall(Measure(run, j, run->primal, run->r));
    if (run->active[j]) {
      PetscCall(run->pencil->multMass(run->primal, x));
      PetscCall(run->basis.append(run->primal, run->r, x));
      continue;
    }
    PetscCall(run->basis.get(j, x));
    /* (K + sigma M) z + C' l = r up to the preconditioner's error, which is z's */
    PetscCall(run->pencil->keepMultipliers(run->z));
    PetscCall(VecAXPY(x, -1.0, run->z));
    if (!run->swapped) PetscCall(VecScale(x, std::sqrt(run->basis.ritz(j)))); /* or x' K x = 1 */
    PetscCall(BVGetColumn(run->eps->V, j, &v));
    PetscCall(run->pencil->copy(x, v));
    PetscCall(BVRestoreColumn(run->eps->V, j, &v));
  }
  PetscCall(VecDestroy(&x));
  Count(run, &run->stored, &n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses the shift again if the highest Ritz value, once it is known to its order of magnitude, is far from it */
static PetscErrorCode Reshift(Run *run, PetscBool *changed)
{
  const PetscReal before = run->pencil->sigma();
  PetscInt        last, converged;
  PetscReal       lambda;

  PetscFunctionBegin;
  *changed = PETSC_FALSE;
  Count(run, &converged, &last);
  if (!run->automatic || !last) PetscFunctionReturn(PETSC_SUCCESS);
  lambda = run->basis.ritz(last - 1) - before;
  if (run->error[last - 1] * run->basis.ritz(last - 1) > lambda) PetscFunctionReturn(PETSC_SUCCESS);
  if (before <= most * lambda && before >= least * lambda) PetscFunctionReturn(PETSC_SUCCESS);
  *changed = PETSC_TRUE;
  PetscCall(PetscInfo(run->eps, "Shift %g becomes %g, as the highest Ritz value is %g\n", (double)before,
                      (double)(part * lambda), (double)lambda));
  PetscCall(run->pencil->changeShift(part * lambda));
  PetscCall(run->basis.changeShift(before, part * lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Chooses one cycle in place of a solve, once for each preconditioner and unless the program has chosen something; the
   preconditioner reads its options afterwards. Few unknowns, for which the plugin factors M_*, get a loose solve

   M_* knows nothing of long rows, which conjugate gradients move: two bodies with a contrast of 1e4 that six mean
   values hold together take 15 iterations then, and more than 100 with one application
*/
static PetscErrorCode ChooseMethod(EPS eps, KSP ksp, PetscObjectId *chosen)
{
  static const PetscInt  few   = 600; /* docs/method.md, inner solver */
  static const PetscReal loose = 1e-2, usual = 1e-8;
  PC                     pc;
  KSP                    inner;
  PetscObjectId          id;
  PetscReal              rtol;
  PetscBool              ours;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectGetId((PetscObject)pc, &id));
  if (id == *chosen) PetscFunctionReturn(PETSC_SUCCESS);
  *chosen = id;
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, KSPPROJECTEDCG, &ours));
  PetscCall(KSPGetTolerances(inner, &rtol, NULL, NULL, NULL));
  if (!ours || rtol != usual) PetscFunctionReturn(PETSC_SUCCESS);
  if (eps->n > few) PetscCall(KSPSetType(inner, KSPPREONLY));
  else PetscCall(KSPSetTolerances(inner, loose, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode EPSSolve_Ainsworth(EPS eps)
{
  EPS_Ainsworth *ctx = (EPS_Ainsworth *)eps->data;
  Run            run;
  PetscInt       all    = 0;
  PetscReal      lowest = 0.0, shift;
  KSP            ksp;
  Mat            K, M;

  PetscFunctionBegin;
  run.eps    = eps;
  run.pencil = &ctx->pencil;
  shift      = ctx->shift;
  if (shift < 0.0 && (eps->which == EPS_TARGET_MAGNITUDE || eps->which == EPS_TARGET_REAL) &&
      PetscRealPart(eps->target) < 0.0)
    shift = -PetscRealPart(eps->target);
  run.swapped   = EPSAinsworthIsSwapped_Private(eps);
  run.automatic = shift < 0.0 && !run.swapped;
  PetscCall(STGetKSP(eps->st, &ksp));
  PetscCall(EPSAinsworthGetMatrices_Private(eps, &K, &M));
  PetscCall(ChooseMethod(eps, ksp, &ctx->chosen));
  if (!run.swapped) PetscCall(AinsworthEstimateLowest(K, M, &lowest));
  PetscCall(ctx->pencil.build(K, M, ksp, run.automatic ? part * lowest : PetscMax(shift, 0.0)));
  PetscCall(ctx->pencil.createVec(run.r.out()));
  PetscCall(VecDuplicate(run.r, run.z.out()));
  PetscCall(VecDuplicate(run.r, run.primal.out()));
  PetscCall(run.basis.create(run.pencil, eps->ncv, run.swapped));
  PetscCall(Start(&run));
  run.error.assign(run.basis.size(), 0.0);
  run.active.assign(run.basis.size(), 1);
  while (eps->reason == EPS_CONVERGED_ITERATING) {
    PetscBool changed;

    run.stored = 0;
    PetscCall(Expand(&run));
    Count(&run, &eps->nconv, &all);
    if (eps->nconv >= PetscMin(eps->nev, all)) PetscCall(Store(&run, eps->nconv));
    Count(&run, &eps->nconv, &all);
    if (eps->its) PetscCall(EPSMonitor(eps, eps->its, eps->nconv, eps->eigr, eps->eigi, eps->errest, all));
    PetscCall((*eps->stopping)(eps, eps->its, eps->max_it, eps->nconv, PetscMin(eps->nev, all), &eps->reason,
                               eps->stoppingctx));
    if (eps->reason) break;
    eps->its++;
    PetscCall(Reshift(&run, &changed));
    if (changed) run.active.assign(run.basis.size(), 1);
    if (changed) continue;
    PetscCall(run.basis.orthonormalize());
    if (run.basis.all() == run.basis.size()) {
      PetscCall(PetscInfo(eps, "Nothing new in the preconditioned residuals\n"));
      eps->reason = EPS_DIVERGED_BREAKDOWN;
    } else PetscCall(run.basis.rayleighRitz(run.active));
    run.error.resize(run.basis.size(), 0.0);
    run.active.resize(run.basis.size(), 1);
  }
  if (all < eps->nev)
    PetscCall(PetscInfo(
      eps, "There are no more than %" PetscInt_FMT " modes of the %" PetscInt_FMT " that are wanted\n", all, eps->nev));
  if (run.stored < eps->nconv) PetscCall(Store(&run, eps->nconv));
  eps->nconv = run.stored;
  PetscFunctionReturn(PETSC_SUCCESS);
}
