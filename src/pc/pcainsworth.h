/* PCAINSWORTH drives the solve: saddle -> projector -> operator and pmat -> inner KSP -> x and lambda */
#ifndef AINSWORTH_PCAINSWORTH_H
#define AINSWORTH_PCAINSWORTH_H

#include <petscainsworth.h>
#include "../saddle/saddle.h"
#include "../multigrid/source.h"
#include "../pmat/pmat.h"
#include "../inner/age.h"
#include "../inner/plan.h"
#include "../inner/prices.h"
#include "../inner/whole.h"
#include "../ksp/deflation.h"
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

/* Energies of a motion, relative to that of diag(A), for the words of a failure: none, and negative beyond rounding */
static const PetscReal PCAinsworthNoEnergy = PETSC_MACHINE_EPSILON / AinsworthUndetermined, PCAinsworthNegative = -1e-12;

/* Stages of set-up, each with its own part of the diagnosis */
typedef enum {
  PC_AINSWORTH_STAGE_PASSED,      /* the program's matrix is known */
  PC_AINSWORTH_STAGE_BLOCKS,      /* so is its normal form */
  PC_AINSWORTH_STAGE_CONSTRAINTS, /* the projector is set up, or there are no constraints */
  PC_AINSWORTH_STAGE_REDUCED      /* everything is set up */
} PCAinsworthStage;

/* What became of the last set-up */
typedef enum {
  PC_AINSWORTH_NONE,     /* there was none, or an error ended it, or a solve since: what it made is not used */
  PC_AINSWORTH_REFUSED,  /* it failed with a reason, and is not repeated before something changes */
  PC_AINSWORTH_STALE,    /* a choice changed since, or the inner solver was lost */
  PC_AINSWORTH_READY,    /* everything is set up */
  PC_AINSWORTH_UNCHANGED /* likewise, and there was nothing to do: A, C and all choices are those of the set-up before */
} PCAinsworthState;

/* Which matrix the inner preconditioner was made for */
typedef enum {
  PC_AINSWORTH_AGE_FRESH,  /* the present one */
  PC_AINSWORTH_AGE_LEVELS, /* its coarser levels are of an earlier A */
  PC_AINSWORTH_AGE_WHOLE   /* an earlier one: PCSetReusePreconditioner() */
} PCAinsworthAgeType;

/* What options and calls choose, compared as a whole: setting the same choices again rebuilds nothing */
struct PCAinsworthChoices {
  PCAinsworthVariant     variant     = {};
  MatAinsworthWeightType weightType  = {};
  Vec                    weight      = NULL; /* of length n, for MAT_AINSWORTH_WEIGHT_USER; NULL until it is set */
  PetscInt               rowsPerRank = 0;
  AinsworthRedundantType redundant   = {};
  AinsworthRung          ladder = AINSWORTH_RUNG_WHOLE; /* the highest rung that may be climbed */
  AinsworthRebuildType   rebuild     = {};
  AinsworthPmatOptions   pmat        = {}; /* factor PETSC_DEFAULT depends on the types of penalty and approximation; symmetric is set by set-up */
};

/* A field that the program named: an index set, or components of each node, in rows and columns */
struct PCAinsworthNamedField {
  std::string           name;
  AinsworthIS           is;
  std::vector<PetscInt> rows, cols;
};

/* What the program passed, and its fields (pcfields.cpp) */
struct PCAinsworthGiven {
  AinsworthSaddleInputs              inputs;
  std::vector<PCAinsworthNamedField> named;
  PetscInt                           components = 0; /* per node of the whole matrix; 0 for its block size */
  PetscObjectId                      mat        = 0; /* the matrix to which inputs.fields belong */
  PetscObjectId                      dm         = 0; /* the DM from which they were taken */
};

/* The system in Ker C, and what leads there and back; empty until set-up */
struct PCAinsworthReduced {
  Mat mat             = NULL;  /* the reduced operator; NULL without constraints */
  Vec inverseDiagonal = NULL;  /* diag(A)^{-1}, length n; weights residuals so that their size does not depend on that of A */
  Vec rhs = NULL, Ax = NULL;   /* f~, and op(A) x with the program's A */
  Vec f = NULL;                /* f minus the terms of known x and lambda; NULL if nothing is known */
  Vec g = NULL, lambda = NULL; /* on the kept rows, if some are not kept */
};

