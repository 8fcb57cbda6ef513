/* The line that every tutorial ends with: size, time, and the residuals of the original blocks */
#ifndef TUTORIALS_REPORT_H
#define TUTORIALS_REPORT_H

#include "saddle.h"
#include <petscsnes.h>

/* ||f - A x - B' lambda||_2 / ||f||_2, absolute where f = 0, and ||C x - D lambda - g||_inf / (1 + ||g||_inf) */
PetscErrorCode ReportResiduals(const SaddleBlocks &, Vec f, Vec g, Vec x, Vec lambda, PetscReal residuals[2]);
PetscErrorCode ReportSolution(const SaddleBlocks &, Vec f, Vec g, const SaddleSolution &);
PetscErrorCode ReportIterations(KSP, PetscInt *);
/* Processor seconds of this rank so far, whatever else runs */
double ReportProcessor();
/* For SNESMonitorSet(): adds the iterations of each step to the PetscInt that is ctx */
PetscErrorCode ReportCount(SNES, PetscInt, PetscReal, void *ctx);
/* For SNESSetUpdate(): each step begins with a solver that knows nothing of the last one */
PetscErrorCode ReportForget(SNES, PetscInt);

#endif
