#include "deflation.h"
#include "../base/layouts.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "matainsworth.h"

/*
   Each row costs an application of the preconditioner and a vector; if there are more rows, they are left to the
   projector
*/
static const size_t mostLongRows = 16;
/*
   A row is dependent if the Cholesky factorization of C L leaves at most this part of its diagonal entry; then nothing
   is done
*/
static const PetscReal dependentRow = 1e-6;
/* A motion is dropped if the preconditioner and the motions before it leave at most this part of its energy */
static const PetscReal dependentMotion = 1e-10;

PetscErrorCode AinsworthDeflation::clear()
{
  PetscFunctionBegin;
  PetscCall(longRows.clear());
  for (std::vector<Vec> *vecs : {&motions, &forces}) {
    for (Vec &v : *vecs) PetscCall(VecDestroy(&v));
    vecs->clear();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

AinsworthDeflation::~AinsworthDeflation()
{
  (void)clear();
}

/*
   Gets the adjoints of the rows of C with more than `longest` entries on all ranks, or none if there are too many.
   Collective
*/
static PetscErrorCode GetLongRows(Mat C, PetscInt longest, std::vector<Vec> *rows)
{
  PetscInt              found;
  std::vector<PetscInt> mine, all;

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    if (row.n > longest) mine.push_back(row.number);
  }));
  found = (PetscInt)mine.size();
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)C)));
  if ((size_t)found > mostLongRows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)C), mine, &all));
  PetscCall(AinsworthGetRows(C, all, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthDeflation::before(Vec r, std::vector<PetscScalar> *parts, Vec rest) const
{
  const PetscInt           n = (PetscInt)motions.size();
  std::vector<PetscScalar> factors;

  PetscFunctionBegin;
  parts->resize(n);
  if (rest != r) PetscCall(VecCopy(r, rest));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecMDot(r, n, motions.data(), parts->data()));
  for (PetscScalar part : *parts) factors.push_back(-part);
  PetscCall(VecMAXPY(rest, n, factors.data(), const_cast<Vec *>(forces.data())));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthDeflation::after(Mat reduced, Vec rest, const std::vector<PetscScalar> &parts, Vec z) const
{
  const PetscInt           n = (PetscInt)motions.size(), m = (PetscInt)longRows.lifted.size();
  std::vector<PetscScalar> factors(n), left(m);

  PetscFunctionBegin;
  if (m) {
    PetscCall(VecMDot(rest, m, longRows.lifted.data(), left.data()));
    PetscCall(longRows.correct(left, z));
  }
  PetscCall(MatAinsworthProject_Private(reduced, z));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecMDot(z, n, forces.data(), factors.data()));
  for (PetscInt k = 0; k < n; k++) factors[k] = parts[k] - factors[k];
  PetscCall(VecMAXPY(z, n, factors.data(), const_cast<Vec *>(motions.data())));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthDeflation::apply(PC inner, Mat reduced, Vec r, Vec z) const
{
  std::vector<PetscScalar> parts;
  Vec                      rest = r;

  PetscFunctionBegin;
  if (motions.size()) PetscCall(VecDuplicate(r, &rest));
  PetscCall(before(r, &parts, rest));
  PetscCall(PCApply(inner, rest, z));
  PetscCall(after(reduced, rest, parts, z));
  if (rest != r) PetscCall(VecDestroy(&rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y = Q' A x for an x in Ker C, and the energy x' y */
static PetscErrorCode Multiply(Mat operation, Vec x, Vec y, PetscReal *energy)
{
  PetscScalar product;

  PetscFunctionBegin;
  PetscCall(MatMult(operation, x, y));
  PetscCall(VecDot(y, x, &product));
  *energy = PetscRealPart(product);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes Z and Y with the preconditioner that has L already; motions without energy and unknowns that C holds have no
   columns
*/
PetscErrorCode AinsworthDeflation::move(PC inner, Mat reduced, Mat operation, const std::vector<PetscInt> &shared)
{
  Vec answer;

  PetscFunctionBegin;
  if (shared.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateVecs(operation, &answer, NULL));
  for (PetscInt unknown : shared) {
    Vec       motion, force;
    PetscInt  rstart, rend;
    PetscReal all = 0.0, left = 0.0;

    PetscCall(AinsworthCreateVecs(operation, &motion, &force));
    PetscCall(VecZeroEntries(motion));
    PetscCall(VecGetOwnershipRange(motion, &rstart, &rend));
    if (unknown >= rstart && unknown < rend) PetscCall(VecSetValue(motion, unknown, 1.0, INSERT_VALUES));
    PetscCall(VecAssemblyBegin(motion));
    PetscCall(VecAssemblyEnd(motion));
    PetscCall(MatAinsworthProject_Private(reduced, motion));
    PetscCall(Multiply(operation, motion, force, &all));
    PetscCall(apply(inner, reduced, force, answer));
    PetscCall(VecAXPY(motion, -1.0, answer)); /* now orthogonal to the motions before it */
    PetscCall(Multiply(operation, motion, force, &left));
    if (left > dependentMotion * all) {
      for (Vec v : {motion, force}) PetscCall(VecScale(v, 1.0 / PetscSqrtReal(left)));
      motions.push_back(motion);
      forces.push_back(force);
    } else {
      PetscCall(VecDestroy(&motion));
      PetscCall(VecDestroy(&force));
    }
  }
  PetscCall(VecDestroy(&answer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthDeflation::setUp(PC inner, Mat reduced, Mat operation, const AinsworthLeftOut &left)
{
  Mat_Ainsworth   *ctx;
  std::vector<Vec> rows;
  bool             apart;

  PetscFunctionBegin;
  if (complete) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(clear()); /* what an error left */
  PetscCall(MatAinsworthGetContext_Private(reduced, &ctx));
  if (left.longest < PETSC_MAX_INT) PetscCall(GetLongRows(ctx->C, left.longest, &rows));
  PetscCall(longRows.setUp(inner, rows, dependentRow, &apart)); /* otherwise they are left to the projector */
  for (Vec &row : rows) PetscCall(VecDestroy(&row));
  PetscCall(move(inner, reduced, operation, left.shared));
  complete = true;
  PetscFunctionReturn(PETSC_SUCCESS);
}