/* The solver of the reduced system */
struct PCAinsworthInner {
  KSP                 ksp = NULL;
  AinsworthPlan       plan;         /* what it is, and which of its parts we chose */
  PetscBool           configured   = PETSC_FALSE; /* defaults are set and options read */
  Mat                 M            = NULL;        /* the preconditioning matrix */
  PCAinsworthPmatType autoType     = {};          /* type of M that auto chose */
  const char         *autoReason   = NULL;        /* why; NULL before it chose */
  AinsworthPmatFormat format       = {};          /* of M; depends on the type of its preconditioner */
  PetscInt            longRows     = 0;           /* number of rows of C left out of M */
  IS                  order        = NULL;        /* of the unknowns, on rank 0: the next factorization of M uses it; NULL until it is found */
  PetscInt            coefficients = 0;           /* iterations of which conjugate gradients can keep them */
  AinsworthLeftOut    left;                       /* what M leaves out, and conjugate gradients add */
  PetscBool           springs = PETSC_FALSE;      /* M includes the springs of D */
  Mat                 operation = NULL;           /* the operator in Ker C; NULL if the method does not iterate there */
  PC                  around    = NULL;           /* takes the place of the preconditioner during a solve; NULL before set-up */
};

/* The age of the inner preconditioner (pcage.cpp) */
struct PCAinsworthAge {
  PCAinsworthAgeType type       = {};
  PetscBool          forProgram = PETSC_FALSE; /* it is kept because the program set PCSetReusePreconditioner() on this PC */
  PetscBool          ownReuse   = PETSC_FALSE; /* the program's own PCSetReusePreconditioner() of the inner PC */
  AinsworthAge       counts;
  AinsworthSource    source; /* the C for which a preconditioner that is kept as a whole was made */
};

/* A factorization of M_* in place of multigrid, by our choice (pcladder.cpp, escape.cpp) */
struct PCAinsworthEscape {
  PetscInt            n        = 0;   /* size of A when it was chosen, or failed */
  PetscReal           entries  = 0.0; /* of A then */
  char                why[256] = {};  /* reason for the choice */
  AinsworthPriceFacts facts;    /* for this set-up, as far as they were asked for: without unknowns none, without fill not those of a factorization */
  AinsworthSeries     series;   /* the current solve */
};

/* A reduced solve that a factorization may end; it is watched if `converged` is set, the method's own convergence test (escape.cpp) */
struct PCAinsworthWatch {
  struct PC_Ainsworth *data                                                           = NULL;
  AinsworthEnd         end                                                            = {}; /* AINSWORTH_END_DEAR if it was ended */
  void                *test                                                           = NULL;
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *) = NULL;
  AinsworthTestDestroyFn *destroy                                                     = NULL;
};

/* The factor of the whole system (pcladder.cpp) */
struct PCAinsworthWhole {
  AinsworthWhole *factor = NULL; /* NULL as long as the reduced system is solved */
  char            why[512]; /* why it was made */
};

/* How the last set-up or solve ended */
struct PCAinsworthOutcome {
  char      why[512]; /* why it failed; empty if it did not */
  PetscBool usable = PETSC_FALSE; /* the result is usable by an outer method */
  Vec       terms  = NULL;        /* largest terms of each row of C x in all solves, if rows are dependent: later residuals contain their rounding */
};

/* The outer solve, from PCPreSolve() to PCPostSolve() (pcouter.cpp) */
struct PCAinsworthOuterSolve {
  AinsworthOuter method       = {};
  PetscInt       applications = 0; /* since the last solve began: a failure since then is that of a solve */
};

/* Error against run time (pcreport.cpp) */
struct PCAinsworthReporting {
  AinsworthReportSettings settings;
  AinsworthReport        *report       = NULL; /* NULL until a solve is reported on */
  PetscLogDouble          setupSeconds = 0.0;  /* of set-ups not followed by a solve yet */
};

