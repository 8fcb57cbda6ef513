#include "saddle.h"
#include <petsc/private/petscimpl.h>

/* Collective: refuses a block that waits for its assembly on any rank; each rank knows only of the values that it set itself */
static PetscErrorCode CheckAssembled(Mat M, PetscInt i, PetscInt j)
{
  PetscBool assembled;

  PetscFunctionBegin;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAssembled(M, &assembled));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &assembled, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)M)));
  PetscCheck(assembled, PetscObjectComm((PetscObject)M), PETSC_ERR_ARG_WRONGSTATE,
             "Block (%" PetscInt_FMT ",%" PetscInt_FMT ") of the MatNest is not assembled: call MatAssemblyBegin() and MatAssemblyEnd() on it", i, j);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: the Frobenius norm of a block, 0 where it is absent, Inf where its type has none */
static PetscErrorCode BlockNorm(Mat M, PetscInt i, PetscInt j, PetscReal *norm)
{
  static PetscInt normId = -1;
  PetscBool       has, known;

  PetscFunctionBegin;
  *norm = 0.0;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckAssembled(M, i, j));
  PetscCall(MatHasOperation(M, MATOP_NORM, &has));
  if (!has) {
    *norm = PETSC_INFINITY;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* A is looked at once while it does not change, however often C does */
  if (normId < 0) PetscCall(PetscObjectComposedDataRegister(&normId));
  PetscCall(PetscObjectComposedDataGetReal((PetscObject)M, normId, *norm, known));
  if (known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNorm(M, NORM_FROBENIUS, norm));
  PetscCall(PetscObjectComposedDataSetReal((PetscObject)M, normId, *norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Which block is A? The multipliers' is absent or zero; where neither is, it is the smaller, of two equal ones (1,1), and must be diagonal
*/
static PetscErrorCode ChoosePrimal(Mat mat, const Mat diagonal[2], const PetscReal norm[2], PetscInt *primal)
{
  MPI_Comm  comm = PetscObjectComm((PetscObject)mat);
  PetscInt  n[2], row, col, l;
  PetscBool rows;

  PetscFunctionBegin;
  PetscCheck(norm[0] != 0.0 || norm[1] != 0.0, comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no primal block: blocks (0,0) and (1,1) of the MatNest are both absent or zero, A must be one of them");
  if (norm[0] == 0.0 || norm[1] == 0.0) {
    *primal = norm[0] == 0.0 ? 1 : 0;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (int i = 0; i < 2; i++) PetscCall(MatGetSize(diagonal[i], &n[i], NULL));
  l       = n[0] < n[1] ? 0 : 1;
  *primal = 1 - l;
  PetscCall(MatHasOperation(diagonal[l], MATOP_GET_ROW, &rows));
  PetscCheck(rows, comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no multipliers: blocks (0,0) and (1,1) of the MatNest are both nonzero, and the type %s of (%" PetscInt_FMT ",%" PetscInt_FMT
             "), the smaller one, has no rows to look at; leave the block of the multipliers absent, or pass a diagonal AIJ matrix",
             ((PetscObject)diagonal[l])->type_name, l, l);
  PetscCall(AinsworthMatFindOffDiagonal(diagonal[l], &row, &col));
  PetscCheck(row < 0, comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no multipliers: blocks (0,0) and (1,1) of the MatNest are both nonzero (Frobenius norms %g and %g), and (%" PetscInt_FMT
             ",%" PetscInt_FMT "), the smaller one, is not diagonal: it has entry (%" PetscInt_FMT ",%" PetscInt_FMT
             "); only zero and negative diagonal blocks, [A C'; C -D], can be treated",
             (double)norm[0], (double)norm[1], l, l, row, col);
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

/* Refuses a block (p,l) that is not the adjoint of block (l,p), where the program passed both */
static PetscErrorCode CheckAdjoint(AinsworthSaddle *sp, Mat block, Mat transposed)
{
  const PetscInt p = sp->primal, l = 1 - p;
  Mat            C = sp->all ? sp->all : sp->C, source[2], other;
  PetscBool      transpose[2], hermitian[2], same = PETSC_FALSE;
  PetscInt       row, col;
  PetscReal      value[2];

  PetscFunctionBegin;
  if (!block || !transposed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetSource(block, NULL, &source[0], &transpose[0], &hermitian[0]));
  PetscCall(GetSource(NULL, transposed, &source[1], &transpose[1], &hermitian[1]));
  if (source[0] == source[1] && (!PetscDefined(USE_COMPLEX) || hermitian[0] || hermitian[1])) PetscFunctionReturn(PETSC_SUCCESS); /* a view of the other */
  PetscCall(AinsworthProbeAdjoint(C, transposed, &same, &sp->negated));
  if (sp->diag) sp->negated = PETSC_FALSE; /* with a diagonal block the sign matters */
  if (same || sp->negated) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetConstraints(source[1], transpose[1], hermitian[1], &other));
  if (PetscDefined(USE_COMPLEX) && !hermitian[1]) { /* the adjoint of a transpose */
    Mat conjugate;

    PetscCall(MatDuplicate(other, MAT_COPY_VALUES, &conjugate));
    PetscCall(MatConjugate(conjugate));
    PetscCall(MatDestroy(&other));
    other = conjugate;
  }
  PetscCall(AinsworthMatFindDifference(C, other, &row, &col, value));
  PetscCall(MatDestroy(&other));
  PetscCheck(row < 0, PetscObjectComm((PetscObject)block), PETSC_ERR_ARG_INCOMP,
             "Block (%" PetscInt_FMT ",%" PetscInt_FMT ") of the MatNest is not the %s of block (%" PetscInt_FMT ",%" PetscInt_FMT "), C: entry (%" PetscInt_FMT
             ",%" PetscInt_FMT ") of C is %g, the other's is %g; only systems [A C'; C 0] can be solved",
             p, l, PetscDefined(USE_COMPLEX) ? "adjoint" : "transpose", l, p, row, col, (double)value[0], (double)value[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The program's blocks with their states; of a transpose view the matrix behind it, whose state tells of its values */
static PetscErrorCode GetBlocks(Mat mat, PetscInt p, Mat block[4], PetscObjectState state[4])
{
  const PetscInt l = 1 - p, at[4][2] = {
                              {p, p},
                              {l, l},
                              {l, p},
                              {p, l}
  };

  PetscFunctionBegin;
  for (int k = 0; k < 4; k++) {
    Mat       view = NULL;
    PetscBool hermitian;

    PetscCall(MatNestGetSubMat(mat, at[k][0], at[k][1], &block[k]));
    if (block[k] && k > 1) PetscCall(GetTransposed(block[k], &view, &hermitian));
    if (view) block[k] = view;
    state[k] = 0;
    if (block[k]) PetscCall(PetscObjectStateGet((PetscObject)block[k], &state[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: NaN or Inf in A, whose norm is known, as a text for the user; empty where there is none */
static PetscErrorCode CheckFinite(Mat A, PetscReal norm, char bad[], size_t len)
{
  PetscInt  row, col;
  PetscBool has;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(A, MATOP_NORM, &has));
  if (!has || !PetscIsInfOrNanReal(norm)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthMatFindNotFinite(A, &row, &col)); /* the norm may overflow for large values */
  if (row >= 0) PetscCall(PetscSNPrintf(bad, len, "entry (%" PetscInt_FMT ",%" PetscInt_FMT ") of A is NaN or Inf", row, col));
  else if (PetscIsNanReal(norm)) PetscCall(PetscSNPrintf(bad, len, "A holds NaN"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleSetUp - finds A and C in the matrix that the program passed

   Blocks (0,1) and (1,0) are compared by one random product. Where values are NaN or Inf sp->bad says which, and nothing else of sp may be used but to ask
   whether the matrix changed.
*/
PetscErrorCode AinsworthSaddleSetUp(Mat mat, AinsworthSaddle *sp)
{
  MPI_Comm  comm = PetscObjectComm((PetscObject)mat);
  PetscBool nest, transpose, hermitian;
  PetscReal norm[2];
  PetscInt  nr, nc, n[3], m[2], p = 0, l;
  Mat       B[2][2], diagonal[2], source;
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
  for (PetscInt i = 0; i < 2; i++) {
    diagonal[i] = B[i][i];
    PetscCall(BlockNorm(diagonal[i], i, i, &norm[i]));
  }
  PetscCall(ChoosePrimal(mat, diagonal, norm, &p));
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
  PetscCall(CheckAssembled(B[l][p], l, p));
  PetscCall(CheckAssembled(B[p][l], p, l));

  PetscCall(AinsworthSaddleReset(sp));
  sp->primal = p;
  PetscCall(GetBlocks(mat, p, sp->block, sp->state));
  for (Mat M : sp->block) PetscCall(PetscObjectReference((PetscObject)M));
  PetscCall(PetscObjectReference((PetscObject)B[p][p]));
  sp->A = B[p][p];
  PetscCall(GetSource(B[l][p], B[p][l], &source, &transpose, &hermitian));
  PetscCall(GetConstraints(source, transpose, hermitian, &sp->C));
  PetscCall(MatNestGetISs(mat, rows, cols));
  for (PetscInt k = 0; k < 2; k++) {
    sp->rows[k] = rows[k ? l : p];
    sp->cols[k] = cols[k ? l : p];
    PetscCall(PetscObjectReference((PetscObject)sp->rows[k]));
    PetscCall(PetscObjectReference((PetscObject)sp->cols[k]));
  }
  PetscCall(CheckFinite(sp->A, norm[p], sp->bad, sizeof(sp->bad)));
  if (!sp->bad[0]) PetscCall(AinsworthSaddleClassifyRows(sp, norm[l] != 0.0 ? B[l][l] : NULL));
  if (!sp->bad[0]) PetscCall(CheckAdjoint(sp, B[l][p], B[p][l]));
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
  PetscCall(PetscFree(sp->kind));
  PetscCall(PetscFree(sp->diag));
  PetscCall(MatDestroy(&sp->all));
  for (int kind = 0; kind < AINSWORTH_ROW_KINDS; kind++) {
    sp->count[kind] = 0;
    PetscCall(MatDestroy(&sp->left[kind]));
    PetscCall(VecDestroy(&sp->part[kind]));
  }
  PetscCall(MatDestroy(&sp->absolute));
  for (Mat &M : sp->block) PetscCall(MatDestroy(&M));
  sp->bad[0]  = 0;
  sp->negated = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Are the blocks other matrices, or have they other values, than at the last set-up? */
PetscErrorCode AinsworthSaddleChanged(Mat mat, const AinsworthSaddle *sp, PetscBool *changed)
{
  Mat              block[4];
  PetscObjectState state[4];

  PetscFunctionBegin;
  PetscCall(GetBlocks(mat, sp->primal, block, state));
  *changed = PETSC_FALSE;
  for (int k = 0; k < 4; k++)
    if (block[k] != sp->block[k] || state[k] != sp->state[k]) *changed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
