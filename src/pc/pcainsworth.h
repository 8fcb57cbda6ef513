/* PCAINSWORTH drives the solve: saddle -> projector -> operator and pmat -> inner KSP -> x and lambda */
#ifndef AINSWORTH_PCAINSWORTH_H
#define AINSWORTH_PCAINSWORTH_H

#include <petscainsworth.h>
#include "../inner/whole.h"
#include "../refine/refine.h"
#include "../diagnose/diagnose.h"
#include "../inner/solver.h"

/* Verdict of the program's own system on a solution */
typedef enum {
  AINSWORTH_VERDICT_MET,
  AINSWORTH_VERDICT_UNMET,        /* a residual is larger than requested */
  AINSWORTH_VERDICT_SINGULAR,     /* A is singular on Ker C, and f is not balanced there */
  AINSWORTH_VERDICT_CONTRADICTION /* no x satisfies this right-hand side of the constraints */
} AinsworthVerdict;

/* What the outer method makes of an application */
typedef enum {
  AINSWORTH_OUTER_NONE,     /* there is none: it is the answer, and judged as such */
  AINSWORTH_OUTER_ANSWER,   /* KSPPREONLY: likewise */
  AINSWORTH_OUTER_FLEXIBLE, /* an iteration, which bears with another operator in each application */
  AINSWORTH_OUTER_RIGID     /* an iteration that assumes a linear preconditioner */
} AinsworthOuter;

/* What became of the last set-up */
typedef enum {
  PC_AINSWORTH_NONE,    /* there was none, or an error ended it, or a solve since: what it made is not used */
  PC_AINSWORTH_REFUSED, /* it failed with a reason, and is not repeated before something changes */
  PC_AINSWORTH_STALE,   /* a choice changed since, or the inner solver was lost */
  PC_AINSWORTH_READY,   /* everything is set up */
  /* likewise, and there was nothing to do: A, C and all choices are those of the set-up before */
  PC_AINSWORTH_UNCHANGED
} PCAinsworthState;

/* A field that the program named: an index set, or components of each node, in rows and columns */
struct PCAinsworthNamedField {
  std::string           name;
  AinsworthRef<IS>      is;
  std::vector<PetscInt> rows, cols;
};

/* What the program passed, and its fields (pcfields.cpp) */
struct PCAinsworthGiven {
  AinsworthSaddleInputs              inputs;
  std::vector<PCAinsworthNamedField> named;
  std::string                        rows;           /* of the multipliers, as an option names them */
  PetscInt                           components = 0; /* per node of the whole matrix; 0 for its block size */
  PetscObjectId                      mat        = 0; /* the matrix to which inputs.fields belong */
  PetscObjectId                      dm         = 0; /* the DM from which they were taken */
};

/* The factor of the whole system (pcladder.cpp) */
struct PCAinsworthWhole {
  AinsworthWhole *factor   = NULL; /* NULL as long as the reduced system is solved */
  char            why[512] = {};   /* why it was made */
};

/* How the last set-up or solve ended */
struct PCAinsworthOutcome {
  char      why[512] = {};          /* why it failed; empty if it did not */
  PetscBool usable   = PETSC_FALSE; /* the result is usable by an outer method */
  /* largest terms of each row of C x in all solves, if rows are dependent: later residuals contain their rounding */
  Vec terms = NULL;
};

/* The outer solve, from PCPreSolve() to PCPostSolve() (pcouter.cpp) */
struct PCAinsworthOuterSolve {
  AinsworthOuter method       = {};
  PetscInt       applications = 0; /* since the last solve began: a failure since then is that of a solve */
};

/* Error against run time (pcreport.cpp) */
struct PCAinsworthReporting {
  AinsworthReport *report       = NULL; /* NULL until a solve is reported on */
  PetscLogDouble   setupSeconds = 0.0;  /* of set-ups not followed by a solve yet */
};

/* The reduced solution of one of several right-hand sides, which its application takes instead of a solve */
struct PCAinsworthFound {
  const class AinsworthTogether *all    = NULL; /* NULL: there is none */
  PetscInt                       column = 0;
};

/*
   The solver, and around it what the program gave and what it gets: from the first to the last in the order of the data
*/
struct PC_Ainsworth : AinsworthSolver {
  PCAinsworthGiven      given;
  PCAinsworthWhole      whole; /* takes the place of the reduced system */
  PCAinsworthState      state = PC_AINSWORTH_NONE;
  PCAinsworthOuterSolve outer;
  PCAinsworthOutcome    outcome;
  PCAinsworthReporting  reporting;
  PCAinsworthFound      found; /* for the next application (pcmatapply.cpp) */

