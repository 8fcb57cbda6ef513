/* PCAINSWORTH drives the solve: saddle -> projector -> operator and pmat -> inner KSP -> x and lambda */
#ifndef AINSWORTH_PCAINSWORTH_H
#define AINSWORTH_PCAINSWORTH_H

#include <petscainsworth.h>
#include "../saddle/saddle.h"
#include "../multigrid/source.h"
#include "../pmat/pmat.h"
#include "../inner/ladder.h"
#include "../inner/prices.h"
#include "../inner/whole.h"
#include "../projector/symbolic.h"
#include "../refine/refine.h"
#include "../report/diagnosis.h"
#include "../report/report.h"

struct Mat_Ainsworth;

/* Presets of weight, penalty, penalty factor, row scaling, and inner Krylov method */
typedef enum {
  PC_AINSWORTH_WEIGHTED, /* W = diag(A)^{-1}, one penalty per row, KSPPROJECTEDCG */
  PC_AINSWORTH_PAPER     /* W = I, one penalty beta, KSPCG: Robert, Jolivet, Jamond, Badri, sections 3 and 4 */
} PCAinsworthVariant;
PETSC_INTERN const char *const PCAinsworthVariants[];

/* What to do with rows of C that are linear combinations of other rows */
typedef enum {
  AINSWORTH_REDUNDANT_DROP, /* left out; a right-hand side that contradicts them is a failure, PC_INCONSISTENT_RHS */
  AINSWORTH_REDUNDANT_ERROR /* the set-up stops with an error that names them */
} AinsworthRedundantType;

/* When the inner preconditioner is rebuilt for other values of A or C */
typedef enum {
  AINSWORTH_REBUILD_AUTO, /* when it costs more iterations than a set-up */
  AINSWORTH_REBUILD_ALWAYS,
  AINSWORTH_REBUILD_NEVER
} AinsworthRebuildType;
PETSC_INTERN const char *const PCAinsworthRebuildTypes[];

/* Solves are counted separately for each number of decades of reduction, up to this many */
#define PC_AINSWORTH_DECADES 17

/* Verdict of the program's own system on a solution */
typedef enum {
  AINSWORTH_VERDICT_MET,
  AINSWORTH_VERDICT_UNMET,        /* a residual is larger than requested */
  AINSWORTH_VERDICT_SINGULAR,     /* A is singular on Ker C, and f is not balanced there */
  AINSWORTH_VERDICT_CONTRADICTION /* no x satisfies this right-hand side of the constraints */
} AinsworthVerdict;

/* What the outer method makes of an application */
typedef enum {
  AINSWORTH_OUTER_ANSWER,   /* KSPPREONLY, or no KSP: it is the answer, and judged as such */
  AINSWORTH_OUTER_FLEXIBLE, /* an iteration, which bears with another operator in each application */
  AINSWORTH_OUTER_RIGID     /* an iteration that assumes a linear preconditioner */
} AinsworthOuter;

/* Energies of a motion, relative to that of diag(A), for the words of a failure: none, and negative beyond rounding */
static const PetscReal PCAinsworthNoEnergy = PETSC_MACHINE_EPSILON / AinsworthUndetermined, PCAinsworthNegative = -1e-12;

/* Stages of set-up, each with its own part of the diagnosis */
typedef enum {
  PC_AINSWORTH_STAGE_PASSED,      /* the program's matrix is known */
  PC_AINSWORTH_STAGE_BLOCKS,      /* so is its normal form */
  PC_AINSWORTH_STAGE_CONSTRAINTS, /* the projector is set up, or there are no constraints */
  PC_AINSWORTH_STAGE_REDUCED      /* everything is set up */
} PCAinsworthStage;

/* What options and calls choose, compared as a whole: setting the same choices again rebuilds nothing */
struct PCAinsworthChoices {
  PCAinsworthVariant     variant;
  MatAinsworthWeightType weightType;
  PetscInt               rowsPerRank;
  AinsworthRedundantType redundant;
  AinsworthRung          ladder = AINSWORTH_RUNG_WHOLE; /* the highest rung that may be climbed */
  AinsworthPmatOptions   pmat;                          /* factor PETSC_DEFAULT depends on the types of penalty and approximation; symmetric is set by set-up */
};

/* A field that the program named: an index set, or components of each node, in rows and columns */
struct PCAinsworthNamedField {
  std::string           name;
  AinsworthIS           is;
  std::vector<PetscInt> rows, cols;
};

