/* What the blocks look like to a reader: signs, scales, long rows, jumps, unknowns that nothing holds (docs/diagnose.md) */
#ifndef AINSWORTH_SURVEY_H
#define AINSWORTH_SURVEY_H

#include "../petsccompat.h"

/* Entries of a vector: of a diagonal, or norms of rows; places are -1 where there is none */
struct AinsworthSurvey {
  PetscInt  positive = 0, negative = 0, zero = 0; /* their numbers */
  PetscInt  firstNegative = -1, firstZero = -1;   /* places */
  PetscReal least = 0.0, most = 0.0;              /* moduli of those that are not zero */
  PetscInt  leastRow = -1, mostRow = -1;
};

/* The largest quotient of the diagonal entries of unknowns of one component that A couples */
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