/* From what the program gave to the last answer, in the order of the data: each part is made from those before it */
struct PC_Ainsworth {
  PCAinsworthChoices    choices;
  PCAinsworthGiven      given;
  AinsworthSaddle       saddle; /* no A before the first set-up */
  PCAinsworthReduced    reduced = {};
  AinsworthHistory      history; /* which solvers this matrix has already seen */
  PCAinsworthInner      inner;
  PCAinsworthAge        age;
  PCAinsworthEscape     escape;
  PCAinsworthWhole      whole     = {};
  PCAinsworthState      state     = {};
  PCAinsworthOuterSolve outer     = {};
  PCAinsworthOutcome    outcome   = {};
  PCAinsworthReporting  reporting = {};

  std::unique_ptr<AinsworthDiagnosis> diagnosis; /* NULL unless requested */
};

/* Returns the prefix of the options of the inner solver */
static inline const char *PCAinsworthPrefix_Private(const PC_Ainsworth *data)
{
  const char *prefix;

  (void)KSPGetOptionsPrefix(data->inner.ksp, &prefix);
  return prefix;
}

/* Returns the type of an object; NULL if it has none yet */
static inline const char *PCAinsworthTypeName_Private(PetscObject object)
{
  const char *type;

  (void)PetscObjectGetType(object, &type);
  return type;
}

