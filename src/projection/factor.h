/*
   The factorization of the Gram matrix: choice of the package, and handling of its failures (docs/method.md, Gram
   matrix)
*/
#ifndef AINSWORTH_FACTOR_H
#define AINSWORTH_FACTOR_H

#include "symbolic.h"
#include <functional>
#include <string>

struct AinsworthFactor {
  /* predicted; 0 if nothing is predicted: the options choose the solver, ranks share it, or S is not Hermitian */
  AinsworthCost  cost;
  MatSolverType  package = NULL; /* chosen here; NULL if the options choose */
  IS             order   = NULL; /* given to CHOLMOD; NULL: CHOLMOD orders itself */
  Mat            upper   = NULL; /* upper triangle, which CHOLMOD factors */
  PCFailedReason failed  = {};   /* set for packages that raise an error where others give a reason */
};

PetscErrorCode AinsworthFactorIsPackage(PC, const char[], PetscBool *);
PetscErrorCode AinsworthFactorPredictBest(Mat, PetscInt, AinsworthCost *, MatOrderingType *, IS *);
PetscErrorCode AinsworthFactorChoose(AinsworthFactor *, Mat, PetscBool, KSP);
PetscErrorCode AinsworthFactorCheckMemory(const AinsworthFactor *, MPI_Comm);
PetscErrorCode AinsworthFactorSetUp(AinsworthFactor *, Mat, KSP);
PetscErrorCode AinsworthFactorTry(const std::function<PetscErrorCode()> &, PetscErrorCode *, std::string *);
PetscErrorCode AinsworthFactorTryUnlogged(const std::function<PetscErrorCode()> &, PetscErrorCode *, std::string *);
PetscErrorCode AinsworthFactorTryCholmod(PetscObject, bool, const std::function<PetscErrorCode()> &, PetscBool *);
PetscErrorCode AinsworthFactorGetFailedReason(const AinsworthFactor *, KSP, PCFailedReason *);
PetscErrorCode AinsworthFactorReset(AinsworthFactor *);
PetscErrorCode AinsworthFactorView(const AinsworthFactor *, PetscViewer);

#endif
