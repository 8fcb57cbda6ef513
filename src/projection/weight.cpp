#include "projector.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include <algorithm>
#include <numeric>
#include <vector>

static const PetscReal tiny = 1e-290; /* smaller numbers may have an inverse that overflows */

/*
   Replaces those diagonal entries of A for which pick() is true by the 1-norms of their rows; number: how many, on all
   ranks. Collective
*/
template <typename Pick>
static PetscErrorCode TakeNorms(Mat A, Vec diagonal, PetscInt *number, Pick pick)
{
  Mat                aij;
  PetscInt           rstart, local, n;
  const PetscScalar *row;
  PetscScalar       *d;

  PetscFunctionBegin;
  *number = 0;
  PetscCall(AinsworthForEntries({diagonal}, [&](PetscInt, PetscScalar entry) { *number += pick(entry); }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, number, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  if (!*number) PetscFunctionReturn(PETSC_SUCCESS); /* the usual case */
  PetscCall(AinsworthGetAIJ(A, &aij));
  PetscCall(MatGetOwnershipRange(aij, &rstart, NULL));
  PetscCall(VecGetLocalSize(diagonal, &local));
  PetscCall(VecGetArray(diagonal, &d));
  for (PetscInt i = 0; i < local; i++) {
    if (!pick(d[i])) continue;
    PetscCall(MatGetRow(aij, rstart + i, &n, NULL, &row));
    d[i] = std::accumulate(row, row + n, PetscReal(0.0),
                           [](PetscReal sum, PetscScalar a) { return sum + PetscAbsScalar(a); });
    PetscCall(MatRestoreRow(aij, rstart + i, &n, NULL, &row));
  }
  PetscCall(VecRestoreArray(diagonal, &d));
  PetscCall(MatDestroy(&aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthWeightCreate - creates W = diag(A)^{-1}, a vector of length n with positive real entries. Collective

   If a diagonal entry of A is missing or not positive, the 1-norm of its row stands in for it: it measures the same
   local stiffness and never has the wrong sign. A zero row gets the smallest weight of the others, so that its unknown
   moves least.
*/
PetscErrorCode AinsworthWeightCreate(Mat A, Vec *weight)
{
  MPI_Comm  comm = PetscObjectComm((PetscObject)A);
  PetscInt  bad;
  PetscReal smallest = PETSC_MAX_REAL;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateDiagonal(A, weight));
  PetscCall(TakeNorms(A, *weight, &bad, [](PetscScalar d) { return !(PetscRealPart(d) > 0.0); }));
  if (bad)
    PetscCall(
      PetscInfo(A,
                "%" PetscInt_FMT
                " diagonal entries of A are not positive: the 1-norms of their rows take their place in the weight\n",
                bad));
  PetscCall(AinsworthUpdate(*weight, [&](PetscInt, PetscScalar &w) {
    w = PetscRealPart(w) > 0.0 ? 1.0 / PetscRealPart(w) : 0.0;
    if (PetscRealPart(w) > 0.0) smallest = PetscMin(smallest, PetscRealPart(w));
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &smallest, 1, MPIU_REAL, MPIU_MIN, comm));
  if (smallest == PETSC_MAX_REAL) smallest = 1.0;
  PetscCall(AinsworthUpdate(*weight, [=](PetscInt, PetscScalar &w) {
    if (PetscRealPart(w) == 0.0) w = smallest;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Replaces (C W C')_ii by the stiffness of row i of C, that of its unknowns and of its spring in series; zero if no
   unknown has a weight
*/
static PetscErrorCode StiffnessOfRows(Mat D, Vec row)
{
  Vec sums;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(row, &sums));
  if (D) PetscCall(AinsworthRowSums(D, 1, sums));
  PetscCall(AinsworthUpdate(row, {sums}, [](PetscInt, PetscScalar &r, PetscScalar d) {
    r = PetscRealPart(r) > tiny ? 1.0 / PetscRealPart(r + d) : 0.0;
  }));
  PetscCall(VecDestroy(&sums));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the local zero rows of A; number: how many, on all ranks. Collective */
static PetscErrorCode FindZeroRows(Mat A, Vec like, std::vector<char> *zero, PetscInt *number)
{
  Vec diagonal;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(like, &diagonal));
  PetscCall(AinsworthGetDiagonal(A, diagonal));
  PetscCall(TakeNorms(A, diagonal, number, [](PetscScalar d) { return d == 0.0; }));
  PetscCall(AinsworthForEntries({diagonal}, [&](PetscInt, PetscScalar d) { zero->push_back(d == 0.0); }));
  PetscCall(VecDestroy(&diagonal));
  *number = (PetscInt)std::count(zero->begin(), zero->end(), 1);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, number, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthWeightLoosen - gives unknowns with zero rows in A (reference nodes, links) a large weight, so that they move
   before what they are tied to. Collective

   Forces in Ker C are inversely proportional to the weights in a row, so little force then acts on unknowns that the
   preconditioner knows nothing about. Such an unknown is as stiff as the rows of C that tie it to unknowns with a
   weight; this is propagated step by step.
*/
PetscErrorCode AinsworthWeightLoosen(Mat A, Mat C, Mat D, Vec weight, PetscBool *any)
{
  static const int  steps  = 8; /* longer chains of links keep the usual weight */
  const PetscReal   factor = AinsworthLooseFactor(D != NULL);
  std::vector<char> zero;
  PetscInt          found;
  Mat               Ct;
  Vec               old, stiffness, row;

  PetscFunctionBegin;
  PetscCall(FindZeroRows(A, weight, &zero, &found));
  *any = (PetscBool)(found > 0);
  if (!*any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatTranspose(C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(AinsworthCreateVecs(C, &stiffness, &row));
  PetscCall(AinsworthVecClone(weight, &old));
  PetscCall(AinsworthUpdate(weight, [&](PetscInt i, PetscScalar &w) {
    if (zero[i]) w = 0.0;
  }));
  for (int step = 0; step < steps && found; step++) {
    PetscCall(AinsworthRowSquares(C, weight, row));
    PetscCall(StiffnessOfRows(D, row));
    PetscCall(AinsworthRowSquares(Ct, row, stiffness));
    found = 0;
    PetscCall(AinsworthUpdate(weight, {stiffness}, [&](PetscInt, PetscScalar &w, PetscScalar r) {
      if (w != 0.0 || !(PetscRealPart(r) > tiny)) return;
      w = 1.0 / PetscRealPart(r);
      found++;
    }));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)C)));
  }
  PetscCall(AinsworthUpdate(weight, {old}, [&](PetscInt i, PetscScalar &w, PetscScalar r) {
    if (zero[i]) w = w != 0.0 ? factor * w : r;
  }));
  PetscCall(MatDestroy(&Ct));
  for (Vec *v : {&old, &stiffness, &row}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthRowPenaltyCreate - creates the penalty B_ii = gamma / (C D C')_ii, length m, from D = diag(A)^{-1}, length
   n. Collective

   This is the local stiffness that constraint i sees: B scales with A and with the inverse square of the row. A zero
   row, which only the compliance couples to others, and a row whose (C D C')_ii is negligible get the largest penalty
   of the others; they add nothing to C' B C.
*/
PetscErrorCode AinsworthRowPenaltyCreate(Mat C, Vec inverseDiagonal, PetscReal gamma, Vec *penalty)
{
  PetscReal largest;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(C, NULL, penalty));
  PetscCall(AinsworthRowSquares(C, inverseDiagonal, *penalty));
  PetscCall(AinsworthUpdate(
    *penalty, [=](PetscInt, PetscScalar &b) { b = PetscRealPart(b) > tiny ? gamma / PetscRealPart(b) : 0.0; }));
  PetscCall(VecMax(*penalty, NULL, &largest));
  PetscCall(AinsworthUpdate(*penalty, [=](PetscInt, PetscScalar &b) {
    if (b == 0.0) b = largest > 0.0 ? largest : 1.0;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}
