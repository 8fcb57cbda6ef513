/* PCAINSWORTH conducts: saddle -> projector -> operator and pmat -> inner KSP -> x and lambda */
#ifndef AINSWORTH_PCAINSWORTH_H
#define AINSWORTH_PCAINSWORTH_H

#include <petscainsworth.h>
#include "../saddle/saddle.h"
#include "../multigrid/source.h"
#include "../pmat/pmat.h"
#include "../report/diagnosis.h"
#include "../report/report.h"

struct Mat_Ainsworth;

/* Weight, penalty, its factor, scaling of rows and inner Krylov method at once */
typedef enum {
  PC_AINSWORTH_WEIGHTED, /* W = diag(A)^{-1}, one penalty per row, KSPPROJECTEDCG */
  PC_AINSWORTH_PAPER     /* W = I, one penalty beta, KSPCG: Robert, Jolivet, Jamond, Badri, sections 3 and 4 */
} PCAinsworthVariant;
PETSC_INTERN const char *const PCAinsworthVariants[];

/* What to do with rows of C that are linear combinations of other rows */
typedef enum {
  AINSWORTH_REDUNDANT_DROP, /* they are left out; a right-hand side that contradicts them is a failure, PC_INCONSISTENT_RHS */
  AINSWORTH_REDUNDANT_ERROR /* the set-up stops with an error that names them */
} AinsworthRedundantType;

/* When the inner preconditioner is made anew for other values of A or C */
typedef enum {
  AINSWORTH_REBUILD_AUTO, /* when it costs more iterations than a set-up */
  AINSWORTH_REBUILD_ALWAYS,
  AINSWORTH_REBUILD_NEVER
} AinsworthRebuildType;
PETSC_INTERN const char *const PCAinsworthRebuildTypes[];

/* Solves are counted apart by the decades that they are asked for, up to so many */
#define PC_AINSWORTH_DECADES 17

/* What the program's own system says of a solution */
typedef enum {
  AINSWORTH_VERDICT_MET,
  AINSWORTH_VERDICT_UNMET,        /* a residual is larger than was asked for */
  AINSWORTH_VERDICT_SINGULAR,     /* A is singular on Ker C, and f not balanced there */
  AINSWORTH_VERDICT_CONTRADICTION /* no x can have this right-hand side of the constraints */
} AinsworthVerdict;

/* What is done for a right-hand side of the reduced system */
typedef enum {
  PC_AINSWORTH_SOLVE_WATCHED, /* solved; the report sees it */
  PC_AINSWORTH_SOLVE_AGAIN,
  PC_AINSWORTH_SOLVE_STEP /* one step of steepest descent */
} PCAinsworthExtent;

/* What set-up has come to: a diagnosis tells of each on its own */
typedef enum {
  PC_AINSWORTH_STAGE_PASSED,      /* a matrix */
  PC_AINSWORTH_STAGE_BLOCKS,      /* its normal form */
  PC_AINSWORTH_STAGE_CONSTRAINTS, /* the projector, or no constraints */
  PC_AINSWORTH_STAGE_REDUCED      /* all is set up */
} PCAinsworthStage;

/* What options and calls choose, compared as a whole: what says the same again rebuilds nothing */
struct PCAinsworthChoices {
  PCAinsworthVariant     variant;
  MatAinsworthWeightType weightType;
  PetscInt               rowsPerRank;
  AinsworthRedundantType redundant;
  AinsworthPmatOptions   pmat; /* factor PETSC_DEFAULT: by the types of penalty and approximation; symmetric is that of the set-up */
};

/* A field that the program named: an index set, or components of each node, in rows and columns */
struct PCAinsworthNamedField {
  std::string           name;
  AinsworthIS           is;
  std::vector<PetscInt> rows, cols;
};

/* A factorization of M_* in the place of multigrid (escape.cpp) */
struct PCAinsworthEscape {
  PetscBool              taken;      /* M_* is factored, by our choice */
  PetscBool              refused;    /* which failed for this matrix */
  PetscBool              now;        /* the solve that runs has ended for it */
  PetscBool              counted;    /* what follows is known */
  PetscInt               n;          /* of the A of that choice */
  PetscReal              entries;    /* of that A */
  PetscReal              operations; /* predicted */
  PetscReal              iterations; /* with multigrid that take as long */
  PetscReal              seconds;    /* the least that one has taken in the solve that runs, on this rank */
  PetscLogDouble         last;       /* the time of its last one */
  std::vector<PetscReal> norms;      /* of the residuals of the solve that runs */
  char                   why[256];   /* in words */
  PetscBool              watching;   /* the KSP has another convergence test than its own, which is: */
  void                  *test;
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  AinsworthTestDestroyFn *destroy;
  PetscBool               error; /* KSPSetErrorIfNotConverged() of its own */
};

struct PC_Ainsworth {
  PCAinsworthChoices choices;
  Vec                userWeight; /* the user's, length n */

