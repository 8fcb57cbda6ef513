/*
   The matrix of one step: the Jacobian without the rows and columns of multipliers held at a bound; blocks without
   bounded rows are the program's own
*/
#include "activeset.h"
#include "../base/objects.h"
#include "../saddle/saddle.h"
#include <vector>

/*
   Creates a diagonal matrix with -1 where keep is 0 and stored zeros elsewhere, so that its pattern is the same in
   every step
*/
static PetscErrorCode CreateHeldDiagonal(Mat like, Vec keep, Mat *E)
{
  PetscInt           rstart, rend, n;
  const PetscScalar *k;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(keep, &rstart, &rend));
  n = rend - rstart;
  PetscCall(
    MatCreateAIJ(PetscObjectComm((PetscObject)like), n, n, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, E));
  PetscCall(VecGetArrayRead(keep, &k));
  for (PetscInt i = rstart; i < rend; i++) PetscCall(MatSetValue(*E, i, i, k[i - rstart] - 1.0, INSERT_VALUES));
  PetscCall(VecRestoreArrayRead(keep, &k));
  PetscCall(MatAssemblyBegin(*E, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*E, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates diag(left) M diag(right), as a transpose view if M is one; left and right may be NULL */
static PetscErrorCode CreateScaled(Mat M, Vec left, Vec right, Mat *scaled)
{
  Mat       source;
  PetscBool hermitian;

  PetscFunctionBegin;
  PetscCall(AinsworthGetTransposed(M, &source, &hermitian));
  if (source) {
    Mat copy;

    PetscCall(CreateScaled(source, right, left, &copy)); /* the factors are real */
    if (hermitian) PetscCall(MatCreateHermitianTranspose(copy, scaled));
    else PetscCall(MatCreateTranspose(copy, scaled));
    PetscCall(MatDestroy(&copy));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatDuplicate(M, MAT_COPY_VALUES, scaled));
  PetscCall(MatDiagonalScale(*scaled, left, right));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a diagonal block, or the whole Jacobian, with rows and columns held; M may be NULL */
static PetscErrorCode CreateHeld(Mat like, Mat M, Vec keep, Mat *held)
{
  Mat E;

  PetscFunctionBegin;
  PetscCall(CreateHeldDiagonal(like, keep, &E));
  if (!M) {
    *held = E;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(CreateScaled(M, keep, keep, held));
  PetscCall(MatAXPY(*held, 1.0, E, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&E));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetNestISs(Mat J, std::vector<IS> *rows, std::vector<IS> *cols)
{
  PetscInt nr, nc;

  PetscFunctionBegin;
  PetscCall(MatNestGetSize(J, &nr, &nc));
  rows->resize(nr);
  cols->resize(nc);
  PetscCall(MatNestGetISs(J, rows->data(), cols->data()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateNest(Mat J, Vec bounded, Vec keep, Mat *step)
{
  std::vector<IS>  rows, cols;
  std::vector<Vec> held; /* keep of the fields that have bounds, NULL for others */
  std::vector<Mat> block;

  PetscFunctionBegin;
  PetscCall(GetNestISs(J, &rows, &cols));
  const PetscInt nr = (PetscInt)rows.size(), nc = (PetscInt)cols.size();
  PetscCheck(nr == nc, PetscObjectComm((PetscObject)J), PETSC_ERR_ARG_SIZ,
             "The Jacobian is a MatNest of %" PetscInt_FMT " by %" PetscInt_FMT
             " blocks, SNES type %s needs as many rows as columns",
             nr, nc, SNESAINSWORTHACTIVESET);
  for (IS is : rows) {
    PetscReal some;
    Vec       part, copy = NULL;

    PetscCall(VecGetSubVector(bounded, is, &part));
    PetscCall(VecMax(part, NULL, &some));
    PetscCall(VecRestoreSubVector(bounded, is, &part));
    if (some > 0.0) {
      PetscCall(VecGetSubVector(keep, is, &part));
      PetscCall(AinsworthVecClone(part, &copy));
      PetscCall(VecRestoreSubVector(keep, is, &part));
    }
    held.push_back(copy);
  }
  for (PetscInt i = 0; i < nr; i++) {
    for (PetscInt j = 0; j < nc; j++) {
      Mat from, to = NULL;

      PetscCall(MatNestGetSubMat(J, i, j, &from));
      if (i == j && held[i]) PetscCall(CreateHeld(J, from, held[i], &to));
      else if (from && (held[i] || held[j])) PetscCall(CreateScaled(from, held[i], held[j], &to));
      else PetscCall(AinsworthShare(from, &to));
      block.push_back(to);
    }
  }
  PetscCall(MatCreateNest(PetscObjectComm((PetscObject)J), nr, rows.data(), nc, cols.data(), block.data(), step));
  for (Mat &M : block) PetscCall(MatDestroy(&M));
  for (Vec &v : held) PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthStepMatCreate(Mat J, Vec bounded, Vec keep, Mat *step)
{
  PetscBool nest;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)J, MATNEST, &nest));
  if (nest) PetscCall(CreateNest(J, bounded, keep, step));
  else PetscCall(CreateHeld(J, J, keep, step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes J known; of a MATNEST only block columns with a nonzero part of known are used, rarely those of A */
PetscErrorCode AinsworthStepMultKnown(Mat J, Vec known, Vec product)
{
  PetscBool       nest;
  std::vector<IS> rows, cols;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)J, MATNEST, &nest));
  if (!nest) {
    PetscCall(MatMult(J, known, product));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(GetNestISs(J, &rows, &cols));
  PetscCall(VecZeroEntries(product));
  for (size_t j = 0; j < cols.size(); j++) {
    PetscReal distance;
    Vec       x, y;

    PetscCall(VecGetSubVector(known, cols[j], &x));
    PetscCall(VecNorm(x, NORM_INFINITY, &distance));
    for (size_t i = 0; i < rows.size() && distance > 0.0; i++) {
      Mat block;

      PetscCall(MatNestGetSubMat(J, (PetscInt)i, (PetscInt)j, &block));
      if (!block) continue;
      PetscCall(VecGetSubVector(product, rows[i], &y));
      PetscCall(MatMultAdd(block, x, y, y));
      PetscCall(VecRestoreSubVector(product, rows[i], &y));
    }
    PetscCall(VecRestoreSubVector(known, cols[j], &x));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
