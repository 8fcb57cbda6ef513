/* Facts about the blocks for a diagnosis: signs, scales, long rows, jumps, loose unknowns (docs/troubleshooting.md) */
#ifndef AINSWORTH_SURVEY_H
#define AINSWORTH_SURVEY_H

#include "../base/petsccompat.h"

/* Summary of the entries of a vector (a diagonal, or norms of rows); row numbers are -1 if there is none */
struct AinsworthSurvey {
  PetscInt  positive = 0, negative = 0, zero = 0; /* number of such entries */
  PetscInt  firstNegative = -1, firstZero = -1;   /* global row numbers */
  PetscReal least = 0.0, most = 0.0;              /* absolute values of nonzero entries */
  PetscInt  leastRow = -1, mostRow = -1;
};

/* The largest ratio of diagonal entries of two unknowns of the same component that A couples */
struct AinsworthJump {
  PetscReal quotient = 1.0;
  PetscInt  row = -1, col = -1;
};

PetscErrorCode AinsworthSurveyDiagonal(Mat, AinsworthSurvey *);
PetscErrorCode AinsworthSurveyRows(Mat, AinsworthSurvey *norms, PetscInt *longest, PetscInt *row);
PetscErrorCode AinsworthSurveyColumns(Mat, PetscInt *most, PetscInt *column);
PetscErrorCode AinsworthSurveyLoose(Mat A, Mat B, PetscInt *loose, PetscInt *first);
PetscErrorCode AinsworthSurveyJump(Mat A, PetscInt bs, AinsworthJump *);
PetscErrorCode AinsworthSurveyPenalty(Mat A, Mat C, PetscBool *penalty);

#endif
