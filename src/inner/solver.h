/* The solver of the reduced system: what it is, its preconditioner, its operators, its price and its age */
#ifndef AINSWORTH_SOLVER_H
#define AINSWORTH_SOLVER_H

#include <petscainsworth.h>
#include "../saddle/saddle.h"
#include "../multigrid/fingerprint.h"
#include "pmat.h"
#include "age.h"
#include "plan.h"
#include "prices.h"
#include "../projection/deflation.h"
#include "../projection/reduced.h"
#include "../projection/symbolic.h"
#include "../refine/refine.h"
#include "../report/report.h"

/* Presets of weight, penalty, penalty factor, row scaling, and inner Krylov method */
typedef enum {
  PC_AINSWORTH_WEIGHTED, /* W = diag(A)^{-1}, one penalty per row, KSPPROJECTEDCG */
  PC_AINSWORTH_PAPER     /* W = I, one penalty beta, KSPCG: Robert, Jolivet, Jamond, Badri, sections 3 and 4 */
} PCAinsworthVariant;
PETSC_INTERN const char *const PCAinsworthVariants[];

/* When the inner preconditioner is rebuilt for other values of A or C */
typedef enum {
  AINSWORTH_REBUILD_AUTO, /* when it costs more iterations than a set-up */
  AINSWORTH_REBUILD_ALWAYS,
  AINSWORTH_REBUILD_NEVER
} AinsworthRebuildType;
PETSC_INTERN const char *const PCAinsworthRebuildTypes[];

/* Which matrix the inner preconditioner was made for */
typedef enum {
  PC_AINSWORTH_AGE_FRESH,  /* the present one */
  PC_AINSWORTH_AGE_LEVELS, /* its coarser levels are of an earlier A */
  PC_AINSWORTH_AGE_WHOLE   /* an earlier one: PCSetReusePreconditioner() */
} PCAinsworthAgeType;

/* What options and calls choose, compared as a whole: setting the same choices again rebuilds nothing */
struct AinsworthChoices {
  PCAinsworthVariant     variant     = {};
  MatAinsworthWeightType weightType  = {};
  Vec                    weight      = NULL; /* of length n, for MAT_AINSWORTH_WEIGHT_USER; NULL until it is set */
  AinsworthGramChoices   gram;
  AinsworthRedundantType redundant   = {};
  AinsworthRung          ladder      = AINSWORTH_RUNG_WHOLE; /* the highest rung that may be climbed */
  AinsworthRebuildType   rebuild     = {};
  /* factor PETSC_DEFAULT depends on the types of penalty and approximation; symmetric is set by set-up */
  AinsworthPmatOptions pmat = {};
};

/* Energies of a motion, relative to that of diag(A), for the words of a failure: none, and negative beyond rounding */
static const PetscReal AinsworthNoEnergy = PETSC_MACHINE_EPSILON / AinsworthUndetermined, AinsworthNegative = -1e-12;

/* The solver of the reduced system */
struct AinsworthInner {
  KSP                 ksp = NULL;
  AinsworthPlan       plan;                     /* what it is, and which of its parts we chose */
  PetscBool           configured = PETSC_FALSE; /* defaults are set and options read */
  AinsworthRef<Mat>   M;                        /* the preconditioning matrix */
  PCAinsworthPmatType autoType   = {};          /* type of M that auto chose */
  const char         *autoReason = NULL;        /* why; NULL before it chose */
  AinsworthPmatFormat format     = {};          /* of M; depends on the type of its preconditioner */
  PetscInt            longRows   = 0;           /* number of rows of C left out of M */
  /* of the unknowns, on rank 0: the next factorization of M uses it; NULL until it is found */
  AinsworthRef<IS>  order;
  PetscInt          coefficients = 0;      /* iterations of which conjugate gradients can keep them */
  AinsworthLeftOut  left;                  /* what M leaves out, and conjugate gradients add */
  PetscBool         springs = PETSC_FALSE; /* M includes the springs of D */
  AinsworthRef<Mat> operation;             /* the operator in Ker C; NULL if the method does not iterate there */
  /* takes the place of the preconditioner during a solve; NULL before set-up */
  AinsworthRef<PC> around;
};

/* The age of the inner preconditioner (rebuild.cpp) */
struct AinsworthSolverAge {
  PCAinsworthAgeType type = {};
  /* it is kept because the program set PCSetReusePreconditioner() on this PC */
  PetscBool            forProgram = PETSC_FALSE;
  PetscBool            ownReuse   = PETSC_FALSE; /* the program's own PCSetReusePreconditioner() of the inner PC */
  AinsworthAge         counts;
  AinsworthFingerprint source; /* the C for which a preconditioner that is kept as a whole was made */
};

