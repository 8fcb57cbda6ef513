#include "pmat.h"
#include "sum.h"
#include "../events.h"
#include "../projector/projector.h"

const char *const PCAinsworthPenaltyTypes[] = {"row", "norm", "PCAinsworthPenaltyType", "PC_AINSWORTH_PENALTY_", NULL};
const char *const PCAinsworthPmatTypes[]    = {"jcb", "id", "cc", "cg", "bj_cc", "bj_cg", "PCAinsworthPmatType", "PC_AINSWORTH_PMAT_", NULL};

/* U = Y op(A) - 1/2 T C with T = Y op(A) Y', op(A) = A or A'; m x n */
static PetscErrorCode CreateU(Mat A, Mat C, Mat Y, PetscBool transpose, Mat *U)
{
  Mat Yt, T, TC;

  PetscFunctionBegin;
  PetscCall(MatHermitianTranspose(Y, MAT_INITIAL_MATRIX, &Yt));
  if (transpose) {
    Mat AYt;
    PetscCall(MatMatMult(A, Yt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &AYt));
    PetscCall(MatHermitianTranspose(AYt, MAT_INITIAL_MATRIX, U));
    PetscCall(MatDestroy(&AYt));
  } else PetscCall(MatMatMult(Y, A, MAT_INITIAL_MATRIX, PETSC_DEFAULT, U));
  PetscCall(MatMatMult(*U, Yt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &T));
  PetscCall(MatDestroy(&Yt));
  PetscCall(MatMatMult(T, C, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &TC));
  PetscCall(MatDestroy(&T));
  PetscCall(MatAXPY(*U, -0.5, TC, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&TC));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   E = Q_*' A Q_* - A = -(C' U + U2' C), from products with m rows only: the cost follows the contact surface

   Q_* = I - Y' C, Y = Inv(S) C W; U2 is U of A', the same where A is symmetric (docs/method.md, surface-only assembly).
*/
static PetscErrorCode CreateProjectionUpdate(const AinsworthPmatInputs *in, Mat inverse, Mat Ct, PetscBool symmetric, Mat *E)
{
  Mat CW = in->C, Y, U, G, Gt;

  PetscFunctionBegin;
  if (in->weight) {
    PetscCall(MatDuplicate(in->C, MAT_COPY_VALUES, &CW));
    PetscCall(MatDiagonalScale(CW, NULL, in->weight));
  }
  PetscCall(MatMatMult(inverse, CW, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &Y));
  if (in->weight) PetscCall(MatDestroy(&CW));
  PetscCall(CreateU(in->A, in->C, Y, PETSC_FALSE, &U));
  PetscCall(MatMatMult(Ct, U, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &G));
  PetscCall(MatDestroy(&U));
  if (symmetric) PetscCall(MatHermitianTranspose(G, MAT_INITIAL_MATRIX, &Gt));
  else {
    Mat G2;
    PetscCall(CreateU(in->A, in->C, Y, PETSC_TRUE, &U));
    PetscCall(MatMatMult(Ct, U, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &G2));
    PetscCall(MatDestroy(&U));
    PetscCall(MatHermitianTranspose(G2, MAT_INITIAL_MATRIX, &Gt));
    PetscCall(MatDestroy(&G2));
  }
  PetscCall(MatDestroy(&Y));
  PetscCall(MatAXPY(G, 1.0, Gt, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&Gt));
  PetscCall(MatScale(G, -1.0));
  *E = G;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreate - the preconditioning matrix M_* = C' B C + Q_*' A Q_*, n x n AIJ, and the penalty B it was made with, length m

   B is one per row, gamma / (C diag(A)^{-1} C')_ii, or beta I with beta = gamma ||Q_*' A Q_*||_1 / ||C' C||_1 (paper, section 3.3).
*/
PetscErrorCode AinsworthPmatCreate(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt, Vec *penalty, Mat *pmat)
{
  Mat A = in->A, BC, Ct, E, inverse, projection = NULL;

  PetscFunctionBegin;
  PetscCall(AinsworthInvGramCreate(in->S, opt, &inverse));
  PetscCall(PetscLogEventBegin(AINSWORTH_PMat, A, in->C, in->S, 0));
  PetscCall(MatHermitianTranspose(in->C, MAT_INITIAL_MATRIX, &Ct));
  if (inverse) PetscCall(CreateProjectionUpdate(in, inverse, Ct, opt->symmetric, &projection));
  PetscCall(MatDestroy(&inverse));
  PetscCall(MatDuplicate(in->C, MAT_COPY_VALUES, &BC));
  if (opt->penalty == PC_AINSWORTH_PENALTY_ROW) {
    Vec D;
    PetscCall(AinsworthWeightCreate(A, &D));
    PetscCall(AinsworthRowPenaltyCreate(in->C, D, opt->factor, penalty));
    PetscCall(VecDestroy(&D));
    PetscCall(MatDiagonalScale(BC, *penalty, NULL));
  }
  PetscCall(MatMatMult(Ct, BC, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &E));
  PetscCall(MatDestroy(&BC));
  PetscCall(MatDestroy(&Ct));
  if (opt->penalty == PC_AINSWORTH_PENALTY_NORM) {
    PetscReal normA, normC;

    PetscCall(MatNorm(E, NORM_INFINITY, &normC));
    if (projection) PetscCall(AinsworthSumNorm(A, projection, &normA));
    else PetscCall(MatNorm(A, NORM_INFINITY, &normA));
    PetscCall(MatScale(E, opt->factor * normA / normC));
    PetscCall(MatCreateVecs(in->C, NULL, penalty));
    PetscCall(VecSet(*penalty, opt->factor * normA / normC));
  }
  if (projection) {
    PetscCall(MatAXPY(E, 1.0, projection, DIFFERENT_NONZERO_PATTERN));
    PetscCall(MatDestroy(&projection));
  }
  PetscCall(AinsworthSum(A, E, in->frame, pmat));
  PetscCall(MatDestroy(&E));
  if (opt->symmetric) PetscCall(MatSetOption(*pmat, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(PetscLogEventEnd(AINSWORTH_PMat, A, in->C, in->S, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