PETSC_INTERN PC_Ainsworth       *PCAinsworthData_Private(PC);
PETSC_INTERN PetscBool           PCAinsworthReadsOptions_Private(PC);
PETSC_INTERN PetscErrorCode      PCCreate_Ainsworth(PC);
PETSC_INTERN PetscErrorCode      PCSetUp_Ainsworth(PC);
PETSC_INTERN PetscErrorCode      PCSetUpOnBlocks_Ainsworth(PC);
PETSC_INTERN PetscErrorCode      PCPreSolve_Ainsworth(PC, KSP, Vec, Vec);
PETSC_INTERN PetscErrorCode      PCPostSolve_Ainsworth(PC, KSP, Vec, Vec);
PETSC_INTERN PetscErrorCode      PCApply_Ainsworth(PC, Vec, Vec);
PETSC_INTERN PetscErrorCode      PCApplyTranspose_Ainsworth(PC, Vec, Vec);
PETSC_INTERN PetscErrorCode      PCMatApply_Ainsworth(PC, Mat, Mat);
PETSC_INTERN PetscErrorCode      PCAinsworthReductionsCollide_Private(const PC_Ainsworth *, Vec, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthForgetFailure_Private(PC);
PETSC_INTERN PetscErrorCode      PCAinsworthAgreeOnFailure_Private(PC, PCFailedReason);
PETSC_INTERN PetscErrorCode      PCAinsworthGetData_Private(PC, PC_Ainsworth **);
PETSC_INTERN PetscErrorCode      PCAinsworthGetDataOrError_Private(PC, PC_Ainsworth **);
PETSC_INTERN PetscErrorCode      PCAinsworthSetStale_Private(PC, PC_Ainsworth *);
PETSC_INTERN void                PCAinsworthChoicesApplyVariant_Private(PCAinsworthChoices *, PCAinsworthVariant);
PETSC_INTERN PetscErrorCode      PCAinsworthChoose_Private(PC, PC_Ainsworth *, const PCAinsworthChoices *);
PETSC_INTERN PetscErrorCode      PCAinsworthConfigureKSP_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthIteratesInKernel_Private(PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetKSPOperators_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthForgetOperators_Private(PCAinsworthInner *);
PETSC_INTERN PetscErrorCode      PCAinsworthGetInnerPC_Private(const PC_Ainsworth *, PC *);
PETSC_INTERN PetscErrorCode      PCAinsworthEnter_Private(PC_Ainsworth *, KSP, Vec);
PETSC_INTERN PetscErrorCode      PCAinsworthLeave_Private(const PC_Ainsworth *, KSP);
PETSC_INTERN PetscErrorCode      PCAinsworthGetPmatFormat_Private(PC_Ainsworth *, AinsworthPmatFormat *);
PETSC_INTERN PetscErrorCode      PCAinsworthUseProduct_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthResetKSP_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthGetReason_Private(const PC_Ainsworth *, KSPConvergedReason *);
PETSC_INTERN PetscErrorCode      PCAinsworthAfterError_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthReuseInner_Private(PC_Ainsworth *, PetscBool);
PETSC_INTERN PetscErrorCode      PCAinsworthLooksDefinite_Private(const PC_Ainsworth *, Mat, PetscBool *);
PETSC_INTERN PCType              PCAinsworthFactorType_Private(const PC_Ainsworth *, MatSolverType *);
PETSC_INTERN PetscErrorCode      PCAinsworthChoosePackage_Private(const PC_Ainsworth *, PC);
PETSC_INTERN PetscErrorCode      PCAinsworthOrderPmat_Private(PC_Ainsworth *, const std::vector<Mat> &, AinsworthCost *);
PETSC_INTERN PetscErrorCode      PCAinsworthConvertPmat_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthSetUpPreconditioner_Private(PC_Ainsworth *, PC, PetscBool *);
PETSC_INTERN PetscReal           PCAinsworthEscapePrice_Private(const PC_Ainsworth *);
PETSC_INTERN PetscBool           PCAinsworthMustKeepInner_Private(PC, const PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthDecideToKeepInner_Private(PC, const PC_Ainsworth *, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthLimit_Private(PC, const PC_Ainsworth *, PetscInt *);
PETSC_INTERN PetscErrorCode      PCAinsworthCount_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthViewRebuild_Private(const PC_Ainsworth *, PetscViewer);
PETSC_INTERN PetscErrorCode      PCAinsworthIsConjugateGradients_Private(KSPType, PetscBool *);
PETSC_INTERN PetscErrorCode      PCAinsworthUpdateInputs_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthComposeFields_Private(PC, PetscBool);
PETSC_INTERN PetscErrorCode      PCAinsworthFieldsFromOptions_Private(PC, PC_Ainsworth *, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode      PCSetFromOptions_Ainsworth(PC, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode      PCAinsworthDescribeLeftOut_Private(PC_Ainsworth *, std::string &);
PETSC_INTERN PetscErrorCode      PCAinsworthDescribePmat_Private(const PC_Ainsworth *, std::string &);
PETSC_INTERN PetscErrorCode      PCView_Ainsworth(PC, PetscViewer);
PETSC_INTERN PetscReal           PCAinsworthPenaltyFactor_Private(const PC_Ainsworth *);
PETSC_INTERN PCAinsworthPmatType PCAinsworthPmatTypeInUse_Private(const PC_Ainsworth *);
PETSC_INTERN PetscErrorCode      PCAinsworthReportBegin_Private(PC_Ainsworth *, AinsworthSaddleVec, PetscLogDouble);
PETSC_INTERN PetscErrorCode      PCAinsworthReportView_Private(const PC_Ainsworth *, PetscViewer);
/* Returns the bytes of a factor, infinite if its entries cannot be numbered */
static inline PetscReal PCAinsworthFactorBytes_Private(const AinsworthCost *cost)
{
  return cost->entries <= (PetscReal)PETSC_MAX_INT ? cost->entries * (PetscReal)sizeof(PetscScalar) : PETSC_INFINITY;
}
PETSC_INTERN PetscErrorCode PCAinsworthLeastMemory_Private(MPI_Comm, PetscReal *);
PETSC_INTERN PetscErrorCode PCAinsworthForgetWhole_Private(PC_Ainsworth *);
PETSC_INTERN PetscErrorCode PCAinsworthJudge_Private(PC, PC_Ainsworth *, PetscBool, KSPConvergedReason, const AinsworthSolver &, PetscBool, AinsworthSaddleVec,
                                                     AinsworthSaddleVec, AinsworthSaddleVec, AinsworthVerdict *, char[], size_t);
PETSC_INTERN PetscErrorCode PCAinsworthExplain_Private(PC, PC_Ainsworth *, KSP, Vec, KSPConvergedReason, char[], size_t);
PETSC_INTERN PetscErrorCode PCAinsworthRayleighQuotient_Private(const PC_Ainsworth *, Vec, PetscReal *);
PETSC_INTERN PetscErrorCode PCAinsworthTry_Private(PC, PC_Ainsworth *, KSPConvergedReason *, PetscInt *, PetscReal *, char[], size_t);
PETSC_INTERN PetscErrorCode PCAinsworthDiagnosePassed_Private(const PC_Ainsworth *, AinsworthDiagnosis *);
PETSC_INTERN PetscErrorCode PCAinsworthDiagnoseBlocks_Private(const PC_Ainsworth *, AinsworthDiagnosis *);
PETSC_INTERN PetscErrorCode PCAinsworthDiagnose_Private(PC, PC_Ainsworth *, PCAinsworthStage);
PETSC_INTERN PetscErrorCode PCAinsworthDiagnoseFailure_Private(PC, PC_Ainsworth *, PetscErrorCode, const char[]);
PETSC_INTERN PetscErrorCode PCAinsworthDiagnoseFromOptions_Private(PC, PC_Ainsworth *, AinsworthOptionItems);
PETSC_INTERN PetscErrorCode PCAinsworthFail_Private(PC, PC_Ainsworth *, PCFailedReason, PetscErrorCode, const char[]);

/* pcplan.cpp: what the inner solver is, and what comes after it */
PETSC_INTERN PetscErrorCode PCAinsworthPlan_Private(PC, const PC_Ainsworth *, AinsworthPlan *);
PETSC_INTERN PetscErrorCode PCAinsworthNextRung_Private(PC, const PC_Ainsworth *, AinsworthEnd, AinsworthLadderStep *);
PETSC_INTERN PetscErrorCode PCAinsworthReview_Private(PC, PC_Ainsworth *);
PETSC_INTERN PetscErrorCode PCAinsworthRememberFactor_Private(PC_Ainsworth *, AinsworthTried, const char[]);
PETSC_INTERN PetscErrorCode PCAinsworthMeasure_Private(const PC_Ainsworth *, PetscInt *, PetscReal *);
PETSC_INTERN PCType         PCAinsworthInnerType_Private(const PC_Ainsworth *, AinsworthPreconditioner);
/* innermethod.cpp */
PETSC_INTERN KSPType        PCAinsworthMethodType_Private(AinsworthMethod);
PETSC_INTERN PetscErrorCode PCAinsworthSetMethod_Private(PCAinsworthInner *, KSPType);
PETSC_INTERN PetscErrorCode PCAinsworthForgetNorm_Private(PCAinsworthInner *);
PETSC_INTERN PetscErrorCode PCAinsworthChooseNorm_Private(PCAinsworthInner *);
PETSC_INTERN PetscErrorCode PCAinsworthKeepCoefficients_Private(PCAinsworthInner *);
/* pcpmat.cpp, pcinner.cpp */
PETSC_INTERN PetscErrorCode PCAinsworthSetUpPmat_Private(PC_Ainsworth *, PC, PetscInt *);
PETSC_INTERN PetscErrorCode PCAinsworthSetUpInner_Private(PC, PC_Ainsworth *, PetscBool, AinsworthEnd *, char[], size_t);
PETSC_INTERN PetscErrorCode PCAinsworthChangeMethod_Private(PC, PC_Ainsworth *, AinsworthEnd *);
/* escape.cpp, escapecost.cpp */
PETSC_INTERN PetscErrorCode PCAinsworthWatchBegin_Private(PC, PC_Ainsworth *, PCAinsworthWatch *);
PETSC_INTERN PetscErrorCode PCAinsworthWatchEnd_Private(PCAinsworthWatch *);
PETSC_INTERN PetscErrorCode PCAinsworthEscapeFacts_Private(PC_Ainsworth *, PetscInt, PetscReal);
PETSC_INTERN PetscErrorCode PCAinsworthEscapeCost_Private(PC_Ainsworth *);
/* pcladder.cpp */
PETSC_INTERN PetscErrorCode PCAinsworthReplan_Private(PC, PC_Ainsworth *, AinsworthEnd, const char[], PetscBool *);

#endif
