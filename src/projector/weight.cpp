#include "projector.h"
#include "../loops.h"
#include "../objects.h"
#include <algorithm>
#include <numeric>
#include <vector>

static const PetscReal tiny = 1e-290; /* its inverse may overflow */

/* The 1-norms of rows of A in the place of those entries of its diagonal that pick(d) is true for; the number of them on all ranks. Collective */
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
  if (!*number) PetscFunctionReturn(PETSC_SUCCESS); /* as a rule */
  PetscCall(AinsworthGetAIJ(A, &aij));
  PetscCall(MatGetOwnershipRange(aij, &rstart, NULL));
  PetscCall(VecGetLocalSize(diagonal, &local));
  PetscCall(VecGetArray(diagonal, &d));
  for (PetscInt i = 0; i < local; i++) {
    if (!pick(d[i])) continue;
    PetscCall(MatGetRow(aij, rstart + i, &n, NULL, &row));
    d[i] = std::accumulate(row, row + n, PetscReal(0.0), [](PetscReal sum, PetscScalar a) { return sum + PetscAbsScalar(a); });
    PetscCall(MatRestoreRow(aij, rstart + i, &n, NULL, &row));
  }
  PetscCall(VecRestoreArray(diagonal, &d));
  PetscCall(MatDestroy(&aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthWeightCreate - W = diag(A)^{-1}, as a vector of length n of positive reals

   Where a diagonal entry of A is not positive (or not stored) the 1-norm of its row stands in for it: the same local stiffness, and
   never of the wrong sign. A row of zeros gets the smallest weight of the others, so that it is moved least.
*/
PetscErrorCode AinsworthWeightCreate(Mat A, Vec *weight)
{
  MPI_Comm  comm = PetscObjectComm((PetscObject)A);
  PetscInt  bad;
  PetscReal smallest = PETSC_MAX_REAL;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateDiagonal(A, weight));
  PetscCall(TakeNorms(A, *weight, &bad, [](PetscScalar d) { return !(PetscRealPart(d) > 0.0); }));
  if (bad) PetscCall(PetscInfo(A, "%" PetscInt_FMT " diagonal entries of A are not positive: the 1-norms of their rows take their place in the weight\n", bad));
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

/* Of each row of C its stiffness, 1 / (C W C')_ii, in place of (C W C')_ii; zero where that is zero, or where D gives way */
static PetscErrorCode StiffnessOfRows(Mat D, Vec row)
{
  static const PetscReal rigid = 1e-3;
  Vec                    sums;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(row, &sums));
  if (D) PetscCall(AinsworthRowSums(D, 1, sums));
  PetscCall(AinsworthUpdate(row, {sums}, [](PetscInt, PetscScalar &r, PetscScalar d) {
    const PetscReal flexible = PetscRealPart(r);

    r = flexible > tiny && PetscRealPart(d) <= rigid * flexible ? 1.0 / flexible : 0.0;
  }));
  PetscCall(VecDestroy(&sums));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the local rows of zeros of A; their number on all ranks */
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
   AinsworthWeightLoosen - a large weight for unknowns with rows of zeros in A, reference nodes and links: they move before what they are tied to does

   Forces in Ker C are in inverse proportion to the weights of a row: few of them then are on unknowns that the preconditioner knows nothing of. Such an
   unknown is as stiff as the rows of C that tie it to unknowns with a weight; and so on from one to the next. Collective
*/
PetscErrorCode AinsworthWeightLoosen(Mat A, Mat C, Mat D, Vec weight, PetscBool *any)
{
  static const int  steps = 8;
  std::vector<char> zero;
  PetscInt          found;
  Mat               Ct;
  Vec               old, stiffness, row;

  PetscFunctionBegin;
  PetscCall(FindZeroRows(A, weight, &zero, &found));
  *any = (PetscBool)(found > 0);
  if (!*any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatTranspose(C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(MatCreateVecs(C, &stiffness, &row));
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
    if (zero[i]) w = w != 0.0 ? AINSWORTH_WEIGHT_LOOSE * w : r;
  }));
  PetscCall(MatDestroy(&Ct));
  for (Vec *v : {&old, &stiffness, &row}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthRowPenaltyCreate - B_ii = gamma / (C D C')_ii, length m, with the inverse diagonal D = diag(A)^{-1}, length n

   The local stiffness seen by constraint i: B scales as A, and as the inverse square of the row's own scale. A row of zeros, which D couples with others, and
   one that D_ii dwarfs so have the largest of the others: they add nothing to C' B C.
*/
PetscErrorCode AinsworthRowPenaltyCreate(Mat C, Vec inverseDiagonal, PetscReal gamma, Vec *penalty)
{
  PetscReal largest;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(C, NULL, penalty));
  PetscCall(AinsworthRowSquares(C, inverseDiagonal, *penalty));
  PetscCall(AinsworthUpdate(*penalty, [=](PetscInt, PetscScalar &b) { b = PetscRealPart(b) > tiny ? gamma / PetscRealPart(b) : 0.0; }));
  PetscCall(VecMax(*penalty, NULL, &largest));
  PetscCall(AinsworthUpdate(*penalty, [=](PetscInt, PetscScalar &b) {
    if (b == 0.0) b = largest > 0.0 ? largest : 1.0;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}
