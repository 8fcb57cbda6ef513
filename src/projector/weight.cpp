#include "projector.h"
#include <vector>

static const PetscReal tiny = 1e-290; /* its inverse may overflow */

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
  PetscCall(AinsworthCreateDiagonal(A, &d));
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

/* Of each row of C the root of its stiffness, 1 / (C W C')_ii, in place of (C W C')_ii; zero where that is zero, or where D gives way */
static PetscErrorCode RootOfStiffness(Mat D, Vec row)
{
  static const PetscReal rigid = 1e-3;
  PetscInt               m;
  PetscScalar           *r;
  const PetscScalar     *d;
  Vec                    sums;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(row, &sums));
  if (D) PetscCall(AinsworthRowSums(D, 1, sums));
  PetscCall(VecGetLocalSize(row, &m));
  PetscCall(VecGetArray(row, &r));
  PetscCall(VecGetArrayRead(sums, &d));
  for (PetscInt i = 0; i < m; i++) {
    const PetscReal flexible = PetscRealPart(r[i]);

    r[i] = flexible > tiny && PetscRealPart(d[i]) <= rigid * flexible ? PetscSqrtReal(1.0 / flexible) : 0.0;
  }
  PetscCall(VecRestoreArrayRead(sums, &d));
  PetscCall(VecRestoreArray(row, &r));
  PetscCall(VecDestroy(&sums));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the local rows of zeros of A; their number on all ranks */
static PetscErrorCode FindZeroRows(Mat A, Vec like, std::vector<char> *zero, PetscInt *number)
{
  Vec                sums;
  PetscInt           n;
  const PetscScalar *s;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(like, &sums));
  PetscCall(AinsworthGetDiagonal(A, sums));
  for (int look = 0; look < 2; look++) { /* as a rule the diagonal tells that there are none */
    PetscCall(VecGetLocalSize(sums, &n));
    PetscCall(VecGetArrayRead(sums, &s));
    zero->assign(n, 0);
    *number = 0;
    for (PetscInt i = 0; i < n; i++) *number += (*zero)[i] = s[i] == 0.0;
    PetscCall(VecRestoreArrayRead(sums, &s));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, number, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
    if (!*number) break;
    if (!look) PetscCall(AinsworthRowSums(A, 1, sums));
  }
  PetscCall(VecDestroy(&sums));
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
  PetscInt          n, found;
  PetscScalar      *w, *r;
  Mat               Ct;
  Vec               old, root, row;

  PetscFunctionBegin;
  PetscCall(FindZeroRows(A, weight, &zero, &found));
  *any = (PetscBool)(found > 0);
  if (!*any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatTranspose(C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(MatCreateVecs(C, &root, &row));
  PetscCall(VecDuplicate(weight, &old));
  PetscCall(VecCopy(weight, old));
  n = (PetscInt)zero.size();
  PetscCall(VecGetArray(weight, &w));
  for (PetscInt i = 0; i < n; i++)
    if (zero[i]) w[i] = 0.0;
  PetscCall(VecRestoreArray(weight, &w));
  for (int step = 0; step < steps && found; step++) {
    PetscCall(VecCopy(weight, root));
    PetscCall(VecSqrtAbs(root));
    PetscCall(AinsworthRowSquares(C, root, row));
    PetscCall(RootOfStiffness(D, row));
    PetscCall(AinsworthRowSquares(Ct, row, root));
    found = 0;
    PetscCall(VecGetArray(weight, &w));
    PetscCall(VecGetArray(root, &r));
    for (PetscInt i = 0; i < n; i++) {
      if (w[i] != 0.0 || !(PetscRealPart(r[i]) > tiny)) continue;
      w[i] = 1.0 / PetscRealPart(r[i]);
      found++;
    }
    PetscCall(VecRestoreArray(root, &r));
    PetscCall(VecRestoreArray(weight, &w));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)C)));
  }
  PetscCall(VecGetArray(weight, &w));
  PetscCall(VecGetArray(old, &r));
  for (PetscInt i = 0; i < n; i++)
    if (zero[i]) w[i] = w[i] != 0.0 ? AINSWORTH_WEIGHT_LOOSE * w[i] : r[i];
  PetscCall(VecRestoreArray(old, &r));
  PetscCall(VecRestoreArray(weight, &w));
  PetscCall(MatDestroy(&Ct));
  for (Vec *v : {&old, &root, &row}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthRowPenaltyCreate - B_ii = gamma / (C D C')_ii, length m, with the inverse diagonal D = diag(A)^{-1}, length n

   The local stiffness seen by constraint i: B scales as A, and as the inverse square of the row's own scale. A row of zeros, which D couples with others, and
   one that D_ii dwarfs so have the largest of the others: they add nothing to C' B C.
*/
PetscErrorCode AinsworthRowPenaltyCreate(Mat C, Vec inverseDiagonal, PetscReal gamma, Vec *penalty)
{
  Vec          root;
  PetscInt     m;
  PetscReal    largest;
  PetscScalar *b;

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
