/* Error against run time while the reduced system is solved: one row per iteration, and the decision to stop (docs/report.md) */
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
  PetscViewer       viewer; /* NULL: no monitor */
  PetscViewerFormat format;
  Vec               reference; /* exact solution, of length n + m or n; NULL: none */
  AinsworthStopType stop;
  PetscReal         rtol;           /* of the error, relative to x */
  char             *monitor, *file; /* the options that viewer and reference come from; NULL: none */
  PetscReal         eigenvalue;     /* lower bound of the spectrum; PETSC_DEFAULT: estimated */
};

/* The reduced system, as PCAINSWORTH knows it */
struct AinsworthReportSystem {
  Mat      A, C;            /* C without rows: no constraints */
  Mat      reduced;         /* the reduced operator; NULL without constraints */
  IS       primal;          /* field of x in the solution of the saddle-point system */
  PetscInt size;            /* of that solution */
  Vec      inverseDiagonal; /* diag(A)^{-1} */
};

/* NAN: not known */
struct AinsworthReportRow {
  PetscReal seconds, natural, primal, constraint, error;
};

struct AinsworthReport {
  AinsworthReportSettings        *settings;
  AinsworthReportSystem           system;
  PetscBool                       estimate; /* the Krylov method has the coefficients of conjugate gradients, of which its operator is observed */
  PetscBool                       kernel;   /* it iterates in Ker C: of its operator, the products with A are observed */
  PetscBool                       watch;    /* there is a monitor, or the error ends the solve */
  PetscBool                       patient;  /* the convergence test is PETSc's own: a residual that no longer falls ends the solve, too */
  PetscBool                       tighten;  /* the convergence test is PETSc's own, in the natural norm: its tolerance comes to refer to x */
  AinsworthEstimator              estimator;
  std::vector<AinsworthReportRow> rows;
  size_t                          printed;
  Vec                             exact; /* solution; NULL: not known */
  AinsworthSaddleVec              b;     /* f and g of the present solve, not owned */
  Vec                             x, r, residual;
  AinsworthSaddleVec              springs;          /* x and lambda of an iterate where D is not zero; NULL: not needed yet */
  PetscReal                       norm[2];          /* of f and g */
  PetscReal                       energy;           /* energy norm of x, as far as it is known */
  PetscReal                       bound;            /* error that ends the solve */
  PetscReal                       least;            /* residual norm, halved at least since the last such */
  PetscInt                        found;            /* the iteration of that norm */
  PetscInt                        patience;         /* iterations without half of it */
  PetscBool                       wentOn;           /* for the sake of x */
  PetscInt                        solve;            /* its number, among those that the viewer shows */
  Vec                             work[2];          /* NULL: not needed yet */
  PetscLogDouble                  start;            /* the time when this solve began, less its set-up */
  PetscLogDouble                  spent, observing; /* seconds of the report itself, and of the observed operator */

  /* what the solve had before */
  PetscBool installed;
  Mat       operation, observed; /* what the method multiplies by, and what takes its place */
  void     *test;
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *);
  AinsworthTestDestroyFn *destroy;
};

PetscErrorCode AinsworthReportCreate(AinsworthReportSettings *, const AinsworthReportSystem *, AinsworthReport **);
PetscErrorCode AinsworthReportDestroy(AinsworthReport **);
/* start: the time when the solve began, less the seconds of its set-up */
PetscErrorCode AinsworthReportBegin(AinsworthReport *, KSP, AinsworthSaddleVec b, PetscLogDouble start);
PetscErrorCode AinsworthReportEnd(AinsworthReport *, KSP, PetscBool failed);

/* x of an iterate of the reduced solve, which is another where D is not zero; not to be destroyed */
PetscErrorCode AinsworthReportGetX(AinsworthReport *, Vec iterate, Vec *x);
PetscErrorCode AinsworthReportSetPatience(AinsworthReport *, KSP);
/* Whether the solve ends here, by what its own convergence test says of a residual and by the estimated error: both refer to x */
PetscErrorCode AinsworthReportStop(AinsworthReport *, KSP, PetscInt step, PetscReal norm, KSPConvergedReason *);

/* What the viewer shows: a row as soon as its error is known, at the end all of them */
PetscErrorCode AinsworthReportHeader(AinsworthReport *);
PetscErrorCode AinsworthReportPrint(AinsworthReport *, PetscBool all);
PetscErrorCode AinsworthReportDraw(AinsworthReport *);

#endif