  /* what the program passed, and told of its fields (pcfields.cpp) */
  AinsworthSaddleInputs              inputs;
  std::vector<PCAinsworthNamedField> named;
  PetscInt                           components; /* of each node of the whole matrix, 0: its block size */
  PetscObjectId                      resolved;   /* the matrix that inputs.fields are for */
  PetscObjectId                      resolvedDM; /* the DM that they are from */

  /* what set-up made of the program's matrix */
  AinsworthSaddle saddle;
  PetscInt        constraints;     /* rows of C that are kept */
  Mat             reduced;         /* the reduced operator; NULL without constraints */
  Mat             M;               /* the preconditioning matrix */
  const char     *autoReason;      /* why auto came to what it is */
  PetscInt        longRows;        /* of C, left out of the preconditioning matrix */
  PetscBool       symmetric;       /* A = A' */
  PetscBool       adjoint;         /* B is C, and D = D' */
  Vec             inverseDiagonal; /* diag(A)^{-1}, length n, in which the size of a residual does not depend on that of A */
  PetscBool       indefinite;      /* conjugate gradients gave way to GMRES since the last set-up */
  PetscBool       stale;           /* a choice changed since the last set-up */
  char            failure[512];    /* of the last set-up or solve, in words; empty where it was good */
  PetscInt        applications;    /* of the outer solve that runs, and one; 0 where none does */
  PetscBool       hidden;          /* diag(A)^{-1} makes rows of C look dependent that are not: the weight is the identity */
  PetscBool       refused;         /* the last set-up ended with a reason: it is not repeated before something changes */
  PetscBool       unfinished;      /* the last set-up, or a solve since, ended with an error */
  PetscBool       applied;         /* since the last solve began: what failed since did so in a solve */
  PetscBool       rigid;           /* that method takes its preconditioner for linear */
  PetscBool       usable;          /* by an outer method: what the last solve returned */
  PetscBool       unchanged;       /* at the last set-up neither A nor C nor a choice had changed */

  /* the reduced solve */
  KSP                 ksp;
  PetscBool           configured;       /* its defaults and options have been read */
  PCAinsworthPmatType autoType;         /* what auto came to */
  AinsworthPmatFormat format;           /* of M, by the type of its preconditioner */
  PetscBool           ownChoice;        /* neither options nor calls chose the type of its preconditioner */
  PetscBool           ownNorm, ownSide; /* nor its norm, nor its side */
  PetscBool           plainCG;          /* its type gave way to KSPCG because there are no constraints */
  PetscBool           kept;             /* its preconditioner is that of an earlier set-up: KSPSetReusePreconditioner() */
  PetscBool           ordered;          /* the program wanted that for its own */
  PetscBool           keptInside;       /* what the program has said about that to the inner KSP */
  PetscBool           ownMethod;        /* it gave way to GMRES because the system is not Hermitian */
  PCAinsworthEscape   escape;
  Vec                 rhs;       /* f~ */
  Vec                 Ax;        /* op(A) x of the solution, with the program's A */
  PetscBool           knownAx;   /* it came with the multipliers */
  Vec                 g, lambda; /* on the kept rows, where some are not kept */
  Vec                 terms;     /* of C x, the largest of each row in all solves, where rows depend on others: their rounding is left in later residuals */
  Vec                 f;         /* less what is known of x and lambda, where something is */

  /* pcrebuild.cpp */
  AinsworthRebuildType rebuild;
  PetscInt             took[PC_AINSWORTH_DECADES]; /* iterations of the first solve with the preconditioner for so many decades; -1: none yet */
  PetscInt             last;                       /* of the last one */
  PetscInt             solves;                     /* since the matrix is another one */
  PetscReal            extra, more;                /* how many iterations more than at first the last one of them took, and all */
  AinsworthSource      source;                     /* the C that a preconditioner that is kept as a whole was made for */

  /* error against run time */
  AinsworthReportSettings reporting;
  AinsworthReport        *report;       /* NULL until a solve is reported on */
  PetscLogDouble          setupSeconds; /* of the set-up that no solve has followed yet */

