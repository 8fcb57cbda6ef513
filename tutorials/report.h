/* The line that every tutorial ends with: size, time, and the residuals of the original blocks */
#ifndef TUTORIALS_REPORT_H
#define TUTORIALS_REPORT_H

#include "saddle.h"

PetscErrorCode ReportSolution(Mat A, Mat C, Vec f, Vec g, const SaddleSolution &);

#endif
