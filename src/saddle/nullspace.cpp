/* Null spaces that the program attached to its matrix, to A, or to the index sets of its fields */
#include "saddle.h"
#include "../base/layouts.h"
#include "../base/objects.h"
#include <vector>

/* Orthogonalizes v against vectors of length 1 by modified Gram-Schmidt */
PetscErrorCode AinsworthOrthogonalize(const std::vector<Vec> &directions, Vec v)
{
  PetscScalar product;

  PetscFunctionBegin;
  for (Vec w : directions) {
    PetscCall(VecDot(v, w, &product));
    PetscCall(VecAXPY(v, -product, w));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the null space of pmat, or else that of amat */
PetscErrorCode AinsworthSaddleGetNullSpace(Mat amat, Mat pmat, MatNullSpace *nullSpace)
{
  PetscFunctionBegin;
  PetscCall(MatGetNullSpace(pmat, nullSpace));
  if (!*nullSpace) PetscCall(MatGetNullSpace(amat, nullSpace));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleRemoveNullSpace - removes the null space attached to the operator from x and lambda together, as a KSP
   does with the solution. Collective

   In exact arithmetic this does not change the residuals. But the rounding is that of the larger of x and lambda, and
   if their units differ by decades nothing may be left of the smaller. So this has to be done before the solution is
   verified, because the KSP does it afterwards. The constant vector is left to the KSP.
*/
PetscErrorCode AinsworthSaddleRemoveNullSpace(const AinsworthSaddle *sp, Mat amat, PetscBool transpose,
                                              AinsworthSaddleVec y, PetscBool *removed)
{
  const AinsworthTransfer *transfer = &sp->transfer[transpose ? 0 : 1];
  const PetscScalar        sign     = sp->negated ? -1.0 : 1.0; /* lambda does not have the program's sign yet */
  AinsworthSaddleVec       part;
  MatNullSpace             whole;
  PetscBool                constant;
  PetscInt                 n = 0;
  const Vec               *v;

  PetscFunctionBegin;
  PetscCall((transpose ? MatGetTransposeNullSpace : MatGetNullSpace)(amat, &whole));
  if (whole) PetscCall(MatNullSpaceGetVecs(whole, &constant, &n, &v));
  if (n) PetscCall(AinsworthSaddleVecDuplicate(y, &part)); /* the parts of the transfer are those of y */
  for (PetscInt i = 0; i < n; i++) {
    PetscScalar dot[2];

    PetscCall(AinsworthTransferIn(transfer, AINSWORTH_ACCESS_READ, v[i], part));
    PetscCall(VecDot(y.primal, part.primal, &dot[0]));
    PetscCall(VecDot(y.dual, part.dual, &dot[1]));
    dot[0] += sign * dot[1];
    PetscCall(VecAXPY(y.primal, -dot[0], part.primal));
    PetscCall(VecAXPY(y.dual, -sign * dot[0], part.dual));
    PetscCall(AinsworthTransferOut(transfer, AINSWORTH_ACCESS_READ, false, v[i], part));
  }
  if (n) PetscCall(AinsworthSaddleVecDestroy(&part));
  *removed = (PetscBool)(n > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tells whether A v vanishes, relative to the diagonal, which bounds the entries of a semidefinite A. Collective */
static PetscErrorCode Annihilates(Mat A, Vec v, PetscBool *zero)
{
  Vec       y;
  PetscReal size, diagonal, norm;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(A, NULL, &y));
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
   Gets the vectors that the program declares to be in the null space of A; to be destroyed

   They are attached to A or, as for PCFIELDSPLIT, to the index set of its field; otherwise they are the primal parts of
   those attached to the whole matrix, if A maps them to zero.
*/
static PetscErrorCode GetNullVectors(const AinsworthSaddle *sp, std::vector<Vec> *vectors)
{
  const Mat                A        = sp->block[AINSWORTH_BLOCK_A];
  const AinsworthTransfer *transfer = &sp->transfer[1];
  AinsworthSaddleVec       part;
  MatNullSpace             nullsp;
  PetscBool                constant, whole, good = PETSC_TRUE;
  PetscInt                 n;
  const Vec               *given;

  PetscFunctionBegin;
  PetscCall(MatGetNullSpace(A, &nullsp));
  if (!nullsp) PetscCall(PetscObjectQuery((PetscObject)sp->rows[0], "nullspace", (PetscObject *)&nullsp));
  whole = (PetscBool)!nullsp;
  if (whole) nullsp = sp->nullSpace;
  if (!nullsp) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNullSpaceGetVecs(nullsp, &constant, &n, &given));
  /* an application may be using the parts of the transfer */
  PetscCall(AinsworthSaddleVecDuplicate({transfer->part[0], transfer->part[1]}, &part));
  for (PetscInt i = 0; i < n + (constant ? 1 : 0); i++) {
    Vec v;

    PetscCall(AinsworthCreateVecs(A, &v, NULL));
    if (i == n) PetscCall(VecSet(v, 1.0));
    else if (whole) {
      PetscCall(AinsworthTransferIn(transfer, AINSWORTH_ACCESS_READ, given[i], part));
      PetscCall(VecCopy(part.primal, v));
      PetscCall(AinsworthTransferOut(transfer, AINSWORTH_ACCESS_READ, false, given[i], part));
    } else PetscCall(AinsworthVecCopyEntries(given[i], v));
    if (whole) PetscCall(Annihilates(A, v, &good));
    if (good) vectors->push_back(v);
    else PetscCall(VecDestroy(&v));
  }
  PetscCall(AinsworthSaddleVecDestroy(&part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleCreateNullSpace - creates the intersection of the null spaces of A and C, NULL if it is trivial.
   Collective

   Vectors that C does not annihilate are not in the null space of the reduced operator. Each vector v is reduced,
   together with its image C v, against the images found so far; the v with a vanishing image span the intersection.
*/
PetscErrorCode AinsworthSaddleCreateNullSpace(const AinsworthSaddle *sp, MatNullSpace *common)
{
  std::vector<Vec> given, free, held, images; /* C v of the held vectors */
  PetscReal        normC;
  const Mat        C = sp->kept.C;

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
    PetscCall(AinsworthOrthogonalize(free, v));
    PetscCall(VecNorm(v, NORM_2, &rest));
    if (rest <= PETSC_SQRT_MACHINE_EPSILON * norm) { /* zero, or a combination of the others, as primal parts may be */
      PetscCall(VecDestroy(&v));
      continue;
    }
    PetscCall(AinsworthCreateVecs(C, NULL, &image));
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
  for (Vec v : free) { /* subtracting held vectors has destroyed their orthogonality */
    PetscCall(AinsworthOrthogonalize(given, v));
    PetscCall(VecNormalize(v, NULL));
    given.push_back(v);
  }
  if (!free.empty())
    PetscCall(
      MatNullSpaceCreate(PetscObjectComm((PetscObject)sp->A), PETSC_FALSE, (PetscInt)free.size(), free.data(), common));
  for (const std::vector<Vec> *vecs : {&free, &held, &images})
    for (Vec v : *vecs) PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleRemoveDualNullSpace - removes the null space of the multipliers, such as that of a pressure, from
   lambda. Collective

   The null space is attached to the index set of the field, as for PCFIELDSPLIT.
*/
PetscErrorCode AinsworthSaddleRemoveDualNullSpace(const AinsworthSaddle *sp, Vec lambda)
{
  Mat          C = sp->all.B; /* forces of the multipliers */
  MatNullSpace nullsp;
  Vec          removed, force;
  PetscReal    norm, normC, size;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)sp->rows[1], "nullspace", (PetscObject *)&nullsp));
  if (!nullsp || sp->all.D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthVecClone(lambda, &removed));
  PetscCall(MatNullSpaceRemove(nullsp, lambda));
  PetscCall(VecAXPY(removed, -1.0, lambda));
  PetscCall(AinsworthCreateVecs(C, &force, NULL));
  PetscCall(MatMultHermitianTranspose(C, removed, force));
  PetscCall(VecNorm(force, NORM_2, &norm));
  PetscCall(VecNorm(removed, NORM_2, &size));
  PetscCall(MatNorm(C, NORM_FROBENIUS, &normC));
  /* it is not a null space of B' */
  if (norm > PETSC_SQRT_MACHINE_EPSILON * normC * size) PetscCall(VecAXPY(lambda, 1.0, removed));
  PetscCall(VecDestroy(&removed));
  PetscCall(VecDestroy(&force));
  PetscFunctionReturn(PETSC_SUCCESS);
}
