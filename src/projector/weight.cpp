#include "projector.h"

/*
   AinsworthWeightCreate - W = diag(A)^{-1}, as a vector of length n of positive reals

   Where a diagonal entry of A is not positive (or not stored) the 1-norm of its row stands in for it: the same local stiffness, and
   never of the wrong sign. A row of zeros gets the smallest weight of the others, so that it is moved least.
*/
PetscErrorCode AinsworthWeightCreate(Mat A, Vec *weight)
{
  Vec          d, sums = NULL;
  PetscScalar *w;
  PetscInt     n, bad = 0;
  PetscReal    smallest = PETSC_MAX_REAL;
  MPI_Comm     comm     = PetscObjectComm((PetscObject)A);

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(A, NULL, &d));
  PetscCall(AinsworthGetDiagonal(A, d));
  PetscCall(VecGetLocalSize(d, &n));
  PetscCall(VecGetArray(d, &w));
  for (PetscInt i = 0; i < n; i++) bad += !(PetscRealPart(w[i]) > 0.0);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &bad, 1, MPIU_INT, MPI_SUM, comm));
  if (bad) {
    const PetscScalar *s;

    PetscCall(PetscInfo(A, "%" PetscInt_FMT " diagonal entries of A are not positive: the 1-norms of their rows take their place in the weight\n", bad));
    PetscCall(VecDuplicate(d, &sums));
    PetscCall(AinsworthRowSums(A, 1, sums));
    PetscCall(VecGetArrayRead(sums, &s));
    for (PetscInt i = 0; i < n; i++)
      if (!(PetscRealPart(w[i]) > 0.0)) w[i] = s[i];
    PetscCall(VecRestoreArrayRead(sums, &s));
    PetscCall(VecDestroy(&sums));
  }
  for (PetscInt i = 0; i < n; i++) {
    w[i] = PetscRealPart(w[i]) > 0.0 ? 1.0 / PetscRealPart(w[i]) : 0.0;
    if (PetscRealPart(w[i]) > 0.0) smallest = PetscMin(smallest, PetscRealPart(w[i]));
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &smallest, 1, MPIU_REAL, MPIU_MIN, comm));
  if (smallest == PETSC_MAX_REAL) smallest = 1.0;
  for (PetscInt i = 0; i < n; i++)
    if (PetscRealPart(w[i]) == 0.0) w[i] = smallest;
  PetscCall(VecRestoreArray(d, &w));
  *weight = d;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthRowPenaltyCreate - B_ii = gamma / (C D C')_ii, length m, with the inverse diagonal D = diag(A)^{-1}, length n

   The local stiffness seen by constraint i: B scales as A, and as the inverse square of the row's own scale. A row of zeros, which D couples with others, and
   one that D_ii dwarfs so have the largest of the others: they add nothing to C' B C.
*/
PetscErrorCode AinsworthRowPenaltyCreate(Mat C, Vec inverseDiagonal, PetscReal gamma, Vec *penalty)
{
  const PetscReal tiny = 1e-290; /* its inverse may overflow */
  Vec             root;
  PetscInt        m;
  PetscReal       largest;
  PetscScalar    *b;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(inverseDiagonal, &root));
  PetscCall(VecCopy(inverseDiagonal, root));
  PetscCall(VecSqrtAbs(root));
  PetscCall(MatCreateVecs(C, NULL, penalty));
  PetscCall(AinsworthRowSquares(C, root, *penalty));
  PetscCall(VecDestroy(&root));
  PetscCall(VecGetLocalSize(*penalty, &m));
  PetscCall(VecGetArray(*penalty, &b));
  for (PetscInt i = 0; i < m; i++) b[i] = PetscRealPart(b[i]) > tiny ? gamma / PetscRealPart(b[i]) : 0.0;
  PetscCall(VecRestoreArray(*penalty, &b));
  PetscCall(VecMax(*penalty, NULL, &largest));
  PetscCall(VecGetArray(*penalty, &b));
  for (PetscInt i = 0; i < m; i++)
    if (b[i] == 0.0) b[i] = largest > 0.0 ? largest : 1.0;
  PetscCall(VecRestoreArray(*penalty, &b));
  PetscFunctionReturn(PETSC_SUCCESS);
}