/* A factorization of M_* in place of multigrid (escape.cpp) */
struct PCAinsworthEscape {
  PetscBool              taken;      /* M_* is factored by our choice */
  PetscBool              refused;    /* the factorization failed for this matrix */
  PetscBool              now;        /* the current solve ended in favor of it */
  PetscInt               n;          /* size of A when it was chosen */
  PetscReal              entries;    /* of A then */
  AinsworthPriceFacts    facts;      /* for this set-up, as far as they were asked for: without unknowns none, without fill not those of a factorization */
  AinsworthSeries        series;     /* the current solve */
  char                   why[256];   /* reason for the choice */
  PetscBool              watching;   /* the convergence test of the KSP is replaced; this is its own: */
  void                  *test;
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  AinsworthTestDestroyFn *destroy;
  PetscBool               error; /* its own KSPSetErrorIfNotConverged() */
};

struct PC_Ainsworth {
  PCAinsworthChoices choices;
  Vec                userWeight; /* set by the user, length n */

  /* what the program passed, and its fields (pcfields.cpp) */
  AinsworthSaddleInputs              inputs;
  std::vector<PCAinsworthNamedField> named;
  PetscInt                           components; /* per node of the whole matrix; 0 for its block size */
  PetscObjectId                      resolved;   /* the matrix to which inputs.fields belong */
  PetscObjectId                      resolvedDM; /* the DM from which they were taken */

  /* made by set-up */
  AinsworthSaddle saddle;
  PetscInt        constraints;       /* number of kept rows of C */
  Mat             reduced;           /* the reduced operator; NULL without constraints */
  Mat             M;                 /* the preconditioning matrix */
  IS              order;             /* of the unknowns, on rank 0: the next factorization of M uses it; NULL until it is found */
  const char     *autoReason;        /* why auto chose its type */
  PetscInt        longRows;          /* number of rows of C left out of the preconditioning matrix */
  PetscBool       symmetric;         /* A = A' */
  PetscBool       adjoint;           /* B is C, and D = D' */
  Vec             inverseDiagonal;   /* diag(A)^{-1}, length n; weights residuals so that their size does not depend on that of A */
  PetscBool       indefinite;        /* GMRES replaced conjugate gradients since the last set-up */
  PetscBool       stale;             /* a choice changed since the last set-up */
  char            failure[512];      /* why the last set-up or solve failed; empty if it did not */
  PetscInt        applications = -1; /* in the current outer solve; -1 outside of a solve */
  PetscBool       hidden;            /* diag(A)^{-1} makes independent rows of C look dependent: the weight is the identity */
  PetscBool       refused;           /* the last set-up failed with a reason; not repeated before something changes */
  PetscBool       unfinished;        /* the last set-up, or a solve since, ended with an error */
  PetscBool       applied;           /* since the last solve began: a failure since then is that of a solve */
  AinsworthOuter  outer;             /* the method of the current outer solve */
  PetscBool       usable;            /* the result of the last solve is usable by an outer method */
  PetscBool       unchanged;         /* neither A nor C nor a choice had changed at the last set-up */

  /* the reduced solve */
  KSP                 ksp;
  PetscBool           configured;       /* defaults are set and options read */
  PCAinsworthPmatType autoType;         /* type that auto chose */
  AinsworthPmatFormat format;           /* of M; depends on the type of its preconditioner */
  PetscBool           ownChoice;        /* we chose the type of its preconditioner, not options or calls */
  PetscBool           ownNorm, ownSide; /* we chose its norm, its side */
  PetscBool           plainCG;          /* KSPCG replaces KSPPROJECTEDCG because there are no constraints */
  PetscBool           kept;             /* its preconditioner is from an earlier set-up: PCSetReusePreconditioner() */
  PetscBool           keptForProgram;   /* because the program set PCSetReusePreconditioner() on this PC */
  PetscBool           ownReuse;         /* the program's own PCSetReusePreconditioner() of the inner PC */
  PetscBool           ownMethod;        /* GMRES replaces KSPPROJECTEDCG because the system is not Hermitian, or indefinite */
  PetscInt            coefficients;     /* iterations of which conjugate gradients can keep them */
  PCAinsworthEscape   escape;
  Vec                 rhs;       /* f~ */
  Vec                 Ax;        /* op(A) x of the solution, with the program's A */
  PetscBool           knownAx;   /* it was computed with the multipliers */
  Vec                 g, lambda; /* on the kept rows, if some are not kept */
  Vec                 terms;     /* largest terms of each row of C x in all solves, if rows are dependent: later residuals contain their rounding */
  Vec                 f;         /* f minus the terms of known x and lambda; NULL if nothing is known */

