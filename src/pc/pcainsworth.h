/* PCAINSWORTH conducts: saddle -> projector -> operator and pmat -> inner KSP -> x and lambda */
#ifndef AINSWORTH_PCAINSWORTH_H
#define AINSWORTH_PCAINSWORTH_H

#include <petscainsworth.h>
#include "../saddle/saddle.h"
#include "../pmat/pmat.h"
#include "../report/report.h"

/* What to do with rows of C that are linear combinations of other rows */
typedef enum {
  AINSWORTH_REDUNDANT_DROP, /* they are left out; a right-hand side that contradicts them is a failure, PC_INCONSISTENT_RHS */
  AINSWORTH_REDUNDANT_ERROR /* the set-up stops with an error that names them */
} AinsworthRedundantType;

/* What options and calls choose, compared as a whole: what says the same again rebuilds nothing */
struct PCAinsworthChoices {
  PCAinsworthVariant     variant;
  MatAinsworthWeightType weightType;
  PetscInt               rowsPerRank;
  AinsworthRedundantType redundant;
  AinsworthPmatOptions   pmat; /* factor PETSC_DEFAULT: by the types of penalty and approximation; symmetric is that of the set-up */
};

struct PC_Ainsworth {
  PCAinsworthChoices choices;
  Vec                weight; /* the user's, length n */

  /* what set-up made of the program's matrix */
  AinsworthSaddle saddle;
  PetscInt        constraints; /* rows of C that are kept */
  Mat             S;           /* the reduced operator; NULL without constraints */
  Mat             M;           /* the preconditioning matrix */
  const char     *autoReason;  /* why auto came to what it is */
  PetscBool       symmetric;   /* A = A' */
  Vec             weights;     /* diag(A)^{-1}, length n, in which the size of a residual does not depend on that of A */
  PetscBool       stale;       /* a choice changed since the last set-up */
  PetscBool       unchanged;   /* at the last set-up neither A nor C nor a choice had changed */

  /* the reduced solve */
  KSP                 ksp;
  PetscBool           configured; /* its defaults and options have been read */
  PCAinsworthPmatType autoType;   /* what auto came to */
  AinsworthPmatFormat format;     /* of M, by the type of its preconditioner */
  PetscBool           ownChoice;  /* neither options nor calls chose the type of its preconditioner */
  PetscBool           projected;  /* its type gave way to KSPCG because there are no constraints */
  Vec                 rhs;        /* f~ */
  Vec                 g, lambda;  /* on the kept rows, where some are not kept */
  Vec                 f;          /* f + C_p' D^{-1} g_p, where rows p are eliminated */

  /* error against run time */
  AinsworthReportSettings reporting;
  AinsworthReport        *report;       /* NULL until a solve is reported on */
  PetscLogDouble          setupSeconds; /* of the set-up that no solve has followed yet */
};

PETSC_INTERN PetscErrorCode      PCCreate_Ainsworth(PC);
PETSC_INTERN PetscErrorCode      PCSetUp_Ainsworth(PC);
PETSC_INTERN PetscErrorCode      PCAinsworthAgreeOnFailure(PC, PCFailedReason);
PETSC_INTERN PetscErrorCode      PCAinsworthGetData(PC, PC_Ainsworth **);
PETSC_INTERN PetscErrorCode      PCAinsworthSetStale(PC, PC_Ainsworth *);
PETSC_INTERN void                PCAinsworthChoicesApplyVariant(PCAinsworthChoices *, PCAinsworthVariant);
PETSC_INTERN PetscErrorCode      PCAinsworthChoose(PC, PC_Ainsworth *, const PCAinsworthChoices *);
PETSC_INTERN PetscErrorCode      PCAinsworthConfigureKSP(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetKSPOperators(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthGetPmatFormat(PC_Ainsworth *, AinsworthPmatFormat *);
PETSC_INTERN PetscErrorCode      PCAinsworthUseProduct(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthFallBack(PC, PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCSetFromOptions_Ainsworth(PC, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode      PCAinsworthViewLeftOut(PC_Ainsworth *, PetscViewer);
PETSC_INTERN PetscErrorCode      PCView_Ainsworth(PC, PetscViewer);
PETSC_INTERN PetscReal           PCAinsworthPenaltyFactor(const PC_Ainsworth *);
PETSC_INTERN PCAinsworthPmatType PCAinsworthPmatTypeInUse(const PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthReportReset(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthReportBegin(PC, PC_Ainsworth *, Vec, Vec);
PETSC_INTERN PetscErrorCode      PCAinsworthReportEnd(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthReportView(const PC_Ainsworth *, PetscViewer);
PETSC_INTERN PetscErrorCode      PCAinsworthVerify(PC, PC_Ainsworth *, PetscBool, Vec, Vec, Vec, Vec, PetscBool *);

#endif
