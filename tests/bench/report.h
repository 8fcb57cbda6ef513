/* The line that every tutorial ends with: size, time, and the residuals of the original blocks */
#ifndef TUTORIALS_REPORT_H
#define TUTORIALS_REPORT_H

#include "saddle.h"
#include <petscsnes.h>

/* ||f - A x - B' lambda||_2 / ||f||_2, absolute where f = 0, and ||C x - D lambda - g||_inf / (1 + ||g||_inf) */
PetscErrorCode ReportResiduals(const SaddleBlocks &, Vec f, Vec g, Vec x, Vec lambda, PetscReal residuals[2]);
PetscErrorCode ReportSolution(const SaddleBlocks &, Vec f, Vec g, const SaddleSolution &);
PetscErrorCode ReportIterations(KSP, PetscInt *);
/*
   What this rank has used so far, whatever else runs: seconds of the processor, pages touched for the first time, bytes
   in use at most
*/
struct ReportUsage {
  double seconds, pages, peak;
};
ReportUsage   ReportGetUsage();
inline double ReportProcessor()
{
  return ReportGetUsage().seconds;
}
/* For SNESMonitorSet(): adds the iterations of each step to the PetscInt that is ctx */
PetscErrorCode ReportCount(SNES, PetscInt, PetscReal, void *ctx);
/* For SNESSetUpdate(): each step begins with a solver that knows nothing of the last one */
PetscErrorCode ReportForget(SNES, PetscInt);

#endif
