/* The penalty B, and what is left of it in series with D */
#include "pmat.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../projection/projector.h"

const char *const AinsworthPenaltyTypes[] = {"row", "norm", "AinsworthPenaltyType", "AINSWORTH_PENALTY_", NULL};

/*
   Computes the infinity norm of A + part (may be NULL), the 1-norm of a symmetric matrix; MatNorm() with NORM_1 stores
   a whole row on every rank
*/
static PetscErrorCode NormOfSum(Mat A, Mat part, PetscReal *norm)
{
  Mat sum;

  PetscFunctionBegin;
  *norm = 0.0;
  if (part) {
    PetscCall(MatDuplicate(part, MAT_COPY_VALUES, &sum));
    PetscCall(AinsworthAddAIJ(1.0, {A}, &sum));
    PetscCall(MatNorm(sum, NORM_INFINITY, norm));
    PetscCall(MatDestroy(&sum));
  }
  if (*norm == 0.0) PetscCall(MatNorm(A, NORM_INFINITY, norm)); /* Ker C = 0: any penalty works */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreateSeries - creates (B^{-1} + D)^{-1}, penalty and compliance in series; 0 where D_ii < 0, where a
   penalty would be too stiff
*/
PetscErrorCode AinsworthPmatCreateSeries(Vec penalty, Vec compliance, Vec *series)
{
  PetscFunctionBegin;
  PetscCall(AinsworthVecClone(penalty, series));
  if (!compliance) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthUpdate(*series, {compliance}, [](PetscInt, PetscScalar &s, PetscScalar d) {
    const PetscReal sum = PetscRealPart(d);

    s = sum < 0.0 ? 0.0 : s / (1.0 + sum * PetscRealPart(s));
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreatePenalty - creates the penalty B, length m, and B in series with D for M_*; C may lack entries of
   long rows. Collective

   B_ii = gamma / (C diag(A)^{-1} C')_ii, or B = beta I with beta = gamma ||Q_*' A Q_*|| / ||C' C|| (paper, section
   3.3).
*/
PetscErrorCode AinsworthPmatCreatePenalty(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt, Mat C,
                                          Mat projection, Vec *penalty, Vec *series)
{
  PetscReal normA, normC;
  Mat       product;

  PetscFunctionBegin;
  if (opt->penalty == AINSWORTH_PENALTY_ROW)
    PetscCall(AinsworthRowPenaltyCreate(in->C, in->inverseDiagonal, opt->factor, penalty));
  else {
    PetscCall(AinsworthMultiplyAdjoint(C, C, &product));
    PetscCall(MatNorm(product, NORM_INFINITY, &normC));
    PetscCall(MatDestroy(&product));
    if (normC == 0.0) PetscCall(MatNorm(in->C, NORM_INFINITY, &normC)); /* all rows are long */
    PetscCall(NormOfSum(in->aij, projection, &normA));
    PetscCall(AinsworthCreateVecs(in->C, NULL, penalty));
    PetscCall(VecSet(*penalty, opt->factor * normA / normC));
  }
  PetscCall(AinsworthPmatCreateSeries(*penalty, in->compliance, series));
  PetscFunctionReturn(PETSC_SUCCESS);
}
