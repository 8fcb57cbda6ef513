#include "pmat.h"
#include "../events.h"
#include "../projector/projector.h"

const char *const AinsworthPenaltyTypes[] = {"row", "norm", "AinsworthPenaltyType", "AINSWORTH_PENALTY_", NULL};

static PetscErrorCode Multiply(Mat left, Mat right, Mat *product)
{
  PetscFunctionBegin;
  PetscCall(MatMatMult(left, right, MAT_INITIAL_MATRIX, PETSC_DEFAULT, product));
  PetscCall(MatProductClear(*product)); /* which would hold the factors */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Y A from Y', which has few rows that are not zero: only these rows of A are read */
static PetscErrorCode MultiplyFewRows(Mat Yt, Mat A, Mat *product)
{
  Mat few[2] = {Yt, A}, Y;
  IS  rows;

  PetscFunctionBegin;
  PetscCall(MatFindNonzeroRows(Yt, &rows)); /* NULL: all */
  for (Mat &mat : few)
    if (rows) PetscCall(MatCreateSubMatrix(mat, rows, NULL, MAT_INITIAL_MATRIX, &mat));
  PetscCall(MatHermitianTranspose(few[0], MAT_INITIAL_MATRIX, &Y));
  PetscCall(Multiply(Y, few[1], product));
  PetscCall(MatDestroy(&Y));
  for (Mat &mat : few)
    if (rows) PetscCall(MatDestroy(&mat));
  PetscCall(ISDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Q_*' A Q_* - A = -C' Y A - A Y' C + C' (Y A Y') C, with Q_* = I - Y' C and Y = Inv(S) C W (docs/method.md, surface-only assembly)

   Where A is symmetric it is H + H' with H = C' ((Y A Y') C / 2 - Y A).
*/
static PetscErrorCode CreateProjectionPart(const AinsworthPmatInputs *in, Mat A, Mat Ct, Mat inverse, PetscBool symmetric, Mat *part)
{
  Mat CW, Y, Yt, YA, YAYt, sum, other;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(in->C, MAT_COPY_VALUES, &CW));
  if (in->weight) PetscCall(MatDiagonalScale(CW, NULL, in->weight));
  PetscCall(Multiply(inverse, CW, &Y));
  PetscCall(MatDestroy(&CW));
  PetscCall(MatHermitianTranspose(Y, MAT_INITIAL_MATRIX, &Yt));
  PetscCall(MatDestroy(&Y));
  PetscCall(MultiplyFewRows(Yt, A, &YA));
  PetscCall(Multiply(YA, Yt, &YAYt));
  PetscCall(Multiply(YAYt, in->C, &sum));
  PetscCall(MatDestroy(&YAYt));
  if (symmetric) PetscCall(MatScale(sum, 0.5));
  PetscCall(MatAXPY(sum, -1.0, YA, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&YA));
  PetscCall(Multiply(Ct, sum, part));
  PetscCall(MatDestroy(&sum));
  if (symmetric) PetscCall(MatHermitianTranspose(*part, MAT_INITIAL_MATRIX, &other));
  else {
    Mat AYt;

    PetscCall(Multiply(A, Yt, &AYt));
    PetscCall(Multiply(AYt, in->C, &other));
    PetscCall(MatDestroy(&AYt));
  }
  PetscCall(MatDestroy(&Yt));
  PetscCall(MatAXPY(*part, symmetric ? 1.0 : -1.0, other, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The norm of A + part, part NULL for 0: the infinity norm, which is the 1-norm where all is symmetric; PETSc's own 1-norm stores a row on every rank */
static PetscErrorCode NormOfSum(Mat A, Mat part, PetscReal *norm)
{
  Mat sum;

  PetscFunctionBegin;
  *norm = 0.0;
  if (part) {
    PetscCall(MatDuplicate(part, MAT_COPY_VALUES, &sum));
    PetscCall(MatAXPY(sum, 1.0, A, DIFFERENT_NONZERO_PATTERN));
    PetscCall(MatNorm(sum, NORM_INFINITY, norm));
    PetscCall(MatDestroy(&sum));
  }
  if (*norm == 0.0) PetscCall(MatNorm(A, NORM_INFINITY, norm)); /* Ker C = 0: any penalty will do */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (B^{-1} + D)^{-1}, penalty and compliance in series; 0 where D_ii is negative, and the penalty would add to what is less than rigid */
static PetscErrorCode CreateSeries(Vec penalty, Vec compliance, Vec *series)
{
  PetscInt           m;
  PetscScalar       *s;
  const PetscScalar *d;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(penalty, series));
  PetscCall(VecCopy(penalty, *series));
  if (!compliance) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(penalty, &m));
  PetscCall(VecGetArray(*series, &s));
  PetscCall(VecGetArrayRead(compliance, &d));
  for (PetscInt i = 0; i < m; i++) {
    const PetscReal sum = PetscRealPart(d[i]);

    s[i] = sum < 0.0 ? 0.0 : s[i] / (1.0 + sum * PetscRealPart(s[i]));
  }
  PetscCall(VecRestoreArrayRead(compliance, &d));
  PetscCall(VecRestoreArray(*series, &s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C' B C, B in series with D, and B itself, length m: one per row, gamma / (C diag(A)^{-1} C')_ii, or beta I, beta = gamma ||Q_*' A Q_*|| / ||C' C|| (paper, section 3.3) */
static PetscErrorCode CreatePenaltyPart(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt, Mat A, Mat Ct, Mat projection, Vec *penalty, Mat *part)
{
  PetscReal normA, normC;
  Vec       series;
  Mat       BC;

  PetscFunctionBegin;
  if (opt->penalty == AINSWORTH_PENALTY_ROW) PetscCall(AinsworthRowPenaltyCreate(in->C, in->inverseDiagonal, opt->factor, penalty));
  else {
    PetscCall(Multiply(Ct, in->C, part));
    PetscCall(MatNorm(*part, NORM_INFINITY, &normC));
    PetscCall(MatDestroy(part));
    PetscCall(NormOfSum(A, projection, &normA));
    PetscCall(MatCreateVecs(in->C, NULL, penalty));
    PetscCall(VecSet(*penalty, opt->factor * normA / normC));
  }
  PetscCall(CreateSeries(*penalty, in->compliance, &series));
  PetscCall(MatDuplicate(in->C, MAT_COPY_VALUES, &BC));
  PetscCall(MatDiagonalScale(BC, series, NULL));
  PetscCall(Multiply(Ct, BC, part));
  PetscCall(MatDestroy(&BC));
  PetscCall(VecDestroy(&series));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *pmat, M_* - A, becomes what the inner preconditioner takes */
static PetscErrorCode AddA(Mat given, Mat A, AinsworthPmatFormat format, Mat *pmat)
{
  Mat      part[2] = {given, *pmat};
  PetscInt bs;

  PetscFunctionBegin;
  if (format == AINSWORTH_PMAT_SUM) {
    PetscCall(MatCreateComposite(PetscObjectComm((PetscObject)given), 2, part, pmat));
    PetscCall(MatDestroy(&part[1]));
  } else if (format == AINSWORTH_PMAT_AIJ) PetscCall(AinsworthAddAIJ(A, pmat));
  else PetscCall(MatAXPY(*pmat, 1.0, A, DIFFERENT_NONZERO_PATTERN));
  if (format == AINSWORTH_PMAT_HYPRE) PetscCall(MatConvert(*pmat, MATHYPRE, MAT_INPLACE_MATRIX, pmat)); /* of AIJ PCHYPRE would make a copy */
  PetscCall(MatGetBlockSize(given, &bs));
  PetscCall(MatSetBlockSize(*pmat, bs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inv(S), of C W C' where S is another */
static PetscErrorCode CreateInverse(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt, Mat *inverse)
{
  Mat S = in->S, CW, CWt;

  PetscFunctionBegin;
  if (!S && opt->type != PC_AINSWORTH_PMAT_ID) {
    PetscCall(MatDuplicate(in->C, MAT_COPY_VALUES, &CW));
    if (in->weight) PetscCall(MatDiagonalScale(CW, NULL, in->weight));
    PetscCall(MatHermitianTranspose(CW, MAT_INITIAL_MATRIX, &CWt));
    PetscCall(Multiply(in->C, CWt, &S));
    PetscCall(MatDestroy(&CW));
    PetscCall(MatDestroy(&CWt));
  }
  PetscCall(AinsworthInvGramCreate(S, opt, inverse));
  if (!in->S) PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreate - the preconditioning matrix M_* = C' B C + Q_*' A Q_*, n x n, and the penalty B it was made with, length m

   bad is a row with NaN or Inf, -1 where there is none; multigrid would loop over it
*/
PetscErrorCode AinsworthPmatCreate(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt, Vec *penalty, Mat *pmat, PetscInt *bad)
{
  Mat      A, Ct, inverse, projection = NULL;
  PetscInt column;

  PetscFunctionBegin;
  PetscCall(CreateInverse(in, opt, &inverse));
  PetscCall(AinsworthGetAIJ(in->A, &A));
  PetscCall(PetscLogEventBegin(AINSWORTH_PMat, in->A, in->C, in->S, 0));
  PetscCall(MatHermitianTranspose(in->C, MAT_INITIAL_MATRIX, &Ct));
  if (inverse) PetscCall(CreateProjectionPart(in, A, Ct, inverse, opt->symmetric, &projection));
  PetscCall(MatDestroy(&inverse));
  PetscCall(CreatePenaltyPart(in, opt, A, Ct, projection, penalty, pmat));
  if (projection) PetscCall(MatAXPY(*pmat, 1.0, projection, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&projection));
  PetscCall(MatDestroy(&Ct));
  PetscCall(PetscLogEventEnd(AINSWORTH_PMat, in->A, in->C, in->S, 0));
  PetscCall(PetscLogEventBegin(AINSWORTH_PMatCopy, in->A, 0, 0, 0));
  PetscCall(AinsworthMatFindNotFinite(*pmat, bad, &column));
  if (*bad < 0) PetscCall(AddA(in->A, A, in->format, pmat));
  PetscCall(PetscLogEventEnd(AINSWORTH_PMatCopy, in->A, 0, 0, 0));
  PetscCall(MatDestroy(&A));
  if (opt->symmetric) PetscCall(MatSetOption(*pmat, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