/* A factorization of M_* in place of multigrid, by our choice (escape.cpp) */
struct AinsworthEscape {
  PetscInt  n        = 0;   /* size of A when it was chosen, or failed */
  PetscReal entries  = 0.0; /* of A then */
  char      why[256] = {};  /* reason for the choice */
  /* for this set-up, as far as they were asked for: without unknowns none, without fill not those of a factorization */
  AinsworthPriceFacts facts;
  AinsworthSeries     series; /* the current solve */
};

/*
   A reduced solve that a factorization may end; it is watched if `converged` is set, the method's own convergence test
   (escape.cpp)
*/
struct AinsworthWatch {
  struct AinsworthSolver *solver  = NULL;
  AinsworthEnd            end     = {}; /* AINSWORTH_END_DEAR if it was ended */
  void                   *test    = NULL;
  AinsworthTestDestroyFn *destroy = NULL;

  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *) = NULL;
};

/* Each part is made from those before it */
struct AinsworthSolver {
  AinsworthChoices        choices;
  AinsworthReportSettings settings; /* of the report; they may end a solve */
  AinsworthSaddleStage    saddle;   /* NULL before the first set-up, and after an error in its place */
  AinsworthReducedStage   reduced;  /* likewise */
  AinsworthHistory        history;  /* which solvers this matrix has already seen */
  AinsworthInner          inner;
  AinsworthSolverAge      age;
  AinsworthEscape         escape;
};

/* Returns the operator of the reduced system; NULL without one */
static inline Mat AinsworthSolverReducedMat(const AinsworthSolver *solver)
{
  return solver->reduced ? (Mat)solver->reduced->mat : NULL;
}

/* Returns the prefix of the options of the inner solver */
static inline const char *AinsworthSolverPrefix(const AinsworthSolver *solver)
{
  const char *prefix;

  (void)KSPGetOptionsPrefix(solver->inner.ksp, &prefix);
  return prefix;
}

/* Returns the type of an object; NULL if it has none yet */
static inline const char *AinsworthTypeName(PetscObject object)
{
  const char *type;

  (void)PetscObjectGetType(object, &type);
  return type;
}

/* Returns the bytes of a factor, infinite if its entries cannot be numbered */
static inline PetscReal AinsworthFactorBytes(const AinsworthCost *cost)
{
  return cost->entries <= (PetscReal)PETSC_MAX_INT ? cost->entries * (PetscReal)sizeof(PetscScalar) : PETSC_INFINITY;
}