  std::unique_ptr<AinsworthDiagnosis> diagnosis; /* NULL unless requested */
};

PETSC_INTERN PC_Ainsworth  *PCAinsworthData_Private(PC);
PETSC_INTERN PetscErrorCode PCCreate_Ainsworth(PC);
PETSC_INTERN PetscErrorCode PCSetUp_Ainsworth(PC);
PETSC_INTERN PetscErrorCode PCSetUpOnBlocks_Ainsworth(PC);
PETSC_INTERN PetscErrorCode PCPreSolve_Ainsworth(PC, KSP, Vec, Vec);
PETSC_INTERN PetscErrorCode PCPostSolve_Ainsworth(PC, KSP, Vec, Vec);
PETSC_INTERN PetscErrorCode PCApply_Ainsworth(PC, Vec, Vec);
PETSC_INTERN PetscErrorCode PCApplyTranspose_Ainsworth(PC, Vec, Vec);
PETSC_INTERN PetscErrorCode PCMatApply_Ainsworth(PC, Mat, Mat);
PETSC_INTERN PetscErrorCode PCAinsworthRefresh_Private(PC);
PETSC_INTERN PetscErrorCode PCAinsworthAfterError_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode PCAinsworthReductionsCollide_Private(const PC_Ainsworth *, Vec, PetscBool *);
PETSC_INTERN PetscErrorCode PCAinsworthAgreeOnFailure_Private(PC, PCFailedReason);
PETSC_INTERN PetscErrorCode PCAinsworthGetData_Private(PC, PC_Ainsworth **);
PETSC_INTERN PetscErrorCode PCAinsworthGetDataOrError_Private(PC, PC_Ainsworth **);
PETSC_INTERN PetscErrorCode PCAinsworthSetStale_Private(PC, PC_Ainsworth *);
PETSC_INTERN void           PCAinsworthChoicesApplyVariant_Private(AinsworthChoices *, PCAinsworthVariant);
PETSC_INTERN PetscErrorCode PCAinsworthChoose_Private(PC, PC_Ainsworth *, const AinsworthChoices *);
PETSC_INTERN PetscErrorCode PCAinsworthCite_Private(void);
PETSC_INTERN PetscErrorCode PCAinsworthUpdateInputs_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode PCAinsworthNameRows_Private(Mat, const std::string &, AinsworthSaddleInputs *);
PETSC_INTERN PetscErrorCode PCAinsworthComposeFields_Private(PC, PetscBool);
PETSC_INTERN PetscErrorCode PCAinsworthFieldsFromOptions_Private(PC, PC_Ainsworth *, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode PCSetFromOptions_Ainsworth(PC, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode PCView_Ainsworth(PC, PetscViewer);
PETSC_INTERN PetscErrorCode PCAinsworthReportBegin_Private(PC_Ainsworth *, AinsworthSaddleVec, PetscLogDouble);
PETSC_INTERN PetscErrorCode PCAinsworthReportView_Private(const PC_Ainsworth *, PetscViewer);
PETSC_INTERN PetscErrorCode PCAinsworthForgetWhole_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode PCAinsworthJudge_Private(PC, PC_Ainsworth *, PetscBool, KSPConvergedReason,
                                                     const AinsworthSolveFn &, PetscBool, AinsworthSaddleVec,
                                                     AinsworthSaddleVec, AinsworthSaddleVec, AinsworthVerdict *, char[],
                                                     size_t);
PETSC_INTERN PetscErrorCode PCAinsworthFail_Private(PC, PC_Ainsworth *, PCFailedReason, PetscErrorCode, const char[]);

/* pcsolve.cpp */
PETSC_INTERN PetscErrorCode PCAinsworthReduce_Private(PC_Ainsworth *, PetscBool, AinsworthSaddleVec);
PETSC_INTERN PetscErrorCode PCAinsworthIsClaim_Private(const PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode PCAinsworthSolveFields_Private(PC, PC_Ainsworth *, PetscBool, PetscBool, AinsworthSaddleVec,
                                                           AinsworthSaddleVec, PetscBool *, KSPConvergedReason *);
PETSC_INTERN PetscErrorCode PCAinsworthSolveLoosely_Private(PC, PC_Ainsworth *, PetscBool, PetscBool, PetscReal,
                                                            AinsworthSaddleVec, AinsworthSaddleVec);
/* pcladder.cpp */
PETSC_INTERN PetscErrorCode PCAinsworthReplan_Private(PC, PC_Ainsworth *, AinsworthEnd, const char[], PetscBool *);

#endif
