/* Error against run time of the reduced solve, one row per iteration, and the decision to stop (docs/report.md) */
#ifndef AINSWORTH_REPORT_H
#define AINSWORTH_REPORT_H

#include <petscainsworth.h>
#include "../operator/matainsworth.h"
#include "estimator.h"
#include <petsctime.h>

/* What ends the reduced solve */
typedef enum {
  AINSWORTH_STOP_RESIDUAL,    /* the convergence test of the inner KSP, on a norm of the residual */
  AINSWORTH_STOP_ENERGY_ERROR /* the estimated energy norm of the error */
} AinsworthStopType;

struct AinsworthReportSettings {
  PetscViewer       viewer; /* NULL for no monitor */
  PetscViewerFormat format;
  Vec               reference; /* exact solution, of length n + m or n; NULL if unknown */
  AinsworthStopType stop;
  PetscReal         rtol;           /* tolerance of the error relative to x */
  char             *monitor, *file; /* options that set viewer and reference; NULL if unset */
  PetscReal         eigenvalue;     /* lower bound of the spectrum; PETSC_DEFAULT to estimate it */
};

/* The reduced system, set by PCAINSWORTH */
struct AinsworthReportSystem {
  Mat      A, C;            /* C has no rows if there are no constraints */
  Mat      reduced;         /* the reduced operator; NULL without constraints */
  IS       primal;          /* field of x in the solution of the saddle-point system */
  PetscInt size;            /* of that solution */
  Vec      inverseDiagonal; /* diag(A)^{-1} */
};

/* NAN if unknown */
struct AinsworthReportRow {
  PetscReal seconds, natural, primal, constraint, error, multipliers;
};

struct AinsworthReport {
  AinsworthReportSettings        *settings;
  AinsworthReportSystem           system;
  PetscBool                       estimate; /* the method is conjugate gradients, and its operator is observed to get the coefficients */
  PetscBool                       kernel;   /* it iterates in Ker C: the products with A are observed */
  PetscBool                       watch;    /* there is a monitor, or the error ends the solve */
  PetscBool                       patient;  /* the convergence test is PETSc's own: stagnation ends the solve, too */
  PetscBool                       tighten;  /* the convergence test is PETSc's own, in the natural norm: its tolerance is made relative to x */
  AinsworthEstimator              estimator;
  std::vector<AinsworthReportRow> rows;
  size_t                          printed;
  Vec                             exact; /* exact x; NULL if unknown */
  AinsworthSaddleVec              b;     /* f and g of the current solve, borrowed */
  Vec                             x, r, residual;
  AinsworthSaddleVec              springs;          /* x and lambda of an iterate if D is nonzero; NULL until needed */
  PetscReal                       norm[2];          /* of f and g */
  PetscReal                       held;             /* norm of C' lambda of the exact solution, in that of diag(A)^{-1} */
  PetscReal                       energy;           /* energy norm of x, as far as it is known */
  PetscReal                       bound;            /* error that ends the solve */
  PetscReal                       least;            /* residual norm when it was last at least halved */
  PetscInt                        found;            /* the iteration then */
  PetscInt                        patience;         /* iterations allowed until it is halved again */
  PetscBool                       wentOn;           /* because the residual was not small relative to x */
  PetscInt                        solve;            /* its number among those that the viewer shows */
  Vec                             work[2];          /* NULL until needed */
  PetscLogDouble                  start;            /* time when this solve began, minus the time of its set-up */
  PetscLogDouble                  spent, observing; /* seconds spent in the report and in the observer */

  /* what to restore in the KSP */
  PetscBool installed;
  Mat       operation, observed; /* the method's operator and its observer */
  void     *test;
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  AinsworthTestDestroyFn *destroy;
};

PetscErrorCode AinsworthReportCreate(AinsworthReportSettings *, const AinsworthReportSystem *, AinsworthReport **);
PetscErrorCode AinsworthReportDestroy(AinsworthReport **);
/* start: time when the solve began, minus the seconds of its set-up */
PetscErrorCode AinsworthReportBegin(AinsworthReport *, KSP, AinsworthSaddleVec b, PetscLogDouble start);
PetscErrorCode AinsworthReportEnd(AinsworthReport *, KSP, PetscBool failed);

/* errors.cpp; the first gets x of an iterate of the reduced solve, which differs from the iterate if D is nonzero; borrowed */
PetscErrorCode AinsworthReportGetX(AinsworthReport *, Vec iterate, Vec *x);
PetscErrorCode AinsworthReportSizes(AinsworthReport *);
PetscErrorCode AinsworthReportResiduals(AinsworthReport *, Vec iterate, AinsworthReportRow *);
PetscErrorCode AinsworthReportTrueError(AinsworthReport *, Vec iterate, PetscReal *error);

/* stop.cpp */
PetscErrorCode AinsworthReportSetPatience(AinsworthReport *, KSP);
/* Decides whether the solve ends, by the result of its own convergence test and by the estimated error, both relative to x */
PetscErrorCode AinsworthReportSmallestRitzValue(KSP, PetscReal *);
PetscErrorCode AinsworthReportStop(AinsworthReport *, KSP, PetscInt step, PetscReal norm, KSPConvergedReason *);

/* Viewer output: a row as soon as its error is known, all rows at the end */
PetscErrorCode AinsworthReportHeader(AinsworthReport *);
PetscErrorCode AinsworthReportPrint(AinsworthReport *, PetscBool all);
PetscErrorCode AinsworthReportDraw(AinsworthReport *);

#endif