/* facts.cpp: what the plan goes by */
PETSC_INTERN PCType         AinsworthSolverInnerType(const AinsworthSolver *, AinsworthPreconditioner);
PETSC_INTERN PetscErrorCode AinsworthSolverPlan(PC, const AinsworthSolver *, AinsworthPlan *);
PETSC_INTERN PetscErrorCode AinsworthSolverNextRung(PC, const AinsworthSolver *, AinsworthEnd, AinsworthLadderStep *);
PETSC_INTERN PetscErrorCode AinsworthSolverMeasure(const AinsworthSolver *, PetscInt *, PetscReal *);
PETSC_INTERN PetscErrorCode AinsworthSolverRememberFactor(AinsworthSolver *, AinsworthTried, const char[]);
PETSC_INTERN PetscErrorCode AinsworthSolverReview(PC, AinsworthSolver *);
PETSC_INTERN PetscBool      AinsworthSolverReadsOptions(PC);
PETSC_INTERN PetscErrorCode AinsworthSolverForgetFailure(PC);
/* options.cpp: options and defaults */
PETSC_INTERN PetscErrorCode AinsworthSolverConfigureKSP(PC, AinsworthSolver *);
PETSC_INTERN PetscErrorCode AinsworthSolverGetPmatFormat(AinsworthSolver *, AinsworthPmatFormat *);
/* method.cpp: the method, its norm and its side */
PETSC_INTERN PetscErrorCode AinsworthSolverIsConjugateGradients(KSPType, PetscBool *);
PETSC_INTERN KSPType        AinsworthSolverMethodType(AinsworthMethod);
PETSC_INTERN PetscErrorCode AinsworthSolverForgetNorm(AinsworthInner *);
PETSC_INTERN PetscErrorCode AinsworthSolverChooseNorm(AinsworthInner *);
PETSC_INTERN PetscErrorCode AinsworthSolverSetMethod(AinsworthInner *, KSPType);
PETSC_INTERN PetscErrorCode AinsworthSolverKeepCoefficients(AinsworthInner *);
PETSC_INTERN PetscErrorCode AinsworthSolverGetReason(const AinsworthSolver *, PetscBool, KSPConvergedReason *);
/* operators.cpp: what it iterates with */
PETSC_INTERN PetscErrorCode AinsworthSolverUseProduct(AinsworthSolver *);
PETSC_INTERN PetscErrorCode AinsworthSolverLooksDefinite(const AinsworthSolver *, Mat, PetscBool *);
PETSC_INTERN PetscErrorCode AinsworthSolverReuseInner(AinsworthSolver *, PetscBool);
PETSC_INTERN PetscErrorCode AinsworthSolverAfterError(AinsworthSolver *);
PETSC_INTERN PetscErrorCode AinsworthSolverResetKSP(AinsworthSolver *);
PETSC_INTERN PetscErrorCode AinsworthSolverIteratesInKernel(AinsworthSolver *, PetscBool *);
PETSC_INTERN PetscErrorCode AinsworthSolverForgetOperators(AinsworthInner *);
PETSC_INTERN PetscErrorCode AinsworthSolverSetKSPOperators(AinsworthSolver *);
PETSC_INTERN PetscErrorCode AinsworthSolverGetInnerPC(const AinsworthSolver *, PC *);
PETSC_INTERN PetscErrorCode AinsworthSolverEnter(AinsworthSolver *, KSP, Vec);
PETSC_INTERN PetscErrorCode AinsworthSolverLeave(const AinsworthSolver *, KSP);
/* matrix.cpp: M_* */
PETSC_INTERN PetscErrorCode      AinsworthSolverSetUpPmat(AinsworthSolver *, PC, PetscInt *);
PETSC_INTERN PetscErrorCode      AinsworthSolverSetUpAlone(AinsworthSolver *, PC);
PETSC_INTERN PCAinsworthPmatType AinsworthSolverPmatTypeInUse(const AinsworthSolver *);
PETSC_INTERN PetscReal           AinsworthSolverPenaltyFactor(const AinsworthSolver *);
/* setup.cpp: set-up */
PETSC_INTERN PetscErrorCode AinsworthSolverSetUpInner(PC, AinsworthSolver *, PetscBool, AinsworthEnd *, char[], size_t);
PETSC_INTERN PetscErrorCode AinsworthSolverChangeMethod(PC, AinsworthSolver *, AinsworthEnd *);
/* factored.cpp: factorizations of M_* */
PETSC_INTERN PCType         AinsworthSolverFactorType(const AinsworthSolver *, MatSolverType *);
PETSC_INTERN PetscErrorCode AinsworthSolverLeastMemory(MPI_Comm, PetscReal *);
PETSC_INTERN PetscErrorCode AinsworthSolverChoosePackage(const AinsworthSolver *, PC);
PETSC_INTERN PetscErrorCode AinsworthSolverOrderPmat(AinsworthSolver *, const std::vector<Mat> &, AinsworthCost *);
PETSC_INTERN PetscErrorCode AinsworthSolverConvertPmat(AinsworthSolver *);
PETSC_INTERN PetscErrorCode AinsworthSolverSetUpPreconditioner(AinsworthSolver *, PC, PetscBool *);
/* rebuild.cpp: when the preconditioner is rebuilt */
PETSC_INTERN PetscBool      AinsworthSolverMustKeepInner(PC, const AinsworthSolver *);
PETSC_INTERN PetscErrorCode AinsworthSolverDecideToKeepInner(PC, const AinsworthSolver *, PetscBool *);
PETSC_INTERN PetscErrorCode AinsworthSolverLimit(PC, const AinsworthSolver *, PetscInt *);
PETSC_INTERN PetscErrorCode AinsworthSolverCount(AinsworthSolver *);
PETSC_INTERN PetscErrorCode AinsworthSolverViewRebuild(const AinsworthSolver *, PetscViewer);
/* cost.cpp: what things cost */
PETSC_INTERN PetscReal      AinsworthSolverEscapePrice(const AinsworthSolver *);
PETSC_INTERN PetscErrorCode AinsworthSolverEscapeFacts(AinsworthSolver *, PetscInt, PetscReal);
PETSC_INTERN PetscErrorCode AinsworthSolverEscapeCost(AinsworthSolver *);
/* escape.cpp: a solve that a factorization may end */
PETSC_INTERN PetscErrorCode AinsworthSolverWatchBegin(PC, AinsworthSolver *, AinsworthWatch *);
PETSC_INTERN PetscErrorCode AinsworthSolverWatchEnd(AinsworthWatch *);
/* motion.cpp: energies of motions */
PETSC_INTERN PetscErrorCode AinsworthSolverRayleighQuotient(const AinsworthSolver *, Vec, PetscReal *);

#endif
