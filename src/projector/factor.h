/* The factorisation of the Gram matrix: which package, and what its failures become (docs/method.md, Gram matrix) */
#ifndef AINSWORTH_FACTOR_H
#define AINSWORTH_FACTOR_H

#include "symbolic.h"
#include <functional>

struct AinsworthFactor {
  AinsworthCost  cost;    /* predicted; 0: the solver is not of our choice, or shared */
  MatSolverType  package; /* of our choice, else NULL */
  IS             order;   /* that CHOLMOD takes, NULL: it looks for one */
  Mat            upper;   /* what it factors: the upper triangle */
  PCFailedReason failed;  /* of a package that raises an error where others give a reason */
};

PetscErrorCode AinsworthFactorIsPackage(PC, const char[], PetscBool *);
PetscErrorCode AinsworthFactorPredictBest(Mat, PetscInt, AinsworthCost *, MatOrderingType *, IS *);
PetscErrorCode AinsworthFactorChoose(AinsworthFactor *, Mat, PetscBool, KSP);
PetscErrorCode AinsworthFactorCheckMemory(const AinsworthFactor *, MPI_Comm);
PetscErrorCode AinsworthFactorSetUp(AinsworthFactor *, Mat, KSP);
PetscErrorCode AinsworthFactorTryCholmod(PetscObject, bool, const std::function<PetscErrorCode()> &, PetscBool *);
PetscErrorCode AinsworthFactorGetFailedReason(const AinsworthFactor *, KSP, PCFailedReason *);
PetscErrorCode AinsworthFactorReset(AinsworthFactor *);
PetscErrorCode AinsworthFactorView(const AinsworthFactor *, PetscViewer);

#endif
