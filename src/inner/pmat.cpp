#include "pmat.h"
#include "../base/events.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../projection/projector.h"

/* Computes Y A from Y', which has few nonzero rows; reads only these rows of A */
static PetscErrorCode MultiplyFewRows(Mat Yt, Mat A, Mat *product)
{
  Mat few[2] = {Yt, A};
  IS  rows;

  PetscFunctionBegin;
  PetscCall(MatFindNonzeroRows(Yt, &rows)); /* NULL: all rows */
  for (Mat &mat : few)
    if (rows) PetscCall(MatCreateSubMatrix(mat, rows, NULL, MAT_INITIAL_MATRIX, &mat));
  PetscCall(AinsworthMultiplyAdjoint(few[0], few[1], product));
  for (Mat &mat : few)
    if (rows) PetscCall(MatDestroy(&mat));
  PetscCall(ISDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes C' B C + Q_*' A Q_* - A = -C' Y A - A Y' C + C' (Y A Y' + B) C with Q_* = I - Y' C and Y = Inv(S) C W
   (docs/method.md, surface-only assembly)

   B may be NULL for 0. If A is symmetric, this is H + H' with H = C' ((Y A Y' + B) C / 2 - Y A).
*/
static PetscErrorCode MultiplyProjection(Mat A, Mat C, Mat CW, Mat inverse, Vec B, PetscBool symmetric, Mat *part)
{
  Mat Y, Yt, YA, YAYt, sum, other;

  PetscFunctionBegin;
  PetscCall(AinsworthMultiply(inverse, CW, &Y));
  PetscCall(MatHermitianTranspose(Y, MAT_INITIAL_MATRIX, &Yt));
  PetscCall(MatDestroy(&Y));
  PetscCall(MultiplyFewRows(Yt, A, &YA));
  PetscCall(AinsworthMultiply(YA, Yt, &YAYt));
  if (B) {
    PetscCall(AinsworthCreateFromDiagonal(B, &other));
    PetscCall(AinsworthAddAIJ(1.0, {other}, &YAYt));
    PetscCall(MatDestroy(&other));
  }
  PetscCall(AinsworthMultiply(YAYt, C, &sum));
  PetscCall(MatDestroy(&YAYt));
  if (symmetric) PetscCall(MatScale(sum, 0.5));
  PetscCall(AinsworthAddAIJ(-1.0, {YA}, &sum));
  PetscCall(MatDestroy(&YA));
  PetscCall(AinsworthMultiplyAdjoint(C, sum, part));
  PetscCall(MatDestroy(&sum));
  if (symmetric) PetscCall(MatHermitianTranspose(*part, MAT_INITIAL_MATRIX, &other));
  else {
    Mat AYt;

    PetscCall(AinsworthMultiply(A, Yt, &AYt));
    PetscCall(AinsworthMultiply(AYt, C, &other));
    PetscCall(MatDestroy(&AYt));
  }
  PetscCall(MatDestroy(&Yt));
  PetscCall(AinsworthAddAIJ(symmetric ? 1.0 : -1.0, {other}, part));
  PetscCall(MatDestroy(&other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Creates Q_*' A Q_* - A, plus C' B C if B is not NULL; NULL for id. C may lack entries of long rows. Collective
*/
static PetscErrorCode CreateProjectionPart(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt, Mat C, Vec B,
                                           Mat *part)
{
  Mat CW, CWt, S, inverse;

  PetscFunctionBegin;
  *part = NULL;
  if (opt->type == PC_AINSWORTH_PMAT_ID) {
    PetscCall(AinsworthPmatCheckFill(in->aij, in->C, NULL, &in->fill, opt->type));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthPmatCreatePrivate(C, in->weight, &in->fill, &CW));
  PetscCall(MatHermitianTranspose(CW, MAT_INITIAL_MATRIX, &CWt));
  PetscCall(AinsworthMultiply(C, CWt, &S));
  PetscCall(MatDestroy(&CWt));
  PetscCall(AinsworthAddAIJ(1.0, {in->N}, &S));
  PetscCall(AinsworthInvGramCreate(S, opt, &inverse));
  PetscCall(MatDestroy(&S));
  PetscCall(AinsworthPmatCheckFill(in->aij, in->C, inverse, &in->fill, opt->type));
  PetscCall(MultiplyProjection(in->aij, C, CW, inverse, B, opt->symmetric, part));
  PetscCall(MatDestroy(&inverse));
  PetscCall(MatDestroy(&CW));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes C' B C */
static PetscErrorCode MultiplyBothSides(Mat C, Vec B, Mat *product)
{
  Mat BC;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &BC));
  PetscCall(MatDiagonalScale(BC, B, NULL));
  PetscCall(AinsworthMultiplyAdjoint(C, BC, product));
  PetscCall(MatDestroy(&BC));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Adds 1e-12 diag(M) to M: if a body floats, M_* is singular, and coarse matrices of BoomerAMG have diagonal entries
   that are zero, or negative by rounding

   Then hypre's estimate of their largest eigenvalue does not terminate.
*/
static PetscErrorCode Shift(Mat M)
{
  static const PetscReal shift = 1e-12;
  Vec                    diagonal;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(M, &diagonal, NULL));
  PetscCall(MatGetDiagonal(M, diagonal));
  PetscCall(VecScale(diagonal, shift));
  PetscCall(MatDiagonalSet(M, diagonal, ADD_VALUES));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gives unknowns in no equation, which are in a null space that the program attached, a diagonal entry: nothing else is
   in their rows of M. Collective
*/
static PetscErrorCode HoldUnused(Vec inverseDiagonal, Mat M)
{
  PetscInt zeros = 0;
  Vec      diagonal, sums;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(M, NULL, &diagonal));
  PetscCall(MatGetDiagonal(M, diagonal));
  PetscCall(AinsworthForEntries({diagonal}, [&](PetscInt, PetscScalar d) { zeros += d == 0.0; }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &zeros, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)M)));
  if (zeros) {
    PetscCall(VecDuplicate(diagonal, &sums));
    PetscCall(AinsworthRowSums(M, 1, sums));
    PetscCall(AinsworthUpdate(diagonal, {sums, inverseDiagonal},
                              [](PetscInt, PetscScalar &d, PetscScalar sum, PetscScalar inverse) {
                                if (sum == 0.0) d = 1.0 / inverse;
                              }));
    PetscCall(MatDiagonalSet(M, diagonal, INSERT_VALUES));
    PetscCall(VecDestroy(&sums));
  }
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes an AIJ matrix one that the inner preconditioner takes. Collective */
static PetscErrorCode Finish(const AinsworthPmatInputs *in, Mat *pmat)
{
  PetscFunctionBegin;
  PetscCall(AinsworthStoreDiagonal(pmat));
  PetscCall(HoldUnused(in->inverseDiagonal, *pmat));
  if (in->format != AINSWORTH_PMAT_HYPRE) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Shift(*pmat));
  PetscCall(MatConvert(*pmat, MATHYPRE, MAT_INPLACE_MATRIX, pmat)); /* PCHYPRE would copy an AIJ matrix */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Converts *pmat from M_* - A to the format that the inner preconditioner takes */
static PetscErrorCode AddA(const AinsworthPmatInputs *in, Mat A, Mat *pmat)
{
  const AinsworthPmatFormat format  = in->format;
  Mat                       part[2] = {A, *pmat};

  PetscFunctionBegin;
  if (format == AINSWORTH_PMAT_SUM) {
    PetscCall(MatCreateComposite(PetscObjectComm((PetscObject)A), part[1] ? 2 : 1, part, pmat));
    PetscCall(MatDestroy(&part[1]));
  } else {
    PetscCall(AinsworthAddAIJ(1.0, {A}, pmat));
    PetscCall(Finish(in, pmat));
  }
  PetscCall(MatSetBlockSize(*pmat, in->bs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MarkSymmetric(Mat M)
{
  PetscFunctionBegin;
  PetscCall(MatSetOption(M, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreateAlone - creates the matrix for BoomerAMG without constraints: A, n x n, shifted like M_*, as a
   floating body would end its elimination on the coarsest level with an error of one rank. Collective
*/
PetscErrorCode AinsworthPmatCreateAlone(const AinsworthPmatInputs *in, PetscBool symmetric, Mat *pmat)
{
  PetscFunctionBegin;
  PetscCall(MatDuplicate(in->aij, MAT_COPY_VALUES, pmat));
  PetscCall(Finish(in, pmat));
  if (symmetric) PetscCall(MarkSymmetric(*pmat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreate - creates the preconditioning matrix M_* = C' B C + Q_*' A Q_*, n x n, and its penalty B, length
   m. Collective

   bad: a row with NaN or Inf, on which multigrid might not terminate; -1 if there is none.
*/
PetscErrorCode AinsworthPmatCreate(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt, Vec *penalty,
                                   Mat *pmat, PetscInt *bad)
{
  Mat C, rest, loose = NULL, held = NULL, projection, shift = NULL,
               base = in->format == AINSWORTH_PMAT_SUM ? in->A : in->aij;
  Vec      series;
  PetscInt column;
  /* this penalty needs no norm of Q_*' A Q_*, and is added together with it */
  bool byRow = opt->penalty == AINSWORTH_PENALTY_ROW;

  PetscFunctionBegin;
  *bad = -1;
  PetscCall(PetscLogEventBegin(AINSWORTH_PMat, in->A, in->C, 0, 0));
  if (in->inKernel) {
    PetscCall(AinsworthRowPenaltyCreate(in->C, in->inverseDiagonal, opt->factor, penalty));
    PetscCall(AinsworthPmatCreateInKernel(in->kernel, opt, in->inKernel));
    *pmat                = NULL;
    const Mat correction = in->inKernel->correction;

    if (correction) PetscCall(AinsworthMatFindEntry(correction, AinsworthIsNotFinite, bad, &column));
    PetscCall(PetscLogEventEnd(AINSWORTH_PMat, in->A, in->C, 0, 0));
    if (*bad < 0) PetscCall(AddA(in, base, pmat));
    if (*bad < 0) PetscCall(MarkSymmetric(*pmat));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthPmatCreateShort(in->C, &in->fill, &C));
  if (!in->shared.empty()) PetscCall(AinsworthPmatHoldShared(in, &C, &held));
  if (byRow && in->weight && in->format != AINSWORTH_PMAT_FACTOR) { /* a factorization needs no elimination */
    PetscCall(AinsworthPmatEliminateLoose(in, opt->factor, C, &rest, &loose));
    PetscCall(MatDestroy(&C));
    C = rest;
  }
  if (byRow) PetscCall(AinsworthPmatCreatePenalty(in, opt, C, NULL, penalty, &series));
  PetscCall(CreateProjectionPart(in, opt, C, byRow ? series : NULL, &projection));
  if (!byRow) PetscCall(AinsworthPmatCreatePenalty(in, opt, C, projection, penalty, &series));
  if (byRow && projection) {
    *pmat      = projection;
    projection = NULL;
  } else PetscCall(MultiplyBothSides(C, series, pmat));
  PetscCall(VecDestroy(&series));
  if (in->fill.leftOut) PetscCall(AinsworthPmatCreateShift(in, &shift));
  PetscCall(AinsworthAddAIJ(1.0, {projection, loose, held, shift}, pmat));
  for (Mat *part : {&projection, &loose, &held, &shift}) PetscCall(MatDestroy(part));
  PetscCall(MatDestroy(&C));
  PetscCall(PetscLogEventEnd(AINSWORTH_PMat, in->A, in->C, 0, 0));
  PetscCall(PetscLogEventBegin(AINSWORTH_PMatCopy, in->A, 0, 0, 0));
  PetscCall(AinsworthMatFindEntry(*pmat, AinsworthIsNotFinite, bad, &column));
  if (*bad < 0) PetscCall(AddA(in, base, pmat));
  PetscCall(PetscLogEventEnd(AINSWORTH_PMatCopy, in->A, 0, 0, 0));
  if (opt->symmetric) PetscCall(MarkSymmetric(*pmat));
  PetscFunctionReturn(PETSC_SUCCESS);
}