  std::unique_ptr<AinsworthDiagnosis> diagnosis; /* NULL: not asked for */
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
PETSC_INTERN PetscErrorCode      PCAinsworthSetStale_Private(PC, PC_Ainsworth *);
PETSC_INTERN void                PCAinsworthChoicesApplyVariant_Private(PCAinsworthChoices *, PCAinsworthVariant);
PETSC_INTERN PetscErrorCode      PCAinsworthChoose_Private(PC, PC_Ainsworth *, const PCAinsworthChoices *);
PETSC_INTERN PetscErrorCode      PCAinsworthConfigureKSP_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthIteratesInKernel_Private(PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetKSPOperators_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthGetPmatFormat_Private(PC_Ainsworth *, AinsworthPmatFormat *);
PETSC_INTERN PetscErrorCode      PCAinsworthUseProduct_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthResetKSP_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetMethod_Private(PC_Ainsworth *, KSPType);
PETSC_INTERN PetscErrorCode      PCAinsworthSetTranspose_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthAfterError_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthKeepInner_Private(PC_Ainsworth *, PetscBool);
PETSC_INTERN PetscErrorCode      PCAinsworthLooksDefinite_Private(const PC_Ainsworth *, Mat, PetscBool *);
PETSC_INTERN PCType              PCAinsworthFactorType_Private(const PC_Ainsworth *, MatSolverType *);
PETSC_INTERN PetscErrorCode      PCAinsworthChoosePackage_Private(const PC_Ainsworth *, PC);
PETSC_INTERN PetscErrorCode      PCAinsworthChooseType_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthIsOwnMultigrid_Private(const PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthConvertPmat_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetUpPreconditioner_Private(PC, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeAtOnce_Private(PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscReal           PCAinsworthEscapeLeast_Private(const PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeCost_Private(PC, const PC_Ainsworth *, PetscReal, PetscReal *, PetscReal *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeReview_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeCheck_Private(PC, PC_Ainsworth *, PetscBool, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeBegin_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscapeEnd_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthEscape_Private(PC, PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthKeepOrSetUpInner_Private(PC, PC_Ainsworth *, Mat_Ainsworth *, PetscBool, char[], size_t);
PETSC_INTERN PetscBool           PCAinsworthKeepsAlways_Private(PC, const PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthKeeps_Private(PC, const PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthIsOld_Private(const PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthLimit_Private(PC, const PC_Ainsworth *, PetscInt *);
PETSC_INTERN PetscErrorCode      PCAinsworthCount_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthForgetCounts_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthRebuild_Private(PC, PC_Ainsworth *, char[], size_t);
PETSC_INTERN PetscErrorCode      PCAinsworthViewRebuild_Private(const PC_Ainsworth *, PetscViewer);
PETSC_INTERN PetscErrorCode      PCAinsworthIsConjugateGradients_Private(KSPType, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthChooseMethod_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthForgetNorm_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthChooseNorm_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthTakeGMRES_Private(PC, PC_Ainsworth *, PetscBool *);
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
PETSC_INTERN PetscErrorCode      PCAinsworthDiagonalEnergy_Private(const PC_Ainsworth *, Vec, Vec, PetscReal *);
PETSC_INTERN PetscErrorCode      PCAinsworthSolveFields_Private(PC, PC_Ainsworth *, PetscBool, PCAinsworthExtent, AinsworthSaddleVec, AinsworthSaddleVec,
                                                                KSPConvergedReason *);
PETSC_INTERN bool                PCAinsworthRefinesRows_Private(const PC_Ainsworth *, PetscReal);
PETSC_INTERN PetscErrorCode      PCAinsworthRefineRows_Private(PC, PC_Ainsworth *, PetscBool, PetscBool, PetscBool, PetscReal, AinsworthSaddleVec,
                                                               AinsworthSaddleVec, AinsworthSaddleVec, PetscBool *, char[], size_t);
PETSC_INTERN PetscErrorCode      PCAinsworthResists_Private(const PC_Ainsworth *, Vec, PetscReal, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthIsFree_Private(const PC_Ainsworth *, Vec, Vec, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthAskedFor_Private(const PC_Ainsworth *, KSPConvergedReason, PetscReal *);
PETSC_INTERN PetscErrorCode      PCAinsworthVerify_Private(PC, PC_Ainsworth *, PetscBool, PetscReal, AinsworthSaddleVec, AinsworthSaddleVec, AinsworthSaddleVec,
                                                           AinsworthVerdict *, char[], size_t);
PETSC_INTERN PetscErrorCode      PCAinsworthExplain_Private(PC, PC_Ainsworth *, Vec, KSPConvergedReason, char[], size_t);
PETSC_INTERN PetscErrorCode      PCAinsworthRayleighQuotient_Private(const PC_Ainsworth *, Vec, PetscReal *);
PETSC_INTERN PetscErrorCode      PCAinsworthTry_Private(PC, PC_Ainsworth *, KSPConvergedReason *, PetscInt *, char[], size_t);
PETSC_INTERN PetscErrorCode      PCAinsworthDiagnosePassed_Private(PC, AinsworthDiagnosis *);
PETSC_INTERN PetscErrorCode      PCAinsworthDiagnoseBlocks_Private(const PC_Ainsworth *, AinsworthDiagnosis *);
PETSC_INTERN PetscErrorCode      PCAinsworthDiagnose_Private(PC, PC_Ainsworth *, PCAinsworthStage);
PETSC_INTERN PetscErrorCode      PCAinsworthDiagnoseFailure_Private(PC, PC_Ainsworth *, PetscErrorCode, const char[]);
PETSC_INTERN PetscErrorCode      PCAinsworthDiagnoseFromOptions_Private(PC, PC_Ainsworth *, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode      PCAinsworthFail_Private(PC, PC_Ainsworth *, PCFailedReason, PetscErrorCode, const char[]);

#endif
