/* PCAINSWORTH conducts: saddle -> projector -> operator and pmat -> inner KSP -> x and lambda */
#ifndef AINSWORTH_PCAINSWORTH_H
#define AINSWORTH_PCAINSWORTH_H

#include <petscainsworth.h>
#include "../saddle/saddle.h"
#include "../pmat/pmat.h"
#include "../report/report.h"

struct PC_Ainsworth {
  /* choices */
  PCAinsworthVariant     variant;
  MatAinsworthWeightType weightType;
  Vec                    weight; /* the user's, length n */
  PetscReal              factor; /* PETSC_DEFAULT: by the type of the penalty */
  PetscInt               rowsPerRank;
  AinsworthPmatOptions   pmat;

  PCAinsworthRedundantType redundant;
  PetscBool                checkTranspose; /* compare blocks (0,1) and (1,0) entry by entry */

  /* what set-up made of the program's matrix */
  AinsworthSaddle saddle;
  PetscInt        constraints; /* rows of C that are kept */
  Mat             S;           /* the reduced operator; NULL without constraints */
  Mat             M;           /* the preconditioning matrix */
  const char     *autoReason;  /* why auto came to what it is */
  PetscBool       symmetric;   /* A = A' */
  Vec             weights;     /* diag(A)^{-1}, length n, in which the size of a residual does not depend on that of A */
  PetscBool       doubtful;    /* rows of C are nearly dependent: C x = g is checked */
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
  Vec                 residual;   /* C x - g, on the kept rows */
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
PETSC_INTERN PetscErrorCode      PCAinsworthGetDataOrError(PC, PC_Ainsworth **);
PETSC_INTERN PetscErrorCode      PCAinsworthSetStale(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthApplyVariant(PC_Ainsworth *, PCAinsworthVariant);
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
PETSC_INTERN PetscErrorCode      PCAinsworthReportSetFromOptions(PC, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode      PCAinsworthReportReset(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthReportBegin(PC, PC_Ainsworth *, Vec, Vec);
PETSC_INTERN PetscErrorCode      PCAinsworthReportEnd(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthReportView(const PC_Ainsworth *, PetscViewer);
PETSC_INTERN PetscErrorCode      PCAinsworthVerify(PC, PC_Ainsworth *, PetscBool, Vec, Vec, Vec, Vec, PetscBool *);

#endif