  /* pcladder.cpp */
  bool            wholeTried = false; /* the whole system was factored, or could not be, for this matrix */
  AinsworthWhole *whole;              /* the factor of the whole system; NULL as long as the reduced one is solved */
  char            climbed[512];       /* why */

  /* pcrebuild.cpp */
  AinsworthRebuildType rebuild;
  PetscInt             took[PC_AINSWORTH_DECADES]; /* iterations of the first solve with the preconditioner, by decades; -1 if none yet */
  PetscInt             last;                       /* iterations of the last solve */
  PetscInt             solves;                     /* number of solves since the matrix changed */
  PetscReal            extra, more;                /* iterations in excess of the first solve: of the last of these solves, and of all */
  AinsworthSource      source;                     /* the C for which a preconditioner that is kept as a whole was made */

  /* error against run time */
  AinsworthReportSettings reporting;
  AinsworthReport        *report;       /* NULL until a solve is reported on */
  PetscLogDouble          setupSeconds; /* of set-ups not followed by a solve yet */

  std::unique_ptr<AinsworthDiagnosis> diagnosis; /* NULL unless requested */
};

PETSC_INTERN PetscErrorCode      PCCreate_Ainsworth(PC);
PETSC_INTERN PetscErrorCode      PCSetUp_Ainsworth(PC);
PETSC_INTERN PetscErrorCode      PCSetUpOnBlocks_Ainsworth(PC);
PETSC_INTERN PetscErrorCode      PCPreSolve_Ainsworth(PC, KSP, Vec, Vec);
PETSC_INTERN PetscErrorCode      PCPostSolve_Ainsworth(PC, KSP, Vec, Vec);
PETSC_INTERN PetscErrorCode      PCApply_Ainsworth(PC, Vec, Vec);
PETSC_INTERN PetscErrorCode      PCApplyTranspose_Ainsworth(PC, Vec, Vec);
PETSC_INTERN PetscErrorCode      PCMatApply_Ainsworth(PC, Mat, Mat);
PETSC_INTERN PetscErrorCode      PCAinsworthReductionsCollide_Private(const PC_Ainsworth *, Vec, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthAgreeOnFailure_Private(PC, PCFailedReason);
PETSC_INTERN PetscErrorCode      PCAinsworthGetData_Private(PC, PC_Ainsworth **);
PETSC_INTERN PetscErrorCode      PCAinsworthGetDataOrError_Private(PC, PC_Ainsworth **);
PETSC_INTERN PetscErrorCode      PCAinsworthSetStale_Private(PC, PC_Ainsworth *);
PETSC_INTERN void                PCAinsworthChoicesApplyVariant_Private(PCAinsworthChoices *, PCAinsworthVariant);
PETSC_INTERN PetscErrorCode      PCAinsworthChoose_Private(PC, PC_Ainsworth *, const PCAinsworthChoices *);
PETSC_INTERN PetscErrorCode      PCAinsworthConfigureKSP_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthIteratesInKernel_Private(PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetKSPOperators_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthGetPmatFormat_Private(PC_Ainsworth *, AinsworthPmatFormat *);
PETSC_INTERN PetscErrorCode      PCAinsworthUseProduct_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthResetKSP_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthKeepCoefficients_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetMethod_Private(PC_Ainsworth *, KSPType);
PETSC_INTERN PetscErrorCode      PCAinsworthGetReason_Private(const PC_Ainsworth *, KSPConvergedReason *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetTranspose_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthAfterError_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthReuseInner_Private(PC_Ainsworth *, PetscBool);
PETSC_INTERN PetscErrorCode      PCAinsworthLooksDefinite_Private(const PC_Ainsworth *, Mat, PetscBool *);
PETSC_INTERN PCType              PCAinsworthFactorType_Private(const PC_Ainsworth *, MatSolverType *);
PETSC_INTERN PetscErrorCode      PCAinsworthChoosePackage_Private(const PC_Ainsworth *, PC);
PETSC_INTERN PetscErrorCode      PCAinsworthChooseType_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthIsOwnMultigrid_Private(const PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthOrderPmat_Private(PC_Ainsworth *, const std::vector<Mat> &, AinsworthCost *);
PETSC_INTERN PetscErrorCode      PCAinsworthConvertPmat_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetUpPreconditioner_Private(PC_Ainsworth *, PC, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeAtOnce_Private(PC, PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscReal           PCAinsworthEscapePrice_Private(const PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeFacts_Private(PC, PC_Ainsworth *, PetscInt, PetscReal);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeCost_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeReview_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeCheck_Private(PC, PC_Ainsworth *, PetscBool, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeTake_Private(PC, PC_Ainsworth *, const char[], char[], size_t);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeBegin_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeEnd_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscape_Private(PC, PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetUpInner_Private(PC, PC_Ainsworth *, Mat_Ainsworth *, PetscBool, char[], size_t);
PETSC_INTERN PetscBool           PCAinsworthMustKeepInner_Private(PC, const PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthDecideToKeepInner_Private(PC, const PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthIsOld_Private(const PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthLimit_Private(PC, const PC_Ainsworth *, PetscInt *);
PETSC_INTERN PetscErrorCode      PCAinsworthCount_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthForgetCounts_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthRebuild_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthViewRebuild_Private(const PC_Ainsworth *, PetscViewer);
PETSC_INTERN PetscErrorCode      PCAinsworthIsConjugateGradients_Private(KSPType, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthChooseMethod_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthForgetNorm_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthChooseNorm_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthTakeGMRES_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthFallBack_Private(PC, PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthUpdateInputs_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthComposeFields_Private(PC, PetscBool);
PETSC_INTERN PetscErrorCode      PCAinsworthFieldsFromOptions_Private(PC, PC_Ainsworth *, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode      PCSetFromOptions_Ainsworth(PC, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode      PCAinsworthDescribeLeftOut_Private(PC_Ainsworth *, std::string &);
PETSC_INTERN PetscErrorCode      PCAinsworthDescribePmat_Private(const PC_Ainsworth *, std::string &);
PETSC_INTERN PetscErrorCode      PCView_Ainsworth(PC, PetscViewer);
PETSC_INTERN PetscReal           PCAinsworthPenaltyFactor_Private(const PC_Ainsworth *);
PETSC_INTERN PCAinsworthPmatType PCAinsworthPmatTypeInUse_Private(const PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthReportBegin_Private(PC, PC_Ainsworth *, AinsworthSaddleVec, PetscLogDouble);
PETSC_INTERN PetscErrorCode      PCAinsworthReportView_Private(const PC_Ainsworth *, PetscViewer);
/* Returns the bytes of a factor, infinite if its entries cannot be numbered */
static inline PetscReal PCAinsworthFactorBytes_Private(const AinsworthCost *cost)
{
  return cost->entries <= (PetscReal)PETSC_MAX_INT ? cost->entries * (PetscReal)sizeof(PetscScalar) : PETSC_INFINITY;
}
PETSC_INTERN PetscErrorCode PCAinsworthLeastMemory_Private(MPI_Comm, PetscReal *);
PETSC_INTERN PetscErrorCode PCAinsworthMethodIsOpen_Private(PC, const PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode PCAinsworthNextRung_Private(PC, PC_Ainsworth *, PetscBool, AinsworthEnd, AinsworthLadderStep *);
PETSC_INTERN PetscErrorCode PCAinsworthClimb_Private(PC, PC_Ainsworth *, AinsworthEnd, const char[], PetscBool *);
PETSC_INTERN PetscErrorCode PCAinsworthForgetWhole_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode PCAinsworthJudge_Private(PC, PC_Ainsworth *, PetscBool, KSPConvergedReason, const AinsworthSolver &, AinsworthSaddleVec,
                                                     AinsworthSaddleVec, AinsworthSaddleVec, AinsworthVerdict *, char[], size_t);
PETSC_INTERN PetscErrorCode PCAinsworthExplain_Private(PC, PC_Ainsworth *, Vec, KSPConvergedReason, char[], size_t);
PETSC_INTERN PetscErrorCode PCAinsworthRayleighQuotient_Private(const PC_Ainsworth *, Vec, PetscReal *);
PETSC_INTERN PetscErrorCode PCAinsworthTry_Private(PC, PC_Ainsworth *, KSPConvergedReason *, PetscInt *, PetscReal *, char[], size_t);
PETSC_INTERN PetscErrorCode PCAinsworthDiagnosePassed_Private(PC, AinsworthDiagnosis *);
PETSC_INTERN PetscErrorCode PCAinsworthDiagnoseBlocks_Private(const PC_Ainsworth *, AinsworthDiagnosis *);
PETSC_INTERN PetscErrorCode PCAinsworthDiagnose_Private(PC, PC_Ainsworth *, PCAinsworthStage);
PETSC_INTERN PetscErrorCode PCAinsworthDiagnoseFailure_Private(PC, PC_Ainsworth *, PetscErrorCode, const char[]);
PETSC_INTERN PetscErrorCode PCAinsworthDiagnoseFromOptions_Private(PC, PC_Ainsworth *, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode PCAinsworthFail_Private(PC, PC_Ainsworth *, PCFailedReason, PetscErrorCode, const char[]);

#endif
