/*
   Unknowns that are in no equation, and equations without an unknown: whatever the values of the others, such a system
   is singular
*/
#include "saddle.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"

/* Counts the marked entries of all ranks. Collective */
static PetscErrorCode CountMarked(Mat A, const std::vector<bool> &marked, PetscInt *number)
{
  PetscFunctionBegin;
  *number = 0;
  for (bool mark : marked) *number += mark;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, number, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Unmarks entries where the column of a matrix, AIJ, has a nonzero entry, or with `rows` its row; does nothing if none
   are marked. Collective
*/
static PetscErrorCode UnmarkUsed(Mat A, bool rows, std::vector<bool> *marked)
{
  Vec      in, out;
  PetscInt number;

  PetscFunctionBegin;
  PetscCall(CountMarked(A, *marked, &number));
  if (!number) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateVecs(A, rows ? &in : &out, rows ? &out : &in));
  PetscCall(VecSet(in, 1.0));
  PetscCall((rows ? AinsworthAbsoluteMult : AinsworthAbsoluteMultTranspose)(A, in, out));
  PetscCall(AinsworthForEntries({out}, [=](PetscInt i, PetscScalar v) {
    if (v != 0.0) (*marked)[i] = false;
  }));
  PetscCall(VecDestroy(&in));
  PetscCall(VecDestroy(&out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Unmarks unknowns that the program has declared free: their unit vectors are in a null space attached to its matrix.
   Collective
*/
static PetscErrorCode UnmarkDeclared(const AinsworthSaddle *sp, std::vector<bool> *marked)
{
  MatNullSpace common;
  PetscInt     n;
  const Vec   *v;
  /* squared length of the part of each unit vector in the null space */
  std::vector<PetscReal> part(marked->size(), 0.0);

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleCreateNullSpace(sp, &common));
  if (!common) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNullSpaceGetVecs(common, NULL, &n, &v));
  for (PetscInt k = 0; k < n; k++)
    PetscCall(AinsworthForEntries({v[k]}, [&](PetscInt i, PetscScalar a) { part[i] += PetscSqr(PetscAbsScalar(a)); }));
  PetscCall(MatNullSpaceDestroy(&common));
  for (size_t i = 0; i < part.size(); i++)
    if (part[i] >= 1.0 - PETSC_SQRT_MACHINE_EPSILON) (*marked)[i] = false;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleNameUnused - lists the unknowns of the primal field that are in no equation or, if there are none, its
   equations without an unknown. Collective

   Only those with a zero on the diagonal of A are looked at, which a set-up knows already. Unknowns in a null space
   that the program attached are not listed.
*/
PetscErrorCode AinsworthSaddleNameUnused(const AinsworthSaddle *sp, PetscBool symmetric, char unknowns[],
                                         char equations[], size_t len)
{
  const AinsworthMatFacts *facts;
  Mat                      A;
  std::vector<bool>        zero, marked;
  PetscInt                 number, start;

  PetscFunctionBegin;
  unknowns[0] = equations[0] = 0;
  PetscCall(AinsworthGetFacts(sp->A, &facts));
  if (!facts->rows || facts->positive) PetscFunctionReturn(PETSC_SUCCESS); /* the usual case */
  PetscCall(AinsworthForEntries({facts->diagonal}, [&](PetscInt, PetscScalar d) { zero.push_back(d == 0.0); }));
  PetscCall(MatGetOwnershipRange(sp->A, &start, NULL));
  PetscCall(CountMarked(sp->A, zero, &number));
  if (!number) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(sp->A, &A));
  marked = zero;
  PetscCall(UnmarkUsed(sp->all.C, false, &marked)); /* far smaller than A */
  PetscCall(UnmarkUsed(A, false, &marked));
  PetscCall(CountMarked(A, marked, &number));
  if (number) {
    PetscCall(UnmarkDeclared(sp, &marked));
    PetscCall(AinsworthNameMarked(PetscObjectComm((PetscObject)A), start, marked, unknowns, len));
  } else if (!symmetric || !sp->oneSided()) {
    marked = zero;
    PetscCall(UnmarkUsed(sp->all.B, false, &marked));
    PetscCall(UnmarkUsed(A, true, &marked));
    PetscCall(AinsworthNameMarked(PetscObjectComm((PetscObject)A), start, marked, equations, len));
  }
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}
