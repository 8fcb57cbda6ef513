#include "saddle.h"
#include "../objects.h"
#include <vector>

/* The near null space of A, attached to A or, as for PCFIELDSPLIT, to the index set of its field, or made of coordinates; NULL if none; not to be destroyed */
PetscErrorCode AinsworthSaddleGetNearNullSpace(const AinsworthSaddle *sp, MatNullSpace *near)
{
  PetscFunctionBegin;
  PetscCall(MatGetNearNullSpace(sp->block[AINSWORTH_BLOCK_A], near));
  if (!*near) PetscCall(PetscObjectQuery((PetscObject)sp->rows[0], "nearnullspace", (PetscObject *)near));
  if (!*near) *near = sp->modes;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vectors of the whole with the near null space of a field in its columns, zero elsewhere, are added; cols NULL: of the whole; to be destroyed */
static PetscErrorCode AddModes(Mat mat, MatNullSpace near, IS cols, std::vector<Vec> *modes)
{
  PetscBool  constant;
  PetscInt   n, local;
  const Vec *given;

  PetscFunctionBegin;
  PetscCall(MatNullSpaceGetVecs(near, &constant, &n, &given));
  PetscCall(MatGetLocalSize(mat, NULL, &local));
  for (PetscInt i = 0; i < n + (constant ? 1 : 0); i++) {
    Vec v, part, mode;

    PetscCall(VecCreateMPI(PetscObjectComm((PetscObject)mat), local, PETSC_DETERMINE, &v));
    part = v;
    if (cols) PetscCall(VecGetSubVector(v, cols, &part));
    if (i < n) {
      PetscCall(AinsworthVecGetFlat(cols ? NULL : mat, PETSC_FALSE, given[i], &mode));
      PetscCall(VecCopy(mode, part));
      PetscCall(AinsworthVecRestoreFlat(cols ? NULL : mat, PETSC_FALSE, given[i], PETSC_FALSE, &mode));
    } else PetscCall(VecSet(part, 1.0));
    if (cols) PetscCall(VecRestoreSubVector(v, cols, &part));
    modes->push_back(v);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* v less its parts in the directions of some vectors of length 1, one after the other */
static PetscErrorCode Orthogonalize(const std::vector<Vec> &directions, Vec v)
{
  PetscScalar product;

  PetscFunctionBegin;
  for (Vec w : directions) {
    PetscCall(VecDot(v, w, &product));
    PetscCall(VecAXPY(v, -product, w));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of a vector of the whole in a field, laid out as the columns of A */
static PetscErrorCode CreatePart(Mat A, Vec whole, IS field, Vec *v)
{
  Vec part;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(A, v, NULL));
  PetscCall(VecGetSubVector(whole, field, &part));
  PetscCall(VecCopy(part, *v));
  PetscCall(VecRestoreSubVector(whole, field, &part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleAttachNearNullSpace - gives an A that was made of parts of mat the near null spaces of these, or of the index sets of their fields, or
   else the primal part of that of mat
*/
PetscErrorCode AinsworthSaddleAttachNearNullSpace(const AinsworthSaddleBlocks *found, Mat mat)
{
  Mat              A = found->block[AINSWORTH_BLOCK_A];
  MatNullSpace     near;
  const char      *name = NULL; /* of what the modes are made of */
  std::vector<Vec> modes, parts;

  PetscFunctionBegin;
  PetscCall(MatGetNearNullSpace(A, &near));
  if (near) PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t i = 0; i < found->fields.size(); i++) {
    Mat block = NULL;

    if (found->multiplier[i]) continue;
    near = NULL;
    if (!found->extracted) PetscCall(MatNestGetSubMat(mat, (PetscInt)i, (PetscInt)i, &block));
    if (block) PetscCall(MatGetNearNullSpace(block, &near));
    if (!near) PetscCall(PetscObjectQuery((PetscObject)found->fields[i].rows.get(), "nearnullspace", (PetscObject *)&near));
    if (near) PetscCall(AddModes(mat, near, found->fields[i].cols.get(), &modes));
    if (near && ((PetscObject)near)->name) name = ((PetscObject)near)->name;
  }
  PetscCall(MatGetNearNullSpace(mat, &near));
  if (modes.empty() && near) PetscCall(AddModes(mat, near, NULL, &modes));
  for (Vec &mode : modes) {
    Vec       v;
    PetscReal norm, rest;

    PetscCall(CreatePart(A, mode, found->cols[0], &v));
    PetscCall(VecDestroy(&mode));
    PetscCall(VecNorm(v, NORM_2, &norm));
    PetscCall(Orthogonalize(parts, v));
    PetscCall(VecNormalize(v, &rest));
    if (rest > PETSC_SQRT_MACHINE_EPSILON * norm) parts.push_back(v);
    else PetscCall(VecDestroy(&v)); /* the primal part of a mode of the multipliers */
  }
  if (parts.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNullSpaceCreate(PetscObjectComm((PetscObject)A), PETSC_FALSE, (PetscInt)parts.size(), parts.data(), &near));
  if (name) PetscCall(PetscObjectSetName((PetscObject)near, name));
  PetscCall(MatSetNearNullSpace(A, near));
  PetscCall(MatNullSpaceDestroy(&near));
  for (Vec &v : parts) PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The null space of the program's matrix; of amat only where pmat has none */
PetscErrorCode AinsworthSaddleGetWhole(Mat amat, Mat pmat, MatNullSpace *whole)
{
  PetscFunctionBegin;
  PetscCall(MatGetNullSpace(pmat, whole));
  if (!*whole) PetscCall(MatGetNullSpace(amat, whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleRemoveNullSpace - what a KSP does with the solution: takes the null space attached to its operator out of x and lambda together

   In exact arithmetic nothing happens to the equations. But the rounding is that of the larger of x and lambda, and where their units are decades apart
   nothing may be left of the smaller: to be done before x and lambda are verified, as the KSP does it after. The constant vector is left to the KSP.
*/
PetscErrorCode AinsworthSaddleRemoveNullSpace(const AinsworthSaddle *sp, Mat amat, PetscBool transpose, AinsworthSaddleVec y, PetscBool *removed)
{
  const IS         *field = transpose ? sp->rows : sp->cols;
  const PetscScalar sign  = sp->negated ? -1.0 : 1.0; /* lambda is still ours */
  MatNullSpace      whole;
  PetscBool         constant;
  PetscInt          n = 0;
  const Vec        *v;

  PetscFunctionBegin;
  PetscCall((transpose ? MatGetTransposeNullSpace : MatGetNullSpace)(amat, &whole));
  if (whole) PetscCall(MatNullSpaceGetVecs(whole, &constant, &n, &v));
  for (PetscInt i = 0; i < n; i++) {
    Vec                flat;
    AinsworthSaddleVec part;
    PetscScalar        dot[2];

    PetscCall(AinsworthVecGetFlat(amat, transpose, v[i], &flat));
    PetscCall(AinsworthSaddleVecGet(flat, field, &part));
    PetscCall(VecDot(y.primal, part.primal, &dot[0]));
    PetscCall(VecDot(y.dual, part.dual, &dot[1]));
    dot[0] += sign * dot[1];
    PetscCall(VecAXPY(y.primal, -dot[0], part.primal));
    PetscCall(VecAXPY(y.dual, -sign * dot[0], part.dual));
    PetscCall(AinsworthSaddleVecRestore(flat, field, &part));
    PetscCall(AinsworthVecRestoreFlat(amat, transpose, v[i], PETSC_FALSE, &flat));
  }
  *removed = (PetscBool)(n > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: does A v vanish? Entries of a semidefinite A are at most as large as those of its diagonal */
static PetscErrorCode Annihilates(Mat A, Vec v, PetscBool *zero)
{
  Vec       y;
  PetscReal size, diagonal, norm;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(A, NULL, &y));
  PetscCall(MatGetDiagonal(A, y));
  PetscCall(VecNorm(y, NORM_INFINITY, &diagonal));
  PetscCall(MatMult(A, v, y));
  PetscCall(VecNorm(y, NORM_INFINITY, &norm));
  PetscCall(VecNorm(v, NORM_INFINITY, &size));
  PetscCall(VecDestroy(&y));
  *zero = (PetscBool)(norm <= PETSC_SQRT_MACHINE_EPSILON * diagonal * size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Vectors that the program says are in the null space of A, to be destroyed: those attached to A, to the index set of its field, as for PCFIELDSPLIT, or the
   primal parts of those attached to the whole matrix, as far as A takes them to zero
*/
static PetscErrorCode GetNullVectors(const AinsworthSaddle *sp, std::vector<Vec> *vectors)
{
  Mat          A = sp->block[AINSWORTH_BLOCK_A], numbering;
  MatNullSpace nullsp;
  PetscBool    constant, whole, good = PETSC_TRUE;
  PetscInt     n;
  const Vec   *given;

  PetscFunctionBegin;
  PetscCall(MatGetNullSpace(A, &nullsp));
  if (!nullsp) PetscCall(PetscObjectQuery((PetscObject)sp->rows[0], "nullspace", (PetscObject *)&nullsp));
  whole = (PetscBool)!nullsp;
  if (whole) nullsp = sp->whole;
  if (!nullsp) PetscFunctionReturn(PETSC_SUCCESS);
  numbering = whole ? sp->numbering : A;
  PetscCall(MatNullSpaceGetVecs(nullsp, &constant, &n, &given));
  for (PetscInt i = 0; i < n + (constant ? 1 : 0); i++) {
    Vec v, flat;

    if (i < n) {
      PetscCall(AinsworthVecGetFlat(numbering, PETSC_FALSE, given[i], &flat));
      if (whole) PetscCall(CreatePart(A, flat, sp->cols[0], &v));
      else {
        PetscCall(MatCreateVecs(A, &v, NULL));
        PetscCall(VecCopy(flat, v));
      }
      PetscCall(AinsworthVecRestoreFlat(numbering, PETSC_FALSE, given[i], PETSC_FALSE, &flat));
    } else {
      PetscCall(MatCreateVecs(A, &v, NULL));
      PetscCall(VecSet(v, 1.0));
    }
    if (whole) PetscCall(Annihilates(A, v, &good));
    if (good) vectors->push_back(v);
    else PetscCall(VecDestroy(&v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleCreateNullSpace - the part of the null space of A that is also in Ker C, NULL if there is none

   What C holds is no null space of the reduced operator. Each vector v is reduced, with its image C v, against the images
   found so far; the v whose image vanishes span Ker A and Ker C.
*/
PetscErrorCode AinsworthSaddleCreateNullSpace(const AinsworthSaddle *sp, MatNullSpace *common)
{
  std::vector<Vec> given, free, held, images; /* of the held ones */
  PetscReal        normC;
  Mat              C = sp->C;

  PetscFunctionBegin;
  *common = NULL;
  PetscCall(GetNullVectors(sp, &given));
  if (given.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNorm(C, NORM_FROBENIUS, &normC));
  for (Vec v : given) {
    PetscReal   norm, rest;
    PetscScalar alpha;
    Vec         image;

    PetscCall(VecNorm(v, NORM_2, &norm));
    PetscCall(Orthogonalize(free, v));
    PetscCall(VecNorm(v, NORM_2, &rest));
    if (rest <= PETSC_SQRT_MACHINE_EPSILON * norm) { /* zero, or a combination of the others, as primal parts may be */
      PetscCall(VecDestroy(&v));
      continue;
    }
    PetscCall(MatCreateVecs(C, NULL, &image));
    PetscCall(VecNormalize(v, NULL));
    PetscCall(MatMult(C, v, image));
    for (size_t k = 0; k < held.size(); k++) {
      PetscCall(VecDot(image, images[k], &alpha));
      PetscCall(VecAXPY(image, -alpha, images[k]));
      PetscCall(VecAXPY(v, -alpha, held[k]));
    }
    PetscCall(VecNorm(image, NORM_2, &norm));
    if (norm <= PETSC_SQRT_MACHINE_EPSILON * normC) {
      PetscCall(VecDestroy(&image));
      PetscCall(VecNormalize(v, NULL));
      free.push_back(v);
    } else {
      PetscCall(VecScale(v, 1.0 / norm));
      PetscCall(VecScale(image, 1.0 / norm));
      held.push_back(v);
      images.push_back(image);
    }
  }
  given.clear();
  for (Vec v : free) { /* combinations with the held vectors are no longer orthogonal to the earlier ones */
    PetscCall(Orthogonalize(given, v));
    PetscCall(VecNormalize(v, NULL));
    given.push_back(v);
  }
  if (!free.empty()) PetscCall(MatNullSpaceCreate(PetscObjectComm((PetscObject)sp->A), PETSC_FALSE, (PetscInt)free.size(), free.data(), common));
  for (const std::vector<Vec> *vecs : {&free, &held, &images})
    for (Vec v : *vecs) PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleRemoveDualNullSpace - of all multipliers that solve the system those without a part in the null space of their field, that of a pressure
   for instance, attached to its index set as for PCFIELDSPLIT
*/
PetscErrorCode AinsworthSaddleRemoveDualNullSpace(const AinsworthSaddle *sp, Vec lambda)
{
  Mat          C = sp->rowsB; /* what multipliers do to x */
  MatNullSpace nullsp;
  Vec          removed, force;
  PetscReal    norm, normC, size;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)sp->rows[1], "nullspace", (PetscObject *)&nullsp));
  if (!nullsp || sp->rowsD) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthVecClone(lambda, &removed));
  PetscCall(MatNullSpaceRemove(nullsp, lambda));
  PetscCall(VecAXPY(removed, -1.0, lambda));
  PetscCall(MatCreateVecs(C, &force, NULL));
  PetscCall(MatMultHermitianTranspose(C, removed, force));
  PetscCall(VecNorm(force, NORM_2, &norm));
  PetscCall(VecNorm(removed, NORM_2, &size));
  PetscCall(MatNorm(C, NORM_FROBENIUS, &normC));
  if (norm > PETSC_SQRT_MACHINE_EPSILON * normC * size) PetscCall(VecAXPY(lambda, 1.0, removed)); /* it is none of theirs */
  PetscCall(VecDestroy(&removed));
  PetscCall(VecDestroy(&force));
  PetscFunctionReturn(PETSC_SUCCESS);
}
