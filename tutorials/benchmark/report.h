/* The line that every tutorial ends with: size, time, and the residuals of the original blocks */
#ifndef TUTORIALS_REPORT_H
#define TUTORIALS_REPORT_H

#include "saddle.h"

/* ||f - A x - B' lambda||_2 / ||f||_2, absolute where f = 0, and ||C x - D lambda - g||_inf / (1 + ||g||_inf) */
PetscErrorCode ReportResiduals(const SaddleBlocks &, Vec f, Vec g, Vec x, Vec lambda, PetscReal residuals[2]);
PetscErrorCode ReportSolution(const SaddleBlocks &, Vec f, Vec g, const SaddleSolution &);
PetscErrorCode ReportIterations(KSP, PetscInt *);

#endif
