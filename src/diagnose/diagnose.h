/* Words: what the solver is, why a solve failed, what a diagnosis finds */
#ifndef AINSWORTH_DIAGNOSE_H
#define AINSWORTH_DIAGNOSE_H

#include "../inner/solver.h"
#include "diagnosis.h"

/* Stages of set-up, each with its own part of the diagnosis */
typedef enum {
  AINSWORTH_STAGE_PASSED,      /* the program's matrix is known */
  AINSWORTH_STAGE_BLOCKS,      /* so is its normal form */
  AINSWORTH_STAGE_CONSTRAINTS, /* the projector is set up, or there are no constraints */
  AINSWORTH_STAGE_REDUCED      /* everything is set up */
} AinsworthStage;

/* describe.cpp */
PETSC_INTERN PetscErrorCode AinsworthDescribePmat(const AinsworthSolver *, std::string &);
PETSC_INTERN PetscErrorCode AinsworthDescribeLeftOut(const AinsworthSolver *, PetscBool unchanged, std::string &);
/* explain.cpp, trial.cpp */
PETSC_INTERN PetscErrorCode AinsworthExplain(PC, AinsworthSolver *, KSP, Vec, KSPConvergedReason, char[], size_t);
PETSC_INTERN PetscErrorCode AinsworthTry(PC, AinsworthSolver *, KSPConvergedReason *, PetscInt *, PetscReal *, char[],
                                         size_t);
/* findings.cpp, blocks.cpp */
PETSC_INTERN PetscErrorCode AinsworthDiagnose(PC, AinsworthSolver *, const AinsworthSaddleInputs &, AinsworthStage,
                                              PetscBool unchanged, AinsworthDiagnosis *);
PETSC_INTERN PetscErrorCode AinsworthDiagnoseFailure(MPI_Comm, AinsworthDiagnosis *, PetscErrorCode, const char[]);
PETSC_INTERN PetscErrorCode AinsworthDiagnosePassed(const AinsworthSaddleInputs &, AinsworthDiagnosis *);
PETSC_INTERN PetscErrorCode AinsworthDiagnoseBlocks(const AinsworthSolver *, AinsworthDiagnosis *);

#endif
