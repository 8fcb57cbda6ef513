#include "saddle.h"
#include <petsc/private/petscimpl.h>

/* Collective: a block that is absent, or whose entries are all zero */
static PetscErrorCode BlockIsZero(Mat M, PetscBool *zero, PetscReal *norm)
{
  PetscBool assembled;

  PetscFunctionBegin;
  *norm = 0.0;
  *zero = PETSC_TRUE;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAssembled(M, &assembled));
  if (!assembled) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatHasOperation(M, MATOP_NORM, zero));
  if (*zero) {
    PetscCall(MatNorm(M, NORM_FROBENIUS, norm));
    *zero = (PetscBool)(*norm == 0.0);
  } else *norm = PETSC_INFINITY;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix whose transpose M stands for, NULL if M is not a transpose view */
static PetscErrorCode GetTransposed(Mat M, Mat *T, PetscBool *hermitian)
{
  PetscErrorCode (*get)(Mat, Mat *);
  PetscErrorCode (*getHermitian)(Mat, Mat *);

  PetscFunctionBegin;
  *T = NULL;
  PetscCall(PetscObjectQueryFunction((PetscObject)M, "MatTransposeGetMat_C", &get));
  PetscCall(PetscObjectQueryFunction((PetscObject)M, "MatHermitianTransposeGetMat_C", &getHermitian));
  *hermitian = (PetscBool)(getHermitian != NULL);
  if (getHermitian) PetscCall((*getHermitian)(M, T));
  else if (get) PetscCall((*get)(M, T));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix that holds the entries of C, and whether C is that matrix, its transpose or its adjoint */
static PetscErrorCode GetSource(Mat block, Mat transposed, Mat *source, PetscBool *transpose, PetscBool *hermitian)
{
  Mat view;

  PetscFunctionBegin;
  *source    = block ? block : transposed;
  *transpose = (PetscBool)!block;
  *hermitian = *transpose;
  if (!*source) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetTransposed(*source, &view, hermitian));
  if (view) {
    *source = view;
    if (*transpose) *transpose = PETSC_FALSE;
    else *transpose = PETSC_TRUE;
  } else *hermitian = *transpose; /* an absent block is the adjoint of the present one */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C as AIJ */
static PetscErrorCode GetConstraints(Mat source, PetscBool transpose, PetscBool hermitian, Mat *C)
{
  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(source, C));
  if (transpose) {
    Mat T = *C;
    if (hermitian) PetscCall(MatHermitianTranspose(T, MAT_INITIAL_MATRIX, C));
    else PetscCall(MatTranspose(T, MAT_INITIAL_MATRIX, C));
    PetscCall(MatDestroy(&T));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leave out the rows of C that are zero: they constrain nothing and would make the Gram matrix singular */
static PetscErrorCode DropZeroRows(AinsworthSaddle *sp)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)sp->C);
  PetscInt rstart, rend, nkept = 0, local, *kept;
  Mat      C;
  IS       rows, cols;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(sp->C, &rstart, &rend));
  PetscCall(PetscMalloc1(rend - rstart, &kept));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt           ncols;
    const PetscScalar *v;
    PetscBool          zero = PETSC_TRUE;

    PetscCall(MatGetRow(sp->C, i, &ncols, NULL, &v));
    for (PetscInt k = 0; k < ncols && zero; k++) zero = (PetscBool)(v[k] == 0.0);
    PetscCall(MatRestoreRow(sp->C, i, &ncols, NULL, &v));
    if (!zero) kept[nkept++] = i;
  }
  local = rend - rstart - nkept;
  PetscCall(MPIU_Allreduce(&local, &sp->zeroRows, 1, MPIU_INT, MPI_SUM, comm));
  if (!sp->zeroRows) {
    PetscCall(PetscFree(kept));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(ISCreateGeneral(comm, nkept, kept, PETSC_OWN_POINTER, &rows));
  PetscCall(MatGetOwnershipRangeColumn(sp->C, &rstart, &rend));
  PetscCall(ISCreateStride(comm, rend - rstart, rstart, 1, &cols));
  PetscCall(MatCreateSubMatrix(sp->C, rows, cols, MAT_INITIAL_MATRIX, &C));
  PetscCall(ISDestroy(&cols));
  PetscCall(MatDestroy(&sp->C));
  sp->C    = C;
  sp->kept = rows;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleSetUp - finds A and C in the matrix that the program passed

   The multiplier field is the one whose diagonal block is absent or zero.
*/
PetscErrorCode AinsworthSaddleSetUp(Mat mat, AinsworthSaddle *sp)
{
  MPI_Comm  comm = PetscObjectComm((PetscObject)mat);
  PetscBool nest, zero[2], assembled, transpose, hermitian;
  PetscReal norm[2];
  PetscInt  nr, nc, n[3], m[2], p, l;
  Mat       B[2][2];
  IS        rows[2], cols[2];

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)mat, MATNEST, &nest));
  PetscCheck(nest, comm, PETSC_ERR_ARG_WRONG, "PCAINSWORTH needs a matrix of type nest, [A C'; C 0], and got type %s: build it with MatCreateNest()",
             ((PetscObject)mat)->type_name);
  PetscCall(MatNestGetSize(mat, &nr, &nc));
  PetscCheck(nr == 2 && nc == 2, comm, PETSC_ERR_ARG_SIZ,
             "PCAINSWORTH needs a MatNest of 2 x 2 blocks, [A C'; C 0], and got %" PetscInt_FMT " x %" PetscInt_FMT
             ": gather the primal fields in one block and the multipliers in another",
             nr, nc);
  for (PetscInt i = 0; i < 2; i++)
    for (PetscInt j = 0; j < 2; j++) PetscCall(MatNestGetSubMat(mat, i, j, &B[i][j]));
  for (PetscInt i = 0; i < 2; i++) PetscCall(BlockIsZero(B[i][i], &zero[i], &norm[i]));
  PetscCheck(zero[0] || zero[1], comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no multipliers: blocks (0,0) and (1,1) of the MatNest are both nonzero (Frobenius norms %g and %g; inf: cannot be computed); "
             "leave the diagonal block of the multipliers absent or zero",
             (double)norm[0], (double)norm[1]);
  PetscCheck(!zero[0] || !zero[1], comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no primal block: blocks (0,0) and (1,1) of the MatNest are both absent or zero, A must be one of them");
  p = zero[0] ? 1 : 0;
  l = 1 - p;
  PetscCheck(B[l][p] || B[p][l], comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no constraints: block (%" PetscInt_FMT ",%" PetscInt_FMT
             ") of the MatNest, C, is absent, and so is its transpose; to solve without constraints pass a block with no rows",
             l, p);
  PetscCall(MatGetSize(B[p][p], &n[0], &n[1]));
  PetscCheck(n[0] == n[1], comm, PETSC_ERR_ARG_SIZ,
             "Block (%" PetscInt_FMT ",%" PetscInt_FMT ") of the MatNest, A, is not square: %" PetscInt_FMT " x %" PetscInt_FMT, p, p, n[0], n[1]);
  if (B[l][p]) PetscCall(MatGetSize(B[l][p], &m[0], &m[1]));
  else PetscCall(MatGetSize(B[p][l], &m[1], &m[0]));
  PetscCheck(m[0] <= n[0], comm, PETSC_ERR_ARG_SIZ,
             "C has more rows than columns, %" PetscInt_FMT " x %" PetscInt_FMT ": its rows cannot be linearly independent", m[0], m[1]);
  for (PetscInt k = 0; k < 2; k++) {
    Mat M = k ? B[p][l] : B[l][p];
    if (!M) continue;
    PetscCall(MatAssembled(M, &assembled));
    PetscCheck(assembled, comm, PETSC_ERR_ARG_WRONGSTATE,
               "Block (%" PetscInt_FMT ",%" PetscInt_FMT ") of the MatNest is not assembled: call MatAssemblyBegin() and MatAssemblyEnd() on it", k ? p : l,
               k ? l : p);
  }

  PetscCall(AinsworthSaddleReset(sp));
  sp->primal = p;
  PetscCall(PetscObjectReference((PetscObject)B[p][p]));
  sp->A = B[p][p];
  PetscCall(PetscObjectStateGet((PetscObject)sp->A, &sp->stateA));
  PetscCall(GetSource(B[l][p], B[p][l], &sp->source, &transpose, &hermitian));
  PetscCall(PetscObjectReference((PetscObject)sp->source));
  PetscCall(PetscObjectStateGet((PetscObject)sp->source, &sp->stateSource));
  PetscCall(GetConstraints(sp->source, transpose, hermitian, &sp->C));
  PetscCall(MatNestGetISs(mat, rows, cols));
  for (PetscInt k = 0; k < 2; k++) {
    sp->rows[k] = rows[k ? l : p];
    sp->cols[k] = cols[k ? l : p];
    PetscCall(PetscObjectReference((PetscObject)sp->rows[k]));
    PetscCall(PetscObjectReference((PetscObject)sp->cols[k]));
  }
  PetscCall(DropZeroRows(sp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSaddleReset(AinsworthSaddle *sp)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&sp->A));
  PetscCall(MatDestroy(&sp->C));
  for (PetscInt k = 0; k < 2; k++) {
    PetscCall(ISDestroy(&sp->rows[k]));
    PetscCall(ISDestroy(&sp->cols[k]));
  }
  PetscCall(ISDestroy(&sp->kept));
  PetscCall(MatDestroy(&sp->source));
  sp->zeroRows = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Are A and C other matrices, or have they other values, than at the last set-up? */
PetscErrorCode AinsworthSaddleChanged(Mat mat, const AinsworthSaddle *sp, PetscBool *changedA, PetscBool *changedC)
{
  const PetscInt   p = sp->primal, l = 1 - p;
  Mat              A, block, transposed, source;
  PetscBool        transpose, hermitian;
  PetscObjectState state = 0;

  PetscFunctionBegin;
  PetscCall(MatNestGetSubMat(mat, p, p, &A));
  if (A) PetscCall(PetscObjectStateGet((PetscObject)A, &state));
  *changedA = (PetscBool)(A != sp->A || state != sp->stateA);
  PetscCall(MatNestGetSubMat(mat, l, p, &block));
  PetscCall(MatNestGetSubMat(mat, p, l, &transposed));
  PetscCall(GetSource(block, transposed, &source, &transpose, &hermitian));
  if (source) PetscCall(PetscObjectStateGet((PetscObject)source, &state));
  *changedC = (PetscBool)(source != sp->source || state != sp->stateSource);
  PetscFunctionReturn(PETSC_SUCCESS);
}
