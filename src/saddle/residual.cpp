/* Residuals of the program's system, and the terms of its rows */
#include "saddle.h"
#include "../base/loops.h"
#include "../base/objects.h"

/*
   AinsworthSaddleResidual - computes left = b - K y with the program's matrix: f - op(A) x - B' lambda and g - C x + D
   lambda. Collective

   known: Ax is op(A) x already; otherwise it is computed.
*/
PetscErrorCode AinsworthSaddleResidual(const AinsworthSaddle *sp, PetscBool transpose, PetscBool known,
                                       AinsworthSaddleVec b, AinsworthSaddleVec y, Vec Ax, AinsworthSaddleVec left)
{
  PetscFunctionBegin;
  if (!known) PetscCall((transpose ? MatMultTranspose : MatMult)(sp->block[AINSWORTH_BLOCK_A], y.primal, Ax));
  PetscCall(MatMultHermitianTranspose(sp->all.B, y.dual, left.primal));
  PetscCall(VecAXPBYPCZ(left.primal, 1.0, -1.0, -1.0, b.primal, Ax));
  PetscCall(MatMult(sp->all.C, y.primal, left.dual));
  PetscCall(VecAYPX(left.dual, -1.0, b.dual));
  if (sp->all.D) { /* sum D lambda separately: its cancellation would add rounding to the other terms */
    Vec work;

    PetscCall(VecDuplicate(left.dual, &work));
    PetscCall(MatMult(sp->all.D, y.dual, work));
    PetscCall(VecAXPY(left.dual, 1.0, work));
    PetscCall(VecDestroy(&work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSaddleMult - computes K y with the program's matrix, and op(A) x on the way. Collective */
PetscErrorCode AinsworthSaddleMult(const AinsworthSaddle *sp, PetscBool transpose, AinsworthSaddleVec y, Vec Ax,
                                   AinsworthSaddleVec product)
{
  AinsworthSaddleVec zero;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleVecDuplicate(product, &zero));
  PetscCall(AinsworthSaddleVecZero(zero));
  PetscCall(AinsworthSaddleResidual(sp, transpose, PETSC_FALSE, zero, y, Ax, product));
  PetscCall(AinsworthSaddleVecScale(product, -1.0));
  PetscCall(AinsworthSaddleVecDestroy(&zero));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds |v| to sum */
static PetscErrorCode AddAbs(Vec sum, Vec v)
{
  PetscFunctionBegin;
  PetscCall(AinsworthUpdate(sum, {v}, [](PetscInt, PetscScalar &s, PetscScalar a) { s += PetscAbsScalar(a); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddlePrimalTerms - computes |op(A)| |x| + |B|' |lambda| + |f|; of an opaque A it has the product Ax alone.
   Collective
*/
PetscErrorCode AinsworthSaddlePrimalTerms(const AinsworthSaddle *sp, PetscBool transpose, AinsworthSaddleVec b,
                                          AinsworthSaddleVec y, Vec Ax, Vec terms)
{
  PetscBool rows;
  Vec       part;
  Mat       A;

  PetscFunctionBegin;
  PetscCall(AinsworthAbsoluteMultTranspose(sp->all.B, y.dual, terms));
  PetscCall(AddAbs(terms, b.primal));
  PetscCall(MatHasOperation(sp->block[AINSWORTH_BLOCK_A], MATOP_GET_ROW, &rows));
  if (rows) {
    PetscCall(VecDuplicate(terms, &part));
    PetscCall(AinsworthGetAIJ(sp->block[AINSWORTH_BLOCK_A], &A));
    PetscCall((transpose ? AinsworthAbsoluteMultTranspose : AinsworthAbsoluteMult)(A, y.primal, part));
    PetscCall(MatDestroy(&A));
    PetscCall(VecAXPY(terms, 1.0, part));
    PetscCall(VecDestroy(&part));
  } else PetscCall(AddAbs(terms, Ax));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSaddleDualTerms - computes |C| |x| + |D| |lambda| + |g|. Collective */
PetscErrorCode AinsworthSaddleDualTerms(const AinsworthSaddle *sp, AinsworthSaddleVec b, AinsworthSaddleVec y,
                                        Vec terms)
{
  Vec part;

  PetscFunctionBegin;
  PetscCall(AinsworthAbsoluteMult(sp->all.C, y.primal, terms));
  PetscCall(AddAbs(terms, b.dual));
  if (!sp->all.D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(terms, &part));
  PetscCall(AinsworthAbsoluteMult(sp->all.D, y.dual, part));
  PetscCall(VecAXPY(terms, 1.0, part));
  PetscCall(VecDestroy(&part));
  PetscFunctionReturn(PETSC_SUCCESS);
}
