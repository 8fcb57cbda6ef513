/* The scale of a system: powers of 2 that bring the entries of [A B'; C -D] to about 1 */
#include "saddle.h"
#include "../loops.h"
#include <cmath>

/* Rounds to a power of 2, by which products cause no rounding; 1 for a size that says nothing */
static PetscReal InverseRoot(PetscReal size)
{
  int exponent;

  if (!(size > 0.0) || PetscIsInfOrNanReal(size)) return 1.0;
  (void)std::frexp((double)size, &exponent);
  return (PetscReal)std::ldexp(1.0, -(exponent - 1) / 2);
}

/* Replaces diagonal entries that are not positive by the largest entry of the row; opaque matrices keep them */
static PetscErrorCode LookAtRows(Mat A, Vec stiffness)
{
  PetscBool    look = PETSC_FALSE, has;
  Mat          aij;
  PetscScalar *d;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(A, MATOP_GET_ROW, &has));
  PetscCall(AinsworthForEntries({stiffness}, [&](PetscInt, PetscScalar v) {
    if (has && !(PetscRealPart(v) > 0.0)) look = PETSC_TRUE;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &look, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)A)));
  if (!look) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(A, &aij));
  PetscCall(VecGetArray(stiffness, &d));
  PetscCall(AinsworthForRows(aij, [d](const AinsworthMatRow &row) {
    PetscReal most = 0.0;

    for (PetscInt k = 0; k < row.n; k++) most = PetscMax(most, PetscAbsScalar(row.a[k]));
    if (!(PetscRealPart(d[row.local]) > 0.0)) d[row.local] = most;
  }));
  PetscCall(VecRestoreArray(stiffness, &d));
  PetscCall(MatDestroy(&aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the stiffness of each unknown: the diagonal of A or, where that is not positive, the largest entry of the row; 0 in rows of zeros */
static PetscErrorCode Stiffness(Mat A, Vec *stiffness)
{
  PetscFunctionBegin;
  PetscCall(AinsworthCreateDiagonal(A, stiffness));
  PetscCall(LookAtRows(A, *stiffness));
  PetscCall(AinsworthUpdate(*stiffness, [](PetscInt, PetscScalar &d) { d = PetscMax(PetscRealPart(d), 0.0); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes (C W C')_kk + |D_kk|, how far a unit force on row k moves it; W: squares of `scale` */
static PetscErrorCode Flexibility(Mat C, Mat D, Vec scale, Vec rows)
{
  Mat scaled;
  Vec springs;

  PetscFunctionBegin;
  PetscCall(AinsworthScaleColumns(C, scale, &scaled)); /* before squaring, against overflow */
  PetscCall(AinsworthRowSums(scaled, 2, rows));
  PetscCall(MatDestroy(&scaled));
  if (!D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(rows, &springs));
  PetscCall(AinsworthGetDiagonal(D, springs));
  PetscCall(AinsworthUpdate(rows, {springs}, [](PetscInt, PetscScalar &r, PetscScalar d) { r += PetscAbsScalar(d); }));
  PetscCall(VecDestroy(&springs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Scales unknowns without stiffness by the rows of B that hold them, and rows that only such unknowns have by these, in turns

   Each turn reaches one row farther; three reach what programs write (a reference node that another one carries), and what is left has no scale but its own
*/
static PetscErrorCode ScaleLoose(const AinsworthSaddle *sp, AinsworthSaddleVec scale, Vec rows)
{
  static const int turns = 3;
  PetscInt         loose = 0;
  Vec              work, known;

  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({scale.primal}, [&](PetscInt, PetscScalar s) { loose += s == 0.0; }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &loose, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)scale.primal)));
  if (!loose) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(scale.primal, &work));
  PetscCall(VecDuplicate(rows, &known));
  for (int turn = 0; turn < turns; turn++) {
    PetscCall(VecCopy(scale.dual, known));
    if (turn + 1 == turns) PetscCall(AinsworthUpdate(known, [](PetscInt, PetscScalar &t) { t = t == 0.0 ? 1.0 : t; }));
    PetscCall(AinsworthAbsoluteMultTranspose(sp->rowsB, known, work));
    PetscCall(AinsworthUpdate(scale.primal, {work}, [](PetscInt, PetscScalar &s, PetscScalar w) {
      if (s == 0.0 && PetscRealPart(w) > 0.0) s = InverseRoot(PetscRealPart(w) * PetscRealPart(w));
    }));
    PetscCall(Flexibility(sp->rowsC, sp->rowsD, scale.primal, rows));
    PetscCall(AinsworthUpdate(scale.dual, {rows}, [](PetscInt, PetscScalar &t, PetscScalar r) {
      if (t == 0.0 && PetscRealPart(r) > 0.0) t = InverseRoot(PetscRealPart(r));
    }));
  }
  PetscCall(VecDestroy(&work));
  PetscCall(VecDestroy(&known));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleScale - finds the scale of the program's system, and its unknowns without stiffness. Collective

   The scale is made of positive powers of 2: A_ii^{-1/2} for unknowns, that of the rows of B that hold them where A has no stiffness, and
   ((C diag(A)^{-1} C')_kk + |D_kk|)^{-1/2} for all rows of the multiplier field. For a positive definite A no entry of the scaled A and C exceeds 2, and an
   error t in the energy norm leaves at most 2 t in each scaled row (Cauchy-Schwarz)
*/
PetscErrorCode AinsworthSaddleScale(AinsworthSaddle *sp)
{
  AinsworthSaddleVec *scale = &sp->scale;
  Vec                 rows;

  PetscFunctionBegin;
  sp->loose.clear();
  PetscCall(Stiffness(sp->block[AINSWORTH_BLOCK_A], &scale->primal));
  PetscCall(AinsworthUpdate(scale->primal, [sp](PetscInt, PetscScalar &s) {
    sp->loose.push_back(s == 0.0);
    s = s == 0.0 ? 0.0 : InverseRoot(PetscRealPart(s));
  }));
  PetscCall(MatCreateVecs(sp->givenC, NULL, &rows));
  PetscCall(VecDuplicate(rows, &scale->dual));
  PetscCall(Flexibility(sp->givenC, sp->rowsD, scale->primal, rows));
  PetscCall(
    AinsworthUpdate(scale->dual, {rows}, [](PetscInt, PetscScalar &t, PetscScalar r) { t = PetscRealPart(r) > 0.0 ? InverseRoot(PetscRealPart(r)) : 0.0; }));
  PetscCall(ScaleLoose(sp, *scale, rows));
  PetscCall(VecDestroy(&rows));
  for (Vec v : {scale->primal, scale->dual}) PetscCall(AinsworthUpdate(v, [](PetscInt, PetscScalar &s) { s = s == 0.0 ? 1.0 : s; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}
